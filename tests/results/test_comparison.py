"""Differences are named, and judged by the model's strength."""

import dataclasses

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.results.quantities import QUANTITIES, When

from ..reference.make import FOLDER


def changed(trajectory, name, row, column, by):
    array = getattr(trajectory, name).copy()
    array[row, column] += by
    return dataclasses.replace(trajectory, **{name: array})


def test_compare_names_quantity_time_and_size(csf):
    difference = changed(csf, "tendon_forces", 40, 1, 7.5).compare(csf)
    assert difference.quantity == "tendon_forces"
    assert difference.time == pytest.approx(0.40)
    assert difference.size == pytest.approx(7.5)
    assert str(difference).startswith("tendon_forces differ by 7.5 at t = 0.4 s, allowed is 0.2")
    # The first in time, and motion before muscles.
    two = changed(changed(csf, "tendon_forces", 40, 1, 7.5), "coordinates", 60, 0, 1e-3)
    assert two.compare(csf).quantity == "coordinates"
    window = changed(csf, "excitation_values", 10, 0, 0.1).compare(csf)
    assert (window.quantity, window.time) == ("excitations", pytest.approx(0.11))


@pytest.fixture(scope="module")
def strained():
    """A stored result with reserves that help and a demand out of reach."""
    one = em.Trajectory.load(FOLDER / "planar_arm_csf.npz")
    help_ = 0.1 * one.torques_delivered[:1] + np.zeros((one.windows + 1, 2))
    return dataclasses.replace(
        one,
        reserve_names=("shoulder_reserve", "elbow_reserve"),
        reserves=help_,
        torques_unmet=0.2 * one.torques_demanded,
        start_unmet=0.2 * one.torques_demanded[0],
        torques_ideal=0.1 * one.torques_delivered,
    )


STRENGTH = [one.field for one in QUANTITIES if one.unit in ("N", "N m or N")]


@pytest.mark.parametrize("times", [100.0, 0.01])
@pytest.mark.parametrize("name", STRENGTH)
def test_compare_finds_the_same_relative_error_of_a_model_of_any_strength(name, times, strained):
    quantity = next(one for one in QUANTITIES if one.field == name)
    of = "tendon_forces" if quantity.unit == "N" else "torques_delivered"
    scale = np.abs(getattr(strained, of)).max()
    other = {field: times * getattr(strained, field) for field in STRENGTH}
    for model, size in ((strained, scale), (dataclasses.replace(strained, **other), times * scale)):
        for share, found in ((0.9, None), (1.1, name)):
            array = getattr(model, name).copy()
            array[(-1,) * array.ndim] += share * quantity.tolerance * size
            difference = dataclasses.replace(model, **{name: array}).compare(model)
            assert (difference and difference.quantity) == found
            if found:
                assert difference.tolerance == pytest.approx(quantity.tolerance * size, rel=1e-3)


def test_torques_that_cancel_may_differ_by_rounding(csf):
    still = {name: np.zeros_like(getattr(csf, name)) for name in STRENGTH if "torque" in name}
    held = dataclasses.replace(csf, **still)
    assert changed(held, "torques_delivered", 5, 0, 1e-9).compare(held) is None
    assert changed(held, "torques_delivered", 5, 0, 1e-2).compare(held) is not None


def test_what_an_older_reference_did_not_store_is_not_compared():
    now = em.Trajectory.load(FOLDER / "results" / "version_2.npz")
    older = dataclasses.replace(now, tendon_lengths=np.full_like(now.tendon_lengths, np.nan))
    assert now.compare(older) is None
    assert older.compare(now).quantity == "tendon_lengths"


def test_compare_notices_another_start(csf):
    difference = dataclasses.replace(csf, start_unmet=np.array([1.0])).compare(csf)
    assert difference[:3] == ("start_unmet", 0.0, 1.0)


def test_compare_of_results_without_windows(csf):
    windows = {
        one.field: getattr(csf, one.field)[:0] for one in QUANTITIES if one.when is When.WINDOWS
    }
    nothing = dataclasses.replace(
        csf, window_time=csf.window_time[:1], reserves=csf.reserves[:1], **windows
    )
    assert nothing.compare(nothing) is None
    assert nothing.compare(csf).quantity == "window_time"
    pytest.importorskip("pandas")
    assert "excitations/left" not in nothing.to_dataframe()


def test_compare_with_own_tolerances(csf):
    other = changed(csf, "tendon_forces", 40, 1, 7.5)
    assert other.compare(csf, {"tendon_forces": 10.0}) is None
    with pytest.raises(em.ParameterError, match="no such quantities: \\['forces'\\]"):
        other.compare(csf, {"forces": 1.0})


def test_compare_notices_nan_names_and_shapes(csf, cmc):
    assert changed(csf, "speeds", 3, 0, np.nan).compare(csf).quantity == "speeds"
    assert csf.compare(cmc).quantity == "method"
    renamed = dataclasses.replace(csf, coordinate_names=("phi",))
    assert renamed.compare(csf).quantity == "coordinate_names"
    short = dataclasses.replace(csf, time=csf.time[:-1])
    assert short.compare(csf).quantity == "time"
