"""Forward kinematics of a tree of links with one joint each, as Exudyn stores it.

With theta = q + q_ref, link i on its parent p:

    R_i = R_p T_i Rot(axis, theta)    p_i = p_p + R_p o_i                       (revolute)
    R_i = R_p T_i                     p_i = p_p + R_p o_i + R_i e_axis theta    (prismatic)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..forces.jacobian import PRISMATIC
from ..numerics.kernel import kernel


@dataclass(frozen=True, eq=False)
class Tree:
    """n links as arrays.

    Attributes
    ----------
    joints : (n,) int ndarray
        0, 1, 2: revolute about the local x, y, z axis; 3, 4, 5: prismatic.
    parents : (n,) int ndarray
        Parent link, always smaller than the link itself; -1 is ground.
    rotations : (n, 3, 3) ndarray
        T, orientation of the joint frame in the parent link's frame.
    offsets : (n, 3) ndarray
        o, joint position in the parent link's frame [m].
    base : (3,) ndarray
        Position of the tree in the global frame [m].
    reference : (n,) ndarray
        Reference coordinates q_ref [rad or m].
    """

    joints: np.ndarray
    parents: np.ndarray
    rotations: np.ndarray
    offsets: np.ndarray
    base: np.ndarray
    reference: np.ndarray

    def __len__(self) -> int:
        return self.joints.size

    def tables(self) -> tuple[np.ndarray, ...]:
        """The arrays that `link_frames` takes before the coordinates."""
        offsets = np.where(self.parents[:, None] < 0, self.base + self.offsets, self.offsets)
        return self.joints, self.parents, self.rotations, offsets, self.reference


def tree_frames(tree: Tree, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Orientations (n, 3, 3), positions (n, 3) and global joint axes (n, 3) of all links."""
    n = len(tree)
    R, p, axes = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    link_frames(*tree.tables(), q, R, p, axes)
    return R, p, axes


@kernel
def link_frames(joints, parents, rotations, offsets, reference, q, R, p, axes):
    """Write orientations R (n, 3, 3), positions p (n, 3) and global joint axes (n, 3).

    Offsets of links on ground are global positions.
    """
    for i in range(joints.size):
        k = parents[i]
        theta = q[i] + reference[i]
        for row in range(3):
            if k < 0:
                p[i, row] = offsets[i, row]
                for column in range(3):
                    R[i, row, column] = rotations[i, row, column]
            else:
                p[i, row] = p[k, row]
                for column in range(3):
                    p[i, row] += R[k, row, column] * offsets[i, column]
                    R[i, row, column] = (
                        R[k, row, 0] * rotations[i, 0, column]
                        + R[k, row, 1] * rotations[i, 1, column]
                        + R[k, row, 2] * rotations[i, 2, column]
                    )
        axis = joints[i] % PRISMATIC
        for row in range(3):
            axes[i, row] = R[i, row, axis]
        if joints[i] >= PRISMATIC:
            for row in range(3):
                p[i, row] += axes[i, row] * theta
        else:
            # Rotation about a coordinate axis mixes the two columns that follow it.
            y, z = (axis + 1) % 3, (axis + 2) % 3
            cos, sin = math.cos(theta), math.sin(theta)
            for row in range(3):
                e_y, e_z = R[i, row, y], R[i, row, z]
                R[i, row, y] = cos * e_y + sin * e_z
                R[i, row, z] = cos * e_z - sin * e_y
