"""Coordinates of a tree of which some follow others: q = q(z), R = dq/dz.

One that follows z_j, through others or at once, moves with

    q_d = f(z_j)    q_d' = f' z_j'    q_d'' = f' z_j'' + f'' z_j'^2,

and the equations of motion of z have

    M_z = R^T M R,    H_z - Q_z = R^T (M R' z' + H - Q).

Exudyn integrates all coordinates and knows of no constraint. Before every residual the dependent
ones are put where they belong, q, q' and q'', and the torques handed over contain the reaction that
holds them there, known from inverse dynamics: their rows are in balance, and the other ones are
those of z. Exudyn thus solves the equation of z itself with whatever integrator, without algebraic
equations, multipliers or drift. M may be singular as long as M_z is not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..errors import ParameterError
from ..numerics.curves import PackedCurves, evaluate, pack
from ..numerics.kernel import kernel
from .coupling import DependentCoordinate, chains
from .geometry import Geometry
from .opened import Dynamics, Opened, agree
from .state import State


class Slopes(NamedTuple):
    """R = dq/dz (N, n), and d^2 q/dz_j^2 (N,) of every coordinate by its own z_j."""

    R: np.ndarray
    bends: np.ndarray


class DynamicsOfTree(Dynamics):
    """`Dynamics` of z with M (N, N) and H - Q (N,) `of_tree`, all of its coordinates."""

    of_tree: tuple[np.ndarray, np.ndarray]

    def __new__(
        cls, M: np.ndarray, bias: np.ndarray, place: tuple, of_tree: tuple[np.ndarray, np.ndarray]
    ) -> DynamicsOfTree:
        self = super().__new__(cls, M, bias, place)
        self.of_tree = of_tree
        return self


class Dependent:
    """z are the coordinates that follow no other; methods as of `Independent`.

    Parameters
    ----------
    given : sequence of DependentCoordinate
        At least one.
    names : sequence of str
        Of all N coordinates of the tree.

    Attributes
    ----------
    free : (n,) int ndarray
        The independent coordinates, by their numbers in the tree.
    tied : (k,) int ndarray
        The dependent ones.
    roots : (N,) int ndarray
        The independent coordinate that each depends on, by its number in the tree.

    Raises
    ------
    ParameterError
        As `chains`.
    """

    known_to_exudyn = False

    def __init__(self, given: Sequence[DependentCoordinate], names: Sequence[str]) -> None:
        self.tied, followed, functions, self.roots = chains(given, names)
        self.free = np.setdiff1d(np.arange(len(names)), self.tied)
        columns = np.searchsorted(self.free, self.roots)
        R = np.zeros((len(names), self.free.size))
        R[self.free, columns[self.free]] = 1.0
        # Overwritten wherever z is; the muscles' torques where they are set.
        self._slopes = Slopes(R, np.zeros(len(names)))
        self._torque = np.zeros(self.free.size)
        links = np.column_stack([self.tied, followed, self.roots[self.tied], columns[self.tied]])
        self._tables = (np.ascontiguousarray(links), *pack(functions), *self._slopes)

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
        shape = (*z.shape[:-1], self.roots.size)
        return tuple(np.array([row[k] for row in states]).reshape(shape) for k in range(len(state)))

    def along(
        self, z: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, Callable[[np.ndarray], np.ndarray]]:
        k, N = len(z), self.roots.size
        q, v_all = np.zeros((2, k, N))
        q[:, self.free], v_all[:, self.free] = z, v
        R = np.empty((k, N, self.free.size))
        follow_each(*self._tables, q, v_all, np.zeros(N), R)
        return q, v_all, lambda torques: np.matmul(torques[:, None], R)[:, 0]

    def geometry(self, of_tree: Callable[..., Geometry]) -> Callable[..., Geometry]:
        rest = np.zeros(self.free.size)

        def of_independent(z: np.ndarray, v: np.ndarray) -> Geometry:
            (q, q_t, _), slopes = self.follow_from(z, v, rest)
            length, speed, r, S = of_tree(q, q_t)
            return Geometry(length, speed, r @ slopes.R, slopes.R.T @ S if S.size else S)

        return of_independent

    def follow_from(
        self, z: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], Slopes]:
        """q, q', q'' (N,) from z, z', z'' (n,); the slopes are overwritten by the next call."""
        q, q_t, q_tt = np.zeros((3, self.roots.size))
        q[self.free], q_t[self.free], q_tt[self.free] = z, v, a
        follow(*self._tables, q, q_t, q_tt)
        return (q, q_t, q_tt), self._slopes

    def state(self, opened: Opened) -> tuple[np.ndarray, np.ndarray]:
        self._follow(opened.state)
        return opened.state.q, opened.state.v

    def _follow(self, state: State) -> Slopes:
        """Put the dependent coordinates of a state where they belong."""
        follow(*self._tables, state.q, state.v, state.a)
        return self._slopes

    def dynamics(self, opened: Opened, place: tuple) -> Dynamics:
        R, bends = self._follow(opened.state)
        M, bias = opened.dynamics()
        bent = bends * opened.state.v[self.roots] ** 2  # R' z'
        return DynamicsOfTree(R.T @ M @ R, R.T @ (M @ bent + bias), place, (M, bias))

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
        R, _ = self._follow(opened.state)
        M, bias = here.of_tree if isinstance(here, DynamicsOfTree) else opened.dynamics()
        balance = M @ opened.state.a + bias
        balance[self.free] = self._torque - balance[self.tied] @ R[self.tied]
        opened.apply(balance)

    def applied(self, opened: Opened) -> np.ndarray:
        return self._torque.copy()

    def reduced(self, opened: Opened, covectors: np.ndarray) -> np.ndarray:
        return covectors @ self._follow(opened.state).R

    def reduced_rows(self, opened: Opened, exact: np.ndarray) -> np.ndarray:
        R, _ = self._follow(opened.state)
        reduced = R.T @ exact
        within = reduced[:, opened.rows] @ R
        reduced[:, opened.rows] = 0.0
        reduced[:, self.within(opened.rows)] = within
        return reduced

    def all_rows(self, opened: Opened, wanted: np.ndarray) -> np.ndarray:
        R, _ = self._follow(opened.state)
        rows = np.zeros((self.roots.size, wanted.shape[1]))
        rows[self.free] = wanted
        # dq_d = R_d dz
        rows[self.tied, opened.rows.start + self.tied] = 1.0
        rows[self.tied[:, None], self.within(opened.rows)] = -R[self.tied]
        return rows


@kernel
def follow(links, grids, bins, pieces, R, bends, q, v, a):
    """Write what follows in q, q', q'', and its slopes and curvatures over its root.

    `links` (k, 4) holds what follows, what it follows, its root and the root's column in R, those
    that are followed first.
    """
    curves = PackedCurves(grids, bins, pieces)
    for k in range(links.shape[0]):
        d, e, root, j = links[k, 0], links[k, 1], links[k, 2], links[k, 3]
        q[d], slope, curvature = evaluate(curves, k, q[e])
        R[d, j] = slope * R[e, j]
        bends[d] = slope * bends[e] + curvature * R[e, j] * R[e, j]
        v[d] = R[d, j] * v[root]
        a[d] = R[d, j] * a[root] + bends[d] * v[root] * v[root]


@kernel
def follow_each(links, grids, bins, pieces, R, bends, q, v, a, Rs):
    """Write what follows in each of the states q, q' (k, N), and its slopes in `Rs` (k, N, n)."""
    for i in range(q.shape[0]):
        follow(links, grids, bins, pieces, R, bends, q[i], v[i], a)
        for d in range(R.shape[0]):
            for j in range(R.shape[1]):
                Rs[i, d, j] = R[d, j]
