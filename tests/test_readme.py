"""The README shows what is: its program is the example, its figures those of the methods."""

import re
from pathlib import Path

import numpy as np
import pytest

import exudyn_muscles as em

from .reference.make import FOLDER

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def test_the_program_is_the_first_example():
    block = re.search(r"^## The shortest program$.*?```python\n(.*?)```", README, re.M | re.S)
    assert block[1] == (ROOT / "examples" / "01_shortest_program.py").read_text()


@pytest.mark.parametrize("method", ["cmc", "csf", "css"])
def test_the_table_has_the_methods_figures(method):
    stored = em.Trajectory.load(FOLDER / f"pendulum_{method}.npz")
    table = README[README.index("## The paper's Table 2") :]
    row = re.search(rf"^\| {method.upper()} \| (.*) \|$", table, re.M)[1].split(" | ")
    assert float(row[1]) == pytest.approx(np.degrees(stored.tracking_error_rms()[0]), abs=6e-5)
    assert float(row[2]) == (stored.counts.recruitments - 1) / 100


def test_every_example_and_every_file_named_exists():
    for name in re.findall(r"`(\d\d_\w+\.py)`", README):
        assert (ROOT / "examples" / name).is_file()
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(
        re.findall(r"^\| `(\d\d_\w+\.py)`", README, re.M)
    )
    for picture in re.findall(r"\]\((docs/[^)]*)\)", README):
        assert (ROOT / picture).is_file()
