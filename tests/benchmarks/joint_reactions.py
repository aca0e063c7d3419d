"""Joint loads of whole runs beside OpenSim's JointReaction, of its own pipelines:

    pip install -e ".[test,opensim]"
    python -m tests.benchmarks.joint_reactions [--python INTERPRETER]

from the repository's root, with OpenSim's CMC cases in `../shared/opensim/cmc`. OpenSim gets the
states and the forces of a static optimization as files. Prints, of every case, CPU seconds of
both, and of every joint the largest force [N] and the largest differences of force and torque over
the largest ones. Asserts nothing; tests compare the same at single states
(`tests/make_analyses.py`).
"""

import argparse
import json
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from time import process_time

import numpy as np

import exudyn_muscles as em
from exudyn_muscles.opensim.result_files import forces, states

from ..opensim import REFERENCE

FILES = REFERENCE.parent / "cmc"
OPENSIM_SIDE = Path(__file__).with_name("opensim_reactions.py")
# Folder, set-up, span [s], and what the set-up names: model, reserves, external loads.
CASES = {
    "arm26": ("arm26_Setup_CMC.xml", (0.0, 1.0), "arm26.osim", "arm26_Reserve_Actuators.xml", None),
    "leg6dof9musc_stance": (
        "leg69_Setup_CMC_Stance.xml", (0.0, 9.0), "leg6dof9musc_added_mass.osim",
        "leg69_CMC_residuals_motors.xml", "leg69_right_grf.xml",
    ),
    "gait2354": (
        "subject01_Setup_CMC.xml", (0.8, 1.2), "subject01_simbody_adjusted.osim",
        "gait2354_CMC_Actuators.xml", "subject01_walk1_grf.xml",
    ),
}  # fmt: skip


def solved(folder, setup, span):
    """The model, its coordinates in the file, and a static optimization of a part of its motion."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        setup = em.opensim.load_setup(folder / setup)
        start, end = max(span[0], setup.motion.start), min(span[1], setup.motion.end)
        motion = setup.motion.between(start, end)
        settings = em.StaticSettings(step=0.01)
        return setup.model, em.static_optimization(setup.model, motion, settings=settings)


def of_opensim(python, folder, stem, model, actuators, loads):
    """OpenSim's report."""
    report = stem.with_name("report.json")
    command = [python, str(OPENSIM_SIDE), model, str(stem), str(report)]
    command += ["--forces", actuators] if actuators else []
    command += ["--loads", loads] if loads else []
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"OpenSim failed with {model}:\n{done.stdout}{done.stderr}")
    return json.loads(report.read_text())


def compare(python, name):
    """CPU seconds of both, and a row for each joint."""
    setup, span, file, actuators, loads = CASES[name]
    folder = FILES / name
    model, result = solved(folder, setup, span)
    em.analysis.joint_loads(model, result)  # compiles
    begun = process_time()
    ours = em.analysis.joint_loads(model, result)
    cpu_time = process_time() - begun
    with tempfile.TemporaryDirectory() as there:
        stem = Path(there, "run")
        described = em.opensim.read_coordinates(folder / file)
        states(result, model, described).write(f"{stem}_states.sto")
        forces(result).write(f"{stem}_forces.sto")
        report = of_opensim(python, folder, stem, file, actuators, loads)
        theirs = em.read_storage(report["file"])
    rows = []
    for joint in em.analysis.joint_names(model):
        own = joint.split("/")[0]
        other = next(key for key, names in report["joints"].items() if own in names)
        columns = [k for k, label in enumerate(theirs.labels) if label.startswith(f"{other}_on_")]
        values = theirs.values[:, columns][:, :6]
        mine = np.hstack([ours[f"force/{joint}"], ours[f"torque/{joint}"]])
        mine = np.column_stack([np.interp(theirs.time, ours.time, column) for column in mine.T])
        sizes = [np.abs(values[:, part]).max() for part in (slice(0, 3), slice(3, 6))]
        off = [np.abs((mine - values)[:, part]).max() for part in (slice(0, 3), slice(3, 6))]
        rows.append((joint, *sizes, *off))
    return cpu_time, report["cpu_time"], rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default=sys.executable, help="that has opensim")
    parser.add_argument("cases", nargs="*", default=list(CASES))
    given = parser.parse_args()
    for name in given.cases:
        ours, theirs, rows = compare(given.python, name)
        print(f"{name}: {ours:.2f} s here, {theirs:.2f} s in OpenSim")
        for joint, force, torque, off, turned in rows:
            print(
                f"  {joint}: force up to {force:.4g} N, off by {off:.2g}; "
                f"torque up to {torque:.4g} N m, off by {turned:.2g}"
            )


if __name__ == "__main__":
    main()
