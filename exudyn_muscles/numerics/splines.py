"""Splines through points, as OpenSim's files have them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import ParameterError
from .curves import COEFFICIENTS, END, ORIGIN, Curve
from .kernel import kernel

Points = tuple[tuple[float, ...], tuple[float, ...]]

QUINTIC = 5
# A point every third of a degree of a full turn; the time goes with their third power.
MOST_POINTS = 1000
# Rows of a record nearer than this part of its usual step are one, which was rounded twice.
SAME_ROW = 1e-3
LEAST_STEP = 1e-7  # what OpenSim takes for the step between points with one x


def simm_spline(x: Sequence[float], y: Sequence[float]) -> Curve:
    """OpenSim's `SimmSpline`: the cubic spline through points, and its tangents beyond them.

    Its third derivative at each end is that of the cubic through the four points there. Where an x
    is repeated, OpenSim's coefficients are those of a step of 1e-7.

    Parameters
    ----------
    x, y : (k,) sequence of float
        Two to 1000 points; x does not decrease.

    Returns
    -------
    Curve

    Raises
    ------
    ParameterError
        These are not such points, or the curve through them is not finite.

    References
    ----------
    Forsythe, Malcolm, Moler: Computer Methods for Mathematical Computations (1977), section 4.4.

    Examples
    --------
    >>> simm_spline([0, 1, 2, 3], [0, 1, 8, 27])(1.5)  # a cubic is its own spline
    array(3.375)
    """
    knots, values = _points(x, y)
    n, h = knots.size, np.maximum(np.diff(knots), LEAST_STEP)
    with np.errstate(all="ignore"):  # Curve refuses what is not finite
        slope, second, third = _derivatives(knots, values, h)

        def spline(places: np.ndarray) -> np.ndarray:
            i = np.clip(np.searchsorted(knots, places, side="right") - 1, 0, n - 2)
            t = places - knots[i]
            return values[i] + t * (slope[i] + t * (0.5 * second[i] + t * third[i] / 6.0))

        return Curve(spline, np.unique(knots).tolist(), name="the spline")


def piecewise_line(x: Sequence[float], y: Sequence[float]) -> Curve:
    """OpenSim's `PiecewiseLinearFunction`: straight from point to point, and on beyond them.

    Parameters and errors as of `simm_spline`.

    Examples
    --------
    >>> piecewise_line([0, 1, 3], [0, 2, 2])(np.array([0.5, 2.0, 4.0])).tolist()
    [1.0, 2.0, 2.0]
    """
    knots, values = _points(x, y)
    n, slopes = knots.size, np.diff(values) / np.maximum(np.diff(knots), LEAST_STEP)

    def line(places: np.ndarray) -> np.ndarray:
        i = np.clip(np.searchsorted(knots, places, side="right") - 1, 0, n - 2)
        return values[i] + (places - knots[i]) * slopes[i]

    return Curve(line, np.unique(knots).tolist(), name="the piecewise linear function")


def checked_points(what: str, given: Sequence[Sequence[float]]) -> Points:
    """The points (x, y) of a `simm_spline`.

    Raises
    ------
    ParameterError
        They are none; names `what` has them.
    """
    try:
        x, y = (tuple(float(number) for number in row) for row in given)
    except (TypeError, ValueError):
        raise ParameterError(f"{what} is a pair (x, y) of points, got {given!r}") from None
    try:
        simm_spline(x, y)
    except ParameterError as error:
        raise ParameterError(f"{what}: {error}") from None
    return x, y


def spline_breaks(
    spline: Curve, ends: tuple[float, float], levels: Sequence[float] = ()
) -> list[float]:
    """Where a spline is not smooth between `ends`, which belong to it, and where it crosses these
    values."""
    found = [*spline.pieces[1:, ORIGIN]]
    for level in levels:
        for piece in spline.pieces[1:-1]:
            coefficients = piece[COEFFICIENTS][::-1].copy()
            coefficients[-1] -= level
            for root in np.roots(np.trim_zeros(coefficients, "f")):
                place = piece[ORIGIN] + root.real
                if root.imag == 0.0 and piece[ORIGIN] < place < piece[END]:
                    found.append(float(place))
    places = np.unique(found)
    return [ends[0], *places[(places > ends[0]) & (places < ends[1])].tolist(), ends[1]]


def told_apart(times: np.ndarray) -> np.ndarray:
    """Which (k,) of increasing times are not followed at once by the same one, but for rounding.

    Examples
    --------
    >>> told_apart(np.array([0.0, 0.1, 0.10000001, 0.2])).tolist()
    [True, False, True, True]
    """
    steps = np.diff(times)
    return np.append(steps > SAME_ROW * np.median(steps), True) if steps.size else times == times


def _points(x: Sequence[float], y: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Points (k,) that a function can go through."""
    knots, values = np.array(x, dtype=float), np.array(y, dtype=float)
    fits = knots.ndim == 1 and knots.shape == values.shape and np.unique(knots).size > 1
    if not (fits and (np.diff(knots) >= 0.0).all()):
        raise ParameterError(f"a spline needs two points or more with increasing x, got {x}, {y}")
    if knots.size > MOST_POINTS:
        raise ParameterError(f"a spline has at most {MOST_POINTS} points, got {knots.size}")
    for end, next_ in ((0, 1), (-1, -2)):  # a step between them would be followed outwards
        if knots[end] == knots[next_] and values[end] != values[next_]:
            raise ParameterError(f"a spline cannot jump at its end, at x = {knots[end]:g}")
    return knots, values


@kernel
def quintic_point(knots, c, c_t, c_tt, at, basis, x):
    """Write x, x', x'' (3, n) of a quintic B-spline of n columns at the place `at`.

    `c` are its coefficients, `c_t` and `c_tt` those of its derivatives, which are B-splines of
    lower degrees on the inner ones of its `knots`; `basis` (6,) is for the work. By de Boor's
    recursion, which finds the B-splines of all three on its way, with the sums of SciPy's.
    """
    k, last = QUINTIC, knots.size - QUINTIC - 2
    while k < last and at >= knots[k + 1]:
        k += 1
    basis[0] = 1.0
    for degree in range(1, QUINTIC + 1):
        lower, basis[0] = basis[0], 0.0
        for n in range(1, degree + 1):
            right, left = knots[k + n], knots[k + n - degree]
            w = 0.0 if right == left else lower / (right - left)
            basis[n - 1] += w * (right - at)
            lower, basis[n] = basis[n], w * (at - left)
        row = QUINTIC - degree
        if row < 3:
            of = c if row == 0 else c_t if row == 1 else c_tt
            for j in range(x.shape[1]):
                x[row, j] = 0.0
                for n in range(degree + 1):
                    x[row, j] += of[k - QUINTIC + n, j] * basis[n]


def _derivatives(
    knots: np.ndarray, values: np.ndarray, h: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slopes where the pieces begin (k - 1,), second derivatives at all points (k,), and the third
    ones of the pieces (k - 1,)."""
    n = knots.size
    slopes = np.diff(values) / h
    # Second derivatives: smooth inside, third derivatives given at the ends.
    A, b = np.eye(n), np.zeros(n)
    for i in range(1, n - 1):
        A[i, i - 1 : i + 2] = h[i - 1], 2.0 * (h[i - 1] + h[i]), h[i]
        b[i] = 6.0 * (slopes[i] - slopes[i - 1])
    if n > 2:
        A[0, :2] = A[-1, -2:] = -1.0, 1.0
    if n > 3:
        second = np.diff(slopes) / np.maximum(knots[2:] - knots[:-2], LEAST_STEP)
        third = 6.0 * np.diff(second) / np.maximum(knots[3:] - knots[:-3], LEAST_STEP)
        b[0], b[-1] = third[0] * h[0], third[-1] * h[-1]
    try:
        bends = np.linalg.solve(A, b)
    except np.linalg.LinAlgError:  # steps so small that they vanish
        bends = np.full(n, np.nan)
    begin = slopes - h * (2.0 * bends[:-1] + bends[1:]) / 6.0
    return begin, bends, np.diff(bends) / h
