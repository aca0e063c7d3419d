"""Coordinates of a tree whose loops are closed: z are those that the closures leave.

With y the coordinates that follow no other by a function, and q = q(y), R_y = dq/dy, the closures

    phi(q) = 0,    G q' = 0,    G q'' + gamma = 0

hold a part y_d of y, which makes up the rank of G R_y: Newton's method finds y_d = y_d(z), and

    y_d' = S z',    S = -(G_d)^+ G_z,    y_d'' = S z'' - (G_d)^+ (gamma + G R_y' y'),

where G_d and G_z are the columns of G R_y. The pseudoinverse makes redundant closures do no harm.
What z is does not depend on where the system was before: y_d is followed from one pose, that of
the model, along a straight line in z.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgelsy

from ..errors import ModelError, ParameterError
from .closures import LINKS, Loops, closure_equations, closure_rows
from .coupling import DependentCoordinate
from .dependent import Dependent
from .renumbered import Renumbering
from .state import State
from .tied import Tied
from .tree import Tree

# Singular values of G over the largest one, below which closures are redundant: loops of files
# close to six digits, and what locks an axis that is locked already then has 1e-6.
REDUNDANT = 1e-5
# Of what the closures know of the coordinate that they know best, how much they have to know of one
# that they hold: less, and it would soon be at a dead point.
KNOWN = 0.3
# Of what the closures know least over best of those that they hold, at a dead point; and the work
# space of LAPACK's solver, in its blocks.
SINGULAR, WORK = 1e-8, 64
FARTHEST = 0.25  # rad or m, of one step towards a pose
ON_THE_WAY, MOST_ITERATIONS = 2, 60
ROUNDING, NEARLY = 1e-14, 1e-9  # rad or m, of steps that go no further, and that may not
CLOSE = 1e-4  # m or 1, by which redundant closures may contradict each other


class ClosedBasis(NamedTuple):
    """R = dq/dz (N, n), and R' z' (N,)."""

    R: np.ndarray
    bent: np.ndarray


class _Equations(NamedTuple):
    """phi, G R_y, gamma + G R_y' y' of y and y', with q, R_y and R_y' y'."""

    phi: np.ndarray
    G: np.ndarray
    gamma: np.ndarray
    q: np.ndarray
    R: np.ndarray
    bent: np.ndarray


class Closed(Tied):
    """z are coordinates of a tree that neither follow others nor are held by closures.

    Parameters
    ----------
    loops : Loops
    given : sequence of DependentCoordinate
    tree : Tree
    names : sequence of str
        Of all N coordinates of the tree.
    near : (N,) ndarray
        A pose of the tree; the nearest one where the closures hold is the model's.

    Attributes
    ----------
    pose : (n,) ndarray
        z of the model's pose.

    Raises
    ------
    ParameterError
        As `chains` and `closure_rows`, or one of `held_first` is no coordinate.
    ModelError
        There is no pose near this one where the closures hold, or they leave nothing to move.
    """

    def __init__(
        self,
        loops: Loops,
        given: Sequence[DependentCoordinate],
        tree: Tree,
        names: Sequence[str],
        near: np.ndarray,
    ) -> None:
        self._rows, self._tables = closure_rows(loops.closures, len(tree)), tree.tables()
        self._explicit = Dependent(given, names) if given else None
        self._identity = np.eye(len(names))
        inner = np.arange(len(names)) if self._explicit is None else self._explicit.free
        self._names = [names[j] for j in inner.tolist()]
        self._reference = self._assembled(near[inner])
        rest = np.zeros(inner.size)
        G = self._equations(self._reference, rest).G
        for name in set(loops.held_first) - set(names):
            raise ParameterError(f"held_first: the tree has no coordinate '{name}'")
        first = [self._names.index(name) for name in loops.held_first if name in self._names]
        held = _determined(G, [*first, *(j for j in range(inner.size)[::-1] if j not in first)])
        self._held = np.sort(held)
        self._z = np.setdiff1d(np.arange(inner.size), self._held)
        if not self._z.size:
            raise ModelError("the closures of the tree's loops leave no coordinate that can move")
        free = inner[self._z]
        super().__init__(free, np.setdiff1d(np.arange(len(names)), free))
        self.pose = self._reference[self._z]
        roots = np.arange(len(names)) if self._explicit is None else self._explicit.roots
        self._matters = np.isin(free, roots[_between(self._rows, tree.parents)])
        self._known: dict[str, tuple] = {}  # the last pose and basis, with where they are

    # Forces.

    def equations_on(self, new: Renumbering) -> np.ndarray:
        """The closures' equations (c, COLUMNS) on a tree with other numbers."""
        return new.on_links(self._rows, LINKS)

    def multipliers(self, G: np.ndarray, missing: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Forces in the closures (c,) that with the reactions of coordinates that follow others
        are the torques `missing` (N,) at q (N,); of redundant closures the least ones."""
        R = self._identity
        if self._explicit is not None:
            y = q[self._explicit.free]
            R = self._explicit.follow_from(y, np.zeros(y.size), np.zeros(y.size))[1].R
        return np.asarray(np.linalg.lstsq((G @ R).T, R.T @ missing, rcond=REDUNDANT)[0])

    # Poses.

    def _equations(self, y: np.ndarray, y_t: np.ndarray) -> _Equations:
        c, n = len(self._rows), self._tables[0].size
        phi, G, gamma = np.empty(c), np.empty((c, n)), np.empty(c)
        if self._explicit is None:
            q, q_t, R, bent = y, y_t, self._identity, np.zeros(n)
        else:
            (q, q_t, bent), slopes = self._explicit.follow_from(y, y_t, np.zeros(y.size))
            R = slopes.R
        closure_equations(*self._tables, self._rows, q, q_t, phi, G, gamma)
        return _Equations(phi, G @ R, gamma + G @ bent, q, R, bent)

    def _assembled(self, near: np.ndarray) -> np.ndarray:
        """The pose y nearest to one where the closures hold."""
        y, rest = near.copy(), np.zeros(near.size)
        for _ in range(MOST_ITERATIONS):
            found = self._equations(y, rest)
            if not np.isfinite(found.G).all():
                break
            step = np.linalg.lstsq(found.G, found.phi, rcond=REDUNDANT)[0]
            y -= step * min(1.0, FARTHEST / max(np.abs(step).max(), FARTHEST))
            if np.abs(step).max() <= ROUNDING * max(1.0, np.abs(y).max()):
                break
        lack = np.abs(self._equations(y, rest).phi).max()
        if not lack <= CLOSE:
            raise ModelError(
                "the loops of the tree cannot be closed near its initial pose: "
                f"{lack:.2g} m or rad are left"
            )
        return y

    def _pose(self, z: np.ndarray) -> np.ndarray:
        """y where the closures hold.

        Raises
        ------
        ModelError
            There is none; names the coordinates.
        """
        known = self._known.get("pose")
        if known is not None and np.array_equal(known[0], z):
            return known[1]
        y = self._reference.copy()
        way = z - self.pose
        count = max(1, int(np.ceil(np.abs(way[self._matters]).max(initial=0.0) / FARTHEST)))
        for k in range(1, count):
            self._approach(y, self.pose + way * (k / count), ON_THE_WAY)
        arrived = self._approach(y, z, MOST_ITERATIONS)
        if not (arrived and np.abs(self._equations(y, np.zeros(y.size)).phi).max() <= CLOSE):
            raise self._error(z, "leave no pose there")
        self._known["pose"] = z.copy(), y
        return y

    def _approach(self, y: np.ndarray, z: np.ndarray, iterations: int) -> bool:
        """Bring y to z and to where the closures hold; whether it is there."""
        ahead, rest, before = z - y[self._z], np.zeros(y.size), np.inf
        for _ in range(iterations):
            found = self._equations(y, rest)
            lack = found.phi + found.G[:, self._z] @ ahead
            step = self._solved(found.G[:, self._held], lack, z)
            y[self._z], ahead = z, np.zeros(z.size)
            y[self._held] -= step
            length = np.abs(step).max()
            is_rounding = length < NEARLY and length >= before
            if is_rounding or length <= ROUNDING * max(1.0, np.abs(y[self._held]).max()):
                return True
            before = length
        return False

    def _solved(self, G: np.ndarray, right: np.ndarray, z: np.ndarray) -> np.ndarray:
        """(G_d)^+ times right-hand sides (c,) or (c, k)."""
        if not np.isfinite(G).all():
            raise self._error(z, "leave no pose there")
        c, k = G.shape
        sides = right.reshape(c, -1)
        work = WORK * (c + k + sides.shape[1])
        _, x, _, rank, _ = dgelsy(G, sides, np.zeros(k, dtype=np.int32), SINGULAR, work)
        if rank < k:
            raise self._error(z, f"do not determine {', '.join(self._held_names)} there")
        return np.asarray(x[:k].reshape(k, *right.shape[1:]))

    @property
    def _held_names(self) -> list[str]:
        return [self._names[j] for j in self._held.tolist()]

    def _error(self, z: np.ndarray, what: str) -> ModelError:
        shown = ", ".join(
            f"{self._names[j]} = {value:.4g}"
            for j, value, matters in zip(self._z.tolist(), z, self._matters, strict=True)
            if matters
        )
        return ModelError(f"the closures of the tree's loops {what}: {shown}")

    # As of `Tied`.

    def _basis(self, z: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, ClosedBasis]:
        """q, and the basis there."""
        known = self._known.get("basis")
        if known is not None and np.array_equal(known[0], z) and np.array_equal(known[1], v):
            return known[2], known[3]
        y = self._pose(z)
        found = self._equations(y, np.zeros(y.size))
        S = -self._solved(found.G[:, self._held], found.G[:, self._z], z)
        y_t = np.empty(y.size)
        y_t[self._z], y_t[self._held] = v, S @ v
        found = self._equations(y, y_t)
        inner, bent = np.zeros((y.size, z.size)), np.zeros(y.size)
        inner[self._z, np.arange(z.size)], inner[self._held] = 1.0, S
        bent[self._held] = -self._solved(found.G[:, self._held], found.gamma, z)
        basis = ClosedBasis(found.R @ inner, found.R @ bent + found.bent)
        self._known["basis"] = z.copy(), v.copy(), found.q, basis
        return found.q, basis

    def follow_from(
        self, z: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ClosedBasis]:
        q, basis = self._basis(np.asarray(z, dtype=float), v)
        return (q.copy(), basis.R @ v, basis.R @ a + basis.bent), basis

    def follow(self, state: State) -> ClosedBasis:
        (q, v, a), basis = self.follow_from(
            *(values[self.free] for values in (state.q, state.v, state.a))
        )
        for values, found in ((state.q, q), (state.v, v), (state.a, a)):
            values[self.tied] = found[self.tied]
        return basis

    def bent(self, basis: ClosedBasis, q_t: np.ndarray) -> np.ndarray:
        return basis.bent


def _between(rows: np.ndarray, parents: np.ndarray) -> np.ndarray:
    """The links (k,) whose joints move the two sides of a closure against each other."""
    found = np.zeros(parents.size, dtype=bool)
    for links in rows[:, LINKS].astype(int):
        behind = np.zeros(parents.size, dtype=bool)
        for link in links.tolist():
            while link >= 0:
                behind[link] ^= True
                link = int(parents[link])
        found |= behind
    return np.flatnonzero(found)


def _determined(G: np.ndarray, order: Sequence[int]) -> list[int]:
    """Columns of G that make up its rank: one after the other the first one in this order of which
    enough is left beside those that are taken."""
    values = np.linalg.svd(G, compute_uv=False)
    left, taken = G.copy(), []
    for _ in range(int((values > REDUNDANT * values[0]).sum())):
        lengths = np.linalg.norm(left, axis=0)
        j = next(j for j in order if lengths[j] >= KNOWN * lengths.max())
        direction = left[:, j] / lengths[j]
        left -= np.outer(direction, direction @ left)
        left[:, j] = 0.0
        taken.append(j)
    return taken
