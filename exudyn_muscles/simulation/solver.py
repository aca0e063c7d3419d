"""Exudyn's running solver, as it is found from the `mbs`, and its matrix."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np

from ..errors import ModelError
from ..skeleton.base import ExudynSkeleton


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


def matrix_triplets(skeleton: ExudynSkeleton) -> np.ndarray:
    """Row, column and a place for the value of the skeleton's rows in its Newton matrix."""
    data = skeleton.mbs.systemData
    columns = np.arange(data.ODE2Size() + data.ODE1Size() + data.AEsize())
    i, j = np.meshgrid(np.arange(skeleton.rows.start, skeleton.rows.stop), columns, indexing="ij")
    return np.column_stack([i.ravel(), j.ravel(), np.zeros(i.size)])
