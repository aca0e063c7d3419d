"""Activation dynamics (5): four laws, their derivatives and limits, and the two one-step rules."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import exudyn_muscles as em
from exudyn_muscles.muscle.activation import activation_rate, trapezoidal
from exudyn_muscles.muscle.rosenbrock import activation_end

from ..differences import difference
from . import hill

EVERY_LAW = pytest.mark.parametrize("law", em.ActivationDynamics)
LEVELS = st.floats(0.01, 1.0)
TAU_A, TAU_D = 0.015, 0.050


def unit(law, smoothing=0.1, **more):
    return em.Muscle(
        "unit",
        max_isometric_force=1000.0,
        optimal_fiber_length=0.1,
        tendon_slack_length=0.2,
        activation_dynamics=law,
        activation_dynamics_smoothing=smoothing,
        **more,
    )


def rate(law, a, u, smoothing=0.1):
    return activation_rate(law.value, a, u, TAU_A, TAU_D, smoothing)


def one_step(law, a, u, h, smoothing=0.1):
    """The trapezoidal rule's."""
    return trapezoidal(law.value, a, u, TAU_A, TAU_D, smoothing, h)


def rosenbrock(law, a, u, h, steps, smoothing=0.1):
    """Activation after `steps` steps, and the estimate of the last one's error."""
    units = em.MuscleSet([unit(law, smoothing)]).tables
    for _ in range(steps):
        a, error = activation_end(units, 0, a, u, h / steps)
    return a, error


# -- the rates ------------------------------------------------------------------------------------


@EVERY_LAW
@given(a=LEVELS, u=LEVELS, smoothing=st.sampled_from([0.1, 10.0, 1000.0]))
def test_rate_is_the_formula(law, a, u, smoothing):
    value, *_ = rate(law, a, u, smoothing)
    assert value == pytest.approx(hill.activation_rate(unit(law, smoothing), a, u), rel=1e-13)
    # The public one, too.
    muscles = em.MuscleSet([unit(law, smoothing)])
    public = em.muscle_dynamics(muscles, [a], [0.2], [0.3], [0.0], [u]).activation_rate[0]
    assert public == pytest.approx(value, rel=1e-14)


@EVERY_LAW
@pytest.mark.parametrize("smoothing", [0.1, 10.0])
def test_partial_derivatives(law, smoothing):
    rng = np.random.default_rng(0)
    for a, u in rng.uniform(0.01, 1.0, (200, 2)):
        step = 1e-3 * min(abs(u - a), 1.0)  # the rate has a kink at u = a
        _, rate_a, rate_u = rate(law, a, u, smoothing)

        def along_a(s, u=u):
            return rate(law, s, u, smoothing)[0]

        def along_u(s, a=a):
            return rate(law, a, s, smoothing)[0]

        rounding = 1e-13 / TAU_A / step
        assert rate_a == pytest.approx(difference(along_a, a, step), rel=1e-8, abs=rounding)
        assert rate_u == pytest.approx(difference(along_u, u, step), rel=1e-8, abs=rounding)


@EVERY_LAW
def test_activation_rests_at_its_excitation(law):
    for level in (0.01, 0.3, 1.0):
        value, rate_a, rate_u = rate(law, level, level)
        assert value == 0.0
        assert rate_a < 0.0 and rate_u == -rate_a
        assert one_step(law, level, level, 0.01) == level
        assert rosenbrock(law, level, level, 0.01, 1) == (level, 0.0)


@EVERY_LAW
def test_activation_goes_towards_its_excitation(law):
    levels = np.linspace(0.01, 1.0, 12)
    for a in levels:
        for u in levels:
            assert np.sign(rate(law, a, u)[0]) == np.sign(u - a)


def test_time_constants_of_the_laws():
    linear, first_order, smooth, bilinear = em.ActivationDynamics
    assert rate(linear, 0.2, 1.0)[0] == pytest.approx(0.8 / TAU_A)
    assert rate(linear, 1.0, 0.2)[0] == pytest.approx(-0.8 / TAU_D)
    # At a = 1/3 the factor 0.5 + 1.5 a is one; it slows rising and speeds up falling.
    for law in (first_order, smooth):
        sharp = 1000.0
        assert rate(law, 1 / 3, 0.9, sharp)[0] == pytest.approx((0.9 - 1 / 3) / TAU_A)
        assert rate(law, 1 / 3, 0.1, sharp)[0] == pytest.approx((0.1 - 1 / 3) / TAU_D)
    assert rate(first_order, 0.9, 1.0)[0] == pytest.approx(0.1 / (1.85 * TAU_A))
    assert rate(first_order, 0.9, 0.8)[0] == pytest.approx(-0.1 * 1.85 / TAU_D)
    # Full excitation has the one time constant, none the other.
    assert rate(bilinear, 0.2, 1.0)[0] == pytest.approx(0.8 / TAU_A)
    assert rate(bilinear, 0.2, 0.6)[0] == pytest.approx(0.4 * (0.6 / TAU_A + 0.4 / TAU_D))
    assert rate(bilinear, 0.8, 0.2)[0] == pytest.approx(-0.6 / TAU_D)


@given(a=LEVELS, u=LEVELS)
def test_the_smooth_law_lies_between_rising_and_falling(a, u):
    first_order, smooth = list(em.ActivationDynamics)[1:3]
    z = 0.5 + 1.5 * a
    ends = sorted([(u - a) / (TAU_A * z), (u - a) * z / TAU_D])
    for b in (1e-3, 0.1, 10.0):
        assert ends[0] - 1e-12 <= rate(smooth, a, u, b)[0] <= ends[1] + 1e-12
    # Without a switch it is their mean, with a sharp one the first-order law.
    assert rate(smooth, a, u, 1e-9)[0] == pytest.approx(0.5 * sum(ends), rel=1e-8, abs=1e-12)
    sharp = rate(smooth, a, u, 1e6)[0]
    if abs(u - a) > 1e-4:
        assert sharp == pytest.approx(rate(first_order, a, u)[0], rel=1e-12)


# -- the trapezoidal rule -------------------------------------------------------------------------


@EVERY_LAW
@given(a=LEVELS, u=LEVELS, h=st.floats(1e-5, 0.02), smoothing=st.sampled_from([0.1, 10.0]))
def test_a_trapezoidal_step_solves_its_equation(law, a, u, h, smoothing):
    end = one_step(law, a, u, h, smoothing)
    slopes = rate(law, a, u, smoothing)[0] + rate(law, end, u, smoothing)[0]
    low, high = sorted([a, u])
    assert low <= end <= high
    if low < end < high:
        assert end == pytest.approx(a + 0.5 * h * slopes, rel=1e-14, abs=1e-15)
    else:  # the equation asks for more than there is
        assert (a + 0.5 * h * slopes - end) * (u - a) >= -1e-15


@EVERY_LAW
@given(a=LEVELS, u=LEVELS, h=st.floats(1e-7, 100.0), smoothing=st.sampled_from([0.1, 10.0, 1000.0]))
def test_a_step_never_crosses_the_excitation(law, a, u, h, smoothing):
    for end in (one_step(law, a, u, h, smoothing), rosenbrock(law, a, u, h, 1, smoothing)[0]):
        assert min(a, u) <= end <= max(a, u)


# -- both rules against the exact solution --------------------------------------------------------


PAIRS = [(0.05, 0.9), (0.9, 0.05), (0.3, 0.35), (0.6, 0.01)]


@EVERY_LAW
@pytest.mark.parametrize("smoothing", [0.1, 10.0])
def test_orders(law, smoothing):
    """The trapezoidal rule has order 2, the Rosenbrock method order 4."""
    h = 0.02
    exact = np.array([hill.activation(unit(law, smoothing), a, u, h) for a, u in PAIRS])

    def by_trapezoidal(a, u, steps):
        for _ in range(steps):
            a = one_step(law, a, u, h / steps, smoothing)
        return a

    def by_rosenbrock(a, u, steps):
        return rosenbrock(law, a, u, h, steps, smoothing)[0]

    for order, solve, counts in ((2, by_trapezoidal, (16, 32, 64)), (4, by_rosenbrock, (4, 8, 16))):
        ends = [[solve(a, u, n) for a, u in PAIRS] for n in counts]
        errors = abs(np.array(ends) - exact).max(axis=1)
        slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
        assert order - 0.2 < slope < order + 0.5, errors


@pytest.mark.parametrize(("a", "u"), PAIRS)
@pytest.mark.parametrize("h", [0.0005, 0.002, 0.005])
def test_linear_filter_has_the_exponential(a, u, h):
    law = em.ActivationDynamics.LINEAR_FILTER
    exact = u + (a - u) * math.exp(-h / (TAU_A if u > a else TAU_D))
    assert hill.activation(unit(law), a, u, h) == pytest.approx(exact, rel=1e-14)
    z = h / (TAU_A if u > a else TAU_D)
    assert abs(rosenbrock(law, a, u, h, 1)[0] - exact) < 0.01 * z**5 * abs(u - a) + 1e-15
    assert one_step(law, a, u, h) == pytest.approx(u + (a - u) * (2 - z) / (2 + z), rel=1e-14)


@EVERY_LAW
def test_the_error_estimate_is_one(law):
    """It is that of the third order: larger than the error, and falls with the fourth power.

    Now and then it passes through zero, so that many steps are taken together.
    """
    pairs = np.random.default_rng(0).uniform(0.01, 1.0, (40, 2))
    estimates = []
    for h in (0.002, 0.001, 0.0005):
        found = np.array([rosenbrock(law, a, u, h, 1) for a, u in pairs])
        exact = np.array([hill.activation(unit(law), a, u, h) for a, u in pairs])
        assert (abs(found[:, 0] - exact) < 0.5 * found[:, 1] + 1e-15).mean() >= 0.95
        estimates.append(found[:, 1])
    orders = np.median(np.log2(np.divide(estimates[:-1], estimates[1:])), axis=1)
    assert (orders > 3.7).all() and (orders < 4.3).all(), orders


def test_rosenbrock_damps_any_step():
    """L-stable: a step far beyond the time constant ends at the excitation."""
    for a, u in PAIRS:
        end, _ = rosenbrock(em.ActivationDynamics.LINEAR_FILTER, a, u, 1e6, 1)
        assert end == pytest.approx(u, abs=1e-5)


@EVERY_LAW
@pytest.mark.parametrize("integrator", em.Integrator)
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_short_time_constants(law, integrator, tolerance):
    """Steps may be far longer than these: between a and u nothing is lost of the accuracy."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        tau_a, tau_d = 10.0 ** rng.uniform(-4.0, -2.0, 2)
        muscle = unit(
            law,
            smoothing=10.0 ** rng.uniform(-1.0, 2.0),
            activation_time_constant=tau_a,
            deactivation_time_constant=tau_d,
            ignore_tendon_compliance=True,
        )
        a, u = rng.uniform(0.01, 1.0, 2)
        window = 10.0 ** rng.uniform(0.0, 2.0) * (tau_a if u > a else tau_d)
        end = em.integrate_window(
            em.MuscleSet([muscle]), [a], [0.2], [u], ([0.3], [0.3]), ([0.0], [0.0]), window,
            tolerance=tolerance, integrator=integrator,
        ).activation[0]  # fmt: skip
        assert min(a, u) <= end <= max(a, u)
        assert end == pytest.approx(hill.activation(muscle, a, u, window), abs=0.2 * tolerance)
