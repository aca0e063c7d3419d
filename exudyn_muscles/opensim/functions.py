"""Functions of a coordinate, as joints and moving path points have them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..numerics.curves import Curve
from ..numerics.splines import piecewise_line, simm_spline
from ..skeleton.coupling import linear_function
from .element import Element

# A polynomial goes on along its tangent beyond these.
POLYNOMIAL_BREAKS = (-10.0, -3.0, -1.0, 0.0, 1.0, 3.0, 10.0)


class Line(NamedTuple):
    """slope * q + value."""

    slope: float
    value: float


def read_function(element: Element, factor: float = 1.0) -> Line | Curve:
    """A function of a file, times a factor."""
    if element.tag == "Constant":
        element.allow("value")
        return Line(0.0, factor * element.number("value", 0.0))
    if element.tag == "LinearFunction":
        element.allow("coefficients")
        slope, value = factor * element.vector("coefficients", 2, (1.0, 0.0))
        return Line(float(slope), float(value))
    if element.tag == "PolynomialFunction":
        element.allow("coefficients")
        polynomial = np.poly1d(factor * element.get("coefficients").numbers())  # highest first
        if polynomial.order < 2:
            return Line(float(polynomial[1]), float(polynomial[0]))
        with element.blamed():
            return Curve(polynomial, POLYNOMIAL_BREAKS, name="the polynomial")
    if element.tag == "MultiplierFunction":
        function = element.object("function")
        element.allow("scale", "function", function.tag)
        return read_function(function, factor * element.number("scale", 1.0))
    if element.tag in ("SimmSpline", "PiecewiseLinearFunction"):
        element.allow("x", "y")
        x, y = element.get("x").numbers(), element.get("y").numbers()
        through = simm_spline if element.tag == "SimmSpline" else piecewise_line
        with element.blamed():
            return through(x.tolist(), (factor * y).tolist())
    element.refuse()


def as_curve(function: Line | Curve) -> Curve:
    """The function as a curve."""
    if isinstance(function, Curve):
        return function
    return linear_function(*function)
