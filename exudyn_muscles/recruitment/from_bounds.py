"""The least squares of (10) from a guess of which forces are at their bounds.

With the multipliers y of the rows x = clip(-A^T y, low, high), and A x = b has the slopes
-A_f A_f^T of those x_f that are between their bounds. The first y is that of the guess; Newton's
method goes on from there, as far as the dual cost, whose gradient A x - b is, becomes better. From
one step of a run to the next that takes a few solutions of n equations; where there is no x at all
it goes on forever, and another solver has to find that out.
"""

from __future__ import annotations

import math

import numpy as np

from ..numerics.kernel import kernel
from ..numerics.symmetric import divided, factorized

ROUNDS = 20
MET = 1e-10  # largest |A x - b| of a solution
BISECTIONS = 30  # of the way to the best place along a step


@kernel(allocates=True)
def from_bounds(A, b, low, high, near):
    """x (m,) and y (n,) from forces `near` bounds (m,), as of `Program`, and whether they were
    found."""
    n, m = A.shape
    x, y, gap, step = np.empty(m), np.zeros(n), np.empty(n), np.empty(n)
    free, way, columns = np.empty(m), np.zeros(m), np.empty((m, n))  # -A^T y, its change, A^T
    at, G, L = np.zeros(m, np.int8), np.zeros((n, n)), np.empty((n, n))
    # In loops, as numba takes seconds to compile the assignment of an array.
    for j in range(n):
        gap[j] = b[j]
    for i in range(m):
        for j in range(n):
            columns[i, j] = A[j, i]
        if near[i] < 0 and low[i] > -math.inf:
            at[i], x[i] = -1, low[i]
        elif near[i] > 0 and high[i] < math.inf:
            at[i], x[i] = 1, high[i]
        else:
            x[i] = 0.0
            add_square(G, columns[i], 1.0)
        less(gap, columns[i], x[i])
        free[i] = x[i]
    settled = False
    for count in range(ROUNDS):
        for j in range(n):
            step[j] = gap[j]
            for k in range(j + 1):
                L[j, k] = G[j, k]
            if L[j, j] == 0.0:  # nothing in the row is free: as far as the gap
                L[j, j] = 1.0
        if not factorized(L):
            return x, y, False
        divided(L, step)
        stays = True
        for i in range(m):
            way[i] = 0.0
            for j in range(n):
                way[i] += columns[i, j] * step[j]
            stays = stays and at[i] == bound(free[i] + way[i], low[i], high[i])
        # From the guess all of it: it is no place that a y belongs to.
        part = 1.0 if stays or count == 0 else best_part(free, way, low, high, step, b)
        for j in range(n):
            y[j] -= part * step[j]
            gap[j] = b[j]
        for i in range(m):
            free[i] = 0.0
            for j in range(n):
                free[i] -= columns[i, j] * y[j]
            x[i] = min(max(free[i], low[i]), high[i])
            less(gap, columns[i], x[i])
            now = bound(free[i], low[i], high[i])
            if (now == 0) != (at[i] == 0):
                add_square(G, columns[i], 1.0 if now == 0 else -1.0)
            at[i] = now
        if settled and stays:  # the second time takes off what rounding left
            met = True
            for j in range(n):
                met = met and abs(gap[j]) <= MET
            return x, y, met
        settled = stays and count > 0
    return x, y, False


@kernel
def bound(x, low, high):
    """Which bound `x` is beyond: -1, 1, or 0."""
    return -1 if x < low else int(x > high)


@kernel
def best_part(free, way, low, high, step, b):
    """How far to go along a step of -y (n,) that changes -A^T y, `free` (m,), by its `way`: all of
    it, or up to where the dual cost is best."""
    if rise(free, way, low, high, step, b, 1.0) >= 0.0:
        return 1.0
    here, there = 0.0, 1.0
    for _ in range(BISECTIONS):
        part = 0.5 * (here + there)
        if rise(free, way, low, high, step, b, part) > 0.0:
            here = part
        else:
            there = part
    return here


@kernel
def rise(free, way, low, high, step, b, part):
    """How the dual cost rises along a step after this part of it."""
    slope = 0.0
    for j in range(b.size):
        slope += step[j] * b[j]
    for i in range(free.size):
        slope -= way[i] * min(max(free[i] + part * way[i], low[i]), high[i])
    return slope


@kernel
def add_square(G, a, factor):
    """Add `factor` a a^T to the lower half of G (n, n)."""
    for j in range(a.size):
        for k in range(j + 1):
            G[j, k] += factor * a[j] * a[k]


@kernel
def less(gap, a, x):
    """Take a x off `gap` (n,)."""
    for j in range(a.size):
        gap[j] -= a[j] * x
