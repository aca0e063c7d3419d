"""Regression: all methods on all models against stored results."""

import pytest

import exudyn_muscles as em

from .reference.make import FOLDER, MODELS, results

METHODS = ("static", "cmc", "csf", "css", "consistent", "forward")
DEFAULT = ("static_default", "csf_default", "css_default", "consistent_default")


@pytest.fixture(scope="module")
def made():
    return results()


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("method", METHODS + DEFAULT)
def test_the_result_is_the_stored_one(made, model, method):
    reference = em.Trajectory.load(FOLDER / f"{model}_{method}.npz")
    difference = made[f"{model}_{method}"].compare(reference)
    assert difference is None, str(difference)


def test_every_result_is_stored(made):
    stored = {file.stem for file in FOLDER.glob("*_*.npz")} - {"window_box", "deprecated_muscles"}
    assert stored == set(made)
