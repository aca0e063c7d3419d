"""What the joints of a system of bodies bear: the forces of their constraints.

With the multipliers mu of the `ConstrainedEquations` a joint does G_j^T mu_j to the coordinates of
its bodies, and with the Jacobian J of the marker on its second one, that is J^T of a force and a
torque there. A force along the tracked axis of a joint is added to it, as it acts between the same
two bodies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import exudyn as exu
import numpy as np

from ...errors import ModelError
from ..joints import JointLoads
from .coordinates import JointCoordinate, Tracked
from .frame_list import FrameList, MarkerCoordinates, read_marker
from .geometry import Pose
from .opened import OpenedSystem


class SystemJoint(NamedTuple):
    """A joint of the `mbs`.

    Attributes
    ----------
    name : str
        Of its object, or of what is tracked of it if that is one coordinate.
    coordinates : tuple of str
        What is tracked of it.
    number : int
        Of its object.
    """

    name: str
    coordinates: tuple[str, ...]
    number: int


def system_joints(
    mbs: exu.MainSystem, tracked: Mapping[str, Tracked | exu.ObjectIndex]
) -> list[SystemJoint]:
    """All joints between two markers that have a position."""
    own: dict[int, list[str]] = {}
    for name, what in tracked.items():
        joint = what.joint if isinstance(what, JointCoordinate) else what
        if isinstance(joint, exu.ObjectIndex):
            own.setdefault(int(joint), []).append(name)
    found = []
    for number in range(mbs.systemData.NumberOfObjects()):
        item = mbs.GetObject(number)
        if item["objectType"].startswith("Joint") and len(item["markerNumbers"]) == 2:
            names = tuple(own.get(number, ()))
            found.append(SystemJoint(names[0] if len(names) == 1 else item["name"], names, number))
    return found


class SystemJointLoads:
    """Loads of joints of a system at its current state.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    joints : sequence of SystemJoint
    names : sequence of str
        Of the tracked coordinates.

    Raises
    ------
    ParameterError
        A joint's marker has no position.
    """

    def __init__(
        self,
        mbs: exu.MainSystem,
        joints: Sequence[SystemJoint],
        names: Sequence[str],
    ) -> None:
        self._mbs, data, frames = mbs, mbs.systemData, FrameList(mbs)
        self._rows = [np.array(data.GetObjectLTGAE(joint.number)) for joint in joints]
        self._own = [[names.index(name) for name in joint.coordinates] for joint in joints]
        self._sides = [
            [
                frames.on_marker(f"joint '{joint.name}'", int(marker))
                for marker in mbs.GetObject(joint.number)["markerNumbers"]
            ]
            for joint in joints
        ]
        for joint, (parent, child) in zip(joints, self._sides, strict=True):
            if np.intersect1d(parent.indices, child.indices).size:
                raise ModelError(
                    f"joint loads: '{joint.name}' lies between two parts of one object; what it "
                    "bears cannot be told from what that object bears inside"
                )

    def __call__(
        self, system: OpenedSystem, pose: Pose, load: np.ndarray, ideal: np.ndarray
    ) -> JointLoads:
        """Under forces `load` (N,) on the coordinates, in which the tracked ones have `ideal` (n,)
        from reserves of their own."""
        of_constraints = system.constraint_forces(load)
        found = []
        for rows, own, (parent, child) in zip(self._rows, self._own, self._sides, strict=True):
            acting = of_constraints[rows].sum(axis=0) + ideal[own] @ pose.T[own]
            p_0, R_0, parent_force = _wrench(self._mbs, parent, acting)
            p_1, R_1, force = _wrench(self._mbs, child, acting)
            if not child.indices.size:
                force = -parent_force
                force[3:] -= np.cross(p_0 - p_1, parent_force[:3])
            found.append((force[:3], force[3:], p_1, p_0, R_1, R_0))
        each = zip(*found, strict=True) if found else [()] * 6
        shapes = [(-1, 3)] * 4 + [(-1, 3, 3)] * 2
        return JointLoads(*(np.array(x).reshape(s) for x, s in zip(each, shapes, strict=True)))


def _wrench(
    mbs: exu.MainSystem, marker: MarkerCoordinates, acting: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position and orientation of a marker, and the force and torque (6,) there that are these
    generalized forces (N,) on its coordinates."""
    J, R = np.zeros((marker.indices.size, 6)), np.eye(3)
    p = read_marker(mbs, marker.marker, J, R if marker.turns else None)
    force = np.linalg.lstsq(J, acting[marker.indices], rcond=None)[0]
    return p, R, force
