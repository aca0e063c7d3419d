"""A system at the states that a result has recorded."""

from __future__ import annotations

from collections.abc import Iterator

import exudyn as exu
import numpy as np

from ..state import State


def recorded(
    mbs: exu.MainSystem, state: State, x: np.ndarray, x_t: np.ndarray, t: np.ndarray
) -> Iterator[None]:
    """Be at each of the coordinates `x` and speeds `x_t` (k, N) at times (k,)."""
    for coordinates, speeds, time in zip(x, x_t, t, strict=True):
        state.q[:], state.v[:] = coordinates, speeds
        mbs.systemData.SetTime(time)
        yield
