"""l, l' and r = -dl/dq of straight paths with via points, in one compiled pass.

For a segment from A to B with unit direction e, dl = e . (dB - dA). A revolute joint with axis z
through o moves a point x of the links behind it by z x (x - o) dq, a prismatic one by z dq.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..kernel import kernel
from .points import Paths
from .tree import PRISMATIC, Tree, link_frames


class Geometry(NamedTuple):
    """Musculotendon geometry of m muscles on n coordinates.

    `length` l (m,) [m], `lengthening_speed` l' (m,) [m/s], `moment_arms` r (m, n) [m or 1],
    r = -dl/dq, so that the torques are r^T F.
    """

    length: np.ndarray
    lengthening_speed: np.ndarray
    moment_arms: np.ndarray


@kernel
def point_positions(positions, links, base, R, p, x):
    """Global positions (k, 3) of all path points, written in place."""
    for k in range(links.size):
        link = links[k]
        for row in range(3):
            if link < 0:
                x[k, row] = positions[k, row]
            else:
                x[k, row] = (
                    p[link, row]
                    + R[link, row, 0] * positions[k, 0]
                    + R[link, row, 1] * positions[k, 1]
                    + R[link, row, 2] * positions[k, 2]
                )


@kernel
def add_motion(joints, parents, p, axes, link, x, k, e, sign, r_i):
    """Add sign * e . dx/dq of point `k` on `link` to the row `r_i`."""
    j = link
    while j >= 0:
        z_x, z_y, z_z = axes[j, 0], axes[j, 1], axes[j, 2]
        if joints[j] >= PRISMATIC:
            r_i[j] += sign * (e[0] * z_x + e[1] * z_y + e[2] * z_z)
        else:
            d_x, d_y, d_z = x[k, 0] - p[j, 0], x[k, 1] - p[j, 1], x[k, 2] - p[j, 2]
            r_i[j] += sign * (
                e[0] * (z_y * d_z - z_z * d_y)
                + e[1] * (z_z * d_x - z_x * d_z)
                + e[2] * (z_x * d_y - z_y * d_x)
            )
        j = parents[j]


@kernel(allocates=True)
def path_geometry(
    joints, parents, rotations, offsets, base, reference, positions, links, starts, q, v, l, l_t, r
):  # fmt: skip
    """Write l (m,), l' (m,) and r (m, n) at the coordinates `q` and speeds `v`."""
    n, m = joints.size, starts.size - 1
    R, p, axes = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    link_frames(joints, parents, rotations, offsets, base, reference, q, R, p, axes)
    x = np.empty((links.size, 3))
    point_positions(positions, links, base, R, p, x)
    e = np.empty(3)
    for i in range(m):
        l[i] = 0.0
        r[i] = 0.0
        for k in range(starts[i], starts[i + 1] - 1):
            for row in range(3):
                e[row] = x[k + 1, row] - x[k, row]
            d = math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
            l[i] += d
            if links[k] == links[k + 1] or d == 0.0:
                continue
            for row in range(3):
                e[row] /= d
            # r = -dl/dq: minus the motion of the segment's end, plus that of its start.
            add_motion(joints, parents, p, axes, links[k + 1], x, k + 1, e, -1.0, r[i])
            add_motion(joints, parents, p, axes, links[k], x, k, e, 1.0, r[i])
        l_t[i] = 0.0
        for j in range(n):
            l_t[i] -= r[i, j] * v[j]


def compile_geometry(tree: Tree, paths: Paths) -> Callable[[np.ndarray, np.ndarray], Geometry]:
    """The function (q, q') -> Geometry of these paths on this tree, without argument checks."""
    tables = path_tables(tree, paths)
    m, n = paths.starts.size - 1, len(tree)

    def geometry(q: np.ndarray, v: np.ndarray) -> Geometry:
        l, l_t, r = np.empty(m), np.empty(m), np.empty((m, n))
        path_geometry(*tables, q, v, l, l_t, r)
        return Geometry(l, l_t, r)

    return geometry


def path_tables(tree: Tree, paths: Paths) -> tuple[np.ndarray, ...]:
    """The arrays that `path_geometry` takes before the state."""
    return (
        tree.joints, tree.parents, tree.rotations, tree.offsets, tree.base, tree.reference,
        paths.positions, paths.links, paths.starts,
    )  # fmt: skip


def path_points(tree: Tree, paths: Paths, q: ArrayLike) -> list[np.ndarray]:
    """Global positions [m] of every muscle's points, (points, 3) each, at coordinates `q` (n,)."""
    n = len(tree)
    R, p, axes = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    x = np.empty((paths.links.size, 3))
    link_frames(
        tree.joints, tree.parents, tree.rotations, tree.offsets, tree.base, tree.reference,
        np.asarray(q, dtype=float), R, p, axes,
    )  # fmt: skip
    point_positions(paths.positions, paths.links, tree.base, R, p, x)
    return np.split(x, paths.starts[1:-1])
