"""Recruitment (10): the forces that share a demanded torque.

    min  sum (F_i / N_i)^2    s.t.  r^T F = Q_m,   F_min <= F <= F_max.

Ideal actuators are among the forces, with their columns as moment arms and their optimal forces as
N. The unknowns of the quadratic program are x = F / N, its rows are scaled to length one.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from enum import Enum
from functools import partial

import daqp
import numpy as np
from numpy.typing import ArrayLike

from ..errors import RecruitmentError
from .certificate import ACCEPTED
from .demand import Demand
from .from_bounds import from_bounds
from .nearest import two_levels
from .problem import Answer, Recruitment, ScaledProblem
from .program import Program

# Close enough for the certificate.
OSQP = {"eps_abs": 1e-8, "eps_rel": 1e-8, "polishing": True, "max_iter": 20000}
# DAQP's infinity, and its mark of a row that is an equality.
UNBOUNDED, EQUALITY = 1e30, 5
# How far DAQP may pass a bound: its default, and what sequences of programs need to come to an
# end. Where it has passed one by more than WITHIN, at the edge of what is within reach, its answer
# is not good enough, and it is asked for an exact one.
USUAL, EXACT, WITHIN = 1e-6, 1e-12, 1e-10
# And of the nearest torque, over the terms that it is the sum of.
ACCEPTED_NEAREST = 1e-12


class Solver(Enum):
    """Which solver is asked first; where it has no acceptable answer, `nearest` finds one.

    DAQP is exact to rounding. Within a run it is only asked where the bounds that forces were at
    before do not lead to the solution. OSQP's noise of up to 1e-8 costs Newton iterations where
    Exudyn's tolerances are tighter.
    """

    DAQP = "daqp"
    OSQP = "osqp"


class Recruiter:
    """Solves (10).

    Parameters
    ----------
    solver : Solver
    weights : (n,) array_like
        Of the squared gaps of the coordinates where a demand is out of reach.
    problem_of : callable
        What makes a problem of a `Demand`, as `Criterion.prepare` returns it.
    """

    def __init__(
        self,
        solver: Solver = Solver.DAQP,
        weights: ArrayLike = 1.0,
        problem_of: Callable[[Demand], ScaledProblem] = ScaledProblem,
    ) -> None:
        self._ask = partial(ask, solver, OF_SOLVER[solver])
        self._problem_of = problem_of
        self._weights = np.sqrt(np.asarray(weights) / np.min(weights))

    def solve(self, demand: Demand) -> Recruitment:
        """Solve (10); out of reach, deliver the torque that `nearest` finds.

        Raises
        ------
        RecruitmentError
            Something is not finite, or as `nearest`.
        """
        problem = self._problem_of(demand)
        if not problem.finite:
            raise RecruitmentError(
                f"the demanded torques {demand.Q_m} or the forces {demand.F_max} N are not finite"
            )
        answer = None if problem.unreachable else self._ask(problem)
        if answer is not None:
            found = problem.recruited(*answer)
            if found.met:
                return found
        # Out of reach, or within it but not for a solver of limited precision.
        x, residual, loose = nearest(problem, self._weights)
        if problem.of_squares or _only_one(problem.A[:, loose]):
            return problem.recruited(x, residual)
        # It is another cost than that of squares that is to be least.
        answer = self._ask(problem.narrowed(x, loose))
        if answer is None:
            return problem.recruited(x, residual, preferred=False)
        return problem.recruited(*answer)


def _only_one(A: np.ndarray) -> bool:
    """Whether A x = b has one solution at most."""
    return A.shape[1] == 0 or int(np.linalg.matrix_rank(A)) == A.shape[1]


def ask(solver: Solver, accepted: float, problem: ScaledProblem) -> tuple[np.ndarray, float] | None:
    """x and its KKT residual, of the first answer with one of `accepted` at most: from bounds that
    forces are likely to be at, of least squares beside DAQP, or of the solver."""
    solvers = [SOLVERS[solver]]
    if solver is Solver.DAQP and problem.of_squares and problem.near is not None:
        solvers.insert(0, partial(_from_bounds, problem.near))
    for solve in solvers:
        answer = problem.solved(solve)
        if answer is not None:
            residual = problem.residual(*answer)
            if residual <= max(accepted, problem.accepted):
                return answer[0], residual
    return None


def _from_bounds(near: np.ndarray, problem: Program) -> Answer:
    x, y, found = from_bounds(problem.A, problem.b, problem.lb, problem.ub, near)
    return (x, y) if found else None


def _ask_daqp(problem: Program) -> Answer:
    for passed in (USUAL, EXACT) if isinstance(problem, ScaledProblem) else (EXACT,):
        answer = _daqp_within(problem, passed)
        if answer is None or _is_within(problem, answer[0]):
            break
    return answer


def _is_within(problem: Program, x: np.ndarray) -> bool:
    """Whether it has passed no bound."""
    return bool((x >= problem.lb - WITHIN).all() and (x <= problem.ub + WITHIN).all())


def _daqp_within(problem: Program, passed: float) -> Answer:
    """Asked itself: through qpsolvers a Ctrl-C can end within ctypes, which swallow it."""
    (n, m), A, upper = problem.A.shape, problem.A, np.concatenate([problem.ub, problem.b])
    if problem.G is not None:
        A, upper = np.vstack([A, problem.G]), np.concatenate([upper, problem.h])
    low = np.full(upper.size, -UNBOUNDED)
    low[:m] = problem.lb
    sense = np.zeros(upper.size, np.intc)
    sense[m : m + n] = EQUALITY
    x, _, found, info = daqp.solve(problem.P, problem.q, A, upper, low, sense, primal_tol=passed)
    return (x, info["lam"][m : m + n]) if found > 0 else None


def _ask_osqp(problem: Program) -> Answer:
    import qpsolvers  # slow to import, and not needed for DAQP

    names = ("P", "q", "G", "h", "A", "b", "lb", "ub")
    same = qpsolvers.Problem(*(getattr(problem, name) for name in names))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what it gives up on is judged by its residual
            solution = qpsolvers.solve_problem(same, solver="osqp", **OSQP)
    except (qpsolvers.SolverError, ArithmeticError):
        return None
    return None if solution.x is None or solution.y is None else (solution.x, solution.y)


SOLVERS = {Solver.DAQP: _ask_daqp, Solver.OSQP: _ask_osqp}
# The residual up to which its answer is taken. That of DAQP is rounding, below 1e-13; where it is
# not, at the very edge of what is within reach, `nearest` is a million times as exact.
OF_SOLVER = {Solver.DAQP: 1e-10, Solver.OSQP: ACCEPTED}


def nearest(problem: ScaledProblem, weights: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """The x (m,) of the least squares whose torque is nearest to the demand, its residual, and
    which of its unknowns may change without the torque becoming less near (m,).

    Nearest in the scaled rows, times their `weights` (n,): every coordinate's gap counts relative
    to what its actuators can do, which also compares torques with forces.

    Raises
    ------
    RecruitmentError
        The nearest torque's residual is not acceptable, as of demands whose squares overflow.
    """
    x, loose = np.empty(problem.lb.size), np.empty(problem.lb.size, dtype=np.bool_)
    first, second = two_levels(
        problem.without_noise(), problem.b, problem.lb, problem.ub,
        weights + np.zeros(problem.b.size), x, loose,
    )  # fmt: skip
    if not (first <= ACCEPTED_NEAREST and np.isfinite(x).all()):
        raise RecruitmentError(
            f"no nearest torque found for {problem.b * problem.scale}, residual {first:.3g}"
        )
    return x, max(first, second), loose
