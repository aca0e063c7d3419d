"""Cylinders whose side is along their axis, against OpenSim's lengths."""

import numpy as np
import pytest

import exudyn_muscles as em

from ..own_models import FOLDER
from . import cylinder_model


@pytest.mark.parametrize("side", cylinder_model.SIDES)
def test_sides_along_the_axis_do_what_they_do_in_opensim(side, tmp_path):
    """But where OpenSim's muscle goes around once more than it has to, which it does wherever it
    goes the longer way counterclockwise, and where none is needed on the way that it takes."""
    with np.load(FOLDER / "cylinders.npz") as stored:
        numbers = dict(stored)
    file = tmp_path / "model.osim"
    file.write_text(cylinder_model.model(side))
    model = em.opensim.load_model(file)
    order = ["".join(cylinder_model.POINTS.values()).find(each) for each in model.coordinates]
    places = np.column_stack([numbers["q"], np.zeros(len(numbers["q"]))])[:, order]
    found = np.array([model.geometry(q, np.zeros(len(q))).length[0] for q in places])
    outside = (np.hypot(*numbers["q"][:, [0, 1]].T) > cylinder_model.RADIUS) & (
        np.hypot(*numbers["q"][:, [3, 4]].T) > cylinder_model.RADIUS
    )
    further = (numbers[side] - found)[outside]
    same = np.abs(further) < 1e-4
    assert same.mean() > 0.8
    assert (further[~same] > 3.0 * cylinder_model.RADIUS).all()
    straight = np.linalg.norm(numbers["q"][:, :3] - numbers["q"][:, 3:], axis=1)
    assert 0.4 < (found > straight + 1e-9)[outside].mean() < 0.7
