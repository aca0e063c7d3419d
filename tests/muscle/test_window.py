"""Window integration by both integrators: accuracy over the whole box and beyond, order, the stop,
rigid tendons, sensitivity, determinism, errors."""

import dataclasses
import itertools
from collections import Counter
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
from exudyn_muscles.numerics.curves import END

from ..differences import difference
from ..zoo import LAWS
from . import hill
from .make_window_box import LAWS as WINDOW_LAWS
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


@cache
def ends(kind, integrator, tolerance):
    """Of the stored windows."""
    muscles, states, _ = load(kind)
    return integrate(muscles, states, integrator, tolerance)


@cache
def units_of(muscle):
    return em.MuscleSet([muscle]).tables


def at_steps(muscle, state, integrator, mesh, steps, tolerance=TOLERANCE, window=hill.WINDOW):
    """(steps, a, l_t, F, dF/du) of one muscle; `steps` = 0 writes the mesh."""
    return kernels.integrate(
        integrator.value, units_of(muscle), 0, *state, window, tolerance, mesh, steps
    )


def trail(muscle, state, integrator, tolerance=TOLERANCE, most=MAX_STEPS):
    """Time, activation, tendon length and musculotendon length at the ends of the steps; at those
    of `most` steps and of the last twenty if there are many."""
    mesh = np.empty(MAX_STEPS)
    n, *_ = at_steps(muscle, state, integrator, mesh, 0, tolerance)
    assert n > 0
    for k in sorted({*range(0, n, -(-n // most)), *range(max(n - 20, 0), n)}):
        _, a, l_t, *_ = at_steps(muscle, state, integrator, mesh, k + 1, tolerance)
        yield mesh[k], a, l_t, hill.cubic(mesh[k], hill.WINDOW, *state[3:])[0]


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
    assert min(fiber) < 0.32
    assert max(fiber) > 1.79
    assert max(abs(v_0 / optimal).max(), abs(v_1 / optimal).max()) > 14.9
    ratio = [muscle.tendon_slack_length / muscle.optimal_fiber_length for muscle in muscles]
    assert min(ratio) < 0.11
    assert max(ratio) > 9.0
    drawn = {muscle.activation_dynamics for muscle in muscles}
    assert drawn | {em.ActivationDynamics.BILINEAR} == set(em.ActivationDynamics)  # came later
    assert Counter(muscle.law for muscle in muscles) == dict.fromkeys(WINDOW_LAWS.values(), 200)


def test_ordinary_states_are_taut_and_within_the_box():
    muscles, (_, l_t, _, l_0, *_), _ = load("ordinary")
    for k, muscle in enumerate(muscles):
        F = muscle.max_isometric_force * hill.tension(muscle, l_t[k])
        assert within(muscle, l_t[k], F, l_0[k]), k


@EITHER_KIND
@pytest.mark.parametrize("number", [0, 130, 260, 390])
def test_stored_references_are_what_the_oracle_gives(kind, number):
    muscles, states, stored = load(kind)
    muscle = list(muscles)[number]
    again = hill.window(muscle, *states[:, number])
    F0 = muscle.max_isometric_force
    assert again == pytest.approx(tuple(stored[:, number]), abs=1e-9, rel=1e-9)
    assert again[2] == pytest.approx(stored[2, number], abs=1e-9 * F0)


@EITHER_KIND
@EITHER_INTEGRATOR
@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_the_error_is_below_the_tolerance(kind, integrator, tolerance):
    """In 99 % of the windows, and never above ten times."""
    muscles, _, (a, l_t, F) = load(kind)
    end = ends(kind, integrator, tolerance)
    error = abs(end.force - np.maximum(F, 0.0)) / muscles.max_isometric_force
    assert np.mean(error > tolerance) <= 0.01
    assert error.max() < 10.0 * tolerance, f"state {error.argmax()}"
    assert abs(end.activation - a).max() < tolerance
    # A slack tendon bears nothing now, but soon may.
    error = abs(end.tendon_length - l_t) * muscles.tables.table[:, PER_STRETCH]
    assert np.mean(error > tolerance / LEAST_STIFFNESS) <= 0.01
    assert error.max() < 10.0 * tolerance / LEAST_STIFFNESS, f"state {error.argmax()}"


def test_default_tolerance():
    assert kernels.DEFAULT_TOLERANCE == TOLERANCE


@EVERY_LAW
def test_fresh_draws(law):
    rng = np.random.default_rng(11)
    for _ in range(2):
        muscle, *state = hill.draw(rng, law)
        F = max(hill.window(muscle, *state)[2], 0.0)
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


@EITHER_INTEGRATOR
@pytest.mark.parametrize("seed", range(3))
def test_same_bits_wherever_curves_were_looked_at_last(integrator, seed):
    muscles, states, _ = load("ordinary")
    once = integrate(muscles, states, integrator)
    curves, found = muscles.tables.curves, muscles.tables.found
    last = np.flatnonzero(np.isnan(curves.pieces[:, END]))  # of each curve
    first, curve = np.append(0, last + 1), np.searchsorted(last, found)
    found[:] = np.random.default_rng(seed).integers(first[curve], last[curve] + 1)
    for one, other in zip(once, integrate(muscles, states, integrator), strict=True):
        assert one.tobytes() == other.tobytes()


def test_steps_are_returned():
    for integrator, fewest, expected in (
        (em.Integrator.TRAPEZOIDAL, 13, 2.0),  # none is longer than a twentieth of 15 ms
        (em.Integrator.ROSENBROCK, 3, 4.0),
    ):
        rough, fine = (ends("box", integrator, tolerance) for tolerance in (1e-4, 1e-6))
        assert rough.steps.min() >= fewest
        assert (fine.steps >= rough.steps).all()
        many = rough.steps > 2.0 * np.median(rough.steps)
        growth = np.median(fine.steps[many] / rough.steps[many])
        assert growth == pytest.approx(100.0 ** (1.0 / expected), rel=0.15)


@EITHER_INTEGRATOR
def test_steps_used_again_give_the_same_bits(integrator):
    muscles, states, _ = load()
    mesh = np.empty(MAX_STEPS)
    for k, muscle in list(enumerate(muscles))[::4]:
        chosen = at_steps(muscle, states[:, k], integrator, mesh, 0)
        assert at_steps(muscle, states[:, k], integrator, mesh, chosen[0]) == chosen


@EITHER_INTEGRATOR
@pytest.mark.parametrize("change", [0.01, 1.0])
def test_steps_used_again_for_another_excitation(change, integrator):
    """They say that they no longer fit, or they are as exact as if chosen for it."""
    muscles, states, _ = load()
    mesh, refused, errors = np.empty(MAX_STEPS), 0, []
    for k, muscle in list(enumerate(muscles))[::4]:
        a, l_t, u, *course = states[:, k]
        n, *_ = at_steps(muscle, states[:, k], integrator, mesh, 0)
        state = a, l_t, max(u - change, 0.01) if u + change > 1.0 else u + change, *course
        n, _, _, F, _ = at_steps(muscle, state, integrator, mesh, n)
        exact = at_steps(muscle, state, em.Integrator.ROSENBROCK, mesh, 0, tolerance=1e-6)[3]
        if n < 0:
            refused += 1
        else:
            errors.append(abs(F - exact) / muscle.max_isometric_force)
    assert refused < 0.2 * len(errors)
    assert np.mean(np.array(errors) > TOLERANCE) <= 0.01
    assert max(errors) < 10.0 * TOLERANCE


@EITHER_INTEGRATOR
def test_steps_that_no_longer_fit_are_chosen_anew(integrator):
    """One step over the whole window does not."""
    muscles, states, _ = load()
    k = 1
    a, l_t, u, *course = (x[k : k + 1] for x in states)
    muscle, mesh = list(muscles)[k], np.full((1, 1, MAX_STEPS), hill.WINDOW)
    steps, end = np.ones((1, 1), int), np.empty((4, 1, 1))
    assert at_steps(muscle, states[:, k], integrator, mesh[0, 0], 1)[0] == -1
    failed = kernels.integrate_all(
        integrator.value, units_of(muscle), a, l_t, u[None], *course, hill.WINDOW, TOLERANCE,
        mesh, steps, end,
    )  # fmt: skip
    assert failed == -1
    fresh = at_steps(muscle, states[:, k], integrator, np.empty(MAX_STEPS), 0)
    assert (steps[0, 0], *end.ravel()) == fresh


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
    for integrator, expected, apart, steps in (
        (em.Integrator.TRAPEZOIDAL, 2.0, 0.01, np.array([16, 32, 64, 128])),
        (em.Integrator.ROSENBROCK, 4.0, 0.25, np.array([8, 16, 32])),
    ):
        ends = []
        for N in steps:
            mesh = hill.WINDOW * np.arange(1, N + 1) / N
            n, a, _, F, _ = at_steps(muscle, state, integrator, mesh, N, tolerance=np.inf)
            assert n == N
            ends.append([a, F])
        errors = abs(np.array(ends) - [a_1, F_1])
        assert order(steps, errors[:, 1]) == pytest.approx(expected, abs=apart)


# -- the stop and the slack tendon ----------------------------------------------------------------

# Fibre above its shortest length, tendon strain over that at F0, activation, excitation, speeds at
# the start, in the middle and at the end of the window; lengths in optimal ones.
SCENES = {
    "comes to rest": (0.02, 0.3, 1.0, 1.0, -5.0, -8.0, -8.0),
    "rests and leaves": (0.02, 0.3, 1.0, 1.0, -10.0, -4.0, 16.0),
    "starts at rest and leaves": (0.0, -0.3, 0.5, 1.0, 2.0, 8.0, 12.0),
    "leaves and comes back": (0.0, -0.1, 1.0, 1.0, 6.0, 2.0, -15.0),
    "rests throughout": (0.0, -0.2, 0.5, 1.0, -1.0, -3.0, -2.0),
    "slack taken up": (0.3, -3.0, 0.3, 1.0, 6.0, 12.0, 15.0),
}
# Whether the fibre rests, phase after phase.
PHASES = {
    "comes to rest": [False, True],
    "rests and leaves": [False, True, False],
    "starts at rest and leaves": [True, False],
    "leaves and comes back": [True, False, True],
    "rests throughout": [True],
    "slack taken up": [False],
}


def scene(law, name):
    """(muscle, state)."""
    above, stretch, a, u, *speeds = SCENES[name]
    muscle = dataclasses.replace(MUSCLE, law=law, tendon_slack_length=0.1)
    strain = muscle.tendon_strain if law.tendon_strain_at_one_norm_force else 0.05
    l_t = muscle.tendon_slack_length * (1.0 + stretch * strain)
    v_0, v, v_1 = muscle.optimal_fiber_length * np.array(speeds)
    l_0 = l_t + hill.shortest(muscle) + above * muscle.optimal_fiber_length
    state = a, l_t, u, l_0, v_0, l_0 + hill.WINDOW * (v_0 + 4.0 * v + v_1) / 6.0, v_1
    return muscle, state


@cache
def reference(law, name):
    """(a, l_t, F) at the end of a scene."""
    muscle, state = scene(law, name)
    return hill.window(muscle, *state)


# A damped fibre of Millard's law comes to its shortest length without end: nothing pulls it there.
COMES_TO_REST = {
    name: LAWS[name]
    for name in (
        "DeGrooteFregly2016",
        "DeGrooteFregly2016, damped",
        "Thelen2003",
        "Millard2012, undamped",
    )
}


@EITHER_INTEGRATOR
@pytest.mark.parametrize("law", COMES_TO_REST.values(), ids=COMES_TO_REST)
@pytest.mark.parametrize("name", SCENES)
def test_stop(name, law, integrator):
    muscle, state = scene(law, name)
    _, l_t1, F_1 = reference(law, name)
    p_min = hill.shortest(muscle)
    rests = []
    for _, _, l_t, l in trail(muscle, state, integrator):
        assert l - l_t > p_min - 1e-15
        rests.append(l - l_t < p_min + 1e-15)
    assert [phase for phase, _ in itertools.groupby(rests)] == PHASES[name]
    for tolerance in (1e-4, 1e-6):
        check_end(muscle, state, integrator, tolerance, hill.WINDOW, l_t1, F_1)


def check_end(muscle, state, integrator, tolerance, window, l_t1, F_1):
    """Force and tendon length at the end of a window are those of the oracle, to the tolerance that
    99 % of the windows meet; here to twice that."""
    n, _, l_t, F, _ = at_steps(muscle, state, integrator, np.empty(MAX_STEPS), 0, tolerance, window)
    assert n > 0
    assert abs(F - F_1) < 2.0 * tolerance * muscle.max_isometric_force
    per_stretch = units_of(muscle).table[0, PER_STRETCH]
    assert abs(l_t - l_t1) * per_stretch < 2.0 * tolerance / LEAST_STIFFNESS


@EITHER_INTEGRATOR
@EVERY_LAW
def test_a_fibre_at_rest_takes_few_steps(law, integrator):
    muscle, state = scene(law, "rests throughout")
    _, l_t1, F_1 = reference(law, "rests throughout")
    for tolerance in (1e-4, 1e-6):
        end = list(trail(muscle, state, integrator, tolerance))
        assert len(end) < 20
        assert all(abs(l - l_t - hill.shortest(muscle)) < 1e-15 for _, _, l_t, l in end)
        check_end(muscle, state, integrator, tolerance, hill.WINDOW, l_t1, F_1)


@EITHER_INTEGRATOR
@pytest.mark.parametrize("distance", [0.0, 5e-15, 1e-12, 1e-10])
def test_a_fibre_goes_along_with_its_stop(distance, integrator):
    """With a slack tendon it bears nothing: near the stop it moves as the path does."""
    muscle = em.Muscle(
        "m", max_isometric_force=464.0, optimal_fiber_length=0.254, tendon_slack_length=0.0445,
        law=em.Millard2012(),
    )  # fmt: skip
    shortest = muscle.shortest_fiber + distance
    l_0, l_1, l_t = 0.1509, 0.1326, 0.1509 - shortest
    assert l_t < 0.9 * muscle.tendon_slack_length
    state = 0.356, l_t, 0.01, l_0, 1.687, l_1, -0.203
    end = integrate(em.MuscleSet([muscle]), [[x] for x in state], integrator, 1e-6)
    assert end.steps[0] < 500
    assert end.force[0] == 0.0
    assert end.tendon_length[0] == pytest.approx(l_1 - shortest, abs=1e-9)


@EITHER_INTEGRATOR
def test_a_time_constant_of_a_picosecond(integrator):
    """A fibre with a thousandth of its activation, shorter than any curve was made for, is torn
    loose by a taut tendon and comes to rest where both are in balance."""
    muscle = em.Muscle(
        "m", max_isometric_force=4868.3, optimal_fiber_length=0.26366,
        tendon_slack_length=0.071216, pennation_angle_at_optimal=0.34415, minimum_activation=0.001,
        activation_dynamics=em.ActivationDynamics.FIRST_ORDER, law=em.DeGrooteFregly2016(),
    )  # fmt: skip
    l_t = 0.083614 - np.sqrt(muscle.shortest_fiber**2 - muscle.width**2)
    state = 0.001, l_t, 0.01, 0.083614, -2.0987, 0.089585, 3.0569
    end = integrate(em.MuscleSet([muscle]), [[x] for x in state], integrator, 1e-6)
    assert 0.0 < end.force[0] < 0.03 * muscle.max_isometric_force


@EITHER_INTEGRATOR
def test_slack_is_taken_up_by_a_damped_fibre(integrator):
    muscle, state = scene(em.Millard2012(), "slack taken up")
    _, l_t1, F_1 = reference(em.Millard2012(), "slack taken up")
    for tolerance in (1e-4, 1e-6):
        check_end(muscle, state, integrator, tolerance, hill.WINDOW, l_t1, F_1)


def test_a_damped_fibre_leaves_its_stop():
    """Where the tendon is slack nothing holds the fibre there, either."""
    muscle, state = scene(em.Millard2012(), "starts at rest and leaves")
    mesh = np.empty(MAX_STEPS)
    _, _, l_t1, F_1, _ = at_steps(muscle, state, em.Integrator.TRAPEZOIDAL, mesh, 0, 1e-6)
    assert 0.1 * muscle.max_isometric_force < F_1
    for tolerance, most in ((1e-4, 40), (1e-6, 120)):
        n, *_ = at_steps(muscle, state, em.Integrator.ROSENBROCK, mesh, 0, tolerance)
        assert 0 < n < most
        check_end(muscle, state, em.Integrator.ROSENBROCK, tolerance, hill.WINDOW, l_t1, F_1)


# -- beyond the box -------------------------------------------------------------------------------

EXTREMES = {
    "short tendon": {"tendon_slack_length": 0.01, "pennation_angle_at_optimal": 0.0},
    "long tendon": {"tendon_slack_length": 1.0},
    "most pennate": {"pennation_angle_at_optimal": 1.4},
    "at its maximum pennation": {"pennation_angle_at_optimal": 0.6, "maximum_pennation_angle": 0.6},
    "quick activation": {"activation_time_constant": 1e-3, "deactivation_time_constant": 2e-3},
}


@cache
def extreme(law, changes=(), a=0.4, u=0.8, window=hill.WINDOW):
    """A unit that lengthens and shortens by a tenth of its optimal length."""
    muscle = dataclasses.replace(MUSCLE, law=law, **dict(changes))
    l_t, l_0 = hill.tendon_length(muscle, 300.0), hill.length(muscle, 300.0, 0.11)
    change = 0.01 * min(window / hill.WINDOW, 1.0)
    state = a, l_t, u, l_0, 3.0 * change / window, l_0 + change, -2.0 * change / window
    return muscle, state, hill.window(muscle, *state, h=window)


@EITHER_INTEGRATOR
@pytest.mark.parametrize("law", WINDOW_LAWS.values(), ids=WINDOW_LAWS)
@pytest.mark.parametrize("changes", EXTREMES.values(), ids=EXTREMES)
def test_extreme_units(changes, law, integrator):
    muscle, state, (_, l_t, F) = extreme(law, tuple(changes.items()))
    for tolerance in (1e-4, 1e-6):
        check_end(muscle, state, integrator, tolerance, hill.WINDOW, l_t, F)


@EITHER_INTEGRATOR
@EVERY_LAW
@pytest.mark.parametrize("window", [1e-9, 1e-4, 0.1, 1.0])
def test_short_and_long_windows(window, law, integrator):
    muscle, state, (_, l_t, F) = extreme(law, window=window)
    for tolerance in (1e-4, 1e-6):
        check_end(muscle, state, integrator, tolerance, window, l_t, F)


@EITHER_INTEGRATOR
@EVERY_LAW
@pytest.mark.parametrize("dynamics", em.ActivationDynamics)
@pytest.mark.parametrize("level", [0.01, 1.0])
def test_excitation_that_is_the_activation(level, dynamics, law, integrator):
    muscle, state, (_, l_t, F) = extreme(law, a=level, u=level)
    muscle = dataclasses.replace(muscle, activation_dynamics=dynamics)  # all stay at `level`
    end = at_steps(muscle, state, integrator, np.empty(MAX_STEPS), 0)
    assert end[1] == level
    check_end(muscle, state, integrator, TOLERANCE, hill.WINDOW, l_t, F)


@EVERY_LAW
def test_rigid_tendons(law):
    rng = np.random.default_rng(12)
    for _ in range(5):
        muscle, a, l_t, u, l_0, v_0, l_1, v_1 = hill.draw(rng, law)
        slack = muscle.tendon_slack_length
        muscle = dataclasses.replace(muscle, ignore_tendon_compliance=True)
        state = a, slack, u, l_0 - l_t + slack, v_0, l_1 - l_t + slack, v_1
        _, _, F = hill.window(muscle, *state)
        for integrator, tolerance in itertools.product(em.Integrator, (1e-4, 1e-6)):
            check_end(muscle, state, integrator, tolerance, hill.WINDOW, slack, F)
            assert {l_t for _, _, l_t, _ in trail(muscle, state, integrator)} == {slack}
            anywhere = np.array(state)[:, None] + 0.01 * np.eye(7)[:, 1:2]
            end = integrate(em.MuscleSet([muscle]), anywhere, integrator, tolerance)
            assert end.tendon_length[0] == slack


@EITHER_INTEGRATOR
@EVERY_LAW
def test_what_a_window_returns_the_next_one_takes(law, integrator):
    """With time constants and tolerances from one end of what is allowed to the other."""

    @given(
        seed=st.integers(0, 2**32),
        constants=st.tuples(*[st.sampled_from([-4.0, -3.5, -3.0]) | st.floats(-4.0, 1.0)] * 2),
        excitations=st.lists(st.floats(0.01, 1.0) | st.sampled_from([0.01, 1.0]), min_size=3),
        tolerance=st.sampled_from([1e-2, 1e-3, 1e-4]),
        rigid=st.booleans(),
    )
    @hypothesis.settings(max_examples=40)
    def check(seed, constants, excitations, tolerance, rigid):
        muscle, a, l_t, _, l, v, *_ = hill.draw(np.random.default_rng(seed), law)
        tau_a, tau_d = 10.0 ** np.array(constants)
        muscle = dataclasses.replace(
            muscle,
            activation_time_constant=tau_a,
            deactivation_time_constant=tau_d,
            ignore_tendon_compliance=rigid,
        )
        for u in excitations:
            state = np.array([a, l_t, u, l, v, l + 0.5 * hill.WINDOW * v, 0.0])[:, None]
            end = integrate(em.MuscleSet([muscle]), state, integrator, tolerance)
            assert min(a, u) <= end.activation[0] <= max(a, u)
            a, l_t, l, v = end.activation[0], end.tendon_length[0], state[5, 0], 0.0

    check()


# -- sensitivity ----------------------------------------------------------------------------------


@EITHER_KIND
@EITHER_INTEGRATOR
@pytest.mark.parametrize(("tolerance", "most", "worst"), [(1e-4, 0.1, 0.3), (1e-6, 0.03, 0.1)])
def test_sensitivity_against_differences_on_a_frozen_mesh(kind, integrator, tolerance, most, worst):
    """To some per cent: to 10 % of dF/du and 1 % of F0 in 99 % of the windows at the default
    tolerance, and five times as exact at a hundredth of it."""
    muscles, states, _ = load(kind)
    errors, delta = [], 1e-5
    for k in range(0, len(muscles), 1 if tolerance == TOLERANCE else 8):
        a, l_t, u, *course = states[:, k]
        u = min(max(u, 0.01 + 2.0 * delta), 1.0 - 2.0 * delta)
        if abs(u - a) < 3.0 * delta:
            continue  # the time constant changes at u = a
        error = sensitivity_error(list(muscles)[k], (a, l_t, u, *course), integrator, tolerance)
        errors.append(error)
    assert np.mean(np.isnan(errors)) < 0.02
    assert np.nanquantile(errors, 0.99) < most
    assert np.nanmax(errors) < worst


def sensitivity_error(muscle, state, integrator, tolerance, delta=1e-5):
    """Of dF/du, over its size and a tenth of F0; NaN where the mesh does not serve as far as that,
    since another step comes to the stop."""
    a, l_t, u, *course = state
    mesh = np.empty(MAX_STEPS)
    n, *_, F_u = at_steps(muscle, state, integrator, mesh, 0, tolerance)

    def end(u):
        used, *_, F, _ = at_steps(muscle, (a, l_t, u, *course), integrator, mesh, n, tolerance)
        return F if used == n else np.nan

    exact = difference(end, u, delta)
    return abs(F_u - exact) / (abs(exact) + 0.1 * muscle.max_isometric_force)


@EITHER_INTEGRATOR
@EVERY_LAW
def test_sensitivity_of_rigid_tendons(law, integrator):
    rng = np.random.default_rng(13)
    for _ in range(20):
        muscle, a, l_t, _, *course = hill.draw(rng, law)
        muscle = dataclasses.replace(muscle, ignore_tendon_compliance=True)
        state = a, l_t, rng.uniform(0.02, 0.98), *course
        assert sensitivity_error(muscle, state, integrator, TOLERANCE) < 0.02


def pulls_throughout(muscle, state, integrator):
    """Whether the fibre's active force stays positive in the whole window."""
    for _, a, l_t, l in trail(muscle, state, integrator, most=50):
        law = hill.curves(muscle)
        v = hill.projection_rate(muscle, a, l_t, l) * hill.fiber(muscle, l_t, l)[1]
        v /= muscle.max_contraction_velocity * muscle.optimal_fiber_length
        if law.multiplier(v / law.fastest(a)) <= 0.0:
            return False
    return True


@EITHER_INTEGRATOR
def test_force_increases_with_excitation(integrator):
    """Wherever the fibre pulls. One that shortens faster than its maximum velocity is pushed, and
    activation then stiffens it against that: `test_a_pushed_fibre_resists`."""

    @given(
        seed=st.integers(0, 2**32),
        law=st.sampled_from(list(LAWS.values())),
        u=st.floats(0.01, 0.99),
        more=st.floats(0.01, 1.0),
    )
    @hypothesis.settings(max_examples=40)
    def check(seed, law, u, more):
        muscle, a, l_t, _, *course = hill.draw(np.random.default_rng(seed), law)
        higher = min(u + more, 1.0)
        low, high = (a, l_t, u, *course), (a, l_t, higher, *course)
        hypothesis.assume(pulls_throughout(muscle, low, integrator))
        hypothesis.assume(pulls_throughout(muscle, high, integrator))
        mesh = np.empty(MAX_STEPS)
        n, _, _, F, F_u = at_steps(muscle, low, integrator, mesh, 0)
        n, _, _, F_high, _ = at_steps(muscle, high, integrator, mesh, n)
        if n < 0:  # the steps chosen for one excitation may be too long for another
            F_high = at_steps(muscle, high, integrator, mesh, 0)[3]
        F0 = muscle.max_isometric_force
        assert F_high > F - TOLERANCE * F0
        assert F_u > -0.01 * F0

    check()


@EITHER_INTEGRATOR
def test_a_pushed_fibre_resists(integrator):
    """Beyond the maximum shortening velocity the force-velocity curve is negative: the tendon gets
    the shorter the higher u is, though by its curve alone, as a slack one does not push."""
    l_t, l = hill.tendon_length(MUSCLE, 100.0), hill.length(MUSCLE, 100.0, 0.1)
    v = -1.5  # m/s, 15 optimal lengths/s
    states = [[0.5], [l_t], [0.01], [l], [v], [l + v * hill.WINDOW], [v]]
    muscles = em.MuscleSet([MUSCLE])
    low = integrate(muscles, states, integrator)
    states[2] = [1.0]
    high = integrate(muscles, states, integrator)
    assert high.tendon_length[0] < low.tendon_length[0] < MUSCLE.tendon_slack_length
    assert high.sensitivity[0] < 0.0
    assert high.force[0] == low.force[0] == 0.0


# -- errors ---------------------------------------------------------------------------------------

GOOD = {
    "activation": [0.5],
    "tendon_length": [0.205],
    "excitation": [0.5],
    "length": ([0.3], [0.3]),
    "lengthening_speed": ([0.0], [0.0]),
    "window": 0.01,
}


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("activation", [0.5, 0.5], "activation: expected 1 finite"),
        ("activation", [np.nan], "activation: expected 1 finite"),
        ("activation", [0.009], r"muscle 'smooth': activation 0.009 is outside \[0.01, 1\]"),
        ("activation", [1.001], "muscle 'smooth': activation 1.001 is outside"),
        ("tendon_length", [np.inf], "tendon_length: expected 1 finite"),
        ("tendon_length", [], "tendon_length: expected 1 finite"),
        ("excitation", ["high"], "excitation: expected 1 finite"),
        ("excitation", [0.0], r"muscle 'smooth': excitation 0 is outside \[0.01, 1\]"),
        ("excitation", [1.1], "muscle 'smooth': excitation 1.1 is outside"),
        ("length", [0.3], r"length must be a pair, at the start and at the end, got \[0.3\]"),
        ("length", ([0.3], [np.nan]), "length_at_end: expected 1 finite"),
        ("length", ([0.3, 0.3], [0.3]), "length_at_start: expected 1 finite"),
        ("lengthening_speed", None, "lengthening_speed must be a pair"),
        ("lengthening_speed", ([None], [0.0]), "speed_at_start: expected 1 finite"),
        ("lengthening_speed", ([0.0], [[0.0]]), "speed_at_end: expected 1 finite"),
        ("window", 0.0, "window = 0.0 s is outside"),
        ("window", -0.01, "window = -0.01 s"),
        ("window", 1.5, r"window = 1.5 s is outside \[1e-09, 1\] s"),
        ("window", np.nan, "window = nan s"),
        ("window", np.inf, "window = inf s"),
        ("tolerance", 0.0, r"tolerance = 0.0 is outside \[1e-06, 0.01\]"),
        ("tolerance", 0.1, "tolerance = 0.1 is outside"),
        ("tolerance", np.nan, "tolerance = nan is outside"),
        ("integrator", "rosenbrock", "integrator = 'rosenbrock' is not one of"),
        ("integrator", 1, "integrator = 1 is not one of"),
    ],
)
def test_bad_input(name, value, message):
    with pytest.raises(em.ParameterError, match=message):
        em.integrate_window(em.MuscleSet([MUSCLE]), **{**GOOD, name: value})


def test_muscles_are_a_muscle_set():
    with pytest.raises(em.ParameterError, match="muscles must be a MuscleSet"):
        em.integrate_window([MUSCLE], **GOOD)


@EITHER_INTEGRATOR
def test_good_input_is_good(integrator):
    em.integrate_window(em.MuscleSet([MUSCLE]), **GOOD, integrator=integrator)


def test_the_rosenbrock_method_is_the_default():
    chosen = em.integrate_window(em.MuscleSet([MUSCLE]), **GOOD)
    same = em.integrate_window(em.MuscleSet([MUSCLE]), **GOOD, integrator=em.Integrator.ROSENBROCK)
    assert chosen == same
    assert em.CosimulationSettings().integrator is em.Integrator.ROSENBROCK


@EITHER_INTEGRATOR
def test_a_failed_window_names_the_muscle(integrator):
    """The box has no window that fails; a length that runs to 1e200 m does."""
    good = dataclasses.replace(MUSCLE, name="good")
    muscles = em.MuscleSet([good, MUSCLE])
    state = {name: 2 * value for name, value in GOOD.items() if isinstance(value, list)}
    message = (
        r"muscle 'smooth'.* over 0\.01 s from activation 0\.5, tendon length 0\.205 m, "
        r"length 0\.3 m, lengthening speed 0 m/s"
    )
    with pytest.raises(em.WindowError, match=message):
        em.integrate_window(
            muscles, **state, length=([0.3, 0.3], [0.3, 1e200]),
            lengthening_speed=([0.0, 0.0], [0.0, 0.0]), window=0.01, integrator=integrator,
        )  # fmt: skip
