"""Newton's matrix: what a method adds to Exudyn's own, or all of it where the tree is alone.

Exudyn finds its matrix by differences of all forces over all coordinates, which on a large tree
takes longer than the rest of a step. Where the tree is all that is solved for, a method makes the
matrix from M and slopes of the forces that it may keep, or without them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeGuard

import exudyn as exu
import numpy as np

from ..skeleton.base import ExudynSkeleton
from ..skeleton.skeleton import Skeleton
from .method import Method
from .solver import newton_factors, running_solver


def is_alone(skeleton: ExudynSkeleton) -> TypeGuard[Skeleton]:
    """Whether it is a tree that is all of its system."""
    return isinstance(skeleton, Skeleton) and skeleton.alone


def addition(method: Method, skeleton: ExudynSkeleton) -> Callable[..., exu.MatrixContainer]:
    """The SystemJacobian user function: what has to be added to Exudyn's own matrix."""
    triplets = _triplets(skeleton)

    def added(mbs: exu.MainSystem, t: float, dq: float, dv: float, _: float) -> exu.MatrixContainer:
        solver = running_solver(mbs)
        exact = np.asarray(solver.GetSystemJacobian())[skeleton.rows]
        wanted = skeleton.reduced_rows(exact)
        if method.feeds_back:
            wanted = method.jacobian(wanted, newton_factors(solver)[0], dq, dv)
        triplets[:, 2] = (skeleton.all_rows(wanted) - exact).ravel()
        container = exu.MatrixContainer()
        container.SetWithSparseMatrix(triplets, exact.shape[1], exact.shape[1])
        return container

    return added


def whole_matrix(method: Method, skeleton: Skeleton) -> Callable[..., bool]:
    """The solver's ComputeNewtonJacobian user function: the matrix of a tree that is alone."""
    nothing = np.zeros((len(skeleton.coordinates), skeleton.width))

    def computed(
        solver: exu.MainSolverImplicitSecondOrder,
        mbs: exu.MainSystem,
        settings: exu.SimulationSettings,
    ) -> bool:
        mass, dq, dv = newton_factors(solver)
        slopes, exact = method.slopes(skeleton), nothing
        if slopes is not None:
            M = np.asarray(solver.GetSystemMassMatrix())  # of the residual at this iterate
            change = M - dq / mass * slopes.stiffness - dv / mass * slopes.damping
            exact = skeleton.reduced_rows(mass * change)
            if not skeleton.known_to_exudyn:
                method.state.change = change
        wanted = method.jacobian(exact, mass, dq, dv)
        solver.SetSystemJacobian(skeleton.whole_matrix(wanted))
        return True

    return computed


def last_lack(solver: exu.MainSolverImplicitSecondOrder) -> np.ndarray:
    """What forces were short of M q'' at the iterate whose residual was the last one."""
    h = solver.it.currentStepSize
    # Exudyn scales the residual once it has its norm.
    return np.asarray(solver.GetSystemResidual() / (solver.newmarkBeta * h * h))


def _triplets(skeleton: ExudynSkeleton) -> np.ndarray:
    """Row, column and a place for the value of the skeleton's rows in its Newton matrix."""
    data = skeleton.mbs.systemData
    columns = np.arange(data.ODE2Size() + data.ODE1Size() + data.AEsize())
    i, j = np.meshgrid(np.arange(skeleton.rows.start, skeleton.rows.stop), columns, indexing="ij")
    return np.column_stack([i.ravel(), j.ravel(), np.zeros(i.size)])
