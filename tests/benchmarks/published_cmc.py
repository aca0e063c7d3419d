"""CMC set-ups of OpenSim's own repositories, run here from their published files as they are,
beside the results that are stored with them.

    git clone https://github.com/opensim-org/opensim-models
    git clone https://github.com/opensim-org/opensim-core
    python -m tests.benchmarks.published_cmc opensim-models opensim-core [--only NAME ...]

from the repository's root. Of a pipeline the files that its step before makes, the adjusted model
and its motion, are laid where that step would have written them; of tests whose step before is a
forward simulation OpenSim makes it, where its Python package is installed. Prints the table of
`docs/opensim.md`; asserts nothing.
"""

import argparse
import contextlib
import importlib.util
import shutil
import tempfile
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

import exudyn_muscles as em

NO_ARM = 1e-6  # m, of muscles beside a residual
STARTED = 0.03  # s, after which OpenSim's simulation begins
TESTS = "Applications/CMC/tests/resources"  # of opensim-core


class Case(NamedTuple):
    """A set-up: which of the repositories it is of, its folder and file, folders whose content is
    laid over it, its stored tracking errors, what is asked of the user, and a forward simulation
    that makes its motion."""

    repository: int
    folder: str
    setup: str
    before: tuple[str, ...] = ()
    stored: str = ""
    in_degrees: bool | None = None
    forward: str = ""


CASES = {
    "Gait2354_Simbody": Case(
        0, "Pipelines/Gait2354_Simbody", "subject01_Setup_CMC.xml", ("OutputReference",),
        "ResultsCMC/subject01_walk1_pErr.sto",
    ),
    "Gait2392_Simbody": Case(
        0, "Pipelines/Gait2392_Simbody", "subject01_Setup_CMC.xml", ("OutputReference",),
        "ResultsCMC/subject01_walk1_pErr.sto", in_degrees=True,
    ),
    "Hamner": Case(
        0, "Pipelines/Hamner", "Setup_CMC.xml", ("outputReference",),
        "ResultsCMC/subject02_pErr.sto",
    ),
    "Gait10dof18musc": Case(
        0, "Pipelines/Gait10dof18musc", "CMC/walk_Setup_CMC.xml", ("OutputReference",),
        "CMC/ResultsCMC/walk_subject_pErr.sto",
    ),
    "Strength_of_Simulation": Case(
        0, "Tutorials/Strength_of_Simulation/Stance", "Reference/leg69_Setup_CMC.xml"
    ),
    "arm26": Case(1, TESTS, "arm26_Setup_CMC.xml"),
    "arm26, EMG": Case(1, TESTS, "arm26_Setup_ComputedMuscleControl_EMG.xml"),
    "leg6dof9musc, stance": Case(1, TESTS, "leg69_Setup_CMC_Stance.xml"),
    "leg6dof9musc, swing": Case(1, TESTS, "leg6dof9musc_setup_Swing.xml"),
    "gait10dof18musc": Case(1, TESTS, "gait10dof18musc_Setup_CMC.xml"),
    "gait2354": Case(1, TESTS, "subject01_Setup_CMC.xml"),
    "runningModel": Case(1, TESTS, "runningModel_Setup_CMC_test.xml"),
    "twoMusclesOnBlock": Case(
        1, TESTS, "twoMusclesOnBlock_Setup_CMC.xml", forward="twoMusclesOnBlock_Setup_Forward.xml"
    ),
    "block_hanging_from_muscle": Case(
        1, TESTS, "block_hanging_from_muscle_Setup_CMC.xml",
        forward="block_hanging_from_muscle_Setup_Forward.xml",
    ),
}  # fmt: skip


def rms(values):
    return np.sqrt(np.mean(np.square(values), axis=0))


def stored_errors(file, begun, end):
    """The largest root mean square of a coordinate's stored errors [rad or m]."""
    errors = em.read_storage(file)
    return rms(errors.values[(errors.time > begun) & (errors.time <= end)]).max()


def lay_out(case, repositories, folder):
    """Copy what a set-up needs; the stored results of the step before where that has them."""
    shutil.copytree(repositories[case.repository] / case.folder, folder, dirs_exist_ok=True)
    for before in case.before:
        shutil.copytree(folder / before, folder, dirs_exist_ok=True)
    if case.forward:
        import opensim

        with contextlib.chdir(folder):
            opensim.ForwardTool(case.forward).run()


def row(name, case, folder):
    """One line of the table."""
    setup = em.opensim.load_setup(folder / case.setup, in_degrees=case.in_degrees)
    model, motion = setup.model, setup.motion
    span = motion.end - motion.start
    methods = {
        "CMC": lambda: em.computed_muscle_control(model, motion, settings=setup.settings),
        "CSF": lambda: em.cosimulate(model, motion, settings=setup.cosimulation(em.Scheme.FULL)),
    }
    results = {}
    for method, run in methods.items():
        run()  # compiles
        results[method] = run()
    begun = motion.start + STARTED - 1e-9
    worst = [
        rms(result.tracking_errors()[result.time > begun]).max() for result in results.values()
    ]
    cmc = results["CMC"]
    arms = model.geometry(motion(motion.start)[0], np.zeros(len(model.coordinates))).moment_arms
    reserves = rms(cmc.torques_ideal)[np.abs(arms).max(axis=0) > NO_ARM].max(initial=0.0)
    other = f"{stored_errors(folder / case.stored, begun, motion.end):.1e}" if case.stored else "-"
    seconds = ", ".join(f"{result.cpu_time / span:.2g}" for result in results.values())
    status = ", ".join(sorted({result.status.name.lower() for result in results.values()}))
    return (
        f"| {name}, {motion.start:.3g} to {motion.end:.3g} s | {len(model.coordinates)}, "
        f"{len(model.muscles)} | {seconds} | {worst[0]:.1e}, {worst[1]:.1e} | {other} | "
        f"{cmc.max_unmet_torque:.2g} | {reserves:.2g} | {status} |"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", metavar="OPENSIM-MODELS", type=Path)
    parser.add_argument("core", metavar="OPENSIM-CORE", type=Path)
    parser.add_argument("--only", nargs="*", default=list(CASES), choices=CASES, metavar="NAME")
    arguments = parser.parse_args()
    print("| set-up | coordinates, muscles | CPU s per s, CMC and CSF | worst RMS error, CMC and "
          "CSF [rad or m] | stored | unmet [N m] | largest RMS of reserves beside muscles [N m] | |"
    )  # fmt: skip
    print("|---|---|---|---|---|---|---|---|")
    for name in arguments.only:
        case = CASES[name]
        if case.forward and importlib.util.find_spec("opensim") is None:
            print(f"| {name} | its motion is made by OpenSim, which is not installed | | | | | | |")
            continue
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            lay_out(case, (arguments.models, arguments.core), Path(folder))
            print(row(name, case, Path(folder)), flush=True)


if __name__ == "__main__":
    main()
