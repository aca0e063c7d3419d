"""Joints that slide on an ellipsoid, as axes one after the other.

With semi-axes a, b, c along e_1, e_2, e_3 and angles x, y, z about them, the joint's frame, turned
by R = R_1(x) R_2(y) R_3(z), is where the ellipsoid's normal is its third axis:

    (a sin y, -b sin x cos y, c cos x cos y).

R_1(x) R_2(y) carries c e_3 to c (sin y, -sin x cos y, cos x cos y), and what a and b are more than
c is added: along e_1 by a function of y, and along e_2, with u = (b - c) cos y, by

    R_1(x) T_3(u/2) R_1(-2 x) T_3(-u/2) R_1(x),    a shift by -u sin x along e_2.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..motion.coordinate import Coordinate
from ..numerics.curves import Curve
from .axes import Axis
from .element import Element
from .functions import POLYNOMIAL_BREAKS, Line

RADII = {
    "EllipsoidJoint": "radii_x_y_z",
    "ScapulothoracicJoint": "thoracic_ellipsoid_radii_x_y_z",
}
WINGING = ("scapula_winging_axis_origin", "scapula_winging_axis_direction")
# The scapula turns about these axes of the thorax: abduction about y, elevation about -x.
SCAPULA = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def ellipsoid_axes(joint: Element, coordinates: list[Coordinate]) -> list[Axis]:
    """The axes of a joint whose class is among `RADII`, with its 3 or 4 coordinates."""
    tag = RADII[joint.tag]
    radii = joint.vector(tag)
    if joint.tag == "EllipsoidJoint":
        return _on_surface(joint, coordinates, radii, np.eye(3))
    axes = _on_surface(joint, coordinates, np.abs(SCAPULA) @ radii, SCAPULA)
    at = np.append(joint.vector(WINGING[0], 2, (0.0, 0.0)), 0.0)
    angle = joint.number(WINGING[1], 0.0)
    direction = np.array([-np.sin(angle), np.cos(angle), 0.0])
    return [
        *axes, *_shift(joint, at), Axis(True, direction, coordinates[3], Line(1.0, 0.0), joint),
        *_shift(joint, -at),
    ]  # fmt: skip


def _on_surface(
    joint: Element, coordinates: list[Coordinate], radii: np.ndarray, e: np.ndarray
) -> list[Axis]:
    x, y, z = coordinates[:3]
    a, b, c = radii.tolist()
    own = [
        Axis(True, direction, coordinate, Line(1.0, 0.0), joint)
        for direction, coordinate in zip(e, (x, y, z), strict=True)
    ]
    count = iter(range(5))

    def follower(rotates: bool, axis: int, of: Coordinate, function: Line | Curve) -> Axis:
        named = replace(joint, name=f"ellipsoid{next(count) + 1}")
        return Axis(rotates, e[axis], of, function, named, pure=False)

    axes = []
    if a != c:
        axes.append(follower(False, 0, y, _wave(np.sin, a - c)))
    axes.append(own[0])
    if b != c:
        half = 0.5 * (b - c)
        axes += [
            follower(False, 2, y, _wave(np.cos, half)),
            follower(True, 0, x, Line(-2.0, 0.0)),
            follower(False, 2, y, _wave(np.cos, -half)),
            follower(True, 0, x, Line(2.0, 0.0)),
        ]
    return [*axes, own[1], *_shift(joint, c * e[2]), own[2]]


def _wave(function: np.ufunc, amplitude: float) -> Curve:
    return Curve(lambda q: amplitude * function(q), POLYNOMIAL_BREAKS)


def _shift(joint: Element, vector: np.ndarray) -> list[Axis]:
    """A constant shift as an axis, none if it is zero."""
    length = float(np.linalg.norm(vector))
    return [Axis(False, vector / length, None, Line(0.0, length), joint)] if length else []
