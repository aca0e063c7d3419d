"""The paths of all muscles as arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from ..checks import check_link_exists
from ..errors import ParameterError
from ..numerics.curves import Curve, PackedCurves, pack
from ..numerics.products import FACTOR_COLUMNS, FACTOR_COORDINATE, factor_rows
from .functions import FunctionPath
from .points import BEYOND_RANGE, ConditionalPathPoint, MovingPathPoint, PathPoint
from .surfaces import LINK, WRAP_COLUMNS, PathWrap, WrapSurface

# Columns of `Paths.rules`; -1 stands for no coordinate and no curve.
COORDINATE, LOW, HIGH, CURVES, RULE_COLUMNS = 0, 1, 2, slice(3, 6), 6
LinkNumbers = Callable[[str, int], int]
NO_RULE = (-1.0, 0.0, 0.0, -1.0, -1.0, -1.0)


class Paths(NamedTuple):
    """The paths of m muscles, as kernels take them.

    Attributes
    ----------
    positions : (k, 3) ndarray
        All points, muscle by muscle, in their own frames [m].
    links : (k,) int ndarray
        Their links, -1 for ground.
    starts : (m + 1,) int ndarray
        Muscle i owns the points starts[i] to starts[i + 1].
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
            bent=np.zeros(0, dtype=np.int64),
            rules=np.tile(NO_RULE, (len(links), 1)),
            curves=_packed([NO_CURVE]),
            wraps=np.empty((0, WRAP_COLUMNS)),
            wrap_starts=np.zeros(m + 1, dtype=np.int64),
            factors=np.empty((0, FACTOR_COLUMNS)),
            factor_starts=np.zeros(m + 1, dtype=np.int64),
        )  # fmt: skip


# Kernels get at least one curve.
NO_CURVE = Curve.line(0.0, 0.0)


def collect_paths(
    muscles: Sequence[str],
    paths: Sequence[Sequence[PathPoint | MovingPathPoint] | FunctionPath],
    wraps: Sequence[Sequence[PathWrap | WrapSurface]],
    links: int | LinkNumbers,
    coordinates: Sequence[str] | None = None,
    kind: str = "muscle",
) -> Paths:
    """The paths of m muscles, checked against a tree or another system.

    Parameters
    ----------
    muscles : sequence of str
        Names.
    paths, wraps : sequence
        Of each muscle.
    links : int or callable
        How many the tree has, each with one coordinate; or what takes what is on a link, for
        messages, and the link, and returns the number of its frame.
    coordinates : sequence of str, optional
        The coordinates' names.
    kind : str
        What has the paths, for messages.

    Raises
    ------
    ParameterError
        A path has fewer than two points, is not made of path points, or names a link, coordinate
        or range that does not exist; names the muscle.
    """
    if callable(links):
        number, names = links, tuple(coordinates or ())
    else:
        number = partial(check_link_exists, links=links)
        names = tuple(coordinates or (f"q{j}" for j in range(links)))
    whose = [f"{kind} '{name}'" for name in muscles]
    wrapped = [
        [PathWrap(wrap) if isinstance(wrap, WrapSurface) else wrap for wrap in each]
        for each in wraps
    ]
    for each in zip(whose, paths, wrapped, strict=True):
        _check_path(*each)
    listed = [() if isinstance(path, FunctionPath) else tuple(path) for path in paths]
    points = [point for path in listed for point in path]
    on_links = [
        number(f"{who}: path point {k}", point.link)
        for who, path in zip(whose, listed, strict=True)
        for k, point in enumerate(path)
    ]
    curves: dict[Curve, int] = {NO_CURVE: 0}
    rules = [
        _rule(f"{who}: path point {number}", point, names, curves)
        for who, path in zip(whose, listed, strict=True)
        for number, point in enumerate(path)
    ]
    wrap_rows = [
        _wrap_rows(who, each, len(path), number)
        for who, each, path in zip(whose, wrapped, listed, strict=True)
    ]
    factors = [
        _factor_rows(who, path, names, curves) for who, path in zip(whose, paths, strict=True)
    ]
    straight = [
        len(path) > 0 and not rows and all(type(point) is PathPoint for point in path)
        for path, rows in zip(listed, wrap_rows, strict=True)
    ]
    return Paths(
        positions=_table([_position(point) for point in points], 3),
        links=np.array(on_links, dtype=np.int64),
        starts=_starts(listed),
        bent=np.flatnonzero(np.logical_not(straight)),
        rules=_table(rules, RULE_COLUMNS),
        curves=_packed(curves),
        wraps=_table([row for rows in wrap_rows for row in rows], WRAP_COLUMNS),
        wrap_starts=_starts(wrap_rows),
        factors=_table([row for rows in factors for row in rows], FACTOR_COLUMNS),
        factor_starts=_starts(factors),
    )


def _check_path(who: str, path: Sequence | FunctionPath, wraps: Sequence) -> None:
    """Raise ParameterError unless there are points and surfaces."""
    if isinstance(path, FunctionPath):
        if wraps:
            raise ParameterError(f"{who}: a FunctionPath cannot wrap")
        return
    if len(path) < 2:
        raise ParameterError(f"{who}: a path needs at least two points, got {len(path)}")
    for number, point in enumerate(path):
        if not isinstance(point, (PathPoint, MovingPathPoint)):
            raise ParameterError(f"{who}: path point {number} is a PathPoint, got {point!r}")
    for number in (0, -1):
        if isinstance(path[number], ConditionalPathPoint):
            raise ParameterError(f"{who}: the path's first and last point cannot be conditional")
    for wrap in wraps:
        if not isinstance(wrap, PathWrap):
            raise ParameterError(f"{who}: not a surface or PathWrap: {wrap!r}")


def _rule(
    what: str,
    point: PathPoint | MovingPathPoint,
    names: tuple[str, ...],
    curves: dict[Curve, int],
) -> list[float]:
    """One point's row of the rules; adds its curves to those that have a number."""
    row = list(NO_RULE)
    if not isinstance(point, (ConditionalPathPoint, MovingPathPoint)):
        return row
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
    is_number = isinstance(coordinate, (int, np.integer)) and not isinstance(coordinate, bool)
    if is_number and 0 <= int(coordinate) < len(names):
        return int(coordinate)
    raise ParameterError(
        f"{what} follows the coordinate {coordinate!r}, but the model has {', '.join(names)}"
    )


def _position(point: PathPoint | MovingPathPoint) -> list[float]:
    if isinstance(point, PathPoint):
        return list(point.position)
    return [0.0 if isinstance(value, Curve) else value for value in (point.x, point.y, point.z)]


def _wrap_rows(
    who: str, wraps: Sequence[PathWrap], points: int, number: LinkNumbers
) -> list[np.ndarray]:
    """The rows of a muscle's active wraps."""
    rows = []
    for wrap in wraps:
        link = number(f"{who}: {wrap.surface}", wrap.surface.link)
        if not wrap.surface.active:
            continue
        try:
            rows.append(wrap.row(points))
        except ParameterError as error:
            raise ParameterError(f"{who}: {error}") from None
        rows[-1][LINK] = link
    return rows


def _factor_rows(
    who: str,
    path: Sequence | FunctionPath,
    names: tuple[str, ...],
    curves: dict[Curve, int],
) -> list[list[float]]:
    """The rows of a path that is a function; adds its curves to those that have a number."""
    if not isinstance(path, FunctionPath):
        return []
    what = f"the path of {who}"
    return factor_rows(path.terms, lambda each: coordinate_number(what, each, names), curves)


def _packed(curves: Iterable[Curve]) -> PackedCurves:
    # Copies, because numba takes 0.2 us longer over every array that is read-only.
    return PackedCurves(*(array.copy() for array in pack(list(curves))))


def _table(rows: Sequence, columns: int) -> np.ndarray:
    return np.array(rows, dtype=float).reshape(-1, columns)


def _starts(items: Sequence[Sequence]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum([len(item) for item in items])]).astype(np.int64)
