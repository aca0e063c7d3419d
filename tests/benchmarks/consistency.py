"""How far a replay is off the motion that its excitations were found for: CSF, CMC and consistent
co-simulation, the table of `docs/consistent.md`.

    python -m tests.benchmarks.consistency [NAME ...]

from the repository's root; rows whose files are in `../shared` are left out where it is absent.
Asserts nothing. Drift is the largest difference of any coordinate from the replay by
`forward_dynamics` at 0.2 ms, RMS the largest tracking error of any coordinate [rad or m]; CPU is
the best of three runs.
"""

import importlib.util
import shutil
import sys
import tempfile
import warnings
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

import exudyn_muscles as em
from models import leg, pedalling, pendulum, planar_arm

from ..opensim import REFERENCE
from ..skeleton.system.convert import as_bodies
from ..skeleton.system.models import MOTION, Arm, spring_hand, wobbling_mass

SHARED = REFERENCE.parents[1]
RUNS = 3


class Row(NamedTuple):
    """A model, its motion, settings of CMC and CSF; drift is looked at up to `until`."""

    model: em.MusculoskeletalModel
    motion: em.Motion
    cmc: em.CMCSettings
    csf: em.CosimulationSettings
    until: float = np.inf


def of_gain(model, motion, kp, until=np.inf):
    return Row(
        model,
        motion,
        em.CMCSettings(kp=kp),
        em.CosimulationSettings(scheme=em.Scheme.FULL, kp=kp),
        until,
    )


def squat():
    path = SHARED / "cases" / "squat_leg.py"
    spec = importlib.util.spec_from_file_location("squat_leg", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return of_gain(module.build(), module.motion(), 100.0, 0.75)


def published(folder, setup, span=None):
    with tempfile.TemporaryDirectory() as work:
        there = Path(work) / folder
        shutil.copytree(REFERENCE.parent / "cmc" / folder, there)
        times = {} if span is None else {"initial_time": span[0], "final_time": span[1]}
        case = em.opensim.load_setup(there / setup, **times)
    return Row(case.model, case.motion, case.settings, case.cosimulation(em.Scheme.FULL))


ARM26 = "arm26", "arm26_Setup_CMC.xml"
ROWS = {
    "pendulum, kp 534": lambda: of_gain(pendulum.build(), pendulum.motion(), 534.0),
    "planar_arm, kp 534": lambda: of_gain(planar_arm.build(), planar_arm.motion(), 534.0),
    "squatting leg, kp 100, to 0.75 s": squat,
    "leg, kp 534": lambda: of_gain(leg.build(), leg.motion(), 534.0),
    "leg, kp 100": lambda: of_gain(leg.build(), leg.motion(), 100.0),
    "arm26, 1 s": lambda: published(*ARM26, (0.0, 1.0)),
    "arm26, 0.40 to 0.65 s": lambda: published(*ARM26, (0.4, 0.65)),
    "leg6dof9musc, stance": lambda: published(
        "leg6dof9musc_stance", "leg69_Setup_CMC_Stance.xml", (0.8, 1.0)
    ),
    "gait2354, 0.8 to 1.2 s": lambda: published("gait2354", "subject01_Setup_CMC.xml"),
    "pedalling, kp 100": lambda: of_gain(pedalling.build(), pedalling.motion(), 100.0),
    "pendulum of bodies, kp 534": lambda: of_gain(
        as_bodies(pendulum.build()), pendulum.motion(), 534.0
    ),
    "planar_arm of bodies, kp 534": lambda: of_gain(
        as_bodies(planar_arm.build()), planar_arm.motion(), 534.0
    ),
    "arm with a wobbling mass": lambda: of_gain(Arm(wobbling_mass).model(), MOTION, 100.0),
    "arm with a sprung hand": lambda: of_gain(Arm(spring_hand).model(), MOTION, 100.0),
}


def drift(row, result):
    replayed = em.forward_dynamics(
        row.model, result.excitations, settings=em.ForwardSettings(step=2e-4)
    )
    at = np.searchsorted(replayed.time, result.time - 1e-9)
    off = np.abs(replayed.coordinates[at] - result.coordinates).max(axis=1)
    return off[result.time <= row.until + 1e-9].max()


def measured(row):
    """Drifts, tracking errors and CPU seconds of CSF, CMC and the consistent scheme."""
    consistent = replace(row.csf, scheme=em.Scheme.CONSISTENT)
    runs = (
        lambda: em.cosimulate(row.model, row.motion, settings=row.csf),
        lambda: em.computed_muscle_control(row.model, row.motion, settings=row.cmc),
        lambda: em.cosimulate(row.model, row.motion, settings=consistent),
    )
    results = [run() for run in runs]  # the first of a process compile kernels
    cpu = np.min([[run().cpu_time for run in runs] for _ in range(RUNS)], axis=0)
    drifts = [drift(row, result) for result in results]
    return drifts, [result.tracking_error_rms().max() for result in results], cpu


def main(names):
    warnings.simplefilter("ignore", em.ExudynMusclesWarning)
    print(
        "| model | drift CSF | CMC | consistent | RMS CSF | CMC | consistent | CPU / CSF | "
        "CPU / CMC |\n|---|---|---|---|---|---|---|---|---|"
    )
    for name in names or ROWS:
        try:
            row = ROWS[name]()
        except OSError as missing:
            print(f"| {name} | left out: {missing.filename} is absent |")
            continue
        drifts, errors, cpu = measured(row)
        numbers = [f"{x:.1e}" for x in (*drifts, *errors)]
        ratios = [f"{cpu[2] / x:.2f}" for x in cpu[:2]]
        print(f"| {name} | {' | '.join([*numbers, *ratios])} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
