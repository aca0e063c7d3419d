"""What a force is divided by in the objective of (10).

A normalizer is any callable `(muscles, F_max) -> (m,) array` of positive values [N], where F_max
are the reachable maxima (9).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..muscle.parameters import MuscleSet

# Below this part of F0 a reachable maximum no longer tells one muscle from another.
SMALLEST_SHARE = 1e-3


class Normalizer(Protocol):
    """Normalising forces (m,) [N] from the muscles and their reachable maxima (m,) [N]."""

    def __call__(self, muscles: MuscleSet, F_max: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True)
class ReachableMaximum:
    """The reachable maximum of the window, as in the paper; at least 0.1 % of F0."""

    def __call__(self, muscles: MuscleSet, F_max: np.ndarray) -> np.ndarray:
        return np.maximum(F_max, SMALLEST_SHARE * muscles.max_isometric_force)


@dataclass(frozen=True)
class MaximumIsometricForce:
    """F0 of every muscle."""

    def __call__(self, muscles: MuscleSet, F_max: np.ndarray) -> np.ndarray:
        return muscles.max_isometric_force
