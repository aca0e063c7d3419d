"""Frames of rigid bodies and markers in a system, and how its speeds x' move them.

A frame has an orientation R and an origin p in ground, and the columns J of its velocity:

    p' = J_p x',    omega = J_r x'    (omega in ground)

Rigid bodies are computed here, by the coordinates of their nodes; frames of any other kind are
what Exudyn says of a marker.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...numerics.kernel import kernel
from ..rotations import exponential

# Kinds of frames.
FIXED, EULER_PARAMETERS, TAIT_BRYAN, ROTATION_VECTOR, PLANE, POINT, PLANE_POINT, MARKER = range(8)
# Coordinates of a node of each kind.
SIZES = {
    FIXED: 0, EULER_PARAMETERS: 7, TAIT_BRYAN: 6, ROTATION_VECTOR: 6, PLANE: 3, POINT: 3,
    PLANE_POINT: 2,
}  # fmt: skip
# Rows of J.
VELOCITY, ROTATION, ROWS = 0, 3, 6


class FrameTables(NamedTuple):
    """Which coordinates each of f frames has: `kinds` (f,); frame k's are
    `indices[starts[k]:starts[k + 1]]`; `reference` (N,) are Exudyn's of the whole system."""

    kinds: np.ndarray
    starts: np.ndarray
    indices: np.ndarray
    reference: np.ndarray


class Frames(NamedTuple):
    """R (f, 3, 3), p (f, 3) and J (k, 6), a row for each of `FrameTables.indices`."""

    R: np.ndarray
    p: np.ndarray
    J: np.ndarray


@kernel(allocates=True)
def rigid_frames(kinds, starts, indices, reference, x, R, p, J):
    """Write the frames of all nodes at the coordinates `x` (N,); other kinds are left alone."""
    for k in range(kinds.size):
        kind, first = kinds[k], starts[k]
        if kind in (FIXED, MARKER):
            continue
        J[first : starts[k + 1]] = 0.0
        in_space = kind in (EULER_PARAMETERS, TAIT_BRYAN, ROTATION_VECTOR, POINT)
        at = 3 if in_space else 2
        p[k, 2] = 0.0
        for i in range(at):
            c = indices[first + i]
            p[k, i] = x[c] + reference[c]
            J[first + i, VELOCITY + i] = 1.0
        if kind == EULER_PARAMETERS:
            _by_euler_parameters(indices, reference, x, first + at, R[k], J)
        elif kind == TAIT_BRYAN:
            _by_tait_bryan(indices, reference, x, first + at, R[k], J)
        elif kind == ROTATION_VECTOR:
            _by_rotation_vector(indices, reference, x, first + at, R[k], J)
        elif kind == PLANE:
            c = indices[first + at]
            cos, sin = math.cos(x[c] + reference[c]), math.sin(x[c] + reference[c])
            R[k] = 0.0
            R[k, 0, 0], R[k, 0, 1], R[k, 1, 0], R[k, 1, 1], R[k, 2, 2] = cos, -sin, sin, cos, 1.0
            J[first + at, ROTATION + 2] = 1.0
        else:
            R[k] = 0.0
            R[k, 0, 0] = R[k, 1, 1] = R[k, 2, 2] = 1.0


@kernel
def _by_euler_parameters(indices, reference, x, first, R, J):
    """omega = G theta' with the global G of the Euler parameters theta."""
    a = x[indices[first]] + reference[indices[first]]
    b = x[indices[first + 1]] + reference[indices[first + 1]]
    c = x[indices[first + 2]] + reference[indices[first + 2]]
    d = x[indices[first + 3]] + reference[indices[first + 3]]
    R[0, 0], R[0, 1], R[0, 2] = (
        a * a + b * b - c * c - d * d,
        2 * (b * c - a * d),
        2 * (b * d + a * c),
    )
    R[1, 0], R[1, 1], R[1, 2] = (
        2 * (b * c + a * d),
        a * a - b * b + c * c - d * d,
        2 * (c * d - a * b),
    )
    R[2, 0], R[2, 1], R[2, 2] = (
        2 * (b * d - a * c),
        2 * (c * d + a * b),
        a * a - b * b - c * c + d * d,
    )
    J[first, 3], J[first, 4], J[first, 5] = -2 * b, -2 * c, -2 * d
    J[first + 1, 3], J[first + 1, 4], J[first + 1, 5] = 2 * a, 2 * d, -2 * c
    J[first + 2, 3], J[first + 2, 4], J[first + 2, 5] = -2 * d, 2 * a, 2 * b
    J[first + 3, 3], J[first + 3, 4], J[first + 3, 5] = 2 * c, -2 * b, 2 * a


@kernel
def _by_tait_bryan(indices, reference, x, first, R, J):
    """R = R_x R_y R_z, omega = e_x alpha' + R_x e_y beta' + R_x R_y e_z gamma'."""
    alpha = x[indices[first]] + reference[indices[first]]
    beta = x[indices[first + 1]] + reference[indices[first + 1]]
    gamma = x[indices[first + 2]] + reference[indices[first + 2]]
    ca, sa = math.cos(alpha), math.sin(alpha)
    cb, sb = math.cos(beta), math.sin(beta)
    cg, sg = math.cos(gamma), math.sin(gamma)
    R[0, 0], R[0, 1], R[0, 2] = cb * cg, -cb * sg, sb
    R[1, 0], R[1, 1], R[1, 2] = ca * sg + sa * sb * cg, ca * cg - sa * sb * sg, -sa * cb
    R[2, 0], R[2, 1], R[2, 2] = sa * sg - ca * sb * cg, sa * cg + ca * sb * sg, ca * cb
    J[first, 3] = 1.0
    J[first + 1, 4], J[first + 1, 5] = ca, sa
    J[first + 2, 3], J[first + 2, 4], J[first + 2, 5] = sb, -sa * cb, ca * cb


@kernel(allocates=True)
def _by_rotation_vector(indices, reference, x, first, R, J):
    """R = exp(theta); Exudyn's speeds are omega in the body's frame, so that omega = R x'."""
    u = np.empty(3)
    for i in range(3):
        u[i] = x[indices[first + i]] + reference[indices[first + i]]
    exponential(u, R)
    for i in range(3):
        for row in range(3):
            J[first + i, ROTATION + row] = R[row, i]
