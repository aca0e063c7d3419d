"""What a force is divided by in the objective of (10).

A normalizer is any callable `(muscles, F_max, geometry) -> (m,) array` of positive values [N],
where F_max are the reachable maxima (9), and the geometry is that of the state at the window's end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..muscle.dynamics import rigid_active_forces
from ..muscle.parameters import MuscleSet
from ..skeleton.geometry import Geometry

# Below this part of F0 a reachable maximum no longer tells one muscle from another.
SMALLEST_SHARE = 1e-3


class Normalizer(Protocol):
    """Normalising forces (m,) [N] from the muscles, their reachable maxima (m,) [N] and their
    geometry."""

    def __call__(self, muscles: MuscleSet, F_max: np.ndarray, geometry: Geometry) -> np.ndarray: ...


@dataclass(frozen=True)
class ReachableMaximum:
    """The reachable maximum of the window, as in the paper; at least 0.1 % of F0."""

    def __call__(self, muscles: MuscleSet, F_max: np.ndarray, geometry: Geometry) -> np.ndarray:
        return np.maximum(F_max, SMALLEST_SHARE * muscles.max_isometric_force)


@dataclass(frozen=True)
class MaximumIsometricForce:
    """F0 of every muscle."""

    def __call__(self, muscles: MuscleSet, F_max: np.ndarray, geometry: Geometry) -> np.ndarray:
        return muscles.max_isometric_force


@dataclass(frozen=True)
class RigidTendonForce:
    """The active force along the tendon at full activation if the tendon were rigid, as in the fast
    target of OpenSim's CMC; at least 0.1 % of F0.

    OpenSim's Millard2012EquilibriumMuscle takes the pennation angle of another fibre there, one of
    l_m / l_m0 metres, and its deprecated classes the force at rest with the elastic tendon times a
    force-velocity curve that is not theirs.
    """

    def __call__(self, muscles: MuscleSet, F_max: np.ndarray, geometry: Geometry) -> np.ndarray:
        F = np.empty(len(muscles))
        rigid_active_forces(muscles.tables, geometry.length, geometry.lengthening_speed, F)
        return np.maximum(F, SMALLEST_SHARE * muscles.max_isometric_force)


def volume_weights(muscles: MuscleSet) -> dict[str, float]:
    """Weights for the objective (10) that count every muscle by its volume, which is proportional
    to F0 times the optimal fibre length; their mean is one.

    Parameters
    ----------
    muscles : MuscleSet

    Returns
    -------
    dict of str to float
        For `weights` of a method's settings.
    """
    if not len(muscles):
        return {}
    volume = muscles.max_isometric_force * muscles.optimal_fiber_length
    return dict(zip(muscles.names, map(float, volume / volume.mean()), strict=True))
