"""What would the tests not notice? Small changes of the code, one at a time, and the tests on each:

    python -m tests.mutations recruitment --count 60 --seed 1

An area's changes are drawn by the seed from all that there are: comparisons turned round, sums and
products exchanged, signs, minima and maxima, constants, flags and whole statements. Each is written
into a copy of the project, whose mapped tests run until one fails. Printed are the changes that no
test noticed; the exit status is 1 if there are any. Compiled kernels run without their compiler,
which would take longer than they do.
"""

from __future__ import annotations

import argparse
import ast
import copy
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

# Area -> pairs of sources and the tests that are to notice, those that fail soonest first.
AREAS: dict[str, list[tuple[str, str]]] = {
    "recruitment": [
        (
            "recruitment/optimization.py recruitment/problem.py recruitment/certificate.py "
            "recruitment/nearest.py recruitment/cheapest.py "
            "recruitment/equations.py recruitment/householder.py",
            "recruitment/test_optimization.py recruitment/test_nearest.py",
        ),
        (
            "recruitment/windows.py recruitment/steady.py recruitment/excitation.py",
            "recruitment/test_bounds.py",
        ),
        (
            "forces/actuators.py recruitment/limits.py recruitment/normalizers.py",
            "forces recruitment/test_limits.py recruitment/test_normalizers.py",
        ),
        ("motion/plausibility.py motion/checks.py", "motion/test_plausibility.py"),
    ],
    "equilibrium": [("muscle/equilibrium.py", "muscle/test_equilibrium.py")],
    "muscle": [
        ("muscle/activation.py", "muscle/test_activation.py"),
        (
            "muscle/contraction.py muscle/force_velocity.py muscle/dynamics.py",
            "muscle/test_contraction.py muscle/test_dynamics.py",
        ),
        (
            "muscle/trapezoidal.py muscle/rosenbrock.py muscle/course.py muscle/window.py",
            "muscle/test_trapezoidal.py muscle/test_window.py",
        ),
        ("muscle/parameters.py muscle/arguments.py", "muscle/test_parameters.py"),
    ],
    "path": [("path", "path skeleton/test_dependent.py")],
    "skeleton": [
        (
            "skeleton",
            "skeleton/test_skeleton.py skeleton simulation/test_host.py",
        )
    ],
    "coupling": [
        (
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


def notices(folder: Path, tests: list[str], limit: float) -> bool:
    """Whether a test fails in a copy of the project, or does not end."""
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, timeout=limit
        )
    except subprocess.TimeoutExpired:
        return True
    return done.returncode != 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("area", choices=AREAS)
    parser.add_argument("--count", type=int, default=60, help="how many changes are tried")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="sources whose path contains this")
    arguments = parser.parse_args()
    tried = []
    for sources, tests in AREAS[arguments.area]:
        paths = [ROOT / "exudyn_muscles" / each for each in sources.split()]
        files = [
            file for path in paths for file in ([path] if path.is_file() else path.glob("*.py"))
        ]
        mapped = [f"tests/{each}" for each in tests.split()]
        tried += [
            (each, mapped)
            for file in sorted(files)
            if arguments.only in str(file)
            for each in changes(file)
        ]
    count = min(arguments.count, len(tried))
    chosen = random.Random(arguments.seed).sample(tried, count)
    print(f"{count} of {len(tried)} changes of {arguments.area}, seed {arguments.seed}", flush=True)
    survivors = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name in COPIED:
            take = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            take(ROOT / name, folder / name)
        limits: dict[str, float] = {}
        for mapped in {" ".join(mapped): mapped for _, mapped in chosen}.values():
            begun = time.perf_counter()
            if notices(folder, mapped, 3600.0):
                sys.exit(f"the tests fail without any change: {' '.join(mapped)}")
            limits[" ".join(mapped)] = 30.0 + PATIENCE * (time.perf_counter() - begun)
        for change, mapped in chosen:
            place = change.source.relative_to(ROOT)
            (folder / place).write_text(change.text)
            if not notices(folder, mapped, limits[" ".join(mapped)]):
                survivors += 1
                print(f"{place}:{change.line}: {change.before}\n    -> {change.after}", flush=True)
            shutil.copy(change.source, folder / place)
    print(f"{survivors} of {count} changes were not noticed")
    return survivors > 0


if __name__ == "__main__":
    sys.exit(main())
