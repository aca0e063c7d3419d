"""The scaled quadratic program of a recruitment, and the forces that its solution stands for."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np

from ..numerics.kernel import kernel
from .certificate import ROUNDING, kkt_residual
from .demand import Demand
from .program import Program

# A torque left over counts as unmet above this part of what the row's actuators can do, at their
# normalising forces at most.
UNMET = 1e-7
# Arms this much shorter than the longest one are rounding: 1e-17 m beside 1e-2 m.
NOISE = 1e-12
# How far a solver's x is from a bound that it is at, at most.
CLOSE = 1e-10
# Rounding of a demand [N m or N] where nothing acts, and over the largest demand.
NOTHING, OF_LARGEST = 1e-12, 2.0**-50


# The unknowns (m,) and the multipliers of the rows (n,), if there is a solution.
Answer = tuple[np.ndarray, np.ndarray] | None


class Recruitment(NamedTuple):
    """Result of (10).

    `force` F_opt (m,) [N, or N m], `torque` delivered (n,), `unmet` demanded minus delivered torque
    (n,), exactly zero where the demand is met, and the `residual` of the optimality conditions:
    that of `kkt_residual`, or out of reach those of `two_levels`. `met` says that all of it is,
    `at_bounds` (m,) are -1 where a force is the lowest, 1 where it is the highest and else 0.
    `preferred` that the forces are what the criterion prefers: if its problem is not solved, they
    are those of the least squares.
    """

    force: np.ndarray
    torque: np.ndarray
    unmet: np.ndarray
    residual: float
    met: bool
    at_bounds: np.ndarray
    preferred: bool


class ScaledProblem(Program):
    """min x^2/2 subject to A x = b and bounds, with the rows of A scaled by what their actuators
    can do, or would do at their normalising forces if that is less.

    Of another cost its `gradient` and how it is `solved` are another one's, and it is not
    `of_squares`: then it is asked once more, for the nearest torque, where the demand is out of
    reach.

    Parameters
    ----------
    demand : Demand

    Attributes
    ----------
    near : (m,) int ndarray or None
        The demand's.
    scale : (n,) ndarray
        The rows' lengths before. Coordinates that actuators cross by no more than rounding have
        none, and rows of zeros.
    accepted : float
        The residual up to which an answer is taken if a solver's own limit is less.
    unreachable, finite : bool
        That one of these is asked for a torque; that all numbers of A and b are finite.
    """

    accepted = 0.0
    of_squares = True

    def __init__(self, demand: Demand) -> None:
        r, Q_m, F_min, F_max, N = given = demand[:5]
        m, n = r.shape
        A, b, (low, high, size) = np.empty((n, m)), np.empty(n), np.empty((3, m))
        self.scale, idle = np.empty(n), np.empty(n, dtype=np.bool_)
        self._nothing, self.unreachable, self.finite = scale_rows(
            r, Q_m, F_min, F_max, N, A, b, low, high, size, self.scale, idle
        )
        self._given, self._size, self._idle = given, size, idle
        self.A, self.b, self.lb, self.ub, self.near = A, b, low, high, demand.near

    @cached_property
    def P(self) -> np.ndarray:  # type: ignore[override]
        """The unit matrix, which not all solvers ask for."""
        return np.eye(self.lb.size)

    @cached_property
    def q(self) -> np.ndarray:  # type: ignore[override]
        """Zeros."""
        return np.zeros(self.lb.size)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """How the cost grows with every unknown (m,)."""
        return x

    def program(self, P: np.ndarray, q: np.ndarray) -> Program:
        """min x P x / 2 + q x subject to the same rows and bounds."""
        return Program(P, q, A=self.A, b=self.b, lb=self.lb, ub=self.ub)

    def solved(self, ask: Callable[[Program], Answer]) -> Answer:
        """The solution, of a solver that can be asked for that of any quadratic program."""
        return ask(self)

    def residual(self, x: np.ndarray, y: np.ndarray) -> float:
        """What the optimality conditions say of an answer."""
        return kkt_residual(x, self.gradient(x), y, self.A, self.b, self.lb, self.ub)

    def narrowed(self, x: np.ndarray, loose: np.ndarray) -> Self:
        """The same cost for the torque of `x` (m,), of which only those that are `loose` (m,) may
        differ."""
        problem = copy(self)
        problem.b = self.A @ x
        problem.lb, problem.ub = np.where(loose, self.lb, x), np.where(loose, self.ub, x)
        return problem

    def without_noise(self) -> np.ndarray:
        """A (n, m) with zeros in place of arms that are rounding."""
        arms = np.abs(self._given[0].T)
        return np.ascontiguousarray(np.where(arms <= NOISE * arms.max(), 0.0, self.A))

    def recruited(self, x: np.ndarray, residual: float, *, preferred: bool = True) -> Recruitment:
        """The forces that `x` stands for, and what they deliver."""
        r, Q_m, F_min, F_max, N = self._given
        F, at_bounds = np.empty(x.size), np.empty(x.size, dtype=np.int8)
        forces(x, N, F_min, F_max, F, at_bounds)
        torque = r.T @ F
        unmet = Q_m - torque
        met = drop_below(unmet, self._nothing)
        if not met:
            unmet[np.abs(unmet) <= self._tolerance(F)] = 0.0
            met = not unmet.any()
        return Recruitment(F, torque, unmet, residual, met, at_bounds, preferred)

    def _tolerance(self, F: np.ndarray) -> np.ndarray:
        """Those of `gap_tolerances`."""
        r, tolerances = self._given[0], np.empty(self.b.size)
        gap_tolerances(
            r, F, self.A, self.scale, self._size, self.lb, self.ub, self._idle, self._nothing,
            tolerances,
        )  # fmt: skip
        return tolerances


@kernel
def all_usable(N):
    """Whether normalising forces N (m,) are all positive and finite."""
    usable = True
    for i in range(N.size):
        usable = usable and 0.0 < N[i] < np.inf
    return usable


@kernel
def scale_rows(r, Q_m, F_min, F_max, N, A, b, low, high, size, scale, idle):
    """Write the scaled problem of a `Demand`: A (n, m), b (n,), the bounds
    (m,), the rows' `scale` (n,) and which of them are `idle`; `size` (m,) are the largest |x|.

    Returns the torque that is nothing, whether an idle row is asked for more, and whether all of A
    and b is finite.
    """
    m, n = r.shape
    demand, longest = 0.0, 0.0
    for j in range(n):
        demand = np.maximum(demand, abs(Q_m[j]))
        for i in range(m):
            longest = np.maximum(longest, abs(r[i, j]))
            A[j, i] = r[i, j] * N[i]
    for i in range(m):
        low[i] = F_min[i] / N[i]
        high[i] = np.maximum(low[i], F_max[i] / N[i])
        size[i] = _largest(A, i, low[i], high[i], demand)
    nothing = max(NOTHING, OF_LARGEST * demand)
    unreachable, finite = False, True
    for j in range(n):
        arm, square = 0.0, 0.0
        for i in range(m):
            arm = np.maximum(arm, abs(r[i, j]))
            able = A[j, i] * np.minimum(size[i], 1.0)
            square += able * able
        idle[j] = arm <= NOISE * longest
        scale[j] = 1.0 if idle[j] else math.sqrt(square)
        b[j] = Q_m[j] / scale[j]
        for i in range(m):
            A[j, i] = 0.0 if idle[j] else A[j, i] / scale[j]
            finite = finite and np.isfinite(A[j, i])
        if idle[j]:
            unreachable = unreachable or abs(Q_m[j]) > nothing
            b[j] = 0.0
        finite = finite and np.isfinite(b[j])
    return nothing, unreachable, finite


@kernel
def _largest(A, i, low, high, demand):
    """The largest |x|: within the bounds, or where there is none what the largest demand needs.

    What is unlimited loses its arms that are rounding in A.
    """
    size = np.maximum(abs(low), abs(high))
    if np.isinf(size):
        longest = 0.0
        for j in range(A.shape[0]):
            longest = np.maximum(longest, abs(A[j, i]))
        size = max(1.0, demand / longest) if longest > 0.0 else 1.0
        for j in range(A.shape[0]):
            if abs(A[j, i]) <= NOISE * longest:
                A[j, i] = 0.0
    return 1.0 if size == 0.0 else size


@kernel
def forces(x, N, F_min, F_max, F, at_bounds):
    """Write the forces F (m,) within the bounds that `x` (m,) stands for, and at which it is."""
    for i in range(x.size):
        low, high = F_min[i], max(F_min[i], F_max[i])
        F[i] = min(max(N[i] * x[i], low), high)
        close = CLOSE * N[i]
        at_bounds[i] = -1 if F[i] <= low + close else int(F[i] >= high - close)


@kernel
def drop_below(values, nothing):
    """Write zero over all `values` whose size is no more than `nothing`; returns whether that is
    true of all of them."""
    every = True
    for j in range(values.size):
        if abs(values[j]) <= nothing:
            values[j] = 0.0
        else:
            every = False
    return every


@kernel
def gap_tolerances(r, F, A, scale, size, low, high, idle, nothing, tolerances):
    """Write up to where torques (n,) are no gap: of what a row's actuators can do, and of rounding
    in the torque of `F` (m,), all of which is rounding where a row is `idle`."""
    for j in range(tolerances.size):
        square, terms = 0.0, 0.0
        for i in range(F.size):
            terms += abs(r[i, j]) * abs(F[i])
            if not (low[i] == 0.0 and high[i] == 0.0):
                able = A[j, i] * scale[j] * min(size[i], 1.0)
                square += able * able
        if not idle[j]:
            terms *= ROUNDING
        tolerances[j] = max(UNMET * math.sqrt(square), nothing + terms)
