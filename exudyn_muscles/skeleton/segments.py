"""The bodies of a skeleton with their masses and joints, for drawings in which they have shapes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import exudyn as exu
import numpy as np

from ..path.frames import GROUND
from .shown import VISUALIZATION, coordinates_shown
from .tree import Tree, tree_frames


class Segment(NamedTuple):
    """A body, in its own frame.

    `joints` (k, 3) are the centers of its joints [m], that towards ground first, `center` (3,) is
    its center of mass [m], `mass` [kg], `tensor` (3, 3) its inertia about the center [kg m^2].
    `number` is that of the tree's link, or of the object; `frame` the one under which paths know
    it, None if they number otherwise.
    """

    number: int
    mass: float
    center: np.ndarray
    tensor: np.ndarray
    joints: np.ndarray
    frame: int | None


class Segments(NamedTuple):
    """All bodies, and a function of their poses (s, 4, 4) at Exudyn's visualization state."""

    bodies: tuple[Segment, ...]
    poses: Callable[[], np.ndarray]


def tree_segments(mbs: exu.MainSystem, number: int, tree: Tree, rows: slice) -> Segments:
    """The links of a tree that have a mass; those without are part of a joint.

    Joints are where they are at the visualization state.
    """
    item = mbs.GetObject(number)
    masses = np.array(item["linkMasses"], dtype=float)
    centers, tensors = (
        np.array(item[name].GetPythonObject(), dtype=float).reshape(-1, *shape)
        for name, shape in (("linkCOMs", (3,)), ("linkInertiasCOM", (3, 3)))
    )
    solid = np.flatnonzero(masses > 0.0)
    R, p, _ = tree_frames(tree, coordinates_shown(mbs)[rows])
    above = {}
    for link in solid:
        parent = tree.parents[link]
        while parent != GROUND and masses[parent] == 0.0:
            parent = tree.parents[parent]
        above[link] = parent
    bodies = []
    for link in solid:
        below = [p[other] for other, parent in above.items() if parent == link]
        joints = (np.array([p[link], *below]) - p[link]) @ R[link]
        bodies.append(
            Segment(int(link), masses[link], centers[link], tensors[link], joints, int(link))
        )

    def poses() -> np.ndarray:
        R, p, _ = tree_frames(tree, coordinates_shown(mbs)[rows])
        return pose_matrices(R[solid], p[solid])

    return Segments(tuple(bodies), poses)


def pose_matrices(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """R (s, 3, 3) and p (s, 3) as (s, 4, 4)."""
    made = np.tile(np.eye(4), (len(p), 1, 1))
    made[:, :3, :3], made[:, :3, 3] = R, p
    return made


def body_poses(mbs: exu.MainSystem, numbers: list[int]) -> np.ndarray:
    """Poses (s, 4, 4) of bodies at the visualization state; mass points do not turn."""
    R, p = np.tile(np.eye(3), (len(numbers), 1, 1)), np.empty((len(numbers), 3))
    kinds = exu.OutputVariableType
    for k, number in enumerate(numbers):
        body = exu.ObjectIndex(number)
        p[k] = mbs.GetObjectOutputBody(body, kinds.Position, np.zeros(3), VISUALIZATION)
        if not mbs.GetObject(number)["objectType"].startswith("Mass"):
            turned = mbs.GetObjectOutputBody(body, kinds.RotationMatrix, np.zeros(3), VISUALIZATION)
            R[k] = np.reshape(turned, (3, 3))
    return pose_matrices(R, p)
