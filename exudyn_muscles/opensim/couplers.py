"""Coordinates that a constraint couples to others."""

from __future__ import annotations

from typing import NamedTuple

from ..numerics.curves import Curve
from ..numerics.products import SumOfProducts
from .element import Element
from .functions import SEVERAL, Line, read_function, read_several

COUPLER = "CoordinateCouplerConstraint"


class Coupler(NamedTuple):
    """What a coordinate follows: the coordinates `of` by a `function`. `element` is its place."""

    of: tuple[str, ...]
    function: Line | Curve | SumOfProducts
    element: Element


def read_couplers(model: Element) -> dict[str, Coupler]:
    """The couplers of a model by the coordinates that follow."""
    couplers: dict[str, Coupler] = {}
    for item in model.items("ConstraintSet"):
        if item.tag != COUPLER or not item.is_on:
            continue
        item.allow(
            "isEnforced", "isDisabled", "coupled_coordinates_function",
            "independent_coordinate_names", "dependent_coordinate_name", "scale_factor",
        )  # fmt: skip
        names = item.word("independent_coordinate_names").split()
        dependent = item.word("dependent_coordinate_name")
        if dependent in couplers:
            line = couplers[dependent].element.line
            raise item.error(f"coordinate '{dependent}' is coupled already, in line {line}")
        function = item.object("coupled_coordinates_function")
        factor = item.number("scale_factor", 1.0)
        given: Line | Curve | SumOfProducts
        if len(names) == 1 and function.tag != SEVERAL:
            given = read_function(function, factor)
        else:
            given = read_several(function, len(names), factor)
        couplers[dependent] = Coupler(tuple(names), given, item)
    return couplers
