"""Paths given by their length as a polynomial of coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb

from ..numerics.curves import Curve
from ..path.functions import FunctionPath
from .bodies import Bodies
from .document import Element

# What OpenSim would take in place of the polynomial's own slopes.
OWN_SLOPES = ("moment_arm_functions", "lengthening_speed_function")
MOST_TERMS = 100_000


def read_function_path(element: Element, bodies: Bodies) -> FunctionPath:
    """A `FunctionBasedPath` whose length is a polynomial."""
    element.allow("coordinate_paths", "length_function", *OWN_SLOPES)
    for tag in OWN_SLOPES:
        own = element.find(tag)
        if own is not None and own.children:
            own.refuse()
    named = element.get("coordinate_paths")
    names = [path.rsplit("/", 1)[-1] for path in named.text.split()]
    known = {coordinate.name for coordinate in bodies.coordinates}
    for name in names:
        if name not in known:
            raise named.error(f"there is no coordinate '{name}'")
    polynomial = element.object("length_function")
    if polynomial.tag != "MultivariatePolynomialFunction":
        polynomial.refuse()
    polynomial.allow("coefficients", "dimension", "order")
    order = int(polynomial.number("order", 0.0))
    if int(polynomial.number("dimension", 0.0)) != len(names) or order < 0:
        raise polynomial.error(f"its dimension is that of {len(names)} coordinates")
    count = comb(len(names) + order, order)
    if count > MOST_TERMS:
        raise polynomial.error(f"it has {count} terms; at most {MOST_TERMS} are read")
    terms: list[tuple[float, dict[str | int, int | Curve]]] = []
    numbers = polynomial.get("coefficients").numbers(count)
    for coefficient, powers in zip(numbers.tolist(), _powers(len(names), order), strict=True):
        factors: dict[str | int, int | Curve] = {}
        for name, power in zip(names, powers, strict=True):
            if name in bodies.locked:
                coefficient *= bodies.locked[name] ** power
            elif power:
                factors[name] = power
        if coefficient != 0.0:
            terms.append((coefficient, factors))
    return FunctionPath(terms or [(0.0, {})])


def _powers(dimension: int, order: int) -> Iterator[tuple[int, ...]]:
    """All powers up to a sum, the last one's first."""
    if dimension == 0:
        yield ()
        return
    for first in range(order + 1):
        for rest in _powers(dimension - 1, order - first):
            yield (first, *rest)
