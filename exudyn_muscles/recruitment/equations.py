"""Linear equations between bounds, as the two levels of `nearest.py` and `cheapest.py` see them.

The unknowns are u_i = |a_i| x_i with the columns a_i of A in some units of the rows: what each one
does for the torque, be the normalising forces as different as may be.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..numerics.kernel import kernel

# Rounding in a row is at least that of this part of what the unknowns can do in it.
LEAST = 1e-3


class Bounded(NamedTuple):
    """C u = d between low and high.

    Attributes
    ----------
    C, d : (n, m) and (n,) ndarray
        The rows in some units, the columns of length one or zero.
    low, high : (m,) ndarray
    length : (m,) ndarray
        The columns' lengths before: u / length are the unknowns.
    least : (n,) ndarray
        What rounding in a row is at least the rounding of.
    """

    C: np.ndarray
    d: np.ndarray
    low: np.ndarray
    high: np.ndarray
    length: np.ndarray
    least: np.ndarray


@kernel(allocates=True)
def contents(A, b, low, high):
    """The sizes of b and of what the unknowns with limits can do in its rows (n,)."""
    rows = np.abs(b)
    for j in range(b.size):
        for i in range(low.size):
            most = max(abs(low[i]), abs(high[i]))
            if most < math.inf:
                rows[j] += abs(A[j, i]) * most
        rows[j] = rows[j] or 1.0
    return rows


@kernel(allocates=True)
def in_units(A, b, low, high, rows, factor):
    """The problem with its rows times `factor`; `rows` are their contents before."""
    C, length = np.empty(A.shape), np.empty(low.size)
    for i in range(low.size):
        square = 0.0
        for j in range(b.size):
            C[j, i] = A[j, i] * factor[j]
            square += C[j, i] * C[j, i]
        length[i] = math.sqrt(square) or 1.0
        for j in range(b.size):
            C[j, i] /= length[i]
    return Bounded(C, b * factor, low * length, high * length, length, LEAST * rows * factor)


@kernel
def in_place(p, u, low, high, x):
    """Write x = u / length, to the last bit where u is at a bound."""
    for i in range(u.size):
        x[i] = min(max(u[i] / p.length[i], low[i]), high[i])
        if u[i] == p.low[i]:
            x[i] = low[i]
        elif u[i] == p.high[i]:
            x[i] = high[i]


@kernel
def gaps(p, u, r, size):
    """Write r = d - C u, and the sums of its terms' sizes."""
    for j in range(r.size):
        r[j], size[j] = p.d[j], p.least[j] + abs(p.d[j])
        for i in range(u.size):
            part = p.C[j, i] * u[i]
            r[j] -= part
            size[j] += abs(part)


@kernel
def first_bound(p, free, k, u, step, room):
    """How far all of the k free unknowns can go along their steps, 1 at most, and the number of the
    one that is then at its bound; -1 if none is. Of several the one whose step ends farthest."""
    part, block, farthest = 1.0, -1, 0.0
    for c in range(k):
        i = free[c]
        beyond = max(p.low[i] - u[i] - step[c], u[i] + step[c] - p.high[i])
        if beyond > room:
            there = ((p.low[i] if step[c] < 0.0 else p.high[i]) - u[i]) / step[c]
            if block < 0 or there < part or (there == part and beyond > farthest):
                part, block, farthest = there, c, beyond
    return part, block


@kernel
def move(p, free, k, u, step, part):
    """Take the part of the steps; returns the longest one."""
    longest = 0.0
    for c in range(k):
        i = free[c]
        u[i] = min(max(u[i] + part * step[c], p.low[i]), p.high[i])
        longest = max(longest, abs(part * step[c]))
    return longest
