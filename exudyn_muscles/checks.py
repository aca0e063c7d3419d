"""Checks of numbers that users give."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .errors import ParameterError

# Exudyn's numbers of items, which are no numbers of links.
ITEMS = {
    f"{kind}Index": f"{kind.lower()}s" for kind in ("Node", "Object", "Marker", "Load", "Sensor")
}


def number_within(name: str, value: Any, low: float, high: float, unit: str = "") -> float:
    """`value` as a float.

    Raises
    ------
    ParameterError
        It is not a number from `low` to `high`, both allowed if finite; names it and the range.
    """
    try:
        number = math.nan if isinstance(value, (str, bytes, bool)) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not low <= number <= high or math.isinf(number):
        shown = f"{value!r} {unit}".strip()
        raise ParameterError(f"{name} = {shown} is outside [{low:g}, {high:g}] {unit}".strip())
    return number


def three_numbers(name: str, value: Sequence[float], unit: str = "") -> tuple[float, float, float]:
    """`value` as three floats.

    Raises
    ------
    ParameterError
        It is not three finite numbers; names it.
    """
    try:
        x, y, z = (float(component) for component in value)
    except (TypeError, ValueError):
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        wanted = f"three finite numbers in {unit}" if unit else "three finite numbers"
        raise ParameterError(f"{name} is {wanted}, got {value!r}")
    return x, y, z


class ItemNumber(int):
    """A number of an Exudyn item that stands where a link's number stands in a tree; equal only to
    that of the same list."""

    kind: str

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and int(self) == int(other)

    def __hash__(self) -> int:
        return hash((self.kind, int(self)))


class BodyNumber(ItemNumber):
    """Of a body among the objects."""

    kind = "ObjectIndex"


class MarkerNumber(ItemNumber):
    """Of a marker, whose frame it is."""

    kind = "MarkerIndex"


ITEM_NUMBERS = {one.kind: one for one in (BodyNumber, MarkerNumber)}


def link_number(what: str, value: Any, lowest: int = -1) -> int:
    """`value` as the number of a link of the kinematic tree, or -1 for ground; or that of a body or
    marker as it is.

    Raises
    ------
    ParameterError
        It is not an integer from `lowest`; names it, and the list that it is from.
    """
    kind = type(value).__name__
    if kind in ITEM_NUMBERS:
        return ITEM_NUMBERS[kind](value)
    if isinstance(value, ItemNumber):
        return value
    if isinstance(value, (int, np.integer)) and not isinstance(value, bool) and value >= lowest:
        return int(value)
    ground = " (-1 is ground)" if lowest == -1 else ""
    raise ParameterError(
        f"{what} is the number of a link in the kinematic tree, an integer from 0{ground}, got "
        f"{item_shown(value)}"
    )


def check_link_exists(what: str, link: int, links: int) -> int:
    """The link; ParameterError if the tree has no such one."""
    if isinstance(link, ItemNumber):
        raise ParameterError(
            f"{what} is on {item_shown(link)}, but the skeleton is a kinematic tree: give the "
            "number of its link, an integer from 0 (-1 is ground)"
        )
    if link >= links:
        raise ParameterError(f"{what} is on link {link}, but the tree has links 0 to {links - 1}")
    return link


def item_shown(value: Any) -> str:
    """A value that is no number of its list, and the list that it is from if it is an item's."""
    kind = value.kind if isinstance(value, ItemNumber) else type(value).__name__
    return f"{kind}({int(value)}), one of the mbs's {ITEMS[kind]}" if kind in ITEMS else repr(value)


def check_settings(settings: object, kind: type) -> None:
    """Raise ParameterError unless the settings are an instance of `kind`."""
    if not isinstance(settings, kind):
        raise ParameterError(f"settings must be {kind.__name__}(...), got {settings!r}")


def check_step(name: str, value: float) -> None:
    """Raise ParameterError unless a time step or window is positive and at most 1 s."""
    number_within(name, value, 1e-6, 1.0, "s")
