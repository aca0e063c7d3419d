"""What joints bear: forces and torques between their two bodies, whatever system they are of."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np


class JointFrame(Enum):
    """In whose axes a joint's load is written."""

    GROUND = "ground"
    PARENT = "parent"
    CHILD = "child"


class JointLoads(NamedTuple):
    """What the parents do to the children in k joints.

    Attributes
    ----------
    force, torque : (k, 3) ndarray
        On the child, about `center` [N, N m], in ground.
    center : (k, 3) ndarray
        The joint on its child [m], in ground.
    parent_center : (k, 3) ndarray
        The joint on its parent; what lies between them is the joint's translation.
    child, parent : (k, 3, 3) ndarray
        Orientations of their frames.
    """

    force: np.ndarray
    torque: np.ndarray
    center: np.ndarray
    parent_center: np.ndarray
    child: np.ndarray
    parent: np.ndarray

    def written(self, frame: JointFrame, on_parent: bool) -> np.ndarray:
        """Force, torque (k, 3) each on the child, or the opposite on the parent about its own
        center, in the axes of a frame, and in ground where they act: (k, 9)."""
        force, torque, center = self.force, self.torque, self.center
        if on_parent:
            way = center - self.parent_center
            force, torque = -force, -torque - np.cross(way, force)
            center = self.parent_center
        if frame is not JointFrame.GROUND:
            R = self.child if frame is JointFrame.CHILD else self.parent
            force, torque = (np.einsum("kji,kj->ki", R, x) for x in (force, torque))
        return np.concatenate([force, torque, center], axis=1)
