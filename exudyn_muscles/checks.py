"""Checks of numbers that users give."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from .errors import ParameterError


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
