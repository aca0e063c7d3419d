"""How one muscle lies around its surfaces: path points and tangent points in order."""

from __future__ import annotations

import math

from ..numerics.kernel import kernel
from .cylinder import CUT, FREE
from .paths import COORDINATE, HIGH, LOW
from .surfaces import FIRST, LAST, LINK, POSITION, ROTATION, SIDE
from .wrapping import wrap_over

SWEEPS = 300  # over the surfaces of one muscle
# Surfaces that overlap can displace each other for ever. From this sweep on each stays where it is
# in the order along the muscle and is passed on the same side; one that lets go stays off.
SETTLED = 50
# Where tangent points move on by as much as this [m], the muscle takes the shorter way over each
# surface from this sweep on, whatever its side is: that makes it shorter, and so comes to an end.
RESTLESS, SHORTEN = 1e-6, 150
AT_REST = 1e-13  # movement of tangent points between two sweeps [m]


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
            frames[f, row] * local[0]
            + frames[f + 1, row] * local[1]
            + frames[f + 2, row] * local[2]
        )


@kernel
def copy_row(source, k, target, j):
    for column in range(3):
        target[j, column] = source[k, column]


@kernel
def is_arc(tag, following):
    """Whether two neighbours on a rope are the two tangent points of one wrap."""
    return tag < 0 and tag % 2 == 1 and following == tag - 1


@kernel
def distance(a, b):
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@kernel
def cross(a, b, c):
    for row in range(3):
        j, k = (row + 1) % 3, (row + 2) % 3
        c[row] = a[j] * b[k] - a[k] * b[j]


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
    rules, starts, wraps, wrap_starts, i, R, p, x, q, rope, tags, contacts, frames, trial, arcs,
    work,
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
    P, Q, around = trial[0], trial[1], trial[10]
    around[:] = 0.0
    sided, moved = True, 0.0
    for sweep in range(SWEEPS):
        if sweep == SHORTEN and moved > RESTLESS:
            sided = False
            around[:] = 0.0
        moved = 0.0
        for w in range(count):
            first = starts[i] + int(wraps[offset + w, FIRST])
            last = starts[i] + int(wraps[offset + w, LAST])
            contact, found = contacts[4 * w : 4 * w + 4], trial[2:6]
            # Off the surface, and look for a place.
            before = -1
            for k in range(n):
                if tags[k] == -1 - 2 * w:
                    before = k - 1
                    for later in range(k, n - 2):
                        tags[later] = tags[later + 2]
                        copy_row(rope, later + 2, rope, later)
                    n -= 2
                    break
            if sweep >= SETTLED and sided:
                cross(contact[0], contact[2], around)
            side = wraps[offset + w, SIDE] if sided else 0.0
            place, least, arc, behind = -1, math.inf, 0.0, -1
            shift = 0.0
            for k in range(n - 1):
                if tags[k] >= 0:
                    behind = tags[k]
                elif is_arc(tags[k], tags[k + 1]):
                    continue
                if sweep >= SETTLED and k != before:
                    continue
                ahead = k + 1
                while tags[ahead] < 0:
                    ahead += 1
                if behind < first or tags[ahead] > last:
                    continue
                to_surface(frames, w, rope[k], P)
                to_surface(frames, w, rope[k + 1], Q)
                status, length = wrap_over(wraps, offset + w, side, around, P, Q, found, work)
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
                moved = math.inf if before >= 0 else moved
                continue
            moved = max(moved, shift) if place == before + 1 else math.inf
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
