"""Recruitment (10): the forces that share a demanded torque.

    min  sum (F_i / N_i)^2    s.t.  r^T F = Q_m,   F_min <= F <= F_max.

Ideal actuators are among the forces, with their columns as moment arms and their optimal forces as
N. The unknowns of the quadratic program are x = F / N, its rows are scaled to length one.
"""

from __future__ import annotations

import warnings
from contextlib import nullcontext
from copy import copy
from enum import Enum
from typing import NamedTuple

import numpy as np
import qpsolvers
from numpy.typing import ArrayLike
from scipy.optimize import lsq_linear

from ..errors import RecruitmentError
from ..kernel import kernel

# Accepted KKT residual of the scaled problem. DAQP reaches 1e-13, OSQP 1e-9 with these settings.
ACCEPTED = 1e-7
OSQP = {"eps_abs": 1e-8, "eps_rel": 1e-8, "polishing": True, "max_iter": 20000}
# A torque left over counts as unmet above this part of the row's length, the torque of all
# actuators at their normalising forces.
UNMET = 1e-7
# Accepted residual where the demand is out of reach: the run goes on with forces that share the
# nearest torque to 1e-5 of their normalising forces.
ACCEPTED_GAP = 1e-5
# Weight of the squared gap against the squared sizes of what actuators do.
GAP_WEIGHT = 1e8
# And where an actuator is so dear that no solver of quadratic programs copes.
DEAR_GAP = 1e18
# Rounding of large multipliers over their size.
ROUNDING = 1e-12
# Rows this much shorter than the longest one are rounding: arms of 1e-17 m beside some of 1e-2 m.
NOISE = 1e-12
ONE = np.ones(1)


class Solver(Enum):
    """Which solver is asked first; the other one is the second opinion.

    DAQP is exact to rounding. OSQP's noise of up to 1e-8 costs Newton iterations where Exudyn's
    tolerances are tighter.
    """

    DAQP = "daqp"
    OSQP = "osqp"


class Recruitment(NamedTuple):
    """Result of (10).

    `force` F_opt (m,) [N, or N m], `torque` delivered (n,), `unmet` demanded minus delivered torque
    (n,), exactly zero where the demand is met, and the `residual` of the KKT conditions of the
    scaled problem.
    """

    force: np.ndarray
    torque: np.ndarray
    unmet: np.ndarray
    residual: float


class Recruiter:
    """Solves (10).

    Parameters
    ----------
    solver : Solver
    weights : (n,) array_like
        Of the squared gaps of the coordinates where a demand is out of reach.
    """

    def __init__(self, solver: Solver = Solver.DAQP, weights: ArrayLike = 1.0) -> None:
        self._order = (solver, *(other for other in Solver if other is not solver))
        self._weights = np.sqrt(np.asarray(weights) / np.min(weights))

    def solve(
        self, r: np.ndarray, Q_m: np.ndarray, F_min: np.ndarray, F_max: np.ndarray, N: np.ndarray
    ) -> Recruitment:
        """Solve (10); out of reach, deliver the torque that `nearest` finds.

        Parameters
        ----------
        r : (m, n) ndarray
            Moment arms.
        Q_m : (n,) ndarray
            Demanded torques.
        F_min, F_max, N : (m,) ndarray
            Bounds and normalising forces [N, or N m].

        Raises
        ------
        RecruitmentError
            No solver gave an answer with acceptable residuals.
        """
        problem = ScaledProblem(r, Q_m, F_min, F_max, N)
        if not (np.isfinite(problem.A).all() and np.isfinite(problem.b).all()):
            raise RecruitmentError(
                f"the demanded torques {Q_m} or the forces {F_max} N are not finite"
            )
        first, second = self._order
        answer = ask(first, problem)
        if answer is None:
            answer = nearest(problem, self._weights)
            if answer is None or UNMET < problem.gap(answer[0]) < 1e-3:
                # A small gap may be the first solver's own.
                answer = ask(second, problem) or answer
        if answer is None:
            raise RecruitmentError(
                f"no recruitment found for the torques {Q_m} between the forces {F_min} and "
                f"{F_max} N"
            )
        x, residual = answer
        F = np.clip(N * x, F_min, np.maximum(F_min, F_max))
        torque = r.T @ F
        unmet = Q_m - torque
        unmet[np.abs(unmet) <= UNMET * problem.scale] = 0.0
        return Recruitment(F, torque, unmet, residual)


def ask(solver: Solver, problem: ScaledProblem) -> tuple[np.ndarray, float] | None:
    """x and its KKT residual, if the solver has an acceptable answer."""
    if problem.unreachable:
        return None
    options = OSQP if solver is Solver.OSQP else {}
    try:
        with warnings.catch_warnings() if options else nullcontext():
            if options:
                warnings.simplefilter("ignore")  # what it gives up on is judged by its residual
            solution = qpsolvers.solve_problem(problem, solver=solver.value, **options)
    except (qpsolvers.SolverError, ArithmeticError):
        return None
    x, y = solution.x, solution.y
    if x is None or y is None:
        return None
    # A dear actuator that has to do much makes large multipliers; their rounding is in x.
    residual = kkt_residual(x, y, problem.A, problem.b, problem.lb, problem.ub) / rounding(y)
    return (x, residual) if residual <= ACCEPTED else None


def nearest(problem: ScaledProblem, weights: np.ndarray = ONE) -> tuple[np.ndarray, float] | None:
    """The cheapest x whose torque is nearest to the demand, and its KKT residual.

    Nearest in the scaled rows, times their `weights`: every coordinate's gap counts relative to
    what its actuators can do, which also compares torques with forces. First the nearest torque is
    found, by bounded least squares, whatever it costs: `GAP_WEIGHT` weighs the gap against what
    actuators do relative to what they can. Then the cheapest forces for that torque.
    """
    answer = nearest_torque(problem, weights)
    if answer is None:
        return None
    x, residual = answer
    reached = problem.with_torque(problem.A @ x)
    for solver in Solver:
        cheapest = ask(solver, reached)
        if cheapest is not None:
            return cheapest[0], max(residual, cheapest[1])
    x = reached.least_squares(np.ones(x.size), DEAR_GAP)
    return (x, residual) if reached.gap(x) <= UNMET else answer


def nearest_torque(problem: ScaledProblem, weights: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Some x whose torque is nearest to the demand, and its KKT residual.

    DAQP is asked first, then SciPy.
    """
    size = problem.size
    A, b, low, high = problem.in_units_of(size, weights)

    def judged(z: np.ndarray) -> tuple[np.ndarray, float]:
        y = GAP_WEIGHT * (A @ z - b)
        # y is the larger the larger the gap; its rounding is then all that can be asked for.
        return z * size, kkt_residual(z, y, A, A @ z, low, high) / rounding(y)

    penalty = problem.P / GAP_WEIGHT + A.T @ A
    z = qpsolvers.solve_qp(penalty, -A.T @ b, lb=low, ub=high, solver="daqp")
    answer = None if z is None else judged(np.clip(z, low, high))
    if answer is None or not answer[1] <= ACCEPTED:
        answer = judged(problem.least_squares(size, GAP_WEIGHT, weights) / size)
    return answer if answer[1] <= ACCEPTED_GAP else None


def rounding(y: np.ndarray) -> float:
    """What a residual is divided by, from 1 on: the rounding of large multipliers."""
    return max(1.0, ROUNDING / ACCEPTED * np.abs(y).max())


class ScaledProblem(qpsolvers.Problem):
    """min x^2/2 subject to A x = b and bounds, with the rows of A scaled by what their actuators
    can do, or would do at their normalising forces if that is less.

    `scale` (n,) are the rows' lengths before, `size` (m,) the largest |x| that can be of use.
    Coordinates that actuators cross by no more than rounding have none; `unreachable` tells that
    one of these is asked for a torque.
    """

    def __init__(
        self, r: np.ndarray, Q_m: np.ndarray, F_min: np.ndarray, F_max: np.ndarray, N: np.ndarray
    ) -> None:
        A, low = r.T * N, F_min / N
        high = np.maximum(low, F_max / N)
        self.size = _sizes(A, Q_m, low, high)
        able = A * np.minimum(self.size, 1.0)
        self.scale = np.sqrt((able * able).sum(axis=1))
        largest = self.scale.max(initial=0.0)
        idle = self.scale <= NOISE * largest
        self.scale[idle] = largest or 1.0
        A, b = A / self.scale[:, None], Q_m / self.scale
        self.unreachable = bool((np.abs(b[idle]) > UNMET).any())
        A[idle] = 0.0
        if not self.unreachable:
            b[idle] = 0.0
        super().__init__(np.eye(low.size), np.zeros(low.size), A=A, b=b, lb=low, ub=high)

    def with_torque(self, b: np.ndarray) -> ScaledProblem:
        """The same problem for another torque within reach, in scaled rows."""
        other = copy(self)
        other.b, other.unreachable = b, False
        return other

    def in_units_of(
        self, size: np.ndarray, weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A, b and the bounds for x over `size`, with the rows weighted."""
        A, b = (weights * self.A.T).T * size, weights * self.b
        return A, b, self.lb / size, self.ub / size

    def least_squares(
        self, size: np.ndarray, gap_weight: float, weights: np.ndarray = ONE
    ) -> np.ndarray:
        """The x that makes the weighted squared gap and the squares of x over `size` least."""
        A, b, low, high = self.in_units_of(size, weights)
        # Bounded least squares needs an interior; where there is none the value is known.
        movable = high > low
        z = low.copy()
        count = int(movable.sum())
        if count:
            root = np.sqrt(gap_weight)
            left = b - A[:, ~movable] @ z[~movable]
            z[movable] = lsq_linear(
                np.vstack([root * A[:, movable], np.eye(count)]),
                np.concatenate([root * left, np.zeros(count)]),
                (low[movable], high[movable]),
                method="bvls",
                tol=1e-15,
                max_iter=100 * count,
            ).x
        return z * size

    def gap(self, x: np.ndarray) -> float:
        """Largest part of a row by which A x misses b."""
        return float(np.abs(self.A @ x - self.b).max())


def _sizes(A: np.ndarray, Q_m: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The largest |x| (m,): within the bounds, or where there is none what all demands need."""
    size = np.maximum(np.abs(low), np.abs(high))
    for i in np.flatnonzero(np.isinf(size)):
        longest = np.abs(A[:, i]).max()
        size[i] = max(1.0, np.abs(Q_m).max() / longest) if longest > 0.0 else 1.0
    size[size == 0.0] = 1.0
    return size


@kernel
def kkt_residual(x, y, A, b, low, high):
    """Largest violation of A x = b and x = clip(-A^T y, low, high); NaN if any number is NaN."""
    worst = 0.0
    for j in range(b.size):
        error = -b[j]
        for i in range(x.size):
            error += A[j, i] * x[i]
        if abs(error) > worst or np.isnan(error):
            worst = abs(error)
    for i in range(x.size):
        free = 0.0
        for j in range(b.size):
            free -= A[j, i] * y[j]
        # 0 * free: a multiplier that is not finite must not disappear behind a bound.
        error = x[i] - min(max(free, low[i]), high[i]) + 0.0 * free
        if abs(error) > worst or np.isnan(error):
            worst = abs(error)
    return worst
