"""Frames of bodies and markers, as they are read from an `mbs`."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import exudyn as exu
import numpy as np

from ...checks import BodyNumber, MarkerNumber, item_shown
from ...errors import ParameterError
from ...path.frames import GROUND
from .frames import (
    EULER_PARAMETERS,
    FIXED,
    MARKER,
    PLANE,
    PLANE_POINT,
    POINT,
    ROTATION_VECTOR,
    TAIT_BRYAN,
    FrameTables,
)

NODES = {
    "RigidBodyEP": EULER_PARAMETERS, "RigidBodyRxyz": TAIT_BRYAN,
    "RigidBodyRotVecLG": ROTATION_VECTOR, "RigidBody2D": PLANE, "Point": POINT,
    "Point2D": PLANE_POINT,
}  # fmt: skip
BODIES = ("RigidBody", "RigidBody2D", "MassPoint", "MassPoint2D")


class MarkerCoordinates(NamedTuple):
    """A marker, the numbers (k,) of the coordinates that move it, and whether it has an
    orientation."""

    marker: exu.MarkerIndex
    indices: np.ndarray
    turns: bool


class FrameList:
    """The frames that something is on, numbered in the order in which they are asked for."""

    def __init__(self, mbs: exu.MainSystem) -> None:
        self._mbs = mbs
        self._numbers: dict[tuple[str, int], int] = {}
        self._kinds: list[int] = []
        self._indices: list[np.ndarray] = []
        self._poses: list[np.ndarray] = []
        self.markers: list[tuple[int, exu.MarkerIndex, bool]] = []

    def number(self, what: str, link: int) -> int:
        """The number of the frame of a body, a marker or ground.

        Raises
        ------
        ParameterError
            There is no such item, or none with a frame; names what is on it.
        """
        if isinstance(link, BodyNumber):
            return self.of_body(what, int(link))
        if isinstance(link, MarkerNumber):
            return self.of_marker(what, int(link))
        if link == GROUND:
            return GROUND
        raise ParameterError(
            f"{what} is on link {link!r}, but the skeleton is a system of bodies: give the "
            "ObjectIndex of a body or the MarkerIndex of a marker (ground if left out)"
        )

    def of_body(self, what: str, number: int) -> int:
        """That of a body, as `number`."""
        item = self._item(what, number, self._mbs.GetObject, "object")
        kind = item["objectType"]
        if kind == "Ground":
            pose = np.column_stack(
                [np.reshape(item["referenceRotation"], (3, 3)), item["referencePosition"]]
            )
            return self._new(("object", number), FIXED, np.zeros(0, np.int64), pose)
        if kind not in BODIES:
            raise ParameterError(
                f"{what} is on object {number} '{item['name']}', a {kind}, which has no frame of "
                "its own: give the MarkerIndex of a marker on it"
            )
        return self._of_node(int(item["nodeNumber"]), f"{what} is on object {number}")

    def _of_node(self, node: int, what: str) -> int:
        kind = self._mbs.GetNode(node)["nodeType"]
        if kind not in NODES:
            raise ParameterError(f"{what}, whose node {node} is a {kind}, which has no frame")
        indices = np.array(self._mbs.systemData.GetNodeLTGODE2(node), dtype=np.int64)
        return self._new(("node", node), NODES[kind], indices)

    def of_marker(self, what: str, number: int) -> int:
        """That of a marker, as `number`."""
        self._item(what, number, self._mbs.GetMarker, "marker")
        key = ("marker", number)
        if key not in self._numbers:
            marker = exu.MarkerIndex(number)
            turns = self._rotates(what, marker)
            self.markers.append((len(self._kinds), marker, turns))
            self._new(key, MARKER, self._coordinates_of(what, marker))
        return self._numbers[key]

    def on_marker(self, what: str, number: int) -> MarkerCoordinates:
        """What a marker is on, without making a frame of it; raises as `number`."""
        self._item(what, number, self._mbs.GetMarker, "marker")
        marker = exu.MarkerIndex(number)
        return MarkerCoordinates(
            marker, self._coordinates_of(what, marker), self._rotates(what, marker)
        )

    def place_of_marker(self, what: str, number: int) -> tuple[int, np.ndarray, np.ndarray]:
        """A frame and the marker's position and axes in it; of a rigid body's marker the body's
        frame."""
        item = self._item(what, number, self._mbs.GetMarker, "marker")
        kind = item["markerType"]
        if kind in ("BodyRigid", "BodyPosition"):
            body = self._mbs.GetObject(item["bodyNumber"])
            if body["objectType"] in (*BODIES, "Ground"):
                local = np.zeros(3)
                local[: len(item["localPosition"])] = item["localPosition"]
                return self.of_body(what, int(item["bodyNumber"])), local, _own_axes(item)
        if kind in ("NodeRigid", "NodePosition"):
            node = int(item["nodeNumber"])
            if self._mbs.GetNode(node)["nodeType"] in NODES:
                return self._of_node(node, what), np.zeros(3), _own_axes(item)
        return self.of_marker(what, number), np.zeros(3), np.eye(3)

    def tables(self) -> tuple[FrameTables, np.ndarray, np.ndarray]:
        """The frames so far, and R, p where they do not move."""
        reference = self._mbs.systemData.GetODE2Coordinates(
            configuration=exu.ConfigurationType.Reference
        )
        starts = np.concatenate([[0], np.cumsum([len(one) for one in self._indices])])
        poses = np.array(self._poses).reshape(-1, 3, 4)
        tables = FrameTables(
            np.array(self._kinds, dtype=np.int64), starts.astype(np.int64),
            np.concatenate([*self._indices, np.zeros(0, np.int64)]).astype(np.int64),
            np.array(reference, dtype=float),
        )  # fmt: skip
        return tables, poses[:, :, :3].copy(), poses[:, :, 3].copy()

    def _new(
        self, key: tuple[str, int], kind: int, indices: np.ndarray, pose: np.ndarray | None = None
    ) -> int:
        if key not in self._numbers:
            self._numbers[key] = len(self._kinds)
            self._kinds.append(kind)
            self._indices.append(indices)
            self._poses.append(np.eye(3, 4) if pose is None else pose)
        return self._numbers[key]

    @staticmethod
    def _item(what: str, number: int, get: Callable[[int], dict], kind: str) -> dict:
        try:
            return get(number)
        except Exception as error:
            raise ParameterError(f"{what} is on {kind} {number}, which the mbs lacks") from error

    def _rotates(self, what: str, marker: exu.MarkerIndex) -> bool:
        """Whether a marker has an orientation; ParameterError if not even a position."""
        for needed in (exu.OutputVariableType.RotationMatrix, exu.OutputVariableType.Position):
            try:
                if np.size(self._mbs.GetMarkerOutput(marker, needed)) in (3, 9):
                    return needed is exu.OutputVariableType.RotationMatrix
            except Exception:  # what Exudyn raises where a marker lacks an output
                continue
        raise ParameterError(f"{what} is on {item_shown(marker)}, which has no position")

    def _coordinates_of(self, what: str, marker: exu.MarkerIndex) -> np.ndarray:
        item, data = self._mbs.GetMarker(marker), self._mbs.systemData
        for name, get in (
            ("bodyNumber", data.GetObjectLTGODE2), ("objectNumber", data.GetObjectLTGODE2),
            ("nodeNumber", data.GetNodeLTGODE2),
        ):  # fmt: skip
            if name in item:
                return np.array(get(int(item[name])), dtype=np.int64)
        raise ParameterError(
            f"{what} is on marker {int(marker)} '{item['name']}', a {item['markerType']}, which is "
            "on no single body or node"
        )


def _own_axes(marker: dict) -> np.ndarray:
    """The axes (3, 3) that a marker has on its body or node."""
    return np.array(marker.get("localHT", np.eye(4)), dtype=float).reshape(4, 4)[:3, :3]


def read_marker(
    mbs: exu.MainSystem, marker: exu.MarkerIndex, J: np.ndarray, R: np.ndarray | None
) -> np.ndarray:
    """A marker's current position (3,); its Jacobians are written into J (k, 6), and its
    orientation into R (3, 3) if it has one."""
    output, item, shape = mbs.GetMarkerOutput, mbs.ComputeItem, (3, len(J))
    J[:, :3] = np.reshape(item(marker, exu.ComputeItemType.PositionJacobian), shape).T
    J[:, 3:] = 0.0
    if R is not None:
        R[:] = np.reshape(output(marker, exu.OutputVariableType.RotationMatrix), (3, 3))
        J[:, 3:] = np.reshape(item(marker, exu.ComputeItemType.RotationJacobian), shape).T
    return np.asarray(output(marker, exu.OutputVariableType.Position))
