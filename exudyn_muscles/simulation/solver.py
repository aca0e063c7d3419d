"""Exudyn's running solver, as it is found from the `mbs`."""

from __future__ import annotations

from typing import Any

import exudyn as exu

from ..errors import ModelError


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
        raise ModelError(
            "the plugin works with mbs.SolveDynamic and its default storeSolver=True"
        ) from error


def request_jacobian(mbs: exu.MainSystem) -> None:
    """Have Exudyn's modified Newton build a new matrix in this step."""
    running_solver(mbs).conv.jacobianUpdateRequested = True


def put_back_solver(mbs: exu.MainSystem, solver: Any) -> None:
    """Where no run has left another one."""
    if solver is not None:
        mbs.sys.setdefault("dynamicSolver", solver)
