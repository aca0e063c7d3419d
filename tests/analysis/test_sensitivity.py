"""Derivatives of recruited forces against differences of recruitments."""

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.analysis import recruitment_sensitivity

from .test_feasible import random_recruitment, recruit

STEP = 1e-5


def central(change):
    """Derivative of the recruited forces by the argument of `change`, which makes arguments."""
    ahead, behind = (recruit(*change(x)).force for x in (STEP, -STEP))
    return (ahead - behind) / (2.0 * STEP)


@pytest.mark.parametrize("seed", range(4))
def test_against_differences(seed):
    r, Q_m, F, low, high, N = random_recruitment(seed)
    found = recruitment_sensitivity(r, F, low, high, N)
    assert 6 < np.count_nonzero(found.free) < F.size
    atol = 1e-5 * N.max()
    for j in range(Q_m.size):
        unit = np.eye(Q_m.size)[j]
        expected = central(lambda x, unit=unit: (r, Q_m + x * unit, low, high, N))
        np.testing.assert_allclose(found.demand[:, j], expected, rtol=1e-5, atol=1e-3)
    for k in (0, 7, 19):
        for j in (0, 3):
            dr = np.zeros_like(r)
            dr[k, j] = 1e-2
            expected = central(lambda x, dr=dr: (r + x * dr, Q_m, low, high, N)) / 1e-2
            np.testing.assert_allclose(found.moment_arms[:, k, j], expected, rtol=1e-4, atol=atol)
        ds = np.eye(F.size)[k]
        expected = central(
            lambda x, ds=ds: (r, Q_m, *(limit * (1.0 + x * ds) for limit in (low, high, N)))
        )
        np.testing.assert_allclose(found.strengths[:, k], expected, rtol=1e-5, atol=1e-2)


def test_where_it_does_not_exist():
    r, _, F, _, _, N = random_recruitment(0)
    with pytest.raises(em.ParameterError, match="the 0 muscles that are free"):
        recruitment_sensitivity(r, F, F, F, N)
    with pytest.raises(em.ParameterError, match=r"\(m, n\) and four arrays"):
        recruitment_sensitivity(r, F[1:], F, F, N)
    for wrong in (-N, 0.0 * N):
        with pytest.raises(em.ParameterError, match="normalizers positive"):
            recruitment_sensitivity(r, F, F, F, wrong)
    with pytest.raises(em.ParameterError, match="forces are finite"):
        recruitment_sensitivity(r, F * np.nan, F, F, N)
