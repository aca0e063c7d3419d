"""Coordinates that a constraint couples to others."""

from __future__ import annotations

from typing import NamedTuple

from ..numerics.curves import Curve
from .element import Element
from .functions import Line, read_function

COUPLER = "CoordinateCouplerConstraint"


class Coupler(NamedTuple):
    """What a coordinate follows: the coordinate `of` by a `function`. `element` is its place."""

    of: str
    function: Line | Curve
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
        if len(names) > 1:
            where = item.get("independent_coordinate_names")
            raise where.error("a function of several coordinates")
        dependent = item.word("dependent_coordinate_name")
        if dependent in couplers:
            line = couplers[dependent].element.line
            raise item.error(f"coordinate '{dependent}' is coupled already, in line {line}")
        function = item.object("coupled_coordinates_function")
        given = read_function(function, item.number("scale_factor", 1.0))
        couplers[dependent] = Coupler(names[0], given, item)
    return couplers
