"""What would the tests not notice? Small changes of the code, one at a time, and the tests on each:

    python -m tests.mutations recruitment --count 60 --seed 1

An area's changes are drawn by the seed from all that there are: comparisons turned round, sums and
products exchanged, signs, minima and maxima, constants, flags and whole statements. Each is written
into a copy of the project, whose mapped tests run until one fails. Printed are the changes that no
test noticed; the exit status is 1 if there are any.
"""

from __future__ import annotations

import argparse
import ast
import copy
import itertools
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
COPIED = ("exudyn_muscles", "tests", "models", "examples", "docs", "pyproject.toml", "README.md")
# A change that makes an endless loop counts as noticed after so many times the usual duration.
PATIENCE = 5.0
QUICK_WRAPPING = "--deselect=tests/path/test_wrapping.py::test_continuous_where_it_lifts_off"


class Part(NamedTuple):
    """Sources, and the tests that are to notice their changes, those that fail soonest first.

    `soon` run without the compiler; what they do not notice the tests `late` are to, which take so
    long without it that compiling all kernels anew for a change is shorter.
    """

    sources: str
    soon: str
    late: str = ""


AREAS: dict[str, list[Part]] = {
    "recruitment": [
        Part(
            "recruitment/optimization.py recruitment/problem.py recruitment/certificate.py "
            "recruitment/nearest.py recruitment/cheapest.py recruitment/criterion.py "
            "recruitment/equations.py recruitment/householder.py",
            "recruitment/test_optimization.py recruitment/test_nearest.py "
            "recruitment/test_criterion.py",
        ),
        Part(
            "recruitment/windows.py recruitment/steady.py recruitment/excitation.py",
            "recruitment/test_bounds.py",
        ),
        Part(
            "forces/actuators.py path/frames.py recruitment/limits.py recruitment/normalizers.py",
            "forces recruitment/test_limits.py recruitment/test_normalizers.py",
        ),
        Part("motion/plausibility.py motion/checks.py", "motion/test_plausibility.py"),
    ],
    "equilibrium": [Part("muscle/equilibrium.py", "muscle/test_equilibrium.py")],
    "muscle": [
        # Without the compiler Python's math.exp raises where it is to be infinite.
        Part("muscle/activation.py", "", "muscle/test_activation.py muscle/test_window.py"),
        Part(
            "muscle/contraction.py muscle/force_velocity.py muscle/dynamics.py",
            "muscle/test_dynamics.py",
            "muscle/test_contraction.py muscle/test_window.py muscle/test_deprecated.py "
            "muscle/test_opensim_units.py",
        ),
        Part(
            "muscle/trapezoidal.py muscle/rosenbrock.py muscle/course.py muscle/window.py",
            "muscle/test_window.py::test_steps_that_no_longer_fit_are_chosen_anew "
            "muscle/test_window.py::test_stop",
            "muscle/test_trapezoidal.py muscle/test_window.py muscle/test_activation.py",
        ),
        Part(
            "muscle/parameters.py muscle/arguments.py",
            "muscle/test_parameters.py",
            "muscle/test_dynamics.py muscle/test_equilibrium.py muscle/test_window.py",
        ),
        Part(
            "muscle/laws",
            "muscle/laws/test_formulas.py muscle/laws/test_curves_against_opensim.py "
            "muscle/laws/test_custom.py",
            "muscle/test_deprecated.py muscle/test_contraction.py",
        ),
    ],
    "path": [
        Part(
            "path/geodesic.py path/great_circle.py path/rope.py path/wrapping.py",
            f"path/test_wrapping.py {QUICK_WRAPPING}",
            "path/test_wrapping.py path/test_degenerate.py path/test_in_a_run.py",
        ),
        Part(
            "path/frames.py path/functions.py path/geometry.py path/paths.py path/points.py "
            "path/pulls.py path/lines.py path/surfaces.py",
            "path/test_points.py path/test_functions.py path/test_geometry.py "
            f"path/test_wrapping.py {QUICK_WRAPPING}",
            "path/test_degenerate.py path/test_in_a_run.py view",
        ),
    ],
    "skeleton": [
        Part(
            "skeleton",
            "skeleton/test_skeleton.py skeleton simulation/test_host.py",
        )
    ],
    "coupling": [
        Part(
            "simulation methods results",
            "simulation/test_coupling.py methods results skeleton/test_dependent.py "
            "skeleton/test_other_bodies.py",
        )
    ],
}

COMPARISONS: dict[type, type] = {
    ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
OPERATIONS: dict[type, type] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
FUNCTIONS = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all"}
FUNCTIONS |= {"all": "any", "abs": "", "sqrt": ""}  # the argument itself


class Change(NamedTuple):
    """A change of a source: its line, the statement before and after, and the whole text."""

    source: Path
    line: int
    before: str
    after: str
    text: str


def changed(node: ast.AST) -> Iterator[ast.AST]:
    """What a node could be instead."""
    new = copy.deepcopy(node)
    if isinstance(new, ast.Compare) and len(new.ops) == 1:
        new.ops = [COMPARISONS[type(new.ops[0])]()]
    elif isinstance(new, (ast.BinOp, ast.AugAssign)) and type(new.op) in OPERATIONS:
        new.op = OPERATIONS[type(new.op)]()
    elif isinstance(new, ast.BoolOp):
        new.op = ast.Or() if isinstance(new.op, ast.And) else ast.And()
    elif isinstance(new, ast.UnaryOp):
        new = new.operand
    elif isinstance(new, ast.Constant) and isinstance(new.value, bool):
        new.value = not new.value
    elif isinstance(new, ast.Constant) and isinstance(new.value, (int, float)):
        new.value = 0 if new.value == 1 else 1 if new.value == 0 else 2 * new.value
    elif isinstance(new, ast.Call) and _name(new.func) in FUNCTIONS and new.args:
        other = FUNCTIONS[_name(new.func)]
        if not other:
            new = new.args[0]
        elif isinstance(new.func, ast.Attribute):
            new.func.attr = other
        else:
            new.func = ast.Name(other)
    elif isinstance(new, (ast.Continue, ast.Break, ast.AugAssign, ast.Expr)):
        new = ast.Pass()
    else:
        return
    yield new
    if isinstance(node, ast.AugAssign):
        yield ast.Pass()


def _name(function: ast.expr) -> str:
    return getattr(function, "attr", getattr(function, "id", ""))


def changes(source: Path) -> list[Change]:
    """All changes of the functions in a source, without messages and annotations."""
    tree = ast.parse(source.read_text())
    found = []
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            for statement in function.body:
                found += list(_within(source, tree, statement))
    return list({(each.line, each.text): each for each in found}.values())


def _within(source: Path, tree: ast.Module, statement: ast.stmt) -> Iterator[Change]:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return  # a docstring
    for parent, field, at, node in _nodes(statement):
        for new in changed(node):
            line = getattr(node, "lineno", statement.lineno)
            whole = _statement(statement, line)
            before = ast.unparse(whole).split("\n")[0]
            _put(parent, field, at, new)
            after = ast.unparse(whole).split("\n")[0] if whole is not node else "pass"
            yield Change(source, line, before, after, ast.unparse(ast.fix_missing_locations(tree)))
            _put(parent, field, at, node)


def _nodes(statement: ast.stmt) -> Iterator[tuple[ast.AST, str, int | None, ast.AST]]:
    """All nodes below a statement that are looked at, with the places where they are."""
    skipped = (ast.Raise, ast.JoinedStr, ast.FunctionDef, ast.Import, ast.ImportFrom)
    for field, value in ast.iter_fields(statement):
        if field in ("annotation", "returns", "decorator_list"):
            continue
        for at, node in enumerate(value) if isinstance(value, list) else [(None, value)]:
            if isinstance(node, ast.AST) and not isinstance(node, skipped):
                yield statement, field, at, node
                yield from _nodes(node)  # type: ignore[arg-type]


def _put(parent: ast.AST, field: str, at: int | None, node: ast.AST) -> None:
    if at is None:
        setattr(parent, field, node)
    else:
        getattr(parent, field)[at] = node


def _statement(outermost: ast.stmt, line: int) -> ast.stmt:
    """The innermost statement that begins before or in a line."""
    inner = [
        node
        for node in ast.walk(outermost)
        if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or node.lineno)
    ]
    return max(inner, key=lambda node: node.lineno, default=outermost)


def files_of(part: Part) -> list[Path]:
    """The sources of a part, a folder's one by one."""
    paths = [ROOT / "exudyn_muscles" / each for each in part.sources.split()]
    return sorted(
        file for path in paths for file in ([path] if path.is_file() else path.glob("*.py"))
    )


def notices(folder: Path, tests: str, compiled: bool, limit: float) -> bool:
    """Whether a test fails in a copy of the project, or does not end."""
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(folder)}
    if not compiled:
        environment["NUMBA_DISABLE_JIT"] = "1"
    mapped = [each if each[0] == "-" else f"tests/{each}" for each in tests.split()]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *mapped]
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, timeout=limit
        )
    except subprocess.TimeoutExpired:
        return True
    return done.returncode != 0


Drawn = tuple[Change, Part]


def drawn(groups: list[list[Drawn]], count: int, draw: random.Random) -> list[Drawn]:
    """So many of all groups, the same number of each as long as it has some left."""
    shuffled = [draw.sample(group, len(group)) for group in groups]
    rounds = itertools.zip_longest(*shuffled)
    each = [one for turn in rounds for one in turn if one is not None][:count]
    return draw.sample(each, len(each))


class Copy:
    """A copy of the project in which tests run, and how long they may take."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._limits: dict[tuple[str, bool], float] = {}
        for name in COPIED:
            take = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            take(ROOT / name, folder / name)

    def survives(self, change: Change, part: Part) -> bool:
        """Whether no test of the part notices a change."""
        runs = [(part.soon, False), (part.late, True)]
        for tests, compiled in runs:
            if tests and (tests, compiled) not in self._limits:
                begun = time.perf_counter()
                if notices(self._folder, tests, compiled, 3600.0):
                    sys.exit(f"the tests fail without any change: {tests}")
                usual = time.perf_counter() - begun
                self._limits[tests, compiled] = 30.0 + PATIENCE * usual
        place = self._folder / change.source.relative_to(ROOT)
        place.write_text(change.text)
        try:
            return not any(notices(self._folder, *run, self._limits[run]) for run in runs if run[0])
        finally:
            shutil.copy(change.source, place)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("area", choices=AREAS)
    parser.add_argument("--count", type=int, default=60, help="how many changes are tried")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="sources whose path contains this")
    arguments = parser.parse_args()
    possible = [
        [(change, part) for change in changes(file)]
        for part in AREAS[arguments.area]
        for file in files_of(part)
        if arguments.only in str(file)
    ]
    chosen = drawn(possible, arguments.count, random.Random(arguments.seed))
    count, all_of_them = len(chosen), sum(map(len, possible))
    print(
        f"{count} of {all_of_them} changes of {arguments.area}, seed {arguments.seed}", flush=True
    )
    survivors = 0
    with tempfile.TemporaryDirectory() as temporary:
        copied = Copy(Path(temporary))
        for change, part in chosen:
            if copied.survives(change, part):
                survivors += 1
                place = change.source.relative_to(ROOT)
                print(f"{place}:{change.line}: {change.before}\n    -> {change.after}", flush=True)
    print(f"{survivors} of {count} changes were not noticed")
    return survivors > 0


if __name__ == "__main__":
    sys.exit(main())
