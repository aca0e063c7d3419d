"""Shapes that read as limbs, of nothing but joints and masses.

A bone goes from the joint towards ground to each further joint; that of a last segment goes beyond
its center of mass, by half of a rod with its inertia and as far as the joint at most. Around it is
an ellipsoid with the segment's mass and inertia. A body with several further joints, and ground, is
the hull of its joints and of the points that muscles have on it, as a pelvis is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError
from ..files.meshes import Mesh, read_mesh
from ..path.frames import GROUND
from ..path.paths import COORDINATE, Paths
from ..path.surfaces import CYLINDER
from ..skeleton.segments import Segment
from .tubes import merged, triangles, tube

# Radii over a bone's length; a femur's are 0.03 and 0.08.
SHAFT, END = 0.032, 0.075
BONE_SIDES, BONE_RINGS, KNOB_RINGS = 10, 12, 4
SMALLEST_BONE = 0.01  # part of a scene's size: nothing shorter is drawn
SPHERE = 20  # rings and sides
# kg/m^3: a trunk with the air in its lungs has 400 and more as an ellipsoid, while the small bones
# of a foot often have a larger inertia than they can, which makes integration easier.
LIGHTEST = 200.0
WATER = 1000.0  # kg/m^3
POINT = 1e-3  # m: a smaller radius of gyration is that of a point mass
UNLIMITED = 3.0  # half the length that is drawn of an unlimited cylinder, in radii


def checked_meshes(
    meshes: Mapping[int, tuple[ArrayLike, ArrayLike] | str | Path], segments: Sequence[Segment]
) -> dict[int, Mesh]:
    """A user's meshes by the numbers of their segments, or ParameterError."""
    numbers, found = [GROUND, *(segment.number for segment in segments)], {}
    for link, mesh in meshes.items():
        if int(link) not in numbers:
            raise ParameterError(
                f"meshes: {link} is no segment with a mass; these are "
                f"{', '.join(map(str, numbers))} (-1 is ground)"
            )
        read = read_mesh(mesh) if isinstance(mesh, (str, Path)) else mesh
        try:
            vertices, corners = (np.array(part) for part in read)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"meshes: of {link}: {error}") from error
        flat = vertices.ndim != 2 or corners.ndim != 2 or len(corners) == 0
        if flat or vertices.shape[1] != 3 or corners.shape[1] != 3:
            raise ParameterError(
                f"meshes: {link} needs vertices (v, 3) and corners (t, 3), got {vertices.shape} "
                f"and {corners.shape}"
            )
        if not np.isfinite(vertices.astype(float)).all():
            raise ParameterError(f"meshes: vertices of {link} must be finite")
        if corners.min() < 0 or corners.max() >= len(vertices):
            raise ParameterError(
                f"meshes: corners of {link} are rows of its {len(vertices)} vertices, got "
                f"{corners.min()} to {corners.max()}"
            )
        found[int(link)] = vertices.astype(float), corners.astype(np.uint32)
    return found


def skeletal(segment: Segment, paths: Paths, smallest: float) -> Mesh | None:
    """The bones of a segment in its frame, none shorter than `smallest` [m]."""
    found = _bones(segment, smallest)
    around = hull(segment, paths)
    if around is not None:
        found.append(around)
    return merged(found) if found else None


def _bones(segment: Segment, smallest: float) -> list[Mesh]:
    joints = segment.joints if len(segment.joints) else segment.center[None]
    start, ends = joints[0], joints[1:]
    if len(ends) == 0:
        along = segment.center - start
        length = float(np.linalg.norm(along))
        # Half of a rod with this mass and inertia: a point mass ends where it is.
        half = np.sqrt(3.0 * np.linalg.norm(segment.tensor, 2) / max(segment.mass, 1e-9))
        ends = (segment.center + min(1.0, half / max(length, 1e-9)) * along)[None]
    return [_bone(start, end) for end in ends if np.linalg.norm(end - start) > smallest]


def hull(segment: Segment | None, paths: Paths) -> Mesh | None:
    """The hull of a segment with several further joints, or of ground (None), in its frame."""
    from scipy.spatial import ConvexHull, QhullError  # slow to import

    number, points = GROUND, [np.empty((0, 3))]
    if segment is not None:
        if len(segment.joints) < 3 or segment.frame is None:
            return None
        number = segment.frame
        points = [segment.joints]
    mine = (paths.links == number) & (paths.rules[:, COORDINATE] < 0.0)  # fixed points
    points.append(paths.positions[mine])
    cloud = np.unique(np.vstack(points), axis=0)
    try:
        found = ConvexHull(cloud)
    except (QhullError, ValueError):  # too few, or all in a plane
        return None
    corners = found.simplices.copy()
    normals = np.cross(
        cloud[corners[:, 1]] - cloud[corners[:, 0]], cloud[corners[:, 2]] - cloud[corners[:, 0]]
    )
    inward = (normals * found.equations[:, :3]).sum(axis=1) < 0.0
    corners[inward] = corners[inward][:, ::-1]
    return cloud, corners.astype(np.uint32)


def flesh(segment: Segment) -> Mesh | None:
    """The homogeneous ellipsoid with the mass and inertia of a segment, in its frame, a ball of
    water for a point mass; None if its inertia is none of a body of tissue in space."""
    moments, axes = np.linalg.eigh(segment.tensor)
    if segment.mass <= 0.0:
        return None
    if moments[-1] < POINT**2 * segment.mass:
        radius = np.cbrt(segment.mass / (4.0 / 3.0 * np.pi * WATER))
        vertices, corners = _sphere()
        return segment.center + radius * vertices, corners
    squares = 2.5 / segment.mass * (moments.sum() - 2.0 * moments)
    if not (squares > POINT**2).all():
        return None
    density = segment.mass / (4.0 / 3.0 * np.pi * np.sqrt(squares.prod()))
    if density < LIGHTEST:
        return None
    vertices, corners = _sphere()
    turned = axes * np.sign(np.linalg.det(axes))
    return segment.center + (vertices * np.sqrt(squares)) @ turned.T, corners


def surface(shape: int, pose: np.ndarray, half_length: float) -> Mesh:
    """A wrapping surface in the frame of unit radii that its `pose` (4, 4) makes."""
    if shape != CYLINDER:
        return _sphere()
    half = min(half_length / float(np.linalg.norm(pose[:3, 2])), UNLIMITED)
    points = np.outer(np.linspace(-half, half, 2), [0.0, 0.0, 1.0])
    return tube(points, np.ones(2), SPHERE), triangles(2, SPHERE)


def _bone(start: np.ndarray, end: np.ndarray) -> Mesh:
    """A shaft with two round ends."""
    length = float(np.linalg.norm(end - start))
    shaft, knob = SHAFT * length, END * length
    x = length * _dense_at_ends()
    to_end = np.minimum(x, length - x)
    # The knobs are spheres about the joints, beyond which they reach, and run out into the shaft.
    reach = -knob * np.cos(np.linspace(0.06 * np.pi, 0.5 * np.pi, KNOB_RINGS + 1)[:-1])
    before = np.concatenate([reach, x, length - reach[::-1]])
    inside = np.sqrt(np.maximum(knob**2 - np.minimum(reach, 0.0) ** 2, 0.0))
    course = shaft + (knob - shaft) * np.exp(-((to_end / (1.6 * knob)) ** 2))
    radii = np.concatenate([inside, course, inside[::-1]])
    points = start + np.outer(before / length, end - start)
    return tube(points, radii, BONE_SIDES), triangles(len(points), BONE_SIDES)


def _dense_at_ends() -> np.ndarray:
    return 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, BONE_RINGS)))


def _sphere() -> Mesh:
    """Of radius 1."""
    z = -np.cos(np.linspace(0.05, np.pi - 0.05, SPHERE))
    points = np.outer(z, [0.0, 0.0, 1.0])
    return tube(points, np.sqrt(1.0 - z**2), SPHERE), triangles(SPHERE, SPHERE)
