"""Coordinates of a tree of which some follow others by functions.

One that follows z_j alone, through others or at once, moves with

    q_d = f(z_j)    q_d' = f' z_j'    q_d'' = f' z_j'' + f'' z_j'^2,

and one that follows several q_e with

    q_d' = sum f_e q_e'    q_d'' = sum f_e q_e'' + sum f_eg q_e' q_g'.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..numerics.curves import Curve, PackedCurves, evaluate, pack
from ..numerics.kernel import kernel
from ..numerics.products import (
    COEFFICIENT,
    FACTOR_COLUMNS,
    FACTOR_COORDINATE,
    SumOfProducts,
    factor_at,
    factor_rows,
    term_at,
)
from .coupling import Chains, DependentCoordinate, chains
from .state import State
from .tied import Slopes, Tied

# Columns of a link: what follows, the only independent coordinate that it needs, or -1; then what
# it follows, that coordinate's column in R and the curve, or of several its first and last factor.
FOLLOWS, ROOT, FOLLOWED, COLUMN, CURVE = range(5)
FIRST, LAST = FOLLOWED, COLUMN
SEVERAL = -1


class Dependent(Tied):
    """z are the coordinates that follow no other.

    Parameters
    ----------
    given : sequence of DependentCoordinate
        At least one.
    names : sequence of str
        Of all N coordinates of the tree.

    Raises
    ------
    ParameterError
        As `chains`.
    """

    def __init__(self, given: Sequence[DependentCoordinate], names: Sequence[str]) -> None:
        order = chains(given, names)
        N = len(names)
        super().__init__(np.setdiff1d(np.arange(N), order.tied), order.tied)
        R = np.zeros((N, self.free.size))
        R[self.free, np.arange(self.free.size)] = 1.0
        self._needs = order.needs
        self._slopes = Slopes(R, np.zeros(N))  # overwritten wherever z is
        self._tables = (*_tables(order, self.free), R, np.zeros(N), self._slopes.bent)

    def roots_of(self, coordinates: np.ndarray) -> np.ndarray:
        """The independent coordinates that these need, by numbers in the tree."""
        return np.flatnonzero(self._needs[coordinates].any(axis=0))

    def along(
        self, z: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, Callable[[np.ndarray], np.ndarray]]:
        k, N = len(z), self.size
        q, v_all = np.zeros((2, k, N))
        q[:, self.free], v_all[:, self.free] = z, v
        R = np.empty((k, N, self.free.size))
        follow_each(*self._tables, q, v_all, np.zeros(N), R)
        return q, v_all, lambda torques: np.matmul(torques[:, None], R)[:, 0]

    def follow_from(
        self, z: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], Slopes]:
        q, q_t, q_tt = np.zeros((3, self.size))
        q[self.free], q_t[self.free], q_tt[self.free] = z, v, a
        follow_links(*self._tables, q, q_t, q_tt)
        return (q, q_t, q_tt), self._slopes

    def follow(self, state: State) -> Slopes:
        follow_links(*self._tables, state.q, state.v, state.a)
        return self._slopes


def _tables(order: Chains, free: np.ndarray) -> tuple[np.ndarray, ...]:
    """The arrays that `follow_links` takes first."""
    curves: dict[Curve, int] = {}
    links: list[list[int]] = []
    factors: list[list[float]] = []
    for d, followed, function in zip(
        order.tied.tolist(), order.followed, order.functions, strict=True
    ):
        if order.several[d]:
            terms = (
                function.terms if isinstance(function, SumOfProducts) else [(1.0, {0: function})]
            )
            first = len(factors)
            factors += factor_rows(terms, followed.__getitem__, curves)
            links.append([d, SEVERAL, first, len(factors), -1])
        elif isinstance(function, Curve):
            (root,) = np.flatnonzero(order.needs[d])
            number = curves.setdefault(function, len(curves))
            links.append([d, int(root), followed[0], int(np.searchsorted(free, root)), number])
    return (
        np.array(links, dtype=np.int64),
        np.array(factors, dtype=float).reshape(-1, FACTOR_COLUMNS),
        *pack(list(curves) or [Curve.line(0.0, 0.0)]),
    )


@kernel
def follow_links(links, factors, grids, bins, pieces, R, bends, bent, q, v, a):
    """Write what follows in q, q', q'', its slopes R, and R' z' `bent`.

    `links` (k, 5) holds those that are followed first. `bends` (N,) is room for the curvature of
    each over its root.
    """
    curves = PackedCurves(grids, bins, pieces)
    for k in range(links.shape[0]):
        d, root = links[k, FOLLOWS], links[k, ROOT]
        if root == SEVERAL:
            first, last = links[k, FIRST], links[k, LAST]
            follow_several(factors, curves, first, last, d, R, bent, q, v, a)
            continue
        e, j = links[k, FOLLOWED], links[k, COLUMN]
        q[d], slope, curvature = evaluate(curves, links[k, CURVE], q[e])
        R[d, j] = slope * R[e, j]
        bends[d] = slope * bends[e] + curvature * R[e, j] * R[e, j]
        v[d] = R[d, j] * v[root]
        a[d] = R[d, j] * a[root] + bends[d] * v[root] * v[root]
        bent[d] = bends[d] * (v[root] * v[root])


@kernel
def follow_several(factors, curves, first, last, d, R, bent, q, v, a):
    """The same of the coordinate `d` alone, which follows others by the factors in these rows."""
    q[d], v[d], a[d], bent[d], R[d] = 0.0, 0.0, 0.0, 0.0, 0.0
    row = first
    while row < last:
        end, value = term_at(factors, curves, row, last, q)
        q[d] += value
        for i in range(row, end):
            e = int(factors[i, FACTOR_COORDINATE])
            if e < 0:
                continue
            change = factors[row, COEFFICIENT]
            for k in range(row, end):
                one, slope, _ = factor_at(factors, curves, k, q)
                change *= slope if k == i else one
            for j in range(R.shape[1]):
                R[d, j] += change * R[e, j]
            v[d] += change * v[e]
            a[d] += change * a[e]
            bent[d] += change * bent[e]
            for j in range(row, end):
                curved = factors[row, COEFFICIENT]
                for k in range(row, end):
                    one, slope, curvature = factor_at(factors, curves, k, q)
                    if k == i and k == j:
                        curved *= curvature
                    elif k in (i, j):
                        curved *= slope
                    else:
                        curved *= one
                curved *= v[e] * v[int(factors[j, FACTOR_COORDINATE])]
                a[d] += curved
                bent[d] += curved
        row = end


@kernel
def follow_each(links, factors, grids, bins, pieces, R, bends, bent, q, v, a, Rs):
    """Write what follows in each of the states q, q' (k, N), and its slopes in `Rs` (k, N, n)."""
    for i in range(q.shape[0]):
        follow_links(links, factors, grids, bins, pieces, R, bends, bent, q[i], v[i], a)
        for d in range(R.shape[0]):
            for j in range(R.shape[1]):
                Rs[i, d, j] = R[d, j]
