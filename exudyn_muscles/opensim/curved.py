"""Joints between the ends of an arc of constant length, as axes one after the other.

With angles x, z, y one after the other, the arc's end points along u = R_1(x) R_3(z) e_2, turned
from e_2 by theta with cos(theta) = c = cos x cos z. Of a length d the end of the arc is at

    d (g(c) u_1, f(c), g(c) u_3),    f = sin(theta) / theta,    g = (1 - c) / (theta sin(theta)),

with u_1 = -sin z and u_3 = sin x cos z. A coordinate that moves nothing has the value c.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..motion.coordinate import Coordinate
from ..numerics.curves import Curve
from ..numerics.products import SumOfProducts
from .axes import Axis, axis_of_several
from .element import Element
from .functions import POLYNOMIAL_BREAKS, Line

CURVATURE = ("neutral_angle_x_z_y", "length")
X, Y, Z = np.eye(3)
# Breaks of f and g: OpenSim stops where an angle is beyond a right one, and c negative.
COSINES = (-0.5, 0.0, 1.0)


def curved_axes(joint: Element, coordinates: list[Coordinate]) -> list[Axis]:
    """The axes of a `ConstantCurvatureJoint` with its coordinates x, z, y."""
    x, z, y = coordinates
    neutral = joint.vector("neutral_angle_x_z_y", default=(0.0, 0.0, 0.0)).tolist()
    length = joint.number("length", 1.0)
    sin_x, cos_x = (_wave(wave, neutral[0]) for wave in (np.sin, np.cos))
    sin_z, cos_z = (_wave(wave, neutral[1]) for wave in (np.sin, np.cos))
    across, along = Curve(_across, COSINES), Curve(_along, COSINES)
    cosine = SumOfProducts([(1.0, {0: cos_x, 1: cos_z})])
    bend = axis_of_several(False, Y, (x, z), cosine, replace(joint, name="bend"))
    bends = [] if bend.coordinate is None else [bend._replace(carries=False)]
    if bend.coordinate is None:
        c = replace(x, name="bend", default_value=bend.fixed or 0.0, locked=True)
    else:
        c = replace(bend.coordinate, name=bend.follower)

    def moved(direction: np.ndarray, name: str, factor: float, by: dict[int, int | Curve]) -> Axis:
        function = SumOfProducts([(factor * length, by)])
        return axis_of_several(False, direction, (x, z, c), function, replace(joint, name=name))

    turns = zip((X, Z, Y), (x, z, y), neutral, strict=True)
    return [
        *bends,
        moved(X, "across1", -1.0, {1: sin_z, 2: across}),
        moved(Y, "along", 1.0, {2: along}),
        moved(Z, "across2", 1.0, {0: sin_x, 1: cos_z, 2: across}),
        *(Axis(True, axis, each, Line(1.0, at), joint) for axis, each, at in turns),
    ]


def _wave(wave: np.ufunc, shift: float) -> Curve:
    return Curve(lambda q: wave(q + shift), POLYNOMIAL_BREAKS)


def _angle(c: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """1 - c, theta and sin(theta), to their last digits where theta is small."""
    s = np.maximum(1.0 - c, 0.0)
    return s, 2.0 * np.arcsin(np.sqrt(0.5 * s)), np.sqrt(s * (2.0 - s))


def _along(c: np.ndarray) -> np.ndarray:
    _, theta, sine = _angle(c)
    return np.divide(sine, theta, out=np.ones_like(theta), where=theta > 0.0)


def _across(c: np.ndarray) -> np.ndarray:
    s, theta, sine = _angle(c)
    return np.divide(s, theta * sine, out=np.full_like(theta, 0.5), where=theta > 0.0)
