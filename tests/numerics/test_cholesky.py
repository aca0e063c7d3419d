"""Cholesky factorization within kernels, beside LAPACK's."""

import numpy as np
import pytest

from exudyn_muscles.numerics.cholesky import divided, factorized


@pytest.mark.parametrize("n", [1, 2, 7, 30])
def test_solutions_are_lapacks(n):
    rng = np.random.default_rng(n)
    A = rng.normal(size=(n, 2 * n))
    G, b = A @ A.T, rng.normal(size=n)
    L, x = G.copy(), b.copy()
    assert factorized(L)
    divided(L, x)
    np.testing.assert_allclose(np.tril(L), np.linalg.cholesky(G), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(x, np.linalg.solve(G, b), rtol=1e-9)


@pytest.mark.parametrize(
    "G",
    [np.zeros((1, 1)), np.diag([1.0, 0.0]), np.ones((2, 2)), np.diag([2.0, -1.0]),
     np.array([[1.0, 2.0], [2.0, 1.0]])],
)  # fmt: skip
def test_what_is_not_positive_definite_is_not_factorized(G):
    assert not factorized(G.copy())
