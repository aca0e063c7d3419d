"""Forces of muscles that move steadily, with which a run starts."""

from __future__ import annotations

import numpy as np

from ..muscle.equilibrium import equilibria, steady_activations
from ..muscle.parameters import MuscleSet


def steady_bounds(
    muscles: MuscleSet, u: np.ndarray, l: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The start's bounds: forces (m,) [N] of muscles that move steadily with the lengths `l`,
    speeds `v` and activations `u` (2, m)."""
    low, high = (_steady(muscles, np.ascontiguousarray(row), l, v)[0] for row in u)
    return low, high


def steady_state(
    muscles: MuscleSet, u: np.ndarray, F: np.ndarray, l: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Activations and tendon lengths (m,) of the steady motion nearest to the forces `F`, with
    activations between the excitations `u` (2, m)."""
    a = np.empty(F.size)
    steady_activations(muscles.tables, F, l, v, a)
    a = np.clip(a, *u)
    return a, _steady(muscles, a, l, v)[1]


def _steady(
    muscles: MuscleSet, a: np.ndarray, l: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forces and tendon lengths (m,) of muscles in equilibrium."""
    rows = np.empty((5, a.size))
    equilibria(muscles.tables, a, l, v, rows)
    return rows[0], rows[1]
