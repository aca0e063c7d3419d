"""Lengths of all muscles' paths, and what a unit of force in each does to links and coordinates.

Along a segment from A to B with unit direction e a muscle pulls with e at A and with -e at B, and
dl = e . (dB - dA). A moving point has its own velocity on its link besides, so that the muscle also
pulls at the point's coordinate.

The same holds where a muscle wraps: the tangent points move with the surface's link. That they
also slide on the surface does not change the length, because a geodesic that the straight parts
touch is stationary. Where a straight part has no length, because a point lies on the surface or two
surfaces touch, e is the geodesic's direction there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..numerics.curves import evaluate
from ..numerics.kernel import kernel
from .cylinder import FIRST_DIRECTION, SECOND_DIRECTION
from .frames import point_positions
from .functions import function_pulls
from .paths import COORDINATE, CURVES, Paths
from .pulls import PULL_COLUMNS, Pulls, pull_coordinate, pull_link
from .rope import distance, is_arc, lay
from .surfaces import LINK

X = CURVES.start

# Sizes ahead of the integers of a work space: points of the longest rope, most surfaces, pulls.
POINTS, SURFACES, PULLS, SIZES = range(4)
# Numbers in it: a surface's contact, frame and arc; a trial, an ellipsoid's.
PER_SURFACE, WORK = 12 + 12 + 1, 33 + 160

# A straight part that is shorter takes its direction from the surface that it touches [m]: of its
# ends' difference rounding would leave too little.
SHORT = 1e-7
# Path points so close together are one [m]; between them there is no direction.
COINCIDENT = 1e-13


class Room(NamedTuple):
    """Where bent muscles are laid, one after the other: a rope, and what `lay` writes of it."""

    rope: np.ndarray
    tags: np.ndarray
    contacts: np.ndarray
    frames: np.ndarray
    arcs: np.ndarray
    trial: np.ndarray
    work: np.ndarray


def space_for(paths: Paths) -> tuple[np.ndarray, np.ndarray]:
    """The integers and numbers that `path_geometry` works on."""
    surfaces = np.diff(paths.wrap_starts)
    points = np.diff(paths.starts) + 2 * surfaces
    pulls = 2 * points  # more than one at each end of a segment
    pulls[paths.bent] *= 4  # and where a point moves, three more
    sizes = points.max(initial=0), surfaces.max(initial=0), pulls.sum() + len(paths.factors)
    room = numbers_of_room(sizes[POINTS], sizes[SURFACES])
    numbers = 3 + PULL_COLUMNS * sizes[PULLS] + paths.positions.size + room
    return (
        np.array([*sizes, *np.zeros(2 * (len(points) + sizes[PULLS]) + sizes[POINTS])], dtype=int),
        np.empty(numbers),
    )


def numbers_of_room(points: int, surfaces: int) -> int:
    """How many numbers `room_in` needs for so long a rope over so many surfaces."""
    return 3 * points + PER_SURFACE * surfaces + WORK


def room_in(tags: np.ndarray, numbers: np.ndarray, surfaces: int) -> Room:
    """The `Room` in what is left of a work room."""
    a = 3 * tags.size
    b, c, d = a + 12 * surfaces, a + 24 * surfaces, a + PER_SURFACE * surfaces
    return Room(
        numbers[:a].reshape((tags.size, 3)), tags,
        numbers[a:b].reshape((4 * surfaces, 3)), numbers[b:c].reshape((4 * surfaces, 3)),
        numbers[c:d], numbers[d : d + 33].reshape((11, 3)), numbers[d + 33 :].reshape((20, 8)),
    )  # fmt: skip


# Kernels hand no views out to Python, which calls the function itself.
_room_in = kernel(room_in)


@kernel
def path_geometry(paths, wanted, R, p, q, integers, numbers, l):
    """Write l (m,) of `Paths` where the links have the frames R, p; of those that are `wanted` (m,)
    alone, or None for all.

    Returns the `Pulls`, none of the others, and the first muscle for which no geodesic was found,
    or -1. The pulls belong to the work space `integers`, `numbers`, which the next call overwrites.
    """
    m, points, rows = l.size, paths.links.size, integers[PULLS]
    a, b = SIZES + 2 * m, SIZES + 2 * m + rows
    c, d = 3 + PULL_COLUMNS * rows, 3 + PULL_COLUMNS * rows + 3 * points
    e, x = numbers[:3], numbers[c:d].reshape((points, 3))
    pulls = Pulls(
        integers[a:b], integers[b : b + rows], numbers[3:c].reshape((rows, PULL_COLUMNS)),
        integers[SIZES : SIZES + m], integers[SIZES + m : a],
    )  # fmt: skip
    point_positions(paths.positions, paths.links, R, p, x)
    k, next_bent = 0, 0
    for i in range(m):
        pulls.firsts[i] = pulls.lasts[i] = 0
        if next_bent < paths.bent.size and paths.bent[next_bent] == i:
            next_bent += 1
            continue
        if wanted is not None and not wanted[i]:
            continue
        pulls.firsts[i] = k
        l[i], k = straight_path(x, paths.links, paths.starts[i], paths.starts[i + 1], e, pulls, k)
        pulls.lasts[i] = k
    if paths.bent.size == 0:
        return pulls, -1
    room = _room_in(integers[b + rows :], numbers[d:], integers[SURFACES])
    for i in paths.bent:
        if wanted is not None and not wanted[i]:
            continue
        pulls.firsts[i] = k
        l[i], k = bent_path(paths, i, R, p, q, x, e, room, pulls, k)
        pulls.lasts[i] = k
        if math.isnan(l[i]):
            return pulls, i
    return pulls, -1


@kernel(inline=True)
def straight_path(x, links, first, last, e, pulls, k):
    """Length of a muscle through the fixed points `first` to `last`, and the number of the row
    after its pulls."""
    length = 0.0
    for a in range(first, last - 1):
        for row in range(3):
            e[row] = x[a + 1, row] - x[a, row]
        d = math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
        length += d
        if links[a] == links[a + 1] or d < COINCIDENT:
            continue
        for row in range(3):
            e[row] /= d
        k = pull_link(pulls, k, links[a + 1], x, a + 1, e, -1.0)
        k = pull_link(pulls, k, links[a], x, a, e, 1.0)
    return length, k


@kernel
def bent_path(paths, i, R, p, q, x, e, room, pulls, k):
    """As `straight_path`, of any other muscle; a length of NaN where it finds no way."""
    length, tags, rope = 0.0, room.tags, room.rope
    first, last = paths.factor_starts[i], paths.factor_starts[i + 1]
    if first < last:
        length, k = function_pulls(paths.factors, paths.curves, first, last, q, pulls, k)
    move_points(paths, R, q, paths.starts[i], paths.starts[i + 1], x)
    count = lay_muscle(paths, i, R, p, q, x, room)
    for a in range(count - 1):
        if is_arc(tags[a], tags[a + 1]):
            length += room.arcs[(-1 - tags[a]) // 2]
            continue
        d = distance(rope[a], rope[a + 1])
        length += d
        if d < SHORT and min(tags[a], tags[a + 1]) < 0:
            contact_direction(room.contacts, room.frames, tags[a], tags[a + 1], e)
        elif d < COINCIDENT:
            continue
        else:
            for row in range(3):
                e[row] = (rope[a + 1, row] - rope[a, row]) / d
        for end, sign in ((a + 1, -1.0), (a, 1.0)):
            tag = tags[end]
            if tag >= 0:
                link = paths.links[tag]
                k = pull_own_coordinate(paths, R, q, tag, e, sign, pulls, k)
            else:
                link = int(paths.wraps[paths.wrap_starts[i] + (-1 - tag) // 2, LINK])
            k = pull_link(pulls, k, link, rope, end, e, sign)
    return length, k


@kernel
def lay_muscle(paths, i, R, p, q, x, room):
    """`lay` muscle `i` in a `Room`; returns how many points its rope has."""
    return lay(
        paths.rules, paths.starts, paths.wraps, paths.wrap_starts, i, R, p, x, q, room.rope,
        room.tags, room.contacts, room.frames, room.trial, room.arcs, room.work,
    )  # fmt: skip


@kernel
def move_points(paths, R, q, first, last, x):
    """Put the moving points among the points `first` to `last` where they are at `q`."""
    for k in range(first, last):
        link = paths.links[k]
        for column in range(3):
            curve = int(paths.rules[k, X + column])
            if curve < 0:
                continue
            value, _, _ = evaluate(paths.curves, curve, q[int(paths.rules[k, COORDINATE])])
            shift = value - paths.positions[k, column]
            for row in range(3):
                if link < 0:
                    x[k, row] += shift if row == column else 0.0
                else:
                    x[k, row] += R[link, row, column] * shift


@kernel
def pull_own_coordinate(paths, R, q, point, e, sign, pulls, k):
    """What the force sign * e does by a moving point's own velocity on its link."""
    for column in range(3):
        curve = int(paths.rules[point, X + column])
        if curve < 0:
            continue
        j, link = int(paths.rules[point, COORDINATE]), paths.links[point]
        _, slope, _ = evaluate(paths.curves, curve, q[j])
        along = e[column]
        if link >= 0:
            along = e[0] * R[link, 0, column] + e[1] * R[link, 1, column]
            along += e[2] * R[link, 2, column]
        k = pull_coordinate(pulls, k, j, sign * along * slope)
    return k


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
