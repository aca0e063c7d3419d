"""Muscle and MuscleSet: bad input is named with muscle, parameter, value and range."""

import dataclasses
import math

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.muscle.parameters import RANGES

GOOD = {
    "max_isometric_force": 1000.0,
    "optimal_fiber_length": 0.1,
    "tendon_slack_length": 0.2,
    "pennation_angle_at_optimal": 0.1,
}


@pytest.mark.parametrize("parameter", RANGES)
@pytest.mark.parametrize("value", [math.nan, -1.0, math.inf, -math.inf, None, "much", [1.0, 2.0]])
def test_bad_value_is_named(parameter, value):
    with pytest.raises(em.ParameterError) as error:
        em.Muscle("flexor", **{**GOOD, parameter: value})
    low, high, unit = RANGES[parameter]
    for part in ("'flexor'", parameter, repr(value), f"[{low:g}, {high:g}] {unit}"):
        assert part in str(error.value)


@pytest.mark.parametrize("parameter", [name for name in RANGES if "pennation" not in name])
def test_zero_is_not_allowed(parameter):
    with pytest.raises(em.ParameterError, match=parameter):
        em.Muscle("flexor", **{**GOOD, parameter: 0.0})


@pytest.mark.parametrize("parameter", RANGES)
def test_ends_of_the_range_are_allowed(parameter):
    for value in RANGES[parameter][:2]:
        if (parameter, value) == ("maximum_pennation_angle", 0.0):
            continue  # below the pennation at the optimal length
        assert getattr(em.Muscle("flexor", **{**GOOD, parameter: value}), parameter) == value


@pytest.mark.parametrize("angle", [-0.1, 1.5, math.pi / 2, math.nan])
def test_pennation_out_of_range(angle):
    with pytest.raises(em.ParameterError, match=r"'flexor': pennation_angle_at_optimal = .* rad"):
        em.Muscle("flexor", **{**GOOD, "pennation_angle_at_optimal": angle})


def test_pennation_above_the_muscles_own_maximum():
    with pytest.raises(em.ParameterError, match=r"pennation_angle_at_optimal = 0\.3 .*0\.2"):
        em.Muscle(
            "flexor",
            **{**GOOD, "pennation_angle_at_optimal": 0.3},
            maximum_pennation_angle=0.2,
        )


@pytest.mark.parametrize("name", ["", None, 3])
def test_bad_name(name):
    with pytest.raises(em.ParameterError, match="name"):
        em.Muscle(name, **GOOD)


def test_duplicate_names():
    twice = [em.Muscle("flexor", **GOOD), em.Muscle("other", **GOOD), em.Muscle("flexor", **GOOD)]
    with pytest.raises(em.ParameterError, match=r"more than once: \['flexor'\]"):
        em.MuscleSet(twice)


def test_no_muscle():
    with pytest.raises(em.ParameterError, match="none"):
        em.MuscleSet([])


def test_bad_input_is_a_value_error():
    assert issubclass(em.ParameterError, ValueError)
    assert issubclass(em.ParameterError, em.ExudynMusclesError)


def test_a_muscle_is_frozen():
    muscle = em.Muscle("flexor", **GOOD)
    with pytest.raises(dataclasses.FrozenInstanceError):
        muscle.max_isometric_force = 1.0


def test_the_set_is_read_only_and_in_order():
    names = ["c", "a", "b"]
    muscles = em.MuscleSet(
        em.Muscle(name, **{**GOOD, "max_isometric_force": 100.0 * (k + 1)})
        for k, name in enumerate(names)
    )
    assert muscles.names == ("c", "a", "b")
    assert [muscle.name for muscle in muscles] == names
    assert len(muscles) == 3
    np.testing.assert_array_equal(muscles.max_isometric_force, [100.0, 200.0, 300.0])
    np.testing.assert_array_equal(muscles.optimal_fiber_length, [0.1] * 3)
    np.testing.assert_array_equal(muscles.minimum_activation, [0.01] * 3)
    with pytest.raises(ValueError, match="read-only"):
        muscles.max_isometric_force[0] = 1.0


def test_shortest_taut_length():
    """0.2 optimal lengths without pennation; the steepest fibre with it."""
    straight = em.Muscle("straight", **{**GOOD, "pennation_angle_at_optimal": 0.0})
    pennate = em.Muscle("pennate", **{**GOOD, "pennation_angle_at_optimal": 0.5})
    shortest = em.MuscleSet([straight, pennate]).shortest_taut_length
    width = 0.1 * math.sin(0.5)
    assert shortest[0] == pytest.approx(0.2 + 0.02)
    assert shortest[1] == pytest.approx(0.2 + width / math.tan(math.acos(0.1)))
