"""Frames: where they are, and how joints turn and move them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from .element import Element
from .joints import Axis

ZERO = (0.0, 0.0, 0.0)
Z = 2  # the axis of a link's joint where none of x, y, z has the right direction


class Place(NamedTuple):
    """Where a frame is: its `link`, -1 for ground, and its `pose` (4, 4) in the link's frame."""

    link: int
    pose: np.ndarray

    def at(self, positions: np.ndarray) -> np.ndarray:
        """Positions of the frame (..., 3) in the link's frame."""
        return positions @ self.pose[:3, :3].T + self.pose[:3, 3]


def pose(element: Element, angles: str, position: str) -> np.ndarray:
    """The pose (4, 4) of a frame from body-fixed angles about x, y and z, and its position."""
    H = np.eye(4)
    H[:3, :3] = Rotation.from_euler("XYZ", element.vector(angles, default=ZERO)).as_matrix()
    H[:3, 3] = element.vector(position, default=ZERO)
    return H


def aligned(direction: np.ndarray) -> tuple[int, np.ndarray]:
    """The number of a local axis and the pose (4, 4) that turns it to a direction (3,)."""
    for number in range(3):
        if np.array_equal(direction, np.eye(3)[number]):
            return number, np.eye(4)
    x = np.cross(np.eye(3)[np.abs(direction).argmin()], direction)
    x /= np.linalg.norm(x)
    H = np.eye(4)
    H[:3, :3] = np.transpose([x, np.cross(direction, x), direction])
    return Z, H


def moved(axis: Axis, value: float) -> np.ndarray:
    """The pose (4, 4) of a frame moved along or about an axis."""
    H = np.eye(4)
    if axis.rotates:
        H[:3, :3] = Rotation.from_rotvec(value * axis.direction).as_matrix()
    else:
        H[:3, 3] = value * axis.direction
    return H
