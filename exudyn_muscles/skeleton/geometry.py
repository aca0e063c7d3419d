"""l, l' and r = -dl/dq of all muscles on a tree: frames of its links, paths, J^T."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import WrappingError
from ..forces.actuator_table import (
    COORDINATE,
    KIND,
    ON,
    ActuatorTable,
    columns,
)
from ..forces.jacobian import add_generalized, generalized
from ..numerics.curves import PackedCurves
from ..numerics.kernel import kernel
from ..numerics.products import FACTOR_COORDINATE
from ..path.geometry import path_geometry, space_for
from ..path.lines import lines
from ..path.paths import COORDINATE as RULE
from ..path.paths import Paths
from ..path.pulls import FORCE
from ..path.surfaces import LINK
from .tree import Tree, link_frames, tree_frames

FRAME = 15  # numbers of a link's orientation, position and joint axis
NO_COLUMNS = np.empty((0, 0))


class Geometry(NamedTuple):
    """Musculotendon geometry of m muscles on n coordinates.

    `length` l (m,) [m], `lengthening_speed` l' (m,) [m/s], `moment_arms` r (m, n) [m or 1],
    r = -dl/dq, so that the torques are r^T F. Ideal actuators with the forces f (k,) add S f;
    `columns` are S (n, k).
    """

    length: np.ndarray
    lengthening_speed: np.ndarray
    moment_arms: np.ndarray
    columns: np.ndarray = NO_COLUMNS

    def torque(self, forces: np.ndarray, ideal: np.ndarray) -> np.ndarray:
        """Torques (n,) of the muscles' forces (m,) and the ideal actuators' (k,)."""
        torque = self.moment_arms.T @ forces
        if ideal.size:
            torque += self.columns @ ideal
        return torque

    def load(self, forces: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """What these forces (m + k,) and their `torque` (n,) are for Exudyn."""
        return torque


class Mounted(NamedTuple):
    """Muscles and actuators on a skeleton.

    `geometry` takes a `place` and returns a Geometry; `columns` takes what the loads are written
    at, the tree's q or a system's pose, and returns S (width, r) of the actuators. `torques` takes
    k places and forces (m + r,) and returns what these are on the coordinates (k, n). `loads` of a
    system takes its pose and returns l, l' (m,) and what unit forces are (m + r, width).
    """

    geometry: Callable[..., Geometry]
    columns: Callable[[Any], np.ndarray]
    torques: Callable[[Sequence[tuple], np.ndarray], np.ndarray]
    loads: Callable[..., tuple[np.ndarray, np.ndarray, np.ndarray]] | None = None


@kernel
def tree_geometry(
    joints, parents, rotations, offsets, reference, positions, links, starts, bent, rules,
    grids, bins, pieces, wraps, wrap_starts, factors, factor_starts, integers, numbers, q, v, l,
    l_t, r,
):  # fmt: skip
    """Write l (m,), l' (m,) and r (m, n) at the coordinates `q` and speeds `v`.

    Returns the first muscle for which no geodesic was found, or -1. `integers` and
    `numbers` are for the work.
    """
    # Handed over from Python as a tuple they would take a microsecond more.
    curves = PackedCurves(grids, bins, pieces)
    paths = Paths(
        positions, links, starts, bent, rules, curves, wraps, wrap_starts, factors, factor_starts
    )
    n = joints.size
    R, p = numbers[: 9 * n].reshape((n, 3, 3)), numbers[9 * n : 12 * n].reshape((n, 3))
    axes = numbers[12 * n : FRAME * n].reshape((n, 3))
    link_frames(joints, parents, rotations, offsets, reference, q, R, p, axes)
    pulls, failed = path_geometry(paths, None, R, p, q, integers, numbers[FRAME * n :], l)
    if failed >= 0:
        return failed
    generalized(joints, parents, p, axes, pulls, r)
    for i in range(l.size):
        l_t[i] = 0.0
        for j in range(n):
            l_t[i] -= r[i, j] * v[j]
    return -1


@kernel
def add_path_torques(
    joints, parents, rotations, offsets, reference, positions, links, starts, bent, rules,
    grids, bins, pieces, wraps, wrap_starts, factors, factor_starts, integers, numbers, crossed,
    forces, wanted, l, first, q, torques,
):  # fmt: skip
    """Add what tensions (m,) along the paths are at the coordinates `q` (k, n) to torques (k, n).

    A path is laid anew only where coordinates that it has `crossed` (m, n) are others than in the
    first row. Returns the first row and path for which no geodesic was found, or -1. `wanted`, l
    (m,) and what paths are in the `first` row (m, n) are room, the rest as of `tree_geometry`.
    """
    paths = Paths(
        positions, links, starts, bent, rules, PackedCurves(grids, bins, pieces), wraps,
        wrap_starts, factors, factor_starts,
    )  # fmt: skip
    n, m = joints.size, l.size
    R, p = numbers[: 9 * n].reshape((n, 3, 3)), numbers[9 * n : 12 * n].reshape((n, 3))
    axes = numbers[12 * n : FRAME * n].reshape((n, 3))
    for k in range(q.shape[0]):
        link_frames(joints, parents, rotations, offsets, reference, q[k], R, p, axes)
        for i in range(m):
            wanted[i] = k == 0
        for j in range(n):
            if q[k, j] != q[0, j]:
                for i in range(m):
                    wanted[i] |= crossed[i, j]
        pulls, failed = path_geometry(paths, wanted, R, p, q[k], integers, numbers[FRAME * n :], l)
        if failed >= 0:
            return k, failed
        for i in range(m):
            if k == 0:
                for j in range(n):
                    first[i, j] = 0.0
                add_pulls(joints, parents, p, axes, pulls, i, forces[i], first[i])
            elif wanted[i]:
                add_pulls(joints, parents, p, axes, pulls, i, forces[i], torques[k])
                continue
            for j in range(n):
                torques[k, j] += first[i, j]
    return -1, -1


@kernel
def add_pulls(joints, parents, p, axes, pulls, i, force, Q):
    """Add what those of the `Pulls` are to Q (n,) that are the muscle's with this number, with its
    force; they are changed."""
    for k in range(pulls.firsts[i], pulls.lasts[i]):
        values = pulls.values[k]
        for axis in range(FORCE, FORCE + 3):
            values[axis] *= force
        add_generalized(joints, parents, p, axes, pulls.kinds[k], pulls.numbers[k], values, Q)


def geometry_tables(tree: Tree, paths: Paths) -> tuple[np.ndarray, ...]:
    """The arrays that `tree_geometry` takes before the state; the last two are its work space."""
    integers, numbers = space_for(paths)
    return (
        *tree.tables(),
        *paths[:5], *paths.curves, *paths[6:], integers,
        np.empty(FRAME * len(tree) + numbers.size),
    )  # fmt: skip


def compile_geometry(
    tree: Tree, paths: Paths, muscles: Sequence[str]
) -> Callable[[np.ndarray, np.ndarray], Geometry]:
    """The function (q, q') -> Geometry of the paths of these muscles, by their names, on a tree.

    Without checks of the arguments; raises WrappingError.
    """
    tables = geometry_tables(tree, paths)
    m, n = paths.starts.size - 1, len(tree)

    def geometry(q: np.ndarray, v: np.ndarray) -> Geometry:
        l, l_t, r = np.empty(m), np.empty(m), np.empty((m, n))
        failed = tree_geometry(*tables, q, v, l, l_t, r)
        if failed >= 0:
            raise _no_way(muscles[failed], q)
        return Geometry(l, l_t, r)

    return geometry


def _no_way(muscle: str, q: np.ndarray) -> WrappingError:
    return WrappingError(
        f"muscle '{muscle}': found no way over an ellipsoid at q = "
        f"{np.array2string(q, precision=4)}; its line passes too near the center"
    )


class PathTorques:
    """What tensions along paths of these names are on a tree."""

    def __init__(self, tree: Tree, paths: Paths, names: Sequence[str]) -> None:
        shape = m, _ = len(names), len(tree)
        self._tables, self._names = geometry_tables(tree, paths), names
        self._crossed = crossed_by(tree, paths)
        self._room = np.empty(m, dtype=bool), np.empty(m), np.empty(shape)

    def add(self, tensions: np.ndarray, q: np.ndarray, torques: np.ndarray) -> None:
        """Add those of tensions (m,) at coordinates (k, N) to torques (k, N)."""
        state, failed = add_path_torques(
            *self._tables, self._crossed, tensions, *self._room, q, torques
        )
        if failed >= 0:
            raise _no_way(self._names[failed], q[state])


def crossed_by(tree: Tree, paths: Paths) -> np.ndarray:
    """Which coordinates each path depends on: (m, N) bool."""
    N = len(tree)
    behind = np.zeros((N + 1, N), dtype=bool)  # the joints between ground, the last row, and links
    for link, parent in enumerate(tree.parents):
        behind[link] = behind[parent]
        behind[link, link] = True
    found = np.zeros((paths.starts.size - 1, N), dtype=bool)
    for i, crossed in enumerate(found):
        points = slice(paths.starts[i], paths.starts[i + 1])
        wraps = paths.wraps[paths.wrap_starts[i] : paths.wrap_starts[i + 1], LINK]
        links = behind[np.r_[paths.links[points], wraps.astype(int)]]
        crossed |= links.any(axis=0) & ~links.all(axis=0)
        factors = paths.factors[paths.factor_starts[i] : paths.factor_starts[i + 1]]
        own = np.r_[paths.rules[points, RULE], factors[:, FACTOR_COORDINATE]].astype(int)
        crossed[own[own >= 0]] = True
    return found


def compile_torques(
    tree: Tree, paths: Paths, muscles: Sequence[str], columns: Callable[[np.ndarray], np.ndarray]
) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """The function (q, forces) -> torques of the forces (m + r,) at coordinates (k, N), as (k, N),
    of actuators by their `columns`; raises WrappingError."""
    m, of_muscles = len(muscles), PathTorques(tree, paths, muscles)

    def torques(q: np.ndarray, forces: np.ndarray) -> np.ndarray:
        found = np.zeros(q.shape)
        of_muscles.add(forces[:m], q, found)
        if forces.size > m:
            found += columns(q) @ forces[m:]
        return found

    return torques


@kernel(allocates=True)
def columns_of_each(joints, parents, rotations, offsets, reference, table, q, S):
    """Write the `columns` S (k, N, r) at the coordinates `q` (k, N)."""
    n = joints.size
    R, p, axes = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    for k in range(q.shape[0]):
        link_frames(joints, parents, rotations, offsets, reference, q[k], R, p, axes)
        columns(joints, parents, R, p, axes, table, S[k])


def compile_columns(tree: Tree, actuators: ActuatorTable) -> Callable[[np.ndarray], np.ndarray]:
    """The function q (..., N) -> S (..., N, r) of the actuators; raises WrappingError."""
    table, paths, names = actuators
    shape = len(tree), len(table)
    if (table[:, KIND] == COORDINATE).all():
        constant = np.zeros(shape)
        constant[table[:, ON].astype(int), np.arange(len(table))] = 1.0
        constant.setflags(write=False)
        return lambda q: (
            np.broadcast_to(constant, (*q.shape[:-1], *shape)) if q.ndim > 1 else constant
        )

    tables = tree.tables()
    tension, along, rest = compile_geometry(tree, paths, names), actuators.along, tree.reference
    signs = actuators.signs

    def of_tree(q: np.ndarray) -> np.ndarray:
        each, S = q.reshape(-1, shape[0]), np.empty((*q.shape[:-1], *shape))
        of_each = S.reshape(-1, *shape)
        columns_of_each(*tables, table, each, of_each)
        if names:
            for row, into in zip(each, of_each, strict=True):
                into[:, along] = signs * tension(row, rest).moment_arms.T
        return S

    return of_tree


def with_columns(
    geometry: Callable[..., Geometry], columns: Callable[[np.ndarray], np.ndarray]
) -> Callable[..., Geometry]:
    """The function `geometry` with the actuators' columns at its coordinates."""
    return lambda q, v: geometry(q, v)._replace(columns=columns(q))


def path_points(tree: Tree, paths: Paths, q: ArrayLike) -> list[np.ndarray]:
    """The `lines` of all muscles at the tree's coordinates `q` (n,)."""
    q = np.asarray(q, dtype=float)
    R, p, _ = tree_frames(tree, q)
    return lines(paths, R, p, q)
