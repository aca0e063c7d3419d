"""Coordinates of a tree of which some are held by others: q = q(z), R = dq/dz.

The equations of motion of the independent ones, z, are

    M_z = R^T M R,    H_z - Q_z = R^T (M R' z' + H - Q).

Exudyn integrates all coordinates and knows of no constraint. Before every residual the dependent
ones are put where they belong, q, q' and q'', and the torques handed over contain the reaction that
holds them there, known from inverse dynamics: their rows are in balance, and the other ones are
those of z. Exudyn thus solves the equation of z itself with whatever integrator, without algebraic
equations, multipliers or drift. M may be singular as long as M_z is not.

Where the tree is alone its Newton matrix lets z feel R^T times what is out of balance in the
dependent rows, as if it were in its own. Reactions then need only be right in the end, and within a
step those of an iterate follow from what Exudyn's residual says of the one before.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..errors import ParameterError
from ..numerics.kernel import kernel
from .geometry import Geometry
from .opened import Assembled, Dynamics, Opened, agree
from .state import State


class Slopes(NamedTuple):
    """R = dq/dz (N, n), and R' z' (N,) at the speeds there."""

    R: np.ndarray
    bent: np.ndarray


class DynamicsOfTree(Dynamics):
    """`Dynamics` of z with those `of_tree`, all of its coordinates."""

    of_tree: Assembled

    def __new__(
        cls, M: np.ndarray, bias: np.ndarray, place: tuple, of_tree: Assembled
    ) -> DynamicsOfTree:
        self = super().__new__(cls, M, bias, place)
        self.of_tree = of_tree
        return self


class Tied(ABC):
    """z are the coordinates that nothing holds; methods as of `Independent`.

    Parameters
    ----------
    free, tied : int ndarray
        The n independent and the k dependent coordinates, by their numbers in the tree.

    Attributes
    ----------
    free, tied : int ndarray
    size : int
        N, of all coordinates of the tree.
    """

    known_to_exudyn = False

    def __init__(self, free: np.ndarray, tied: np.ndarray) -> None:
        self.free, self.tied, self.size = free, tied, free.size + tied.size
        # Overwritten where the muscles' torques are set, the accelerations there as well.
        self._torque, self._balance, self._a = np.zeros(free.size), *np.zeros((2, self.size))
        self._row = np.empty(self.size)  # room

    @abstractmethod
    def follow_from(
        self, z: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], Slopes]:
        """q, q', q'' (N,) from z, z', z'' (n,); the basis is overwritten by the next call."""

    @abstractmethod
    def follow(self, state: State) -> Slopes:
        """Put the dependent coordinates of a state where they belong."""

    def part(self, values: np.ndarray) -> np.ndarray:
        return values[self.free]

    def within(self, rows: slice) -> np.ndarray:
        return rows.start + self.free

    def state_of_tree(self, *state: np.ndarray) -> tuple[np.ndarray, ...]:
        z, n = np.asarray(state[0], dtype=float), self.free.size
        rows = [np.zeros((z.size // n, n))] * 3
        for k, values in enumerate(state):
            rows[k] = np.asarray(values, dtype=float).reshape(rows[k].shape)
        states = [self.follow_from(*row)[0] for row in zip(*rows, strict=True)]
        shape = (*z.shape[:-1], self.size)
        return tuple(np.array([row[k] for row in states]).reshape(shape) for k in range(len(state)))

    def along(
        self, z: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, Callable[[np.ndarray], np.ndarray]]:
        k, rest = len(z), np.zeros(self.free.size)
        q, q_t = np.empty((2, k, self.size))
        R = np.empty((k, self.size, self.free.size))
        for i in range(k):
            (q[i], q_t[i], _), slopes = self.follow_from(z[i], v[i], rest)
            R[i] = slopes.R
        return q, q_t, lambda torques: np.matmul(torques[:, None], R)[:, 0]

    def geometry(self, of_tree: Callable[..., Geometry]) -> Callable[..., Geometry]:
        rest = np.zeros(self.free.size)

        def of_independent(z: np.ndarray, v: np.ndarray) -> Geometry:
            (q, q_t, _), slopes = self.follow_from(z, v, rest)
            length, speed, r, S = of_tree(q, q_t)
            return Geometry(length, speed, r @ slopes.R, slopes.R.T @ S if S.size else S)

        return of_independent

    def state(self, opened: Opened) -> tuple[np.ndarray, np.ndarray]:
        self.follow(opened.state)
        return opened.state.q, opened.state.v

    def dynamics(self, opened: Opened, place: tuple) -> Dynamics:
        basis = self.follow(opened.state)
        n, of_tree = self.free.size, opened.dynamics()
        M_z, bias_z = np.empty((n, n)), np.empty(n)
        reduce_dynamics(self.free, self.tied, *basis, *of_tree[:2], self._row, M_z, bias_z)
        return DynamicsOfTree(M_z, bias_z, place, of_tree)

    def begin(self, opened: Opened, torque: np.ndarray) -> None:
        """Also sets the accelerations of the whole system, as Exudyn would compute them."""
        M, bias, _ = self.dynamics(opened, ())
        opened.state.a[self.free] = np.linalg.solve(M, torque - bias)
        opened.accelerate_others()
        self.apply(opened, torque, None)

    def settle(self, opened: Opened, newmark: bool) -> None:
        needed = opened.state.current[2]
        found = needed.copy()
        self.begin(opened, self._torque)
        if not (newmark or agree(found, needed)):
            raise ParameterError(
                "generalized alpha starts from initial accelerations of its own, which cannot be "
                "right here: the tree's mass matrix is singular without the reactions of its "
                "dependent coordinates, or generalizedAlpha.computeInitialAccelerations = False; "
                "use TrapezoidalIndex2"
            )

    def apply(self, opened: Opened, torque: np.ndarray | None, here: Dynamics | None) -> None:
        """Also sets the reactions of the dependent coordinates, which every iterate has anew."""
        if torque is not None:
            self._torque[:] = torque
        R = self.follow(opened.state).R
        known = here.of_tree if isinstance(here, DynamicsOfTree) else opened.dynamics()
        M, bias, carried = known
        self._a[:] = opened.state.a
        hold_tied(self.free, self.tied, R, M, bias, self._a, self._torque, self._balance)
        opened.apply(self._balance, carried)

    def apply_again(
        self, opened: Opened, torque: np.ndarray, change: np.ndarray, lack: np.ndarray
    ) -> None:
        """M and H - Q are not asked for: at the iterate before Exudyn has found what the reactions
        lacked there. What is wrong with them now it finds next, and `whole_matrix` lets nothing but
        z feel it, as part of its own residual."""
        self._torque[:] = torque
        R, carried, a = self.follow(opened.state).R, opened.carried_here(), opened.state.a
        hold_again(
            self.free, self.tied, R, change, lack, a, self._a, opened.load, carried, self._torque,
            self._balance,
        )  # fmt: skip
        self._a[:] = a
        opened.apply(self._balance, carried)

    def applied(self, opened: Opened) -> np.ndarray:
        return self._torque.copy()

    def reduced(self, opened: Opened, covectors: np.ndarray) -> np.ndarray:
        return covectors @ self.follow(opened.state).R

    def reduced_rows(self, opened: Opened, exact: np.ndarray) -> np.ndarray:
        R, reduced = self.follow(opened.state).R, np.empty((self.free.size, exact.shape[1]))
        reduce_rows(self.free, self.tied, R, opened.rows.start, exact, reduced)
        return reduced

    def all_rows(self, opened: Opened, wanted: np.ndarray) -> np.ndarray:
        R, rows = self.follow(opened.state).R, np.zeros((self.size, wanted.shape[1]))
        spread_rows(self.free, self.tied, R, opened.rows.start, wanted, rows)
        return rows

    def whole_matrix(self, opened: Opened, wanted: np.ndarray) -> np.ndarray:
        R, matrix = self.follow(opened.state).R, np.zeros((self.size, self.size))
        make_whole(self.free, self.tied, R, wanted, matrix)
        return matrix


@kernel
def reduce_dynamics(free, tied, R, bent, M, bias, row, M_z, bias_z):
    """Write R^T M R (n, n) and R^T (M R' z' + bias) (n,), of which `bent` is R' z' (N,)."""
    for i in range(free.size):
        for e in range(row.size):
            row[e] = M[free[i], e]
        bias_z[i] = bias[free[i]]
        for d in tied:
            if R[d, i] != 0.0:
                bias_z[i] += R[d, i] * bias[d]
                for e in range(row.size):
                    row[e] += R[d, i] * M[d, e]
        for e in range(row.size):
            bias_z[i] += row[e] * bent[e]
        for j in range(free.size):
            M_z[i, j] = row[free[j]]
            for d in tied:
                M_z[i, j] += row[d] * R[d, j]


@kernel
def hold_tied(free, tied, R, M, bias, a, torque, balance):
    """Write torques on all coordinates (N,) that hold the `tied` ones where they belong at
    accelerations `a` (N,), and with it are `torque` (n,) on the `free` ones."""
    for k in range(free.size):
        balance[free[k]] = torque[k]
    for d in tied:
        balance[d] = bias[d]
        for e in range(a.size):
            balance[d] += M[d, e] * a[e]
        for k in range(free.size):
            balance[free[k]] -= balance[d] * R[d, k]


@kernel
def hold_again(free, tied, R, change, lack, a, before, load, carried, torque, balance):
    """Make of the `balance` at accelerations `before`, where `load` (N,) was carried and all forces
    were `lack` (N,) short of M q'', about that at `a` where `carried` is."""
    for k in range(free.size):
        balance[free[k]] = torque[k]
    for d in tied:
        balance[d] += lack[d] + load[d] - carried[d]
        for e in range(a.size):
            balance[d] += change[d, e] * (a[e] - before[e])
        for k in range(free.size):
            balance[free[k]] -= balance[d] * R[d, k]


@kernel
def reduce_rows(free, tied, R, first, exact, reduced):
    """Write the tree's rows (N, all) of a Newton matrix as those of z, over z (n, all); the tree's
    columns begin with the one numbered `first`."""
    for k in range(free.size):
        for c in range(exact.shape[1]):
            reduced[k, c] = exact[free[k], c]
        for d in tied:
            if R[d, k] != 0.0:
                for c in range(exact.shape[1]):
                    reduced[k, c] += R[d, k] * exact[d, c]
        for d in tied:
            for j in range(free.size):
                reduced[k, first + free[j]] += reduced[k, first + d] * R[d, j]
            reduced[k, first + d] = 0.0


@kernel
def spread_rows(free, tied, R, first, wanted, rows):
    """Write rows (n, all) of z as those of the whole tree (N, all), which are zero before, with
    dq_d = R_d dz."""
    for k in range(free.size):
        for c in range(wanted.shape[1]):
            rows[free[k], c] = wanted[k, c]
    for d in tied:
        rows[d, first + d] = 1.0
        for k in range(free.size):
            rows[d, first + free[k]] = -R[d, k]


@kernel
def make_whole(free, tied, R, wanted, matrix):
    """Write the matrix (N, N), which is zero before, of rows (n, N) of z: whatever forces lack in
    the rows of the `tied` is felt by z, and moves nothing else, as these follow anyway."""
    for k in range(free.size):
        for c in range(wanted.shape[1]):
            matrix[free[k], c] = wanted[k, c]
        for d in tied:
            matrix[free[k], d] = -R[d, k]
    for d in tied:
        matrix[d, d] = 1.0
