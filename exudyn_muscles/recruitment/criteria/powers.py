"""Another power than the square, as a sequence of quadratic programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import qpsolvers

from ...checks import number_within
from ...model import MusculoskeletalModel
from ..certificate import kkt_residual
from ..demand import Demand
from ..problem import Answer, ScaledProblem
from .criterion import Problems

# Beyond it programs of nearly no curvature are not always solved to what is accepted.
LARGEST_EXPONENT = 5.0
MOST_PROGRAMS = 100
CONVERGED = 1e-11  # KKT residual, a tenth of what is accepted of DAQP
# Curvatures are at least this part of the largest one: they vanish with forces.
FLATTEST = 1e-6
SHORTEST = 2.0**-20  # step along the way to a program's solution
ROUNDED = 1.0 + 1e-8  # near the solution costs differ by what constraints are off


class PoweredProblem(ScaledProblem):
    """min s^2 sum |x / s|^p / p in place of x^2/2 of `ScaledProblem`, with the size s of x."""

    def __init__(self, demand: Demand, power: float) -> None:
        super().__init__(demand)
        self._power = power
        shortest = np.linalg.lstsq(self.A, self.b, rcond=None)[0] if self.finite else np.zeros(1)
        self._around = float(np.abs(shortest).max()) or 1.0

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """How the cost grows with every unknown (m,)."""
        return self._around * np.abs(x / self._around) ** (self._power - 1.0) * np.sign(x)

    def solved(self, ask: Callable[[qpsolvers.Problem], Answer]) -> Answer:
        """The solution by Newton's method, every program with the curvatures of the one before.

        What lies between two points within reach is within reach: a step that makes the cost larger
        is halved.
        """
        answer = ask(self)
        if answer is None:
            return None
        x, y = answer
        for _ in range(MOST_PROGRAMS):
            g = self.gradient(x)
            if kkt_residual(x, g, y, self.A, self.b, self.lb, self.ub) <= CONVERGED:
                break
            curvature = (self._power - 1.0) * np.abs(x / self._around) ** (self._power - 2.0)
            curvature = np.maximum(curvature, FLATTEST * curvature.max())
            program = qpsolvers.Problem(
                np.diag(curvature), g - curvature * x,
                A=self.A, b=self.b, lb=self.lb, ub=self.ub,
            )  # fmt: skip
            answer = ask(program)
            if answer is None:
                return None
            step, part, most = answer[0] - x, 1.0, ROUNDED * self._cost(x)
            while self._cost(x + part * step) > most and part > SHORTEST:
                part *= 0.5
            x, y = x + part * step, answer[1]
        return x, y

    def _cost(self, x: np.ndarray) -> float:
        return float((np.abs(x / self._around) ** self._power).sum())


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

    def prepare(self, model: MusculoskeletalModel) -> Problems:
        """See `Criterion`."""
        return partial(PoweredProblem, power=self.exponent)
