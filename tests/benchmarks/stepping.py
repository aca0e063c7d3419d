"""How long a control interval of 10 ms takes in real time, one `SolveSteps` after the other:

    python -m tests.benchmarks.stepping [--models FOLDER] [--seconds N]

from the repository's root, with OpenSim's CMC cases in `../shared/opensim/cmc`; `--models` names a
clone of opensim-models, whose running body is added. Prints wall time of whole walks, begun anew
until they have lasted N seconds; garbage is collected between the intervals, as who steps in real
time does while waiting. Other processes on the machine count, so leave it alone meanwhile. Asserts
nothing.
"""

import argparse
import gc
import tempfile
import warnings
from pathlib import Path
from time import perf_counter

import exudyn as exu
import numpy as np

import exudyn_muscles as em

from .published_cmc import CASES as PUBLISHED
from .published_cmc import lay_out
from .timed import FILES

INTERVAL = 0.01  # s
BOTH = (em.Scheme.FULL, em.Scheme.CONSISTENT)
SETUPS = {
    "gait2354": (FILES / "gait2354" / "subject01_Setup_CMC.xml", {}, BOTH),
    # Whose toes the consistent scheme loses.
    "gait2392": (FILES / "gait2392" / "subject01_Setup_CMC.xml", {"in_degrees": True}, BOTH[:1]),
}
RUNNING = "Hamner"  # of `PUBLISHED`


def interval_settings():
    """Exudyn's settings for one interval by TrapezoidalIndex2."""
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = INTERVAL, 1
    integration.verboseMode = 0
    integration.generalizedAlpha.useNewmark = True
    integration.generalizedAlpha.useIndex2Constraints = True
    integration.generalizedAlpha.computeInitialAccelerations = False  # the plugin's are right
    # As `cosimulate` has them: the matrix is right, so that one iteration mostly suffices.
    integration.newton.useModifiedNewton = False
    integration.newton.relativeTolerance, integration.newton.absoluteTolerance = 1e-8, 1e-9
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    return settings


def stepped(setup, scheme):
    """Wall time [s] of every interval of one run, and its result."""
    model, motion, mbs = setup.model, setup.motion, setup.model.mbs
    plugin = em.CosimulationPlugin(model, motion, setup.cosimulation(scheme))
    model.skeleton.set_initial_state(*motion(motion.start)[:2])
    settings, solver, times = interval_settings(), exu.MainSolverImplicitSecondOrder(), []
    settings.timeIntegration.startTime = motion.start
    settings.timeIntegration.endTime = motion.start + INTERVAL
    with plugin.attached():
        mbs.sys["dynamicSolver"], mbs.sys["simulationSettings"] = solver, settings
        solver.InitializeSolver(mbs, settings)
        gc.disable()
        try:
            while solver.it.currentTime < motion.end - 1.5 * INTERVAL:
                begun = perf_counter()
                solver.it.endTime = solver.it.currentTime + INTERVAL
                if not solver.SolveSteps(mbs, settings):
                    break  # the plugin says why
                times.append(perf_counter() - begun)
                gc.collect(0)
        finally:
            gc.enable()
        solver.FinalizeSolver(mbs, settings)
    return times, plugin.result()


def rows(name, setup, schemes, seconds):
    """One line of the table for each scheme."""
    model = setup.model
    for scheme in schemes:
        stepped(setup, scheme)  # compiles
        times, begun = [], perf_counter()
        while perf_counter() - begun < seconds:
            run, result = stepped(setup, scheme)
            times += run
        p50, p99, most = 1e3 * np.percentile(times, [50, 99, 100])
        print(
            f"| {name}, {len(model.coordinates)}, {len(model.muscles)} | {scheme.name.lower()} | "
            f"{p50:.2f} | {p99:.2f} | {most:.2f} | {len(times)} | "
            f"{result.tracking_error_rms().max():.1e} |",
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", type=Path, metavar="FOLDER", help="clone of opensim-models")
    parser.add_argument("--seconds", type=float, default=20.0, metavar="N", help="default 20")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", em.ExudynMusclesWarning)
    print("| model, coordinates, muscles | scheme | p50 ms | p99 ms | most ms | intervals | "
          "largest RMS error [rad or m] |\n|---|---|---|---|---|---|---|")  # fmt: skip
    for name, (file, options, schemes) in SETUPS.items():
        rows(name, em.opensim.load_setup(file, **options), schemes, arguments.seconds)
    if arguments.models is not None:
        with tempfile.TemporaryDirectory() as folder:
            lay_out(PUBLISHED[RUNNING], [arguments.models], Path(folder))
            setup = em.opensim.load_setup(Path(folder, PUBLISHED[RUNNING].setup))
            rows(RUNNING, setup, BOTH, arguments.seconds)


if __name__ == "__main__":
    main()
