"""Paths of muscles, and the surfaces that these wrap over."""

from __future__ import annotations

import warnings
from operator import mul

import numpy as np
from scipy.spatial.transform import Rotation

from ..numerics.curves import Curve
from ..path.functions import FunctionPath
from ..path.points import BEYOND_RANGE, ConditionalPathPoint, MovingPathPoint, PathPoint
from ..path.surfaces import (
    PathWrap,
    WrapCylinder,
    WrapEllipsoid,
    WrapSphere,
    WrapSurface,
    WrapTorus,
)
from .bodies import Bodies
from .element import Element
from .frames import Place, pose
from .function_paths import read_function_path
from .functions import Line, as_curve, read_function

FUNCTION = "FunctionBasedPath"
PATHS = ("GeometryPath", "path", FUNCTION)
POINTS, WRAPS = "PathPointSet", "PathWrapSet"
# Up to this version of the format points may lie in the muscle itself.
POINTS_INSIDE = 20301


def path_tags(muscle: Element) -> tuple[str, ...]:
    """What in a muscle is its path."""
    return (*PATHS, POINTS, WRAPS) if muscle.version <= POINTS_INSIDE else PATHS


def read_path(
    muscle: Element, bodies: Bodies
) -> tuple[list[PathPoint | MovingPathPoint] | FunctionPath, list[PathWrap]]:
    """The points and wraps of a muscle's path, or the function that it is."""
    function = _function(muscle)
    if function is not None:
        return read_function_path(function, bodies), []
    found = [_point(point, bodies) for point in _items(muscle, POINTS)]
    points = [point for point in found if point is not None]
    return points, [_wrap(wrap, bodies) for wrap in _items(muscle, WRAPS)]


def _function(element: Element) -> Element | None:
    """What is a muscle's path if that is a function of coordinates."""
    found = element.find(*PATHS)
    if found is not None and found.tag == "path":
        found = element.object("path")
    return found if found is not None and found.tag == FUNCTION else None


def _items(element: Element, tag: str) -> list[Element]:
    """Points or wraps of a muscle's path."""
    if element.version <= POINTS_INSIDE and element.find(*PATHS) is None:
        return element.items(tag)
    path = element.find("GeometryPath") or element.object("path")
    if path.tag != "GeometryPath":
        path.refuse()
    path.allow(POINTS, WRAPS)
    return path.items(tag)


def _point(element: Element, bodies: Bodies) -> PathPoint | MovingPathPoint | None:
    """A point of a path, None if a locked coordinate keeps it out."""
    if element.tag not in ("PathPoint", "ConditionalPathPoint", "MovingPathPoint"):
        element.refuse()
    frame = ("socket_parent_frame", "body")
    place = bodies.place(element.get(*frame))
    if element.tag == "MovingPathPoint":
        with element.blamed():
            return _moving_point(element, place, bodies)
    position = place.at(element.vector("location")).tolist()
    if element.tag == "PathPoint":
        element.allow(*frame, "location")
        return PathPoint(position, place.link)
    sockets = ("socket_coordinate", "coordinate", "coordinates")  # the last before version 2.1
    element.allow(*frame, "location", "range", *sockets)
    coordinate = _coordinate(element, *sockets)
    low, high = element.vector("range", 2)
    if coordinate in bodies.locked:
        inside = low - BEYOND_RANGE <= bodies.locked[coordinate] <= high + BEYOND_RANGE
        return PathPoint(position, place.link) if inside else None
    with element.blamed():
        return ConditionalPathPoint(
            position, place.link, coordinate=coordinate, range=(float(low), float(high))
        )


def _moving_point(element: Element, place: Place, bodies: Bodies) -> PathPoint | MovingPathPoint:
    """A point that moves with a coordinate, beyond whose range it stays where it is."""
    locations, coordinates = [f"{x}_location" for x in "xyz"], [f"{x}_coordinate" for x in "xyz"]
    sockets = [f"socket_{coordinate}" for coordinate in coordinates]
    # Before version 4 points that move had a location as well, which meant nothing.
    element.allow("socket_parent_frame", "body", "location", *locations, *coordinates, *sockets)
    ranges = {each.name: each.range for each in bodies.coordinates}
    functions, names = [], set()
    for location, *tags in zip(locations, sockets, coordinates, strict=True):
        function = read_function(element.object(location))
        if not (isinstance(function, Line) and function.slope == 0.0):
            name = _coordinate(element, *tags)
            if name not in ranges:
                raise element.get(*tags).error(f"there is no coordinate '{name}'")
            low, high = ranges[name]
            if name in bodies.locked or not low < high:
                value = min(max(bodies.locked.get(name, low), low), high)
                function = Line(0.0, float(as_curve(function)(value)))
            else:
                names.add(name)
        functions.append(function)
    if not names:
        position = [as_curve(function)(0.0) for function in functions]
        return PathPoint(place.at(np.array(position)).tolist(), place.link)
    if len(names) > 1:
        raise element.error(f"expected a point that moves with one coordinate, found {len(names)}")
    name = names.pop()
    low, high = ranges[name]
    curves = [as_curve(function) for function in functions]
    breaks = np.unique(np.concatenate([curve.pieces[1:, 0] for curve in curves]))
    breaks = np.array([low, *breaks[(breaks > low) & (breaks < high)], high])

    def component(row: int) -> Curve:
        *turn, shift = place.pose[row]
        return Curve(
            lambda q: sum(map(mul, turn, (c(q) for c in curves)), shift),
            breaks.tolist(),
            (0.0, 0.0),
        )

    x, y, z = (component(row) for row in range(3))
    return MovingPathPoint(x, y, z, place.link, coordinate=name)


def _coordinate(element: Element, *tags: str) -> str:
    """The coordinate that a point names, by its path or its name."""
    return element.word(*tags).split("/")[-1]


def _wrap(element: Element, bodies: Bodies) -> PathWrap:
    """A surface that a path wraps over."""
    element.allow("wrap_object", "method", "range")
    name = element.word("wrap_object")
    found = bodies.wraps.get(name, [])
    if len(found) != 1:
        raise element.error(f"expected one surface '{name}', found {len(found)}")
    first, last = (int(number) for number in element.vector("range", 2, (-1.0, -1.0)))
    # From 1, and less for both ends of the path.
    return PathWrap(_surface(*found[0]), max(first - 1, 0), last - 1 if last > 0 else -1)


def _angles(R: np.ndarray) -> np.ndarray:
    """Body-fixed angles about x, y and z; any of them where they are not unique."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Gimbal lock")
        return Rotation.from_matrix(R).as_euler("XYZ")


def _surface(element: Element, place: Place) -> WrapSurface:
    """A surface given in a frame."""
    sizes = {"WrapCylinder": ["radius", "length"], "WrapSphere": ["radius"]}
    sizes |= {"WrapEllipsoid": ["dimensions"], "WrapTorus": ["inner_radius", "outer_radius"]}
    if element.tag not in sizes:
        element.refuse()
    element.allow(
        "active", "xyz_body_rotation", "translation", "quadrant", "display_preference",
        *sizes[element.tag],
    )  # fmt: skip
    H = place.pose @ pose(element, "xyz_body_rotation", "translation")
    side = element.word("quadrant", default="all").lower().lstrip("+")
    where = {
        "link": place.link,
        "position": H[:3, 3],
        "rotation": _angles(H[:3, :3]),
        "side": None if side == "all" else side,
        "active": element.flag("active", True),
        "name": element.name,
    }
    with element.blamed():
        if element.tag == "WrapCylinder":
            return WrapCylinder(element.number("radius"), element.number("length"), **where)
        if element.tag == "WrapSphere":
            return WrapSphere(element.number("radius"), **where)
        if element.tag == "WrapTorus":
            radii = (element.number(name) for name in sizes["WrapTorus"])
            return WrapTorus(*radii, **where)
        return WrapEllipsoid(element.vector("dimensions").tolist(), **where)
