"""Reachable forces (8), (9), the excitation (11) between them, and the steady start."""

import dataclasses

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.recruitment.limits import Limits
from exudyn_muscles.recruitment.steady import steady_bounds, steady_state
from exudyn_muscles.recruitment.windows import (
    MuscleState,
    Windows,
    excite,
    open_window,
    reach_end,
)

from ..differences import difference
from ..muscle import hill
from ..zoo import LAWS

TOLERANCE = 1e-4
H = 0.010


def limits(muscles):
    """Lowest and highest excitation of muscles without limits of their own."""
    return Limits({}, muscles, []).at(0.0)[0]


class Window:
    """Muscles that have settled for a window and now move on: states as a run meets them."""

    def __init__(self, seed, m=7):
        rng = np.random.default_rng(seed)
        self.integrator = list(em.Integrator)[seed % 2]
        units = []
        for k in range(m):
            optimal = rng.uniform(0.04, 0.2)
            units.append(
                em.Muscle(
                    f"m{k}",
                    max_isometric_force=10.0 ** rng.uniform(1.5, 4.0),
                    optimal_fiber_length=optimal,
                    tendon_slack_length=optimal * 10.0 ** rng.uniform(-0.7, 0.7),
                    pennation_angle_at_optimal=rng.uniform(0.0, 0.5),
                    law=list(LAWS.values())[k % len(LAWS)],
                    ignore_tendon_compliance=k % 7 == 6,
                    activation_dynamics=list(em.ActivationDynamics)[(seed + k) % 3],
                )
            )
        self.muscles = em.MuscleSet(units)
        optimal = self.muscles.optimal_fiber_length
        self.a = rng.uniform(0.02, 0.9, m)
        l = np.array(
            [
                hill.length(unit, 0.0, rng.uniform(0.7, 1.2) * x)
                for unit, x in zip(units, optimal, strict=True)
            ]
        )
        self.l_t = em.equilibrium(self.muscles, self.a, l).tendon_length
        self.l, self.v = l, rng.uniform(-3.0, 3.0, m) * optimal
        self.v_1 = self.v + rng.uniform(-1.0, 1.0, m) * optimal
        self.l_1 = l + H * 0.5 * (self.v + self.v_1)
        self.rng = rng

    def opened(self, tolerance=TOLERANCE, u=None, windows=None):
        windows = windows or Windows(self.muscles, tolerance, self.integrator)
        u = limits(self.muscles) if u is None else u
        return open_window(windows, MuscleState(self.a, self.l_t, self.l, self.v), H, u)

    def reach(self, *given, **options):
        return reach_end(self.opened(*given, **options), self.l_1, self.v_1)

    def end(self, u, tolerance=TOLERANCE):
        return em.integrate_window(
            self.muscles, self.a, self.l_t, u, (self.l, self.l_1), (self.v, self.v_1), H,
            tolerance=tolerance, integrator=self.integrator,
        )  # fmt: skip


SEEDS = range(8)


@pytest.fixture(params=SEEDS)
def window(request):
    return Window(request.param)


def test_bounds_are_windows_at_both_limits(window):
    low, high = window.reach()[-2:]
    m = len(window.muscles)
    np.testing.assert_array_equal(low, np.maximum(window.end(np.full(m, 0.01)).force, 0.0))
    np.testing.assert_array_equal(high, np.maximum(window.end(np.ones(m)).force, 0.0))
    assert (high > low).all()


def test_excitations_lie_between_and_forces_follow(window):
    """Forces rise with the excitation, so that those of the bounds enclose all."""
    low, high = window.reach(1e-6)[-2:]
    last = low
    for u in np.linspace(0.05, 0.95, 8):
        F = np.maximum(window.end(np.full(low.size, u), 1e-6).force, 0.0)
        assert ((last < F) | (F == 0.0)).all()  # slack at both
        last = F
    assert (last < high).all()


def test_excitation_ends_in_the_wanted_force(window):
    F0 = window.muscles.max_isometric_force
    reach = window.reach()
    low, high = reach.low, reach.high
    for _ in range(5):
        F_opt = low + window.rng.uniform(0.0, 1.0, low.size) * (high - low)
        found = excite(reach, F_opt)
        assert (abs(found.force - F_opt) <= 1e-9 * F0).all()
        assert (found.excitation >= window.muscles.minimum_activation).all()
        assert (found.excitation <= 1.0).all()
        # It is the force of a window with that excitation, by an integration of its own. That one
        # chooses its steps anew, so it agrees to the tolerance.
        again = window.end(found.excitation)
        assert (abs(again.force - F_opt) <= 2.0 * TOLERANCE * F0).all()
        np.testing.assert_allclose(again.activation, found.activation, atol=0.1 * TOLERANCE)
        # The state goes with the force.
        state = found.activation, found.tendon_length, window.l_1, window.v_1
        force = em.muscle_dynamics(window.muscles, *state).tendon_force
        np.testing.assert_allclose(force, found.force, rtol=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_the_unit_of_force_does_not_matter(seed):
    """Muscles of a fly: excitations are those of muscles ten thousand times as strong."""
    found = []
    for scale in (1.0, 1e-4):
        window = Window(seed)
        window.muscles = em.MuscleSet(
            dataclasses.replace(muscle, max_isometric_force=scale * muscle.max_isometric_force)
            for muscle in window.muscles
        )
        reach = window.reach()
        low, high = reach.low, reach.high
        for share in (1e-6, 0.01, 0.3, 0.9):
            found.append(excite(reach, low + share * (high - low)).excitation)
    np.testing.assert_allclose(found[4:], found[:4], rtol=1e-6)
    assert (np.array(found[1:4]) > 0.0101).all()


def test_an_excitation_takes_few_integrations():
    """2.6 on average with the Rosenbrock method: 3.0 without the kink at the activation, 3.5 if the
    last secant were integrated once more, 4.2 without secants at all."""
    used = []
    for seed in range(1, 8, 2):
        window = Window(seed)
        assert window.integrator is em.Integrator.ROSENBROCK
        reach = window.reach()
        low, high = reach.low, reach.high
        for _ in range(20):
            before = reach.window.windows.tally[0]
            excite(reach, low + window.rng.uniform(0.0, 1.0, low.size) * (high - low))
            used.append((reach.window.windows.tally[0] - before) / low.size)
    assert 1.5 < np.mean(used) < 2.8


def test_the_last_secant_is_as_good_as_an_integration():
    """Its excitation, activation and tendon length are those of a window on the same steps."""
    for seed in range(1, 16, 2):
        window = Window(seed)
        reach = window.reach(1e-6)
        low, high = reach.low, reach.high
        found = excite(reach, low + window.rng.uniform(0.0, 1.0, low.size) * (high - low))
        again = window.end(found.excitation, 1e-6)
        F0 = window.muscles.max_isometric_force
        assert (abs(again.force - found.force) <= 2e-7 * F0).all()
        np.testing.assert_allclose(again.activation, found.activation, atol=1e-7)


def test_targets_outside_give_the_nearest_bound(window):
    F0 = window.muscles.max_isometric_force
    reach = window.reach()
    low, high = reach.low, reach.high
    before = reach.window.windows.tally[0]
    under, over = excite(reach, low - 0.1 * F0), excite(reach, high + 0.1 * F0)
    assert reach.window.windows.tally[0] == before  # both are known
    np.testing.assert_array_equal(under.excitation, window.muscles.minimum_activation)
    np.testing.assert_array_equal(np.maximum(under.force, 0.0), low)
    np.testing.assert_array_equal(over.excitation, np.ones(low.size))
    np.testing.assert_array_equal(over.force, high)
    at_bound = excite(reach, np.where(np.arange(low.size) % 2, low, high))
    np.testing.assert_array_equal(at_bound.excitation, np.where(np.arange(low.size) % 2, 0.01, 1.0))


def test_limits_of_excitations_are_the_ends(window):
    """Bounds, excitations outside of them and the steady start, with limits of their own."""
    m = len(window.muscles)
    u = np.array([np.linspace(0.05, 0.3, m), np.linspace(0.4, 0.9, m)])
    reach = window.reach(u=u)
    low, high = reach.low, reach.high
    np.testing.assert_array_equal(low, np.maximum(window.end(u[0]).force, 0.0))
    np.testing.assert_array_equal(high, np.maximum(window.end(u[1]).force, 0.0))
    np.testing.assert_array_equal(excite(reach, low - 1.0).excitation, u[0])
    np.testing.assert_array_equal(excite(reach, high + 1.0).excitation, u[1])
    between = excite(reach, 0.5 * (low + high)).excitation
    assert ((u[0] < between) & (between < u[1]) | (high <= low)).all()
    low, high = steady_bounds(window.muscles, u, window.l, 0.0 * window.v)
    np.testing.assert_array_equal(low, em.equilibrium(window.muscles, u[0], window.l).force)
    for wanted, a in ((0.5 * low, u[0]), (2.0 * high, u[1])):
        np.testing.assert_array_equal(
            steady_state(window.muscles, u, wanted, window.l, 0.0 * window.v)[0], a
        )


def test_few_integrations():
    """The sensitivity of the same pass saves a bracketing search."""
    counts = []
    for seed in SEEDS:
        window = Window(seed)
        reach = window.reach()
        low, high = reach.low, reach.high
        before = reach.window.windows.tally[0]
        assert before == 2 * low.size
        excite(reach, low + window.rng.uniform(0.05, 0.95, low.size) * (high - low))
        counts.append((reach.window.windows.tally[0] - before) / low.size)
    assert np.mean(counts) <= 4.0


def test_bounds_are_smooth_within_a_window(window):
    """The first steps are used again, so that difference quotients do not see the tolerance."""
    opened = window.reach().window
    optimal = window.muscles.optimal_fiber_length
    for direction in ("length", "speed"):

        def bounds(s, direction=direction):
            l = window.l_1 + (s * optimal if direction == "length" else 0.0)
            v = window.v_1 + (s * optimal if direction == "speed" else 0.0)
            return np.array(reach_end(opened, l, v)[-2:])

        F0 = window.muscles.max_isometric_force
        fine, coarse = (difference(bounds, 0.0, step) / F0 for step in (1e-6, 1e-5))
        # Force by length is some 1/strain of the tendon, and rounding 1e-16 / 1e-6 of that.
        # Thelen's curves have kinks, and a step across one is not smooth in where it lies.
        smooth = [not isinstance(muscle.law, em.Thelen2003) for muscle in window.muscles]
        for those, rtol in ((smooth, 1e-4), (np.logical_not(smooth), 1e-2)):
            np.testing.assert_allclose(fine[:, those], coarse[:, those], rtol=rtol, atol=1e-7)


def test_same_bits_twice_in_a_window(window):
    first = window.reach()
    reach_end(first.window, window.l_1 * 1.0001, window.v_1)
    wanted = 0.5 * (first.low + first.high)
    found = excite(first, wanted)
    again = reach_end(first.window, window.l_1, window.v_1)
    np.testing.assert_array_equal(first.ends, again.ends)
    for one, two in zip(found, excite(again, wanted), strict=True):
        np.testing.assert_array_equal(one, two)


def test_a_new_window_forgets_the_last(window):
    far = window.l_1 + 0.3 * window.muscles.optimal_fiber_length
    first = reach_end(window.opened(), far, window.v_1)
    again = window.reach(windows=first.window.windows)
    np.testing.assert_array_equal(again.ends, window.reach().ends)


def test_a_window_that_is_over_is_an_error(window):
    first = window.reach()
    window.opened(windows=first.window.windows)
    with pytest.raises(RuntimeError, match="another one was opened meanwhile"):
        reach_end(first.window, window.l_1, window.v_1)
    with pytest.raises(RuntimeError, match="another one was opened meanwhile"):
        excite(first, first.low)


def test_bounds_are_not_below_zero():
    """Shortening faster than the fibre can, the tendon is slack; it cannot push."""
    window = Window(0)
    window.v = window.v_1 = -15.0 * window.muscles.optimal_fiber_length
    window.l_1 = window.l + H * window.v
    m = len(window.muscles)
    slack = [window.end(np.full(m, u)).force <= 0.0 for u in (0.01, 1.0)]
    assert np.any(slack[0])
    low, high = window.reach()[-2:]
    np.testing.assert_array_equal(low == 0.0, slack[0])
    np.testing.assert_array_equal(high == 0.0, slack[1])
    assert (low >= 0.0).all()


def test_a_failed_window_names_the_muscle():
    window = Window(0)
    far = window.l_1.copy()
    far[3] = 1e200
    with pytest.raises(em.WindowError, match="muscle 'm3'"):
        reach_end(window.opened(), far, window.v_1)


# -- the start ------------------------------------------------------------------------------------


def start_of(window, moving):
    """Muscles, their limits, lengths and speeds, which are moderate."""
    optimal = window.muscles.optimal_fiber_length
    v = np.clip(window.v, -optimal, optimal) if moving else np.zeros(optimal.size)
    return window.muscles, limits(window.muscles), window.l, v


@pytest.mark.parametrize("moving", [False, True])
def test_steady_bounds_are_the_equilibria(window, moving):
    muscles, u, l, v = start_of(window, moving)
    for bound, a in zip(steady_bounds(muscles, u, l, v), u, strict=True):
        force = em.equilibrium(muscles, a, l, v).force
        np.testing.assert_array_equal(bound, np.maximum(force, 0.0))
    low, high = steady_bounds(muscles, u, l, v)
    assert (high > low).all()


@pytest.mark.parametrize("moving", [False, True])
def test_steady_state_delivers_the_force(window, moving):
    muscles, u, l, v = start_of(window, moving)
    low, high = steady_bounds(muscles, u, l, v)
    F_opt = low + window.rng.uniform(0.0, 1.0, low.size) * (high - low)
    a, l_t = steady_state(muscles, u, F_opt, l, v)
    F = em.muscle_dynamics(muscles, a, l_t, l, v).tendon_force
    # But at the kinks of Thelen's curves, where a moving unit may balance on neither side.
    smooth = [not (moving and isinstance(muscle.law, em.Thelen2003)) for muscle in muscles]
    assert (abs(F - F_opt) <= 1e-9 * muscles.max_isometric_force)[smooth].all()


def test_steady_state_is_steady(window):
    """Nothing moves over a window with u = a and the length held."""
    muscles, u, l, rest = start_of(window, False)
    low, high = steady_bounds(muscles, u, l, rest)
    a, l_t = steady_state(muscles, u, 0.5 * (low + high), l, rest)
    F = em.muscle_dynamics(muscles, a, l_t, l, rest).tendon_force
    end = em.integrate_window(
        muscles, a, l_t, a, (l, l), (rest, rest), H, integrator=window.integrator
    )
    np.testing.assert_allclose(end.activation, a, rtol=1e-14)
    assert (abs(end.force - F) <= 1e-9 * muscles.max_isometric_force).all()


def test_steady_motion_goes_on_steadily(window):
    """With u = a and the speed held, forces change a tenth of what they do from rest."""
    muscles, u, l, v = start_of(window, True)
    low, high = steady_bounds(muscles, u, l, v)
    F_opt = 0.5 * (low + high)
    jumps = []
    for speed in (v, 0.0 * v):
        a, l_t = steady_state(muscles, u, F_opt, l, speed)
        h = 0.002
        end = em.integrate_window(
            muscles, a, l_t, a, (l, l + h * v), (v, v), h, integrator=window.integrator
        )
        jumps.append(abs(end.force - F_opt) / muscles.max_isometric_force)
    elastic = [not muscle.ignore_tendon_compliance for muscle in muscles]
    assert np.mean(jumps[0][elastic]) < 0.3 * np.mean(jumps[1][elastic])


def test_steady_state_of_forces_out_of_reach(window):
    muscles, u, l, rest = start_of(window, False)
    low, high = steady_bounds(muscles, u, l, rest)
    for wanted, activation, bound in ((2.0 * high, 1.0, high), (0.5 * low, 0.01, low)):
        a, l_t = steady_state(muscles, u, wanted, l, rest)
        np.testing.assert_array_equal(a, np.full(low.size, activation))
        F = em.muscle_dynamics(muscles, a, l_t, l, rest).tendon_force
        np.testing.assert_allclose(F, bound)


@pytest.mark.parametrize("integrator", em.Integrator)
@pytest.mark.parametrize("law", LAWS)
def test_a_muscle_that_is_slack_either_way_rests(law, integrator):
    """Shortened faster than any activation can take up, F_opt = 0 is no reason to excite."""
    if law == "Thelen2003Deprecated":
        pytest.skip("its tendon is never slack")
    muscle = em.Muscle(
        "unit",
        max_isometric_force=1000.0,
        optimal_fiber_length=0.1,
        tendon_slack_length=0.2,
        law=LAWS[law],
    )
    muscles = em.MuscleSet([muscle])
    rested = 0
    for speed in np.linspace(-0.5, -3.0, 26):
        l, v, a = np.array([0.3]), np.array([speed]), np.array([0.3])
        l_t = em.equilibrium(muscles, a, l).tendon_length
        windows = Windows(muscles, 1e-4, integrator)
        window = open_window(windows, MuscleState(a, l_t, l, v), 0.01, limits(muscles))
        reach = reach_end(window, l + 0.01 * v, v)
        low, high = reach.low, reach.high
        u, _, slack, end = excite(reach, low)
        assert u[0] == 0.01
        rested += high[0] == 0.0 and end[0] <= 0.0 and slack[0] < 0.2
    assert rested > 0, "no speed left the tendon slack at both bounds"


@pytest.mark.parametrize("integrator", em.Integrator)
def test_steps_that_no_longer_fit_are_chosen_anew(integrator):
    """Bounds at constant speed and then at an end that is far from it: the steps of the first
    evaluation miss the second by far, and a method without iteration would not notice."""
    unit = em.Muscle(
        "unit", max_isometric_force=1000.0, optimal_fiber_length=0.1, tendon_slack_length=0.205
    )
    muscles, h, l, v, v_1 = em.MuscleSet([unit]), 0.01, 0.169 + 0.205 * 1.024, 0.21, 0.37
    state = MuscleState(*np.array([[0.01], [0.205 * 1.024], [l], [v]]))
    ends = [
        (np.array([l + h * v]), np.array([v])),
        (np.array([l + h * 0.5 * (v + v_1)]), np.array([v_1])),
    ]
    again, fresh = (
        open_window(Windows(muscles, TOLERANCE, integrator), state, h, limits(muscles))
        for _ in range(2)
    )
    reach_end(again, *ends[0])
    np.testing.assert_allclose(
        reach_end(again, *ends[1])[-2:], reach_end(fresh, *ends[1])[-2:], rtol=2e-4
    )


def test_a_fibre_that_bears_nothing_actively_starts_at_rest():
    unit = em.Muscle(
        "unit", max_isometric_force=1000.0, optimal_fiber_length=0.15, tendon_slack_length=0.16,
        law=em.Millard2012(),
    )  # fmt: skip
    muscles = em.MuscleSet([unit])
    u, rest = limits(muscles), np.zeros(1)
    for length in (0.45, 0.46, 0.47):  # beyond 1.81 optimal lengths
        l = np.array([length])
        low, _ = steady_bounds(muscles, u, l, rest)
        assert steady_state(muscles, u, low, l, rest)[0] == unit.minimum_activation
