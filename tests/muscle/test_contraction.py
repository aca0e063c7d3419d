"""Contraction dynamics (4) of all laws: the formulas, derivatives, the stop, the slack tendon."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import exudyn_muscles as em
from exudyn_muscles.muscle.contraction import at_stop, stopped_rate, tendon_force, tendon_rate

from ..differences import certified
from ..zoo import LAWS
from . import hill

EVERY_LAW = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
EITHER_TENDON = pytest.mark.parametrize("rigid", [False, True], ids=["elastic", "rigid"])
EITHER_INTEGRATOR = pytest.mark.parametrize("integrator", em.Integrator)


@st.composite
def units(draw, law=None, rigid=False):
    optimal = draw(st.floats(0.04, 0.2))
    return em.Muscle(
        "unit",
        max_isometric_force=draw(st.floats(30.0, 10000.0)),
        optimal_fiber_length=optimal,
        tendon_slack_length=optimal * draw(st.floats(0.1, 10.0)),
        pennation_angle_at_optimal=draw(st.sampled_from([0.0, 0.1, 0.3, 0.5])),
        law=draw(st.sampled_from(list(LAWS.values()))) if law is None else law,
        ignore_tendon_compliance=rigid,
    )


@st.composite
def states(draw, law=None, rigid=False):
    """A unit and a state (a, l_t, l, l') of the allowed box; fibres may be at their stop."""
    muscle = draw(units(law, rigid))
    a = draw(st.floats(0.01, 1.0))
    l_t = muscle.tendon_slack_length
    if not rigid:
        l_t = hill.tendon_length(muscle, draw(st.floats(-0.1, 2.0)) * muscle.max_isometric_force)
    fiber = draw(st.floats(0.3, 1.8)) * muscle.optimal_fiber_length
    width = hill.width(muscle)
    l = l_t + math.sqrt(max(fiber**2 - width**2, hill.shortest(muscle) ** 2))
    return muscle, a, l_t, l, draw(st.floats(-15.0, 15.0)) * muscle.optimal_fiber_length


def random_state(rng, law, rigid=False):
    """Like `states`, but never on a kink."""
    optimal = rng.uniform(0.04, 0.2)
    muscle = em.Muscle(
        "unit",
        max_isometric_force=10.0 ** rng.uniform(1.5, 4.0),
        optimal_fiber_length=optimal,
        tendon_slack_length=optimal * 10.0 ** rng.uniform(-1.0, 1.0),
        pennation_angle_at_optimal=rng.choice([0.0, rng.uniform(0.05, 0.5)]),
        law=law,
        ignore_tendon_compliance=rigid,
    )
    l_t = muscle.tendon_slack_length
    if not rigid:
        l_t = hill.tendon_length(muscle, rng.uniform(-0.1, 2.0) * muscle.max_isometric_force)
        if rng.random() < 0.1:
            l_t = muscle.tendon_slack_length * rng.uniform(0.9, 1.0)
    fiber = rng.uniform(0.25, 1.8) * optimal
    p = math.sqrt(max(fiber**2 - hill.width(muscle) ** 2, (0.9 * hill.shortest(muscle)) ** 2))
    return muscle, rng.uniform(0.01, 1.0), l_t, l_t + p, rng.uniform(-15.0, 15.0) * optimal


def of_one(kernel, state):
    muscle, *rest = state
    return kernel(em.MuscleSet([muscle]).tables, 0, *rest)


def rounding(state, partials):
    """What rounding of the arguments alone changes, over the machine precision."""
    return abs(np.array(partials)) @ abs(np.array(state[1 : 1 + len(partials)]))


# -- the formulas ---------------------------------------------------------------------------------


@EVERY_LAW
def test_rate_is_the_formula(law):
    @given(state=states(law))
    @settings(max_examples=50)
    def check(state):
        muscle, a, l_t, l, v = state
        value, *partials, f_t = of_one(tendon_rate, state)
        p_t = hill.projection_rate(muscle, a, l_t, l)
        terms = abs(v) + abs(p_t) + rounding(state, partials)
        # Some curves go on along tangents of their polynomials, which are good to 1e-12.
        V = muscle.max_contraction_velocity * muscle.optimal_fiber_length
        precision = 1e-12 if abs(p_t) < 2.0 * V else 5e-12
        assert value == pytest.approx(v - p_t, rel=precision, abs=1e-14 * (terms + V))
        stopped, *found = of_one(stopped_rate, state)
        assert found == ([v, 0.0, 0.0, 0.0, f_t] if stopped else [value, *partials, f_t])
        per_F0 = of_one(tendon_force, state)[2] / muscle.max_isometric_force
        assert f_t == pytest.approx(per_F0, rel=1e-14)

    check()


@EVERY_LAW
def test_force_is_the_formula(law):
    @given(state=states(law))
    @settings(max_examples=50)
    def check(state):
        muscle, a, l_t, l, v = state
        value, *partials = of_one(tendon_force, state)
        F0 = muscle.max_isometric_force
        # A tension is known to 1e-13 F0, where the curve does not vanish exactly.
        near = 1e-13 * F0 + 1e-14 * rounding(state, partials)
        assert value == pytest.approx(hill.force(*state), rel=1e-12, abs=near)
        assert partials[0] == partials[2] == partials[3] == 0.0
        if not isinstance(muscle.law, NEVER_SLACK) and l_t < muscle.tendon_slack_length:
            assert value == partials[1] == 0.0

    check()


# Their tendons push or pull where they are slack.
NEVER_SLACK = (em.DeGrooteFregly2016, em.DeGrooteFregly2016Published, em.Thelen2003Deprecated)


@EVERY_LAW
def test_force_at_a_rigid_tendon_is_the_formula(law):
    @given(state=states(law, rigid=True))
    @settings(max_examples=50)
    def check(state):
        muscle, a, l_t, l, v = state
        value, *partials = of_one(tendon_force, state)
        near = 1e-13 * muscle.max_isometric_force + 1e-14 * rounding(state, partials)
        assert value == pytest.approx(hill.force(*state), rel=1e-12, abs=near)
        assert of_one(tendon_rate, state) == (0.0,) * 5
        assert of_one(at_stop, (muscle, l_t, l)) == l_t

    check()


# -- their derivatives ----------------------------------------------------------------------------


def check_partials(kernel, state, scales, least=0.0):
    """Partial derivatives against differences where these certify themselves; how many do.

    `scales` are changes of the arguments over which the function bends; `least` is a value that is
    known to be small beside what the function can be.
    """
    muscle, *arguments = state
    units = em.MuscleSet([muscle]).tables
    partials = kernel(units, 0, *arguments)[1 : 1 + len(scales)]
    certain = 0
    for k, (partial, scale) in enumerate(zip(partials, scales, strict=True)):
        if k == 1 and muscle.ignore_tendon_compliance:  # l_t is not a state
            certain += partial == 0.0
            continue

        def along(s, k=k):
            shifted = list(arguments)
            shifted[k] = s
            return kernel(units, 0, *shifted)[0]

        found, apart = certified(along, arguments[k], scale)
        size = max(abs(found), abs(partial), least / scale)
        if apart <= 1e-7 * size:
            certain += 1
            assert abs(partial - found) <= 1e-6 * size, (k, partial, found, state)
    return certain


@EVERY_LAW
def test_partial_derivatives_of_the_rate(law):
    rng = np.random.default_rng(1)
    certain, count = 0, 150
    for _ in range(count):
        state = random_state(rng, law)
        muscle, a, l_t, l, _ = state
        optimal, V = muscle.optimal_fiber_length, muscle.max_contraction_velocity
        # The inverse of f_v bends over a tenth of its argument load / (a f_l).
        x, cos = hill.fiber(muscle, l_t, l)
        capacity = min(max(a * hill.curves(muscle).active(x), 1e-4), 1.0)
        stretch = muscle.tendon_strain * muscle.tendon_slack_length
        scales = (
            0.3 * a * min(1.0, capacity * 3.0),
            0.1 * min(capacity * stretch, optimal * cos),
            0.1 * min(capacity * optimal, optimal * cos),
        )
        certain += check_partials(tendon_rate, state, scales, 1e-3 * V * optimal)
    assert certain > 0.95 * 3 * count


@EVERY_LAW
@pytest.mark.parametrize("rigid", [False, True], ids=["elastic", "rigid"])
def test_partial_derivatives_of_the_force(law, rigid):
    rng = np.random.default_rng(2)
    certain, count = 0, 100
    for _ in range(count):
        state = random_state(rng, law, rigid)
        muscle, a, l_t, l, _ = state
        optimal, V = muscle.optimal_fiber_length, muscle.max_contraction_velocity
        _, cos = hill.fiber(muscle, l_t, l)
        stretch = muscle.tendon_strain * muscle.tendon_slack_length
        scales = (0.3 * a, 0.1 * stretch, 0.1 * optimal * cos, 0.01 * V * optimal)
        certain += check_partials(tendon_force, state, scales, 1e-3 * muscle.max_isometric_force)
    assert certain > 0.95 * 4 * count


# -- the ends of the box --------------------------------------------------------------------------


@given(state=states())
@settings(max_examples=150)
def test_nothing_overflows(state):
    assert np.isfinite(of_one(tendon_rate, state)).all()
    assert np.isfinite(of_one(tendon_force, state)).all()


@EVERY_LAW
@pytest.mark.parametrize("rigid", [False, True], ids=["elastic", "rigid"])
def test_nothing_overflows_in_the_corners(law, rigid):
    for lean in (0.0, 0.5):
        for ratio in (0.1, 10.0):
            muscle = em.Muscle(
                "unit",
                max_isometric_force=1000.0,
                optimal_fiber_length=0.1,
                tendon_slack_length=0.1 * ratio,
                pennation_angle_at_optimal=lean,
                law=law,
                ignore_tendon_compliance=rigid,
            )
            for a in (0.01, 1.0):
                for strain in (-0.2, -0.02, 0.0, 0.07):
                    for fiber in (0.0, 0.3, 1.8):
                        l_t = 0.1 * ratio * (1.0 + strain)
                        p = math.sqrt(max((0.1 * fiber) ** 2 - hill.width(muscle) ** 2, 0.0))
                        for v in (-1.5, 0.0, 1.5):
                            state = muscle, a, l_t, l_t + p, v
                            assert np.isfinite(of_one(stopped_rate, state)).all()
                            assert np.isfinite(of_one(tendon_force, state)).all()


# -- the stop -------------------------------------------------------------------------------------


@EVERY_LAW
def test_the_fiber_stops(law):
    """At its shortest length it rests while it would shorten, and leaves when it is pulled."""

    @given(muscle=units(law), a=st.floats(0.01, 1.0), f=st.floats(0.0, 2.0), v=st.floats(-1.0, 1.0))
    @settings(max_examples=50)
    def check(muscle, a, f, v):
        l_t = hill.tendon_length(muscle, f * muscle.max_isometric_force)
        l = l_t + hill.shortest(muscle)
        l_t = of_one(at_stop, (muscle, math.inf, l))
        assert l - l_t == pytest.approx(hill.shortest(muscle), abs=1e-15 + 1e-15 * l)
        assert of_one(at_stop, (muscle, l_t - 1e-3, l)) == l_t - 1e-3
        at = of_one(stopped_rate, (muscle, a, l_t, l, v))
        free = hill.projection_rate(muscle, a, l_t, l)
        rest = 1e-9 * muscle.max_contraction_velocity * muscle.optimal_fiber_length
        if free < -rest:
            assert at[:5] == (True, v, 0.0, 0.0, 0.0)
        elif free > rest:
            assert not at[0]
            assert at[1] == pytest.approx(v - free, rel=1e-9, abs=rest)
        # A fibre that is not there moves freely.
        longer = of_one(stopped_rate, (muscle, a, l_t, l + 1e-4, v))
        assert not longer[0]
        assert longer[1] == pytest.approx(hill.rate(muscle, a, l_t, l + 1e-4, v), rel=1e-8)

    check()


# -- the slack tendon -----------------------------------------------------------------------------


@EITHER_INTEGRATOR
@given(muscle=units(), a=st.floats(0.01, 1.0), stretch=st.floats(0.8, 1.2))
@settings(max_examples=40)
def test_slack_tendon_recovers(integrator, muscle, a, stretch):
    muscles = em.MuscleSet([muscle])
    F0, optimal = muscle.max_isometric_force, muscle.optimal_fiber_length
    l = hill.length(muscle, 0.0, stretch * optimal)
    taut = hill.tendon_length(muscle, 0.0)
    slack = 0.06 * muscle.tendon_slack_length  # here f_SE of De Groote is -0.19
    # The fibre takes the slack up, unloaded or pushed.
    slowest = min(-hill.projection_rate(muscle, a, taut - s, l) for s in np.linspace(0, slack, 9))
    windows = 2 + math.ceil(1.5 * slack / slowest / hill.WINDOW)
    l_t, level, force = np.array([taut - slack]), np.array([a]), -np.inf
    resting = em.equilibrium(muscles, [a], [l])
    for _ in range(windows):
        end = em.integrate_window(
            muscles, level, l_t, [a], ([l], [l]), ([0.0], [0.0]), 0.01, integrator=integrator
        )
        assert end.force[0] > force - 1e-4 * F0  # rises towards the balance
        assert end.tendon_length[0] > l_t[0] - 1e-4 * slack
        l_t, force = end.tendon_length, end.force[0]
        if force > 0.5 * resting.force[0]:
            break
    assert force > 0.0


@EITHER_INTEGRATOR
@given(muscle=units(), a=st.floats(0.01, 1.0), speed=st.floats(3.0, 15.0))
@settings(max_examples=40)
def test_slack_tendon_taut_after_a_stretch(integrator, muscle, a, speed):
    muscles = em.MuscleSet([muscle])
    optimal = muscle.optimal_fiber_length
    slack = 0.06 * muscle.tendon_slack_length
    l_t = np.array([hill.tendon_length(muscle, 0.0) - slack])
    # The fibre rests at its optimal length, the tendon hangs loose; then the unit is pulled.
    start = hill.length(muscle, 0.0, optimal) - slack
    v = speed * optimal
    for k in range(1 + math.ceil((slack + 0.2 * optimal) / v / hill.WINDOW)):
        ends = (start + k * v * hill.WINDOW, start + (k + 1) * v * hill.WINDOW)
        end = em.integrate_window(
            muscles, [a], l_t, [a], ([ends[0]], [ends[1]]), ([v], [v]), hill.WINDOW,
            integrator=integrator,
        )  # fmt: skip
        l_t = end.tendon_length
    assert end.force[0] > 0.0


@EITHER_INTEGRATOR
@pytest.mark.parametrize("lean", [0.0, 0.3], ids=["straight", "pennate"])
@EVERY_LAW
def test_a_slack_unit_is_taken_up_by_a_stretch(law, lean, integrator):
    """Window by window against the oracle: no force at all while slack, then taut."""
    muscle = em.Muscle(
        "unit",
        max_isometric_force=1000.0,
        optimal_fiber_length=0.1,
        tendon_slack_length=0.2,
        pennation_angle_at_optimal=lean,
        law=law,
    )
    muscles = em.MuscleSet([muscle])
    a, l_t = 0.1, 0.17
    l, v = hill.length(muscle, 0.0, 0.09) - 0.03, 0.0
    exact = a, l_t
    forces = []
    for k in range(8):
        # Pulled with a speed that grows and falls.
        v_1 = 0.9 * math.sin(math.pi * (k + 1) / 8)
        l_1 = l + 0.5 * hill.WINDOW * (v + v_1)
        u = 0.3 if k % 2 else 0.05
        exact = hill.window(muscle, *exact[:2], u, l, v, l_1, v_1)
        end = em.integrate_window(
            muscles, [a], [l_t], [u], ([l], [l_1]), ([v], [v_1]), hill.WINDOW, integrator=integrator
        )
        a, l_t, l, v = end.activation[0], end.tendon_length[0], l_1, v_1
        assert end.force[0] == pytest.approx(exact[2], abs=1e-4 * 1000.0)
        assert a == pytest.approx(exact[0], abs=1e-4)
        # One F0 is a stretch of some 0.01 m; where the tendon is slack, errors of l_t are as large.
        assert l_t == pytest.approx(exact[1], abs=2e-6)
        forces.append(end.force[0])
        if not isinstance(law, NEVER_SLACK):
            assert (end.force[0] == 0.0) == (l_t <= 0.2)
    assert max(forces) > 100.0
    if not isinstance(law, NEVER_SLACK):
        assert forces[:2] == [0.0, 0.0]


# -- rigid tendons --------------------------------------------------------------------------------


@EITHER_INTEGRATOR
@EVERY_LAW
def test_a_rigid_tendon_keeps_its_length(law, integrator):
    rng = np.random.default_rng(3)
    for _ in range(10):
        muscle, a, l_t, l, v = random_state(rng, law, rigid=True)
        u, l_0, v_0, l_1, v_1 = hill.course(rng, muscle, l, v)
        end = em.integrate_window(
            em.MuscleSet([muscle]), [a], [l_t], [u], ([l_0], [l_1]), ([v_0], [v_1]), hill.WINDOW,
            integrator=integrator,
        )  # fmt: skip
        assert end.tendon_length[0] == l_t
        exact = hill.window(muscle, a, l_t, u, l_0, v_0, l_1, v_1)
        assert end.activation[0] == pytest.approx(exact[0], abs=1e-4)
        assert end.force[0] == pytest.approx(exact[2], abs=1e-4 * muscle.max_isometric_force)
