"""What is preferred among the forces that deliver a torque.

A criterion builds a problem; how it is solved and how its solution is certified is the same for
all, as is what is done out of reach.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..checks import number_within
from .powered import PoweredProblem
from .problem import ScaledProblem

# Beyond it programs of nearly no curvature are not always solved to what is accepted.
LARGEST_EXPONENT = 5.0


class Criterion(Protocol):
    """Anything with a `problem`; see `SquaredForces`."""

    def problem(
        self, r: np.ndarray, Q_m: np.ndarray, F_min: np.ndarray, F_max: np.ndarray, N: np.ndarray
    ) -> ScaledProblem:
        """The problem whose solution is preferred.

        Parameters
        ----------
        r : (m, n) ndarray
            Moment arms of muscles and ideal actuators.
        Q_m : (n,) ndarray
            Demanded torques.
        F_min, F_max, N : (m,) ndarray
            Bounds and normalising forces [N, or N m].
        """
        ...


@dataclass(frozen=True)
class SquaredForces:
    """(10): the least sum of (F_i / N_i)^2, as in the paper."""

    def problem(
        self, r: np.ndarray, Q_m: np.ndarray, F_min: np.ndarray, F_max: np.ndarray, N: np.ndarray
    ) -> ScaledProblem:
        """See `Criterion`."""
        return ScaledProblem(r, Q_m, F_min, F_max, N)


@dataclass(frozen=True)
class PoweredForces:
    """The least sum of |F_i / N_i|^exponent, as of muscle endurance with 3.

    The larger the exponent, the more evenly muscles share. Out of reach, where all that counts is
    the nearest torque, the forces with that torque are those of `SquaredForces`.

    Parameters
    ----------
    exponent : float
        Between 2 and 5.

    Raises
    ------
    ParameterError
        It is not; names it.
    """

    exponent: float

    def __post_init__(self) -> None:
        number_within("exponent", self.exponent, 2.0, LARGEST_EXPONENT)

    def problem(
        self, r: np.ndarray, Q_m: np.ndarray, F_min: np.ndarray, F_max: np.ndarray, N: np.ndarray
    ) -> ScaledProblem:
        """See `Criterion`."""
        return PoweredProblem(r, Q_m, F_min, F_max, N, self.exponent)
