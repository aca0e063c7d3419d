"""l, l' and r = -dl/dq of all muscles' paths in one compiled pass.

For a segment from A to B with unit direction e, dl = e . (dB - dA). A revolute joint with axis z
through o moves a point x of the links behind it by z x (x - o) dq, a prismatic one by z dq. A
moving point has its own velocity on its link besides.

The same holds where a muscle wraps: the tangent points move with the surface's link. That they
also slide on the surface does not change the length, because a geodesic that the straight parts
touch is stationary.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError
from ..kernel import kernel
from ..muscle.curves import PackedCurves, evaluate
from .points import COORDINATE, CURVES, HIGH, LOW, STRAIGHT, Paths
from .surfaces import FIRST, LAST, LINK, POSITION, ROTATION
from .tree import PRISMATIC, Tree, link_frames
from .wrapping import CUT, FREE, wrap_over

X = CURVES.start
SWEEPS = 100  # over the surfaces of one muscle
AT_REST = 1e-13  # movement of tangent points between two sweeps [m]

# Rows of `ropes` that one muscle with W wraps needs besides those of its points: two tangent
# points, contact, contact of the best segment, axes and position of the surface.
ROWS_OF_A_WRAP = 2 + 4 + 4 + 4


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
def to_surface(frames, w, point, local):
    """A global point in the frame of wrap `w`: three rows of axes and one of position."""
    f = 4 * w
    d_x, d_y, d_z = (
        point[0] - frames[f + 3, 0],
        point[1] - frames[f + 3, 1],
        point[2] - frames[f + 3, 2],
    )
    for row in range(3):
        local[row] = frames[f + row, 0] * d_x + frames[f + row, 1] * d_y + frames[f + row, 2] * d_z


@kernel
def from_surface(frames, w, local, point):
    f = 4 * w
    for row in range(3):
        point[row] = frames[f + 3, row] + (
            frames[f, row] * local[0] + frames[f + 1, row] * local[1] + frames[f + 2, row] * local[2]
        )


@kernel
def copy_row(source, k, target, j):
    for column in range(3):
        target[j, column] = source[k, column]


@kernel
def distance(a, b):
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@kernel
def surface_frames(wraps, first, last, R, p, frames):
    """Global axes and positions of the surfaces `first` to `last`, four rows each."""
    for w in range(first, last):
        link, f = int(wraps[w, LINK]), 4 * (w - first)
        for axis in range(4):
            # Columns of the rotation, then the position.
            for row in range(3):
                if axis < 3:
                    frames[f + axis, row] = wraps[w, ROTATION.start + 3 * row + axis]
                else:
                    frames[f + axis, row] = wraps[w, POSITION.start + row]
            if link >= 0:
                a, b, c = frames[f + axis, 0], frames[f + axis, 1], frames[f + axis, 2]
                for row in range(3):
                    value = R[link, row, 0] * a + R[link, row, 1] * b + R[link, row, 2] * c
                    frames[f + axis, row] = value if axis < 3 else value + p[link, row]


@kernel
def lay(
    rules, starts, wraps, wrap_starts, i, R, p, x, q, rope, tags, contacts, frames, trial, arcs, work
):  # fmt: skip
    """Lay muscle `i` around its surfaces; returns how many points its rope has.

    `rope` (points, 3) gets the active path points and the tangent points, `tags` what they are: the
    number of a path point, or -1 - 2w and -2 - 2w for the first and second tangent point of the
    muscle's wrap w. `contacts` (4 W, 3) and `arcs` (W,) belong to the wraps.

    Several surfaces are laid one after the other, each between the tangent points of the others,
    until none moves. Of the segments that could wrap over a surface it takes the first one that
    cuts it, otherwise the one that gets least longer, as OpenSim does.
    """
    n = 0
    for k in range(starts[i], starts[i + 1]):
        j = int(rules[k, COORDINATE])
        if j >= 0 and not rules[k, LOW] <= q[j] <= rules[k, HIGH]:
            continue
        tags[n] = k
        copy_row(x, k, rope, n)
        n += 1
    offset, count = wrap_starts[i], wrap_starts[i + 1] - wrap_starts[i]
    surface_frames(wraps, offset, offset + count, R, p, frames)
    P, Q = trial[0], trial[1]
    for _ in range(SWEEPS):
        moved = 0.0
        for w in range(count):
            first = starts[i] + int(wraps[offset + w, FIRST])
            last = starts[i] + int(wraps[offset + w, LAST])
            contact, found = contacts[4 * w : 4 * w + 4], trial[2:6]
            # Off the surface, and look for a place.
            had = False
            for k in range(n):
                if tags[k] == -1 - 2 * w:
                    had = True
                    for later in range(k, n - 2):
                        tags[later] = tags[later + 2]
                        copy_row(rope, later + 2, rope, later)
                    n -= 2
                    break
            place, least, arc, behind = -1, math.inf, 0.0, -1
            shift = 0.0
            for k in range(n - 1):
                if tags[k] >= 0:
                    behind = tags[k]
                elif tags[k] % 2 == 1 and tags[k + 1] == tags[k] - 1:
                    continue  # the arc on another surface
                ahead = k + 1
                while tags[ahead] < 0:
                    ahead += 1
                if behind < first or tags[ahead] > last:
                    continue
                to_surface(frames, w, rope[k], P)
                to_surface(frames, w, rope[k + 1], Q)
                status, length = wrap_over(wraps, offset + w, P, Q, found, work)
                if status == FREE:
                    continue
                longer = distance(P, found[0]) + length + distance(found[1], Q) - distance(P, Q)
                if status == CUT or longer < least:
                    place, least, arc = k + 1, longer, length
                    shift = max(distance(found[0], contact[0]), distance(found[1], contact[1]))
                    for row in range(4):
                        copy_row(found, row, trial, 6 + row)
                if status == CUT:
                    break
            if place < 0:
                moved = math.inf if had else moved
                continue
            moved = max(moved, shift) if had else math.inf
            for row in range(4):
                copy_row(trial, 6 + row, contact, row)
            arcs[w] = arc
            for later in range(n - 1, place - 1, -1):
                tags[later + 2] = tags[later]
                copy_row(rope, later, rope, later + 2)
            n += 2
            tags[place], tags[place + 1] = -1 - 2 * w, -2 - 2 * w
            from_surface(frames, w, contact[0], rope[place])
            from_surface(frames, w, contact[1], rope[place + 1])
        if moved < AT_REST or count == 1:
            break
    return n


@kernel(allocates=True)
def path_geometry(
    joints, parents, rotations, offsets, base, reference, positions, links, starts, kinds, rules,
    grids, bins, pieces, wraps, wrap_starts, q, v, l, l_t, r,
):  # fmt: skip
    """Write l (m,), l' (m,) and r (m, n) at the coordinates `q` and speeds `v`."""
    n, m = joints.size, starts.size - 1
    R, p, axes = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    link_frames(joints, parents, rotations, offsets, base, reference, q, R, p, axes)
    x = np.empty((links.size, 3))
    point_positions(positions, links, base, R, p, x)
    curves = PackedCurves(grids, bins, pieces)
    points = surfaces = 0
    for i in range(m):
        if kinds[i] != STRAIGHT:
            points = max(points, starts[i + 1] - starts[i])
            surfaces = max(surfaces, wrap_starts[i + 1] - wrap_starts[i])
    size = points + 2 * surfaces
    work, tags = np.empty((1 + size + 10 + 9 * surfaces, 3)), np.empty(size, dtype=np.int64)
    steps = np.empty((16 if surfaces else 0, 8))
    e, rope, trial = work[0], work[1 : size + 1], work[size + 1 : size + 11]
    rest = work[size + 11 :]
    contacts, frames, arcs = rest[: 4 * surfaces], rest[4 * surfaces :], rest[8 * surfaces :, 0]
    for i in range(m):
        l[i] = 0.0
        r[i] = 0.0
        if kinds[i] == STRAIGHT:
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
        else:
            move_points(positions, links, rules, curves, R, p, q, starts[i], starts[i + 1], x)
            count = lay(
                rules, starts, wraps, wrap_starts, i, R, p, x, q, rope, tags, contacts, frames,
                trial, arcs, steps,
            )  # fmt: skip
            for k in range(count - 1):
                a, b = tags[k], tags[k + 1]
                if a < 0 and b == a - 1 and a % 2 == 1:
                    l[i] += arcs[(-1 - a) // 2]
                    continue
                d = distance(rope[k], rope[k + 1])
                l[i] += d
                if d == 0.0:
                    continue
                for row in range(3):
                    e[row] = (rope[k + 1, row] - rope[k, row]) / d
                for end, tag, sign in ((k + 1, b, -1.0), (k, a, 1.0)):
                    if tag >= 0:
                        link = links[tag]
                        add_own_motion(links, rules, curves, R, q, tag, e, sign, r[i])
                    else:
                        link = int(wraps[wrap_starts[i] + (-1 - tag) // 2, LINK])
                    add_motion(joints, parents, p, axes, link, rope, end, e, sign, r[i])
        l_t[i] = 0.0
        for j in range(n):
            l_t[i] -= r[i, j] * v[j]
        if not l[i] < math.inf:
            return i
    return -1


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
        paths.positions, paths.links, paths.starts, paths.kinds, paths.rules, *paths.curves,
        paths.wraps, paths.wrap_starts,
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
