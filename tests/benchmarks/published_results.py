"""A whole body's published CMC, run here from its published files as they are, beside its published
results: the squat jump of https://github.com/zwq817/jump-simulation, a model of 19 coordinates and
18 muscles, recorded with two force plates.

    git clone https://github.com/zwq817/jump-simulation
    python -m tests.benchmarks.published_results jump-simulation

from the repository's root. Prints for each method CPU seconds per simulated second, and root mean
squares: of every coordinate's tracking error [rad or m], beside the published ones, of how far the
muscles' tendon forces are from the published ones [N], and of reserves and residuals beside them.
Asserts nothing.
"""

import argparse
import warnings
from pathlib import Path

import numpy as np

import exudyn_muscles as em

SETUP = "Setup_CMC.xml"
ERRORS, FORCES = "CMC/jumper_CMC_pErr.sto", "CMC/jumper_CMC_Actuation_force.sto"
STARTED = 0.03  # s, after which OpenSim's simulation begins


def rms(values):
    return np.sqrt(np.mean(np.square(values), axis=0))


def run(setup):
    """Results of CMC and both co-simulations, the second ones, after the kernels are compiled."""
    methods = {
        "CMC": lambda: em.computed_muscle_control(
            setup.model, setup.motion, settings=setup.settings
        ),
        "CSF": lambda: em.cosimulate(
            setup.model, setup.motion, settings=setup.cosimulation(em.Scheme.FULL)
        ),
        "consistent": lambda: em.cosimulate(
            setup.model, setup.motion, settings=setup.cosimulation()
        ),
    }
    for name, method in methods.items():
        method()
        yield name, method()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    arguments = parser.parse_args()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        setup = em.opensim.load_setup(arguments.folder / SETUP)
        results = dict(run(setup))
    begun = setup.motion.start + STARTED - 1e-9
    errors = em.read_storage(arguments.folder / ERRORS)
    published = dict(zip(errors.labels, rms(errors.values[errors.time > begun]), strict=True))
    theirs = em.read_storage(arguments.folder / FORCES)
    rows = (theirs.time > begun) & (theirs.time <= setup.motion.end)
    names = setup.model.muscles.names
    print(f"{len(setup.model.coordinates)} coordinates, {len(names)} muscles, "
          f"{setup.motion.start:g} to {setup.motion.end:g} s")  # fmt: skip
    print("tracking errors:", " ".join(["published", *results]))
    for j, name in enumerate(setup.model.coordinates):
        ours = [
            rms(result.tracking_errors()[result.time > begun, j]) for result in results.values()
        ]
        print(f"  {name:18}", " ".join(f"{x:.1e}" for x in (published[name], *ours)))
    columns = theirs.values[rows]
    muscles = columns[:, [theirs.labels.index(name) for name in names]]
    for label, result in results.items():
        forces = [np.interp(theirs.time[rows], result.time, x) for x in result.tendon_forces.T]
        held = rms(result.reserves).max() if result.reserve_names else 0.0
        print(
            f"{label}: {result.status.name.lower()}, "
            f"{result.cpu_time / (setup.motion.end - setup.motion.start):.2f} CPU s per s; tendon "
            f"forces {rms(np.array(forces).T - muscles).mean():.0f} N from the published ones of "
            f"{rms(muscles).mean():.0f} N (means over muscles); largest reserve {held:.1f}"
        )
    print(f"largest published reserve {rms(columns[:, len(names) :]).max():.1f}")


if __name__ == "__main__":
    main()
