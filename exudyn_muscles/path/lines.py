"""Paths and surfaces in space, for pictures."""

from __future__ import annotations

import numpy as np

from .frames import point_positions
from .geodesic import follow_geodesic, steps_over
from .geometry import lay_muscle, move_points, numbers_of_room, room_in
from .paths import Paths
from .rope import from_surface, is_arc, surface_frames
from .surfaces import CYLINDER, FIRST, HALF_LENGTH, LAST, RADII, SHAPE, TORUS

PARTS_OF_AN_ARC, PARTS_OF_A_RING = 12, 24


def lines(paths: Paths, R: np.ndarray, p: np.ndarray, q: np.ndarray) -> list[np.ndarray]:
    """Global positions [m] of every muscle's points, (points, 3) each.

    Where a muscle wraps there are points along the geodesic; a path that is a function has none.

    Parameters
    ----------
    paths : Paths
    R, p : (links, 3, 3), (links, 3) ndarray
        Frames of the links [m].
    q : (n,) ndarray
        Coordinates, on which points and functions may depend.
    """
    x = np.empty((paths.links.size, 3))
    point_positions(paths.positions, paths.links, R, p, x)
    found = np.split(x, paths.starts[1:-1])
    for i in paths.bent:
        found[i] = _rope(paths, i, R, p, x, q)
    return found


def surfaces(paths: Paths, R: np.ndarray, p: np.ndarray) -> list[tuple[int, np.ndarray, float]]:
    """Shape, pose (4, 4) with axes as long as the radii, and half length [m] of every surface."""
    # Several muscles may wrap over one surface; which of their points do makes no difference.
    rows = paths.wraps.copy()
    rows[:, [FIRST, LAST]] = 0.0
    found = []
    for row in np.unique(rows, axis=0):
        frames, pose = np.empty((4, 3)), np.eye(4)
        surface_frames(row[None], 0, 1, R, p, frames)
        if row[SHAPE] == TORUS:
            found += _ring(row[RADII], frames)
            continue
        pose[:3, :3], pose[:3, 3] = frames[:3].T * row[RADII], frames[3]
        found.append((int(row[SHAPE]), pose, float(row[HALF_LENGTH])))
    return found


def _ring(radii: np.ndarray, frames: np.ndarray) -> list[tuple[int, np.ndarray, float]]:
    """A torus as cylinders one after the other."""
    (tube, circle, _), (x, y, z, center), found = radii, frames, []
    for angle in 2.0 * np.pi * np.arange(PARTS_OF_A_RING) / PARTS_OF_A_RING:
        outward = np.cos(angle) * x + np.sin(angle) * y
        pose = np.eye(4)
        pose[:3, :3] = tube * np.column_stack([outward, -z, np.cross(outward, -z)])
        pose[:3, 3] = center + circle * outward
        found.append((CYLINDER, pose, circle * np.tan(np.pi / PARTS_OF_A_RING)))
    return found


def _rope(
    paths: Paths, i: int, R: np.ndarray, p: np.ndarray, x: np.ndarray, q: np.ndarray
) -> np.ndarray:
    """Points along muscle `i`."""
    offset, surfaces = paths.wrap_starts[i], np.diff(paths.wrap_starts)[i]
    tags = np.empty(np.diff(paths.starts)[i] + 2 * surfaces, dtype=np.int64)
    room = room_in(tags, np.empty(numbers_of_room(tags.size, surfaces)), surfaces)
    move_points(paths, R, q, paths.starts[i], paths.starts[i + 1], x)
    count = lay_muscle(paths, i, R, p, q, x, room)
    points = []
    for k in range(count):
        points.append(room.rope[k])
        if k + 1 < count and is_arc(tags[k], tags[k + 1]):
            w = (-1 - tags[k]) // 2
            if paths.wraps[offset + w, SHAPE] == TORUS:
                points += _over_tube(room.contacts[4 * w : 4 * w + 4], room.arcs[w], w, room.frames)
                continue
            radii = paths.wraps[offset + w, RADII]
            inverse_squares = 1.0 / radii**2
            if paths.wraps[offset + w, SHAPE] == CYLINDER:
                inverse_squares[2] = 0.0  # an ellipsoid of that length, too
            y = np.concatenate([room.contacts[4 * w], room.contacts[4 * w + 2], [0.0, 0.0]])
            part = room.arcs[w] / PARTS_OF_AN_ARC
            for _ in range(PARTS_OF_AN_ARC - 1):
                follow_geodesic(
                    y, inverse_squares, part, steps_over(radii, part), np.empty((13, 8))
                )
                point = np.empty(3)
                from_surface(room.frames, w, y, point)
                points.append(point)
    return np.array(points).reshape(-1, 3)


def _over_tube(contact: np.ndarray, arc: float, w: int, frames: np.ndarray) -> list[np.ndarray]:
    """Points between the tangent points on a torus: a cubic with the directions there."""
    first, last, ahead, behind = contact
    points = []
    for s in np.arange(1, PARTS_OF_AN_ARC) / PARTS_OF_AN_ARC:
        slopes = s * (1.0 - s) ** 2 * arc * ahead - s * s * (1.0 - s) * arc * behind
        local = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * first + s * s * (3.0 - 2.0 * s) * last + slopes
        point = np.empty(3)
        from_surface(frames, w, local, point)
        points.append(point)
    return points
