"""Recruitment (10): the forces that share a demanded torque.

    min  sum (F_i / N_i)^2    s.t.  r^T F = Q_m,   F_min <= F <= F_max.

Ideal actuators are among the forces, with their columns as moment arms and their optimal forces as
N. The unknowns of the quadratic program are x = F / N, its rows are scaled to length one.
"""

from __future__ import annotations

import warnings
from enum import Enum
from typing import NamedTuple

import daqp
import numpy as np
import qpsolvers
from numpy.typing import ArrayLike

from ..errors import RecruitmentError
from ..kernel import kernel
from .nearest import two_levels

# Accepted KKT residual of the scaled problem. DAQP reaches 1e-13, OSQP 1e-9 with these settings.
ACCEPTED = 1e-7
OSQP = {"eps_abs": 1e-8, "eps_rel": 1e-8, "polishing": True, "max_iter": 20000}
# DAQP's infinity, and its mark of a row that is an equality.
UNBOUNDED, EQUALITY = 1e30, 5
# And of the nearest torque, over the terms that it is the sum of.
ACCEPTED_NEAREST = 1e-12
# A torque left over counts as unmet above this part of what the row's actuators can do, at their
# normalising forces at most.
UNMET = 1e-7
# Rounding of sums over the sizes of their terms: it is then all that can be asked for.
ROUNDING = 1e-12
# Arms this much shorter than the longest one are rounding: 1e-17 m beside 1e-2 m.
NOISE = 1e-12
# Rounding of a demand [N m or N] where nothing acts, and over the largest demand.
NOTHING, OF_LARGEST = 1e-12, 2.0**-50


class Solver(Enum):
    """Which solver is asked first; where it has no acceptable answer, `nearest` finds one.

    DAQP is exact to rounding. OSQP's noise of up to 1e-8 costs Newton iterations where Exudyn's
    tolerances are tighter.
    """

    DAQP = "daqp"
    OSQP = "osqp"


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


class Recruiter:
    """Solves (10).

    Parameters
    ----------
    solver : Solver
    weights : (n,) array_like
        Of the squared gaps of the coordinates where a demand is out of reach.
    """

    def __init__(self, solver: Solver = Solver.DAQP, weights: ArrayLike = 1.0) -> None:
        self._solver = solver
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
            Something is not finite, or as `nearest`.
        """
        problem = ScaledProblem(r, Q_m, F_min, F_max, N)
        if not (np.isfinite(problem.A).all() and np.isfinite(problem.b).all()):
            raise RecruitmentError(
                f"the demanded torques {Q_m} or the forces {F_max} N are not finite"
            )
        answer = ask(self._solver, problem)
        if answer is not None:
            found = problem.recruited(*answer)
            if not found.unmet.any():
                return found
        # Out of reach, or within it but not for a solver of limited precision.
        return problem.recruited(*nearest(problem, self._weights))


def ask(solver: Solver, problem: ScaledProblem) -> tuple[np.ndarray, float] | None:
    """x and its KKT residual, if the solver has an acceptable answer."""
    if problem.unreachable:
        return None
    answer = SOLVERS[solver](problem)
    if answer is None:
        return None
    residual = kkt_residual(*answer, problem.A, problem.b, problem.lb, problem.ub)
    return (answer[0], residual) if residual <= OF_SOLVER[solver] else None


Answer = tuple[np.ndarray, np.ndarray] | None


def _ask_daqp(problem: ScaledProblem) -> Answer:
    """x and the multipliers of its rows.

    Asked itself: through qpsolvers a Ctrl-C can end within ctypes, which swallow it.
    """
    n, m = problem.A.shape
    high, low = np.concatenate([problem.ub, problem.b]), np.full(m + n, -UNBOUNDED)
    low[:m] = problem.lb
    sense = np.zeros(m + n, np.intc)
    sense[m:] = EQUALITY
    x, _, found, info = daqp.solve(problem.P, problem.q, problem.A, high, low, sense)
    return (x, info["lam"][m:]) if found > 0 else None


def _ask_osqp(problem: ScaledProblem) -> Answer:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what it gives up on is judged by its residual
            solution = qpsolvers.solve_problem(problem, solver="osqp", **OSQP)
    except (qpsolvers.SolverError, ArithmeticError):
        return None
    return None if solution.x is None or solution.y is None else (solution.x, solution.y)


SOLVERS = {Solver.DAQP: _ask_daqp, Solver.OSQP: _ask_osqp}
# The residual up to which its answer is taken. That of DAQP is rounding, below 1e-13; where it is
# not, at the very edge of what is within reach, `nearest` is a million times as exact.
OF_SOLVER = {Solver.DAQP: 1e-10, Solver.OSQP: ACCEPTED}


def nearest(problem: ScaledProblem, weights: np.ndarray) -> tuple[np.ndarray, float]:
    """The cheapest x whose torque is nearest to the demand, and its residual.

    Nearest in the scaled rows, times their `weights` (n,): every coordinate's gap counts relative
    to what its actuators can do, which also compares torques with forces.

    Raises
    ------
    RecruitmentError
        The nearest torque's residual is not acceptable, as of demands whose squares overflow.
    """
    x = np.empty(problem.lb.size)
    first, second = two_levels(
        problem.without_noise(), problem.b, problem.lb, problem.ub,
        weights + np.zeros(problem.b.size), x,
    )  # fmt: skip
    if not (first <= ACCEPTED_NEAREST and np.isfinite(x).all()):
        raise RecruitmentError(
            f"no nearest torque found for {problem.b * problem.scale}, residual {first:.3g}"
        )
    return x, max(first, second)


class ScaledProblem(qpsolvers.Problem):
    """min x^2/2 subject to A x = b and bounds, with the rows of A scaled by what their actuators
    can do, or would do at their normalising forces if that is less.

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


@kernel
def kkt_residual(x, y, A, b, low, high):
    """Largest violation of A clip(x, low, high) = b and x = clip(-A^T y, low, high), each over the
    rounding of its terms if these are large; NaN if any number is NaN."""
    worst = 0.0
    for j in range(b.size):
        error, terms = -b[j], abs(b[j])
        for i in range(x.size):
            part = A[j, i] * min(max(x[i], low[i]), high[i])
            error += part
            terms += abs(part)
        error = abs(error) / max(1.0, ROUNDING / ACCEPTED * terms)
        if error > worst or np.isnan(error):
            worst = error
    for i in range(x.size):
        free, terms = 0.0, 0.0
        for j in range(b.size):
            free -= A[j, i] * y[j]
            terms += abs(A[j, i] * y[j])
        # 0 * free: a multiplier that is not finite must not disappear behind a bound.
        error = x[i] - min(max(free, low[i]), high[i]) + 0.0 * free
        error = abs(error) / max(1.0, ROUNDING / ACCEPTED * terms)
        if error > worst or np.isnan(error):
            worst = error
    return worst
