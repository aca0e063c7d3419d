"""Tracked quantities as rows of a table, as they are read from the items of an `mbs`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import exudyn as exu
import numpy as np

from ...checks import item_shown
from ...errors import ParameterError
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
from .frame_list import FrameList


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
            table[k, rows.FRAME_0] = _coordinate(mbs, what, one)
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
        _put_side(frames, what, row, side, int(marker), axes)


def _put_side(
    frames: FrameList, what: str, row: np.ndarray, side: int, marker: int, axes: np.ndarray
) -> None:
    """Write frame, point and axes of one of both markers."""
    frame, point, own = frames.place_of_marker(what, marker)
    row[(rows.FRAME_0, rows.FRAME_1)[side]] = frame
    row[(rows.POINT_0, rows.POINT_1)[side]] = point
    row[(rows.AXES_0, rows.AXES_1)[side]] = (own @ axes).ravel()


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
        _put_side(frames, what, row, side, marker, _axes_of(item, side))
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
