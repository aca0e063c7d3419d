"""Joints as axes one after the other, each with a function of a coordinate.

Translations along axes of the parent's frame come before rotations about axes that turn along.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..motion.coordinate import Coordinate
from ..numerics.curves import Curve
from .axes import Axis, axis_of_several
from .curved import CURVATURE, curved_axes
from .element import TWICE, UNKNOWN, Element
from .ellipsoids import RADII, WINGING, ellipsoid_axes
from .functions import SEVERAL, Line, as_curve, read_function, read_several

X, Y, Z = np.eye(3)


# Of every class: whether an axis rotates, its direction, and the number of its coordinate.
CLASSES: dict[str, tuple[tuple[bool, np.ndarray, int], ...]] = {
    "WeldJoint": (),
    "PinJoint": ((True, Z, 0),),
    "SliderJoint": ((False, X, 0),),
    "UniversalJoint": ((True, X, 0), (True, Y, 1)),
    "BallJoint": ((True, X, 0), (True, Y, 1), (True, Z, 2)),
    "GimbalJoint": ((True, X, 0), (True, Y, 1), (True, Z, 2)),
    "PlanarJoint": ((False, X, 1), (False, Y, 2), (True, Z, 0)),
    "FreeJoint": (
        (False, X, 3), (False, Y, 4), (False, Z, 5), (True, X, 0), (True, Y, 1), (True, Z, 2)
    ),
}  # fmt: skip
# Numbers of coordinates, of the joints on ellipsoids as well.
COUNTS = {kind: len(table) for kind, table in CLASSES.items()} | {
    "EllipsoidJoint": 3, "ScapulothoracicJoint": 4, "ConstantCurvatureJoint": 3
}  # fmt: skip
FRAMES = ("frames", "socket_parent_frame", "socket_child_frame")
OLD_FRAMES = (
    "parent_body", "location_in_parent", "orientation_in_parent", "location", "orientation",
    "reverse",
)  # fmt: skip
COORDINATES = ("coordinates", "CoordinateSet")
# Properties that only these classes have.
OWN = {
    "CustomJoint": ("SpatialTransform",), "ScapulothoracicJoint": WINGING,
    "ConstantCurvatureJoint": CURVATURE,
}  # fmt: skip
# Of a custom joint: translations come before rotations.
AXES = [f"{kind}{k}" for kind in ("translation", "rotation") for k in (1, 2, 3)]


def read_axes(joint: Element) -> tuple[list[Coordinate], list[Axis]]:
    """A joint's coordinates and axes."""
    custom = joint.tag == "CustomJoint"
    if not custom and joint.tag not in COUNTS:
        joint.refuse()
    own = OWN.get(joint.tag, ())
    joint.allow(*FRAMES, *OLD_FRAMES, *COORDINATES, RADII.get(joint.tag, ""), *own)
    members = [*joint.items("coordinates"), *joint.items("CoordinateSet")]
    coordinates = [_coordinate(member) for member in members]
    if not custom and len(coordinates) != COUNTS[joint.tag]:
        raise joint.error(f"expected {COUNTS[joint.tag]} coordinates, found {len(coordinates)}")
    if custom:
        axes = _custom_axes(joint, coordinates)
    elif joint.tag in RADII:
        axes = ellipsoid_axes(joint, coordinates)
    elif joint.tag == "ConstantCurvatureJoint":
        axes = curved_axes(joint, coordinates)
    else:
        line = Line(1.0, 0.0)
        axes = [
            Axis(rotates, direction, coordinates[k], line, joint)
            for rotates, direction, k in CLASSES[joint.tag]
        ]
    pure = [axis for axis in axes if axis.coordinate and axis.pure]
    turned, moved = (
        {axis.coordinate.name for axis in pure if axis.coordinate and axis.rotates == rotates}
        for rotates in (True, False)
    )
    path = joint_path(joint)
    known = [replace(each, rotates=each.name in turned - moved, joint=path) for each in coordinates]
    return known, axes


def joint_path(joint: Element) -> str:
    """A joint's path in OpenSim 4."""
    return f"/jointset/{joint.name}"


def _coordinate(element: Element) -> Coordinate:
    if element.tag != "Coordinate":
        element.refuse()
    element.allow(
        "motion_type", "default_value", "default_speed_value", "initial_value", "range", "clamped",
        "locked", "prescribed_function", "prescribed", "is_free_to_satisfy_constraints",
    )  # fmt: skip
    low, high = element.vector("range", 2, (-10.0, 10.0))
    return Coordinate(
        element.name,
        element.number("default_value", 0.0),
        element.number("default_speed_value", 0.0),
        (float(low), float(high)),
        element.flag("clamped"),
        element.flag("locked"),
        prescribed=_prescribed(element),
        follows_constraints=element.flag("is_free_to_satisfy_constraints"),
    )


def _prescribed(element: Element) -> Curve | None:
    """What a coordinate is moved by over time.

    Warns
    -----
    ModelFileWarning
        It is one that is.
    """
    given = element.flag("prescribed") and not element.flag("locked")
    if not given or not element.objects("prescribed_function"):
        return None
    element.get("prescribed").warn(
        "OpenSim moves this coordinate by its function; here an ideal actuator that costs next to "
        "nothing moves it, along a motion that takes the function's values"
    )
    return as_curve(read_function(element.object("prescribed_function")))


def _custom_axes(joint: Element, coordinates: list[Coordinate]) -> list[Axis]:
    transform = joint.get("SpatialTransform")
    transform.allow("TransformAxis")
    given: dict[str, Element] = {}
    for item in transform.children:
        if item.name not in AXES:
            item.warn(UNKNOWN)
        elif given.setdefault(item.name, item) is not item:
            item.warn(TWICE)
    # Those that are left out do not move.
    return [_custom_axis(given[name], coordinates) for name in AXES if name in given]


def _custom_axis(element: Element, coordinates: list[Coordinate]) -> Axis:
    function = element.object("function") if element.objects("function") else None
    element.allow("coordinates", "axis", "function", *([] if function is None else [function.tag]))
    direction = element.vector("axis", default=(1.0, 0.0, 0.0))
    length = np.linalg.norm(direction)
    if not length > 0.0:
        raise element.get("axis").error("its length is zero")
    names = element.word("coordinates", default="").split()
    known = {coordinate.name: coordinate for coordinate in coordinates}
    for name in names:
        if name not in known:
            raise element.get("coordinates").error(f"the joint has no coordinate '{name}'")
    found = [known[name] for name in names]
    rotates = element.name.startswith("rotation")
    if function is not None and (len(names) > 1 or function.tag == SEVERAL):
        several = read_several(function, len(names))
        return axis_of_several(rotates, direction / length, found, several, element)
    if len(names) > 1:
        raise element.error("several coordinates without a function of them")
    if function is None:  # OpenSim completes an empty function, one that is not there is zero
        is_there = element.find("function") is not None
        given: Line | Curve = Line(1.0 if names and is_there else 0.0, 0.0)
    else:
        given = read_function(function)
    if not names and not (isinstance(given, Line) and given.slope == 0.0):
        raise element.error("a function without a coordinate")
    linear = function is None or function.tag == "LinearFunction"
    pure = linear and isinstance(given, Line) and abs(given.slope) == 1.0
    return Axis(rotates, direction / length, found[0] if found else None, given, element, pure)
