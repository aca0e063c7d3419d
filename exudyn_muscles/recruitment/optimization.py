"""Recruitment (10): the forces that share a demanded torque.

    min  sum (F_i / N_i)^2 + sum (tau_r / opt_r)^2
    s.t. r^T F + S tau_r = Q_m,   F_min <= F <= F_max,   tau_r within its limits,

with ideal reserve actuators tau_r if the model has any. The unknowns of the quadratic program are
x = (F / N, tau_r / opt), its rows are scaled to length one.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
import qpsolvers
from scipy.optimize import lsq_linear

from ..checks import number_within
from ..errors import ParameterError, RecruitmentError
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
# Weight of the squared gap against the cost where the demand is out of reach.
GAP_WEIGHT = 1e8
# Rounding of the multipliers of that problem over their size, with Hessians of condition 1e8.
ROUNDING = 1e-12


class Solver(Enum):
    """Which solver is asked first; the other one is the second opinion.

    DAQP is exact to rounding. OSQP's noise of up to 1e-8 costs Newton iterations where Exudyn's
    tolerances are tighter.
    """

    DAQP = "daqp"
    OSQP = "osqp"


@dataclass(frozen=True)
class Reserve:
    """An ideal torque on one coordinate that helps where the muscles do not suffice.

    Parameters
    ----------
    coordinate : str
        The coordinate's name in the model.
    optimal_force : float
        Torque [N m] or force [N] at control 1: the larger, the cheaper.
    min_control, max_control : float
        Limits of torque over optimal force.

    Raises
    ------
    ParameterError
        The optimal force is not positive and finite, or the limits do not enclose zero.
    """

    coordinate: str
    optimal_force: float
    min_control: float = -np.inf
    max_control: float = np.inf

    def __post_init__(self) -> None:
        name = f"reserve on '{self.coordinate}':"
        number_within(f"{name} optimal_force", self.optimal_force, 1e-9, 1e9)
        try:
            enclosed = self.min_control <= 0.0 <= self.max_control
        except TypeError:
            enclosed = False
        if not enclosed:
            raise ParameterError(
                f"{name} controls [{self.min_control!r}, {self.max_control!r}] must enclose 0"
            )


class Recruitment(NamedTuple):
    """Result of (10).

    `force` F_opt (m,) [N], `reserve` (k,) [N m], `torque` delivered (n,), `unmet` demanded minus
    delivered torque (n,), exactly zero where the demand is met, and the `residual` of the KKT
    conditions of the scaled problem.
    """

    force: np.ndarray
    reserve: np.ndarray
    torque: np.ndarray
    unmet: np.ndarray
    residual: float


def reserve_columns(coordinates: Sequence[str], reserves: Sequence[Reserve]) -> np.ndarray:
    """S (n, r): 1 where reserve k acts on coordinate j.

    Raises
    ------
    ParameterError
        A reserve acts on a coordinate that does not exist.
    """
    S = np.zeros((len(coordinates), len(reserves)))
    for k, reserve in enumerate(reserves):
        if reserve.coordinate not in coordinates:
            raise ParameterError(
                f"reserve on '{reserve.coordinate}': the coordinates are {list(coordinates)}"
            )
        S[list(coordinates).index(reserve.coordinate), k] = 1.0
    return S


class Recruiter:
    """Solves (10) for one model.

    Parameters
    ----------
    coordinates : sequence of str
        Names of the n coordinates.
    reserves : sequence of Reserve
    solver : Solver
    """

    def __init__(
        self, coordinates: Sequence[str], reserves: Sequence[Reserve] = (), solver=Solver.DAQP
    ) -> None:
        self._order = (solver, *(other for other in Solver if other is not solver))
        self._optimal = np.array([reserve.optimal_force for reserve in reserves])
        self._columns = reserve_columns(coordinates, reserves) * self._optimal
        self._low = np.array([reserve.min_control for reserve in reserves])
        self._high = np.array([reserve.max_control for reserve in reserves])

    def build(
        self, r: np.ndarray, Q_m: np.ndarray, F_min: np.ndarray, F_max: np.ndarray, N: np.ndarray
    ) -> ScaledProblem:
        """The quadratic program of (10).

        Parameters
        ----------
        r : (m, n) ndarray
            Moment arms.
        Q_m : (n,) ndarray
            Demanded torques.
        F_min, F_max, N : (m,) ndarray
            Bounds and normalising forces [N].
        """
        A = r.T * N
        low, high = F_min / N, F_max / N
        if self._optimal.size:
            A = np.hstack([A, self._columns])
            low, high = np.concatenate([low, self._low]), np.concatenate([high, self._high])
        return ScaledProblem(A, Q_m, low, high)

    def solve(
        self, r: np.ndarray, Q_m: np.ndarray, F_min: np.ndarray, F_max: np.ndarray, N: np.ndarray
    ) -> Recruitment:
        """Solve (10); out of reach, deliver the torque that `nearest` finds.

        Raises
        ------
        RecruitmentError
            No solver gave an answer with acceptable residuals.
        """
        problem = self.build(r, Q_m, F_min, F_max, N)
        if not (np.isfinite(problem.A).all() and np.isfinite(problem.b).all()):
            raise RecruitmentError(
                f"the demanded torques {Q_m} or the forces {F_max} N are not finite"
            )
        first, second = self._order
        answer = ask(first, problem)
        if answer is None:
            answer = nearest(problem)
            if answer is None or UNMET < problem.gap(answer[0]) < 1e-3:
                # A small gap may be the first solver's own.
                answer = ask(second, problem) or answer
        if answer is None:
            raise RecruitmentError(
                f"no recruitment found for the torques {Q_m} between the forces {F_min} and "
                f"{F_max} N"
            )
        x, residual = answer
        m = N.size
        F = np.clip(N * x[:m], F_min, np.maximum(F_min, F_max))
        reserve = self._optimal * x[m:]
        torque = r.T @ F
        if reserve.size:
            torque += self._columns @ x[m:]
        unmet = Q_m - torque
        unmet[np.abs(unmet) <= UNMET * problem.scale] = 0.0
        return Recruitment(F, reserve, torque, unmet, residual)


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
    if solution.x is None or solution.y is None:
        return None
    residual = kkt_residual(solution.x, solution.y, problem.A, problem.b, problem.lb, problem.ub)
    return (solution.x, residual) if residual <= ACCEPTED else None


def nearest(problem: ScaledProblem) -> tuple[np.ndarray, float] | None:
    """The cheapest x whose torque is nearest to the demand, and its KKT residual.

    Nearest in the scaled rows: every coordinate's gap counts relative to what its actuators can do,
    which also compares torques with forces. The gap is weighted so heavily against the cost that a
    demand within reach is met to 1e-8 of a row. DAQP is asked first, then bounded least squares.
    """
    A, b, low, high = problem.A, problem.b, problem.lb, problem.ub

    def judged(x: np.ndarray) -> tuple[np.ndarray, float]:
        y = GAP_WEIGHT * (A @ x - b)
        residual = kkt_residual(x, y, A, A @ x, low, high)
        # y is the larger the larger the gap; its rounding is then all that can be asked for.
        return x, residual / max(1.0, ROUNDING / ACCEPTED * np.abs(y).max())

    penalty = problem.P / GAP_WEIGHT + A.T @ A
    x = qpsolvers.solve_qp(penalty, -A.T @ b, lb=low, ub=high, solver="daqp")
    answer = None if x is None else judged(np.clip(x, low, high))
    if answer is None or not answer[1] <= ACCEPTED:
        # Bounded least squares needs an interior; where there is none the value is known.
        movable = high > low
        x = low.copy()
        size = int(movable.sum())
        if size:
            root = np.sqrt(GAP_WEIGHT)
            left = b - A[:, ~movable] @ x[~movable]
            x[movable] = lsq_linear(
                np.vstack([root * A[:, movable], np.eye(size)]),
                np.concatenate([root * left, np.zeros(size)]),
                (low[movable], high[movable]),
                method="bvls",
                tol=1e-15,
                max_iter=100 * size,
            ).x
        answer = judged(x)
    return answer if answer[1] <= ACCEPTED_GAP else None


class ScaledProblem(qpsolvers.Problem):
    """min x^2/2 subject to A x = b and bounds, with the rows of A scaled to length one.

    `scale` (n,) are the rows' lengths before; `unreachable` tells that a coordinate without any
    actuator is asked for a torque.
    """

    def __init__(self, A: np.ndarray, b: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
        self.scale = np.sqrt((A * A).sum(axis=1))
        idle = self.scale == 0.0
        self.scale[idle] = 1.0
        self.unreachable = bool((b[idle] != 0.0).any())
        super().__init__(
            np.eye(low.size),
            np.zeros(low.size),
            A=A / self.scale[:, None],
            b=b / self.scale,
            lb=low,
            ub=np.maximum(low, high),
        )

    def gap(self, x: np.ndarray) -> float:
        """Largest part of a row by which A x misses b."""
        return float(np.abs(self.A @ x - self.b).max())


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
