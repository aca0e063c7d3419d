"""Muscles through a ring beside OpenSim's, and what is wrong in a file."""

import numpy as np
import pytest

import exudyn_muscles as em

from ..own_models import FOLDER
from . import torus_model

# OpenSim's cylinder lies next to the straight line, ours where it holds the muscle most.
LONGER = 3.5e-4  # m


def load(tmp_path, text):
    file = tmp_path / "model.osim"
    file.write_text(text)
    return em.opensim.load_model(file)


@pytest.mark.parametrize("side", torus_model.SIDES)
def test_lengths_are_opensims_but_for_the_place_of_the_cylinder(side, tmp_path):
    model = load(tmp_path, torus_model.model(side))
    with np.load(FOLDER / "torus.npz") as stored:
        q, expected = stored["q"], stored[side]
    order = [list(torus_model.RANGES).index(each) for each in model.coordinates]
    lengths = np.array([model.geometry(row, 0.0 * row).length[0] for row in q[:, order]])
    straight = np.linalg.norm(q[:, 1:] - [0.05, 0.03, 0.12], axis=1)
    wraps = expected > straight + 1e-7
    assert 3 <= wraps.sum() <= 10
    np.testing.assert_allclose(lengths[~wraps], expected[~wraps], rtol=0, atol=1e-6)
    np.testing.assert_array_less(expected - 1e-9, lengths)
    np.testing.assert_array_less(lengths, expected + LONGER)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<outer_radius>0.06", "<outer_radius>0.01", "WrapTorus 'ring': outer_radius = 0.01 m is"),
        ("<inner_radius>0.02", "<inner_radius>0", "inner_radius = 0.0 m is outside"),
        ("<inner_radius>0.02</inner_radius>", "", "there is no inner_radius in it"),
    ],
)
def test_what_is_wrong(old, new, message, tmp_path):
    text = torus_model.model()
    assert old in text
    with pytest.raises(em.ModelFileError, match=message):
        load(tmp_path, text.replace(old, new))
