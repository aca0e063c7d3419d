"""What a force is divided by in (10)."""

import numpy as np

import exudyn_muscles as em

MUSCLES = em.MuscleSet(
    em.Muscle(f"m{k}", max_isometric_force=F0, optimal_fiber_length=0.1, tendon_slack_length=0.1)
    for k, F0 in enumerate([1000.0, 2000.0, 3000.0])
)


def test_reachable_maximum_is_guarded():
    """The paper's normaliser; where nothing can be reached, a thousandth of F0."""
    N = em.ReachableMaximum()(MUSCLES, np.array([500.0, 0.0, 2.9]))
    np.testing.assert_array_equal(N, [500.0, 2.0, 3.0])


def test_maximum_isometric_force():
    N = em.MaximumIsometricForce()(MUSCLES, np.array([500.0, 0.0, 2.9]))
    np.testing.assert_array_equal(N, [1000.0, 2000.0, 3000.0])


def test_normalizers_change_who_pulls():
    """With equal arms, forces share as the squares of their normalisers."""
    from exudyn_muscles.recruitment.optimization import Recruiter

    r, F_max = np.full((3, 1), 0.05), np.array([900.0, 600.0, 300.0])
    for normalizer in (em.ReachableMaximum(), em.MaximumIsometricForce()):
        N = normalizer(MUSCLES, F_max)
        F = Recruiter(["q"]).solve(r, np.array([10.0]), np.zeros(3), F_max, N).force
        np.testing.assert_allclose(F / F[0], (N / N[0]) ** 2, rtol=1e-9)
