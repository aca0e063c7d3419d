"""Tracked quantities z of a system's state and their rates, z' = T x'."""

from __future__ import annotations

import math

import numpy as np

from ...numerics.kernel import kernel
from ...path.frames import turned
from ...path.rope import cross
from ..rotations import advance
from .frames import ROTATION, VELOCITY, rigid_frames

TURN = 2.0 * math.pi

# Kinds of tracked quantities.
ANGLE, SLOPE, DISPLACEMENT, COORDINATE, FUNCTION = range(5)
# Columns of a row: kind; the frames it lies between, or a coordinate; of angles the two entries of
# the relative rotation A = A_0^T A_1 and their signs; of displacements the axis; points and axes in
# the frames.
KIND, FRAME_0, FRAME_1, ENTRIES, AXIS, POINT_0, POINT_1, AXES_0, AXES_1, COLUMNS = (
    0, 1, 2, slice(3, 9), 9, slice(10, 13), slice(13, 16), slice(16, 25), slice(25, 34), 34
)  # fmt: skip


@kernel
def _axes(R, frame, local, A):
    """Write a joint's axes A (3, 3) in ground."""
    for i in range(3):
        for j in range(3):
            if frame < 0:
                A[i, j] = local[3 * i + j]
            else:
                A[i, j] = (
                    R[frame, i, 0] * local[j] + R[frame, i, 1] * local[3 + j]
                    + R[frame, i, 2] * local[6 + j]
                )  # fmt: skip


@kernel
def _add(starts, indices, J, frame, sign, force, torque, row):
    """Add sign (force . p' + torque . omega) of a frame to a row (N,) of T."""
    if frame < 0:
        return
    for k in range(starts[frame], starts[frame + 1]):
        for i in range(3):
            row[indices[k]] += sign * (
                force[i] * J[k, VELOCITY + i] + torque[i] * J[k, ROTATION + i]
            )


@kernel(allocates=True)
def measure(table, starts, indices, R, p, J, x, z, T):
    """Write z (n,) and T (n, N) of all rows but FUNCTION ones, where frames are R, p, J."""
    A_0, A_1, A = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    x_0, x_1 = np.empty(3), np.empty(3)
    zero, gradient, arm = np.zeros(3), np.empty(3), np.empty(3)
    for k in range(table.shape[0]):
        row, kind = table[k], int(table[k, KIND])
        if kind == FUNCTION:
            continue
        T[k] = 0.0
        f_0, f_1 = int(row[FRAME_0]), int(row[FRAME_1])
        if kind == COORDINATE:
            z[k] = x[f_0]
            T[k, f_0] = 1.0
            continue
        _axes(R, f_0, row[AXES_0], A_0)
        if kind == DISPLACEMENT:
            turned(R, f_0, row[POINT_0], x_0)
            turned(R, f_1, row[POINT_1], x_1)
            if f_0 >= 0:
                x_0 += p[f_0]
            if f_1 >= 0:
                x_1 += p[f_1]
            axis = int(row[AXIS])
            z[k] = 0.0
            for i in range(3):
                gradient[i] = A_0[i, axis]
                z[k] += gradient[i] * (x_1[i] - x_0[i])
            # d/dt of e . (x_1 - x_0), with e fixed in frame 0
            if f_1 >= 0:
                cross(x_1 - p[f_1], gradient, arm)
                _add(starts, indices, J, f_1, 1.0, gradient, arm, T[k])
            if f_0 >= 0:
                cross(x_1 - p[f_0], gradient, arm)
                _add(starts, indices, J, f_0, -1.0, gradient, arm, T[k])
            continue
        _axes(R, f_1, row[AXES_1], A_1)
        for i in range(3):
            for j in range(3):
                A[i, j] = A_0[0, i] * A_1[0, j] + A_0[1, i] * A_1[1, j] + A_0[2, i] * A_1[2, j]
        if kind == SLOPE:
            s, c = A[0, 2], math.sqrt(A[0, 0] * A[0, 0] + A[0, 1] * A[0, 1])
            # dA = omega x A, so that d A_02 = omega_1 A_22 - omega_2 A_12
            gradient[0], gradient[1], gradient[2] = 0.0, A[2, 2] / c, -A[1, 2] / c
        else:
            entries = row[ENTRIES]
            i, j, u, w = int(entries[0]), int(entries[1]), int(entries[3]), int(entries[4])
            sign_s, sign_c = entries[2], entries[5]
            s, c = sign_s * A[i, j], sign_c * A[u, w]
            for axis in range(3):
                gradient[axis] = 0.0
            # d A_ij = (omega x A_j)_i
            gradient[(i + 1) % 3] += sign_s * A[(i + 2) % 3, j] * c
            gradient[(i + 2) % 3] -= sign_s * A[(i + 1) % 3, j] * c
            gradient[(u + 1) % 3] -= sign_c * A[(u + 2) % 3, w] * s
            gradient[(u + 2) % 3] += sign_c * A[(u + 1) % 3, w] * s
            for axis in range(3):
                gradient[axis] /= s * s + c * c
        z[k] = math.atan2(s, c)
        for i in range(3):
            arm[i] = A_0[i, 0] * gradient[0] + A_0[i, 1] * gradient[1] + A_0[i, 2] * gradient[2]
        _add(starts, indices, J, f_1, 1.0, zero, arm, T[k])
        _add(starts, indices, J, f_0, -1.0, zero, arm, T[k])


@kernel(allocates=True)
def measure_pose(table, kinds, starts, indices, reference, x, near, R, p, J, z, T):
    """Write all frames but those of markers, and `measure` there at coordinates `x` (N,).

    Angles are as many turns on that they are next to `near` (n,).
    """
    rigid_frames(kinds, starts, indices, reference, x, R, p, J)
    measure(table, starts, indices, R, p, J, x, z, T)
    for k in range(z.size):
        if table[k, KIND] == ANGLE or table[k, KIND] == SLOPE:
            z[k] += TURN * round((near[k] - z[k]) / TURN)


@kernel(allocates=True)
def rate_along(table, kinds, starts, indices, reference, vectors, x, x_t, e, R, p, J, rate):
    """Write T' x' (n,) at `x`, `x_t` (N,), by central differences over times of e [s].

    Of what depends on rigid frames alone; R, p, J are those at `x`.
    """
    n = rate.size
    there, turned, moved, rows = x.copy(), R.copy(), p.copy(), J.copy()
    z, T = np.empty(n), np.empty((n, x.size))
    rate[:] = 0.0
    for side in (e, -e):
        there[:] = x
        advance(vectors, reference, there, side * x_t)
        rigid_frames(kinds, starts, indices, reference, there, turned, moved, rows)
        measure(table, starts, indices, turned, moved, rows, there, z, T)
        for k in range(n):
            for j in range(x.size):
                rate[k] += T[k, j] * x_t[j] / (2.0 * side)
