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
    "model motion", "recruitment", "results", "simulation", "methods", "opensim plot view",
    "storage", "", "cli",
]  # fmt: skip
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms.split() or [""]}
LONGEST = 350  # lines of a file
# What evolves by its nature: a run, and who listens to numba.
STATES = {"numerics.compilation _Compilation"}

# What does not hold yet. These tables only shrink: an entry that is too large or that is no longer
# needed fails, too.
UPWARD = {
    "path.points -> muscle.parameters",
}
LONG = {
    "path/points.py": 363,
    "plot/figures.py": 673,
    "results/trajectory.py": 686,
    "simulation/plugin.py": 483,
    "skeleton/external_forces.py": 352,
    "skeleton/skeleton.py": 401,
    "view/scene.py": 539,
}
# Number of a class's attributes that are set after its objects were made.
SET_LATER = {
    "methods.cmc": 1,
    "methods.cmc CMCPlugin": 4,
    "methods.cosimulation CosimulationPlugin": 10,
    "methods.forward ForwardPlugin": 2,
    "methods.recruiting MuscleOptimization": 9,
    "methods.static": 2,
    "methods.unified UnifiedPlugin": 8,
    "recruitment.bounds ReachableForces": 5,
    "results.trajectory Recorder": 2,
    "simulation.plugin Plugin": 17,
    "skeleton.dependent DependentSkeleton": 1,
    "skeleton.external_forces _Acting": 1,
    "skeleton.skeleton Skeleton": 16,
}


@cache
def modules():
    """File and syntax of every module by its name in the package."""
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
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
    assert upward == UPWARD


def test_imports_are_not_circular():
    known = {tuple(each.split(" -> ")) for each in UPWARD}
    graph = {name: {x for x in own if (name, x) not in known} for name, own in imports().items()}
    tuple(TopologicalSorter(graph).static_order())


def test_files_are_short():
    lengths = {
        file.relative_to(PACKAGE).as_posix(): len(file.read_text().splitlines())
        for file, _ in modules().values()
    }
    assert {file: lines for file, lines in lengths.items() if lines > LONGEST} == LONG


def assigned(node):
    """The attribute that a node of the syntax sets, as the object's name and its own, or None."""
    if isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load):
        return ast.unparse(node.value), node.attr
    if isinstance(node, ast.Call) and ast.unparse(node.func) in ("object.__setattr__", "setattr"):
        return ast.unparse(node.args[0]), ast.unparse(node.args[1])
    return None


@cache
def functions():
    """All methods and functions: what they belong to, their name, their syntax."""
    found = []
    for module, (_, tree) in modules().items():
        owners = {module: tree}
        owners |= {f"{module} {x.name}": x for x in ast.walk(tree) if isinstance(x, ast.ClassDef)}
        for owner, node in owners.items():
            found += [(owner, x.name, x) for x in node.body if isinstance(x, ast.FunctionDef)]
    return found


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


def test_what_was_made_stays_as_it_is():
    """Attributes of the package's classes are set where an object is made, and nowhere else."""
    of_a_class = set()
    for _, name, function in functions():
        if name == "__init__":
            pairs = filter(None, map(assigned, ast.walk(function)))
            of_a_class |= {attribute for of, attribute in pairs if of == "self"}
    for _, tree in modules().values():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                fields = [x.target for x in node.body if isinstance(x, ast.AnnAssign)]
                of_a_class |= {ast.unparse(field) for field in fields}
    made, later = makers(), defaultdict(set)
    for owner, name, function in functions():
        for of, attribute in filter(None, map(assigned, ast.walk(function))):
            ours = of == "self" or (attribute in of_a_class and re.fullmatch(r"(self\.)?\w+", of))
            if ours and name not in made:
                later[owner].add(attribute)
    assert later.keys() >= STATES
    assert {x: len(later[x]) for x in sorted(later.keys() - STATES)} == SET_LATER


def test_nothing_tells_of_the_machine_it_was_written_on():
    for file, _ in modules().values():
        found = re.search(r"\.\./shared|/(home|root|tmp|work)/|\b[Ss]essions?\b", file.read_text())
        assert not found, f"{file}: {found[0]}"
