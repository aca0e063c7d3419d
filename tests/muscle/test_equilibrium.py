"""Equilibrium of fibre and tendon, at rest and moving, and the activation that a force asks for."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import exudyn_muscles as em
from exudyn_muscles.muscle.arguments import as_rows
from exudyn_muscles.muscle.equilibrium import steady_activations

from ..differences import certified, difference
from ..zoo import LAWS
from . import hill
from .test_contraction import EITHER_INTEGRATOR, EITHER_TENDON, EVERY_LAW, units

ACTIVATIONS = st.floats(0.01, 1.0)


def of_one(muscle, a, l, v=0.0):
    found = em.equilibrium(em.MuscleSet([muscle]), [a], [l], [v])
    return em.Equilibrium(*(values[0] for values in found))


def length(muscle, stretch):
    """Musculotendon length at the slack tendon length."""
    return muscle.tendon_slack_length + math.sqrt(
        max((stretch * muscle.optimal_fiber_length) ** 2 - hill.width(muscle) ** 2, 0.0)
    )


def fiber_force(muscle, a, l_t, l):
    """Of the resting fibre along the tendon, over F0."""
    x, cos = hill.fiber(muscle, l_t, l)
    law = hill.curves(muscle)
    return (a * law.active(x) * law.multiplier(0.0) + law.passive(x)) * cos


def slope(function, x, scale):
    """Derivative of `function` at `x`, or None at a kink."""
    found, apart = certified(function, x, scale)
    sides = [difference(function, x + side * scale, 4e-6 * scale) for side in (-1e-5, 1e-5)]
    smooth = abs(sides[1] - sides[0]) < 1e-3 * abs(found) and apart < 1e-7 * abs(found)
    return found if smooth else None


# -- at rest --------------------------------------------------------------------------------------


@EVERY_LAW
def test_fiber_and_tendon_balance(law):
    @given(muscle=units(law), a=ACTIVATIONS, stretch=st.floats(0.2, 1.7))
    @settings(max_examples=50)
    def check(muscle, a, stretch):
        l = length(muscle, stretch)
        found = of_one(muscle, a, l)
        F0, l_t = muscle.max_isometric_force, found.tendon_length
        x, _ = hill.fiber(muscle, l_t, l)
        assert found.fiber_length == pytest.approx(x * muscle.optimal_fiber_length, rel=1e-14)
        tension = max(hill.tension(muscle, l_t), 0.0)  # slack tendons do not push
        assert found.force == pytest.approx(F0 * tension, abs=1e-12 * F0)
        assert abs(found.fiber_velocity) == 0.0
        excess = hill.tension(muscle, l_t) - fiber_force(muscle, a, l_t, l)
        if l - l_t > hill.shortest(muscle) * (1.0 + 1e-9) + 1e-12:
            assert abs(excess) < 1e-12
        else:  # the fibre rests at its stop, and the tendon bears less than it could
            assert excess <= 1e-12

    check()


@EVERY_LAW
def test_a_path_too_short_to_be_taut_leaves_the_tendon_slack(law):
    """The equilibrium is the steady state of the window integration there, too."""

    @given(muscle=units(law), a=ACTIVATIONS, short=st.floats(0.0, 0.08))
    @settings(max_examples=30)
    def check(muscle, a, short):
        muscles = em.MuscleSet([muscle])
        l = hill.shortest(muscle) + (1.0 - short) * muscle.tendon_slack_length
        found = of_one(muscle, a, l)
        if isinstance(law, em.Thelen2003Deprecated):  # it pulls at its fibre
            pull = 1e-3 * found.tendon_length / muscle.tendon_slack_length
            assert found.force == pytest.approx(pull * muscle.max_isometric_force, rel=1e-12)
        else:
            assert 0.0 <= found.force <= 1e-12 * muscle.max_isometric_force
        if hill.tension(muscle, found.tendon_length) < -1e-12:
            assert found.force == found.stiffness == 0.0
        if hill.shortest(muscle) > 0.0 and not isinstance(law, em.Thelen2003Deprecated):
            assert l - found.tendon_length == pytest.approx(hill.shortest(muscle), rel=1e-9)
        for integrator in em.Integrator:
            end = em.integrate_window(
                muscles, [a], [found.tendon_length], [a], ([l], [l]), ([0.0], [0.0]), 0.1,
                integrator=integrator,
            )  # fmt: skip
            near = 1e-4 * muscle.max_isometric_force
            assert end.force[0] == pytest.approx(found.force, abs=near)

    check()


@EVERY_LAW
def test_rigid_tendon(law):
    @given(muscle=units(law, rigid=True), a=ACTIVATIONS, stretch=st.floats(0.0, 1.8))
    @settings(max_examples=50)
    def check(muscle, a, stretch):
        l = length(muscle, stretch)
        l_t = muscle.tendon_slack_length
        found = of_one(muscle, a, l)
        x, _ = hill.fiber(muscle, l_t, l)
        assert found.tendon_length == l_t
        assert found.fiber_length == pytest.approx(x * muscle.optimal_fiber_length, rel=1e-14)
        near = 1e-13 * muscle.max_isometric_force
        assert found.force == pytest.approx(hill.force(muscle, a, l_t, l, 0.0), rel=1e-12, abs=near)

    check()


@EITHER_INTEGRATOR
@EVERY_LAW
def test_it_is_the_steady_state(law, integrator):
    """Nothing moves over a window that begins there."""
    rng = np.random.default_rng(0)
    muscles = em.MuscleSet(
        em.Muscle(
            f"m{k}",
            max_isometric_force=1000.0,
            optimal_fiber_length=0.1,
            tendon_slack_length=0.1 * 4.0 ** rng.uniform(-1, 1),
            pennation_angle_at_optimal=rng.uniform(0.0, 0.5),
            law=law,
        )
        for k in range(20)
    )
    a = rng.uniform(0.01, 1.0, 20)
    l = np.array([length(muscle, rng.uniform(0.6, 1.2)) for muscle in muscles])
    start, rest = em.equilibrium(muscles, a, l), np.zeros(20)
    end = em.integrate_window(
        muscles, a, start.tendon_length, a, (l, l), (rest, rest), 0.01, integrator=integrator
    )
    np.testing.assert_allclose(end.force, start.force, rtol=0, atol=1e-9 * 1000.0)
    found = em.muscle_dynamics(muscles, a, start.tendon_length, l, rest)
    np.testing.assert_allclose(found.tendon_length_rate, 0.0, rtol=0, atol=1e-10)


# -- moving ---------------------------------------------------------------------------------------


@EVERY_LAW
def test_moving_units_share_the_speed_by_their_compliances(law):
    shared = []

    @given(
        muscle=units(law),
        a=st.floats(0.05, 1.0),
        stretch=st.floats(0.7, 1.3),
        speed=st.floats(-5.0, 5.0),
    )
    @settings(max_examples=40)
    def check(muscle, a, stretch, speed):
        l = length(muscle, stretch)
        v = speed * muscle.optimal_fiber_length
        found = of_one(muscle, a, l, v)
        l_t = found.tendon_length
        x, cos = hill.fiber(muscle, l_t, l)
        V = muscle.max_contraction_velocity * muscle.optimal_fiber_length
        slack = found.force <= 1e-9 * muscle.max_isometric_force
        if slack or x <= hill.curves(muscle).shortest * (1.0 + 1e-9):
            return  # there is no share

        # Stiffnesses of the resting fibre and of the tendon.
        def along(p):
            return fiber_force(muscle, a, l - p, l)

        def tension(l_t):
            return hill.tension(muscle, l_t)

        k_m = slope(along, l - l_t, 0.1 * muscle.optimal_fiber_length * cos)
        k_t = slope(tension, l_t, 0.02 * muscle.tendon_slack_length)
        if k_m is None or k_t is None:
            return  # at a kink the share jumps, and nothing need balance
        # With its velocity the fibre balances the tendon.
        exact = cos * hill.projection_rate(muscle, a, l_t, l)
        load = tension(l_t) / cos - hill.curves(muscle).passive(x)
        if isinstance(law, em.Schutte1993) and load < 1e-9:
            assert found.fiber_velocity < exact + 1e-8 * V  # its share is more than it can do
            return
        assert found.fiber_velocity == pytest.approx(exact, rel=1e-9, abs=1e-8 * V)
        share = k_t / (k_t + max(k_m, 0.0))
        assert found.fiber_velocity == pytest.approx(share * v * cos, rel=1e-5, abs=1e-9 * V)
        shared.append(share)

    check()
    assert len(shared) > 20


@EVERY_LAW
@pytest.mark.parametrize("v", [-0.2, -0.05, 0.1])
def test_on_the_descending_limb_the_fiber_takes_the_whole_speed_and_no_more(law, v):
    """A fibre that weakens as it is stretched has a negative compliance, and would take more."""
    muscle = em.Muscle(
        "unit", max_isometric_force=1000.0, optimal_fiber_length=0.1, tendon_slack_length=1.0,
        pennation_angle_at_optimal=0.2, law=law,
    )  # fmt: skip
    V = muscle.max_contraction_velocity * muscle.optimal_fiber_length
    limb = 0
    for stretch in np.linspace(1.1, 1.5, 9):
        l = length(muscle, stretch) + 0.02

        def along(p, l=l):
            return fiber_force(muscle, 1.0, l - p, l)

        found = of_one(muscle, 1.0, l, v)
        p = l - found.tendon_length
        if difference(along, p, 1e-6) < -0.1:
            limb += 1
            _, cos = hill.fiber(muscle, found.tendon_length, l)
            assert found.fiber_velocity == pytest.approx(v * cos, rel=1e-9)
            balances = cos * hill.projection_rate(muscle, 1.0, found.tendon_length, l)
            assert found.fiber_velocity == pytest.approx(balances, rel=1e-8, abs=1e-8 * V)
    assert limb >= 2


@EVERY_LAW
def test_a_moving_rigid_unit_moves_its_fiber_alone(law):
    @given(muscle=units(law, rigid=True), a=ACTIVATIONS, speed=st.floats(-5.0, 5.0))
    @settings(max_examples=30)
    def check(muscle, a, speed):
        l, v = length(muscle, 1.0), speed * muscle.optimal_fiber_length
        found = of_one(muscle, a, l, v)
        _, cos = hill.fiber(muscle, muscle.tendon_slack_length, l)
        assert found.fiber_velocity == pytest.approx(v * cos, rel=1e-14)
        exact = hill.force(muscle, a, muscle.tendon_slack_length, l, v)
        near = 1e-13 * muscle.max_isometric_force
        assert found.force == pytest.approx(exact, rel=1e-12, abs=near)

    check()


# -- stiffness ------------------------------------------------------------------------------------


@EVERY_LAW
@EITHER_TENDON
def test_stiffness_is_the_slope_of_the_force(law, rigid):
    rng = np.random.default_rng(4)
    certain = 0
    for _ in range(60):
        optimal = rng.uniform(0.04, 0.2)
        muscle = em.Muscle(
            "unit",
            max_isometric_force=1000.0,
            optimal_fiber_length=optimal,
            tendon_slack_length=optimal * 10.0 ** rng.uniform(-1.0, 0.7),
            pennation_angle_at_optimal=rng.choice([0.0, rng.uniform(0.05, 0.5)]),
            law=law,
            ignore_tendon_compliance=rigid,
        )
        a, l = rng.uniform(0.05, 1.0), length(muscle, rng.uniform(0.6, 1.3))

        def force(l, muscle=muscle, a=a):
            return of_one(muscle, a, l).force

        slope, apart = certified(force, l, 0.05 * optimal)
        if apart < 1e-7 * max(abs(slope), 1000.0):
            certain += 1
            assert of_one(muscle, a, l).stiffness == pytest.approx(slope, rel=1e-6, abs=1e-3)
    assert certain > 50


@EVERY_LAW
def test_a_slack_unit_without_force_has_no_stiffness(law):
    if isinstance(law, em.Thelen2003Deprecated):
        pytest.skip("its tendon is never slack")
    muscle = next(iter(slack_unit(law)))
    l = 0.9 * muscle.tendon_slack_length + hill.shortest(muscle)
    found = of_one(muscle, 0.5, l)
    assert found.stiffness == found.force == 0.0
    moving = of_one(muscle, 0.5, l, -0.1)
    assert moving.force == moving.stiffness == 0.0 and np.isfinite(moving).all()


def slack_unit(law):
    """A pennated unit, whose fibre stops under any law."""
    return em.MuscleSet(
        [
            em.Muscle(
                "unit",
                max_isometric_force=1000.0,
                optimal_fiber_length=0.1,
                tendon_slack_length=0.2,
                pennation_angle_at_optimal=0.3,
                law=law,
            )
        ]
    )


# -- the activation of a force --------------------------------------------------------------------


def steady(muscles, F, l, v=0.0):
    a = np.empty(len(muscles))
    steady_activations(muscles.tables, F, l, np.full(l.size, v), a)
    return a


@EVERY_LAW
@EITHER_TENDON
def test_steady_activation_inverts_equilibrium(law, rigid):
    @given(
        muscle=units(law, rigid),
        a=st.floats(0.02, 0.98),
        stretch=st.floats(0.5, 1.3),
        speed=st.just(0.0) | st.floats(-3.0, 3.0),
    )
    @settings(max_examples=50)
    def check(muscle, a, stretch, speed):
        muscles = em.MuscleSet([muscle])
        l, v = np.array([length(muscle, stretch)]), speed * muscle.optimal_fiber_length
        found = em.equilibrium(muscles, [a], l, [v])
        if found.fiber_length[0] > 0.5 * muscle.optimal_fiber_length and found.force[0] > 1.0:
            again = steady(muscles, found.force, l, v)
            stronger = em.equilibrium(muscles, [1.01 * a], l, [v])
            if stronger.force[0] <= (1.0 + 1e-12) * found.force[0]:
                assert isinstance(law, em.Schutte1993)  # a fibre too fast for any active force
                return
            assert again[0] == pytest.approx(a, rel=1e-9)
            # And once more around: the state of the activation found is the same.
            state = em.equilibrium(muscles, again, l, [v])
            assert state.force[0] == pytest.approx(found.force[0], rel=1e-9)
            near = 1e-9 * muscle.tendon_slack_length
            assert state.tendon_length[0] == pytest.approx(found.tendon_length[0], abs=near)

    check()


@EVERY_LAW
@EITHER_TENDON
def test_steady_activation_of_forces_out_of_reach(law, rigid):
    muscle = em.Muscle(
        "unit",
        max_isometric_force=1000.0,
        optimal_fiber_length=0.1,
        tendon_slack_length=0.2,
        law=law,
        minimum_activation=0.02,
        ignore_tendon_compliance=rigid,
    )
    muscles, l = em.MuscleSet([muscle]), np.array([0.3])
    assert steady(muscles, np.array([5000.0]), l)[0] == 1.0
    for F in (0.0, 1.0, -10.0):
        assert steady(muscles, np.array([F]), l)[0] == 0.02
    # Where the fibre has no strength any activation will do: the least.
    assert steady(muscles, np.array([10.0]), np.array([0.21]))[0] >= 0.02


# -- the public function --------------------------------------------------------------------------


def test_many_units_at_once():
    muscles = em.MuscleSet(
        em.Muscle(
            name,
            max_isometric_force=1000.0 + 10.0 * k,
            optimal_fiber_length=0.1,
            tendon_slack_length=0.2,
            pennation_angle_at_optimal=0.2,
            law=law,
            ignore_tendon_compliance=k % 2 == 1,
        )
        for k, (name, law) in enumerate(LAWS.items())
    )
    a, l = np.linspace(0.1, 0.9, len(muscles)), np.linspace(0.29, 0.31, len(muscles))
    for v in (None, np.linspace(-0.5, 0.5, len(muscles))):
        together = em.equilibrium(muscles, a, l, v)
        for k, muscle in enumerate(muscles):
            alone = of_one(muscle, a[k], l[k], 0.0 if v is None else v[k])
            np.testing.assert_array_equal([values[k] for values in together], alone)


def test_lengthening_makes_stronger():
    unit = next(iter(slack_unit(em.Millard2012())))
    forces = [of_one(unit, 0.5, 0.3, v).force for v in (-0.3, 0.0, 0.3)]
    assert forces[0] < forces[1] < forces[2]
    slope = difference(lambda v: of_one(unit, 0.5, 0.3, v).force, 0.0, 1e-3)
    assert slope > 0.0


BAD = [[1.0, 2.0], [math.nan], [math.inf], 1.0, ["x"]]


@pytest.mark.parametrize("bad", BAD)
def test_bad_arrays(bad):
    muscles = slack_unit(em.Thelen2003())
    names = ("activation", "length", "lengthening_speed")
    for position, name in enumerate(names):
        arguments = [[0.5], [0.2], [0.0]]
        arguments[position] = bad
        with pytest.raises(em.ParameterError, match=f"{name}: expected 1 finite values"):
            em.equilibrium(muscles, *arguments)


@pytest.mark.parametrize("a", [0.0, -0.5, 1.1])
def test_activation_out_of_range(a):
    with pytest.raises(em.ParameterError, match=rf"'unit': activation {a:g} .* \[0\.01, 1\]"):
        em.equilibrium(slack_unit(em.Thelen2003()), [a], [0.3])


def test_as_rows_copies():
    values = np.array([1.0])
    (row,) = as_rows(slack_unit(em.Thelen2003()), activation=values)
    row[0] = 2.0
    assert values[0] == 1.0
