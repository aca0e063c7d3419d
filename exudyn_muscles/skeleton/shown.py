"""What pictures know of a skeleton, all of it at Exudyn's visualization state."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import exudyn as exu
import numpy as np

from ..path.lines import lines
from ..path.paths import Paths
from .tree import Tree, tree_frames

VISUALIZATION = exu.ConfigurationType.Visualization


class Sticks(NamedTuple):
    """Straight lines from joint to joint, in place of graphics that would hide the muscles.

    `points` returns both ends (k, 2, 3) of the k sticks [m], a joint first, `ends` (k,) says where
    the second is the last of a chain. `replaced` are the objects that they stand for; `outline`
    returns points (j, 3) around the graphics of bodies: of those that keep them beside the sticks
    or, if these are not drawn (True), of all.
    """

    points: Callable[[], np.ndarray]
    ends: np.ndarray
    replaced: tuple[int, ...]
    outline: Callable[[bool], np.ndarray]


def coordinates_shown(mbs: exu.MainSystem) -> np.ndarray:
    """Coordinates of the whole system."""
    return np.array(mbs.systemData.GetODE2Coordinates(configuration=VISUALIZATION))


def tree_sticks(mbs: exu.MainSystem, number: int, tree: Tree, rows: slice) -> Sticks:
    """Sticks between the joints of a tree and to the last links' centers of mass.

    They take the place of all graphics of the object `number`, as Exudyn does not tell those that
    the user made from the blocks that it makes itself.
    """
    centers = np.array(mbs.GetObject(number)["linkCOMs"].GetPythonObject(), dtype=float)
    centers = centers.reshape(-1, 3)
    parents = tree.parents
    ends = [i for i in range(len(parents)) if i not in parents]
    origin = np.zeros(3)
    pairs = [
        [(origin, parent), (origin, link)] for link, parent in enumerate(parents) if parent >= 0
    ]
    pairs += [[(origin, link), (centers[link], link)] for link in ends]
    points = [point for pair in pairs for point in pair]
    paths = Paths.straight(
        positions=np.array([position for position, _ in points]),
        links=np.array([link for _, link in points], dtype=np.int64),
        starts=2 * np.arange(len(pairs) + 1),
    )

    def ends_shown() -> np.ndarray:
        q = coordinates_shown(mbs)[rows]
        R, p, _ = tree_frames(tree, q)
        return np.array(lines(paths, R, p, q))

    last = np.arange(len(pairs)) >= len(pairs) - len(ends)
    replaced = (number, *_ground_of(mbs, number, tree))
    return Sticks(ends_shown, last, replaced, lambda _: np.empty((0, 3)))


def _ground_of(mbs: exu.MainSystem, number: int, tree: Tree) -> tuple[int, ...]:
    """The ground that `CreateKinematicTree` makes just before the tree.

    It has a block to every first joint that is not at the base, no name, and the base for its
    position.
    """
    blocks = int((tree.offsets[tree.parents < 0] != 0.0).any(axis=1).sum())
    if number == 0 or blocks == 0:
        return ()
    before = mbs.GetObject(number - 1)
    is_own = (
        before["objectType"] == "Ground"
        and before["name"] == f"object{number - 1}"
        and np.array_equal(before["referencePosition"], tree.base)
        and len(before["VgraphicsData"]) == blocks
    )
    return (number - 1,) if is_own else ()
