"""Characteristic curves as piecewise polynomials, the one form in which the compiled kernels see
them: built-in curves, a user's own function and measured points then run at the same speed.

A piece is a polynomial of fifth degree that agrees with its function to 13 digits or better. Beyond
its two ends a curve goes on along straight lines.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError
from .kernel import kernel

# One piece in a row, a cache line: its origin, six coefficients in ascending order, its end.
ORIGIN, COEFFICIENTS, END, COLUMNS = 0, slice(1, 7), 7, 8
RELATIVE_ERROR = 2e-15
ABSOLUTE_ERROR = 5e-16  # where a curve passes zero: curves are of the size of one
ROUNDING = 1e-13  # below this an error that does not shrink is the function's own rounding
DEEPEST = 24  # halvings of one interval, where a kink is cut down to a ten-millionth of it
MOST_PIECES = 20_000
# Bins of a curve: so many for each piece, or so many as wide as the median piece if that is more:
# curves that are followed far out have narrow pieces where they bend, and there the kernels work.
BINS, MOST_BINS = 2, 20_000

# Chebyshev points with both ends, so that neighbouring pieces meet, and places in between.
NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(6) / 5)
PROBES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(5) + 0.5) / 5)
TO_COEFFICIENTS = np.linalg.inv(np.vander(NODES, increasing=True))


class Curve:
    """A curve from its function.

    Parameters
    ----------
    function : callable
        Takes and returns an array.
    breaks : sequence of float
        Start and end of the range in which the curve follows the function, and the places between
        them where the function is not smooth.
    slopes : pair of float or None
        Of the straight lines before and behind the range; None goes on along the tangent.
    name : str
        For the message of the error.

    Attributes
    ----------
    pieces : (k, 8) ndarray, read-only
        Origin, coefficients c0 ... c5 and end of every piece, the straight lines included; the last
        end is NaN.

    Raises
    ------
    ParameterError
        The function is not finite, too rough, or too steep or large for its polynomials to be
        finite; names the curve and the place.
    """

    def __init__(
        self,
        function: Callable[[np.ndarray], np.ndarray],
        breaks: Sequence[float],
        slopes: tuple[float | None, float | None] = (None, None),
        name: str = "curve",
    ) -> None:
        edges = np.array(breaks, dtype=float)
        if not (np.diff(edges) > 0.0).all():
            raise ParameterError(f"{name}: breaks must increase, got {edges.tolist()}")
        starts, coefficients = _pieces(function, edges, name)
        ends = np.append(starts[1:], edges[-1])
        first, last = starts[0], ends[-1]
        with np.errstate(all="ignore"):
            powers = (last - starts[-1]) ** np.arange(6)
            value = coefficients[-1] @ powers
            slope = coefficients[-1, 1:] @ (np.arange(1, 6) * powers[:-1])
            bins_per_unit = BINS * (len(starts) + 2) / (last - first)
        if not np.isfinite([*coefficients.ravel(), value, slope, bins_per_unit]).all():
            raise ParameterError(f"{name} is too steep or too large between {first:g} and {last:g}")
        before = [coefficients[0, 0], coefficients[0, 1] if slopes[0] is None else slopes[0]]
        behind = [value, slope if slopes[1] is None else slopes[1]]
        self.pieces = np.zeros((len(starts) + 2, COLUMNS))
        self.pieces[:, ORIGIN] = [first, *starts, last]
        self.pieces[1:-1, COEFFICIENTS] = coefficients
        self.pieces[0, 1:3], self.pieces[-1, 1:3] = before, behind
        self.pieces[:, END] = [first, *ends, np.nan]  # never reached, not even by infinity
        self.pieces.setflags(write=False)

    @classmethod
    def _of(cls, pieces: np.ndarray) -> Curve:
        curve = cls.__new__(cls)
        curve.pieces = pieces
        curve.pieces.setflags(write=False)
        return curve

    @classmethod
    def line(cls, slope: float, intercept: float) -> Curve:
        """The straight line slope x + intercept, to the last bit.

        Parameters
        ----------
        slope, intercept : float

        Returns
        -------
        Curve
        """
        pieces = np.zeros((3, COLUMNS))
        pieces[:, ORIGIN] = [0.0, 0.0, 1.0]
        pieces[:, 1] = [intercept, intercept, slope + intercept]
        pieces[:, 2] = slope
        pieces[:, END] = [0.0, 1.0, np.nan]
        return cls._of(pieces)

    def stretched(self, about: float, factor: float) -> Curve:
        """The curve of (x - about) / factor + about: wider by a positive factor.

        Parameters
        ----------
        about, factor : float

        Returns
        -------
        Curve
        """
        pieces = self.pieces.copy()
        for column in (ORIGIN, END):
            pieces[:, column] = (self.pieces[:, column] - about) * factor + about
        pieces[:, COEFFICIENTS] /= factor ** np.arange(6)
        return self._of(pieces)

    @property
    def range(self) -> tuple[float, float]:
        """Start and end of the range between the two straight lines."""
        return float(self.pieces[0, END]), float(self.pieces[-1, ORIGIN])

    def __call__(self, x: ArrayLike) -> np.ndarray:
        """Values at `x`."""
        return self._evaluate(x)[0]

    def derivative(self, x: ArrayLike) -> np.ndarray:
        """First derivatives.

        Parameters
        ----------
        x : array_like

        Returns
        -------
        ndarray
            Of the shape of x.
        """
        return self._evaluate(x)[1]

    def _evaluate(self, x: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Values and slopes to the bit as of `evaluate`, whose calls from Python take long."""
        places = np.asarray(x, dtype=float)
        grids, bins, pieces = pack([self])
        scale, shift, count, _ = grids[0]
        with np.errstate(over="ignore", invalid="ignore"):
            place = places * scale + shift
            k = bins[np.where(place > 0.0, np.minimum(place, count), 0.0).astype(int)]
            while (beyond := places >= pieces[k, END]).any():
                k = k + beyond
            while (before := places < pieces[k - 1, END]).any():
                k = k - before
            t = places - pieces[k, ORIGIN]
            c = np.moveaxis(pieces[k, COEFFICIENTS], -1, 0)
            tt = t * t
            value = (c[0] + t * c[1]) + tt * ((c[2] + t * c[3]) + tt * (c[4] + t * c[5]))
            slope = (c[1] + t * (2.0 * c[2])) + tt * (
                (3.0 * c[3] + t * (4.0 * c[4])) + tt * (5.0 * c[5])
            )
        return np.asarray(value), np.asarray(slope)


class PackedCurves(NamedTuple):
    """Curves as the kernels read them.

    A bin holds the number of the piece at its start, so that a piece is found without a search.

    Attributes
    ----------
    grids : (c, 4) ndarray
        Of every curve: bins per unit, minus its start in bins, number of bins, its first bin.
    bins : ndarray of int
        Numbers of pieces; each curve has one more for all that lies behind its range.
    pieces : (k, 8) ndarray
        The pieces of all curves.
    """

    grids: np.ndarray
    bins: np.ndarray
    pieces: np.ndarray


def pack(curves: Sequence[Curve]) -> PackedCurves:
    """The curves one behind the other."""
    grids, bins = [], []
    first_bin = first_piece = 0
    for curve in curves:
        start, end = curve.range
        median = np.median(np.diff(curve.pieces[1:, ORIGIN]))
        count = max(BINS * len(curve.pieces), min(int(BINS * (end - start) / median), MOST_BINS))
        edges = start + (end - start) * np.arange(count + 1) / count
        numbers = np.searchsorted(curve.pieces[:, END], edges, side="right")
        numbers[0] = 0  # also serves all that lies before it
        scale = count / (end - start)
        grids.append([scale, -start * scale, count, first_bin])
        bins.append(first_piece + numbers)
        first_bin += count + 1
        first_piece += len(curve.pieces)
    packed = PackedCurves(
        np.array(grids), np.concatenate(bins), np.concatenate([curve.pieces for curve in curves])
    )
    for array in packed:
        array.setflags(write=False)
    return packed


def _pieces(function: Callable, edges: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Starts and coefficients of the pieces: intervals are halved until they fit."""
    starts, widths = edges[:-1], np.diff(edges)
    parent_error = np.full(starts.shape, np.inf)
    done_starts: list[np.ndarray] = []
    done_coefficients: list[np.ndarray] = []
    for level in range(DEEPEST + 1):
        values = _values(function, starts[:, None] + widths[:, None] * NODES, name)
        # From the differences, which are small in small pieces: rounding shrinks with them.
        coefficients = (values - values[:, :1]) @ TO_COEFFICIENTS.T
        coefficients[:, 0] = values[:, 0]
        probed = _values(function, starts[:, None] + widths[:, None] * PROBES, name)
        error = np.abs(coefficients @ np.vander(PROBES, 6, increasing=True).T - probed).max(axis=1)
        size = np.abs(values).max(axis=1)
        fits = error <= RELATIVE_ERROR * size + ABSOLUTE_ERROR
        # Halving divides the error of a smooth function by 64.
        fits |= (error > 0.1 * parent_error) & (error < ROUNDING * (1.0 + size))
        fits |= level == DEEPEST
        done_starts.append(starts[fits])
        with np.errstate(all="ignore"):
            done_coefficients.append(coefficients[fits] / widths[fits, None] ** np.arange(6))
        starts, widths, parent_error = starts[~fits], 0.5 * widths[~fits], error[~fits]
        if starts.size > MOST_PIECES:
            raise ParameterError(
                f"{name} is too rough for a smooth curve, for example near x = {starts[0]:.6g}"
            )
        starts, widths = np.concatenate([starts, starts + widths]), np.tile(widths, 2)
        parent_error = np.tile(parent_error, 2)
        if not starts.size:
            break
    all_starts = np.concatenate(done_starts)
    order = np.argsort(all_starts)
    return all_starts[order], np.concatenate(done_coefficients)[order]


def _values(function: Callable, x: np.ndarray, name: str) -> np.ndarray:
    values = np.asarray(function(x.ravel()), dtype=float).reshape(x.shape)
    if not np.isfinite(values).all():
        raise ParameterError(
            f"{name} is not finite at x = {x[~np.isfinite(values)][0]:.6g}: "
            f"{values[~np.isfinite(values)][0]}"
        )
    return values


@kernel(inline=True)
def evaluate(curves, curve, x):
    """Value, slope and curvature at `x` of a curve by its number."""
    return polynomial(curves.pieces, piece_at(curves, curve, x), x)


@kernel(inline=True)
def piece_at(curves, curve, x):
    """The piece in which `x` is."""
    grids, bins, pieces = curves
    place = x * grids[curve, 0] + grids[curve, 1]
    count = grids[curve, 2]
    b = int(grids[curve, 3])
    if place >= count:
        b += int(count)
    elif place > 0.0:
        b += int(place)
    k = bins[b]
    while x >= pieces[k, 7]:
        k += 1
    while x < pieces[k - 1, 7]:  # a bin further, by rounding
        k -= 1
    return k


@kernel(inline=True)
def is_in(pieces, k, x):
    """Whether `x` is in the piece `k`; the last piece of the curve before has no end."""
    return not (x >= pieces[k, 7] or x < pieces[k - 1, 7])


@kernel(inline=True)
def polynomial(pieces, k, x):
    """Value, slope and curvature at `x` of the piece `k`."""
    t = x - pieces[k, 0]
    c_1, c_2, c_3 = pieces[k, 2], pieces[k, 3], pieces[k, 4]
    c_4, c_5 = pieces[k, 5], pieces[k, 6]
    # In pairs, which a processor computes side by side.
    tt = t * t
    value = (pieces[k, 1] + t * c_1) + tt * ((c_2 + t * c_3) + tt * (c_4 + t * c_5))
    slope = (c_1 + t * (2.0 * c_2)) + tt * ((3.0 * c_3 + t * (4.0 * c_4)) + tt * (5.0 * c_5))
    curvature = 2.0 * c_2 + t * (6.0 * c_3 + t * (12.0 * c_4 + t * (20.0 * c_5)))
    return value, slope, curvature
