"""Stored kernels are forgotten when any of their sources changes, not only their own file, and
give the same bits as kernels just compiled."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import exudyn_muscles
from exudyn_muscles.numerics.kernel import SOURCES

EQUILIBRIUM = """
from exudyn_muscles.muscle import equilibrium, parameters
unit = parameters.Muscle("unit", max_isometric_force=1000.0, optimal_fiber_length=0.1,
                         tendon_slack_length=0.2)
print(equilibrium.equilibrium(parameters.MuscleSet([unit]), [0.5], [0.34]).force[0])
print(sum(equilibrium.equilibria.entry.stats.cache_hits.values()))
"""

WINDOWS = """
from hashlib import sha256
import exudyn_muscles as em
from exudyn_muscles.muscle.window import integrate_all
from tests.muscle.make_window_box import load
muscles, (a, l_t, u, l_0, v_0, l_1, v_1), _ = load("box")
window = (l_0, l_1), (v_0, v_1), 0.01
end = em.integrate_window(muscles, a, l_t, u, *window, integrator=em.Integrator.ROSENBROCK)
print(sha256(b"".join(each.tobytes() for each in end)).hexdigest())
print(sum(integrate_all.entry.stats.cache_hits.values()))
"""


def run(folder, script):
    path = os.pathsep.join([str(folder), str(Path(__file__).parents[2])])
    environment = {**os.environ, "PYTHONPATH": path}
    printed = subprocess.run(
        [sys.executable, "-c", script],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        cwd=folder,
    ).stdout
    result, hits = printed.split()[-2:]
    return result, int(hits)


@pytest.fixture
def package(tmp_path):
    """A copy of the package without stored kernels."""
    source = Path(exudyn_muscles.__file__).parent
    ignore = shutil.ignore_patterns("__pycache__")
    return Path(shutil.copytree(source, tmp_path / "exudyn_muscles", ignore=ignore))


def test_all_kernels_are_in_the_sources():
    root = Path(exudyn_muscles.__file__).parent
    for file in root.rglob("*.py"):
        if re.search(r"^@kernel", file.read_text(), re.MULTILINE):
            name = file.relative_to(root)
            # Of a folder in the sources only its own files count.
            folder = name.parent.as_posix()
            assert {name.as_posix(), folder, name.parts[0]} & set(SOURCES), name


def test_a_change_in_another_file_is_seen(package):
    first, hits = run(package.parent, EQUILIBRIUM)
    assert hits == 0
    assert run(package.parent, EQUILIBRIUM) == (first, 1)
    contraction = package / "muscle" / "contraction.py"
    changed = contraction.read_text().replace("+ f_PE + beta * v,", "+ 1.1 * f_PE + beta * v,")
    assert changed != contraction.read_text()
    contraction.write_text(changed)
    stiffer, hits = run(package.parent, EQUILIBRIUM)
    assert hits == 0
    assert float(stiffer) > float(first) + 1.0


def rename(package, module, name):
    package.joinpath("numerics", f"{module}.py").rename(package / "numerics" / f"{name}.py")
    for file in package.rglob("*.py"):
        file.write_text(file.read_text().replace(f"{module} import", f"{name} import"))


def test_kernels_stored_before_a_module_was_moved_are_compiled_anew(package):
    """They name the types of a module that is there no longer."""
    rename(package, "curves", "old_curves")
    first, _ = run(package.parent, EQUILIBRIUM)
    rename(package, "old_curves", "curves")
    assert run(package.parent, EQUILIBRIUM) == (first, 0)
    assert run(package.parent, EQUILIBRIUM) == (first, 1)


def test_stored_kernels_give_the_bits_of_those_just_compiled(package):
    compiled, hits = run(package.parent, WINDOWS)
    assert hits == 0
    assert run(package.parent, WINDOWS) == (compiled, 1)


def test_stored_kernels_need_none_of_what_numba_compiles_with(package):
    """Which takes it a third of a second to import."""
    refused = """
from numba.core.registry import cpu_target
def refresh():
    raise AssertionError("everything is imported")
cpu_target.target_context.refresh = refresh
"""
    compiled, _ = run(package.parent, EQUILIBRIUM)
    assert run(package.parent, refused + EQUILIBRIUM) == (compiled, 1)
