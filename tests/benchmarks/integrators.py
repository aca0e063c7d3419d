"""The trapezoidal rule and the Rosenbrock method in whole runs: tables of `docs/muscle_laws.md`.

    python -m tests.benchmarks.integrators [NAME ...]

from the repository's root; rows whose files are in `../shared` are left out where it is absent.
Asserts nothing. In every cell the trapezoidal rule comes first. CPU is the best of three runs, in
alternation, in ms, and the Rosenbrock method's part of it; RMS is the largest tracking error of any
coordinate and drift the largest difference of any coordinate from the replay by `forward_dynamics`
at 0.2 ms [rad or m]; the order is that of CSF's tracking error at steps of 20, 10, 5 and 2.5 ms.
"""

import sys
import warnings
from dataclasses import replace

import numpy as np

import exudyn_muscles as em

from .consistency import ROWS as MODELS
from .consistency import drift, published

RUNS = 3
STEPS = np.array([0.020, 0.010, 0.005, 0.0025])  # s
INTEGRATORS = em.Integrator.TRAPEZOIDAL, em.Integrator.ROSENBROCK
ROWS = MODELS | {
    "running body, its own span": lambda: published(
        "running_test", "runningModel_Setup_CMC_test.xml"
    ),
}


def static(row, integrator):
    limits = row.csf.control_limits
    settings = em.StaticSettings(
        step=row.csf.step, control_limits=limits, integrator=integrator
    )  # fmt: skip
    return em.static_optimization(row.model, row.motion, settings=settings)


def cmc(row, integrator):
    settings = replace(row.cmc, integrator=integrator)
    return em.computed_muscle_control(row.model, row.motion, settings=settings)


def of_scheme(scheme, **changes):
    def run(row, integrator):
        settings = replace(row.csf, scheme=scheme, integrator=integrator, **changes)
        return em.cosimulate(row.model, row.motion, settings=settings)

    return run


METHODS = {
    "static": static,
    "CMC": cmc,
    "CSF": of_scheme(em.Scheme.FULL),
    "CSS": of_scheme(em.Scheme.SIMPLIFIED),
    "consistent": of_scheme(em.Scheme.CONSISTENT),
}


def pair(numbers):
    return ", ".join(f"{x:.2e}" for x in numbers)


def cells(row, name):
    """Text of CPU times, tracking errors and drifts of one method."""
    method, cpu = METHODS[name], np.full(2, np.inf)
    for _ in range(RUNS):
        results = [method(row, integrator) for integrator in INTEGRATORS]
        cpu = np.minimum(cpu, [result.cpu_time for result in results])
    texts = [f"{1e3 * cpu[0]:.0f}, {cpu[1] / cpu[0]:.2f}"]
    if name == "static":
        return [*texts, "-", "-"]
    return [
        *texts,
        pair(result.tracking_error_rms().max() for result in results),
        pair(drift(row, result) for result in results),
    ]


def orders(row):
    """Order of CSF's tracking error with either integrator."""
    found = []
    for integrator in INTEGRATORS:
        errors = [
            of_scheme(em.Scheme.FULL, step=step)(row, integrator).tracking_error_rms().max()
            for step in STEPS
        ]
        found.append(np.polyfit(np.log(STEPS), np.log(errors), 1)[0])
    return found


def main(names):
    warnings.simplefilter("ignore", em.ExudynMusclesWarning)
    print("| model | method | CPU [ms], ratio | RMS | drift |\n|---|---|---|---|---|")
    order = {}
    for name in names or ROWS:
        try:
            row = ROWS[name]()
        except OSError as missing:
            print(f"| {name} | left out: {missing.filename} is absent |")
            continue
        for method in METHODS:
            try:
                texts = cells(row, method)
            except em.ExudynMusclesError as error:
                texts = [str(error)]
            print(f"| {name} | {method} | {' | '.join(texts)} |", flush=True)
        if "kp" in name:
            order[name] = orders(row)
    print("\n| model | order of CSF |\n|---|---|")
    for name, found in order.items():
        print(f"| {name} | {found[0]:.2f}, {found[1]:.2f} |")


if __name__ == "__main__":
    main(sys.argv[1:])
