"""Coordinates that follow others: q = q(z) with R = dq/dz, z the independent coordinates.

A follower d of the independent coordinate z_j, through others or at once, moves with

    q_d = f(z_j)    q_d' = f' z_j'    q_d'' = f' z_j'' + f'' z_j'^2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import NamedTuple

import numpy as np

from ..errors import ParameterError
from ..numerics.curves import Curve, PackedCurves, evaluate, pack
from ..numerics.kernel import kernel
from .geometry import Geometry


@dataclass(frozen=True)
class Follower:
    """A coordinate of the tree that is a function of another one.

    Parameters
    ----------
    coordinate : str
        The coordinate that follows.
    of : str
        The one that it follows: an independent coordinate, or a follower of one.
    function : Curve
        Of Exudyn's coordinates, which are without the node's reference coordinates: `simm_spline`,
        `linear_function` or any other. Forces jump where its slope does.

    Raises
    ------
    ParameterError
        The function is not a curve.
    """

    coordinate: str
    _: KW_ONLY
    of: str
    function: Curve

    def __post_init__(self) -> None:
        if not isinstance(self.function, Curve):
            raise ParameterError(
                f"follower '{self.coordinate}': its function is a Curve, such as simm_spline(...) "
                f"or linear_function(...), got {self.function!r}"
            )


def linear_function(slope: float, intercept: float = 0.0) -> Curve:
    """The straight line slope x + intercept, as of OpenSim's coordinate couplers.

    A slope of zero locks what follows it.

    Examples
    --------
    >>> linear_function(0.5, 0.25)(3.0)
    array(1.75)
    """
    if not np.isfinite([slope, intercept]).all():
        raise ParameterError(
            f"a linear function's slope and intercept are finite, got {slope!r}, {intercept!r}"
        )
    return Curve.line(slope, intercept)


class Slopes(NamedTuple):
    """R = dq/dz (N, n), and d^2 q/dz_j^2 (N,) of every coordinate by its own z_j."""

    R: np.ndarray
    bends: np.ndarray


class Followers:
    """The followers among the N coordinates of a tree.

    Parameters
    ----------
    followers : sequence of Follower
    names : sequence of str
        Of all N coordinates.

    Attributes
    ----------
    free : (n,) int ndarray
        The independent coordinates, by their numbers in the tree.
    tied : (k,) int ndarray
        The followers.
    roots : (N,) int ndarray
        The independent coordinate that each depends on, by its number in the tree.

    Raises
    ------
    ParameterError
        A follower or what it follows is no coordinate, has several functions, or follows itself.
    """

    def __init__(self, followers: Sequence[Follower], names: Sequence[str]) -> None:
        functions: dict[int, tuple[int, Curve]] = {}
        for follower in followers:
            d, e = (_number(follower, name, names) for name in (follower.coordinate, follower.of))
            if d in functions:
                raise ParameterError(f"coordinate '{follower.coordinate}' follows more than once")
            functions[d] = e, follower.function
        order: list[int] = []
        self.roots = np.arange(len(names))
        for d in functions:
            chain = [d]
            while chain[-1] in functions:
                e = functions[chain[-1]][0]
                if e in chain:
                    raise ParameterError(
                        "followers in a circle: " + ", ".join(names[i] for i in [*chain, e])
                    )
                chain.append(e)
            self.roots[d] = chain[-1]
            order += [i for i in reversed(chain[:-1]) if i not in order]
        self.tied = np.array(order, dtype=np.int64)
        self.free = np.setdiff1d(np.arange(len(names)), self.tied)
        columns = np.searchsorted(self.free, self.roots)
        links = [[d, functions[d][0], self.roots[d], columns[d]] for d in order]
        R = np.zeros((len(names), self.free.size))
        R[self.free, columns[self.free]] = 1.0
        self._slopes = Slopes(R, np.zeros(len(names)))
        self._tables = (
            np.array(links, dtype=np.int64),
            *pack([functions[d][1] for d in order]),
            *self._slopes,
        )

    def follow(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> Slopes:
        """Write the followers' entries of q, q', q'' (N,) from the independent ones.

        The slopes are overwritten by the next call.
        """
        follow(*self._tables, q, v, a)
        return self._slopes

    def state(
        self, z: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], Slopes]:
        """q, q', q'' (N,) from z, z', z'' (n,)."""
        q, q_t, q_tt = state = np.zeros((3, self.roots.size))
        q[self.free], q_t[self.free], q_tt[self.free] = z, v, a
        slopes = self.follow(*state)
        return (q, q_t, q_tt), slopes

    def projected(self, geometry: Callable[..., Geometry]) -> Callable[..., Geometry]:
        """The function (z, z') -> Geometry with r_z = r R from that of all coordinates."""
        rest = np.zeros(self.free.size)

        def of_independent(z: np.ndarray, v: np.ndarray) -> Geometry:
            (q, q_t, _), slopes = self.state(z, v, rest)
            length, speed, r, S = geometry(q, q_t)
            return Geometry(length, speed, r @ slopes.R, slopes.R.T @ S if S.size else S)

        return of_independent


def _number(follower: Follower, name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise ParameterError(
            f"follower '{follower.coordinate}' of '{follower.of}': the tree has no coordinate "
            f"'{name}', only {', '.join(names)}"
        )
    return list(names).index(name)


@kernel
def follow(links, grids, bins, pieces, R, bends, q, v, a):
    """Write what follows in q, q', q'', and its slopes and curvatures over its root.

    `links` (k, 4) holds follower, followed, root and the root's column in R, those that are
    followed first.
    """
    curves = PackedCurves(grids, bins, pieces)
    for k in range(links.shape[0]):
        d, e, root, j = links[k, 0], links[k, 1], links[k, 2], links[k, 3]
        q[d], slope, curvature = evaluate(curves, k, q[e])
        R[d, j] = slope * R[e, j]
        bends[d] = slope * bends[e] + curvature * R[e, j] * R[e, j]
        v[d] = R[d, j] * v[root]
        a[d] = R[d, j] * a[root] + bends[d] * v[root] * v[root]
