"""What `speed.py` and the regression guard time: runs of whole models.

Uses only what older versions have as well. Started as a program it serves timings: a line with
names in, a line with CPU seconds out.
"""

import json
import sys
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import exudyn_muscles as em
from models import pendulum

FILES = Path("..", "shared", "opensim", "cmc")  # beside the repository
CORE = Path("Applications", "CMC", "tests", "resources")  # of opensim-core
ANSWER = "timed: "  # before an answer, as Exudyn prints as well


class Case(NamedTuple):
    """A set-up file in a folder, and its span [s] if it is not the file's."""

    folder: Path
    setup: str
    span: dict[str, float] = {}  # noqa: RUF012


SETUPS = {
    "gait2354": Case(
        FILES / "gait2354", "subject01_Setup_CMC.xml", {"initial_time": 0.8, "final_time": 1.2}
    ),
    "gait10dof18musc": Case(
        CORE, "gait10dof18musc_Setup_CMC.xml", {"initial_time": 0.6, "final_time": 0.9}
    ),
    "runningModel": Case(FILES / "running_test", "runningModel_Setup_CMC_test.xml"),
    "Hamner": Case(Path(), "Setup_CMC.xml"),
    "arm26": Case(FILES / "arm26", "arm26_Setup_CMC.xml"),
}
PENDULUM = "pendulum"
SCHEMES = {"CSF": "FULL", "consistent": "CONSISTENT"}


class Timed(NamedTuple):
    """Runs of a model by the names of the methods, and what they simulate [s]."""

    runs: dict[str, Callable[[], list[em.Trajectory]]]
    simulated: float


def timed(name, folder):
    """The runs of one case, whose set-up is below `folder`."""
    if name == PENDULUM:
        return of_pendulum()
    setup = loaded(name, folder)
    model, motion = setup.model, setup.motion

    def cosimulate(scheme):
        return lambda: [em.cosimulate(model, motion, settings=setup.cosimulation(scheme))]

    known = em.Scheme.__members__
    runs = {
        method: cosimulate(known[scheme]) for method, scheme in SCHEMES.items() if scheme in known
    }
    runs["CMC"] = lambda: [em.computed_muscle_control(model, motion, settings=setup.settings)]
    return Timed(runs, motion.end - motion.start)


def loaded(name, folder):
    """The set-up of one case."""
    case = SETUPS[name]
    return em.opensim.load_setup(Path(folder) / case.folder / case.setup, **case.span)


def of_pendulum():
    model, motion = pendulum.build(), pendulum.motion()
    # or, in older versions, by its name there
    settings = getattr(em, "CosimulationSettings", None) or em.Cosimulation
    full, simplified = (settings(scheme=s) for s in (em.Scheme.FULL, em.Scheme.SIMPLIFIED))

    def paper():
        return [
            em.static_optimization(model, motion),
            em.computed_muscle_control(model, motion),
            em.cosimulate(model, motion, settings=full),
            em.cosimulate(model, motion, settings=simplified),
        ]

    return Timed({"the paper's four": paper}, motion.end - motion.start)


def cpu_seconds(run, simulated):
    """Those that the results tell, per simulated second."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", em.ExudynMusclesWarning)
        return sum(result.cpu_time for result in run()) / simulated


def serve():
    case = cache(timed)
    for line in sys.stdin:
        name, folder, method = json.loads(line)
        runs, simulated = case(name, folder)
        print(ANSWER + json.dumps(cpu_seconds(runs[method], simulated)), flush=True)


if __name__ == "__main__":
    serve()
