"""The nearest torque within reach, and the cheapest forces that deliver it.

Two problems, one behind the other, in the unknowns and rows of `optimization.py`:

    nearest     min |W (A x - b)|^2                           low <= x <= high
    cheapest    min |x|^2 / 2    s.t.  A x = A x_nearest,     low <= x <= high

Both are solved by active sets, with an orthogonal factorization in every step. The first one as by
P. B. Stark, R. L. Parker, "Bounded-variable least-squares: an algorithm and applications",
Computational Statistics 10 (1995).
"""

from __future__ import annotations

import math

import numpy as np

from ..numerics.kernel import kernel
from .cheapest import cheapest_point
from .equations import contents, first_bound, gaps, in_place, in_units, move
from .householder import factors, least_squares

# Where an unknown is: at a bound, between both, unlimited and not yet in use, without room.
LOW, FREE, HIGH, UNUSED, FIXED = range(5)
# From which part of the sum of their terms' sizes on a slope and a gap are more than rounding.
SLOPE, GAP = 2.0**-50, 1e-13
# A slope this large over the gap's terms holds an unknown at its bound, whatever it costs there.
HOLDS = 1e-9


@kernel(allocates=True)
def two_levels(A, b, low, high, weights, x, loose):
    """Write the cheapest of the x (m,) with the nearest torque, and which of them are `loose` (m,):
    they may change without the torque becoming less near.

    Returns two residuals. Of the nearest torque: the largest slope of the gap that an unknown could
    still follow, over the sum of its terms' sizes. Of the cheapest x: that of `cheapest_point`.
    """
    n, m = A.shape
    u, at, slope = np.empty(m), np.empty(m, dtype=np.int64), np.empty(m)
    r, size = np.empty(n), np.empty(n)
    # Every row in units of what it is about: is the demand within reach?
    rows = contents(A, b, low, high)
    p = in_units(A, b, low, high, rows, 1.0 / rows)
    start(p, u, at, slope, r, size)
    residual = nearest_point(p, u, at, slope)
    gaps(p, u, r, size)
    reached = (np.abs(r) <= GAP * size).all()
    if not reached:
        # Then the weights say what is nearest.
        u /= p.length
        p = in_units(A, b, low, high, rows, weights / (weights * rows).max())
        u *= p.length
        residual = nearest_point(p, u, at, slope)
        gaps(p, u, r, size)
    for i in range(m):
        gap, terms = 0.0, 0.0
        for j in range(n):
            gap += abs(p.C[j, i] * r[j])
            terms += abs(p.C[j, i]) * size[j]
        held = not reached and abs(slope[i]) > max(HOLDS * gap, GAP * terms)
        loose[i] = at[i] == FREE or not (at[i] == FIXED or held)
    in_place(p, u, low, high, x)
    if not reached:
        b = A @ x
    rows += np.abs(A) @ np.abs(x)
    p = in_units(A, b, low, high, rows, 1.0 / rows)
    return residual, cheapest_point(p, low, high, x, loose)


@kernel
def start(p, u, at, slope, r, size):
    """All unknowns to the bounds to which the slopes at the smallest u point."""
    for i in range(u.size):
        u[i] = min(max(0.0, p.low[i]), p.high[i])
    gaps(p, u, r, size)
    slopes(p, r, slope)
    for i in range(u.size):
        used = False
        for j in range(r.size):
            used = used or p.C[j, i] != 0.0
        if not used or p.low[i] == p.high[i]:
            at[i] = FIXED
        elif p.low[i] == -math.inf and p.high[i] == math.inf:
            at[i] = UNUSED
        elif p.low[i] == -math.inf or (slope[i] > 0.0 and p.high[i] < math.inf):
            at[i] = HIGH
        else:
            at[i] = LOW


@kernel(allocates=True)
def nearest_point(p, u, at, slope):
    """Write the u (m,) with the smallest |d - C u|, where each one is, and the slopes there.

    Begins with u and `at` as they are, whose free columns are independent. Returns the largest
    slope that an unknown could follow, over the sum of its terms' sizes.
    """
    n, m = p.C.shape
    r, size, rest, z = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    free, refused = np.empty(n, dtype=np.int64), np.zeros(m, dtype=np.bool_)
    f = factors(n, n)
    k = 0
    for i in range(m):
        if at[i] == FREE:
            free[k] = i
            k += 1
        elif at[i] == LOW or at[i] == HIGH:
            u[i] = p.low[i] if at[i] == LOW else p.high[i]
    new, before, solved, checked, residual = -1, LOW, k == 0, False, math.inf
    for _ in range(20 * (m + n)):
        gaps(p, u, r, size)
        if not solved:
            for c in range(k):
                for j in range(n):
                    f.M[j, c] = p.C[j, free[c]]
            rest[:] = r
            least_squares(f, n, k, rest, z)
            part, block = first_bound(p, free, k, u, z, 0.0)
            side = FREE if block < 0 else LOW if z[block] < 0.0 else HIGH
            for c in range(k):
                if free[c] == new and not z[c] * slope[new] > 0.0:
                    # By rounding: it would leave its bound for the wrong side.
                    part, block, side, refused[new] = 0.0, c, before, True
            if part > 0.0:
                refused[:] = False
            move(p, free, k, u, z, part)
            if block >= 0:
                i = free[block]
                at[i] = side
                if side != UNUSED:
                    u[i] = p.low[i] if side == LOW else p.high[i]
                k -= 1
                free[block:k] = free[block + 1 : k + 1]
            new, solved = -1, block < 0 or k == 0
            continue
        slopes(p, r, slope)
        residual, new = steepest(p, size, at, slope, refused)
        if new >= 0 and k < n:
            before, at[new], free[k] = at[new], FREE, new
            k, solved, checked = k + 1, False, False
        elif checked or k == 0:
            break
        else:
            # Once more, with what rounding has left.
            new, solved, checked = -1, False, True
    return residual


@kernel
def steepest(p, size, at, slope, refused):
    """The largest slope that an unknown could follow, over the sum of its terms' sizes; and the
    unknown to set free, -1 if there is none."""
    residual, largest, new = 0.0, 0.0, -1
    for i in range(slope.size):
        follows = abs(slope[i])
        if at[i] == LOW:
            follows = slope[i]
        elif at[i] == HIGH:
            follows = -slope[i]
        if at[i] == FIXED or not follows > 0.0:
            continue
        terms = 0.0
        for j in range(size.size):
            terms += abs(p.C[j, i]) * size[j]
        residual = max(residual, follows / terms)
        if at[i] != FREE and not refused[i] and follows > max(SLOPE * terms, largest):
            largest, new = follows, i
    return residual, new


@kernel
def slopes(p, r, slope):
    """Write C^T r: how |r|^2 / 2 falls with each unknown."""
    for i in range(slope.size):
        slope[i] = 0.0
        for j in range(r.size):
            slope[i] += p.C[j, i] * r[j]
