"""Excitations given muscle by muscle, as functions of time, and as functions of the state."""

import re
from collections import deque
from pathlib import Path

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum, planar_arm

from ..runs import plugin_run, settings

FIELDS = (
    "coordinates", "speeds", "activations", "tendon_forces", "tendon_lengths", "excitation_values",
    "window_time",
)  # fmt: skip


def same_bits(first, second):
    return all(np.array_equal(getattr(first, name), getattr(second, name)) for name in FIELDS)


def reflex(delay):
    """A stretch reflex of all muscles: how much longer they were a while ago than at the start."""
    memory, first = deque(), []

    def function(t, state):
        memory.append((t, state.musculotendon_lengths))
        first[:] = first or [state.musculotendon_lengths]
        while len(memory) > 1 and memory[1][0] <= t - delay + 1e-9:
            memory.popleft()
        return np.clip(0.1 + 20.0 * (memory[0][1] - first[0]), 0.0, 1.0)

    return function


def moving_arm():
    model = planar_arm.build()
    model.skeleton.set_initial_state(np.radians([20.0, 60.0]), np.array([1.0, -2.0]))
    return model


# Functions of time


def test_a_constant_function_is_a_single_window():
    model, values = pendulum.build(), {"right": 0.1, "left": 0.5}
    asked = em.forward_dynamics(model, em.ExcitationFunction(lambda t: values, end=0.05))
    given = em.forward_dynamics(
        model, em.Excitations.from_mapping([0.0, 0.05], values, model.muscles.names)
    )
    assert len(asked.excitation_values) == 1
    assert asked.excitation_values[0].tolist() == [0.5, 0.1]
    assert same_bits(asked, given)


def test_a_function_of_time_is_asked_for_the_middle_of_every_step():
    model = pendulum.build()

    def ramp(t, slope=4.0):  # what only has a default is no state
        return [0.2 + slope * t, 0.2]

    result = em.forward_dynamics(model, em.ExcitationFunction(ramp, end=0.12, start=0.1))
    middles = 0.5 * (result.time[1:] + result.time[:-1])
    np.testing.assert_array_equal(result.window_time, result.time)
    np.testing.assert_allclose(result.excitation_values[:, 0], 0.2 + 4.0 * middles, rtol=1e-14)
    assert result.activations[0].tolist() == [0.6000000000000001, 0.2]
    assert same_bits(result, em.forward_dynamics(model, result.excitations))


# Functions of the state


def test_a_delayed_reflex_replays_to_the_bit():
    model = moving_arm()
    result = em.forward_dynamics(
        model, em.ExcitationFunction(reflex(0.02), end=0.2, activations=0.1)
    )
    assert np.ptp(result.excitation_values, axis=0).max() > 0.1
    assert (result.activations[0] == 0.1).all()
    replayed = em.forward_dynamics(planar_arm.build(), result.excitations)
    assert same_bits(result, replayed)
    # The reflex matters: without it the arm goes elsewhere.
    without = em.Excitations([0.0, 0.2], np.full((1, 6), 0.1), initial=result.excitations.initial)
    other = em.forward_dynamics(model, without)
    assert np.abs(other.coordinates[-1] - result.coordinates[-1]).max() > 0.01


def test_a_function_senses_what_was_accepted():
    model, seen = moving_arm(), []

    def watching(t, state):
        seen.append((t, state))
        return np.full(6, 0.1 + 0.5 * t)

    result = em.forward_dynamics(model, em.ExcitationFunction(watching, end=0.05))
    assert [t for t, _ in seen] == result.time[:-1].tolist()
    assert (result.activations[0] == model.muscles.minimum_activation).all()
    for name in ("coordinates", "speeds", "activations", "tendon_forces", "musculotendon_lengths",
                 "fiber_lengths"):  # fmt: skip
        sensed = np.array([getattr(state, name) for _, state in seen])
        np.testing.assert_allclose(sensed, getattr(result, name)[:-1], rtol=1e-12, atol=1e-15)
    _, state = seen[7]
    speed = model.geometry(state.coordinates, state.speeds).lengthening_speed
    np.testing.assert_allclose(state.lengthening_speeds, speed, rtol=0, atol=1e-15)
    with pytest.raises(ValueError, match="read-only"):
        state.activations[0] = 1.0


def test_rejected_steps_leave_no_trace_in_a_reflex():
    """One of 23 tries is rejected at its full size: the reflex is asked once for each state that
    was accepted, however often the step from there is tried."""
    model, log = moving_arm(), []
    follow = reflex(0.01)

    def logged(t, state):
        u = follow(t, state)
        log.append((t, u))
        return u

    tries = {"all": 0, "rejected": 0}

    def post_newton(mbs, t):
        tries["all"] += 1
        h = t - mbs.systemData.GetTime(exu.ConfigurationType.StartOfStep)
        if tries["all"] % 23 == 0:
            tries["rejected"] += 1
            return [10.0, 0.5 * h]
        return [0.0, -1.0]

    model.mbs.SetPostNewtonUserFunction(post_newton)
    plugin = em.ForwardPlugin(model, em.ExcitationFunction(logged, end=0.2))
    result = plugin_run(model, plugin, settings(0.001, 0.2))
    assert result.counts.rejected_steps == tries["rejected"] > 5
    assert [t for t, _ in log] == result.time[:-1].tolist()
    used = np.repeat(result.excitation_values, np.diff(
        np.searchsorted(result.time, result.window_time)
    ), axis=0)  # fmt: skip
    lowest = model.muscles.minimum_activation
    np.testing.assert_array_equal(used, [np.maximum(u, lowest) for _, u in log])
    # The same rejections with the used excitations: the same motion.
    tries.update(all=0)
    model.skeleton.set_initial_state(*result.excitations.initial[:2])
    again = plugin_run(model, em.ForwardPlugin(model, result.excitations), settings(0.001, 0.2))
    assert same_bits(result, again)


def test_a_plugin_runs_twice_with_the_same_bits():
    model = moving_arm()

    def stiff(t, state):
        return np.clip(5.0 * (state.fiber_lengths - 0.08), 0.0, 1.0)

    plugin = em.ForwardPlugin(model, em.ExcitationFunction(stiff, end=0.05))
    first, second = (plugin_run(model, plugin, settings(0.001, 0.05)) for _ in range(2))
    assert same_bits(first, second)


def test_what_the_documents_show_runs_as_it_stands():
    text = (Path(__file__).parents[2] / "docs/given.md").read_text()
    mapping, functions = re.findall(r"```python\n(.*?)```", text, re.S)[:2]
    model = pendulum.build()
    model.skeleton.set_initial_state(np.array([0.4]), np.array([0.5]))
    shown = {"em": em, "np": np, "model": model, "names": model.muscles.names}
    exec(mapping + functions, shown)
    np.testing.assert_array_equal(shown["u"].values, [[0.2, 0.1], [0.5, 0.1]])
    assert np.ptp(shown["result"].excitation_values, axis=0).min() > 0.1
    assert same_bits(shown["result"], shown["again"])
    burst = em.forward_dynamics(model, shown["burst"]).excitation_values
    np.testing.assert_allclose(burst, [[0.1, 0.1], [0.5, 0.1]])


# What is wrong is named


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        ([0.5, 1.5], r"'right': excitation 1\.5 at t = 0\.012 s is outside \[0, 1\]"),
        ([np.nan, 0.5], r"'left': excitation nan at t = 0\.012 s is outside \[0, 1\]"),
        ({"left": 0.1, "right": -0.2}, r"'right': excitation -0\.2 at t = 0\.012 s is outside"),
        ([0.5], r"at t = 0\.012 s: the shape is \(1,\), expected \(2,\), .* left, right"),
        (0.5, r"the shape is \(\), expected \(2,\)"),
        ({"left": 0.5}, "the names are left, expected left, right"),
        ({"left": "much", "right": 1}, "are no numbers"),
    ],
)
def test_what_a_function_returned_is_named_with_its_time(returned, message):
    model = pendulum.build()

    def function(t, state):
        return [0.5, 0.5] if t < 0.0115 else returned

    with pytest.raises(em.ParameterError, match=message) as caught:
        em.forward_dynamics(model, em.ExcitationFunction(function, end=0.05))
    assert caught.value.trajectory.time[-1] == pytest.approx(0.012)
    assert caught.value.trajectory.status is em.Status.INCOMPLETE


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (lambda t: [0.5, 0.5], r"got function; give it as ExcitationFunction\(function, end=...\)"),
        ({"left": 0.5, "right": 0.5}, r"got dict; give it as Excitations\.from_mapping"),
        ([0.5, 0.5], r"got list; give it as Excitations\(time, values\)"),
    ],
)
def test_other_kinds_are_told_what_they_should_be(given, message):
    with pytest.raises(em.ParameterError, match=message):
        em.forward_dynamics(pendulum.build(), given)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((lambda: 0.0, 1.0), r"takes \(\), expected \(t\), or \(t, state\)"),
        ((lambda t, s, x: 0.0, 1.0), r"takes \(t, s, x\), expected"),
        ((0.5, 1.0), "expected a function of t, or of t and the state, got 0.5"),
        ((lambda t: 0.0, 0.0), "end = 0 s is not after start = 0 s"),
        ((lambda t: 0.0, np.nan), "end = nan s is outside"),
    ],
)
def test_a_bad_function_is_named(arguments, message):
    with pytest.raises(em.ParameterError, match=message):
        em.ExcitationFunction(*arguments)


def test_bad_activations_at_the_start_are_named():
    given = em.ExcitationFunction(lambda t, state: [0.5, 0.5], end=0.1, activations=[0.1, 0.2, 0.3])
    with pytest.raises(em.ParameterError, match=r"activations: the shape is \(3,\)"):
        em.forward_dynamics(pendulum.build(), given)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"left": 0.5}, "the names are left, expected left, right"),
        ({"left": 0.5, "right": 0.5, "toe": 0.5}, "left, right, toe, expected left, right"),
        ({"left": 0.5, "right": [0.1, 0.2, 0.3]}, r"'right' has the shape \(3,\), expected a "
         r"number or \(2,\), one value for each window between 3 times"),
        ({"left": "x", "right": 0.5}, "'left' has the shape"),
        ({"left": 0.5, "right": [0.1, np.nan]}, "nan at t = 0.1 s, in column 1 of the values, "
         "must be finite"),
    ],
)  # fmt: skip
def test_a_mapping_says_what_is_wrong(values, message):
    with pytest.raises(em.ParameterError, match=message):
        em.Excitations.from_mapping([0.0, 0.1, 0.2], values, ("left", "right"))


def test_an_array_says_what_is_wrong_with_its_shape():
    given = em.Excitations([0.0, 0.1, 0.2], np.full((2, 3), 0.5))
    message = r"3 muscles .* the shape \(2, 3\), expected \(2, 2\) with the columns left, right"
    with pytest.raises(em.ParameterError, match=message):
        em.forward_dynamics(pendulum.build(), given)
