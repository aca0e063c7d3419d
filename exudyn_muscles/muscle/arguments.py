"""Arrays that users give, one value a muscle."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError
from .parameters import MuscleSet


def as_rows(muscles: MuscleSet, **arrays: ArrayLike) -> list[np.ndarray]:
    """Contiguous float copies, one value a muscle each."""
    if not isinstance(muscles, MuscleSet):
        raise ParameterError(f"muscles must be a MuscleSet, got {muscles!r}")
    rows = []
    for name, values in arrays.items():
        try:
            row = np.array(values, dtype=float)
        except (TypeError, ValueError):
            row = np.array(np.nan)
        if row.shape != (len(muscles),) or not np.isfinite(row).all():
            raise ParameterError(
                f"{name}: expected {len(muscles)} finite values, one a muscle, got {values!r}"
            )
        rows.append(row)
    return rows


def check_range(name: str, values: np.ndarray, muscles: MuscleSet) -> None:
    """Raise ParameterError for an activation or excitation below the minimum or above 1."""
    low = muscles.minimum_activation
    for i in np.flatnonzero((values < low - 1e-12) | (values > 1.0 + 1e-12)):
        raise ParameterError(
            f"muscle '{muscles.names[i]}': {name} {values[i]:g} is outside [{low[i]:g}, 1]"
        )
