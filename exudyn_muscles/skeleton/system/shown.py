"""What is seen of a system of bodies and joints, at Exudyn's visualization state."""

from __future__ import annotations

import exudyn as exu
import numpy as np
from exudyn import graphics

from ..segments import Segment, Segments, body_poses
from ..shown import VISUALIZATION, OwnGraphics, coordinates_shown
from .frame_list import BODIES, FrameList
from .measuring import measure_pose
from .tracked_rows import TrackedRows

POSITION = exu.OutputVariableType.Position
AUTOMATIC = np.array(graphics.color.defaultBody)


def frames_shown(
    mbs: exu.MainSystem, frames: FrameList, tracked: TrackedRows, near: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """R (f, 3, 3), p (f, 3) and z (n,); functions of the user's have the values of `near`, or
    their current ones."""
    x, n, (tables, R, p) = coordinates_shown(mbs), len(tracked.units), frames.tables()
    for k, marker, turns in frames.markers:
        p[k] = mbs.GetMarkerOutput(marker, POSITION, VISUALIZATION)
        if turns:
            rotation = exu.OutputVariableType.RotationMatrix
            R[k] = np.reshape(mbs.GetMarkerOutput(marker, rotation, VISUALIZATION), (3, 3))
    J, z, T = np.zeros((tables.indices.size, 6)), np.empty(n), np.empty((n, x.size))
    turns_from = np.zeros(n) if near is None else near
    measure_pose(tracked.table, *tables, x, turns_from, R, p, J, z, T)
    for k, function in tracked.functions.items():
        z[k] = function.value(mbs) if near is None else near[k]
    return R, p, z


def system_graphics(mbs: exu.MainSystem) -> OwnGraphics:
    """Bodies that the user gave graphics to keep them. Those without any, or with no more than the
    shape that `CreateRigidBody` makes of an inertia, are drawn as limbs, without their joints."""
    joints, limbs, replaced, corners = _joints(mbs), [], [], []
    for number in range(mbs.systemData.NumberOfObjects()):
        item = mbs.GetObject(number, True)
        if item["objectType"] not in BODIES:
            continue
        own = item["VgraphicsData"]
        automatic = _is_automatic(own)
        corners += [(number, corner, automatic) for corner in _corners(own)]
        if item.get("VgraphicsDataUserFunction") or (own and not automatic):
            continue
        limbs.append(number)
        places = ("body", number), ("node", _node(item))
        replaced += [number, *(joint for joint, on, _ in joints if on in places)]

    def at(number: int, point: np.ndarray) -> np.ndarray:
        return mbs.GetObjectOutputBody(exu.ObjectIndex(number), POSITION, point, VISUALIZATION)

    def outline(alone: bool) -> np.ndarray:
        seen = [corner[:2] for corner in corners if alone or not corner[2]]
        return np.reshape([at(*corner) for corner in seen], (-1, 3))

    return OwnGraphics(tuple(limbs), tuple(dict.fromkeys(replaced)), outline)


def system_segments(mbs: exu.MainSystem) -> Segments:
    """The bodies of a system with their joints, where they are at the visualization state."""
    joints, numbers, bodies = _joints(mbs), [], []
    for number in range(mbs.systemData.NumberOfObjects()):
        if mbs.GetObject(number)["objectType"] in BODIES:
            numbers.append(number)
    for number, pose in zip(numbers, body_poses(mbs, numbers), strict=True):
        item = mbs.GetObject(number)
        places = [
            mbs.GetMarkerOutput(marker, POSITION, VISUALIZATION)
            for _, on, marker in joints
            if on in (("body", number), ("node", _node(item)))
        ]
        centers = (np.reshape(places, (-1, 3)) - pose[:3, 3]) @ pose[:3, :3]
        bodies.append(Segment(number, item["mass"], _center(item), _tensor(item), centers, None))
    return Segments(tuple(bodies), lambda: body_poses(mbs, numbers))


def _tensor(body: dict) -> np.ndarray:
    """The inertia (3, 3) about the center of mass; of a planar body about the axis that it has."""
    given = np.atleast_1d(body.get("inertia", 0.0))
    if given.size != 6:
        return np.diag([0.0, 0.0, given[0]])
    xx, yy, zz, yz, xz, xy = given
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    c = _center(body)
    return tensor - body["mass"] * ((c @ c) * np.eye(3) - np.outer(c, c))


def _joints(mbs: exu.MainSystem) -> list[tuple[int, tuple[str, int], exu.MarkerIndex]]:
    """Joints, what they are on, and their markers there."""
    found = []
    for number in range(mbs.systemData.NumberOfObjects()):
        item = mbs.GetObject(number)
        if not item["objectType"].startswith("Joint"):
            continue
        for marker in map(int, item["markerNumbers"]):
            place = mbs.GetMarker(marker)
            for kind in ("body", "node"):
                if f"{kind}Number" in place:
                    on = kind, int(place[f"{kind}Number"])
                    found.append((number, on, exu.MarkerIndex(marker)))
    return found


def _node(body: dict) -> int:
    return int(body["nodeNumber"])


def _center(body: dict) -> np.ndarray:
    """The center of mass in a body's frame."""
    center = np.zeros(3)
    given = body.get("centerOfMass", ())
    center[: len(given)] = given
    return center


def _is_automatic(own: list[dict]) -> bool:
    """Whether these are a single part in the color that Exudyn takes for bodies without one."""
    colors = [np.reshape(part.get("colors", ()), (-1, 4)) for part in own]
    return len(own) == 1 and len(colors[0]) > 0 and np.allclose(colors[0], AUTOMATIC)


def _corners(own: list[dict]) -> np.ndarray:
    """Corners (8, 3) of the box around graphics and origin in a body's frame."""
    parts = [np.reshape(one["points"], (-1, 3)) for one in own if "points" in one]
    points = np.vstack([np.zeros((1, 3)), *parts])
    box = np.array([points.min(axis=0), points.max(axis=0)])
    choices = np.indices((2, 2, 2)).reshape(3, 8).T
    return box[choices, np.arange(3)]
