"""Cholesky factorization within kernels, of matrices for which a call of LAPACK takes longer."""

from __future__ import annotations

import math

from .kernel import kernel

# Pivots of less than this part of their row's are rounding.
SINGULAR = 1e-13


@kernel
def factorized(G):
    """Overwrite the lower half of G (n, n) by its Cholesky factor; False: it is singular."""
    for j in range(G.shape[0]):
        whole = G[j, j]
        for k in range(j):
            for i in range(k):
                G[j, k] -= G[j, i] * G[k, i]
            G[j, k] /= G[k, k]
            G[j, j] -= G[j, k] * G[j, k]
        if not G[j, j] > SINGULAR * whole:
            return False
        G[j, j] = math.sqrt(G[j, j])
    return True


@kernel
def divided(L, b):
    """Overwrite b (n,) by (L L^T)^-1 b."""
    n = b.size
    for j in range(n):
        for k in range(j):
            b[j] -= L[j, k] * b[k]
        b[j] /= L[j, j]
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            b[j] -= L[k, j] * b[k]
        b[j] /= L[j, j]
