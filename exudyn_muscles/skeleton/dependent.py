"""Coordinates of a tree of which some follow others by functions.

One that follows z_j, through others or at once, moves with

    q_d = f(z_j)    q_d' = f' z_j'    q_d'' = f' z_j'' + f'' z_j'^2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..numerics.curves import PackedCurves, evaluate, pack
from ..numerics.kernel import kernel
from .coupling import DependentCoordinate, chains
from .state import State
from .tied import Tied


class Slopes(NamedTuple):
    """R = dq/dz (N, n), and d^2 q/dz_j^2 (N,) of every coordinate by its own z_j."""

    R: np.ndarray
    bends: np.ndarray


class Dependent(Tied):
    """z are the coordinates that follow no other.

    Parameters
    ----------
    given : sequence of DependentCoordinate
        At least one.
    names : sequence of str
        Of all N coordinates of the tree.

    Attributes
    ----------
    roots : (N,) int ndarray
        The independent coordinate that each depends on, by its number in the tree.

    Raises
    ------
    ParameterError
        As `chains`.
    """

    def __init__(self, given: Sequence[DependentCoordinate], names: Sequence[str]) -> None:
        tied, followed, functions, self.roots = chains(given, names)
        super().__init__(np.setdiff1d(np.arange(len(names)), tied), tied)
        columns = np.searchsorted(self.free, self.roots)
        R = np.zeros((len(names), self.free.size))
        R[self.free, columns[self.free]] = 1.0
        self._slopes = Slopes(R, np.zeros(len(names)))  # overwritten wherever z is
        links = np.column_stack([self.tied, followed, self.roots[self.tied], columns[self.tied]])
        self._tables = (np.ascontiguousarray(links), *pack(functions), *self._slopes)

    def along(
        self, z: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, Callable[[np.ndarray], np.ndarray]]:
        k, N = len(z), self.roots.size
        q, v_all = np.zeros((2, k, N))
        q[:, self.free], v_all[:, self.free] = z, v
        R = np.empty((k, N, self.free.size))
        follow_each(*self._tables, q, v_all, np.zeros(N), R)
        return q, v_all, lambda torques: np.matmul(torques[:, None], R)[:, 0]

    def follow_from(
        self, z: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], Slopes]:
        q, q_t, q_tt = np.zeros((3, self.roots.size))
        q[self.free], q_t[self.free], q_tt[self.free] = z, v, a
        follow_links(*self._tables, q, q_t, q_tt)
        return (q, q_t, q_tt), self._slopes

    def follow(self, state: State) -> Slopes:
        follow_links(*self._tables, state.q, state.v, state.a)
        return self._slopes

    def bent(self, basis: Slopes, q_t: np.ndarray) -> np.ndarray:
        return np.asarray(basis.bends * q_t[self.roots] ** 2)


@kernel
def follow_links(links, grids, bins, pieces, R, bends, q, v, a):
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
        follow_links(links, grids, bins, pieces, R, bends, q[i], v[i], a)
        for d in range(R.shape[0]):
            for j in range(R.shape[1]):
                Rs[i, d, j] = R[d, j]
