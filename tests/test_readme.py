"""The README shows what is: its program is the example, its figures those of the methods."""

import re
from pathlib import Path

import numpy as np
import pytest

import exudyn_muscles as em
from models import leg, pendulum

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


@pytest.mark.parametrize(("name", "model"), [("pendulum", pendulum), ("leg", leg)])
def test_the_drift_of_replayed_excitations(name, model):
    stored = em.Trajectory.load(FOLDER / f"{name}_csf.npz")
    replayed = em.forward_dynamics(model.build(), stored.excitations)
    at = np.searchsorted(replayed.time, stored.time - 1e-9)
    drift = np.abs(replayed.coordinates[at] - stored.coordinates).max()
    figure = re.search(rf"([\d.]+) rad on\s+`models/{name}\.py`", README)[1]
    assert float(figure) == pytest.approx(drift, abs=5e-4)


@pytest.mark.filterwarnings("ignore::exudyn_muscles.UnmetTorqueWarning")
@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
def test_the_gains_that_full_cosimulation_bears():
    error = {
        kp: em.cosimulate(
            pendulum.build(),
            pendulum.motion(),
            settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=kp),
        ).tracking_error_rms()[0]
        for kp in (1e7, 1e8, 1e9)
    }
    assert error[1e7] < 1e-5
    assert error[1e8] > 0.1 and error[1e9] > 0.1
    assert "kp = 1e7 1/s^2, and neither at 1e8 nor at 1e9" in README


def test_every_example_and_every_file_named_exists():
    for name in re.findall(r"`(\d\d_\w+\.py)`", README):
        assert (ROOT / "examples" / name).is_file()
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(
        re.findall(r"^\| `(\d\d_\w+\.py)`", README, re.M)
    )
    for picture in re.findall(r"\]\((docs/[^)]*)\)", README):
        assert (ROOT / picture).is_file()
