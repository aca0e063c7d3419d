"""Recorded forces over time, such as a force plate's, as data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..checks import link_number
from ..errors import ParameterError, StorageError
from ..files.storage import read_storage
from ..path.frames import GROUND

LARGEST = 1e12  # of times, forces, points and torques: no skeleton bears a millionth of it
FEWEST_FOR_SPLINE = 4  # samples; OpenSim joins fewer by straight lines


@dataclass(frozen=True, eq=False)
class ExternalForce:
    """A recorded force, torque or both on a link.

    Between the samples runs the natural cubic spline, as in OpenSim, and straight lines if there
    are fewer than four. Outside of the record there is no force; the methods of this package refuse
    to run there.

    Parameters
    ----------
    name : str
    link : int, ObjectIndex or MarkerIndex
        That it acts on: of a kinematic tree by its number, else a body or marker.
    times : (k,) array_like
        Increasing [s], k >= 2.
    force : (k, 3) array_like, optional
        [N].
    point : (k, 3) array_like, optional
        Where the force acts [m]; the origin of the link's frame if left out. One given in ground
        stays there whatever the link does.
    torque : (k, 3) array_like, optional
        In addition to the force's own [N m].
    force_expressed_in, point_expressed_in : int
        The link in whose frame force and torque, or the point, are given; -1 is ground.

    Raises
    ------
    ParameterError
        Neither force nor torque, a point without a force, shapes that do not fit, times that do not
        increase, values not finite, or no such link; names the force.
    """

    name: str
    link: int
    times: np.ndarray
    force: np.ndarray | None = None
    point: np.ndarray | None = None
    torque: np.ndarray | None = None
    force_expressed_in: int = GROUND
    point_expressed_in: int = GROUND

    def __post_init__(self) -> None:
        times = self._array("times", self.times)
        if times.ndim != 1 or times.size < 2:
            raise self._error(f"times must be (k,) with k >= 2, got {times.shape}")
        wrong = np.flatnonzero(~(np.diff(times) > 0.0))
        if wrong.size:
            t, after = times[wrong[0] : wrong[0] + 2]
            raise self._error(f"times must increase, {t:g} s is followed by {after:g} s")
        object.__setattr__(self, "times", times)
        for name in ("force", "point", "torque"):
            if getattr(self, name) is None:
                continue
            values = self._array(name, getattr(self, name))
            if values.shape != (times.size, 3):
                raise self._error(f"{name} must be ({times.size}, 3), got {values.shape}")
            object.__setattr__(self, name, values)
        try:
            with np.errstate(all="ignore"):
                finite = np.isfinite(cubics(self)).all()
        except ValueError:  # not even the spline's equations are
            finite = False
        if not finite:
            raise self._error(f"times are too close: the smallest step is {np.diff(times).min()} s")
        if self.force is None and (self.torque is None or self.point is not None):
            needed = "a force or a torque" if self.point is None else "a force at its point"
            raise self._error(f"needs {needed}")
        for name, lowest in (
            ("link", 0),
            ("force_expressed_in", GROUND),
            ("point_expressed_in", GROUND),
        ):
            what, value = f"external force '{self.name}': {name}", getattr(self, name)
            object.__setattr__(self, name, link_number(what, value, lowest))

    def _array(self, name: str, values: ArrayLike) -> np.ndarray:
        """Finite numbers, not to be written."""
        try:
            array = np.array(values, dtype=float)
        except (TypeError, ValueError) as error:
            raise self._error(f"{name} must be an array of numbers: {error}") from error
        unknown = np.argwhere(~np.isfinite(array))
        if unknown.size:
            row = unknown[0][0]
            raise self._error(f"{name} must be finite, row {row} is {array[row]}")
        if (largest := np.abs(array).max(initial=0.0)) > LARGEST:
            raise self._error(f"{name} goes up to {largest:g}, allowed is {LARGEST:g} in SI units")
        array.setflags(write=False)
        return array

    def _error(self, text: str) -> ParameterError:
        return ParameterError(f"external force '{self.name}': {text}")

    @classmethod
    def from_file(
        cls,
        name: str,
        link: int,
        file: str | Path,
        *,
        force: str | None = None,
        point: str | None = None,
        torque: str | None = None,
    ) -> ExternalForce:
        """A record in ground from a storage file (`.sto`, `.mot`).

        Parameters
        ----------
        name, link
            As of the class.
        file : str or Path
            As `read_storage` reads it.
        force, point, torque : str, optional
            What the labels of their three columns begin with, such as `ground_force_v`,
            `ground_force_p` and `ground_torque_`.

        Returns
        -------
        ExternalForce

        Raises
        ------
        StorageError
            The file is damaged or lacks such columns; tells which there are.
        ParameterError
            As the class; names the file.
        FileNotFoundError
        """
        storage = read_storage(file)
        try:
            f, p, tau = (
                None if identifier is None else storage.vector(identifier)
                for identifier in (force, point, torque)
            )
            return cls(name, link, storage.time, f, p, tau)
        except (StorageError, ParameterError) as error:
            raise type(error)(f"{file}: {error}") from error


def cubics(record: ExternalForce) -> np.ndarray:
    """Cubics (k - 1, 4, 9) in the time since each sample, highest power first."""
    columns = np.zeros((record.times.size, 9))
    for k, values in enumerate((record.force, record.point, record.torque)):
        if values is not None:
            columns[:, 3 * k : 3 * k + 3] = values
    if record.times.size >= FEWEST_FOR_SPLINE:
        from scipy.interpolate import CubicSpline  # slow to import

        c = CubicSpline(record.times, columns, bc_type="natural").c
    else:
        slopes = np.diff(columns, axis=0) / np.diff(record.times)[:, None]
        c = np.stack([0.0 * slopes, 0.0 * slopes, slopes, columns[:-1]])
    return np.ascontiguousarray(c.transpose(1, 0, 2))
