"""Path points, and the paths of all muscles as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import ParameterError
from ..muscle.parameters import MuscleSet

GROUND = -1


@dataclass(frozen=True)
class PathPoint:
    """A point of a muscle path, fixed on ground or on a link of the tree.

    Parameters
    ----------
    position : (3,) sequence of float
        In the frame of the link, or in the global frame [m].
    link : int, optional
        Number of the link in the kinematic tree, from 0; ground if left out.

    Raises
    ------
    ParameterError
        The position is not three finite numbers, or the link is not an integer from 0.
    """

    position: Sequence[float]
    link: int = GROUND

    def __post_init__(self) -> None:
        try:
            x, y, z = (float(value) for value in self.position)
        except (TypeError, ValueError):
            x = y = z = np.nan
        if not np.isfinite([x, y, z]).all():
            raise ParameterError(
                f"a path point's position is three finite numbers in m, got {self.position!r}"
            )
        object.__setattr__(self, "position", (x, y, z))
        if not isinstance(self.link, (int, np.integer)) or self.link < GROUND:
            raise ParameterError(f"a path point's link is an integer from 0, got {self.link!r}")
        object.__setattr__(self, "link", int(self.link))


@dataclass(frozen=True, eq=False)
class Paths:
    """The paths of m muscles.

    Attributes
    ----------
    positions : (k, 3) ndarray
        All points, muscle by muscle, in their own frames [m].
    links : (k,) int ndarray
        Their links, -1 for ground.
    starts : (m + 1,) int ndarray
        Muscle i owns the points starts[i] to starts[i + 1].
    """

    positions: np.ndarray
    links: np.ndarray
    starts: np.ndarray


def collect_paths(muscles: MuscleSet, number_of_links: int) -> Paths:
    """The paths of a set, checked against a tree of `number_of_links` links.

    Raises
    ------
    ParameterError
        A path has fewer than two points, is not made of `PathPoint`, or names a link that does not
        exist; names the muscle.
    """
    for muscle in muscles:
        if len(muscle.path) < 2:
            raise ParameterError(
                f"muscle '{muscle.name}': a path needs at least two points, got {len(muscle.path)}"
            )
        for number, point in enumerate(muscle.path):
            if not isinstance(point, PathPoint):
                raise ParameterError(
                    f"muscle '{muscle.name}': path point {number} is a PathPoint, got {point!r}"
                )
            if point.link >= number_of_links:
                raise ParameterError(
                    f"muscle '{muscle.name}': path point {number} is on link {point.link}, but the "
                    f"tree has links 0 to {number_of_links - 1}"
                )
    points = [point for muscle in muscles for point in muscle.path]
    counts = [len(muscle.path) for muscle in muscles]
    return Paths(
        positions=np.array([point.position for point in points]),
        links=np.array([point.link for point in points], dtype=np.int64),
        starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
    )
