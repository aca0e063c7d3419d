"""The equations of a constrained system as Exudyn has them, on a solver object of our own.

With coordinates x, the Jacobian G of the constraints, and D where Exudyn keeps equations of
multipliers alone, as of a joint's free axes,

    [M  G^T] [ x'' ]   [Q - H]
    [G  D  ] [-mu  ] = [gamma].
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import NamedTuple

import exudyn as exu
import numpy as np
from scipy.linalg.lapack import dgecon, dgesv, dgetrf, dgetrs

from .rotations import advance
from .state import State

# Largest displacement for central differences along the motion [m or rad]: what is cut off and what
# is rounded are both 1e-10 of the accelerations.
DISPLACEMENT = 1e-5
FASTEST = 10.0  # m/s or rad/s; slower systems move less


class ConstrainedEquations:
    """Of a system at its current state.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    solver : exudyn.MainSolverImplicitSecondOrder
        Initialized with it.
    state : State
        Of the whole system.

    Attributes
    ----------
    number : int
        Of the constraints' equations.
    vectors, reference : ndarray
        As in `advance`.
    """

    def __init__(
        self, mbs: exu.MainSystem, solver: exu.MainSolverImplicitSecondOrder, state: State
    ) -> None:
        data = mbs.systemData
        n, first_order = data.ODE2Size(), data.ODE1Size()
        self._mbs, self._solver, self._data, self._n = mbs, solver, data, n
        self._x, self._speeds = state.current[:2]
        self._multipliers = data.GetSystemStateDict(reference=True)["AECoords"]
        self._algebraic = slice(n + first_order, None)
        self._kept = np.r_[0:n, n + first_order : data.SystemSize()]
        self.number = self._multipliers.size
        self.vectors = rotation_vectors(mbs)
        reference = exu.ConfigurationType.Reference
        self.reference = np.array(data.GetODE2Coordinates(configuration=reference), dtype=float)

    def matrix(self, stiffness: float = 0.0, damping: float = 0.0) -> np.ndarray:
        """[[M, G^T], [G, D]]; M with so much of the forces' slopes over x and x'."""
        n, K = self._n, self._jacobian(stiffness, damping, 1.0)
        self._solver.ComputeMassMatrix(self._mbs)
        K[:n, :n] += self._solver.GetSystemMassMatrix()
        K[:n, n:] = K[n:, :n].T
        return K

    def _jacobian(self, stiffness: float, damping: float, of_positions: float) -> np.ndarray:
        """Slopes of the forces, with these factors, and of constraints; rolling is of velocities
        alone, and where G of positions is left out only it remains."""
        solver, mbs = self._solver, self._mbs
        solver.ComputeJacobianODE2RHS(mbs, stiffness, damping, 0.0)
        solver.ComputeJacobianAE(mbs, of_positions, 1.0, 0.0, False)
        K = np.asarray(solver.GetSystemJacobian())
        return K if K.shape[0] == self._kept.size else K[np.ix_(self._kept, self._kept)]

    def fastest(self) -> float:
        """With how much the system swings about its current state at most [rad/s], forces of
        springs and contacts alone; 0 if nothing pulls it back."""
        n, K = self._n, self.matrix()
        right = np.zeros((K.shape[0], n))
        right[:n] = self.matrix(stiffness=-1.0)[:n, :n] - K[:n, :n]
        pulled = solved(K, right)
        if pulled is None:
            return 0.0
        return float(np.sqrt(np.linalg.eigvals(pulled[:n]).real.max(initial=0.0)))

    @contextmanager
    def free(self) -> Iterator[None]:
        """Be without constraint forces, which Exudyn takes for forces and for what is lacking."""
        kept = self._multipliers.copy()
        try:
            self._multipliers[:] = 0.0
            yield
        finally:
            self._multipliers[:] = kept

    def forces(self) -> np.ndarray:
        """Q - H (N,), where the system is `free`."""
        self._solver.ComputeODE2RHS(self._mbs)
        return np.asarray(self._solver.GetSystemResidual())[: self._n]

    def lacking(self, velocity: bool) -> np.ndarray:
        """What the constraints lack, at position or velocity level, where the system is `free`.

        Those of velocities alone, as of rolling, ask for nothing at position level.
        """
        self._solver.ComputeAlgebraicEquations(self._mbs, velocity)
        lack = np.asarray(self._solver.GetSystemResidual())[self._algebraic]
        return lack if velocity else np.where(self._of_velocities, 0.0, lack)

    @cached_property
    def _of_velocities(self) -> np.ndarray:
        """Which equations (c,) are of velocities alone."""
        return np.asarray(self._jacobian(0.0, 0.0, 0.0)[self._n :, : self._n].any(axis=1))

    def lacking_now(self, velocity: bool) -> np.ndarray:
        """The same of a system that is not."""
        with self.free():
            return self.lacking(velocity)

    def demanded(self) -> np.ndarray:
        """gamma, the accelerations that constraints ask for, where the system is `free`."""
        return -self.derivative(lambda: self.lacking(velocity=True))

    def derivative(self, evaluate: Callable[[], np.ndarray]) -> np.ndarray:
        """Of what a function returns, over time; by central differences along the motion."""
        x, t, e = self._x.copy(), self._data.GetTime(), short_time(self._speeds)
        found = []
        try:
            for side in (e, -e):
                self.advance(side * self._speeds)
                self._data.SetTime(t + side)
                found.append(evaluate())
                self._x[:] = x
        finally:
            self._x[:] = x
            self._data.SetTime(t)
        return (found[0] - found[1]) / (2.0 * e)

    def advance(self, step: np.ndarray) -> None:
        """Move the system by a step (N,) along its speeds."""
        advance(self.vectors, self.reference, self._x, step)


def short_time(speeds: np.ndarray) -> float:
    """For differences along a motion [s]."""
    return DISPLACEMENT / max(FASTEST, float(np.abs(speeds).max()))


def solved(K: np.ndarray, right: np.ndarray) -> np.ndarray | None:
    """The solutions for right-hand sides (N + c, k); None if there are none."""
    _, _, solution, failed = dgesv(K, right)
    return None if failed or not np.isfinite(solution).all() else solution


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Of a symmetric matrix."""
    found = np.linalg.inv(matrix)
    return 0.5 * (found + found.T)


# Of the reciprocal condition, in the 1-norm and as LAPACK estimates it: at most this, over the size
# of the matrix, where anything is redundant or singular by `singular.py`.
SUSPICIOUS = 1e-9


class Factors(NamedTuple):
    """L and U of [[M, G^T], [G, D]], with the pivots."""

    LU: np.ndarray
    pivots: np.ndarray

    @staticmethod
    def of(K: np.ndarray) -> Factors | None:
        """Of a matrix (N + c, N + c); None of a singular one."""
        LU, pivots, failed = dgetrf(K)
        return None if failed or not np.isfinite(LU).all() else Factors(LU, pivots)

    @property
    def size(self) -> int:
        """N + c."""
        return self.pivots.size

    def solve(self, right: np.ndarray) -> np.ndarray:
        """The solutions for right-hand sides (N + c,) or (N + c, k)."""
        return dgetrs(self.LU, self.pivots, right)[0]

    def may_be_singular(self, K: np.ndarray) -> bool:
        """Whether the singular values of K have to be looked at."""
        condition, _ = dgecon(self.LU, np.abs(K).sum(axis=0).max())
        return bool(condition <= SUSPICIOUS * self.size)


def rotation_vectors(mbs: exu.MainSystem) -> np.ndarray:
    """First coordinates of all rotation vectors in the system."""
    data = mbs.systemData
    first = [
        data.GetNodeLTGODE2(k)[3]
        for k in range(data.NumberOfNodes())
        if mbs.GetNode(k)["nodeType"] == "RigidBodyRotVecLG"
    ]
    return np.array(first, dtype=np.int64)
