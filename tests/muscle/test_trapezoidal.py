"""One step of the trapezoidal rule, as monolithic integration takes it: the equation that it
solves, order, derivatives with respect to the path."""

import dataclasses

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.muscle.contraction import tendon_rate
from exudyn_muscles.muscle.parameters import PER_STRETCH
from exudyn_muscles.muscle.trapezoidal import step

from ..differences import certified
from . import hill
from .test_contraction import EVERY_LAW
from .test_window import (
    COMES_TO_REST,
    MUSCLE,
    SMOOTH_LAWS,
    TOLERANCE,
    ends,
    load,
    order,
    smooth,
    units_of,
)

FASTEST = hill.FASTEST  # optimal lengths/s


def step_of(muscle, start, end, h):
    """(converged, a, l_t, F, dF/dl, dF/dl') after the step from (a, l_t, u, l, l') to (l, l')."""
    return step(units_of(muscle), 0, *start, *end, h)


# -- order ----------------------------------------------------------------------------------------


def march(muscle, state, N):
    """a and F after N steps through the window."""
    a, l_t, u, *course = state
    h = hill.WINDOW / N
    l, v = hill.cubic(0.0, hill.WINDOW, *course)
    for k in range(1, N + 1):
        end = hill.cubic(k * h, hill.WINDOW, *course)
        converged, a, l_t, F, _, _ = step_of(muscle, (a, l_t, u, l, v), end, h)
        assert converged
        l, v = end
    return a, F


@pytest.mark.parametrize("law", SMOOTH_LAWS.values(), ids=SMOOTH_LAWS)
@pytest.mark.parametrize("dynamics", em.ActivationDynamics)
@pytest.mark.parametrize(("a", "u"), [(0.4, 1.0), (0.6, 0.2)])
def test_second_order(law, dynamics, a, u):
    muscle, state, (a_1, _, F_1) = smooth(law, dynamics, a, u)
    steps = np.array([16, 32, 64, 128])
    errors = abs(np.array([march(muscle, state, N) for N in steps]) - [a_1, F_1])
    assert order(steps, errors[:, 0]) == pytest.approx(2.0, abs=1e-3)
    assert order(steps, errors[:, 1]) == pytest.approx(2.0, abs=1e-3)


# -- the equation ---------------------------------------------------------------------------------


def settled():
    """Muscles and (a, l_t, u, l, l') of the box's states one window later, with new excitations."""
    muscles, states, _ = load()
    end = ends("box", em.Integrator.TRAPEZOIDAL, TOLERANCE)
    u = np.resize([0.01, 0.5, 1.0], len(muscles))
    starts = end.activation, end.tendon_length, u, states[5], states[6]
    return zip(muscles, zip(*starts, strict=True), strict=True)


def error(muscle, start, end, found, h):
    """Of the tendon length over the tendon's stretch at F0: what is missing of the equation but for
    rounding, over the equation's slope."""
    a, l_t, _, l, v = start
    _, a_1, l_t1, _, _, _ = found
    first = hill.rate(muscle, a, l_t, l, v)
    last = end[1] - hill.projection_rate(muscle, a_1, l_t1, end[0])
    missing = l_t + 0.5 * h * (first + last) - l_t1
    if l_t1 >= end[0] - hill.shortest(muscle):
        missing = min(missing, 0.0)  # the fibre would shorten on
    rounding = 1e-12 * (l_t + 0.5 * h * (abs(first) + abs(last)))
    units = units_of(muscle)
    slope = 1.0 - 0.5 * h * tendon_rate(units, 0, a_1, l_t1, *end)[2]
    return (abs(missing) - rounding) / slope * units.table[0, PER_STRETCH]


@pytest.mark.parametrize("h", [1e-3, 1e-2])
def test_a_step_solves_the_trapezoidal_rule(h):
    for muscle, start in settled():
        end = start[3] + h * start[4], start[4]
        converged, a_1, l_t1, F, _, _ = found = step_of(muscle, start, end, h)
        if h == 1e-2 and end[0] < hill.shortest(muscle) + 0.5 * muscle.tendon_slack_length:
            continue  # a path as short as that is no path
        assert converged, muscle.name
        assert error(muscle, start, end, found, h) < 1e-9, muscle.name
        F0 = muscle.max_isometric_force
        expected = max(hill.force(muscle, a_1, l_t1, *end), 0.0)
        assert pytest.approx(expected, abs=1e-11 * F0) == F


@pytest.mark.parametrize(("h", "most", "fewest"), [(1e-3, 740, 700), (1e-2, 640, 600)])
def test_a_step_says_when_it_has_no_solution(h, most, fewest):
    """Far off the balance the trapezoidal rule overshoots: with time constants of 1 us and less it
    need not have a solution at all. What counts as converged is one."""
    muscles, (a, l_t, u, l_0, v_0, _, _), _ = load()
    solved = 0
    for muscle, *start in zip(muscles, a, l_t, u, l_0, v_0, strict=True):
        end = start[3] + h * start[4], start[4]
        found = step_of(muscle, start, end, h)
        solved += found[0]
        # The tendon curves go on straight some way above that force, the oracle's do not.
        if found[0] and found[3] < 10.0 * muscle.max_isometric_force:
            assert error(muscle, start, end, found, h) < 1e-9, muscle.name
    assert fewest < solved < most


def test_a_rigid_tendon_keeps_its_length():
    muscle = dataclasses.replace(MUSCLE, ignore_tendon_compliance=True)
    start = 0.4, 0.2, 0.9, 0.29, 0.1
    converged, a_1, l_t1, F, _, _ = step_of(muscle, start, (0.2905, -0.1), 0.005)
    assert converged
    assert l_t1 == 0.2
    assert pytest.approx(hill.force(muscle, a_1, 0.2, 0.2905, -0.1), rel=1e-12) == F


# -- derivatives ----------------------------------------------------------------------------------


def check_derivatives(muscle, start, end, h):
    """Those of F against differences; whether there is no kink."""
    F0, optimal = muscle.max_isometric_force, muscle.optimal_fiber_length
    (l, v), smooth = end, True
    _, _, _, _, F_l, F_v = step_of(muscle, start, end, h)

    def force(l, v):
        return step_of(muscle, start, (l, v), h)[3]

    for found, function, x, scale in (
        (F_l, lambda l: force(l, v), l, optimal),
        (F_v, lambda v: force(l, v), v, FASTEST * optimal),
    ):
        exact, apart = certified(function, x, scale)
        if apart < 1e-6 * max(abs(exact), 1e-3 * F0 / scale):
            assert found == pytest.approx(exact, rel=1e-5, abs=1e-5 * F0 / scale), muscle.name
        else:
            smooth = False
    return smooth


@pytest.mark.parametrize("h", [1e-3, 1e-2])
def test_derivatives(h):
    checked = [
        check_derivatives(muscle, start, (start[3] + h * start[4], start[4]), h)
        for muscle, start in settled()
    ]
    assert np.mean(checked) > 0.95


@EVERY_LAW
def test_derivatives_of_rigid_tendons(law):
    rng = np.random.default_rng(14)
    checked = []
    for _ in range(25):
        muscle, a, l_t, u, l_0, v_0, l_1, v_1 = hill.draw(rng, law)
        slack = muscle.tendon_slack_length
        muscle = dataclasses.replace(muscle, ignore_tendon_compliance=True)
        start, end = (a, slack, u, l_0 - l_t + slack, v_0), (l_1 - l_t + slack, v_1)
        _, a_1, _, F, _, _ = step_of(muscle, start, end, hill.WINDOW)
        F0 = muscle.max_isometric_force
        assert pytest.approx(hill.force(muscle, a_1, slack, *end), abs=1e-11 * F0) == F
        checked.append(check_derivatives(muscle, start, end, hill.WINDOW))
    assert np.mean(checked) > 0.9


@pytest.mark.parametrize("law", COMES_TO_REST.values(), ids=COMES_TO_REST)
@pytest.mark.parametrize("stretch", [-0.03, -0.001, 0.0002])
@pytest.mark.parametrize("speed", [-0.05, -0.5])
def test_derivatives_at_the_stop(law, stretch, speed):
    """The fibre keeps its length and the tendon takes up all changes, without a force if slack."""
    muscle = dataclasses.replace(MUSCLE, law=law)
    l_t, h = muscle.tendon_slack_length * (1.0 + stretch), 1e-3
    l = l_t + hill.shortest(muscle)
    start, end = (1.0, l_t, 1.0, l, speed), (l + h * speed, speed)
    converged, _, l_t1, _, F_l, F_v = step_of(muscle, start, end, h)
    assert converged
    assert l_t1 == pytest.approx(end[0] - hill.shortest(muscle), abs=1e-15)
    assert F_v == 0.0
    tendon = tuple(
        max(hill.force(muscle, 1.0, l_t1 + side * 1e-6, 0.0, 0.0), 0.0) for side in (-1.0, 1.0)
    )
    assert F_l == pytest.approx((tendon[1] - tendon[0]) / 2e-6, rel=1e-5)
    assert check_derivatives(muscle, start, end, h)


@EVERY_LAW
def test_derivatives_with_a_slack_tendon(law):
    rng = np.random.default_rng(15)
    checked = []
    for _ in range(40):
        muscle, a, _, u, *_ = hill.draw(rng, law)
        l_t = muscle.tendon_slack_length * rng.uniform(0.95, 1.0)
        v = rng.uniform(-2.0, 2.0) * muscle.optimal_fiber_length
        l = l_t + rng.uniform(0.6, 1.2) * muscle.optimal_fiber_length
        start, end = (a, l_t, u, l, v), (l + 1e-3 * v, v)
        assert step_of(muscle, start, end, 1e-3)[0]
        checked.append(check_derivatives(muscle, start, end, 1e-3))
    assert np.mean(checked) > 0.9
