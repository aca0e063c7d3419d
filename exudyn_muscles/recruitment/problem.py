"""The scaled quadratic program of a recruitment, and the forces that its solution stands for."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import qpsolvers

# A torque left over counts as unmet above this part of what the row's actuators can do, at their
# normalising forces at most.
UNMET = 1e-7
# Rounding of sums over the sizes of their terms: it is then all that can be asked for.
ROUNDING = 1e-12
# Arms this much shorter than the longest one are rounding: 1e-17 m beside 1e-2 m.
NOISE = 1e-12
# Rounding of a demand [N m or N] where nothing acts, and over the largest demand.
NOTHING, OF_LARGEST = 1e-12, 2.0**-50


# The unknowns (m,) and the multipliers of the rows (n,), if there is a solution.
Answer = tuple[np.ndarray, np.ndarray] | None


class Recruitment(NamedTuple):
    """Result of (10).

    `force` F_opt (m,) [N, or N m], `torque` delivered (n,), `unmet` demanded minus delivered torque
    (n,), exactly zero where the demand is met, and the `residual` of the optimality conditions:
    that of `kkt_residual`, or out of reach those of `two_levels`.
    """

    force: np.ndarray
    torque: np.ndarray
    unmet: np.ndarray
    residual: float


class ScaledProblem(qpsolvers.Problem):
    """min x^2/2 subject to A x = b and bounds, with the rows of A scaled by what their actuators
    can do, or would do at their normalising forces if that is less.

    Of another cost its `gradient` and how it is `solved` are another one's.

    `scale` (n,) are the rows' lengths before. Coordinates that actuators cross by no more than
    rounding have none, and rows of zeros; `unreachable` tells that one of these is asked for a
    torque.
    """

    def __init__(
        self, r: np.ndarray, Q_m: np.ndarray, F_min: np.ndarray, F_max: np.ndarray, N: np.ndarray
    ) -> None:
        A, low = r.T * N, F_min / N
        high = np.maximum(low, F_max / N)
        size = _sizes(A, Q_m, low, high)
        able = A * np.minimum(size, 1.0)
        self.scale = np.sqrt((able * able).sum(axis=1))
        arms = np.abs(r)
        idle = arms.max(axis=0) <= NOISE * arms.max()
        self.scale[idle] = 1.0
        A, b = A / self.scale[:, None], Q_m / self.scale
        nothing = max(NOTHING, OF_LARGEST * np.abs(Q_m).max())
        self.unreachable = bool((np.abs(Q_m[idle]) > nothing).any())
        A[idle] = b[idle] = 0.0
        self._given, self._size = (r, Q_m, F_min, F_max, N), size
        self._idle, self._nothing = idle, nothing
        super().__init__(np.eye(low.size), np.zeros(low.size), A=A, b=b, lb=low, ub=high)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """How the cost grows with every unknown (m,)."""
        return x

    def solved(self, ask: Callable[[qpsolvers.Problem], Answer]) -> Answer:
        """The solution, of a solver that can be asked for that of any quadratic program."""
        return ask(self)

    def without_noise(self) -> np.ndarray:
        """A (n, m) with zeros in place of arms that are rounding."""
        arms = np.abs(self._given[0].T)
        return np.ascontiguousarray(np.where(arms <= NOISE * arms.max(), 0.0, self.A))

    def recruited(self, x: np.ndarray, residual: float) -> Recruitment:
        """The forces that `x` stands for, and what they deliver."""
        r, Q_m, F_min, F_max, N = self._given
        F = np.clip(N * x, F_min, np.maximum(F_min, F_max))
        torque = r.T @ F
        unmet = Q_m - torque
        met = np.abs(unmet) <= self._nothing
        if not met.all():
            met |= np.abs(unmet) <= self._tolerance(F)
        unmet[met] = 0.0
        return Recruitment(F, torque, unmet, residual)

    def _tolerance(self, F: np.ndarray) -> np.ndarray:
        """Up to where torques (n,) are no gap: of what a row's actuators can do, and of rounding in
        the torque of `F`, all of which is rounding where nothing acts."""
        able = self.A * self.scale[:, None] * np.minimum(self._size, 1.0)
        able[:, (self.lb == 0.0) & (self.ub == 0.0)] = 0.0
        terms = np.abs(self._given[0].T) @ np.abs(F)
        terms[~self._idle] *= ROUNDING
        return np.maximum(UNMET * np.sqrt((able * able).sum(axis=1)), self._nothing + terms)


def _sizes(A: np.ndarray, Q_m: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The largest |x| (m,): within the bounds, or where there is none what all demands need.

    What is unlimited loses its arms that are rounding in A.
    """
    size = np.maximum(np.abs(low), np.abs(high))
    for i in np.flatnonzero(np.isinf(size)):
        arms = np.abs(A[:, i])
        longest = arms.max()
        size[i] = max(1.0, np.abs(Q_m).max() / longest) if longest > 0.0 else 1.0
        A[arms <= NOISE * longest, i] = 0.0
    size[size == 0.0] = 1.0
    return size
