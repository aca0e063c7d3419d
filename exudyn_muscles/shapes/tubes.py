"""Round bodies along lines: rings of vertices, and the triangles between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..files.meshes import Mesh

SIDES = 8


def tube(points: np.ndarray, radii: np.ndarray, sides: int = SIDES) -> np.ndarray:
    """Vertices of a closed round body.

    Parameters
    ----------
    points : (..., n, 3) ndarray
        Its axis [m]; neighbours may coincide.
    radii : (..., n) ndarray
        [m].
    sides : int

    Returns
    -------
    (..., n sides + 2, 3) ndarray
        Ring by ring, then both ends.
    """
    along = _directions(points)
    side = np.empty_like(points)
    # The first ring starts anywhere; each further one turns as little as it can.
    last = _across(along[..., 0, :])
    for k in range(points.shape[-2]):
        last = last - _dot(last, along[..., k, :]) * along[..., k, :]
        size = np.linalg.norm(last, axis=-1, keepdims=True)
        last = np.where(size > 1e-6, last / np.maximum(size, 1e-6), _across(along[..., k, :]))
        side[..., k, :] = last
    other = np.cross(along, side)
    angles = 2.0 * np.pi * np.arange(sides) / sides
    circle = (
        np.cos(angles)[:, None] * side[..., None, :] + np.sin(angles)[:, None] * other[..., None, :]
    )
    rings = points[..., None, :] + radii[..., None, None] * circle
    flat = rings.reshape(*points.shape[:-2], -1, 3)
    return np.concatenate([flat, points[..., :1, :], points[..., -1:, :]], axis=-2)


def triangles(n: int, sides: int = SIDES) -> np.ndarray:
    """Corners (t, 3) of the triangles of a `tube` with n rings, seen from outside."""
    k = np.arange(sides)
    after = (k + 1) % sides
    found = []
    for ring in range(n - 1):
        a, b = ring * sides, (ring + 1) * sides
        found.append(np.column_stack([a + k, a + after, b + k]))
        found.append(np.column_stack([a + after, b + after, b + k]))
    start, end, last = n * sides, n * sides + 1, (n - 1) * sides
    found.append(np.column_stack([np.full(sides, start), after, k]))
    found.append(np.column_stack([np.full(sides, end), last + k, last + after]))
    return np.vstack(found).astype(np.uint32)


def merged(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    begins = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])[:-1]
    corners = [corners + begin for (_, corners), begin in zip(meshes, begins, strict=True)]
    vertices = np.vstack([vertices for vertices, _ in meshes])
    return vertices, np.vstack(corners).astype(np.uint32)


def normals(vertices: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Unit normals (v, 3) of a smooth surface, means over the triangles (t, 3) around."""
    a, b, c = (vertices[corners[:, k]] for k in range(3))
    across, found = np.cross(b - a, c - a), np.zeros_like(vertices)
    for k in range(3):
        np.add.at(found, corners[:, k], across)
    return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-300)


def on_vertices(values: np.ndarray, sides: int = SIDES) -> np.ndarray:
    """Values (..., n) of rings at the vertices (..., n sides + 2)."""
    return np.concatenate(
        [np.repeat(values, sides, axis=-1), values[..., :1], values[..., -1:]], axis=-1
    )


def _directions(points: np.ndarray) -> np.ndarray:
    """Unit tangents (..., n, 3): the mean of the parts before and after that have a length."""
    parts = np.diff(points, axis=-2)
    length = np.linalg.norm(parts, axis=-1, keepdims=True)
    unit = np.divide(parts, length, out=np.zeros_like(parts), where=length > 1e-9)
    mean = np.zeros_like(points)
    mean[..., :-1, :] += unit
    mean[..., 1:, :] += unit
    size = np.linalg.norm(mean, axis=-1, keepdims=True)
    return np.where(size > 1e-6, mean / np.maximum(size, 1e-6), np.array([0.0, 0.0, 1.0]))


def _across(along: np.ndarray) -> np.ndarray:
    """A unit vector perpendicular to each of these."""
    axis = np.eye(3)[np.abs(along).argmin(axis=-1)]
    found = np.cross(along, axis)
    return found / np.linalg.norm(found, axis=-1, keepdims=True)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(axis=-1, keepdims=True)
