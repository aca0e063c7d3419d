"""Constraints of a model that close loops of its tree."""

from __future__ import annotations

import numpy as np

from ..skeleton.closures import Closure, ClosureKind
from .bodies import Bodies
from .couplers import COUPLER
from .element import ON, Element
from .frames import ZERO, Place, Z, aligned
from .linkers import LINKED, linked_frames

SWITCHES = ("isDisabled", *ON)
POINTS = tuple(f"{what}body_{k}" for k in (1, 2) for what in ("socket_", "", "location_"))


def read_closures(model: Element, bodies: Bodies) -> list[Closure]:
    """The constraints of a model that are on, without couplers of coordinates.

    Those between bodies that cannot move against each other are left out: OpenSim's results do not
    depend on them.
    """
    found = []
    for item in model.items("ConstraintSet"):
        if item.tag == COUPLER or not item.is_on:
            continue
        if item.tag not in READERS:
            item.refuse()
        with item.blamed():
            closure = READERS[item.tag](item, bodies)
        if closure.link_0 != closure.link_1:
            found.append(closure)
    return found


def _distance(element: Element, bodies: Bodies) -> Closure:
    element.allow(*SWITCHES, *POINTS, "constant_distance")
    return _between_points(
        element, bodies, ClosureKind.DISTANCE, element.number("constant_distance")
    )


def _point(element: Element, bodies: Bodies) -> Closure:
    element.allow(*SWITCHES, *POINTS)
    return _between_points(element, bodies, ClosureKind.POINT)


def _between_points(
    element: Element, bodies: Bodies, kind: ClosureKind, distance: float = 0.0
) -> Closure:
    places = [_on_body(element, bodies, f"body_{k}", f"location_body_{k}") for k in (1, 2)]
    return _closure(element, kind, places, distance)


def _line(element: Element, bodies: Bodies) -> Closure:
    names = ("line_body", "follower_body")
    direction = element.vector("line_direction_vec", default=ZERO)
    length = np.linalg.norm(direction)
    if not length > 0.0:
        raise element.error("line_direction_vec has no length")
    element.allow(
        *SWITCHES, *names, *(f"socket_{name}" for name in names), "line_direction_vec",
        "point_on_line", "point_on_follower",
    )  # fmt: skip
    line, follower = (
        _on_body(element, bodies, name, point)
        for name, point in zip(names, ("point_on_line", "point_on_follower"), strict=True)
    )
    # The closure's line is its frame's z axis.
    number, turn = aligned(direction / length)
    turn[:3, :3] = np.roll(turn[:3, :3], Z - number, axis=1)
    return _closure(element, ClosureKind.LINE, [Place(line.link, line.pose @ turn), follower])


def _weld(element: Element, bodies: Bodies) -> Closure:
    element.allow(*SWITCHES, *LINKED)
    return _closure(element, ClosureKind.WELD, linked_frames(element, bodies, "/constraintset"))


def _on_body(element: Element, bodies: Bodies, body: str, point: str) -> Place:
    """A frame at a point of a body.

    OpenSim takes the point in the frame of the body that the named frame is on, wherever it is
    there.
    """
    path = f"/constraintset/{element.name}"
    place = bodies.body_of(element.get(f"socket_{body}", body), path)
    at = np.eye(4)
    at[:3, 3] = element.vector(point, default=ZERO)
    return Place(place.link, place.pose @ at)


def _closure(
    element: Element, kind: ClosureKind, places: list[Place], distance: float = 0.0
) -> Closure:
    (link_0, frame_0), (link_1, frame_1) = places
    return Closure(kind, link_0, link_1, frame_0.tolist(), frame_1.tolist(), distance, element.name)


READERS = {
    "ConstantDistanceConstraint": _distance,
    "PointConstraint": _point,
    "PointOnLineConstraint": _line,
    "WeldConstraint": _weld,
}
