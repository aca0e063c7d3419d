"""Symmetric equations within kernels, too few for a call of LAPACK to be worth it."""

from __future__ import annotations

from .kernel import kernel

# Pivots of less than this part of their row's are rounding.
SINGULAR = 1e-13


@kernel
def factorized(G):
    """Overwrite the lower half of the symmetric G (n, n) by its factors L D L^T, D in place of the
    ones of L; False: it is singular. Not for what needs to be pivoted, as positive definite
    matrices do not."""
    for j in range(G.shape[0]):
        whole = G[j, j]
        for k in range(j):
            for i in range(k):
                G[j, k] -= G[j, i] * G[k, i]
        for k in range(j):
            scaled = G[j, k]
            G[j, k] /= G[k, k]
            G[j, j] -= scaled * G[j, k]
        if not abs(G[j, j]) > SINGULAR * abs(whole):
            return False
    return True


@kernel
def divided(L, b):
    """Overwrite b (n,) by G^-1 b, with the factors of G."""
    n = b.size
    for j in range(n):
        for k in range(j):
            b[j] -= L[j, k] * b[k]
    for j in range(n - 1, -1, -1):
        b[j] /= L[j, j]
        for k in range(j + 1, n):
            b[j] -= L[k, j] * b[k]
