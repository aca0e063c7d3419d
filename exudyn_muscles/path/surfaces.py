"""Surfaces that muscles wrap over, and which part of a path wraps over which of them.

Position, orientation, side and range mean what they mean in OpenSim's `WrapObject` and `PathWrap`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any

import numpy as np

from ..checks import link_number, number_within, three_numbers
from ..errors import ParameterError
from .frames import GROUND

# Columns of `Paths.wraps`: what the surface is and where, and the path points that it may be
# between.
SHAPE, LINK, FIRST, LAST, AXIS, SIDE, HALF_LENGTH = range(7)
RADII, POSITION, ROTATION = slice(7, 10), slice(10, 13), slice(13, 22)
WRAP_COLUMNS = 22
CYLINDER, SPHERE, ELLIPSOID, TORUS = range(4)

LARGEST = 1e3  # radius, length [m]
LARGEST_RATIO = 10.0  # of an ellipsoid's radii


@dataclass(frozen=True)
class WrapSurface:
    """What all surfaces have in common; use `WrapCylinder`, `WrapSphere`, ...

    Parameters
    ----------
    position : (3,) sequence of float
        Of the center, in the frame of the link or in the global frame [m].
    rotation : (3,) sequence of float
        Body-fixed angles about x, y and z, one after the other [rad].
    link : int, ObjectIndex or MarkerIndex, optional
        As in `PathPoint`; ground if left out.
    side : str, optional
        "x", "-x", "y", ...: the muscle passes on this side of the center, in the surface's own
        axes; OpenSim's `quadrant`. By the shorter way if left out.
    active : bool
        Nothing wraps over an inactive surface.
    name : str
        For messages.

    Raises
    ------
    ParameterError
        Names the surface, the parameter, its value and the allowed range.
    """

    _: KW_ONLY
    position: Sequence[float] = (0.0, 0.0, 0.0)
    rotation: Sequence[float] = (0.0, 0.0, 0.0)
    link: int = GROUND
    side: str | None = None
    active: bool = True
    name: str = ""

    def __post_init__(self) -> None:
        for parameter in ("position", "rotation"):
            self._set_vector(parameter)
        object.__setattr__(self, "link", link_number(f"{self}: link", self.link))
        sides = [sign + axis for axis in "xyz" for sign in ("", "-")]
        if self.side is not None and self.side not in sides:
            raise ParameterError(f"{self}: side = {self.side!r} is not one of {', '.join(sides)}")

    def __str__(self) -> str:
        return f"{type(self).__name__} '{self.name}'" if self.name else type(self).__name__

    def _set_vector(self, parameter: str) -> None:
        vector = three_numbers(f"{self}: {parameter}", getattr(self, parameter))
        object.__setattr__(self, parameter, vector)

    def _set_size(self, parameter: str, value: Any, low: float = 1e-6) -> float:
        return number_within(f"{self}: {parameter}", value, low, LARGEST, "m")

    def row(self) -> np.ndarray:
        """The surface's part of its row in `Paths.wraps`."""
        from scipy.spatial.transform import Rotation  # slow to import

        row = np.zeros(WRAP_COLUMNS)
        row[LINK], row[POSITION] = self.link, self.position
        row[ROTATION] = Rotation.from_euler("XYZ", self.rotation).as_matrix().ravel()
        if self.side is not None:
            row[AXIS] = "xyz".index(self.side[-1])
            row[SIDE] = -1.0 if self.side[0] == "-" else 1.0
        return row


@dataclass(frozen=True)
class WrapCylinder(WrapSurface):
    """A cylinder about its z axis: a muscle runs over it along a helix.

    Where both ends of the helix would lie beyond the cylinder's length, nothing wraps.

    Parameters
    ----------
    radius : float
        [m].
    length : float
        [m], half of it on each side of the center; unlimited if left out.
    **surface
        As in `WrapSurface`. A side of z, along the axis, does what it does in OpenSim: around the
        cylinder it goes by which of the ends are on that side (`path/cylinder.py`).
    """

    radius: float
    length: float = math.inf

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "radius", self._set_size("radius", self.radius))
        if self.length != math.inf:
            object.__setattr__(self, "length", self._set_size("length", self.length, 0.0))

    def row(self) -> np.ndarray:
        row = super().row()
        row[SHAPE], row[RADII], row[HALF_LENGTH] = CYLINDER, self.radius, 0.5 * self.length
        return row


@dataclass(frozen=True)
class WrapSphere(WrapSurface):
    """A sphere: a muscle runs over it along a great circle.

    Parameters
    ----------
    radius : float
        [m].
    **surface
        As in `WrapSurface`.
    """

    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "radius", self._set_size("radius", self.radius))

    def row(self) -> np.ndarray:
        row = super().row()
        row[SHAPE], row[RADII] = SPHERE, self.radius
        return row


@dataclass(frozen=True)
class WrapEllipsoid(WrapSurface):
    """An ellipsoid: a muscle runs over it along a geodesic.

    Parameters
    ----------
    radii : (3,) sequence of float
        Half axes along x, y and z [m]; the largest is at most ten times the smallest.
    **surface
        As in `WrapSurface`.
    """

    radii: Sequence[float]

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set_vector("radii")
        radii = tuple(self._set_size("radii", radius) for radius in self.radii)
        if max(radii) > LARGEST_RATIO * min(radii):
            raise ParameterError(
                f"{self}: radii = {radii} m differ by more than a factor of {LARGEST_RATIO:g}"
            )

    def row(self) -> np.ndarray:
        row = super().row()
        row[SHAPE], row[RADII] = ELLIPSOID, self.radii
        return row


@dataclass(frozen=True)
class WrapTorus(WrapSurface):
    """A torus about its z axis: a muscle runs through its hole, over the tube's inner side.

    Parameters
    ----------
    inner_radius : float
        Of the tube [m].
    outer_radius : float
        Of the circle that the tube is around [m], larger than that; OpenSim's names.
    **surface
        As in `WrapSurface`; with a side nothing wraps while the muscle's straight line is next to
        the circle on the other side.
    """

    inner_radius: float
    outer_radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("inner_radius", "outer_radius"):
            object.__setattr__(self, name, self._set_size(name, getattr(self, name)))
        if not self.inner_radius < self.outer_radius:
            raise ParameterError(
                f"{self}: outer_radius = {self.outer_radius:g} m is not above inner_radius = "
                f"{self.inner_radius:g} m"
            )

    def row(self) -> np.ndarray:
        row = super().row()
        row[SHAPE], row[RADII] = TORUS, (self.inner_radius, self.outer_radius, 0.0)
        return row


@dataclass(frozen=True)
class PathWrap:
    """A surface that a part of a path may wrap over.

    Parameters
    ----------
    surface : WrapCylinder, WrapSphere, WrapEllipsoid or WrapTorus
    first, last : int
        The path points between which it may wrap, as indices of the muscle's `path`: from 0, or
        from -1 backwards. The whole path if left out.
    """

    surface: WrapSurface
    first: int = 0
    last: int = -1

    def __post_init__(self) -> None:
        if not isinstance(self.surface, WrapSurface):
            raise ParameterError(f"a PathWrap's surface is not one: {self.surface!r}")

    def row(self, points: int) -> np.ndarray:
        """The row in `Paths.wraps` for a path of so many points.

        Parameters
        ----------
        points : int

        Returns
        -------
        ndarray

        Raises
        ------
        ParameterError
            `first` or `last` is no point of the path, or `first` not before `last`.
        """
        row = self.surface.row()
        ends = []
        for name, given in (("first", self.first), ("last", self.last)):
            if not isinstance(given, (int, np.integer)) or not -points <= given < points:
                raise ParameterError(
                    f"{self.surface}: {name} = {given!r} is not the index of one of {points} "
                    "path points"
                )
            ends.append(given % points)
        if ends[0] >= ends[1]:
            raise ParameterError(
                f"{self.surface}: first = {self.first} does not lie before last = {self.last}"
            )
        row[FIRST], row[LAST] = ends
        return row
