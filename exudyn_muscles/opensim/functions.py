"""Functions of coordinates, as joints, couplers, paths and moving path points have them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import comb
from typing import NamedTuple, overload

import numpy as np

from ..numerics.curves import Curve
from ..numerics.products import SumOfProducts
from ..numerics.splines import piecewise_line, simm_spline
from ..skeleton.coupling import linear_function
from .element import Element

# A polynomial goes on along its tangent beyond these.
POLYNOMIAL_BREAKS = (-10.0, -3.0, -1.0, 0.0, 1.0, 3.0, 10.0)
MOST_TERMS = 100_000
SEVERAL = "MultivariatePolynomialFunction"


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


@overload
def as_curve(function: Line | Curve) -> Curve: ...
@overload
def as_curve(function: Line | Curve | SumOfProducts) -> Curve | SumOfProducts: ...
def as_curve(function: Line | Curve | SumOfProducts) -> Curve | SumOfProducts:
    """The function as a curve if it is a line."""
    return linear_function(*function) if isinstance(function, Line) else function


def read_several(element: Element, count: int, factor: float = 1.0) -> SumOfProducts:
    """A function of so many coordinates in a file, times a factor."""
    if element.tag == "LinearFunction":
        element.allow("coefficients")
        *slopes, value = (factor * element.vector("coefficients", count + 1)).tolist()
        return SumOfProducts([(value, {}), *((slope, {k: 1}) for k, slope in enumerate(slopes))])
    if element.tag == "MultiplierFunction":
        function = element.object("function")
        element.allow("scale", "function", function.tag)
        return read_several(function, count, factor * element.number("scale", 1.0))
    if element.tag != SEVERAL:
        element.refuse()
    element.allow("coefficients", "dimension", "order")
    order = int(element.number("order", 0.0))
    if int(element.number("dimension", 0.0)) != count or order < 0:
        raise element.error(f"its dimension is that of {count} coordinates")
    terms = comb(count + order, order)
    if terms > MOST_TERMS:
        raise element.error(f"it has {terms} terms; at most {MOST_TERMS} are read")
    numbers = (factor * element.get("coefficients").numbers(terms)).tolist()
    return SumOfProducts(
        [
            (coefficient, {k: power for k, power in enumerate(powers) if power})
            for coefficient, powers in zip(numbers, _powers(count, order), strict=True)
            if coefficient != 0.0
        ]
        or [(0.0, {})]
    )


def without_locked(
    function: SumOfProducts, names: Sequence[str], locked: Mapping[str, float]
) -> tuple[SumOfProducts, tuple[str, ...]]:
    """The function of those of its coordinates that are not locked at a value, and their names."""
    values = {k: locked[name] for k, name in enumerate(names) if name in locked}
    left = tuple(name for name in names if name not in locked)
    return function.fixed(values, len(names)), left


def _powers(dimension: int, order: int) -> Iterator[tuple[int, ...]]:
    """All powers up to a sum, the last one's first."""
    if dimension == 0:
        yield ()
        return
    for first in range(order + 1):
        for rest in _powers(dimension - 1, order - first):
            yield (first, *rest)
