"""Exudyn's running solver, as it is found from the `mbs`, and its matrix."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import exudyn as exu

from ..errors import ModelError

SAME_TIME = 1e-9  # s: Exudyn adds up the steps of a run
SOLVER = ("dynamicSolver", "simulationSettings")  # in mbs.sys
UNKNOWN_SOLVER = (
    "the plugin works with mbs.SolveDynamic and its default storeSolver=True; a solver of your own "
    "for SolveSteps is to be found within attached() as mbs.sys['dynamicSolver'], its settings as "
    "mbs.sys['simulationSettings']"
)


def running_solver(mbs: exu.MainSystem) -> exu.MainSolverImplicitSecondOrder:
    """The solver that calls the user functions.

    Raises
    ------
    ModelError
        The run does not store its solver.
    """
    try:
        return mbs.sys["dynamicSolver"]
    except KeyError as error:
        raise ModelError(UNKNOWN_SOLVER) from error


def check_begins(mbs: exu.MainSystem, t: float) -> None:
    """Raise ModelError unless it is this solver that begins to solve at the time `t`, and goes on
    from there."""
    iteration = running_solver(mbs).it
    if iteration.currentStepIndex != 0:
        raise ModelError(UNKNOWN_SOLVER)
    if not iteration.adaptiveStep and abs(iteration.startTime - t) > SAME_TIME:
        raise ModelError(
            f"without adaptiveStep Exudyn counts steps from it.startTime = {iteration.startTime:g} "
            f"s, and SolveSteps begins at t = {t:g} s: set solver.it.startTime as well"
        )


def goes_by_newmark(mbs: exu.MainSystem) -> bool:
    """Whether it goes by Newmark's method, as TrapezoidalIndex2, and not by generalized alpha.

    Raises
    ------
    ModelError
        The run does not store its settings.
    """
    try:
        settings = mbs.sys["simulationSettings"]
    except KeyError as error:
        raise ModelError(UNKNOWN_SOLVER) from error
    return bool(settings.timeIntegration.generalizedAlpha.useNewmark)


def takes_matrices(mbs: exu.MainSystem) -> bool:
    """Whether it is implicit and can be given a Newton matrix as an array."""
    kind = mbs.sys[SOLVER[1]].linearSolver.solverType
    dense = kind in (exu.LinearSolverType.EXUdense, exu.LinearSolverType.EigenDense)
    return dense and isinstance(running_solver(mbs), exu.MainSolverImplicitSecondOrder)


def newton_factors(solver: exu.MainSolverImplicitSecondOrder) -> tuple[float, float, float]:
    """mass, dq and dv of the Newton matrix, as `Method.jacobian` has them."""
    mass, h = (1.0 - solver.alphaM) / (1.0 - solver.alphaF), solver.it.currentStepSize
    return mass, -solver.newmarkBeta * h * h, -solver.newmarkGamma * h


def set_newton_matrix(mbs: exu.MainSystem, function: Callable) -> Callable[[], None]:
    """Have the solver take its Newton matrix from a function; returned is what ends that."""
    solver = running_solver(mbs)
    solver.SetUserFunctionComputeNewtonJacobian(mbs, function)
    return partial(solver.SetUserFunctionComputeNewtonJacobian, mbs, None)


def request_jacobian(mbs: exu.MainSystem) -> None:
    """Have Exudyn's modified Newton build a new matrix in this step."""
    running_solver(mbs).conv.jacobianUpdateRequested = True


def set_time_of_solver(mbs: exu.MainSystem, t: float) -> None:
    """Have the solver that the `mbs` has, if any, go on at the time `t`."""
    if SOLVER[0] in mbs.sys:
        mbs.sys[SOLVER[0]].it.currentTime = t


def last_solver(mbs: exu.MainSystem) -> dict[str, Any]:
    """Solver and settings of the last run, as far as there are any, by their names in mbs.sys."""
    return {name: mbs.sys[name] for name in SOLVER if name in mbs.sys}


def forget_solver(mbs: exu.MainSystem) -> None:
    """Leave the `mbs` without them."""
    for name in SOLVER:
        mbs.sys.pop(name, None)


def put_back_solver(mbs: exu.MainSystem, last: Mapping[str, Any]) -> None:
    """Where no run has left another one."""
    for name, value in last.items():
        mbs.sys.setdefault(name, value)
