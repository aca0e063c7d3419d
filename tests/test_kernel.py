"""Stored kernels are forgotten when any of their sources changes, not only their own file."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import exudyn_muscles

SCRIPT = """
from exudyn_muscles.muscle import equilibrium, parameters
unit = parameters.Muscle("unit", max_isometric_force=1000.0, optimal_fiber_length=0.1,
                         tendon_slack_length=0.2)
print(equilibrium.equilibrium(parameters.MuscleSet([unit]), [0.5], [0.34]).force[0])
print(sum(equilibrium.equilibria.stats.cache_hits.values()))
"""


def run(folder):
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    printed = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        cwd=folder,
    ).stdout
    force, hits = printed.split()[-2:]
    return float(force), int(hits)


def test_a_change_in_another_file_is_seen(tmp_path):
    package = tmp_path / "exudyn_muscles"
    shutil.copytree(
        Path(exudyn_muscles.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__")
    )
    first, hits = run(tmp_path)
    assert hits == 0
    assert run(tmp_path) == (first, 1)
    contraction = package / "muscle" / "contraction.py"
    changed = contraction.read_text().replace("+ f_PE + beta * v,", "+ 1.1 * f_PE + beta * v,")
    assert changed != contraction.read_text()
    contraction.write_text(changed)
    stiffer, hits = run(tmp_path)
    assert hits == 0
    assert stiffer > first + 1.0
