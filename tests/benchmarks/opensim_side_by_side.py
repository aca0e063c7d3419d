"""OpenSim's CMC beside this package's CMC, with either prediction, and CSF: the same model, motion,
window and machine.

    pip install -e ".[test,opensim]"    # or, beside the package, pip install opensim
    python -m tests.benchmarks.opensim_side_by_side [--cases NAME ...] [--json FILE]

from the repository's root, with OpenSim's CMC cases in `../shared/opensim/cmc`; that of
gait10dof18musc in a clone of opensim-core, which `--core FOLDER` names. Prints a table for each
case and asserts nothing.

- CPU seconds are those of the run, without imports and loading the model. OpenSim runs once, in a
  new process; our methods once more after a first run, which compiles their kernels.
- Simulated seconds are those of the result: OpenSim leaves out the first 30 ms and the last window.
- Tracking errors are root mean squares over each one's own points: OpenSim's over the starts of its
  windows (`pErr.sto`), ours over all accepted steps.
- The replay's error is the largest difference of any coordinate from the run whose excitations were
  replayed: OpenSim's by its ForwardTool with the set-up's tolerances, ours by `forward_dynamics`.
"""

import argparse
import dataclasses
import importlib.util
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

import exudyn_muscles as em
from exudyn_muscles.files.disk import write_file

from ..opensim import REFERENCE
from .opensim_cmc import REPORT, RESULTS

FILES = REFERENCE.parent / "cmc"
CORE = "Applications/CMC/tests/resources"  # of opensim-core
OPENSIM_SIDE = Path(__file__).with_name("opensim_cmc.py")


class Case(NamedTuple):
    """One run: a folder of `FILES`, its set-up file, the span [s] and what makes its motion."""

    folder: str
    setup: str
    span: tuple[float, float]
    motion_setup: str | None = None


CASES = {
    "twoMusclesOnBlock": Case(
        "twoMusclesOnBlock", "twoMusclesOnBlock_Setup_CMC.xml", (0.0, 1.0),
        "twoMusclesOnBlock_Setup_Forward.xml",
    ),
    "arm26": Case("arm26", "arm26_Setup_CMC.xml", (0.0, 1.0)),  # of std_arm26_states.sto
    "arm26_short": Case("arm26", "arm26_Setup_CMC.xml", (0.4, 0.65)),  # of its set-up file
    "leg6dof9musc_stance": Case("leg6dof9musc_stance", "leg69_Setup_CMC_Stance.xml", (0.8, 1.0)),
    "gait10dof18musc": Case(CORE, "gait10dof18musc_Setup_CMC.xml", (0.6, 0.9)),
    "gait2354": Case("gait2354", "subject01_Setup_CMC.xml", (0.8, 1.2)),  # OpenSim takes minutes
}  # fmt: skip


class Run(NamedTuple):
    """What is compared of one method's run; errors per coordinate [rad or m]."""

    cpu_time: float
    span: tuple[float, float]
    tracking_rms: dict[str, float]
    replay_error: dict[str, float]

    @property
    def simulated(self):
        """Simulated seconds."""
        return self.span[1] - self.span[0]

    @property
    def load(self):
        """CPU seconds per simulated second."""
        return self.cpu_time / self.simulated


def run_opensim(case, folder):
    """OpenSim's CMC and its replay, in a process of their own."""
    command = [sys.executable, str(OPENSIM_SIDE), case.setup, *map(str, case.span)]
    if case.motion_setup is not None:
        command.append(case.motion_setup)
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"OpenSim failed with {case.setup}:\n{done.stdout}{done.stderr}")
    report = json.loads((folder / REPORT).read_text())
    states = em.read_storage(folder / RESULTS / "states.sto")
    replayed = em.read_storage(folder / RESULTS / "replay.sto")
    errors = em.read_storage(folder / RESULTS / "errors.sto")
    span = float(states.time[0]), float(states.time[-1])
    tracked = errors.values[errors.time >= span[0]]
    rms = np.sqrt(np.mean(tracked**2, axis=0))
    replay_error = {
        name: float(np.abs(coordinate(replayed, name)(states.time) - at(states.time)).max())
        for name, at in ((name, coordinate(states, name)) for name in errors.labels)
    }
    return Run(
        report["cpu_time"], span, dict(zip(errors.labels, rms.tolist(), strict=True)), replay_error
    )


def coordinate(states, name):
    """A coordinate of a states file as a function of time, by its values and speeds."""
    value, speed = (
        next(j for j, label in enumerate(states.labels) if label.endswith(f"/{name}/{kind}"))
        for kind in ("value", "speed")
    )
    return CubicHermiteSpline(states.time, states.values[:, value], states.values[:, speed])


def run_ours(method, setup):
    """One of our methods, after a first run that compiles."""
    method(setup)
    result = method(setup)
    steps = em.ForwardSettings(step=setup.settings.step)
    replayed = em.forward_dynamics(setup.model, result.excitations, settings=steps)
    return Run(
        result.cpu_time,
        (float(result.time[0]), float(result.time[-1])),
        named(result, result.tracking_error_rms()),
        named(result, replay_errors(result, replayed)),
    )


def named(result, values):
    return dict(zip(result.coordinate_names, values.tolist(), strict=True))


def replay_errors(result, replayed):
    """Largest differences (n,) at the result's own times, which the replay's steps contain."""
    at = np.searchsorted(replayed.time, result.time - 1e-9)
    if not np.allclose(replayed.time[at], result.time, rtol=0.0, atol=1e-9):
        raise SystemExit("the replay's steps do not meet those of the run")
    return np.abs(replayed.coordinates[at] - result.coordinates).max(axis=0)


def cmc(setup):
    return em.computed_muscle_control(setup.model, setup.motion, settings=setup.settings)


def shifted(setup):
    settings = dataclasses.replace(setup.settings, prediction=em.Prediction.SHIFTED)
    return em.computed_muscle_control(setup.model, setup.motion, settings=settings)


def csf(setup):
    settings = setup.cosimulation(em.Scheme.FULL)
    return em.cosimulate(setup.model, setup.motion, settings=settings)


def compare(case, source, folder):
    """All runs of a case, on a copy of its files: OpenSim writes where they are."""
    shutil.copytree(source, folder)
    runs = {"OpenSim CMC": run_opensim(case, folder)}
    start, end = case.span
    setup = em.opensim.load_setup(folder / case.setup, initial_time=start, final_time=end)
    ours = {"CMC": cmc, "CMC, shifted": shifted, "CSF": csf}
    return runs | {label: run_ours(method, setup) for label, method in ours.items()}


def table(runs):
    """Rows of text, a method each."""
    names = [name for name in runs["CSF"].tracking_rms if name in runs["OpenSim CMC"].tracking_rms]
    head = ["", "CPU s", "simulated s", "CPU s per s", "OpenSim / this", "replay error"]
    rows = [head + [f"RMS {name}" for name in names]]
    slowest = runs["OpenSim CMC"].cpu_time
    for label, run in runs.items():
        errors = (f"{run.tracking_rms[name]:.2e}" for name in names)
        rows.append([
            label, f"{run.cpu_time:.3f}", f"{run.simulated:.3f}", f"{run.load:.3f}",
            f"{slowest / run.cpu_time:.1f}", f"{max(run.replay_error.values()):.1e}", *errors,
        ])  # fmt: skip
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in rows
    ]


def machine():
    packages = ("opensim", "exudyn_muscles", "exudyn", "numpy", "numba")
    return {
        "platform": platform.platform(),
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "versions": {package: version(package) for package in packages},
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), metavar="NAME",
                        help=f"of {', '.join(CASES)}; default all")  # fmt: skip
    parser.add_argument("--core", type=Path, metavar="FOLDER", help="clone of opensim-core")
    parser.add_argument("--json", type=Path, metavar="FILE", help="store the numbers")
    arguments = parser.parse_args()
    if arguments.core is None and arguments.cases == list(CASES):
        arguments.cases.remove("gait10dof18musc")
    sources = {
        name: (arguments.core or Path() if CASES[name].folder == CORE else FILES)
        / CASES[name].folder
        for name in arguments.cases
    }
    if importlib.util.find_spec("opensim") is None:
        parser.exit(2, "OpenSim's Python package is not installed: pip install opensim\n")
    for folder in sources.values():
        if not folder.is_dir():
            parser.exit(2, f"OpenSim's CMC cases are not beside this repository: no {folder}\n")
    if arguments.json is not None and not arguments.json.parent.is_dir():
        parser.error(f"--json: no folder {arguments.json.parent}")
    found = {}
    for name in arguments.cases:
        case = CASES[name]
        with tempfile.TemporaryDirectory() as folder:
            found[name] = compare(case, sources[name], Path(folder, name))
        print(f"{name}, {case.span[0]:g} to {case.span[1]:g} s", *table(found[name]), "", sep="\n")
    if arguments.json is not None:
        content = {
            "machine": machine(),
            "cases": {
                name: {
                    label: run._asdict() | {"cpu_time_per_simulated_second": run.load}
                    for label, run in runs.items()
                }
                for name, runs in found.items()
            },
        }
        write_file(arguments.json, (json.dumps(content, indent=2) + "\n").encode())
        print(f"wrote {arguments.json}")


if __name__ == "__main__":
    main()
