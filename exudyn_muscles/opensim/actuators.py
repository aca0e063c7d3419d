"""Ideal actuators: reserves on coordinates, residual forces and torques on bodies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..forces.actuators import Actuator, PointActuator, Reserve, TorqueActuator
from ..path.frames import GROUND
from .bodies import Bodies
from .element import ON, Element
from .frames import Place

COMMON = ("isDisabled", *ON, "min_control", "max_control", "optimal_force")
# Before this version of the format an actuator's first body was the one that it pushed against.
FIRST = 10905
OLD_POINT = {"body": "body_B", "point": "point_B", "direction": "direction_A"}
OLD_TORQUE = {"bodyA": "body_B", "bodyB": "body_A", "axis": "direction_A"}
# What these versions had beside them, which OpenSim does not read.
LEFT_OVER = ("body_A", "point_A", "max_force", "min_force")
ACTUATORS = ("CoordinateActuator", "PointActuator", "TorqueActuator")


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
        if element.tag == "TorqueActuator":
            return _torque_actuator(element, bodies, common)
        return _reserve(element, bodies, common)


def _reserve(element: Element, bodies: Bodies, common: dict[str, Any]) -> Reserve | None:
    element.allow(*COMMON, "coordinate")
    name = element.word("coordinate")
    independent = [link.name for link in bodies.links if link.follows is None]
    if name not in (*independent, *bodies.locked):
        raise element.get("coordinate").error(
            f"'{name}' is no independent coordinate, those are {', '.join(independent)}"
        )
    return None if name in bodies.locked else Reserve(name, **common)


def _point_actuator(
    element: Element, bodies: Bodies, common: dict[str, Any]
) -> PointActuator | None:
    is_old = element.version < FIRST
    names = OLD_POINT if is_old else {}
    element.allow(
        *COMMON, *(LEFT_OVER if is_old else ()), *names.values(),
        "body", "point", "point_is_global", "direction", "force_is_global",
    )  # fmt: skip
    place = _place(element, _named(element, "body", names), bodies)
    point = element.vector(_named(element, "point", names), default=(0, 0, 0))
    direction = element.vector(_named(element, "direction", names), default=(1, 0, 0))
    direction = -direction if is_old else direction
    point_is_global = element.flag("point_is_global")
    force_is_global = element.flag("force_is_global", is_old)
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


def _torque_actuator(
    element: Element, bodies: Bodies, common: dict[str, Any]
) -> TorqueActuator | None:
    is_old = element.version < FIRST
    names = OLD_TORQUE if is_old else {}
    element.allow(
        *COMMON, *(LEFT_OVER if is_old else ()), *names.values(),
        "bodyA", "bodyB", "torque_is_global", "axis",
    )  # fmt: skip
    place, other = (
        _place(element, _named(element, tag, names), bodies) for tag in ("bodyA", "bodyB")
    )
    axis = element.vector(_named(element, "axis", names), default=(0, 0, 1))
    axis = -axis if is_old else axis
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


def _named(element: Element, tag: str, old: Mapping[str, str]) -> str:
    """The old name of a property if it is called so."""
    return old[tag] if tag in old and element.find(old[tag]) is not None else tag


def _place(element: Element, tag: str, bodies: Bodies) -> Place:
    """The frame of the body that a property names."""
    element.word(tag)
    return bodies.place(element.get(tag))
