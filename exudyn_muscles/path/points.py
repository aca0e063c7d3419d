"""Path points, and the paths of all muscles as arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np

from ..checks import link_number, three_numbers
from ..errors import ParameterError
from ..muscle.parameters import Muscle, MuscleSet
from ..numerics.curves import Curve, PackedCurves, pack
from .functions import FACTOR_COLUMNS, FACTOR_COORDINATE, FunctionPath
from .surfaces import LINK, WRAP_COLUMNS, PathWrap, WrapSurface
from .tree import GROUND

# Columns of `Paths.rules`; -1 stands for no coordinate and no curve.
COORDINATE, LOW, HIGH, CURVES, RULE_COLUMNS = 0, 1, 2, slice(3, 6), 6
NO_RULE = (-1.0, 0.0, 0.0, -1.0, -1.0, -1.0)
# OpenSim's points, too, are active a little beyond their range.
BEYOND_RANGE = 1e-5


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
    names : tuple of str
        Of the muscles.
    bent : int ndarray
        Numbers of the muscles for which what follows matters.
    rules : (k, 6) ndarray
        Of every point: the coordinate that it depends on, its range, the curves of x, y, z.
    curves : PackedCurves
        Of moving points.
    wraps : (w, 22) ndarray
        Surfaces, muscle by muscle; the columns are those of `surfaces`.
    wrap_starts : (m + 1,) int ndarray
        Muscle i owns the wraps wrap_starts[i] to wrap_starts[i + 1].
    factors : (f, 5) ndarray
        Of paths that are functions; the columns are those of `functions`.
    factor_starts : (m + 1,) int ndarray
        Muscle i owns the factors factor_starts[i] to factor_starts[i + 1].
    """

    positions: np.ndarray
    links: np.ndarray
    starts: np.ndarray
    names: tuple[str, ...]
    bent: np.ndarray
    rules: np.ndarray
    curves: PackedCurves
    wraps: np.ndarray
    wrap_starts: np.ndarray
    factors: np.ndarray
    factor_starts: np.ndarray

    def crosses_a_joint(self, i: int) -> bool:
        """Whether the length of muscle `i` depends on any coordinate."""
        points = slice(self.starts[i], self.starts[i + 1])
        wraps = self.wraps[self.wrap_starts[i] : self.wrap_starts[i + 1], LINK]
        factors = self.factors[self.factor_starts[i] : self.factor_starts[i + 1]]
        moves = self.rules[points, CURVES] >= 0.0, factors[:, FACTOR_COORDINATE] >= 0.0
        return len({*self.links[points], *wraps}) > 1 or any(move.any() for move in moves)

    @classmethod
    def straight(cls, positions: np.ndarray, links: np.ndarray, starts: np.ndarray) -> Paths:
        """Straight lines through fixed points."""
        m = len(starts) - 1
        return cls(
            positions, links, starts,
            names=("",) * m,
            bent=np.zeros(0, dtype=np.int64),
            rules=np.tile(NO_RULE, (len(links), 1)),
            curves=pack([NO_CURVE]),
            wraps=np.empty((0, WRAP_COLUMNS)),
            wrap_starts=np.zeros(m + 1, dtype=np.int64),
            factors=np.empty((0, FACTOR_COLUMNS)),
            factor_starts=np.zeros(m + 1, dtype=np.int64),
        )  # fmt: skip


# Kernels get at least one curve.
NO_CURVE = Curve.line(0.0, 0.0)


def collect_paths(
    muscles: MuscleSet, number_of_links: int, coordinates: Sequence[str] | None = None
) -> Paths:
    """The paths of a set, checked against a tree.

    Parameters
    ----------
    muscles : MuscleSet
    number_of_links : int
        Of the tree; each has one coordinate.
    coordinates : sequence of str, optional
        The coordinates' names.

    Raises
    ------
    ParameterError
        A path has fewer than two points, is not made of path points, or names a link, coordinate
        or range that does not exist; names the muscle.
    """
    names = tuple(coordinates or (f"q{j}" for j in range(number_of_links)))
    for muscle in muscles:
        _check_path(muscle, number_of_links)
    listed = [
        () if isinstance(muscle.path, FunctionPath) else tuple(muscle.path) for muscle in muscles
    ]
    points = [point for path in listed for point in path]
    curves: dict[Curve, int] = {NO_CURVE: 0}
    rules = [
        _rule(muscle, number, point, names, curves)
        for muscle, path in zip(muscles, listed, strict=True)
        for number, point in enumerate(path)
    ]
    wraps = [_wrap_rows(muscle, len(path)) for muscle, path in zip(muscles, listed, strict=True)]
    factors = [_factor_rows(muscle, names, curves) for muscle in muscles]
    straight = [
        len(path) > 0 and not rows and all(type(point) is PathPoint for point in path)
        for path, rows in zip(listed, wraps, strict=True)
    ]
    return Paths(
        positions=_table([_position(point) for point in points], 3),
        links=np.array([point.link for point in points], dtype=np.int64),
        starts=_starts(listed),
        names=muscles.names,
        bent=np.flatnonzero(np.logical_not(straight)),
        rules=_table(rules, RULE_COLUMNS),
        curves=pack(list(curves)),
        wraps=_table([row for rows in wraps for row in rows], WRAP_COLUMNS),
        wrap_starts=_starts(wraps),
        factors=_table([row for rows in factors for row in rows], FACTOR_COLUMNS),
        factor_starts=_starts(factors),
    )


def _check_path(muscle: Muscle, number_of_links: int) -> None:
    """Raise ParameterError unless there are points, and surfaces, on links of the tree."""
    if isinstance(muscle.path, FunctionPath):
        if muscle.wraps:
            raise ParameterError(f"muscle '{muscle.name}': a FunctionPath cannot wrap")
        return
    if len(muscle.path) < 2:
        raise ParameterError(
            f"muscle '{muscle.name}': a path needs at least two points, got {len(muscle.path)}"
        )
    for number, point in enumerate(muscle.path):
        what = f"muscle '{muscle.name}': path point {number}"
        if not isinstance(point, (PathPoint, MovingPathPoint)):
            raise ParameterError(f"{what} is a PathPoint, got {point!r}")
        _check_number(what, point.link, number_of_links)
    for number in (0, -1):
        if isinstance(muscle.path[number], ConditionalPathPoint):
            raise ParameterError(
                f"muscle '{muscle.name}': the path's first and last point cannot be conditional"
            )
    for wrap in _wraps(muscle):
        if not isinstance(wrap, PathWrap):
            raise ParameterError(f"muscle '{muscle.name}': not a surface or PathWrap: {wrap!r}")
        surface = wrap.surface
        _check_number(f"muscle '{muscle.name}': {surface}", surface.link, number_of_links)


def _check_number(what: str, link: int, number_of_links: int) -> None:
    if link >= number_of_links:
        raise ParameterError(
            f"{what} is on link {link}, but the tree has links 0 to {number_of_links - 1}"
        )


def _rule(
    muscle: Muscle,
    number: int,
    point: PathPoint | MovingPathPoint,
    names: tuple[str, ...],
    curves: dict[Curve, int],
) -> list[float]:
    """One point's row of the rules; adds its curves to those that have a number."""
    row = list(NO_RULE)
    if not isinstance(point, (ConditionalPathPoint, MovingPathPoint)):
        return row
    what = f"muscle '{muscle.name}': path point {number}"
    row[COORDINATE] = coordinate_number(what, point.coordinate, names)
    if isinstance(point, ConditionalPathPoint):
        row[LOW], row[HIGH] = point.range[0] - BEYOND_RANGE, point.range[1] + BEYOND_RANGE
    else:
        row[LOW], row[HIGH] = -math.inf, math.inf
        row[CURVES] = [
            curves.setdefault(value, len(curves)) if isinstance(value, Curve) else -1.0
            for value in (point.x, point.y, point.z)
        ]
    return row


def coordinate_number(what: str, coordinate: str | int, names: tuple[str, ...]) -> int:
    """The number of a coordinate given by its name or number."""
    if isinstance(coordinate, str) and coordinate in names:
        return names.index(coordinate)
    if isinstance(coordinate, (int, np.integer)) and 0 <= coordinate < len(names):
        return int(coordinate)
    raise ParameterError(
        f"{what} follows the coordinate {coordinate!r}, but the model has {', '.join(names)}"
    )


def _position(point: PathPoint | MovingPathPoint) -> list[float]:
    if isinstance(point, PathPoint):
        return list(point.position)
    return [0.0 if isinstance(value, Curve) else value for value in (point.x, point.y, point.z)]


def _wraps(muscle: Muscle) -> list[PathWrap]:
    return [PathWrap(wrap) if isinstance(wrap, WrapSurface) else wrap for wrap in muscle.wraps]


def _wrap_rows(muscle: Muscle, points: int) -> list[np.ndarray]:
    """The rows of a muscle's active wraps."""
    try:
        return [wrap.row(points) for wrap in _wraps(muscle) if wrap.surface.active]
    except ParameterError as error:
        raise ParameterError(f"muscle '{muscle.name}': {error}") from None


def _factor_rows(
    muscle: Muscle, names: tuple[str, ...], curves: dict[Curve, int]
) -> list[list[float]]:
    """The rows of a path that is a function; adds its curves to those that have a number."""
    rows = []
    path = muscle.path
    for term, (coefficient, factors) in enumerate(
        path.terms if isinstance(path, FunctionPath) else ()
    ):
        if not factors:
            rows.append([term, coefficient, -1.0, -1.0, -1.0])
        for coordinate, factor in factors.items():
            j = coordinate_number(f"the path of muscle '{muscle.name}'", coordinate, names)
            if isinstance(factor, Curve):
                exponent, number = -1, curves.setdefault(factor, len(curves))
            else:
                exponent, number = int(factor), -1
            rows.append([term, coefficient, j, exponent, number])
    return rows


def _table(rows: Sequence, columns: int) -> np.ndarray:
    return np.array(rows, dtype=float).reshape(-1, columns)


def _starts(items: Sequence[Sequence]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum([len(item) for item in items])]).astype(np.int64)
