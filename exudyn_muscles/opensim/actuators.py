"""Ideal actuators: reserves on coordinates, residual forces and torques on bodies."""

from __future__ import annotations

import math
from typing import Any

from ..errors import ParameterError
from ..path.tree import GROUND
from ..recruitment.actuators import Actuator, PointActuator, Reserve, TorqueActuator
from .bodies import Bodies
from .document import ON, Element

COMMON = ("isDisabled", *ON, "min_control", "max_control", "optimal_force")
ACTUATORS = ("CoordinateActuator", "PointActuator", "TorqueActuator")


def read_actuator(element: Element, bodies: Bodies) -> Actuator:
    """An ideal actuator of a file.

    Raises
    ------
    ModelFileError
        Something is damaged or cannot be represented; names it.
    """
    common: dict[str, Any] = {
        "name": element.name,
        "optimal_force": element.number("optimal_force", 1.0),
        "min_control": element.number("min_control", -math.inf, infinite=True),
        "max_control": element.number("max_control", math.inf, infinite=True),
    }
    try:
        if element.tag == "PointActuator":
            return _point_actuator(element, bodies, common)
        if element.tag == "TorqueActuator":
            return _torque_actuator(element, bodies, common)
        element.allow(*COMMON, "coordinate")
        return Reserve(element.word("coordinate"), **common)
    except ParameterError as error:
        raise element.error(str(error)) from None


def _point_actuator(element: Element, bodies: Bodies, common: dict[str, Any]) -> PointActuator:
    element.allow(*COMMON, "body", "point", "point_is_global", "direction", "force_is_global")
    place = bodies.place(element.get("body"))
    if place.link == GROUND:
        raise element.get("body").error("ground does not move")
    point = element.vector("point", default=(0, 0, 0))
    direction = element.vector("direction")
    point_is_global = element.flag("point_is_global")
    force_is_global = element.flag("force_is_global")
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


def _torque_actuator(element: Element, bodies: Bodies, common: dict[str, Any]) -> TorqueActuator:
    element.allow(*COMMON, "bodyA", "bodyB", "torque_is_global", "axis")
    place = bodies.place(element.get("bodyA"))
    against = bodies.place(element.get("bodyB")).link if element.word("bodyB", default="") else -1
    axis, is_global = (
        element.vector("axis", default=(0, 0, 1)),
        element.flag("torque_is_global", True),
    )
    if not is_global:
        axis = place.pose[:3, :3] @ axis
    link = place.link
    if link == GROUND:  # whose frame is ground's
        link, against, axis, is_global = against, link, -axis, True
    if link == GROUND:
        raise element.get("bodyA").error("ground does not move, and nor does bodyB")
    return TorqueActuator(
        link=link, against=against, axis=axis.tolist(), torque_is_global=is_global, **common
    )
