"""Window integration: accuracy over the whole box, order, sensitivity, determinism, errors."""

import hypothesis
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import exudyn_muscles as em
from exudyn_muscles.muscle import window as kernels

from ..differences import difference
from . import hill
from .make_window_box import FILE, PARAMETERS

TOLERANCE = 1e-4  # of the force at the end of a window, over F0


@pytest.fixture(scope="module")
def box():
    """600 states of the allowed box as one set of muscles, their states and reference forces."""
    with np.load(FILE) as data:
        muscles = em.MuscleSet(
            em.Muscle(f"m{k}", **dict(zip(PARAMETERS, row, strict=True)))
            for k, row in enumerate(data["parameters"])
        )
        return muscles, data["states"].T, data["force"]


def integrate(muscles, state, tolerance=TOLERANCE):
    a, F, u, l_0, v_0, l_1, v_1 = state
    return em.integrate_window(
        muscles, a, F, u, (l_0, l_1), (v_0, v_1), hill.WINDOW, tolerance=tolerance
    )


def test_the_box_is_the_whole_box(box):
    muscles, (a, F, u, l_0, v_0, l_1, v_1), _ = box
    optimal, f = muscles.optimal_fiber_length, F / muscles.max_isometric_force
    fiber = [hill.load(muscle, F[k], l_0[k])[0] for k, muscle in enumerate(muscles)]
    assert a.min() < 0.011
    assert a.max() > 0.99
    assert u.min() == 0.01
    assert u.max() == 1.0
    assert f.min() < -0.09
    assert f.max() > 1.99
    assert min(fiber) < 0.31
    assert max(fiber) > 1.79
    assert max(abs(v_0 / optimal).max(), abs(v_1 / optimal).max()) > 14.9
    ratio = [muscle.tendon_slack_length / muscle.optimal_fiber_length for muscle in muscles]
    assert min(ratio) < 0.11
    assert max(ratio) > 9.0


def test_force_at_the_default_tolerance(box):
    muscles, state, force = box
    end = integrate(muscles, state)
    error = abs(end.force - force) / muscles.max_isometric_force
    assert kernels.DEFAULT_TOLERANCE == TOLERANCE
    assert error.max() < TOLERANCE, f"state {error.argmax()}"


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-5, 1e-6])
def test_force_at_other_tolerances(box, tolerance):
    muscles, state, force = box
    end = integrate(muscles, state, tolerance)
    error = abs(end.force - force) / muscles.max_isometric_force
    assert error.max() < tolerance, f"state {error.argmax()}"


def test_activation_is_exact(box):
    muscles, state, _ = box
    end = integrate(muscles, state)
    exact = [
        hill.activation(muscle, a, u, hill.WINDOW)
        for muscle, a, u in zip(muscles, state[0], state[2], strict=True)
    ]
    np.testing.assert_allclose(end.activation, exact, rtol=1e-14)


@pytest.mark.parametrize("number", [0, 149, 226, 398, 599])
def test_stored_references_are_what_radau_gives(box, number):
    muscles, state, force = box
    muscle = list(muscles)[number]
    again = hill.window(muscle, *state[:, number])
    assert again == pytest.approx(force[number], abs=1e-9 * muscle.max_isometric_force)


def test_fresh_draws():
    rng = np.random.default_rng(11)
    for _ in range(5):
        muscle, *state = hill.draw(rng)
        end = integrate(em.MuscleSet([muscle]), np.array(state)[:, None])
        reference = hill.window(muscle, *state)
        assert abs(end.force[0] - reference) < TOLERANCE * muscle.max_isometric_force


def test_same_bits_twice_and_muscle_by_muscle(box):
    muscles, state, _ = box
    first, second = integrate(muscles, state), integrate(muscles, state)
    for one, other in zip(first, second, strict=True):
        assert one.tobytes() == other.tobytes()
    for k in (3, 77):
        alone = integrate(em.MuscleSet([list(muscles)[k]]), state[:, k : k + 1])
        assert [float(x[0]) for x in alone] == [float(x[k]) for x in first]


def test_steps_are_returned(box):
    muscles, state, _ = box
    rough, fine = integrate(muscles, state, 1e-4), integrate(muscles, state, 1e-6)
    assert rough.steps.min() >= 20  # no step is longer than a twentieth of the window
    assert (fine.steps > rough.steps).all()
    # Second order: 100 times the accuracy in 10 times the steps, for states that need many.
    many = rough.steps > 100
    assert np.median(fine.steps[many] / rough.steps[many]) == pytest.approx(10.0, rel=0.15)


# -- fixed steps ----------------------------------------------------------------------------------

MUSCLE = em.Muscle(
    "smooth",
    max_isometric_force=1000.0,
    optimal_fiber_length=0.1,
    tendon_slack_length=0.2,
    pennation_angle_at_optimal=0.2,
)
TABLE = em.MuscleSet([MUSCLE]).table


def smooth_state(a, u, f=0.4, fiber=0.9):
    """A unit near its balance that first lengthens, then shortens."""
    l_0 = hill.length(MUSCLE, 1000.0 * f, 0.1 * fiber)
    return a, 1000.0 * f, u, l_0, 0.10, l_0 + 0.0004, -0.05


def at_fixed_steps(state, N):
    mesh = hill.WINDOW * np.arange(1, N + 1) / N
    n, a, F, F_u = kernels.integrate(TABLE, 0, *state, hill.WINDOW, TOLERANCE, mesh, N)
    assert n == N
    return a, F, F_u


def order(steps, errors):
    """Slope of log(error) against log(step)."""
    return -np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize(("a", "u"), [(0.4, 1.0), (0.6, 0.2), (0.3, 0.35)])
def test_second_order(a, u):
    state = smooth_state(a, u)
    exact = hill.window(MUSCLE, *state)
    steps = np.array([8, 16, 32, 64, 128])
    errors = [abs(at_fixed_steps(state, N)[1] - exact) for N in steps]
    assert order(steps, errors) == pytest.approx(2.0, abs=0.05)
    assert errors[-1] < 1e-5 * 1000.0


def march(state, N):
    """`step` N times, as the unified mode does: activation by the trapezoidal rule too."""
    a, F, u, *ends = state
    h = hill.WINDOW / N
    l, v = hill.cubic(0.0, hill.WINDOW, *ends)
    for k in range(1, N + 1):
        l_1, v_1 = hill.cubic(k * h, hill.WINDOW, *ends)
        converged, a, F, _, _ = kernels.step(TABLE, 0, a, F, u, l, v, l_1, v_1, h)
        assert converged
        l, v = l_1, v_1
    return a, F


@pytest.mark.parametrize(("a", "u"), [(0.4, 1.0), (0.6, 0.2)])
def test_unified_step_is_second_order(a, u):
    state = smooth_state(a, u)
    exact = hill.window(MUSCLE, *state), hill.activation(MUSCLE, a, u, hill.WINDOW)
    steps = np.array([8, 16, 32, 64, 128])
    ends = [march(state, N) for N in steps]
    assert order(steps, [abs(F - exact[0]) for _, F in ends]) == pytest.approx(2.0, abs=0.05)
    assert order(steps, [abs(a - exact[1]) for a, _ in ends]) == pytest.approx(2.0, abs=0.05)


@pytest.fixture(scope="module", params=[0.01, 0.5, 1.0])
def settled(request, box):
    """(a, F, u, l, v) of the box's states one window later, and a new excitation."""
    muscles, state, _ = box
    end = integrate(muscles, state)
    return end.activation, end.force, np.full(len(muscles), request.param), state[5], state[6]


def unified_step(muscles, k, start, h, l=None, v=None):
    """`step` of muscle k with held speed, or to the length `l` and the speed `v`."""
    a, F, u, l_0, v_0 = (values[k] for values in start)
    l = l_0 + h * v_0 if l is None else l
    v = v_0 if v is None else v
    return kernels.step(muscles.table, k, a, F, u, l_0, v_0, l, v, h)


def trapezoidal_error(muscle, start, end, h):
    """Error of the force after one step: residual of the rule over its own slope."""
    a, F, _, l, v = start
    a_1, F_1, l_1, v_1 = end
    mean = 0.5 * (hill.rate(muscle, a, F, l, v) + hill.rate(muscle, a_1, F_1, l_1, v_1))
    slope = em.contraction_rate(em.MuscleSet([muscle]), [a_1], [F_1], [l_1], [v_1])[0, 2]
    return abs(F + h * mean - F_1) / (1.0 + 0.5 * h * abs(slope))


@pytest.mark.parametrize("h", [0.001, 0.01])
def test_unified_step_solves_the_trapezoidal_rule(box, settled, h):
    muscles, _, _ = box
    for k, muscle in enumerate(muscles):
        converged, a_1, F_1, _, _ = unified_step(muscles, k, settled, h)
        assert converged, k
        start = [values[k] for values in settled]
        end = a_1, F_1, start[3] + h * start[4], start[4]
        assert trapezoidal_error(muscle, start, end, h) < 1e-9 * muscle.max_isometric_force, k


def test_unified_step_says_when_it_has_no_solution(box):
    """Far off the balance the trapezoidal rule overshoots: with 1 ms steps and time constants of
    1 us and less it need not have a solution at all. What counts as converged is one."""
    muscles, (a, F, u, l_0, v_0, _, _), _ = box
    h, solved = 0.001, 0
    for k, muscle in enumerate(muscles):
        converged, a_1, F_1, _, _ = unified_step(muscles, k, (a, F, u, l_0, v_0), h)
        if converged:
            solved += 1
            start = a[k], F[k], u[k], l_0[k], v_0[k]
            end = a_1, F_1, l_0[k] + h * v_0[k], v_0[k]
            assert trapezoidal_error(muscle, start, end, h) < 1e-9 * muscle.max_isometric_force, k
    assert 450 < solved < 600


def test_unified_step_derivatives(box, settled):
    muscles, _, _ = box
    h, checked = 0.001, 0
    for k, muscle in enumerate(muscles):
        F0, optimal = muscle.max_isometric_force, muscle.optimal_fiber_length
        l, v = settled[3][k] + h * settled[4][k], settled[4][k]
        _, _, F_1, F_l, F_v = unified_step(muscles, k, settled, h)
        p = l - hill.tendon(muscle, F_1 / F0)[0]
        if abs(p - hill.shortest(muscle)) < 1e-3 * optimal:
            continue  # the kink of the shortest fibre
        step_l, step_v = 1e-6 * optimal, 1e-4 * optimal
        by_l = difference(lambda l, k=k: unified_step(muscles, k, settled, h, l=l)[2], l, step_l)
        by_v = difference(
            lambda v, k=k, l=l: unified_step(muscles, k, settled, h, l, v)[2], v, step_v
        )
        # F_1 is converged to some 1e-15 F0.
        assert F_l == pytest.approx(by_l, rel=1e-5, abs=1e-14 * F0 / step_l), k
        assert F_v == pytest.approx(by_v, rel=1e-5, abs=1e-14 * F0 / step_v), k
        checked += 1
    assert checked > 500


# -- sensitivity ----------------------------------------------------------------------------------


def test_sensitivity_against_differences_on_a_frozen_mesh(box):
    muscles, state, _ = box
    mesh = np.empty(kernels.MAX_STEPS)
    delta = 1e-5
    for k, muscle in enumerate(muscles):
        a, F, u, *ends = state[:, k]
        u = min(max(u, 0.01 + 2.0 * delta), 1.0 - 2.0 * delta)
        if abs(u - a) < 3.0 * delta:
            continue  # the time constant changes at u = a
        n, _, _, F_u = kernels.integrate(
            muscles.table, k, a, F, u, *ends, hill.WINDOW, TOLERANCE, mesh, 0
        )

        def end(u, k=k, a=a, F=F, ends=ends, n=n):
            return kernels.integrate(
                muscles.table, k, a, F, u, *ends, hill.WINDOW, TOLERANCE, mesh, n
            )[2]

        F0 = muscle.max_isometric_force
        assert F_u == pytest.approx(difference(end, u, delta), rel=1e-5, abs=1e-8 * F0), k


def pulls_throughout(muscle, state):
    """Whether the fibre's active force stays positive in the whole window."""
    a, F, u, *ends = state
    mesh = np.empty(kernels.MAX_STEPS)
    table = em.MuscleSet([muscle]).table
    arguments = (table, 0, a, F, u, *ends, hill.WINDOW, TOLERANCE)
    n = kernels.integrate(*arguments, mesh, 0)[0]
    # The steps are tiny while the start's transient lasts: some of those, all of the last.
    for k in {*range(0, n, max(1, n // 50)), *range(max(0, n - 40), n)}:
        force = kernels.integrate(*arguments, mesh, k + 1)[2]
        l, _ = hill.cubic(mesh[k], hill.WINDOW, *ends)
        if hill.load(muscle, force, l)[2] <= 0.0:
            return False
    return True


@given(seed=st.integers(0, 2**32), u=st.floats(0.01, 0.99), more=st.floats(0.01, 1.0))
@hypothesis.settings(max_examples=150)
def test_force_increases_with_excitation(seed, u, more):
    """Wherever the fibre pulls. One that shortens faster than its maximum velocity is pushed, and
    activation then stiffens it against that: `test_a_pushed_fibre_resists`."""
    muscle, a, F, _, *ends = hill.draw(np.random.default_rng(seed))
    table, mesh = em.MuscleSet([muscle]).table, np.empty(kernels.MAX_STEPS)
    higher = min(u + more, 1.0)
    hypothesis.assume(pulls_throughout(muscle, (a, F, u, *ends)))
    hypothesis.assume(pulls_throughout(muscle, (a, F, higher, *ends)))
    arguments = (*ends, hill.WINDOW, TOLERANCE, mesh)
    n, _, low, slope = kernels.integrate(table, 0, a, F, u, *arguments, 0)
    n, _, high, _ = kernels.integrate(table, 0, a, F, higher, *arguments, n)
    if n < 0:  # the steps chosen for one excitation may be too long for another
        _, _, high, _ = kernels.integrate(table, 0, a, F, higher, *arguments, 0)
        assert high > low - TOLERANCE * muscle.max_isometric_force
    else:
        assert high > low
    assert slope > 0.0


def test_a_pushed_fibre_resists():
    """Beyond the maximum shortening velocity the force-velocity curve is negative: F falls with u,
    but not below slack by more than the curve's end."""
    l = hill.length(MUSCLE, 100.0, 0.1)
    v = -1.5  # m/s, 15 optimal lengths/s
    ends = ([l], [l + v * hill.WINDOW]), ([v], [v])
    muscles = em.MuscleSet([MUSCLE])
    low, high = (
        em.integrate_window(muscles, [0.5], [100.0], [u], *ends, hill.WINDOW) for u in (0.01, 1.0)
    )
    assert high.force[0] < low.force[0]
    assert high.sensitivity[0] < 0.0
    assert high.force[0] > -0.2 * 1000.0


# -- errors ---------------------------------------------------------------------------------------

GOOD = {
    "activation": [0.5],
    "force": [400.0],
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
        ("force", [np.inf], "force: expected 1 finite"),
        ("force", [], "force: expected 1 finite"),
        ("excitation", ["high"], "excitation: expected 1 finite"),
        ("length", ([0.3], [np.nan]), "length_at_end: expected 1 finite"),
        ("length", ([0.3, 0.3], [0.3]), "length_at_start: expected 1 finite"),
        ("lengthening_speed", ([0.0], [[0.0]]), "speed_at_end: expected 1 finite"),
        ("window", 0.0, "window = 0.0 s"),
        ("window", -0.01, "window = -0.01 s"),
        ("window", np.nan, "window = nan s"),
        ("window", np.inf, "window = inf s"),
        ("tolerance", 0.0, r"tolerance = 0.0 is outside \[1e-06, 0.01\]"),
        ("tolerance", 0.1, "tolerance = 0.1 is outside"),
        ("tolerance", np.nan, "tolerance = nan is outside"),
    ],
)
def test_bad_input(name, value, message):
    with pytest.raises(em.ParameterError, match=message):
        em.integrate_window(em.MuscleSet([MUSCLE]), **{**GOOD, name: value})


def test_good_input_is_good():
    em.integrate_window(em.MuscleSet([MUSCLE]), **GOOD)


def test_a_failed_window_names_the_muscle():
    """The box has no window that fails; a length that runs to 1e200 m does."""
    muscles = em.MuscleSet([MUSCLE])
    with pytest.raises(em.WindowError, match=r"muscle 'smooth'.*activation 0\.5, force 400 N"):
        em.integrate_window(muscles, **{**GOOD, "length": ([0.3], [1e200])})
