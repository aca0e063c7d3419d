"""Limits of controls over time."""

import dataclasses
import re

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.recruitment.limits import Limits

MUSCLES = em.MuscleSet(
    em.Muscle(name, max_isometric_force=1e3, optimal_fiber_length=0.1, tendon_slack_length=0.1)
    for name in ("flexor", "extensor")
)
RESERVES = [em.Reserve("elbow", 20.0, -2.0, 3.0), em.Reserve("wrist", 5.0)]


def test_without_limits_of_their_own():
    u, forces = Limits({}, MUSCLES, RESERVES).at(0.3)
    np.testing.assert_array_equal(u, [[0.01, 0.01], [1.0, 1.0]])
    np.testing.assert_array_equal(forces, [[-40.0, -np.inf], [60.0, np.inf]])


def test_the_muscles_own_limits():
    own = em.MuscleSet(
        [dataclasses.replace(muscle, min_control=0.1, max_control=0.7) for muscle in MUSCLES]
    )
    given = {"flexor": em.ControlLimits(0.0, 1.0)}
    u, _ = Limits(given, own, RESERVES).at(0.0)
    np.testing.assert_array_equal(u, [[0.01, 0.1], [1.0, 0.7]])


def test_constant_limits():
    given = {
        "extensor": em.ControlLimits(0.0, 0.5),
        "wrist_reserve": em.ControlLimits(-1.0, 2.0),
    }
    u, forces = Limits(given, MUSCLES, RESERVES).at(7.0)
    np.testing.assert_array_equal(u, [[0.01, 0.01], [1.0, 0.5]])  # not below minimum activation
    np.testing.assert_array_equal(forces, [[-40.0, -5.0], [60.0, 10.0]])


def test_limits_run_linearly_and_stay_at_the_ends():
    given = em.ControlLimits(([1.0, 2.0, 4.0], [0.1, 0.3, 0.2]), 0.9)
    found = [given.at(t) for t in (0.0, 1.5, 3.0, 9.0)]
    np.testing.assert_allclose(found, [[0.1, 0.9], [0.2, 0.9], [0.25, 0.9], [0.2, 0.9]])


def test_between_times_as_numpy_interpolates():
    """In all its cases: at and beyond the times, between equal values, towards no limit at all."""
    times = np.array([0.1, 0.4, 0.5, 0.9, 1.3])
    values = np.array([0.2, 0.2, 0.7, np.inf, 0.4])
    given = em.ControlLimits(-1.0, (times, values))
    limits = Limits({"elbow_reserve": given}, MUSCLES, RESERVES)
    for t in (*times, 0.0, 0.2, 0.45, 0.7, 1.1, 1.299, 2.0):
        high = np.interp(t, times, values)
        assert given.at(t) == (-1.0, high)
        _, forces = limits.at(t)
        assert forces[:, 0].tolist() == [-20.0, 20.0 * high]


def test_steps_hold_up_to_their_time():
    """As OpenSim's with use_steps, whatever the rounding of a window's end."""
    given = em.ControlLimits(0.0, ([0.1, 0.2, 0.3], [0.5, 0.6, 0.7]), steps=True)
    for t, high in ((0.0, 0.5), (0.1, 0.5), (0.15, 0.6), (0.2 + 1e-12, 0.6), (0.21, 0.7), (9, 0.7)):
        assert given.at(t) == (0.0, high)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ((0.5, 0.4), "minimum 0.5 is above maximum 0.4 at t = 0 s"),
        ((([0, 2], [0, 1]), ([1], [0.6])), "minimum 1 is above maximum 0.6 at t = 2 s"),
        ((([0, 0], [0, 1]), 1.0), "minimum is a number, or increasing times and as many values"),
        ((0.0, ([0, 1], [1])), "maximum is a number"),
        ((0.0, "one"), "maximum is a number"),
        ((np.nan, 1.0), "minimum is a number"),
        ((np.inf, np.inf), "no control is above inf or below -inf"),
        ((-np.inf, -np.inf), "no control is above inf or below -inf"),
        ((0.0, 1.0, "yes"), "steps is True or False, got 'yes'"),
    ],
)
def test_limits_that_are_none(limits, message):
    with pytest.raises(em.ParameterError, match=re.escape(message)):
        em.ControlLimits(*limits)


@pytest.mark.parametrize(
    ("name", "limits", "message"),
    [
        ("toe", (0.0, 1.0), "control limits of 'toe': the actuators are flexor, extensor, elbow_"),
        ("flexor", (0.0, 1.5), "muscle 'flexor': control limits [0, 1.5] at t = 0 s are outside"),
        ("flexor", (0.0, 0.005), "muscle 'flexor': a maximum control of 0.005 at t = 0 s is below"),
    ],
)
def test_limits_that_do_not_fit_the_model(name, limits, message):
    with pytest.raises(em.ParameterError, match=re.escape(message)):
        Limits({name: em.ControlLimits(*limits)}, MUSCLES, RESERVES)


def test_limits_are_values():
    """They compare, and do not change with the lists that they were given."""
    times, values = [0.0, 1.0], [0.1, 0.2]
    given = em.ControlLimits((times, values), 1)
    values[0] = 5.0
    assert given == em.ControlLimits((np.array([0.0, 1.0]), np.array([0.1, 0.2])), 1.0)
    assert given.at(0.0) == (0.1, 1.0)
