"""Pages of the documentation say what is: names in their code exist, and numbers are printed."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest

import exudyn_muscles as em

from .benchmarks import paper_table

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
PAGES += [page for room in ("theory", "tutorials") for page in (ROOT / "docs" / room).glob("*.md")]
ROOMS = {"em": em, "studies": em.studies, "operators": em.operators, "plot": em.plot}


def blocks(page):
    return re.findall(r"^```python\n(.*?)^```", page.read_text(), re.M | re.S)


def test_there_are_blocks():
    assert sum(len(blocks(page)) for page in PAGES) > 40


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_code_on_pages_has_names_of_the_package(page):
    """Every block is Python, and what it takes from the package is there."""
    for block in blocks(page):
        for node in ast.walk(ast.parse(block)):
            if isinstance(node, ast.Attribute):
                first, *inner = ast.unparse(node).split(".")
                found = ROOMS.get(first) if all(map(str.isidentifier, inner)) else None
                for name in inner if found else ():
                    assert hasattr(found, name), f"{page.name}: {ast.unparse(node)}"
                    found = getattr(found, name)
                    if not isinstance(found, (type, type(em))):
                        break  # what a value has only a run knows


def commands(page):
    """The project's commands between backticks, or as lines of blocks."""
    text = re.sub(r"\s+", " ", page.read_text())
    return re.findall(r"(?:python -m|pytest) tests[/.][^`]*?(?=`| ```|$)", text)


def test_there_are_commands():
    assert sum(len(commands(page)) for page in PAGES) > 30


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_on_pages_run_something(page):
    for command in commands(page):
        place = re.search(r"tests[\w./]*\w", command)[0]
        path = ROOT / (place if "/" in place or place == "tests" else place.replace(".", "/"))
        there = path if path.exists() else path.with_suffix(".py")
        assert there.exists(), command
        for word in re.findall(r"\w+", "".join(re.findall(r'-k "?([\w ]+)', command))):
            names = re.findall(r"^def (test_\w+)", there.read_text(), re.M)
            assert word == "or" or any(word in name for name in names), f"{command}: {word}"


@pytest.fixture(scope="module")
def examined():
    return (ROOT / "docs" / "theory" / "table2.md").read_text()


def test_the_papers_table_tells_the_gain(examined):
    def error(kp, predicts):
        return paper_table.cosimulated(kp, 2.0 * np.sqrt(kp), predicts)

    printed = {kp: f"{error(kp, False):.4f}" == "0.0186" for kp in (529.0, 531.0, 536.0, 538.0)}
    assert printed == {529.0: False, 531.0: True, 536.0: True, 538.0: False}
    assert "from 530 to 537 1/s^2" in examined
    assert f"{error(641.0, True):.4f}" == "0.1146" and "kp = 641" in examined
    pair = [paper_table.cosimulated(496.0, 36.6, predicts) for predicts in (False, True)]
    np.testing.assert_allclose(pair, [0.0186, 0.1146], rtol=0, atol=1e-4)
    csf, css = (
        em.Trajectory.load(ROOT / "tests" / "reference" / f"pendulum_{method}.npz")
        for method in ("csf", "css")
    )
    for stored, predicts in ((csf, False), (css, True)):
        found = error(stored.settings["kp"], predicts)
        assert found == pytest.approx(np.degrees(stored.tracking_error_rms()[0]), rel=2e-3)
        assert f"| {found:.4f} |" in examined


def test_what_decides_the_error_of_cmc(examined):
    for mean in (0.476, 0.49, 0.5, 0.51, 0.526):
        assert f"| {mean:.3f} | {paper_table.computed(mean):.4f} |" in examined
    result = paper_table.of_run()
    mean, error = paper_table.mean_within_windows(result), result.tracking_error_rms()[0]
    assert f"the mean is {mean:.3f}, and the error {np.degrees(error):.4f}" in examined
    # Of the measured mean alone.
    assert np.degrees(error) == pytest.approx(paper_table.computed(mean), rel=0.05)
