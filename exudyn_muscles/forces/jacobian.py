"""J^T: forces and torques at points of a tree's links, as generalized forces.

A revolute joint with axis z through o moves a point x of the links behind it by z x (x - o) dq, a
prismatic one by z dq. Of the unit pulls of muscles these are the moment arms r = -dl/dq.
"""

from __future__ import annotations

from ..numerics.kernel import kernel
from ..path.pulls import FORCE, ON_COORDINATE, POINT

ON_LINK_AS_TORQUE = 2  # a row of `Pulls` with a torque in place of the force at a point

# Joint codes from here on are prismatic joints; smaller ones are revolute.
PRISMATIC = 3


@kernel(inline=True)
def generalized(joints, parents, p, axes, pulls, Q):
    """Write the generalized forces Q (m, n) of `Pulls` on all coordinates of a tree.

    `joints`, `parents` (n,) are the tree's; p, `axes` (n, 3) positions and global joint axes of its
    links.
    """
    for i in range(Q.shape[0]):
        Q[i] = 0.0
        for k in range(pulls.firsts[i], pulls.lasts[i]):
            add_generalized(
                joints, parents, p, axes, pulls.kinds[k], pulls.numbers[k], pulls.values[k], Q[i]
            )


@kernel(inline=True)
def generalized_by_frames(starts, indices, p, J, T, pulls, Q):
    """Write the generalized forces Q (m, N) of `Pulls` on all coordinates of a system.

    Frame k, with the origin p, moves by its coordinates `indices[starts[k]:starts[k + 1]]` with the
    same rows of J, as of `Frames`; `T` (n, N) are the rates of what the pulls call coordinates.
    """
    for i in range(Q.shape[0]):
        Q[i] = 0.0
        for k in range(pulls.firsts[i], pulls.lasts[i]):
            values, number = pulls.values[k], pulls.numbers[k]
            f_x, f_y, f_z = values[FORCE], values[FORCE + 1], values[FORCE + 2]
            if pulls.kinds[k] == ON_COORDINATE:
                for c in range(T.shape[1]):
                    Q[i, c] += f_x * T[number, c]
                continue
            if number < 0:
                continue
            if pulls.kinds[k] == ON_LINK_AS_TORQUE:
                t_x, t_y, t_z = f_x, f_y, f_z
                f_x, f_y, f_z = 0.0, 0.0, 0.0
            else:  # about the frame's origin
                d_x = values[POINT] - p[number, 0]
                d_y = values[POINT + 1] - p[number, 1]
                d_z = values[POINT + 2] - p[number, 2]
                t_x, t_y, t_z = d_y * f_z - d_z * f_y, d_z * f_x - d_x * f_z, d_x * f_y - d_y * f_x
            for c in range(starts[number], starts[number + 1]):
                Q[i, indices[c]] += (
                    f_x * J[c, 0] + f_y * J[c, 1] + f_z * J[c, 2]
                    + t_x * J[c, 3] + t_y * J[c, 4] + t_z * J[c, 5]
                )  # fmt: skip


@kernel
def add_generalized(joints, parents, p, axes, kind, number, values, Q):
    """Add what one row of `Pulls` is on all coordinates to Q (n,)."""
    f_x, f_y, f_z = values[FORCE], values[FORCE + 1], values[FORCE + 2]
    j = number
    if kind == ON_COORDINATE:
        Q[j] += f_x
        return
    is_torque = kind == ON_LINK_AS_TORQUE
    while j >= 0:
        z_x, z_y, z_z = axes[j, 0], axes[j, 1], axes[j, 2]
        is_revolute = joints[j] < PRISMATIC
        if is_torque == is_revolute:
            Q[j] += f_x * z_x + f_y * z_y + f_z * z_z
        elif is_revolute:
            d_x = values[POINT] - p[j, 0]
            d_y = values[POINT + 1] - p[j, 1]
            d_z = values[POINT + 2] - p[j, 2]
            Q[j] += (
                f_x * (z_y * d_z - z_z * d_y)
                + f_y * (z_z * d_x - z_x * d_z)
                + f_z * (z_x * d_y - z_y * d_x)
            )
        j = parents[j]
