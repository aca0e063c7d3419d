"""Path points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

from ..checks import link_number, three_numbers
from ..errors import ParameterError
from ..numerics.curves import Curve
from .frames import GROUND

# OpenSim's points, too, are active a little beyond their range.
BEYOND_RANGE = 1e-5


@dataclass(frozen=True)
class PathPoint:
    """A point of a muscle path, fixed on ground, on a link of the tree, or on a body.

    Parameters
    ----------
    position : (3,) sequence of float
        In the frame of the link, or in the global frame [m].
    link : int, ObjectIndex or MarkerIndex, optional
        Number of the link in the kinematic tree, from 0; in other systems a body, or a marker whose
        frame it is. Ground if left out.

    Raises
    ------
    ParameterError
        The position is not three finite numbers, or the link is not an integer from 0, a body or a
        marker.
    """

    position: Sequence[float]
    link: int = GROUND

    def __post_init__(self) -> None:
        position = three_numbers("a path point's position", self.position, "m")
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "link", link_number("a path point's link", self.link))


@dataclass(frozen=True)
class ConditionalPathPoint(PathPoint):
    """A point that belongs to the path while a coordinate is within a range.

    Length and moment arms jump at the ends of the range unless the point lies on the straight line
    there.

    Parameters
    ----------
    position, link
        As in `PathPoint`.
    coordinate : str or int
        Name or number of the coordinate.
    range : pair of float
        Lowest and highest value of the coordinate, both included [rad or m].
    """

    _: KW_ONLY
    coordinate: str | int
    range: tuple[float, float]

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            low, high = (float(value) for value in self.range)
        except (TypeError, ValueError):
            low = high = math.nan
        if not low <= high:
            raise ParameterError(
                f"a conditional path point's range is a lowest and a highest value, got "
                f"{self.range!r}"
            )
        object.__setattr__(self, "range", (low, high))


@dataclass(frozen=True)
class MovingPathPoint:
    """A point whose position on its link follows a coordinate.

    Parameters
    ----------
    x, y, z : Curve or float
        Functions of the coordinate, or fixed numbers [m].
    link : int, optional
        As in `PathPoint`.
    coordinate : str or int
        Name or number of the coordinate.
    """

    x: Curve | float
    y: Curve | float
    z: Curve | float
    link: int = GROUND
    _: KW_ONLY
    coordinate: str | int

    def __post_init__(self) -> None:
        for name in "xyz":
            value = getattr(self, name)
            if isinstance(value, Curve):
                continue
            try:
                number = float(value)
            except (TypeError, ValueError):
                number = math.nan
            if not math.isfinite(number):
                raise ParameterError(
                    f"a moving path point's {name} is a Curve or a finite number in m, got "
                    f"{value!r}"
                )
            object.__setattr__(self, name, number)
        object.__setattr__(self, "link", link_number("a path point's link", self.link))
