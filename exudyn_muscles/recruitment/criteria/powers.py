"""Another power than the square, as a sequence of quadratic programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from ...checks import number_within
from ...model import MusculoskeletalModel
from ..certificate import ACCEPTED, kkt_residual
from ..demand import Demand
from ..problem import Answer, ScaledProblem
from ..program import Program
from .criterion import Problems
from .quantity import Quantity, counted

LARGEST_EXPONENT = 10.0
CONVERGED = 1e-11  # KKT residual, a tenth of what is accepted of DAQP
# Part of the squares that is added to the powers: it decides where quantities are so small beside
# the largest one that their powers are rounding, and keeps programs curved.
SQUARES = 1e-6
# Where that is not enough curvatures are at least these parts of the largest possible one.
FLATTEST, PROGRAMS = (0.0, 1e-6, 1e-5), 25
SHORTEST = 2.0**-20  # step along the way to a program's solution
ROUNDED = 1.0 + 1e-8  # near the solution costs differ by what constraints are off


class PoweredProblem(ScaledProblem):
    """min s^2 sum (|z|^p / p + SQUARES z^2 / 2), z = (x - c) / s, in place of |x|^2 / 2 of
    `ScaledProblem`, with c where the quantity is zero and the size s of x - c by squares alone.

    The last one of an answer's multipliers (n + 1,) is s.
    """

    accepted = ACCEPTED
    of_squares = False

    def __init__(self, demand: Demand, power: float, quantity: Quantity) -> None:
        demand, zero, _ = counted(quantity, demand)
        super().__init__(demand)
        self._zero, self._power = zero, power

    def solved(self, ask: Callable[[Program], Answer]) -> Answer:
        """The solution by Newton's method, every program with the curvatures of the one before.

        What lies between two points within reach is within reach: a step that makes the cost larger
        is halved.
        """
        answer = ask(self.program(np.eye(self.lb.size), -self._zero))
        if answer is None:
            return None
        x, y = answer
        s = float(np.abs(x - self._zero).max(initial=0.0)) or 1.0
        for flattest in FLATTEST:
            for _ in range(PROGRAMS):
                if self.residual(x, np.append(y, s)) <= CONVERGED:
                    return x, np.append(y, s)
                z = np.abs(x - self._zero) / s
                curvature = (self._power - 1.0) * np.maximum(
                    z ** (self._power - 2.0) + SQUARES / (self._power - 1.0), flattest
                )
                slope = self._slope(x, s) - curvature * x
                answer = ask(self.program(np.diag(curvature), slope))
                if answer is None:
                    break
                step, part, most = answer[0] - x, 1.0, ROUNDED * self._cost(x, s)
                while self._cost(x + part * step, s) > most and part > SHORTEST:
                    part *= 0.5
                x, y = x + part * step, answer[1]
        return x, np.append(y, s)

    def residual(self, x: np.ndarray, y: np.ndarray) -> float:
        """What the optimality conditions say of an answer."""
        return kkt_residual(x, self._slope(x, y[-1]), y[:-1], self.A, self.b, self.lb, self.ub)

    def _slope(self, x: np.ndarray, s: float) -> np.ndarray:
        """How the cost grows with every unknown (m,)."""
        z = (x - self._zero) / s
        return s * (np.abs(z) ** (self._power - 1.0) * np.sign(z) + SQUARES * z)

    def _cost(self, x: np.ndarray, s: float) -> float:
        z = np.abs(x - self._zero) / s
        return float((z**self._power / self._power + 0.5 * SQUARES * z * z).sum())


@dataclass(frozen=True)
class _Powered:
    """What the criteria below have in common."""

    exponent: float
    _quantity: ClassVar[Quantity]

    def __post_init__(self) -> None:
        number_within("exponent", self.exponent, 2.0, LARGEST_EXPONENT)

    def prepare(self, model: MusculoskeletalModel) -> Problems:
        """See `Criterion`."""
        return partial(PoweredProblem, power=self.exponent, quantity=self._quantity)


@dataclass(frozen=True)
class PoweredForces(_Powered):
    """The least sum of abs(F_i / N_i)^exponent, as of muscle endurance with 3.

    The larger the exponent, the more evenly muscles share. A millionth of the squares is added,
    which decides between forces so small that their powers are rounding.

    Parameters
    ----------
    exponent : float
        Between 2 and 10.

    Raises
    ------
    ParameterError
        It is not; names it.
    """

    _quantity = Quantity.FORCE


@dataclass(frozen=True)
class PoweredActivations(_Powered):
    """The least sum of the activations' powers, and of those of f / f_optimal of ideal actuators;
    a millionth of the squares is added as of `PoweredForces`.

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
    _quantity = Quantity.ACTIVATION
