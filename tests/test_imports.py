"""What is imported when: slow libraries and rooms of the package where they are used."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import exudyn_muscles as em

ROOT = Path(__file__).parents[1]
ROOMS = {f"exudyn_muscles.{name}" for name in ("analysis", "opensim", "plot", "report", "studies")}
# What a run needs none of.
NEVER = {*ROOMS, "exudyn_muscles.cli", "matplotlib.pyplot", "scipy.integrate", "scipy.signal"}
MODEL = "import sys; sys.path.insert(0, 'models'); import pendulum; model = pendulum.build()"
STAGES = {
    "import": ("import exudyn_muscles", {"exudyn", "numba", "numpy", "scipy"}),
    "all names": ("from exudyn_muscles import *", {"numba", "scipy.integrate", "scipy.optimize"}),
    "model": (MODEL, {"numba", "scipy.interpolate", "scipy.optimize", "scipy.spatial"}),
    "motion": (f"{MODEL}; pendulum.motion()", {"numba", "scipy.integrate"}),
    "run": (
        f"{MODEL}; import exudyn_muscles as em; em.cosimulate(model, pendulum.motion())",
        set(),
    ),
    "help": (
        "from exudyn_muscles.cli import main; main(['--version'])",
        {"exudyn", "numba", "scipy"},
    ),
}


def imported(code):
    """The modules that a process has imported when its code has run."""
    end = "import json, sys; print(json.dumps(sorted(sys.modules)))"
    told = f"import atexit; atexit.register(lambda: exec({end!r}))"
    printed = subprocess.run(
        [sys.executable, "-c", f"{told}\n{code}"],
        env={**os.environ, "PYTHONPATH": str(ROOT)}, cwd=ROOT, capture_output=True, text=True,
        check=True,
    ).stdout  # fmt: skip
    return set(json.loads(printed.splitlines()[-1]))


@pytest.mark.parametrize("stage", STAGES)
def test_what_is_not_used_is_not_imported(stage):
    code, others = STAGES[stage]
    unused = others if stage in ("all names", "help") else others | NEVER
    assert not imported(code) & unused


def test_all_names_are_there():
    """Each of the object that its place defines, and as a program that completes names sees it."""
    assert set(em.__all__) <= set(dir(em))
    for name in em.__all__:
        assert getattr(em, name) is not None
    star = {}
    exec("from exudyn_muscles import *", star)
    assert set(em.__all__) <= set(star)


@pytest.mark.parametrize("room", [em, em.opensim, em.plot, em.studies, em.view])
def test_the_list_of_names_is_of_what_is_imported(room):
    """Type checkers read `__all__` in the stub, and Python its imports."""
    stub = Path(room.__file__).with_suffix(".pyi").read_text()
    names = {}
    exec(stub[stub.index("__all__ = [") :].partition("]")[0] + "]", names)
    assert sorted(names["__all__"]) == names["__all__"] == room.__all__


def test_a_name_of_a_room_is_not_the_room():
    """`report` is a function, whichever of both is imported first."""
    imported("import exudyn_muscles as em, exudyn_muscles.report.page; assert callable(em.report)")
