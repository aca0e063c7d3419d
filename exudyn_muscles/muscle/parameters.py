"""One muscle, and a set of them as a struct of arrays.

Names and units are OpenSim's, the symbols are the paper's.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..checks import number_within
from ..errors import ParameterError
from .curves import tendon_stiffness

if TYPE_CHECKING:
    from ..path.points import PathPoint

# Rows of `MuscleSet.table`, which is what the compiled kernels see.
F_0, L_M0, L_TS, WIDTH, V_M, K_T, P_MIN, A_MIN, TAU_A, TAU_D = range(10)

# OpenSim uses the curves of DeGrooteFregly2016Muscle above 0.2 optimal fibre lengths.
SHORTEST_FIBER = 0.2
# OpenSim's limit for all fixed-width units; the fibre would stand across the tendon at 90 deg.
MAXIMUM_PENNATION = math.acos(0.1)

# Lowest and highest allowed value and unit of every parameter.
RANGES = {
    "max_isometric_force": (1e-3, 1e6, "N"),
    "optimal_fiber_length": (1e-4, 10.0, "m"),
    "tendon_slack_length": (1e-5, 10.0, "m"),
    "pennation_angle_at_optimal": (0.0, 1.4, "rad"),
    "max_contraction_velocity": (0.1, 100.0, "optimal fiber lengths/s"),
    "activation_time_constant": (1e-4, 10.0, "s"),
    "deactivation_time_constant": (1e-4, 10.0, "s"),
    "minimum_activation": (1e-3, 0.5, "1"),
    "tendon_strain_at_one_norm_force": (1e-3, 1.0, "1"),
    "maximum_pennation_angle": (0.0, MAXIMUM_PENNATION, "rad"),
}


@dataclass(frozen=True)
class Muscle:
    """A musculotendon unit: Hill-type fibre with constant width and an elastic tendon.

    Parameters
    ----------
    name : str
        Unique within a model.
    max_isometric_force : float
        F0 [N].
    optimal_fiber_length : float
        l_m0 [m].
    tendon_slack_length : float
        l_ts [m].
    pennation_angle_at_optimal : float
        alpha_0 [rad].
    max_contraction_velocity : float
        v_max [optimal fibre lengths/s]. 10 is OpenSim's default.
    activation_time_constant, deactivation_time_constant : float
        tau_a and tau_d [s] of (5); 15 and 50 ms as in Thelen (2003).
    minimum_activation : float
        a_min, also the lowest excitation; 0.01 as in OpenSim.
    tendon_strain_at_one_norm_force : float
        Tendon strain at F0; 0.049 as in OpenSim.
    maximum_pennation_angle : float
        The fibre does not shorten further once it is reached [rad]; acos(0.1) as in OpenSim.
    path : sequence of PathPoint
        From origin to insertion, straight lines between the points.

    Raises
    ------
    ParameterError
        Names the muscle, the parameter, its value and the allowed range.
    """

    name: str
    _: KW_ONLY
    max_isometric_force: float
    optimal_fiber_length: float
    tendon_slack_length: float
    pennation_angle_at_optimal: float = 0.0
    max_contraction_velocity: float = 10.0
    activation_time_constant: float = 0.015
    deactivation_time_constant: float = 0.050
    minimum_activation: float = 0.01
    tendon_strain_at_one_norm_force: float = 0.049
    maximum_pennation_angle: float = MAXIMUM_PENNATION
    path: tuple[PathPoint, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise ParameterError(f"a muscle's name is a non-empty string, got {self.name!r}")
        for parameter, (low, high, unit) in RANGES.items():
            name = f"muscle '{self.name}': {parameter}"
            number = number_within(name, getattr(self, parameter), low, high, unit)
            object.__setattr__(self, parameter, number)
        if self.pennation_angle_at_optimal > self.maximum_pennation_angle:
            raise ParameterError(
                f"muscle '{self.name}': pennation_angle_at_optimal = "
                f"{self.pennation_angle_at_optimal:g} is outside "
                f"[0, maximum_pennation_angle = {self.maximum_pennation_angle:g}] rad"
            )
        object.__setattr__(self, "path", tuple(self.path))


class MuscleSet:
    """m muscles as a struct of arrays.

    Attributes
    ----------
    names : tuple of str
    table : (10, m) ndarray, read-only
        Parameters by row, as the compiled kernels use them.

    Raises
    ------
    ParameterError
        Two muscles share a name, or there is none.
    """

    def __init__(self, muscles: Iterable[Muscle]) -> None:
        self._muscles = tuple(muscles)
        self.names = tuple(muscle.name for muscle in self._muscles)
        if not self._muscles:
            raise ParameterError("a model needs at least one muscle, got none")
        twice = [name for name, count in Counter(self.names).items() if count > 1]
        if twice:
            raise ParameterError(f"muscle names must be unique, used more than once: {twice}")
        self.table = np.array([_column(muscle) for muscle in self._muscles]).T.copy()
        self.table.setflags(write=False)

    def __len__(self) -> int:
        return len(self._muscles)

    def __iter__(self) -> Iterator[Muscle]:
        return iter(self._muscles)

    @property
    def max_isometric_force(self) -> np.ndarray:
        """F0, (m,) [N]."""
        return self.table[F_0]

    @property
    def minimum_activation(self) -> np.ndarray:
        """a_min, (m,)."""
        return self.table[A_MIN]

    @property
    def optimal_fiber_length(self) -> np.ndarray:
        """l_m0, (m,) [m]."""
        return self.table[L_M0]

    @property
    def shortest_taut_length(self) -> np.ndarray:
        """Musculotendon length (m,) [m] below which the tendon is slack at the shortest fibre."""
        return self.table[L_TS] + self.table[P_MIN]


def _column(muscle: Muscle) -> list[float]:
    """One muscle's column of the table."""
    width = muscle.optimal_fiber_length * math.sin(muscle.pennation_angle_at_optimal)
    shortest = SHORTEST_FIBER * muscle.optimal_fiber_length
    if width > 0.0:
        shortest = max(shortest, width / math.sin(muscle.maximum_pennation_angle))
    column = [0.0] * 10
    column[F_0] = muscle.max_isometric_force
    column[L_M0] = muscle.optimal_fiber_length
    column[L_TS] = muscle.tendon_slack_length
    column[WIDTH] = width
    column[V_M] = muscle.max_contraction_velocity * muscle.optimal_fiber_length
    column[K_T] = tendon_stiffness(muscle.tendon_strain_at_one_norm_force)
    column[P_MIN] = math.sqrt(shortest**2 - width**2)
    column[A_MIN] = muscle.minimum_activation
    column[TAU_A] = muscle.activation_time_constant
    column[TAU_D] = muscle.deactivation_time_constant
    return column
