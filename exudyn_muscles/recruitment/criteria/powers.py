"""Another power than the square, as a sequence of quadratic programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import qpsolvers

from ...checks import number_within
from ...model import MusculoskeletalModel
from ..certificate import ACCEPTED
from ..demand import Demand
from ..problem import Answer, ScaledProblem
from .criterion import Problems
from .quantity import Quantity, counted

LARGEST_EXPONENT = 10.0
CONVERGED = 1e-11  # KKT residual, a tenth of what is accepted of DAQP
# Curvatures, which vanish with forces, are at least one of these parts of the largest one, for so
# many programs each: small ones converge fast but may leave a program without an answer, or one of
# multipliers that are rounded.
FLATTEST, PROGRAMS = (1e-6, 1e-7, 1e-8, 1e-5), 25
SHORTEST = 2.0**-20  # step along the way to a program's solution
ROUNDED = 1.0 + 1e-8  # near the solution costs differ by what constraints are off


class PoweredProblem(ScaledProblem):
    """min s^2 sum |(x - c) / s|^p / p in place of |x|^2 / 2 of `ScaledProblem`, with c where the
    quantity is zero and the size s of x - c."""

    accepted = ACCEPTED
    of_squares = False

    def __init__(self, demand: Demand, power: float, quantity: Quantity) -> None:
        demand, zero, _ = counted(quantity, demand)
        super().__init__(demand)
        self._zero = zero
        self._power = power
        shortest = np.linalg.lstsq(self.A, self.b, rcond=None)[0] if self.finite else 0.0
        low, high = self.lb - self._zero, self.ub - self._zero
        forced = np.maximum(np.maximum(low, -high), np.abs(shortest))
        self._around = float(forced.max()) or 1.0

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """How the cost grows with every unknown (m,)."""
        part = self._part(x)
        return self._around * np.abs(part) ** (self._power - 1.0) * np.sign(part)

    def solved(self, ask: Callable[[qpsolvers.Problem], Answer]) -> Answer:
        """The solution by Newton's method, every program with the curvatures of the one before.

        What lies between two points within reach is within reach: a step that makes the cost larger
        is halved.
        """
        answer = ask(self._program(np.ones(self.lb.size), -self._zero))
        if answer is None:
            return None
        x, y = answer
        for flattest in FLATTEST:
            for _ in range(PROGRAMS):
                g = self.gradient(x)
                if self.residual(x, y) <= CONVERGED:
                    return x, y
                curvature = (self._power - 1.0) * np.abs(self._part(x)) ** (self._power - 2.0)
                curvature = np.maximum(curvature, flattest * curvature.max())
                answer = ask(self._program(curvature, g - curvature * x))
                if answer is None:
                    break
                step, part, most = answer[0] - x, 1.0, ROUNDED * self._cost(x)
                while self._cost(x + part * step) > most and part > SHORTEST:
                    part *= 0.5
                x, y = x + part * step, answer[1]
        return x, y

    def _program(self, curvature: np.ndarray, slope: np.ndarray) -> qpsolvers.Problem:
        return qpsolvers.Problem(
            np.diag(curvature), slope, A=self.A, b=self.b, lb=self.lb, ub=self.ub
        )

    def _part(self, x: np.ndarray) -> np.ndarray:
        return (x - self._zero) / self._around

    def _cost(self, x: np.ndarray) -> float:
        return float((np.abs(self._part(x)) ** self._power).sum())


@dataclass(frozen=True)
class PoweredForces:
    """The least sum of |F_i / N_i|^exponent, as of muscle endurance with 3.

    The larger the exponent, the more evenly muscles share.

    Parameters
    ----------
    exponent : float
        Between 2 and 10.

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
        return partial(PoweredProblem, power=self.exponent, quantity=Quantity.FORCE)


@dataclass(frozen=True)
class PoweredActivations:
    """The least sum of the activations' powers, and of f / f_optimal of ideal actuators.

    Parameters
    ----------
    exponent : float
        Between 2, as is usual, and 10.

    Raises
    ------
    ParameterError
        It is not; names it.
    """

    exponent: float = 2.0

    def __post_init__(self) -> None:
        number_within("exponent", self.exponent, 2.0, LARGEST_EXPONENT)

    def prepare(self, model: MusculoskeletalModel) -> Problems:
        """See `Criterion`."""
        return partial(PoweredProblem, power=self.exponent, quantity=Quantity.ACTIVATION)
