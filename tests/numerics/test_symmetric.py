"""Symmetric equations within kernels, beside LAPACK's."""

import numpy as np
import pytest

from exudyn_muscles.numerics.symmetric import divided, factorized


@pytest.mark.parametrize("n", [1, 2, 7, 30])
@pytest.mark.parametrize("shift", [0.0, -0.3])
def test_solutions_are_lapacks(n, shift):
    """Of positive definite matrices, and of others."""
    rng = np.random.default_rng(n)
    A = rng.normal(size=(n, 2 * n))
    G, b = A @ A.T / n + shift * np.eye(n), rng.normal(size=n)
    L, x = G.copy(), b.copy()
    assert factorized(L)
    divided(L, x)
    np.testing.assert_allclose(x, np.linalg.solve(G, b), rtol=1e-9)


def test_negative_pivots():
    L, x = np.array([[1.0, 0.0], [2.0, 1.0]]), np.array([1.0, 5.0])
    assert factorized(L)
    divided(L, x)
    np.testing.assert_allclose(x, np.linalg.solve([[1.0, 2.0], [2.0, 1.0]], [1.0, 5.0]))


@pytest.mark.parametrize("G", [np.zeros((1, 1)), np.diag([1.0, 0.0]), np.ones((2, 2)),
                               np.diag([2.0, np.nan])])  # fmt: skip
def test_what_is_singular_is_not_factorized(G):
    assert not factorized(G.copy())
