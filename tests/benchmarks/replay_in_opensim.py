"""The files that this package writes, replayed by OpenSim itself.

    pip install -e ".[test,opensim]"
    python -m tests.benchmarks.replay_in_opensim [--methods NAME ...]

from the repository's root, with OpenSim's CMC cases in `../shared/opensim/cmc`. Prints for each
coordinate [rad or m]

- drift: the largest difference of OpenSim's run, its Manager at an accuracy of 1e-6, from the
  motion of the method whose states and controls it was given;
- apart: the largest difference of the accelerations of both at equal states, where one means of
  what the path between two points is and the other does not: OpenSim's moment arms over
  ellipsoids are not -dl/dq.

`docs/opensim_side_by_side.json` has what OpenSim's own CMC drifts when OpenSim replays it.
"""

import argparse
import importlib.util
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import exudyn_muscles as em

from ..opensim import REFERENCE

FILES = REFERENCE.parent / "cmc"
OPENSIM_SIDE = Path(__file__).with_name("opensim_replay.py")
METHODS = {"cmc": None, "csf": em.Scheme.FULL, "consistent": em.Scheme.CONSISTENT}


class Case(NamedTuple):
    """A set-up in a folder of `FILES`, and what it names: model, reserves, external loads."""

    folder: str
    setup: str
    model: str
    forces: str
    loads: str | None = None


CASES = (
    Case("arm26", "arm26_Setup_CMC.xml", "arm26.osim", "arm26_Reserve_Actuators.xml"),
    Case(
        "leg6dof9musc_stance", "leg69_Setup_CMC_Stance.xml", "leg6dof9musc_added_mass.osim",
        "leg69_CMC_residuals_motors.xml", "leg69_right_grf.xml",
    ),
)  # fmt: skip


def replayed(result, model, described, file, forces=(), loads=None):
    """Differences and accelerations (T,) of every coordinate by its name, as OpenSim finds them."""
    with tempfile.TemporaryDirectory() as folder:
        stem, report = Path(folder, "run"), Path(folder, "report.json")
        em.opensim.write_results(result, stem, model=model, described=described)
        command = [sys.executable, OPENSIM_SIDE, Path(file).name, stem, report]
        command += ["--forces", *forces] if forces else []
        command += ["--loads", loads] if loads else []
        done = subprocess.run(
            list(map(str, command)), cwd=Path(file).parent, capture_output=True, text=True
        )
        if done.returncode:
            raise RuntimeError(f"OpenSim failed:\n{done.stdout}{done.stderr}")
        return json.loads(report.read_text())


def compute(setup, method):
    scheme = METHODS[method]
    if scheme is None:
        return em.computed_muscle_control(setup.model, setup.motion, settings=setup.settings)
    return em.cosimulate(setup.model, setup.motion, settings=setup.cosimulation(scheme))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    arguments = parser.parse_args()
    if importlib.util.find_spec("opensim") is None:
        parser.exit(2, "OpenSim's Python package is not installed: pip install opensim\n")
    if not FILES.is_dir():
        parser.exit(2, f"OpenSim's CMC cases are not beside this repository: no {FILES}\n")
    for case in CASES:
        folder = FILES / case.folder
        setup = em.opensim.load_setup(folder / case.setup)
        for method in arguments.methods:
            result = compute(setup, method)
            found = replayed(
                result, setup.model, setup.coordinates, folder / case.model, [case.forces],
                case.loads,
            )  # fmt: skip
            print(f"{case.folder}, {method}, {result.time[0]:g} to {result.time[-1]:g} s")
            for name, of in found.items():
                drift, line = np.abs(of["differences"]).max(), f"  {name:20s}"
                line += f" drift {drift:.1e}"
                if name in result.coordinate_names:
                    own = result.accelerations[:, result.coordinate_names.index(name)]
                    apart = np.abs(np.array(of["accelerations"]) - own).max()
                    line += f", accelerations apart {apart:.1e} of {np.abs(own).max():.1e}"
                print(line)


if __name__ == "__main__":
    main()
