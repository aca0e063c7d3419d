"""The reference of the documentation has every public name, and every docstring in it says what is
taken, returned and raised.
"""

import ast
import enum
import importlib
import inspect
import re
import runpy
import textwrap
from pathlib import Path
from types import ModuleType

import pytest
from numpydoc.docscrape import NumpyDocString

import exudyn_muscles as em

DOCS = Path(__file__).parents[1] / "docs"
ROOMS = [
    em, em.analysis, em.opensim, em.opensim.result_files, em.operators, em.plot, em.studies, em.view
]  # fmt: skip
# How the site completes the parameters of a class by those of its bases.
INHERITED = runpy.run_path(str(DOCS / "extensions" / "inherited.py"))


def public(module):
    """Names that a module offers: those of `__all__`, or the functions that it makes."""
    made = {
        name
        for name, value in vars(module).items()
        if inspect.isfunction(value) and value.__module__ == module.__name__ and name[0] != "_"
    }
    names = getattr(module, "__all__", made)
    return {name for name in names if not isinstance(getattr(module, name), ModuleType)}


def in_reference():
    """Full names of the reference's objects -> their members that are named there; None if none
    are shown, empty if all are."""
    found = {}
    for page in sorted((DOCS / "reference").glob("*.rst")):
        module, name = None, None
        for line in page.read_text().splitlines():
            if line.startswith(".. currentmodule:: "):
                module = line.split()[-1]
            elif re.match(r"\.\. auto(?!summary)", line):
                name = f"{module}.{line.split()[-1]}"
                assert name not in found, f"{name} is there twice"
                found[name] = None
            elif members := re.match(r"   :members:(.*)", line):
                found[name] = members[1].replace(",", " ").split()
    return found


REFERENCE = in_reference()


def test_the_reference_has_every_public_name():
    there = {f"{module.__name__}.{name}" for module in ROOMS for name in public(module)}
    assert set(REFERENCE) == there - {"exudyn_muscles.opensim.result_files.write_results"}  # twice


def documented(full):
    """Full name, object and class of what is shown: an object of the reference and its members."""
    module, _, name = full.rpartition(".")
    made = getattr(importlib.import_module(module), name)
    yield full, made, None
    if isinstance(made, type) and not issubclass(made, enum.Enum) and REFERENCE[full] is not None:
        own = [name for name, value in vars(made).items() if name[0] != "_" and shown(value)]
        for member in REFERENCE[full] or own:
            yield f"{full}.{member}", inspect.getattr_static(made, member), made


def shown(value):
    """Is it a method or property?"""
    return isinstance(value, (property, classmethod, staticmethod)) or inspect.isfunction(value)


def lacking(made, owner):
    """What the docstring of an object does not say; `owner` is its class, if it has one."""
    if isinstance(made, type):
        return lacking_of_class(made)
    function = inspect.unwrap(getattr(made, "__func__", made))
    # Docstrings of overridden methods are inherited, which is found through the class.
    text = inspect.getdoc(getattr(owner, getattr(function, "__name__", ""), made))
    if not text:
        return {"a docstring"}
    if not inspect.isfunction(function):
        return set()  # a property, or data
    doc, signature = NumpyDocString(text), inspect.signature(function)
    told = {each.strip().lstrip("*") for one in doc["Parameters"] for each in one.name.split(",")}
    missing = {each for each in signature.parameters if each not in ("self", "cls")} - told
    given = signature.return_annotation
    # Nothing, or a `with` block; or a type that the text names.
    told_otherwise = re.match("None|NoReturn|Iterator", given) or f"`{given}`" in text
    if not doc["Returns"] and not told_otherwise:
        missing.add("Returns")
    errors = " ".join(one.type for one in doc["Raises"])
    return missing | {f"Raises {each}" for each in raised(function) if each not in errors}


def lacking_of_class(made):
    if not made.__doc__:
        return {"a docstring"}
    if issubclass(made, (enum.Enum, BaseException)) or getattr(made, "_is_protocol", False):
        return set()
    told = set(INHERITED["described"](made))
    for parameter in INHERITED["inherited_parameters"](made):
        told |= set(INHERITED["names"](parameter))
    return set(inspect.signature(made).parameters) - told


def raised(function):
    """Names of the errors that a function raises itself."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    errors = [node.exc for node in ast.walk(tree) if isinstance(node, ast.Raise) and node.exc]
    names = {ast.unparse(each.func if isinstance(each, ast.Call) else each) for each in errors}
    return {name for name in names if name.endswith("Error")}


@pytest.mark.parametrize("full", REFERENCE)
def test_docstrings_are_complete(full):
    missing = {name: lacking(made, owner) for name, made, owner in documented(full)}
    assert not {name: what for name, what in missing.items() if what}
