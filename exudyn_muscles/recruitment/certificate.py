"""The optimality conditions that every answer of a solver is checked by."""

from __future__ import annotations

import numpy as np

from ..numerics.kernel import kernel

# Rounding of sums over the sizes of their terms: it is then all that can be asked for.
ROUNDING = 1e-12
# Accepted KKT residual of the scaled problem. DAQP reaches 1e-13, OSQP 1e-9 with our settings.
ACCEPTED = 1e-7


@kernel
def kkt_residual(x, g, y, A, b, low, high):
    """Largest violation of A clip(x, low, high) = b and x = clip(x - g - A^T y, low, high), with
    the gradient `g` of what is minimised, each over the rounding of its terms if these are large;
    NaN if any number is NaN."""
    worst = 0.0
    for j in range(b.size):
        error, terms = -b[j], abs(b[j])
        for i in range(x.size):
            part = A[j, i] * min(max(x[i], low[i]), high[i])
            error += part
            terms += abs(part)
        error = abs(error) / max(1.0, ROUNDING / ACCEPTED * terms)
        if error > worst or np.isnan(error):
            worst = error
    for i in range(x.size):
        free, terms = x[i] - g[i], 0.0
        for j in range(b.size):
            free -= A[j, i] * y[j]
            terms += abs(A[j, i] * y[j])
        # 0 * free: a multiplier that is not finite must not disappear behind a bound.
        error = x[i] - min(max(free, low[i]), high[i]) + 0.0 * free
        error = abs(error) / max(1.0, ROUNDING / ACCEPTED * terms)
        if error > worst or np.isnan(error):
            worst = error
    return worst
