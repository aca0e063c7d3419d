"""The cheapest forces with the torque of given ones: the second level of `nearest.py`.

An active set of free unknowns, to begin with all that may change. Every step goes to the cheapest
point along the directions that keep the torque, or to the first bound on the way, so that what is
within reach is never lost.
"""

from __future__ import annotations

import numpy as np

from ..numerics.kernel import kernel
from .equations import first_bound, gaps, in_place, move
from .householder import factorize, factors, least_squares, shortest, times_q

# A multiplier asks for a step away from a bound from this part of the sum of its terms' sizes on.
WRONG = 1e-12
# Rows are combinations of others if no more than this part of them is not.
DEPENDENT = 1e-13
# The same for rows that are put right at the end: smaller parts would move the rest too far.
PUT_RIGHT = 1e-9
# Unknowns may pass their bounds by this part of the largest one.
PASSED = 1e-14


@kernel(allocates=True)
def cheapest_point(p, low, high, x, loose):
    """Replace x (m,), with C u = d, by the cheapest one, of which only the `loose` may differ.

    Returns its residual: the larger one of the rows' errors over their terms' sizes and of what
    |x|^2 / 2 may still lose over what it is.
    """
    n, m = p.C.shape
    most = max(m, n)
    u, y, step, rest, z = x * p.length, np.zeros(n), np.empty(m), np.empty(most), np.empty(most)
    F, free, Z = np.empty(m, dtype=np.int64), loose.copy(), np.empty((m, m))
    f, g = factors(most, most), factors(most, most)
    k, idle = 0, 0
    for i in range(m):
        if x[i] == low[i]:
            u[i] = p.low[i]
        elif x[i] == high[i]:
            u[i] = p.high[i]
    for _ in range(20 * (m + n)):
        k, largest = 0, 0.0
        for i in range(m):
            if free[i]:
                F[k] = i
                k += 1
                largest = max(largest, abs(u[i]))
        rank = downhill(p, F, k, u, f, g, Z, rest, z, step)
        part, block = first_bound(p, F, k, u, step, PASSED * largest)
        idle = idle + 1 if move(p, F, k, u, step, part) <= PASSED * largest else 0
        if block >= 0:
            i = F[block]
            u[i], free[i] = (p.low[i] if step[block] < 0.0 else p.high[i]), False
            continue
        multipliers(p, F, k, rank, u, f, g, rest, z, y)
        leaves = most_wrong(p, loose, free, u, y)
        if leaves < 0 or idle > 2 * (m + n):
            break
        free[leaves] = True
    put_right(p, F, k, u, f)
    in_place(p, u, low, high, x)
    return residual_of_cheapest(p, low, high, x, loose, y)


@kernel
def downhill(p, F, k, u, f, g, Z, rest, z, step):
    """Write the step to the cheapest point in the directions Z of the k free unknowns F that keep
    C u. Returns the rank of the free columns, which f has factorized."""
    for c in range(k):
        for j in range(p.d.size):
            f.M[c, j] = p.C[j, F[c]]
    rank = factorize(f, k, p.d.size, DEPENDENT)
    for e in range(k - rank):
        rest[:k] = 0.0
        rest[rank + e] = 1.0
        times_q(f, k, rank, rest)
        for c in range(k):
            Z[c, e] = rest[c]
            g.M[c, e] = rest[c] / p.length[F[c]]
    for c in range(k):
        rest[c] = -u[F[c]] / p.length[F[c]]
    least_squares(g, k, k - rank, rest, z)
    for c in range(k):
        step[c] = 0.0
        for e in range(k - rank):
            step[c] += Z[c, e] * z[e]
    return rank


@kernel
def multipliers(p, F, k, rank, u, f, g, rest, z, y):
    """Write the y with which x = -A^T y for the free unknowns."""
    for c in range(k):
        i = F[c]
        for e in range(rank):
            g.M[c, e] = p.C[f.order[e], i] * p.length[i]
        rest[c] = -u[i] / p.length[i]
    least_squares(g, k, rank, rest, z)
    y[:] = 0.0
    for e in range(rank):
        y[f.order[e]] = z[e]


@kernel
def most_wrong(p, loose, free, u, y):
    """The unknown that a multiplier asks most to leave its bound; -1 if there is none."""
    found, largest = -1, 0.0
    for i in range(u.size):
        if not loose[i] or free[i]:
            continue
        wrong = -u[i] / p.length[i]
        terms = abs(wrong)
        for j in range(y.size):
            part = p.C[j, i] * p.length[i] * y[j]
            wrong -= part
            terms += abs(part)
        if u[i] == p.high[i]:
            wrong = -wrong
        if wrong > max(WRONG * terms, largest):
            found, largest = i, wrong
    return found


@kernel(allocates=True)
def put_right(p, F, k, u, f):
    """Once more C u = d with the k free unknowns F, every row by its own size, if it helps."""
    n, m = p.C.shape
    r, size, z, old = np.empty(n), np.empty(n), np.empty(m), u.copy()
    gaps(p, u, r, size)
    before = (np.abs(r) / size).max()
    for j in range(n):
        longest = 0.0
        for c in range(k):
            longest = max(longest, abs(p.C[j, F[c]]))
        longest = longest or 1.0
        r[j] /= longest
        for c in range(k):
            f.M[c, j] = p.C[j, F[c]] / longest
    shortest(f, k, n, PUT_RIGHT, r, z)
    move(p, F, k, u, z, 1.0)
    gaps(p, u, r, size)
    if (np.abs(r) / size).max() >= before:
        u[:] = old


@kernel(allocates=True)
def residual_of_cheapest(p, low, high, x, loose, y):
    """See `cheapest_point`. What may be lost is the cost less its dual, unknown by unknown."""
    r, size = np.empty(y.size), np.empty(y.size)
    gaps(p, x * p.length, r, size)
    cost, lost = 1.0, 0.0
    for i in range(x.size):
        cost += 0.5 * x[i] * x[i]
        if loose[i]:
            pull = 0.0
            for j in range(y.size):
                pull += p.C[j, i] * p.length[i] * y[j]
            best = min(max(-pull, low[i]), high[i])
            lost += (x[i] - best) * (0.5 * (x[i] + best) + pull)
    return max(np.abs(r).max(), lost / cost)
