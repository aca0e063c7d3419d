"""QR factorization M P = Q R by Householder's reflections, with exchange of rows and columns.

Columns are taken by their length, rows by the size of their entry: every row keeps the accuracy of
its own size, be the rows ever so different (A. J. Cox, N. J. Higham, "Stability of Householder QR
factorization for weighted least squares problems", Numerical Analysis 1997, Pitman Research Notes
in Mathematics 380).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..numerics.kernel import kernel


class Factors(NamedTuple):
    """Room for the factors of up to k rows and n columns.

    Attributes
    ----------
    M : (k, n) ndarray
        What is factorized; then R, and below its diagonal the reflections.
    order : (n,) ndarray of int
        The columns as they were taken.
    swap : (n,) ndarray of int
        Rows exchanged with the first, second, ... one.
    beta : (n,) ndarray
        Factors of the reflections.
    """

    M: np.ndarray
    order: np.ndarray
    swap: np.ndarray
    beta: np.ndarray


@kernel(allocates=True)
def factors(k, n):
    return Factors(
        np.empty((k, n)), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64), np.empty(n)
    )


@kernel
def factorize(f, k, n, least):
    """Factorize the first k rows and n columns of M; returns the rank.

    The rank is the number of columns taken before all that is left is no longer than `least`.
    """
    M = f.M
    for j in range(n):
        f.order[j] = j
    for s in range(min(k, n)):
        longest, at = 0.0, s
        for j in range(s, n):
            square = 0.0
            for i in range(s, k):
                square += M[i, j] * M[i, j]
            if square > longest:
                longest, at = square, j
        if longest <= least * least:
            return s
        f.order[s], f.order[at] = f.order[at], f.order[s]
        for i in range(k):
            M[i, s], M[i, at] = M[i, at], M[i, s]
        top = s
        for i in range(s + 1, k):
            if abs(M[i, s]) > abs(M[top, s]):
                top = i
        f.swap[s] = top
        for j in range(n):
            M[s, j], M[top, j] = M[top, j], M[s, j]
        diagonal = -math.copysign(math.sqrt(longest), M[s, s])
        head = M[s, s] - diagonal
        f.beta[s] = -head / diagonal
        M[s, s] = diagonal
        for i in range(s + 1, k):
            M[i, s] /= head
        for j in range(s + 1, n):
            dot = M[s, j]
            for i in range(s + 1, k):
                dot += M[i, s] * M[i, j]
            dot *= f.beta[s]
            M[s, j] -= dot
            for i in range(s + 1, k):
                M[i, j] -= dot * M[i, s]
    return min(k, n)


@kernel
def reflect(f, k, s, x):
    """Apply the reflection `s` to x (k,)."""
    dot = x[s]
    for i in range(s + 1, k):
        dot += f.M[i, s] * x[i]
    dot *= f.beta[s]
    x[s] -= dot
    for i in range(s + 1, k):
        x[i] -= dot * f.M[i, s]


@kernel
def times_q(f, k, rank, x):
    """Write Q x over x (k,)."""
    for s in range(rank - 1, -1, -1):
        reflect(f, k, s, x)
    for s in range(rank - 1, -1, -1):
        x[s], x[f.swap[s]] = x[f.swap[s]], x[s]


@kernel
def times_q_transposed(f, k, rank, x):
    """Write Q^T x over x (k,)."""
    for s in range(rank):
        x[s], x[f.swap[s]] = x[f.swap[s]], x[s]
    for s in range(rank):
        reflect(f, k, s, x)


@kernel
def least_squares(f, k, n, x, z):
    """Write the z (n,) with which M z comes nearest to x (k,); M and x are used up."""
    rank = factorize(f, k, n, 0.0)
    times_q_transposed(f, k, rank, x)
    z[:n] = 0.0
    for s in range(rank - 1, -1, -1):
        for c in range(s + 1, rank):
            x[s] -= f.M[s, c] * z[f.order[c]]
        z[f.order[s]] = x[s] / f.M[s, s]


@kernel
def shortest(f, k, n, least, x, z):
    """Write the shortest z (k,) with M^T z = x (n,), as far as M's columns are independent."""
    rank = factorize(f, k, n, least)
    z[:k] = 0.0
    for s in range(rank):
        z[s] = x[f.order[s]]
        for c in range(s):
            z[s] -= f.M[c, s] * z[c]
        z[s] /= f.M[s, s]
    times_q(f, k, rank, z)
