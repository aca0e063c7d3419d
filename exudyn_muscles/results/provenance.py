"""What a result was made with: versions, and settings as JSON can hold them."""

from __future__ import annotations

import dataclasses
import platform
from collections.abc import Mapping
from enum import Enum
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np

PACKAGES = ("exudyn_muscles", "exudyn", "numpy", "scipy", "numba", "qpsolvers", "daqp", "osqp")


@cache
def versions() -> dict[str, str]:
    """Versions of everything that may change a result."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


def plain(settings: Any) -> dict[str, Any]:
    """The fields of a dataclass of settings."""
    return {
        item.name: _value(getattr(settings, item.name))
        for item in dataclasses.fields(settings)
        if item.init
    }


def _value(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, Mapping):
        return {name: _value(item) for name, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_value(item) for item in np.asarray(value).tolist()]
    if dataclasses.is_dataclass(value) and any(item.init for item in dataclasses.fields(value)):
        return plain(value)
    return value if isinstance(value, (bool, int, float, str, type(None))) else repr(value)
