"""l, l' and r = -dl/dq of all muscles' paths in one compiled pass.

For a segment from A to B with unit direction e, dl = e . (dB - dA). A revolute joint with axis z
through o moves a point x of the links behind it by z x (x - o) dq, a prismatic one by z dq. A
moving point has its own velocity on its link besides.

The same holds where a muscle wraps: the tangent points move with the surface's link. That they
also slide on the surface does not change the length, because a geodesic that the straight parts
touch is stationary. Where a straight part has no length, because a point lies on the surface or two
surfaces touch, e is the geodesic's direction there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import WrappingError
from ..forces.actuators import COORDINATE as ON_COORDINATE
from ..forces.actuators import KIND, ON, columns
from ..numerics.curves import PackedCurves, evaluate
from ..numerics.kernel import kernel
from ..path.frames import point_positions
from ..path.functions import function_geometry
from ..path.geodesic import follow_geodesic, steps_over
from ..path.paths import COORDINATE, CURVES, Paths
from ..path.rope import distance, from_surface, is_arc, lay, surface_frames
from ..path.surfaces import CYLINDER, FIRST, HALF_LENGTH, LAST, LINK, RADII, SHAPE
from ..path.wrapping import FIRST_DIRECTION, SECOND_DIRECTION
from .tree import PRISMATIC, Tree, link_frames, tree_frames

X = CURVES.start

PARTS_OF_AN_ARC = 12  # in pictures

# Numbers in the kernels' work space: a wrap's contact, frame and arc; a trial, an ellipsoid's.
WORK_PER_WRAP, WORK = 12 + 12 + 1, 33 + 160

# A straight part that is shorter takes its direction from the surface that it touches [m]: of its
# ends' difference rounding would leave too little.
SHORT = 1e-7
# Path points so close together are one [m]; between them there is no direction.
COINCIDENT = 1e-13

NO_COLUMNS = np.empty((0, 0))


class Geometry(NamedTuple):
    """Musculotendon geometry of m muscles on n coordinates.

    `length` l (m,) [m], `lengthening_speed` l' (m,) [m/s], `moment_arms` r (m, n) [m or 1],
    r = -dl/dq, so that the torques are r^T F. Ideal actuators with the forces f (k,) add S f;
    `columns` are S (n, k).
    """

    length: np.ndarray
    lengthening_speed: np.ndarray
    moment_arms: np.ndarray
    columns: np.ndarray = NO_COLUMNS


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


@kernel
def move_points(positions, links, rules, curves, R, p, q, first, last, x):
    """Put the moving points among the points `first` to `last` where they are at `q`."""
    for k in range(first, last):
        for column in range(3):
            curve = int(rules[k, X + column])
            if curve < 0:
                continue
            value, _, _ = evaluate(curves, curve, q[int(rules[k, COORDINATE])])
            shift = value - positions[k, column]
            for row in range(3):
                if links[k] < 0:
                    x[k, row] += shift if row == column else 0.0
                else:
                    x[k, row] += R[links[k], row, column] * shift


@kernel
def add_own_motion(links, rules, curves, R, q, k, e, sign, r_i):
    """Add what a moving point's own velocity on its link contributes, as `add_motion` does."""
    for column in range(3):
        curve = int(rules[k, X + column])
        if curve < 0:
            continue
        j, link = int(rules[k, COORDINATE]), links[k]
        _, slope, _ = evaluate(curves, curve, q[j])
        along = e[column]
        if link >= 0:
            along = e[0] * R[link, 0, column] + e[1] * R[link, 1, column]
            along += e[2] * R[link, 2, column]
        r_i[j] += sign * along * slope


@kernel
def contact_direction(contacts, frames, a, b, e):
    """Write the global direction of the muscle where a surface ends or begins the straight part
    from tag `a` to tag `b`."""
    w = (-1 - (a if a < 0 else b)) // 2
    row = 4 * w + (SECOND_DIRECTION if a < 0 else FIRST_DIRECTION)
    for column in range(3):
        e[column] = 0.0
        for axis in range(3):
            e[column] += frames[4 * w + axis, column] * contacts[row, axis]


@kernel
def bent_geometry(
    joints, parents, R, p, axes, x, positions, links, starts, bent, rules, grids, bins, pieces,
    wraps, wrap_starts, factors, factor_starts, tags, e, space, q, l, r,
):  # fmt: skip
    """Add l and r of the muscles `bent`; returns the first without a length, or -1."""
    curves = PackedCurves(grids, bins, pieces)
    # Room for the longest rope, and for the most surfaces.
    points = tags.size
    surfaces = (space.size - 3 * points - WORK) // WORK_PER_WRAP
    rope, end = space[: 3 * points].reshape((points, 3)), 3 * points
    contacts = space[end : end + 12 * surfaces].reshape((4 * surfaces, 3))
    frames = space[end + 12 * surfaces : end + 24 * surfaces].reshape((4 * surfaces, 3))
    arcs = space[end + 24 * surfaces : end + 25 * surfaces]
    end += WORK_PER_WRAP * surfaces
    trial, work = space[end : end + 33].reshape((11, 3)), space[end + 33 :].reshape((20, 8))
    for i in bent:
        if factor_starts[i] < factor_starts[i + 1]:
            l[i] = function_geometry(
                factors, curves, factor_starts[i], factor_starts[i + 1], q, r[i]
            )
        move_points(positions, links, rules, curves, R, p, q, starts[i], starts[i + 1], x)
        count = lay(
            rules, starts, wraps, wrap_starts, i, R, p, x, q, rope, tags, contacts, frames, trial,
            arcs, work,
        )  # fmt: skip
        for k in range(count - 1):
            a, b = tags[k], tags[k + 1]
            if is_arc(a, b):
                l[i] += arcs[(-1 - a) // 2]
                continue
            d = distance(rope[k], rope[k + 1])
            l[i] += d
            if d < SHORT and min(a, b) < 0:
                contact_direction(contacts, frames, a, b, e)
            elif d < COINCIDENT:
                continue
            else:
                for row in range(3):
                    e[row] = (rope[k + 1, row] - rope[k, row]) / d
            for end, tag, sign in ((k + 1, b, -1.0), (k, a, 1.0)):
                if tag >= 0:
                    link = links[tag]
                    add_own_motion(links, rules, curves, R, q, tag, e, sign, r[i])
                else:
                    link = int(wraps[wrap_starts[i] + (-1 - tag) // 2, LINK])
                add_motion(joints, parents, p, axes, link, rope, end, e, sign, r[i])
        if math.isnan(l[i]):
            return i
    return -1


@kernel
def path_geometry(
    joints, parents, rotations, offsets, base, reference, positions, links, starts, bent, rules,
    grids, bins, pieces, wraps, wrap_starts, factors, factor_starts, tags, space, q, v, l, l_t, r,
):  # fmt: skip
    """Write l (m,), l' (m,) and r (m, n) at the coordinates `q` and speeds `v`.

    Returns the first muscle for which no geodesic was found, or -1. `tags` and `space` are for the
    work.
    """
    n, m, points = joints.size, starts.size - 1, links.size
    R, p = space[: 9 * n].reshape((n, 3, 3)), space[9 * n : 12 * n].reshape((n, 3))
    axes, end = space[12 * n : 15 * n].reshape((n, 3)), 15 * n
    x, end = space[end : end + 3 * points].reshape((points, 3)), end + 3 * points
    e = space[end : end + 3]
    link_frames(joints, parents, rotations, offsets, base, reference, q, R, p, axes)
    point_positions(positions, links, R, p, x)
    b = 0
    for i in range(m):
        l[i] = 0.0
        r[i] = 0.0
        if b < bent.size and bent[b] == i:
            b += 1
            continue
        for k in range(starts[i], starts[i + 1] - 1):
            for row in range(3):
                e[row] = x[k + 1, row] - x[k, row]
            d = math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
            l[i] += d
            if links[k] == links[k + 1] or d < COINCIDENT:
                continue
            for row in range(3):
                e[row] /= d
            # r = -dl/dq: minus the motion of the segment's end, plus that of its start.
            add_motion(joints, parents, p, axes, links[k + 1], x, k + 1, e, -1.0, r[i])
            add_motion(joints, parents, p, axes, links[k], x, k, e, 1.0, r[i])
    failed = -1
    if bent.size > 0:
        failed = bent_geometry(
            joints, parents, R, p, axes, x, positions, links, starts, bent, rules, grids, bins,
            pieces, wraps, wrap_starts, factors, factor_starts, tags, e, space[end + 3 :], q, l, r,
        )  # fmt: skip
    for i in range(m):
        l_t[i] = 0.0
        for j in range(n):
            l_t[i] -= r[i, j] * v[j]
    return failed


def compile_geometry(tree: Tree, paths: Paths) -> Callable[[np.ndarray, np.ndarray], Geometry]:
    """The function (q, q') -> Geometry of these paths on this tree, without argument checks."""
    tables = path_tables(tree, paths)
    m, n = paths.starts.size - 1, len(tree)

    def geometry(q: np.ndarray, v: np.ndarray) -> Geometry:
        l, l_t, r = np.empty(m), np.empty(m), np.empty((m, n))
        failed = path_geometry(*tables, q, v, l, l_t, r)
        if failed >= 0:
            raise WrappingError(
                f"muscle '{paths.names[failed]}': found no way over an ellipsoid at q = "
                f"{np.array2string(q, precision=4)}; its line passes too near the center"
            )
        return Geometry(l, l_t, r)

    return geometry


def compile_columns(tree: Tree, table: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """The function q (N,) -> S (N, r) of the actuators in an `actuator_table`."""
    N, r = len(tree), len(table)
    if (table[:, KIND] == ON_COORDINATE).all():
        constant = np.zeros((N, r))
        constant[table[:, ON].astype(int), np.arange(r)] = 1.0
        constant.setflags(write=False)
        return lambda q: constant

    def of_tree(q: np.ndarray) -> np.ndarray:
        S = np.empty((N, r))
        columns(tree.joints, tree.parents, *tree_frames(tree, q), table, S)
        return S

    return of_tree


def path_tables(tree: Tree, paths: Paths) -> tuple[np.ndarray, ...]:
    """The arrays that `path_geometry` takes before the state; the last two are its work space."""
    bent = paths.bent
    surfaces = np.diff(paths.wrap_starts)[bent].max(initial=0)
    points = np.diff(paths.starts)[bent].max(initial=0) + 2 * surfaces
    size = 15 * len(tree) + 3 * len(paths.links) + 3
    return (
        tree.joints, tree.parents, tree.rotations, tree.offsets, tree.base, tree.reference,
        paths.positions, paths.links, paths.starts, bent, paths.rules,
        # Copies, because numba takes 0.2 us longer over every array that is read-only.
        *(array.copy() for array in paths.curves),
        paths.wraps, paths.wrap_starts, paths.factors, paths.factor_starts,
        np.empty(points, dtype=np.int64),
        np.empty(size + 3 * points + WORK_PER_WRAP * surfaces + WORK),
    )  # fmt: skip


def path_points(tree: Tree, paths: Paths, q: ArrayLike) -> list[np.ndarray]:
    """Global positions [m] of every muscle's points, (points, 3) each, at coordinates `q` (n,).

    Where a muscle wraps there are points along the geodesic; a path that is a function has none.
    """
    q = np.asarray(q, dtype=float)
    R, p, x = _frames(tree, paths, q)
    found = np.split(x, paths.starts[1:-1])
    for i in paths.bent:
        found[i] = _rope(paths, i, R, p, x, q)
    return found


def surfaces_at(tree: Tree, paths: Paths, q: ArrayLike) -> list[tuple[int, np.ndarray, float]]:
    """Shape, pose (4, 4) with axes as long as the radii, and half length [m] of every surface."""
    R, p, _ = _frames(tree, paths, np.asarray(q, dtype=float))
    # Several muscles may wrap over one surface; which of their points do makes no difference.
    rows = paths.wraps.copy()
    rows[:, [FIRST, LAST]] = 0.0
    found = []
    for row in np.unique(rows, axis=0):
        frames, pose = np.empty((4, 3)), np.eye(4)
        surface_frames(row[None], 0, 1, R, p, frames)
        pose[:3, :3], pose[:3, 3] = frames[:3].T * row[RADII], frames[3]
        found.append((int(row[SHAPE]), pose, float(row[HALF_LENGTH])))
    return found


def _frames(tree: Tree, paths: Paths, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Orientations and positions of the links, and positions of the path points."""
    R, p, _ = tree_frames(tree, q)
    x = np.empty((paths.links.size, 3))
    point_positions(paths.positions, paths.links, R, p, x)
    return R, p, x


def _rope(
    paths: Paths, i: int, R: np.ndarray, p: np.ndarray, x: np.ndarray, q: np.ndarray
) -> np.ndarray:
    """Points along muscle `i`."""
    offset, surfaces = paths.wrap_starts[i], np.diff(paths.wrap_starts)[i]
    size = np.diff(paths.starts)[i] + 2 * surfaces
    rope, tags, arcs = np.empty((size, 3)), np.empty(size, dtype=np.int64), np.empty(surfaces)
    contacts, frames = np.empty((4 * surfaces, 3)), np.empty((4 * surfaces, 3))
    move_points(
        paths.positions, paths.links, paths.rules, paths.curves, R, p, q, paths.starts[i],
        paths.starts[i + 1], x,
    )  # fmt: skip
    count = lay(
        paths.rules, paths.starts, paths.wraps, paths.wrap_starts, i, R, p, x, q, rope, tags,
        contacts, frames, np.empty((11, 3)), arcs, np.empty((20, 8)),
    )  # fmt: skip
    points = []
    for k in range(count):
        points.append(rope[k])
        if k + 1 < count and is_arc(tags[k], tags[k + 1]):
            w = (-1 - tags[k]) // 2
            radii = paths.wraps[offset + w, RADII]
            inverse_squares = 1.0 / radii**2
            if paths.wraps[offset + w, SHAPE] == CYLINDER:
                inverse_squares[2] = 0.0  # an ellipsoid of that length, too
            y = np.concatenate([contacts[4 * w], contacts[4 * w + 2], [0.0, 0.0]])
            part = arcs[w] / PARTS_OF_AN_ARC
            for _ in range(PARTS_OF_AN_ARC - 1):
                follow_geodesic(
                    y, inverse_squares, part, steps_over(radii, part), np.empty((13, 8))
                )
                point = np.empty(3)
                from_surface(frames, w, y, point)
                points.append(point)
    return np.array(points).reshape(-1, 3)
