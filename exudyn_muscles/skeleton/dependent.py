"""A skeleton with coordinates that follow others: the methods see the independent ones only.

With q = q(z) and R = dq/dz, (1) becomes M_z z'' + H_z - Q_z = R^T r^T F, where

    M_z = R^T M R,    H_z - Q_z = R^T (M R' z' + H - Q).

Exudyn integrates all coordinates and knows of no constraint. Before every residual the followers
are put where they belong, q, q' and q'', and the torques handed over contain the reaction that
holds them there, known from inverse dynamics: followers' rows are in balance, and the other ones
are those of z. Exudyn thus solves the equation of z itself with whatever integrator, without
algebraic equations, multipliers or drift. M may be singular as long as M_z is not.
"""

from __future__ import annotations

from collections.abc import Sequence

import exudyn as exu
import numpy as np

from .followers import Follower, Followers, Slopes
from .hold import Hold
from .skeleton import Skeleton


class DependentSkeleton(Skeleton):
    """A `Skeleton` of which all but the names that begin with `tree` is about z.

    Parameters
    ----------
    mbs, tree, coordinates
        As of `Skeleton`; the coordinates are all of the tree's.
    followers : sequence of Follower
        At least one.
    """

    followers: Followers

    def __init__(
        self,
        mbs: exu.MainSystem,
        tree: int,
        coordinates: Sequence[str] | None,
        followers: Sequence[Follower],
    ) -> None:
        super().__init__(mbs, tree, coordinates)
        self.followers = Followers(followers, self.tree_coordinates)
        self._free, self._tied = self.followers.free, self.followers.tied
        self.coordinates = tuple(self.tree_coordinates[j] for j in self._free)

    @property
    def units(self) -> tuple[str, ...]:
        units = super().units
        return tuple(units[j] for j in self._free)

    @property
    def q(self) -> np.ndarray:  # type: ignore[override]
        return self.tree_q[self._free]

    @property
    def v(self) -> np.ndarray:  # type: ignore[override]
        return self.tree_v[self._free]

    @property
    def acceleration(self) -> np.ndarray:  # type: ignore[override]
        return self.tree_a[self._free]

    @property
    def start(self) -> tuple[np.ndarray, ...]:  # type: ignore[override]
        return tuple(values[self._free] for values in self._tree_start)

    @property
    def free(self) -> np.ndarray:  # type: ignore[override]
        return self.rows.start + self._free

    @property
    def applied(self) -> np.ndarray:
        return self._torque

    def _attach(self) -> None:
        """There is nothing to keep: the independent ones are read from the tree's."""

    def open(self, held: Hold) -> None:
        self.check_assembled()
        before = self.initial_arrays()
        placed = self.initial_arrays()
        for array, values in zip(placed, self.state_of_tree(*self.initial_state()), strict=True):
            array[self.rows] = values

        def put_back() -> None:  # but not where the run has left something else
            each = zip(self.initial_arrays(), placed, before, strict=True)
            self.set_initial_arrays(*(b if np.array_equal(x, p) else x for x, p, b in each))

        held.keep(put_back)
        self.set_initial_arrays(*placed)
        super().open(held)

    def _prepare(self, held: Hold) -> None:
        self._torque = np.zeros(len(self))
        super()._prepare(held)

    def _follow(self) -> Slopes:
        return self.followers.follow(self.tree_q, self.tree_v, self.tree_a)

    def follow(self) -> None:
        self._follow()

    def hold(self) -> None:
        self.apply(self._torque)

    def begin(self, torque: np.ndarray) -> None:
        """Also sets the accelerations of the whole system, as Exudyn would compute them."""
        M, bias = self.dynamics()
        self.tree_a[self._free] = np.linalg.solve(M, torque - bias)
        if self.others:
            solver, current = self._solver, self._current[2]
            rest = np.delete(np.arange(current.size), self.rows)
            M_rest = solver.GetSystemMassMatrix()[np.ix_(rest, rest)]
            current[rest] = np.linalg.solve(M_rest, solver.GetSystemResidual()[rest])
        self.apply(torque)

    def settle(self) -> bool:
        found = self._current[2].copy()
        self.begin(self._torque)
        needed = self._current[2]
        return bool(np.abs(found - needed).max() <= 1e-6 * np.abs(needed).max() + 1e-9)

    def apply(self, torque: np.ndarray) -> None:
        """Set the muscles' torques (n,) and the followers' reactions at the current state."""
        R, _ = self._follow()
        M, bias = super().dynamics()
        balance = M @ self.tree_a + bias
        balance[self._free] = torque - balance[self._tied] @ R[self._tied]
        self._torque = np.array(torque)
        super().apply(balance)

    def dynamics(self) -> tuple[np.ndarray, np.ndarray]:
        R, bends = self._follow()
        M, bias = super().dynamics()
        bent = bends * self.tree_v[self.followers.roots] ** 2  # R' z'
        return R.T @ M @ R, R.T @ (M @ bent + bias)

    def state_of_tree(self, *state: np.ndarray) -> tuple[np.ndarray, ...]:
        z = np.asarray(state[0], dtype=float)
        rows = [np.zeros((z.size // len(self), len(self)))] * 3
        for k, values in enumerate(state):
            rows[k] = np.asarray(values, dtype=float).reshape(rows[k].shape)
        states = [self.followers.state(*row)[0] for row in zip(*rows, strict=True)]
        shape = (*z.shape[:-1], len(self.tree))
        return tuple(np.array([row[k] for row in states]).reshape(shape) for k in range(len(state)))

    def reduced(self, covectors: np.ndarray) -> np.ndarray:
        return covectors @ self._follow().R

    def reduced_rows(self, exact: np.ndarray) -> np.ndarray:
        R, _ = self._follow()
        reduced = R.T @ exact
        within = reduced[:, self.rows] @ R
        reduced[:, self.rows] = 0.0
        reduced[:, self.free] = within
        return reduced

    def all_rows(self, wanted: np.ndarray) -> np.ndarray:
        R, _ = self._follow()
        rows = np.zeros((len(self.tree), wanted.shape[1]))
        rows[self._free] = wanted
        # dq_d = R_d dz
        rows[self._tied, self.rows.start + self._tied] = 1.0
        rows[self._tied[:, None], self.free] = -R[self._tied]
        return rows
