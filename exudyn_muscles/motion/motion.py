"""The desired motion q_d(t), q_d'(t), q_d''(t) of all coordinates.

Coordinates are Exudyn's, in rad and m, in the order of the tree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..errors import MotionError, StorageError
from ..files.storage import read_storage
from ..numerics.splines import QUINTIC, quintic_point, told_apart
from .coordinate import Coordinate
from .low_pass import LowPass, low_passed
from .plausibility import check_unit, warn_of_locked
from .samples import check_finite, checked_samples, equally_spaced, quintic_spline, samples_of_file

if TYPE_CHECKING:
    from scipy.interpolate import BPoly, BSpline


class Motion:
    """A desired motion of n coordinates over a time span.

    Build one with `from_waypoints`, `from_samples`, `from_file` or `from_arrays`. A target that is
    moved while a run goes on derives from it, with `start`, `end`, `source`, `__len__` and
    `__call__` of its own; what it says of times that are over has to stay.

    Parameters
    ----------
    times : (k,) ndarray
        Of which the first and the last are the span [s].
    curve : BSpline or BPoly
        Of n coordinates over time, differentiable twice.

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
        from scipy.interpolate import BSpline  # slow to import

        self._curves = (curve, curve.derivative(), curve.derivative(2))
        self._tables = None
        if isinstance(curve, BSpline) and curve.k == QUINTIC:
            # For single times, of which SciPy makes arrays for 10 us.
            self._tables = (curve.t, *(np.ascontiguousarray(one.c) for one in self._curves))
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
        if times.ndim:
            low, high = times.min(initial=self.start), times.max(initial=self.start)
        else:
            low = high = times.item()
        margin = 1e-9 * max(self.end - self.start, 1.0)  # accumulated time steps
        if not (low >= self.start - margin and high <= self.end + margin):
            worst = high if low >= self.start - margin else low
            raise MotionError(
                f"the motion spans [{self.start:.10g}, {self.end:.10g}] s, asked for t = "
                f"{worst:.10g} s"
            )
        if not times.ndim and self._tables is not None:
            x, basis = np.empty((3, self._tables[1].shape[1])), np.empty(QUINTIC + 1)
            quintic_point(*self._tables, min(max(low, self.start), self.end), basis, x)
            return x[0], x[1], x[2]
        inside = np.minimum(np.maximum(times, self.start), self.end)
        q, v, a = (curve(inside) for curve in self._curves)
        return q, v, a

    def between(self, start: float, end: float) -> Motion:
        """The same motion over a part of its span.

        Parameters
        ----------
        start, end : float
            [s]

        Returns
        -------
        Motion

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

        Returns
        -------
        Motion

        Raises
        ------
        MotionError
            Too few points, times not increasing, shapes that do not fit, or values not finite.
        """
        t, q = checked_samples(times, coordinates, 2)
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
        return cls(t, quintic_spline(t, q, conditions))

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

        Returns
        -------
        Motion

        Raises
        ------
        MotionError
            As `from_waypoints`, the cut-off is not between zero and half the sampling rate, or the
            record is shorter than one period of it.
        """
        t, q = checked_samples(times, coordinates, QUINTIC + 1)
        if cutoff is None:
            return cls(t, quintic_spline(t, q))
        span = t[[0, -1]]
        t, q = low_passed(*equally_spaced(t, q), cutoff, low_pass)
        return cls(span, quintic_spline(t, q))

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

        Returns
        -------
        Motion

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
            samples = samples_of_file(storage, coordinates, units, described)
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

        Returns
        -------
        Motion

        Raises
        ------
        MotionError
            As `from_waypoints`.
        """
        from scipy.interpolate import BPoly  # slow to import

        t, q = checked_samples(times, coordinates, 2)
        _, v = checked_samples(times, speeds, 2, "speeds")
        _, a = checked_samples(times, accelerations, 2, "accelerations")
        if not q.shape == v.shape == a.shape:
            raise MotionError(
                f"coordinates {q.shape}, speeds {v.shape} and accelerations {a.shape} must have "
                "the same shape"
            )
        with np.errstate(all="ignore"):
            curve = BPoly.from_derivatives(t, np.stack([q, v, a], axis=1))
        check_finite(t, curve)
        return cls(t, curve)
