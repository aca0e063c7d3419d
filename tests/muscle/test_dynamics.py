"""What a muscle does at one instant: one consistent picture, whatever the law and the tendon."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import exudyn_muscles as em
from exudyn_muscles.muscle.dynamics import tendon_forces
from exudyn_muscles.muscle.trapezoidal import step

from ..differences import difference
from ..zoo import LAWS
from . import hill
from .test_contraction import EITHER_TENDON, EVERY_LAW, random_state, states


def of_one(state, u=None):
    muscle, *arguments = state
    excitation = None if u is None else [u]
    found = em.muscle_dynamics(em.MuscleSet([muscle]), *([x] for x in arguments), excitation)
    return em.MuscleDynamics(*(values[0] for values in found))


def stands_still(state):
    """Whether the fibre rests at its stop."""
    muscle, _, l_t, l, _ = state
    return l - l_t <= hill.shortest(muscle) * (1.0 + 1e-9) + 1e-12


@EVERY_LAW
@EITHER_TENDON
def test_every_quantity_is_the_formula(law, rigid):
    @given(state=states(law, rigid), u=st.floats(0.01, 1.0))
    @settings(max_examples=40)
    def check(state, u):
        muscle, a, l_t, l, v = state
        found, curves = of_one(state, u), hill.curves(muscle)
        x, cos = hill.fiber(muscle, l_t, l)
        near = 1e-13 * muscle.max_isometric_force
        exact = max(hill.force(*state), 0.0)
        assert found.tendon_force == pytest.approx(exact, rel=1e-11, abs=10.0 * near)
        assert found.fiber_length == pytest.approx(x * muscle.optimal_fiber_length, rel=1e-14)
        assert math.cos(found.pennation_angle) == pytest.approx(cos, abs=1e-14)
        assert found.active_force_length == pytest.approx(curves.active(x), rel=1e-12, abs=1e-13)
        assert found.passive_force_length == pytest.approx(curves.passive(x), rel=1e-12, abs=1e-13)
        assert found.activation_rate == pytest.approx(hill.activation_rate(muscle, a, u), rel=1e-13)
        if rigid:
            assert found.tendon_length_rate == 0.0
            assert found.tendon_stiffness == math.inf
        elif not stands_still(state):
            exact = hill.rate(*state)
            rounding = 1e-11 * (abs(v) + muscle.max_contraction_velocity)
            assert found.tendon_length_rate == pytest.approx(exact, rel=1e-10, abs=rounding)
        assert found.fiber_velocity == pytest.approx(
            (v - found.tendon_length_rate) * cos, rel=1e-13
        )

    check()


@EVERY_LAW
@EITHER_TENDON
def test_fiber_and_tendon_bear_the_same(law, rigid):
    """F = F0 (a f_l f_v + f_PE + beta v) cos(alpha), and f_v goes with the velocity.

    The damper of some laws is another, and a fibre of Schutte that is pushed bears what it has to.
    """
    count = []

    @given(state=states(law, rigid))
    @settings(max_examples=80)
    def check(state):
        muscle, a, l_t, l, v = state
        found, F0 = of_one(state), muscle.max_isometric_force
        active = F0 * a * found.active_force_length * found.force_velocity
        assert found.active_fiber_force == pytest.approx(active, rel=1e-13)
        V = muscle.max_contraction_velocity * muscle.optimal_fiber_length
        v_m = found.fiber_velocity / V
        formulas = hill.curves(muscle)
        damper, near = formulas.damping * v_m, 1e-13 * F0
        if isinstance(law, (em.Thelen2003Deprecated, em.Schutte1993)):
            strength = a * found.active_force_length
            w = v_m / formulas.fastest(a)
            damper = formulas.borne(strength, w) - strength * found.force_velocity
            near = 1e-11 * (F0 + abs(active))
        passive = F0 * (found.passive_force_length + damper)
        pushed = found.tendon_force < F0 * found.passive_force_length * math.cos(
            found.pennation_angle
        )
        if not (isinstance(law, em.Schutte1993) and pushed):
            assert found.passive_fiber_force == pytest.approx(passive, rel=1e-12, abs=near)
        if stands_still(state):
            return
        along = (found.active_fiber_force + found.passive_fiber_force) * math.cos(
            found.pennation_angle
        )
        along = max(along, 0.0)  # slack tendons and rigid units do not push
        terms = abs(active) + abs(passive) + F0
        assert found.tendon_force == pytest.approx(along, abs=1e-11 * terms)
        count.append(1)

    check()
    assert len(count) > 20


@EVERY_LAW
@EITHER_TENDON
def test_power_balance(law, rigid):
    """F l' = F l_t' + F_fibre l_m': what goes in goes into tendon and fibre."""

    @given(state=states(law, rigid))
    @settings(max_examples=40)
    def check(state):
        muscle, a, l_t, l, v = state
        found = of_one(state)
        if stands_still(state) or found.tendon_force == 0.0:
            return
        fiber = (found.active_fiber_force + found.passive_fiber_force) * found.fiber_velocity
        tendon = found.tendon_force * found.tendon_length_rate
        V = muscle.max_contraction_velocity * muscle.optimal_fiber_length
        terms = abs(fiber) + abs(tendon) + muscle.max_isometric_force * (abs(v) + 0.1 * V)
        parts = abs(found.active_fiber_force) + abs(found.passive_fiber_force)
        terms += parts * abs(found.fiber_velocity)
        assert found.tendon_force * v == pytest.approx(fiber + tendon, abs=1e-11 * terms)

    check()


@EVERY_LAW
def test_tendon_stiffness_is_the_slope_of_the_force(law):
    rng = np.random.default_rng(0)
    for _ in range(30):
        muscle = em.Muscle(
            "unit",
            max_isometric_force=10.0 ** rng.uniform(1.5, 4.0),
            optimal_fiber_length=0.1,
            tendon_slack_length=0.1 * 10.0 ** rng.uniform(-1.0, 1.0),
            law=law,
        )
        l_t = muscle.tendon_slack_length * (1.0 + rng.uniform(0.001, 0.05))
        state = muscle, 0.5, l_t, l_t + 0.1, 0.0

        def force(s, state=state):
            return of_one((state[0], state[1], s, *state[3:])).tendon_force

        step = 1e-5 * muscle.tendon_slack_length
        slope = difference(force, l_t, step)
        assert of_one(state).tendon_stiffness == pytest.approx(slope, rel=1e-5)


@EVERY_LAW
def test_a_slack_unit_bears_nothing(law):
    if isinstance(law, em.Thelen2003Deprecated):
        pytest.skip("its tendon is never slack")
    muscle = unit(law=law)
    for l_t in (0.1, 0.15, 0.19, 0.1995):
        if hill.tension(muscle, l_t) > 0.0:
            assert isinstance(law, em.DeGrooteFregly2016Published)  # taut from 0.9989 l_ts on
            continue
        found = of_one((muscle, 0.5, l_t, l_t + 0.1, 0.3))
        assert found.tendon_force == found.tendon_stiffness == 0.0
        assert found.fiber_velocity < 0.0  # it takes the slack up
        pushes = hill.tension(muscle, l_t) * muscle.max_isometric_force  # by its curve
        fiber = found.active_fiber_force + found.passive_fiber_force
        assert fiber == pytest.approx(pushes, rel=1e-9, abs=1e-9)


@EVERY_LAW
@EITHER_TENDON
def test_no_force_is_below_zero(law, rigid):
    """Of any state, and at the end of any window from it."""
    rng = np.random.default_rng(3)
    slack = 0
    for _ in range(60):
        muscle, a, l_t, l, v = random_state(rng, law, rigid)
        if not rigid:
            l_t = muscle.tendon_slack_length * rng.uniform(0.85, 1.01)
            l = l_t + rng.uniform(0.3, 1.2) * muscle.optimal_fiber_length
        muscles = em.MuscleSet([muscle])
        state = [a], [l_t], [l], [v]
        force = em.muscle_dynamics(muscles, *state).tendon_force[0]
        balance = em.equilibrium(muscles, [a], [l], [v])
        rows = np.empty(1)
        tendon_forces(muscles.tables, *(np.array(x) for x in state), rows)
        assert rows[0] == force
        ends = [l, l + 0.001 * v], [v, v]
        end = em.integrate_window(
            muscles, [a], [l_t], [0.01], *(([x], [y]) for x, y in ends), 0.001
        )
        assert min(force, balance.force[0], end.force[0]) >= 0.0
        if force == 0.0:
            slack += 1
            assert step(muscles.tables, 0, a, l_t, 0.01, l, v, l, v, 1e-9)[3:] == (0.0, 0.0, 0.0)
    assert slack > 10 or rigid or isinstance(law, em.Thelen2003Deprecated)


@EVERY_LAW
def test_a_fiber_at_its_stop_moves_with_its_path(law):
    muscle = unit(law=law, pennation_angle_at_optimal=0.3)
    l_t = 0.195  # slack
    for v in (-0.5, 0.0, 0.3):
        # Also beyond: a path that is shorter than the state says.
        for beyond in (0.0, 1e-3):
            found = of_one((muscle, 0.5, l_t, l_t + hill.shortest(muscle) - beyond, v))
            assert found.tendon_length_rate == v
            assert found.fiber_velocity == 0.0
            assert found.fiber_length == pytest.approx(
                math.hypot(hill.shortest(muscle), hill.width(muscle)), rel=1e-14
            )


# -- the fibre's length as the state --------------------------------------------------------------


@EVERY_LAW
def test_tendon_length_inverts_the_fiber_length(law):
    @given(state=states(law))
    @settings(max_examples=40)
    def check(state):
        muscle, a, l_t, l, v = state
        muscles = em.MuscleSet([muscle])
        again = em.tendon_length(muscles, [of_one(state).fiber_length], [l])
        # At 84 deg the projection is known to ten times less than the fibre's length.
        assert again[0] == pytest.approx(l_t, abs=1e-13 * l)

    check()


def test_tendon_length_of_several_units():
    muscles = em.MuscleSet([unit("a", pennation_angle_at_optimal=0.3), unit("b")])
    l_t = em.tendon_length(muscles, [0.09, 0.11], [0.3, 0.31])
    width = 0.1 * math.sin(0.3)
    np.testing.assert_allclose(l_t, [0.3 - math.sqrt(0.09**2 - width**2), 0.2], rtol=1e-15)


def test_several_units_are_as_each_alone():
    rng = np.random.default_rng(1)
    muscles = em.MuscleSet(
        unit(name, law=law, ignore_tendon_compliance=k % 3 == 2)
        for k, (name, law) in enumerate(LAWS.items())
    )
    m = len(muscles)
    a, u = rng.uniform(0.01, 1.0, (2, m))
    l_t = np.where([muscle.ignore_tendon_compliance for muscle in muscles], 0.2, 0.204)
    l, v = rng.uniform(0.28, 0.32, m), rng.uniform(-0.5, 0.5, m)
    together = em.muscle_dynamics(muscles, a, l_t, l, v, u)
    for k, muscle in enumerate(muscles):
        alone = of_one((muscle, a[k], l_t[k], l[k], v[k]), u[k])
        np.testing.assert_array_equal([values[k] for values in together], alone)


def test_without_excitation_there_is_no_activation_rate():
    found = of_one((unit(), 0.5, 0.2, 0.3, 0.0))
    assert math.isnan(found.activation_rate)
    assert np.isfinite(np.delete(found, em.MuscleDynamics._fields.index("activation_rate"))).all()


# -- bad input ------------------------------------------------------------------------------------


def unit(name="unit", **parameters):
    sizes = {"max_isometric_force": 1000.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.2}
    return em.Muscle(name, **sizes, **parameters)


@pytest.mark.parametrize("bad", [[1.0, 2.0], [math.nan], [math.inf], 1.0, ["x"]])
def test_bad_arrays(bad):
    muscles = em.MuscleSet([unit()])
    names = "activation", "tendon_length", "length", "lengthening_speed", "excitation"
    for position, name in enumerate(names):
        arguments = [[0.5], [0.2], [0.3], [0.0], [0.5]]
        arguments[position] = bad
        with pytest.raises(em.ParameterError, match=f"{name}: expected 1 finite values"):
            em.muscle_dynamics(muscles, *arguments)
    for position, name in enumerate(("fiber_length", "length")):
        arguments = [[0.1], [0.3]]
        arguments[position] = bad
        with pytest.raises(em.ParameterError, match=f"{name}: expected 1 finite values"):
            em.tendon_length(muscles, *arguments)


@pytest.mark.parametrize("a", [0.0, -0.5, 1.1])
def test_activation_out_of_range(a):
    with pytest.raises(em.ParameterError, match=rf"'unit': activation {a:g} .* \[0\.01, 1\]"):
        em.muscle_dynamics(em.MuscleSet([unit()]), [a], [0.2], [0.3], [0.0])


def test_a_fiber_shorter_than_its_width():
    muscles = em.MuscleSet([unit("fine"), unit("thick", pennation_angle_at_optimal=0.5)])
    with pytest.raises(em.ParameterError, match=r"'thick': fiber_length = 0\.04 m .* 0\.0479"):
        em.tendon_length(muscles, [0.04, 0.04], [0.3, 0.3])


def test_a_rigid_tendon_has_its_slack_length_whatever_is_given():
    unit = em.Muscle(
        "rigid", max_isometric_force=1000.0, optimal_fiber_length=0.1, tendon_slack_length=0.2,
        ignore_tendon_compliance=True,
    )  # fmt: skip
    muscles = em.MuscleSet([unit])
    for l_t in (0.15, 0.2, 0.25):
        assert em.muscle_dynamics(muscles, [0.5], [l_t], [0.3], [0.0]).tendon_force == (
            em.equilibrium(muscles, [0.5], [0.3]).force
        )
        end = em.integrate_window(
            muscles, [0.5], [l_t], [0.5], ([0.3], [0.3]), ([0.0], [0.0]), 0.01
        )
        assert end.tendon_length == 0.2
        assert end.force == pytest.approx(em.equilibrium(muscles, [0.5], [0.3]).force, rel=1e-14)
