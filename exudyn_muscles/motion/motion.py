"""The desired motion q_d(t), q_d'(t), q_d''(t) of all coordinates.

Coordinates are Exudyn's, in rad and m, in the order of the tree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BPoly, BSpline, make_interp_spline

from ..errors import MotionError, StorageError
from ..files.storage import Storage, read_storage
from ..numerics.splines import told_apart
from .coordinate import Coordinate
from .low_pass import LowPass, low_passed
from .plausibility import check_unit, warn_of_locked

DEGREE = 5  # quintic: the accelerations are smooth
MOST_SAMPLES = 100_000  # of a filter, as OpenSim has it
LARGEST = 1e9  # of times and coordinates: nothing is known more finely than to 1e-7 there


class Motion:
    """A desired motion of n coordinates over a time span.

    Build one with `from_waypoints`, `from_samples`, `from_file` or `from_arrays`.

    Attributes
    ----------
    start, end : float
        Time span [s].
    source : str or None
        The file that it was read from.
    """

    def __init__(
        self, times: np.ndarray, curve: BSpline | BPoly, source: str | None = None
    ) -> None:
        self._curves = (curve, curve.derivative(), curve.derivative(2))
        self.start, self.end = float(times[0]), float(times[-1])
        self.source = source

    def __len__(self) -> int:
        """Number of coordinates."""
        return self._curves[0](self.start).size

    def __call__(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """q_d, q_d' and q_d'' at the times `t`.

        Parameters
        ----------
        t : float or (k,) array_like
            Times [s].

        Returns
        -------
        tuple of three (n,) or (k, n) ndarray

        Raises
        ------
        MotionError
            A time lies outside the motion's span.
        """
        times = np.asarray(t, dtype=float)
        margin = 1e-9 * max(self.end - self.start, 1.0)  # accumulated time steps
        low, high = times.min(initial=self.start), times.max(initial=self.start)
        if not (low >= self.start - margin and high <= self.end + margin):
            worst = high if low >= self.start - margin else low
            raise MotionError(
                f"the motion spans [{self.start:.10g}, {self.end:.10g}] s, asked for t = "
                f"{worst:.10g} s"
            )
        inside = np.minimum(np.maximum(times, self.start), self.end)
        q, v, a = (curve(inside) for curve in self._curves)
        return q, v, a

    def between(self, start: float, end: float) -> Motion:
        """The same motion over a part of its span [s].

        Raises
        ------
        MotionError
            The part is empty or not within the span.
        """
        if not start < end:
            raise MotionError(f"a motion from {start:g} to {end:g} s is empty")
        self([start, end])
        return Motion(np.array([start, end]), self._curves[0], self.source)

    @classmethod
    def from_waypoints(
        cls,
        times: ArrayLike,
        coordinates: ArrayLike,
        *,
        speeds: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
        accelerations: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
    ) -> Motion:
        """The quintic C4 spline through way points, as in Table 1 of the paper.

        Parameters
        ----------
        times : (k,) array_like
            Increasing [s], k >= 2.
        coordinates : (k, n) or (k,) array_like
            Coordinates at these times [rad or m].
        speeds, accelerations : pair of float or (n,) array_like
            At the start and at the end; at rest if left out.

        Raises
        ------
        MotionError
            Too few points, times not increasing, shapes that do not fit, or values not finite.
        """
        t, q = _checked(times, coordinates, 2)
        ends = []
        for name, pair in (("speeds", speeds), ("accelerations", accelerations)):
            try:
                first, last = (np.zeros(q.shape[1]) + np.asarray(x, dtype=float) for x in pair)
            except (TypeError, ValueError) as error:
                raise MotionError(
                    f"{name}: expected a pair of numbers or of {q.shape[1]} values, got {pair!r}"
                ) from error
            if not (np.isfinite(first).all() and np.isfinite(last).all()):
                raise MotionError(f"{name} must be finite, got {pair!r}")
            ends.append((first, last))
        conditions = tuple([(1, ends[0][k]), (2, ends[1][k])] for k in (0, 1))
        return cls(t, _spline(t, q, conditions))

    @classmethod
    def from_samples(
        cls,
        times: ArrayLike,
        coordinates: ArrayLike,
        *,
        cutoff: float | None = None,
        low_pass: LowPass = LowPass.BUTTERWORTH,
    ) -> Motion:
        """The quintic spline through recorded samples, optionally low-pass filtered.

        Parameters
        ----------
        times : (k,) array_like
            Increasing [s], k >= 6. A filter takes the spline's values at equal times: as many of
            them if steps differ by less than a tenth, else one for each smallest step, as OpenSim.
        coordinates : (k, n) or (k,) array_like
            Samples [rad or m].
        cutoff : float, optional
            Cut-off frequency [Hz] of the filter; not filtered if left out.
        low_pass : LowPass
            The filter. What was before a record's first sample is not known: accelerations are
            uncertain there, for half a period of the cut-off. The default continues the record for
            three periods with a part of its acceleration. OpenSim's continues it by point
            reflection, which makes accelerations zero at the ends, 60 samples far, and so does its
            spline.

        Raises
        ------
        MotionError
            As `from_waypoints`, the cut-off is not between zero and half the sampling rate, or the
            record is shorter than one period of it.
        """
        t, q = _checked(times, coordinates, DEGREE + 1)
        if cutoff is None:
            return cls(t, _spline(t, q))
        span = t[[0, -1]]
        t, q = low_passed(*_equally_spaced(t, q), cutoff, low_pass)
        return cls(span, _spline(t, q))

    @classmethod
    def from_file(
        cls,
        file: str | Path,
        coordinates: Sequence[str],
        units: Sequence[str],
        *,
        cutoff: float | None = None,
        low_pass: LowPass = LowPass.BUTTERWORTH,
        described: Sequence[Coordinate] = (),
        in_degrees: bool | None = None,
    ) -> Motion:
        """The quintic spline through the samples in a storage file (`.sto`, `.mot`).

        Of two rows at almost one time, by less than a thousandth of a step, the last counts.

        Parameters
        ----------
        file : str or Path
            As `read_storage` reads it.
        coordinates : (n,) sequence of str
            Their names; other columns do not matter.
        units : (n,) sequence of str
            rad or m, as a model's `skeleton.units`: degrees are converted.
        cutoff, low_pass
            As `from_samples`.
        described : sequence of opensim.Coordinate
            What the model's file says of its coordinates (`opensim.read_coordinates`): the ranges
            that the motion should keep to, what is locked, and what is prescribed: that takes its
            function's values in place of the file's.
        in_degrees : bool, optional
            What the file's angles are, whatever its header says.

        Raises
        ------
        StorageError
            The file is damaged or lacks a coordinate; tells which columns there are.
        MotionError
            As `from_samples`; names the file. Or angles that by the model's ranges can only be
            degrees, although the file does not say so, nor `in_degrees`.
        FileNotFoundError

        Warns
        -----
        MotionWarning
            Angles that cannot be radians, or a column that moves a locked coordinate.
        """
        storage = read_storage(file)
        if in_degrees is not None:
            storage = replace(storage, in_degrees=in_degrees)
        kept = told_apart(storage.time)
        storage = replace(storage, time=storage.time[kept], values=storage.values[kept])
        try:
            samples = _samples(storage, coordinates, units, described)
            unknown = np.argwhere(~np.isfinite(samples))
            if unknown.size:
                k, j = unknown[0]
                raise MotionError(
                    f"coordinate '{coordinates[j]}' is {samples[k, j]} at t = {storage.time[k]:g} s"
                )
            motion = cls.from_samples(storage.time, samples, cutoff=cutoff, low_pass=low_pass)
        except (StorageError, MotionError) as error:
            raise type(error)(f"{file}: {error}") from error
        if in_degrees is None:
            check_unit(storage, samples, coordinates, units, described, str(file))
        warn_of_locked(storage, described, str(file))
        return cls(np.array([motion.start, motion.end]), motion._curves[0], str(file))

    @classmethod
    def from_arrays(
        cls, times: ArrayLike, coordinates: ArrayLike, speeds: ArrayLike, accelerations: ArrayLike
    ) -> Motion:
        """The piecewise quintic that passes through given coordinates, speeds and accelerations.

        Parameters
        ----------
        times : (k,) array_like
            Increasing [s], k >= 2.
        coordinates, speeds, accelerations : (k, n) or (k,) array_like

        Raises
        ------
        MotionError
            As `from_waypoints`.
        """
        t, q = _checked(times, coordinates, 2)
        _, v = _checked(times, speeds, 2, "speeds")
        _, a = _checked(times, accelerations, 2, "accelerations")
        if not q.shape == v.shape == a.shape:
            raise MotionError(
                f"coordinates {q.shape}, speeds {v.shape} and accelerations {a.shape} must have "
                "the same shape"
            )
        with np.errstate(all="ignore"):
            curve = BPoly.from_derivatives(t, np.stack([q, v, a], axis=1))
        _check_finite(t, curve)
        return cls(t, curve)


def _samples(
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


def _spline(t: np.ndarray, q: np.ndarray, conditions: tuple | None = None) -> BSpline:
    """The quintic spline through points."""
    try:
        with np.errstate(all="ignore"):
            curve = make_interp_spline(t, q, k=DEGREE, bc_type=conditions)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise MotionError(f"there is no quintic spline through these points: {error}") from None
    _check_finite(t, curve)
    return curve


def _check_finite(t: np.ndarray, curve: BSpline | BPoly) -> None:
    with np.errstate(all="ignore"):
        finite = np.isfinite(curve.derivative(2).c).all()
    if not finite:
        raise MotionError(f"times are too close: the smallest step is {np.diff(t).min()} s")


def _equally_spaced(t: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same span with equal steps; those of files are rounded."""
    steps = np.diff(t)
    spread, mean, count = np.ptp(steps), steps.mean(), t.size
    if spread <= 1e-6 * mean:
        return t, q
    if spread > 0.1 * mean:
        count = 1 + round(min((t[-1] - t[0]) / steps.min(), MOST_SAMPLES))
    even = np.linspace(t[0], t[-1], count)
    return even, _spline(t, q)(even)


def _checked(
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
