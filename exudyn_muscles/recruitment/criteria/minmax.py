"""The least largest quantity, and of all forces with that the cheapest.

Two levels, in the unknowns x of a problem with q = x - c:

    min t               s.t.  A x = b,  low <= x <= high,  |q_i| <= t,
    min |q|^2 / 2       s.t.  A x = b,  low <= x <= high,  |q_i| <= t of the first,

of which the second makes the answer unique and continuous in the demand. With a small part of the
second cost added the first one has, below some size of the part, the same solution
(O. L. Mangasarian and R. R. Meyer, "Nonlinear perturbation of linear programs", SIAM Journal on
Control and Optimization 17 (1979)); that it is small enough is seen from the duality gap.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...errors import ParameterError
from ...model import MusculoskeletalModel
from ..certificate import ACCEPTED, kkt_residual
from ..demand import Demand
from ..problem import Answer, ScaledProblem
from ..program import Program
from .criterion import Problems
from .quantity import Quantity, counted

# Parts of the second cost in the first level, tried in this order.
PARTS = (1e-4, 1e-6, 1e-8)
# The first level's t may be wrong by its solver's rounding.
ROOM = 1e-10
# Duality gap of the first level over t from which on a smaller part is tried.
WIDE = 1e-9
# What is no farther from a bound is at it.
AT = 1e-9


class MinMaxProblem(ScaledProblem):
    """The two levels in place of |x|^2 / 2 of `ScaledProblem`.

    The multipliers of an answer are those of both levels (2, n).
    """

    accepted = ACCEPTED
    of_squares = False

    def __init__(self, demand: Demand, quantity: Quantity) -> None:
        demand, zero, _ = counted(quantity, demand)
        super().__init__(demand)
        self._zero = zero

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """How the second level's cost grows with every unknown (m,)."""
        return x - self._zero

    def solved(self, ask: Callable[[Program], Answer]) -> Answer:
        """The second level's solution."""
        for part in PARTS:
            first = ask(self._first_level(part))
            if first is None:
                continue
            t = np.abs(first[0][:-1] - self._zero).max(initial=0.0) * (1.0 + ROOM)
            low, high = self._within(t)
            second = ask(Program(self.P, -self._zero, A=self.A, b=self.b, lb=low, ub=high))
            if second is None:
                continue
            answer = second[0], np.array([self._multipliers(*first), second[1]])
            if self._gap(*answer) <= WIDE:
                return answer
        return None

    def residual(self, x: np.ndarray, y: np.ndarray) -> float:
        """The larger one of the first level's duality gap and of the second level's residual."""
        t = np.abs(x - self._zero).max(initial=0.0)
        second = kkt_residual(x, self.gradient(x), y[1], self.A, self.b, *self._within(t))
        return max(self._gap(x, y), second)

    def _first_level(self, part: float) -> Program:
        """In the unknowns x and t (m + 1,)."""
        (n, m), c = self.A.shape, self._zero
        one, t = np.eye(m), np.ones((m, 1))
        below = self.lb < c  # others are above -t anyway
        q = np.append(-part * c, 1.0)
        return Program(
            part * np.eye(m + 1), q, A=np.hstack([self.A, np.zeros((n, 1))]), b=self.b,
            G=np.block([[one, -t], [-one[below], -t[below]]]), h=np.concatenate([c, -c[below]]),
            lb=np.append(self.lb, 0.0), ub=np.append(self.ub, np.inf),
        )  # fmt: skip

    def _multipliers(self, solution: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Those of the first level without the small part, next to `y` (n,): what is between bounds
        has no slope, and what is at t has slopes of one altogether; none if a bound demands t."""
        q, t = solution[:-1] - self._zero, solution[-1]
        low, high = self.lb - self._zero, self.ub - self._zero
        if t <= self._least() + AT:
            return np.zeros(y.size)
        at_low, at_high = q <= low + AT, q >= high - AT
        most = (np.abs(q) >= t - AT) & ~at_low & ~at_high
        free = ~(most | at_low | at_high)
        rows = np.vstack([self.A.T[free], self.A[:, most] @ -np.sign(q[most])])
        off = np.append(np.zeros(len(rows) - 1), 1.0) - rows @ y
        return y + np.linalg.lstsq(rows, off, rcond=None)[0]

    def _within(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Bounds (m,) between which no quantity is larger than `t`."""
        low = np.minimum(np.maximum(self.lb, self._zero - t), self.ub)
        return low, np.maximum(np.minimum(self.ub, self._zero + t), low)

    def _least(self) -> float:
        """The least largest quantity that bounds allow."""
        low, high = self.lb - self._zero, self.ub - self._zero
        return float(np.maximum(low, -high).max(initial=0.0))

    def _gap(self, x: np.ndarray, y: np.ndarray) -> float:
        """How much smaller the largest quantity may be than that of `x`, over its size: by the dual
        function of the first level's multipliers, the least of t + y (A x - b) within the bounds
        and |q_i| <= t, which is convex in t with its kinks where bounds come in."""
        t, slopes = float(np.abs(x - self._zero).max(initial=0.0)), self.A.T @ y[0]
        low, high = self.lb - self._zero, self.ub - self._zero
        least = self._least()
        kinks = np.abs(np.concatenate([low, high]))
        kinks = np.concatenate([[least, t], kinks[np.isfinite(kinks) & (kinks >= least)]])
        best = np.inf
        for kink in kinks:
            low, high = self._within(kink)
            best = min(best, kink + float((slopes * np.where(slopes > 0.0, low, high)).sum()))
        return (t - (best - float(y[0] @ self.b))) / max(t, 1.0)


@dataclass(frozen=True)
class MinMax:
    """The least largest quantity of all muscles and ideal actuators; of the forces with it those of
    the least squares.

    J. Rasmussen, M. Damsgaard, M. Voigt, "Muscle recruitment by the min/max criterion", Journal of
    Biomechanics 34 (2001), with the second level that makes the answer unique. It is what powers
    come to as they grow.

    Parameters
    ----------
    quantity : Quantity

    Raises
    ------
    ParameterError
        It is not one.
    """

    quantity: Quantity = Quantity.FORCE

    def __post_init__(self) -> None:
        if not isinstance(self.quantity, Quantity):
            raise ParameterError(f"quantity = {self.quantity!r} is not one of {list(Quantity)}")

    def prepare(self, model: MusculoskeletalModel) -> Problems:
        """See `Criterion`.

        Parameters
        ----------
        model : MusculoskeletalModel

        Returns
        -------
        Problems
        """
        return partial(MinMaxProblem, quantity=self.quantity)
