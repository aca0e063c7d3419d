"""Checks of numbers that users give."""

from __future__ import annotations

import math
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
