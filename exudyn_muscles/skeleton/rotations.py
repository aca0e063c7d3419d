"""Rotation vectors, and coordinates that are moved along Exudyn's speeds."""

from __future__ import annotations

import math

import numpy as np

from ..numerics.kernel import kernel

SMALL_ANGLE = 1e-4  # below which the series of sin(a) / a to a^4 are exact to 1e-16


@kernel
def exponential(u, R):
    """Write the rotation R by the rotation vector `u`."""
    square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    angle = math.sqrt(square)
    if angle < SMALL_ANGLE:
        s, c = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        s, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    for i in range(3):
        for j in range(3):
            R[i, j] = c * u[i] * u[j]
        R[i, i] += 1.0 - c * square
    R[0, 1] -= s * u[2]
    R[1, 0] += s * u[2]
    R[0, 2] += s * u[1]
    R[2, 0] -= s * u[1]
    R[1, 2] -= s * u[0]
    R[2, 1] += s * u[0]


@kernel(allocates=True)
def advance(vectors, reference, x, dx):
    """Move coordinates `x` (N,) by `dx` along Exudyn's speeds, in place.

    `vectors` (k,) are the first coordinates of rotation vectors, which are composed instead of
    added; the others are sums.
    """
    before = np.empty((vectors.size, 3))
    for k in range(vectors.size):
        before[k] = x[vectors[k] : vectors[k] + 3] + reference[vectors[k] : vectors[k] + 3]
    x += dx
    first, second, both = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for k in range(vectors.size):
        at = slice(vectors[k], vectors[k] + 3)
        exponential(before[k], first)
        exponential(dx[at], second)
        for i in range(3):
            for j in range(3):
                both[i, j] = (
                    first[i, 0] * second[0, j]
                    + first[i, 1] * second[1, j]
                    + first[i, 2] * second[2, j]
                )
        logarithm(both, x[at])
        x[at] -= reference[at]


@kernel(allocates=True)
def logarithm(R, u):
    """Write the rotation vector of R; by its quaternion, which is exact for every angle."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    best, most = 3, trace
    for i in range(3):
        if R[i, i] > most:
            best, most = i, R[i, i]
    q = np.empty(4)
    if best == 3:
        q[0], q[1], q[2], q[3] = (
            1.0 + trace,
            R[2, 1] - R[1, 2],
            R[0, 2] - R[2, 0],
            R[1, 0] - R[0, 1],
        )
    else:
        i, j, k = best, (best + 1) % 3, (best + 2) % 3
        q[0] = R[k, j] - R[j, k]
        q[1 + i] = 1.0 + 2.0 * R[i, i] - trace
        q[1 + j] = R[j, i] + R[i, j]
        q[1 + k] = R[k, i] + R[i, k]
    q /= math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if q[0] < 0.0:
        q *= -1.0
    sin = math.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    factor = 2.0 if sin < SMALL_ANGLE else 2.0 * math.atan2(sin, q[0]) / sin
    for i in range(3):
        u[i] = factor * q[1 + i]
