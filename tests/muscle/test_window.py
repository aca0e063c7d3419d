"""Window integration by both integrators: accuracy over the whole box and beyond, order, the stop,
rigid tendons, sensitivity, determinism, errors."""

import dataclasses
import itertools
from functools import cache

import hypothesis
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import exudyn_muscles as em
from exudyn_muscles.muscle import window as kernels
from exudyn_muscles.muscle.course import LEAST_STIFFNESS, MAX_STEPS
from exudyn_muscles.muscle.parameters import PER_STRETCH

from ..differences import difference
from ..zoo import LAWS
from . import hill
from .make_window_box import load, within
from .test_contraction import EITHER_INTEGRATOR, EVERY_LAW

TOLERANCE = 1e-4  # of the force at the end of a window, over F0
TOLERANCES = [1e-3, 1e-4, 1e-5, 1e-6]
EITHER_KIND = pytest.mark.parametrize("kind", ["box", "ordinary"])

load = cache(load)


def integrate(muscles, states, integrator, tolerance=TOLERANCE, window=hill.WINDOW):
    """Of states (a, l_t, u, l_0, v_0, l_1, v_1), (7, m)."""
    a, l_t, u, l_0, v_0, l_1, v_1 = states
    return em.integrate_window(
        muscles, a, l_t, u, (l_0, l_1), (v_0, v_1), window,
        tolerance=tolerance, integrator=integrator,
    )  # fmt: skip


def at_steps(muscle, state, integrator, mesh, steps, tolerance=TOLERANCE, window=hill.WINDOW):
    """(steps, a, l_t, F, dF/du) of one muscle; `steps` = 0 writes the mesh."""
    units = em.MuscleSet([muscle]).units
    return kernels.integrate(
        integrator.value, units, 0, *state, window, tolerance, mesh, steps
    )  # fmt: skip


def trail(muscle, state, integrator, tolerance=TOLERANCE, window=hill.WINDOW):
    """Time, activation, tendon length and musculotendon length at the end of every step."""
    mesh = np.empty(MAX_STEPS)
    n, *_ = at_steps(muscle, state, integrator, mesh, 0, tolerance, window)
    assert n > 0
    for k in range(n):
        _, a, l_t, *_ = at_steps(muscle, state, integrator, mesh, k + 1, tolerance, window)
        yield mesh[k], a, l_t, hill.cubic(mesh[k], window, *state[3:])[0]


# -- the reference windows ------------------------------------------------------------------------


def test_the_box_is_the_whole_box():
    muscles, (a, l_t, u, l_0, v_0, l_1, v_1), _ = load()
    optimal = muscles.optimal_fiber_length
    f = [hill.tension(*pair) for pair in zip(muscles, l_t, strict=True)]
    fiber = [hill.fiber(*state)[0] for state in zip(muscles, l_t, l_0, strict=True)]
    assert a.min() < 0.011
    assert a.max() > 0.99
    assert u.min() == 0.01
    assert u.max() == 1.0
    assert min(f) < -0.09
    assert max(f) > 1.99
    assert min(fiber) < 0.31
    assert max(fiber) > 1.79
    assert max(abs(v_0 / optimal).max(), abs(v_1 / optimal).max()) > 14.9
    ratio = [muscle.tendon_slack_length / muscle.optimal_fiber_length for muscle in muscles]
    assert min(ratio) < 0.11
    assert max(ratio) > 9.0
    assert {muscle.activation_dynamics for muscle in muscles} == set(em.ActivationDynamics)
    assert min(np.bincount([list(LAWS.values()).index(muscle.law) for muscle in muscles])) == 0
    assert all(len({muscle.law for muscle in muscles}) == 4 for muscles in [muscles])


def test_ordinary_states_are_taut_and_within_the_box():
    muscles, (_, l_t, _, l_0, *_), _ = load("ordinary")
    for k, muscle in enumerate(muscles):
        F = muscle.max_isometric_force * hill.tension(muscle, l_t[k])
        assert within(muscle, l_t[k], F, l_0[k]), k


@EITHER_KIND
@pytest.mark.parametrize("number", [0, 130, 260, 390])
def test_stored_references_are_what_the_oracle_gives(kind, number):
    muscles, states, ends = load(kind)
    muscle = list(muscles)[number]
    again = hill.window(muscle, *states[:, number])
    F0 = muscle.max_isometric_force
    assert again == pytest.approx(tuple(ends[:, number]), abs=1e-9, rel=1e-9)
    assert again[2] == pytest.approx(ends[2, number], abs=1e-9 * F0)


@EITHER_KIND
@EITHER_INTEGRATOR
@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_error_is_below_the_tolerance(kind, integrator, tolerance):
    """In 99 % of the windows, and never above ten times."""
    muscles, states, (a, l_t, F) = load(kind)
    end = integrate(muscles, states, integrator, tolerance)
    error = abs(end.force - F) / muscles.max_isometric_force
    assert np.mean(error > tolerance) <= 0.01
    assert error.max() < 10.0 * tolerance, f"state {error.argmax()}"
    assert abs(end.activation - a).max() < tolerance
    # A slack tendon bears nothing now, but soon may.
    error = abs(end.tendon_length - l_t) * muscles.units.table[:, PER_STRETCH]
    assert np.mean(error > tolerance / LEAST_STIFFNESS) <= 0.01
    assert error.max() < 10.0 * tolerance / LEAST_STIFFNESS, f"state {error.argmax()}"


def test_default_tolerance():
    assert kernels.DEFAULT_TOLERANCE == TOLERANCE


@EVERY_LAW
def test_fresh_draws(law):
    rng = np.random.default_rng(11)
    for _ in range(3):
        muscle, *state = hill.draw(rng, law)
        F = hill.window(muscle, *state)[2]
        for integrator, tolerance in itertools.product(em.Integrator, (1e-4, 1e-6)):
            end = integrate(em.MuscleSet([muscle]), np.array(state)[:, None], integrator, tolerance)
            assert abs(end.force[0] - F) < tolerance * muscle.max_isometric_force


@EITHER_INTEGRATOR
def test_same_bits_twice_and_muscle_by_muscle(integrator):
    muscles, states, _ = load()
    first, second = (integrate(muscles, states, integrator) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        assert one.tobytes() == other.tobytes()
    for k in range(0, len(muscles), 50):
        alone = integrate(em.MuscleSet([list(muscles)[k]]), states[:, k : k + 1], integrator)
        assert [float(x[0]) for x in alone] == [float(x[k]) for x in first]


def test_steps_are_returned():
    muscles, states, _ = load()
    for integrator, fewest, order in (
        (em.Integrator.TRAPEZOIDAL, 13, 2.0),  # none is longer than a twentieth of 15 ms
        (em.Integrator.ROSENBROCK, 5, 4.0),
    ):
        rough, fine = (
            integrate(muscles, states, integrator, tolerance) for tolerance in (1e-4, 1e-6)
        )
        assert rough.steps.min() >= fewest
        assert (fine.steps >= rough.steps).all()
        many = rough.steps > 2.0 * np.median(rough.steps)
        growth = np.median(fine.steps[many] / rough.steps[many])
        assert growth == pytest.approx(100.0 ** (1.0 / order), rel=0.15)


@EITHER_INTEGRATOR
def test_steps_used_again_give_the_same_bits(integrator):
    muscles, states, _ = load()
    mesh = np.empty(MAX_STEPS)
    for k, muscle in enumerate(muscles):
        chosen = at_steps(muscle, states[:, k], integrator, mesh, 0)
        assert at_steps(muscle, states[:, k], integrator, mesh, chosen[0]) == chosen


def test_steps_that_no_longer_fit_are_chosen_anew():
    """One implicit step over the whole window has no solution here."""
    muscles, states, _ = load()
    a, l_t, u, *course = states
    method = em.Integrator.TRAPEZOIDAL.value
    failed = 0
    for k in range(0, len(muscles), 20):
        mesh, steps, end = np.full((1, 1, MAX_STEPS), hill.WINDOW), np.ones((1, 1), int), np.empty(4)
        units = em.MuscleSet([list(muscles)[k]]).units
        arguments = (*(x[k : k + 1] for x in course), hill.WINDOW, TOLERANCE, mesh)
        n, *_ = kernels.integrate(
            method, units, 0, *states[:, k], hill.WINDOW, TOLERANCE, mesh[0, 0], 1
        )
        if n > 0:
            continue
        failed += 1
        done = kernels.integrate_all(
            method, units, a[k : k + 1], l_t[k : k + 1], u[None, k : k + 1], *arguments, steps,
            end.reshape(4, 1, 1),
        )  # fmt: skip
        assert done == -1
        fresh = at_steps(list(muscles)[k], states[:, k], em.Integrator.TRAPEZOIDAL, mesh[0, 0], 0)
        assert (steps[0, 0], *end) == fresh
    assert failed > 5


# -- fixed steps ----------------------------------------------------------------------------------

MUSCLE = em.Muscle(
    "smooth",
    max_isometric_force=1000.0,
    optimal_fiber_length=0.1,
    tendon_slack_length=0.2,
    pennation_angle_at_optimal=0.3,
)
SMOOTH_LAWS = {name: law for name, law in LAWS.items() if name.startswith("DeGroote")}


@cache
def smooth(law, dynamics, a, u):
    """A unit near its balance that first lengthens, then shortens: (muscle, state, end)."""
    muscle = dataclasses.replace(
        MUSCLE, law=law, activation_dynamics=dynamics, activation_dynamics_smoothing=10.0
    )
    l_t = hill.tendon_length(muscle, 400.0)
    l_0 = hill.length(muscle, 400.0, 0.09)
    state = a, l_t, u, l_0, 0.10, l_0 + 0.0004, -0.05
    return muscle, state, hill.window(muscle, *state)


def order(steps, errors):
    """Slope of log(error) against log(step)."""
    return -np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize("law", SMOOTH_LAWS.values(), ids=SMOOTH_LAWS)
@pytest.mark.parametrize("dynamics", em.ActivationDynamics)
@pytest.mark.parametrize(("a", "u"), [(0.4, 1.0), (0.6, 0.2)])
def test_order(law, dynamics, a, u):
    muscle, state, (a_1, _, F_1) = smooth(law, dynamics, a, u)
    for integrator, expected, steps in (
        (em.Integrator.TRAPEZOIDAL, 2.0, np.array([16, 32, 64, 128])),
        (em.Integrator.ROSENBROCK, 4.0, np.array([8, 16, 32])),
    ):
        ends = []
        for N in steps:
            mesh = hill.WINDOW * np.arange(1, N + 1) / N
            n, a, _, F, _ = at_steps(muscle, state, integrator, mesh, N)
            assert n == N
            ends.append([a, F])
        errors = abs(np.array(ends) - [a_1, F_1])
        print(integrator, order(steps, errors[:, 1]), errors[:, 1], order(steps, errors[:, 0]), errors[:,0])
