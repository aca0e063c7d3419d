"""What a force is divided by in (10)."""

import dataclasses

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.skeleton.geometry import Geometry

MUSCLES = em.MuscleSet(
    em.Muscle(f"m{k}", max_isometric_force=F0, optimal_fiber_length=0.1, tendon_slack_length=0.1)
    for k, F0 in enumerate([1000.0, 2000.0, 3000.0])
)
GEOMETRY = Geometry(np.array([0.2, 0.21, 0.101]), np.array([0.1, -0.5, 0.0]), np.zeros((3, 1)))


def test_reachable_maximum_is_guarded():
    """The paper's normaliser; where nothing can be reached, a thousandth of F0."""
    N = em.ReachableMaximum()(MUSCLES, np.array([500.0, 0.0, 2.9]), GEOMETRY)
    np.testing.assert_array_equal(N, [500.0, 2.0, 3.0])


def test_maximum_isometric_force():
    N = em.MaximumIsometricForce()(MUSCLES, np.array([500.0, 0.0, 2.9]), GEOMETRY)
    np.testing.assert_array_equal(N, [1000.0, 2000.0, 3000.0])


def test_normalizers_change_who_pulls():
    """With equal arms, forces share as the squares of their normalisers."""
    from exudyn_muscles.recruitment.demand import Demand
    from exudyn_muscles.recruitment.optimization import Recruiter

    r, F_max = np.full((3, 1), 0.05), np.array([900.0, 600.0, 300.0])
    for normalizer in (em.ReachableMaximum(), em.MaximumIsometricForce()):
        N = normalizer(MUSCLES, F_max, GEOMETRY)
        F = Recruiter().solve(Demand(r, np.array([10.0]), np.zeros(3), F_max, N)).force
        np.testing.assert_allclose(F / F[0], (N / N[0]) ** 2, rtol=1e-9)


@pytest.mark.parametrize("law", [em.DeGrooteFregly2016(), em.Millard2012(), em.Thelen2003()])
def test_rigid_tendon_force_is_that_of_a_rigid_unit_without_its_passive_part(law):
    """Against the unit itself, made rigid; the third fibre is too short to pull."""
    muscles = [
        dataclasses.replace(
            muscle, law=law, ignore_tendon_compliance=True, pennation_angle_at_optimal=0.3
        )
        for muscle in MUSCLES
    ]
    now = em.muscle_dynamics(em.MuscleSet(muscles), np.ones(3), np.full(3, 0.1), *GEOMETRY[:2])
    expected = now.active_fiber_force * np.cos(now.pennation_angle)
    assert (expected[:2] > 200.0).all()
    expected[2] = 3.0  # the guard
    elastic = em.MuscleSet(
        [dataclasses.replace(muscle, ignore_tendon_compliance=False) for muscle in muscles]
    )
    N = em.RigidTendonForce()(elastic, np.ones(3), GEOMETRY)
    np.testing.assert_allclose(N, expected, rtol=1e-13)
