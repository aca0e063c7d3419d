"""Samples of a motion: checked, joined by splines, at equal steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..errors import MotionError
from ..files.storage import Storage
from ..numerics.splines import QUINTIC
from .coordinate import Coordinate

if TYPE_CHECKING:
    from scipy.interpolate import BPoly, BSpline

MOST_SAMPLES = 100_000  # of a filter, as OpenSim has it
LARGEST = 1e9  # of times and coordinates: nothing is known more finely than to 1e-7 there


def samples_of_file(
    storage: Storage,
    names: Sequence[str],
    units: Sequence[str],
    described: Sequence[Coordinate],
) -> np.ndarray:
    """Coordinates (k, n) of a file, or of their own functions."""
    functions = {each.name: each.prescribed for each in described if each.prescribed is not None}
    given = [k for k, name in enumerate(names) if name not in functions]
    samples = np.empty((storage.time.size, len(names)))
    samples[:, given] = storage.coordinates([names[k] for k in given], [units[k] for k in given])
    for k, name in enumerate(names):
        if name in functions:
            samples[:, k] = functions[name](storage.time)
    return samples


def quintic_spline(t: np.ndarray, q: np.ndarray, conditions: tuple | None = None) -> BSpline:
    """The quintic spline through points."""
    from scipy.interpolate import make_interp_spline  # slow to import

    try:
        with np.errstate(all="ignore"):
            curve = make_interp_spline(
                t, q, k=QUINTIC, bc_type=conditions
            )  # accelerations are smooth
    except (ValueError, np.linalg.LinAlgError) as error:
        raise MotionError(f"there is no quintic spline through these points: {error}") from None
    check_finite(t, curve)
    return curve


def check_finite(t: np.ndarray, curve: BSpline | BPoly) -> None:
    with np.errstate(all="ignore"):
        finite = np.isfinite(curve.derivative(2).c).all()
    if not finite:
        raise MotionError(f"times are too close: the smallest step is {np.diff(t).min()} s")


def equally_spaced(t: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same span with equal steps; those of files are rounded."""
    steps = np.diff(t)
    spread, mean, count = np.ptp(steps), steps.mean(), t.size
    if spread <= 1e-6 * mean:
        return t, q
    if spread > 0.1 * mean:
        count = 1 + round(min((t[-1] - t[0]) / steps.min(), MOST_SAMPLES))
    even = np.linspace(t[0], t[-1], count)
    return even, quintic_spline(t, q)(even)


def checked_samples(
    times: ArrayLike, values: ArrayLike, fewest: int, name: str = "coordinates"
) -> tuple[np.ndarray, np.ndarray]:
    """Times (k,) and values (k, n) as finite float arrays."""
    try:
        t, q = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise MotionError(f"times and {name} must be arrays of numbers: {error}") from error
    if q.ndim == 1:
        q = q[:, None]
    if t.ndim != 1 or q.ndim != 2 or q.shape[0] != t.size or q.shape[1] == 0:
        raise MotionError(f"times {t.shape} and {name} {q.shape} do not fit: expected (k,), (k, n)")
    if t.size < fewest:
        raise MotionError(f"a motion needs at least {fewest} points, got {t.size}")
    if not np.isfinite(t).all() or not np.isfinite(q).all():
        row = int(np.argmin(np.isfinite(t) & np.isfinite(q).all(axis=1)))
        raise MotionError(f"times and {name} must be finite; row {row}: t = {t[row]}, {q[row]}")
    for what, array, unit in (("times", t, "s"), (name, q, "in rad, m and s")):
        if (largest := np.abs(array).max()) > LARGEST:
            raise MotionError(f"{what} go up to {largest:g}, allowed is {LARGEST:g} {unit}")
    wrong = np.flatnonzero(np.diff(t) <= 0.0)
    if wrong.size:
        k = int(wrong[0])
        raise MotionError(
            f"times must increase: t[{k}] = {t[k]:g} s is followed by t[{k + 1}] = {t[k + 1]:g} s"
        )
    return t, q
