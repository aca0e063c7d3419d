"""Ideal actuators: reserves on coordinates, residual forces and torques on bodies."""

from __future__ import annotations

import math
from typing import Any

from ..forces.actuators import Actuator, PathActuator, PointActuator, Reserve, TorqueActuator
from ..path.frames import GROUND
from ..path.points import PathPoint
from .bodies import Bodies
from .document import TURNED
from .element import ON, Element
from .frames import Place
from .paths import path_tags, read_path

COMMON = ("isDisabled", *ON, "min_control", "max_control", "optimal_force")
# With an activation that follows the control by a time constant.
SLOWER = "ActivationCoordinateActuator"
ACTUATORS = (
    "CoordinateActuator", "PointActuator", "TorqueActuator", "PathActuator", "PointToPointActuator",
    SLOWER,
)  # fmt: skip


def read_actuator(element: Element, bodies: Bodies) -> Actuator | None:
    """An ideal actuator of a file, None if what it acts on cannot move."""
    common: dict[str, Any] = {
        "name": element.name,
        "optimal_force": element.number("optimal_force", 1.0),
        "min_control": element.number("min_control", -math.inf, infinite=True),
        "max_control": element.number("max_control", math.inf, infinite=True),
    }
    with element.blamed():
        if element.tag == "PointActuator":
            return _point_actuator(element, bodies, common)
        if element.tag == "PathActuator":
            element.allow(*COMMON, *path_tags(element))
            path, wraps = read_path(element, bodies)
            return PathActuator(path=path, wraps=wraps, **common)
        if element.tag == "PointToPointActuator":
            return _between_points(element, bodies, common)
        if element.tag == "TorqueActuator":
            return _torque_actuator(element, bodies, common)
        return _reserve(element, bodies, common)


def _reserve(element: Element, bodies: Bodies, common: dict[str, Any]) -> Reserve | None:
    slow = ("activation_time_constant", "default_activation") if element.tag == SLOWER else ()
    if slow:
        tau = element.number("activation_time_constant", 0.01)
        element.warn(f"its force follows its control at once here, in OpenSim within {tau:g} s")
    element.allow(*COMMON, "coordinate", *slow)
    name = element.word("coordinate")
    known = [coordinate.name for coordinate in bodies.coordinates]
    if name not in known:
        raise element.get("coordinate").error(
            f"there is no coordinate '{name}', those are {', '.join(known)}"
        )
    return None if name in bodies.locked else Reserve(name, **common)


def _point_actuator(
    element: Element, bodies: Bodies, common: dict[str, Any]
) -> PointActuator | None:
    is_old = element.version < TURNED
    # What it pushed against, which OpenSim no longer reads.
    other = element.find("body_A")
    against_ground = is_old and other is not None and other.text in ("", "ground")
    element.allow(
        *COMMON, "body", "point", "point_is_global", "direction", "force_is_global",
        *(("body_A", "point_A") if against_ground else ()),
    )  # fmt: skip
    place = _place(element, "body", bodies)
    point = element.vector("point", default=(0, 0, 0))
    direction = element.vector("direction", default=(1, 0, 0)) * (-1.0 if is_old else 1.0)
    point_is_global = element.flag("point_is_global")
    force_is_global = element.flag("force_is_global", is_old)  # its default then
    if place.link == GROUND:
        return None
    if not point_is_global:
        point = place.at(point)
    if not force_is_global:
        direction = place.pose[:3, :3] @ direction
    return PointActuator(
        link=place.link,
        point=point.tolist(),
        direction=direction.tolist(),
        point_is_global=point_is_global,
        force_is_global=force_is_global,
        **common,
    )


def _between_points(
    element: Element, bodies: Bodies, common: dict[str, Any]
) -> PathActuator | None:
    element.allow(*COMMON, "bodyA", "bodyB", "points_are_global", "pointA", "pointB")
    if element.flag("points_are_global"):
        element.get("points_are_global").refuse()
    places = [_place(element, f"body{end}", bodies) for end in "AB"]
    if places[0].link == places[1].link:
        return None
    path = [
        PathPoint(place.at(element.vector(f"point{end}", default=(0, 0, 0))).tolist(), place.link)
        for end, place in zip("AB", places, strict=True)
    ]
    return PathActuator(path=path, pushes=True, **common)


def _torque_actuator(
    element: Element, bodies: Bodies, common: dict[str, Any]
) -> TorqueActuator | None:
    element.allow(*COMMON, "bodyA", "bodyB", "torque_is_global", "axis")
    place, other = (_place(element, tag, bodies) for tag in ("bodyA", "bodyB"))
    is_old = element.version < TURNED
    axis = element.vector("axis", default=(0, 0, 1)) * (-1.0 if is_old else 1.0)
    is_global = element.flag("torque_is_global", True)
    if not is_global:
        axis = place.pose[:3, :3] @ axis
    link, against = place.link, other.link
    if link == GROUND:  # whose frame is ground's
        link, against, axis, is_global = against, link, -axis, True
    if link == against:  # both are ground, or welded to one another
        return None
    return TorqueActuator(
        link=link, against=against, axis=axis.tolist(), torque_is_global=is_global, **common
    )


def _place(element: Element, tag: str, bodies: Bodies) -> Place:
    """The frame of the body that a property names."""
    element.word(tag)
    return bodies.place(element.get(tag))
