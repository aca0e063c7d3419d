"""Operators on muscles, and models with other muscles on the same skeleton."""

from dataclasses import replace

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import operators
from exudyn_muscles.muscle.laws import LAWS
from models import pedalling, pendulum


def unit(name="unit", **parameters):
    size = {"max_isometric_force": 1000.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.2}
    return em.Muscle(name, **(size | parameters))


def curves(muscle):
    return muscle.law.curves()


@pytest.mark.parametrize("law", LAWS.values())
def test_fibres_without_passive_force(law):
    rigid = law().curves().tendon_force_length is None
    given = unit(law=law(), ignore_tendon_compliance=rigid)
    (muscle,) = operators.ignore_passive_fiber_forces([given])
    x = np.linspace(0.3, 2.5, 50)
    assert not curves(muscle).passive_force_length(x).any()
    np.testing.assert_array_equal(
        curves(muscle).active_force_length(x), law().curves().active_force_length(x)
    )
    (l,) = em.tendon_length(em.MuscleSet([muscle]), [1.6 * muscle.optimal_fiber_length], [1.0])
    assert 0.0 < l < 1.0


@pytest.mark.parametrize("law", LAWS.values())
def test_wider_fibres(law):
    once = operators.scale_active_fiber_force_curve_width([unit(law=law())], 1.5)
    (twice,) = operators.scale_active_fiber_force_curve_width(once, 1.2)
    x = np.linspace(0.3, 2.0, 50)
    expected = law().curves().active_force_length((x - 1.0) / 1.8 + 1.0)
    np.testing.assert_allclose(curves(twice).active_force_length(x), expected, rtol=0, atol=1e-12)


def test_wider_as_the_law_itself_has_it():
    (muscle,) = operators.scale_active_fiber_force_curve_width([unit()], 1.5)
    own = em.DeGrooteFregly2016(active_force_width_scale=1.5).curves().active_force_length
    x = np.linspace(0.3, 2.0, 50)
    # Curves are made to 1e-9 or so each.
    np.testing.assert_allclose(curves(muscle).active_force_length(x), own(x), rtol=0, atol=1e-8)


def test_muscles_without_physiology_pull_with_their_activation():
    given = unit(pennation_angle_at_optimal=0.4, law=em.Millard2012(), minimum_activation=0.0)
    (muscle, other) = operators.ignore_physiology([given, unit("other")], "unit")
    assert other == unit("other")
    units = em.MuscleSet([muscle])
    for l, v, a in ((0.05, 3.0, 0.2), (0.31, -4.0, 0.7), (2.0, 0.0, 1.0), (0.3, 0.0, 0.0)):
        found = em.muscle_dynamics(units, [a], [0.0], [l], [v])
        assert found.tendon_force[0] == 1000.0 * a
    end = em.integrate_window(
        units, [0.1], [0.0], [0.6], ([0.3], [0.3]), ([0.0], [0.0]), 0.01,
        integrator=em.Integrator.ROSENBROCK,
    )  # fmt: skip
    assert end.force[0] == pytest.approx(600.0, abs=1e-6)


def test_tendons_strengths_and_laws():
    both = [unit("a"), unit("b")]
    changed = operators.ignore_tendon_compliance(both, ["b"])
    assert [m.ignore_tendon_compliance for m in changed] == [False, True]
    back = operators.ignore_tendon_compliance(changed, ignore=False)
    assert [m.ignore_tendon_compliance for m in back] == [False, False]
    stronger = operators.scale_max_isometric_force(both, 2.0, "a")
    assert stronger[0].max_isometric_force == 2.0 * both[0].max_isometric_force
    assert stronger[1] is both[1]
    (damped,) = operators.replace_law([unit(minimum_activation=0.02)], em.Millard2012())
    assert isinstance(damped.law, em.Millard2012) and damped.minimum_activation == 0.02
    with pytest.raises(em.ParameterError, match="a MuscleLaw such as"):
        operators.replace_law(both, "Thelen")
    with pytest.raises(em.ParameterError, match="there is no muscle 'c', only a, b"):
        operators.scale_max_isometric_force(both, 2.0, ["c"])


@pytest.mark.parametrize("source", [pendulum, pedalling])
def test_a_model_with_other_muscles(source):
    model, motion = source.build(), source.motion()
    before = em.static_optimization(model, motion)
    stronger = model.replace(muscles=operators.scale_max_isometric_force(model.muscles, 2.0))
    assert stronger.mbs is model.mbs and stronger.coordinates == model.coordinates
    after = em.static_optimization(stronger, motion)
    assert after.force_max.max() > 1.3 * before.force_max.max()
    again = em.static_optimization(stronger.replace(muscles=model.muscles), motion)
    assert again.compare(before) is None
    reserve = em.Reserve(model.coordinates[0], optimal_force=1.0)
    assert model.replace(reserves=[reserve]).reserves == (reserve,)


def test_muscles_that_pull_strongly_by_themselves_are_named():
    model, motion = pendulum.build(), pendulum.motion()
    short = [
        replace(muscle, tendon_slack_length=share * muscle.tendon_slack_length)
        for muscle, share in zip(model.muscles, (0.6, 1.0), strict=True)
    ]
    weak = model.replace(muscles=short)
    with pytest.warns(em.PassiveForceWarning, match=r"left .* N, .* times its max_isometric_force"):
        weak.check_lengths(motion(np.linspace(0.0, 1.0, 11))[0])
    relieved = weak.replace(muscles=operators.ignore_passive_fiber_forces(weak.muscles))
    relieved.check_lengths(motion(np.linspace(0.0, 1.0, 11))[0])  # says nothing
