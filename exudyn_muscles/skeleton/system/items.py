"""Frames and tracked quantities as they are read from the items of an `mbs`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import exudyn as exu
import numpy as np

from ...checks import BodyNumber, MarkerNumber, item_shown
from ...errors import ModelError, ParameterError
from ...path.frames import GROUND
from . import measuring as rows
from .coordinates import (
    AXES,
    JointCoordinate,
    NodeCoordinate,
    RelativePosition,
    RelativeRotation,
    ScalarFunction,
    Tracked,
)
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

    def place_of_marker(self, what: str, number: int) -> tuple[int, np.ndarray]:
        """A frame and the marker's position in it; of a rigid body's marker the body's frame."""
        item = self._item(what, number, self._mbs.GetMarker, "marker")
        kind = item["markerType"]
        if kind in ("BodyRigid", "BodyPosition"):
            body = self._mbs.GetObject(item["bodyNumber"])
            if body["objectType"] in (*BODIES, "Ground"):
                local = np.zeros(3)
                local[: len(item["localPosition"])] = item["localPosition"]
                return self.of_body(what, int(item["bodyNumber"])), local
        if kind in ("NodeRigid", "NodePosition"):
            node = int(item["nodeNumber"])
            if self._mbs.GetNode(node)["nodeType"] in NODES:
                return self._of_node(node, what), np.zeros(3)
        return self.of_marker(what, number), np.zeros(3)

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


class TrackedRows(NamedTuple):
    """Tracked quantities: a `table` (n, 34) for `measure`, FUNCTION rows by their number in it, and
    `units` (n,)."""

    table: np.ndarray
    functions: dict[int, ScalarFunction]
    units: tuple[str, ...]


def tracked_rows(
    mbs: exu.MainSystem,
    frames: FrameList,
    tracked: Mapping[str, Tracked | exu.ObjectIndex],
) -> TrackedRows:
    """What is tracked, checked against the `mbs`.

    Raises
    ------
    ParameterError
        Names the coordinate, and the item that does not serve it.
    """
    table = np.zeros((len(tracked), rows.COLUMNS))
    functions, units = {}, []
    for k, (name, one) in enumerate(tracked.items()):
        what = f"coordinate '{name}'"
        if isinstance(one, exu.ObjectIndex):
            one = JointCoordinate(one)
        if isinstance(one, JointCoordinate):
            units.append(_joint(mbs, frames, what, one, table[k]))
        elif isinstance(one, RelativeRotation):
            _between(frames, what, one, table[k], _turned_to(np.array(one.axis), 2))
            _angle(table[k], ((1, 0, 1.0), (0, 0, 1.0)))
            units.append("rad")
        elif isinstance(one, RelativePosition):
            _between(frames, what, one, table[k], _turned_to(np.array(one.axis), 0))
            table[k, rows.KIND], table[k, rows.AXIS] = rows.DISPLACEMENT, 0
            units.append("m")
        elif isinstance(one, NodeCoordinate):
            table[k, rows.KIND] = rows.COORDINATE
            table[k, rows.FRAMES] = _coordinate(mbs, what, one), GROUND
            units.append(one.unit)
        elif isinstance(one, ScalarFunction):
            table[k, rows.KIND] = rows.FUNCTION
            functions[k] = one
            units.append(one.unit)
        else:
            raise ParameterError(
                f"{what} is the ObjectIndex of a joint, a JointCoordinate, RelativeRotation, "
                f"RelativePosition, NodeCoordinate or ScalarFunction, got {item_shown(one)}"
            )
    return TrackedRows(table, functions, tuple(units))


def _coordinate(mbs: exu.MainSystem, what: str, one: NodeCoordinate) -> int:
    try:
        own = mbs.systemData.GetNodeLTGODE2(one.node)
    except Exception as error:
        raise ParameterError(f"{what}: the mbs has no node {int(one.node)}") from error
    if not 0 <= one.index < len(own):
        raise ParameterError(
            f"{what}: node {int(one.node)} '{mbs.GetNode(one.node)['name']}' has the coordinates "
            f"0 to {len(own) - 1}, got {one.index}"
        )
    return int(own[one.index])


def _between(
    frames: FrameList,
    what: str,
    one: RelativeRotation | RelativePosition,
    row: np.ndarray,
    axes: np.ndarray,
) -> None:
    """Frames, points and axes of what lies between two markers."""
    for side, marker in enumerate((one.marker_0, one.marker_1)):
        row[1 + side], row[rows.POINTS[side]] = frames.place_of_marker(what, int(marker))
        row[rows.AXES[side]] = axes.ravel()


def _turned_to(axis: np.ndarray, column: int) -> np.ndarray:
    """A rotation one of whose columns is an axis."""
    others = np.linalg.svd(axis[None])[2][1:]
    turned = np.roll(np.column_stack([axis, *others]), column, axis=1)
    turned[:, (column + 1) % 3] *= np.sign(np.linalg.det(turned))
    return turned


def _angle(row: np.ndarray, entries: tuple[tuple[int, int, float], ...]) -> None:
    """The angle atan2 of two entries of the relative rotation, each with its sign."""
    row[rows.KIND], row[rows.ENTRIES] = rows.ANGLE, np.ravel(entries)


# The entries of R_x R_y R_z by which an angle is known where only these rotations are free.
ANGLES = {
    ("rx",): {"rx": ((2, 1, 1.0), (1, 1, 1.0))},
    ("ry",): {"ry": ((0, 2, 1.0), (2, 2, 1.0))},
    ("rz",): {"rz": ((1, 0, 1.0), (0, 0, 1.0))},
    ("rx", "ry"): {"rx": ((2, 1, 1.0), (1, 1, 1.0)), "ry": ((0, 2, 1.0), (0, 0, 1.0))},
    ("ry", "rz"): {"ry": ((0, 2, 1.0), (2, 2, 1.0)), "rz": ((1, 0, 1.0), (1, 1, 1.0))},
    ("rx", "rz"): {"rx": ((1, 2, -1.0), (2, 2, 1.0)), "rz": ((0, 1, -1.0), (0, 0, 1.0))},
    ("rx", "ry", "rz"): {"rx": ((1, 2, -1.0), (2, 2, 1.0)), "rz": ((0, 1, -1.0), (0, 0, 1.0))},
}  # fmt: skip


def _joint(
    mbs: exu.MainSystem, frames: FrameList, what: str, one: JointCoordinate, row: np.ndarray
) -> str:
    """A joint's free axis as a row; returns its unit."""
    number = int(one.joint)
    try:
        item = mbs.GetObject(number)
    except Exception as error:
        raise ParameterError(f"{what}: the mbs has no object {number}") from error
    shown = f"object {number} '{item['name']}', a {item['objectType']}"
    free = _free_axes(item)
    if not free:
        raise ParameterError(f"{what}: {shown}, is no joint with a free axis")
    axis = one.axis or (free[0] if len(free) == 1 else "")
    if axis not in free:
        given = f"not {one.axis}" if one.axis else "so that JointCoordinate needs its axis="
        raise ParameterError(f"{what}: free axes of {shown}, are {', '.join(free)}, {given}")
    for side in range(2):
        marker = int(item["markerNumbers"][side])
        row[1 + side], row[rows.POINTS[side]] = frames.place_of_marker(what, marker)
        row[rows.AXES[side]] = _axes_of(item, side).ravel()
    if axis[0] == "t":
        row[rows.KIND], row[rows.AXIS] = rows.DISPLACEMENT, "xyz".index(axis[1])
        return "m"
    rotations = tuple(name for name in free if name[0] == "r")
    if rotations == ("rx", "ry", "rz") and axis == "ry":
        row[rows.KIND] = rows.SLOPE
    else:
        _angle(row, ANGLES[rotations][axis])
    return "rad"


def _free_axes(item: dict) -> tuple[str, ...]:
    """Those of a joint, empty if the object is none."""
    kind = item["objectType"]
    if kind == "JointGeneric":
        locked = item["constrainedAxes"]
        return tuple(axis for axis, lock in zip(AXES, locked, strict=True) if not lock)
    return {
        "JointRevoluteZ": ("rz",), "JointPrismaticX": ("tx",), "JointRevolute2D": ("rz",),
        "JointPrismatic2D": ("tx",), "JointSpherical": ("rx", "ry", "rz"),
    }.get(kind, ())  # fmt: skip


def _axes_of(item: dict, side: int) -> np.ndarray:
    """A joint's axes (3, 3) in the frame of one of its markers."""
    if item["objectType"] == "JointPrismatic2D":
        x, y = np.asarray(item["axisMarker0"], dtype=float) / np.linalg.norm(item["axisMarker0"])
        return np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]])
    given = item.get(f"rotationMarker{side}")
    return np.eye(3) if given is None else np.array(given, dtype=float).reshape(3, 3)


def force_object(mbs: exu.MainSystem) -> tuple[exu.ObjectIndex, np.ndarray]:
    """The object by which generalized forces get into a system, and its coordinates there.

    It has the name of this package, no mass, and no force but in a run. The first model of a system
    adds it; Exudyn assembles anew, and the state is as before.
    """
    name, data = "exudyn_muscles", mbs.systemData
    nodes = [k for k in range(data.NumberOfNodes()) if len(data.GetNodeLTGODE2(k))]
    if not nodes:
        raise ModelError("the mbs has no node with coordinates: there is nothing that can move")
    for number in range(data.NumberOfObjects()):
        item = mbs.GetObject(number)
        if item["objectType"] == "GenericODE2" and item["name"] == name:
            if [int(node) for node in item["nodeNumbers"]] != nodes:
                raise ModelError(
                    f"the mbs has got other nodes since object {number} '{name}' was added to it: "
                    "build it and its model anew"
                )
            found = exu.ObjectIndex(number)
            break
    else:
        kinds = (exu.ConfigurationType.Initial, exu.ConfigurationType.Current)
        states = [(kind, data.GetSystemState(kind)) for kind in kinds]
        size, time = data.ODE2Size(), data.GetTime()
        found = mbs.AddObject(
            {
                "objectType": "GenericODE2", "name": name, "nodeNumbers": nodes,
                "forceVector": np.zeros(size), "Vshow": False,
            }
        )  # fmt: skip
        mbs.Assemble()
        for kind, state in states:
            data.SetSystemState(state, kind)
        data.SetTime(time)
    return found, np.array(data.GetObjectLTGODE2(found), dtype=np.int64)
