"""What pictures know of a skeleton, all of it at Exudyn's visualization state."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import exudyn as exu
import numpy as np

from .tree import Tree

VISUALIZATION = exu.ConfigurationType.Visualization


class OwnGraphics(NamedTuple):
    """What a system has to be drawn by, and where limbs take its place.

    `limbs` are the numbers of the segments that are drawn as limbs, as their graphics are missing
    or would hide the muscles, `replaced` the objects in whose place they are. `outline` returns
    points (j, 3) around the graphics of bodies: of those that keep them beside the limbs or, if
    these are not drawn (True), of all.
    """

    limbs: tuple[int, ...]
    replaced: tuple[int, ...]
    outline: Callable[[bool], np.ndarray]


@contextmanager
def pose_shown(mbs: exu.MainSystem) -> Iterator[Callable[[np.ndarray], None]]:
    """A function that poses the visualization state, which is as before afterwards."""
    data = mbs.systemData
    before = np.array(data.GetODE2Coordinates(configuration=VISUALIZATION))
    try:
        yield lambda x: data.SetODE2Coordinates(x, configuration=VISUALIZATION)
    finally:
        data.SetODE2Coordinates(before, configuration=VISUALIZATION)


def coordinates_shown(mbs: exu.MainSystem) -> np.ndarray:
    """Coordinates of the whole system."""
    return np.array(mbs.systemData.GetODE2Coordinates(configuration=VISUALIZATION))


def tree_graphics(mbs: exu.MainSystem, number: int, tree: Tree) -> OwnGraphics:
    """Limbs take the place of all graphics of the object `number`, as Exudyn does not tell those
    that the user made from the blocks that it makes itself."""
    limbs = tuple(range(len(tree.parents)))
    return OwnGraphics(limbs, (number, *_ground_of(mbs, number, tree)), lambda _: np.empty((0, 3)))


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
