"""The rooms of the package, measured on its source: who knows whom, and who changes what."""

import ast
import re
from collections import defaultdict
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import exudyn_muscles

PACKAGE = Path(exudyn_muscles.__file__).parent
# From low to high; "" is the package itself. Rooms of one floor do not know each other.
FLOORS = [
    "errors", "checks", "files", "numerics", "path", "muscle", "forces", "skeleton",
    "model motion operators shapes", "joints", "recruitment", "results", "simulation", "methods",
    "analysis", "opensim plot view",
    "report storage studies", "", "cli",
]  # fmt: skip
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms.split() or [""]}
LONGEST = 350  # lines of a file
# Classes whose objects evolve, with those derived from them: a run's state, what it counts and
# records, and who listens to numba.
STATES = {"RunState", "Counts", "Recorder", "_Compilation"}
EVOLVING = r"\b(state|counts|settings)\b"  # what they are called, and Exudyn's settings

# Number of attributes that a class sets after its objects were made.
SET_LATER = {
    "numerics.dispatchers _PartLibrary": 1,  # as numba's own
    "recruitment.problem ScaledProblem": 3,  # a copy that is narrowed
    "simulation.plugin Plugin": 1,  # a new state for every run
    "skeleton.tied DynamicsOfTree": 1,  # where it is made: a tuple has no __init__
    "skeleton.skeleton Skeleton": 1,  # what is open of it
    "skeleton.system.geometry GeometryOnAll": 1,  # as DynamicsOfTree
    "skeleton.system.skeleton GeneralSkeleton": 1,
}


@cache
def modules():
    """File and syntax of every module by its name in the package; of a room that imports its names
    when they are used, where they are."""
    found = {}
    for file in sorted([*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.pyi")]):
        name = ".".join(file.relative_to(PACKAGE).with_suffix("").parts)
        found[re.sub(r"\.?__init__$", "", name)] = file, ast.parse(file.read_text())
    return found


@cache
def imports():
    """What every module imports of the package, wherever in it, and for types alone as well."""
    found = {}
    for name, (file, tree) in modules().items():
        here = [PACKAGE.name, *file.relative_to(PACKAGE).parts[:-1]]
        found[name] = set()
        for node in ast.walk(tree):
            given = []
            if isinstance(node, ast.Import):
                given = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                above = here[: len(here) - node.level + 1] if node.level else []
                base = ".".join([*above, *filter(None, [node.module])])
                given = [f"{base}.{alias.name}" for alias in node.names]
            for path in given:
                top, _, inner = path.partition(".")
                if top == PACKAGE.name:
                    found[name].add(inner if inner in modules() else inner.rpartition(".")[0])
    return found


def room(module):
    return module.partition(".")[0]


def test_imports_run_downward():
    upward = {
        f"{name} -> {other}"
        for name, others in imports().items()
        for other in others
        if room(name) != room(other) and FLOOR[room(name)] <= FLOOR[room(other)]
    }
    assert not upward


def test_imports_are_not_circular():
    tuple(TopologicalSorter(imports()).static_order())


def test_files_are_short():
    lengths = {
        file.relative_to(PACKAGE).as_posix(): len(file.read_text().splitlines())
        for file, _ in modules().values()
    }
    assert not {file: lines for file, lines in lengths.items() if lines > LONGEST}


def assigned(node):
    """The attribute that a node of the syntax sets, as the object's name and its own, or None."""
    if isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load):
        return ast.unparse(node.value), node.attr
    if isinstance(node, ast.Call) and ast.unparse(node.func) in ("object.__setattr__", "setattr"):
        return ast.unparse(node.args[0]), ast.unparse(node.args[1])
    return None


@cache
def classes():
    """Syntax of all classes by what they are called: module, blank, name."""
    return {
        f"{module} {node.name}": node
        for module, (_, tree) in modules().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    }


@cache
def functions():
    """All methods and functions: the class or module that they are of, their name, their syntax."""
    owners = {module: tree for module, (_, tree) in modules().items()} | classes()
    return [
        (owner, node.name, node)
        for owner, inside in owners.items()
        for node in inside.body
        if isinstance(node, ast.FunctionDef)
    ]


def makers():
    """Names of the methods in which objects are made, and of those that only these call."""
    callers = defaultdict(set)
    for _, name, function in functions():
        for node in ast.walk(function):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                callers[node.func.attr].add(name)
    found = {"__init__", "__post_init__"}
    found |= {name for _, name, function in functions() if "classmethod" in decorators(function)}
    while more := {name for name, own in callers.items() if own <= found} - found:
        found |= more
    return found


def decorators(function):
    return {ast.unparse(each) for each in function.decorator_list}


def evolving():
    """The classes whose objects evolve."""
    found = set(STATES)
    bases = {name.split()[1]: {ast.unparse(x) for x in y.bases} for name, y in classes().items()}
    while more := {name for name, own in bases.items() if own & found} - found:
        found |= more
    return {name for name in classes() if name.split()[1] in found}


def test_what_was_made_stays_as_it_is():
    """Attributes of the package's classes are set where an object is made, and nowhere else."""
    states, made = evolving(), makers()
    fixed = set()  # names of the attributes of all other classes
    for owner, node in classes().items():
        if owner not in states:
            fields = [x.target for x in node.body if isinstance(x, ast.AnnAssign)]
            fixed |= {ast.unparse(field) for field in fields}
    for owner, name, function in functions():
        if name == "__init__" and owner not in states:
            pairs = filter(None, map(assigned, ast.walk(function)))
            fixed |= {attribute for of, attribute in pairs if of == "self"}
    later = defaultdict(set)
    for owner, name, function in functions():
        for of, attribute in filter(None, map(assigned, ast.walk(function))):
            ours = of == "self" and owner not in states
            ours |= attribute in fixed and of != "self" and not re.search(EVOLVING, of)
            ours |= of.endswith("record")  # which changes itself
            if ours and name not in made:
                later[owner].add(f"{of}.{attribute}")
    assert {owner: len(later[owner]) for owner in sorted(later)} == SET_LATER


def test_nothing_tells_of_the_machine_it_was_written_on():
    for file, _ in modules().values():
        found = re.search(r"\.\./shared|/(home|root|tmp|work)/|\b[Ss]essions?\b", file.read_text())
        assert not found, f"{file}: {found[0]}"
