"""OpenSim's static optimization beside this package's: the same set-up files, model and motion.

    pip install opensim
    git clone https://github.com/opensim-org/opensim-models
    git clone https://github.com/opensim-org/opensim-core
    python -m tests.benchmarks.opensim_static FOLDER   # with both of them in it [--json FILE]

from the repository's root. Where results differ is told in three steps, each a root mean square
over all muscles and OpenSim's times:

- `same`: OpenSim's problem solved here, with rigid tendons and neither passive forces nor
  activation dynamics. What is left is geometry, dynamics and the two optimizers.
- `passive`: with passive forces, of rigid tendons still.
- `whole`: this package's result, whose tendons stretch and whose activations take time.

Asserts nothing.
"""

import argparse
import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

import exudyn_muscles as em
from exudyn_muscles.files.disk import write_file

from ..opensim_static import Course, simplified
from .opensim_analyze import REPORT

OPENSIM_SIDE = Path(__file__).with_name("opensim_analyze.py")
MODELS, CORE = "opensim-models", "opensim-core"
TESTS = f"{CORE}/Applications/Analyze/tests/resources"
IK = "arm26_InverseKinematics.mot"
COURSE = f"{MODELS}/Tutorials/Computed_Muscle_Control/OutputReference"
LOADS = f"{MODELS}/Tutorials/Estimating_Joint_Reaction_Loads"


class Case(NamedTuple):
    """A set-up file, and what it names that lies elsewhere in the repositories, by the name that it
    has in the set-up."""

    setup: str
    beside: dict[str, str]


CASES = {
    "arm26": Case(
        f"{COURSE}/StaticOptimization/arm26_Setup_StaticOptimization.xml",
        {
            "arm26.osim": f"{COURSE}/arm26.osim",
            IK: f"{COURSE}/InverseKinematics/{IK}",
        },
    ),
    "arm26_bounds": Case(f"{TESTS}/arm26_bounds_Setup_StaticOptimization.xml", {}),
    "gait10dof18musc": Case(f"{TESTS}/staticoptimization_spring_Setup.xml", {}),
    "gait2392": Case(
        f"{LOADS}/setup_static_optimization.xml",
        {"subject01_simbody_adjusted.osim": f"{LOADS}/subject01_simbody_adjusted_StaticOp.osim"},
    ),
}  # fmt: skip


def of_opensim(folder, setup, names):
    """OpenSim's result for these muscles, and its CPU time."""
    done = subprocess.run(
        [sys.executable, str(OPENSIM_SIDE), setup], cwd=folder, capture_output=True, text=True
    )
    if done.returncode:
        raise SystemExit(f"OpenSim failed with {setup}:\n{done.stdout}{done.stderr}")
    report = json.loads((folder / REPORT).read_text())
    results = folder / report["results"]
    tables = [
        em.read_storage(results / f"{report['name']}_StaticOptimization_{kind}.sto")
        for kind in ("activation", "force")
    ]
    columns = ([table.labels.index(name) for name in names] for table in tables)
    values = [t.values[:, at] for t, at in zip(tables, columns, strict=True)]
    return Course(tables[0].time, *values), report["cpu_time"]


def whole(result, times):
    """This package's result at these times."""
    columns = zip(result.activations.T, strict=False), zip(result.tendon_forces.T, strict=False)
    at = (
        np.column_stack([np.interp(times, result.time, column) for (column,) in each])
        for each in columns
    )
    return Course(times, *at)


def differences(one, other):
    """Root mean squares of activations and of forces [N]."""
    return [float(np.sqrt(np.mean((x - y) ** 2))) for x, y in zip(one[1:], other[1:], strict=True)]


def compare(case, root, folder):
    """A row of numbers of a case, run on a copy of its folder."""
    source = root / case.setup
    shutil.copytree(source.parent, folder)
    for name, there in case.beside.items():
        shutil.copy(root / there, folder / name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        setup = em.opensim.load_setup(folder / source.name)
        for _ in range(2):  # the first run compiles
            result = em.static_optimization(setup.model, setup.motion, settings=setup.settings)
    theirs, cpu_time = of_opensim(folder, source.name, setup.model.muscles.names)
    inside = (theirs.time >= result.time[0] - 1e-9) & (theirs.time <= result.time[-1] + 1e-9)
    theirs = Course(*(part[inside] for part in theirs))
    times = np.clip(theirs.time, result.time[0], result.time[-1])
    found = {
        "same": simplified(setup, times, False),
        "passive": simplified(setup, times, True),
        "whole": whole(result, times),
    }
    return {
        "coordinates": len(setup.model.coordinates),
        "muscles": len(setup.model.muscles),
        "span": [float(result.time[0]), float(result.time[-1])],
        "instants": int(inside.sum()),
        "cpu_time_opensim": cpu_time,
        "cpu_time": result.cpu_time,
        "windows": result.counts.steps,
        "largest_unmet_torque": result.max_unmet_torque,
        "force_opensim": float(np.sqrt(np.mean(theirs.force**2))),
        "differences": {name: differences(course, theirs) for name, course in found.items()},
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument("--json", type=Path, metavar="FILE", help="store the numbers")
    arguments = parser.parse_args()
    if importlib.util.find_spec("opensim") is None:
        parser.exit(2, "OpenSim's Python package is not installed: pip install opensim\n")
    found = {}
    for name, case in CASES.items():
        if not (arguments.folder / case.setup).is_file():
            parser.error(f"no file {arguments.folder / case.setup}")
        with tempfile.TemporaryDirectory() as folder:
            found[name] = row = compare(case, arguments.folder, Path(folder, "case"))
        print(
            f"{name}: {row['coordinates']} coordinates, {row['muscles']} muscles, "
            f"{row['instants']} instants in {row['span'][0]:g} to {row['span'][1]:g} s; CPU "
            f"{row['cpu_time_opensim']:.2f} s of OpenSim, {row['cpu_time']:.2f} s here in "
            f"{row['windows']} windows; unmet {row['largest_unmet_torque']:.3g}"
        )
        for step, (activation, force) in row["differences"].items():
            print(f"  {step:8} activations {activation:.2e}, forces {force:.3g} N of "
                  f"{row['force_opensim']:.3g} N (RMS)")  # fmt: skip
    if arguments.json is not None:
        write_file(arguments.json, (json.dumps(found, indent=2) + "\n").encode())


if __name__ == "__main__":
    main()
