"""CONTRIBUTING.md, CHANGELOG.md and CITATION.cff say what is."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

import exudyn_muscles

ROOT = Path(__file__).parents[1]
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text()
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "README.md"])
def test_files_that_are_named_exist(name):
    named = set(re.findall(r"`([\w./]*/[\w./]*)`", (ROOT / name).read_text()))
    inside = {path for path in named if path.split("/")[0] in ("exudyn_muscles", "tests", "models")}
    assert len(inside) > 5
    assert not {path for path in inside if not (ROOT / path).exists()}


def test_names_of_the_walks_are_in_the_files_beside_them():
    """`name` (`file`): a name that is followed by a file is made there."""
    pairs = re.findall(r"`([\w.]+)`\s+\(`([\w./]+\.py)`\)", CONTRIBUTING)
    assert len(pairs) > 5
    for name, path in pairs:
        syntax = ast.parse((ROOT / path).read_text())
        made = {getattr(node, "name", None) for node in ast.walk(syntax)}
        assert set(name.split(".")) <= made, f"{name} is not in {path}"


def test_versions_and_licence_agree():
    citation = (ROOT / "CITATION.cff").read_text()
    assert f"\nversion: {PROJECT['version']}\n" in citation
    assert f"\nlicense: {PROJECT['license']}\n" in citation
    assert PROJECT["description"] in citation
    versions = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.M)
    assert versions[0] in ("Unreleased", PROJECT["version"])
    assert PROJECT["version"] in versions


def test_type_information_is_there():
    assert (Path(exudyn_muscles.__file__).parent / "py.typed").is_file()
