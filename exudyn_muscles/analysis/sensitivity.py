"""How recruited forces follow what they were recruited from: exact derivatives from the active set.

Where the least sum of (F / N)^2 with r^T F = Q_m has the muscles `free` between their limits and
the others at one, with W = diag(N_i^2) over the free ones and 0 over the others,

    F = W r lambda + F_held,    A lambda = Q_m - r^T F_held,    A = r^T W r,

and the derivatives are those of linear equations. They hold as long as no muscle comes to a limit
or leaves one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError
from ..recruitment.problem import all_usable


class Sensitivity(NamedTuple):
    """Derivatives of m forces.

    Attributes
    ----------
    free : (m,) ndarray of bool
        Muscles that are between their limits.
    demand : (m, n) ndarray
        dF/dQ_m [1/m or 1].
    moment_arms : (m, m, n) ndarray
        dF_i/dr_kj [N/m or N].
    strengths : (m, m) ndarray
        dF_i/ds_k [N] of factors s_k, one now, on a muscle's limits and normalising force together.
    """

    free: np.ndarray
    demand: np.ndarray
    moment_arms: np.ndarray
    strengths: np.ndarray


def recruitment_sensitivity(
    moment_arms: ArrayLike,
    force: ArrayLike,
    force_min: ArrayLike,
    force_max: ArrayLike,
    normalizer: ArrayLike,
) -> Sensitivity:
    """Derivatives of one recruitment by the sum of squares, the default criterion.

    Parameters
    ----------
    moment_arms : (m, n) array_like
        r [m or 1].
    force, force_min, force_max : (m,) array_like
        The recruited forces and their limits [N].
    normalizer : (m,) array_like
        N [N], the normalising forces.

    Returns
    -------
    Sensitivity

    Raises
    ------
    ParameterError
        Shapes do not fit, or the muscles that are free cannot follow every demand: some coordinates
        have none left, and the derivative does not exist.
    """
    r = np.asarray(moment_arms, dtype=float)
    F, low, high, N = (np.asarray(x, float) for x in (force, force_min, force_max, normalizer))
    if r.ndim != 2 or not all(x.shape == r.shape[:1] for x in (F, low, high, N)):
        raise ParameterError(
            f"moment arms (m, n) and four arrays (m,) were expected, got {r.shape} and "
            f"{[x.shape for x in (F, low, high, N)]}"
        )
    given = np.concatenate((r.ravel(), F))
    if not (np.isfinite(given).all() and all_usable(N) and (low <= high).all()):
        raise ParameterError(
            "moment arms and forces are finite, normalizers positive and finite, and no limit is "
            "above the other"
        )
    rounding = 1e-9 * N
    free = (low + rounding < F) & (high - rounding > F)
    W = np.where(free, N * N, 0.0)
    A = (r * W[:, None]).T @ r
    if np.linalg.matrix_rank(A, hermitian=True) < r.shape[1]:
        raise ParameterError(
            f"the {np.count_nonzero(free)} muscles that are free cannot follow every demand"
        )
    held = np.where(free, 0.0, F)
    multipliers = np.linalg.solve(A, r.T @ (F - held))
    demand = np.linalg.solve(A, (r * W[:, None]).T).T  # W r A^-1
    # With dr: dF = W dr lambda + W r dlambda, A dlambda = -dA lambda - dr^T F_held, and of a
    # change of r_k alone dA lambda + dr^T F_held = dr_k F_k + W_k r_k (dr_k lambda).
    m, n = r.shape
    arms = -F[None, :, None] * demand[:, None, :]
    arms -= (demand @ (r * W[:, None]).T)[:, :, None] * multipliers
    arms[np.arange(m), np.arange(m)] += W[:, None] * multipliers
    # With ds_k: W_k grows by 2 W_k, a force that is held by itself.
    grows = np.where(free, 2.0 * W * (r @ multipliers), held)
    strengths = np.diag(grows) - demand @ (r * grows[:, None]).T
    return Sensitivity(free, demand, arms, strengths)
