"""Excitations over time, from a result or a file, to be replayed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError, StorageError
from ..files.storage import read_storage
from ..forces.actuators import Actuator, actuator_names

# How long after the row that ends a window in a file another one begins the next [s]: nothing for a
# muscle, and another number than the end at any time of a day.
EDGE = 1e-8


class SystemStart(NamedTuple):
    """Where a whole system of bodies and joints began, what is passive with it: the `names` of its
    N coordinates, x and x' (N,)."""

    names: tuple[str, ...]
    coordinates: np.ndarray
    speeds: np.ndarray

    @property
    def known(self) -> bool:
        """Whether there is such a system, and the result tells where it began."""
        return bool(self.names) and bool(np.isfinite([self.coordinates, self.speeds]).all())


@dataclass(frozen=True, eq=False)
class Excitations:
    """Piecewise constant excitations of m muscles and their windows.

    Attributes
    ----------
    time : (k + 1,) ndarray
        Ends of the k windows [s].
    values : (k, m) ndarray
        u in every window.
    reserves : (k + 1, r) ndarray
        Reserve torques at the windows' ends, linear in between [N m].
    initial : tuple of ndarray or None
        q (n,), q' (n,), a (m,) and l_t (m,) at the start, if known.
    system : SystemStart or None
        Of a system of bodies and joints, if known.

    Raises
    ------
    ParameterError
        Shapes that do not fit, times that do not increase, or values not finite.
    """

    time: np.ndarray
    values: np.ndarray
    reserves: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    initial: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None = None
    system: SystemStart | None = None

    def __post_init__(self) -> None:
        t, u = np.asarray(self.time, dtype=float), np.asarray(self.values, dtype=float)
        r = np.asarray(self.reserves, dtype=float)
        if r.size == 0:
            r = np.empty((t.size, 0))
        if t.ndim == 1 and u.ndim == 2 and t.size == len(u) > 0:
            raise ParameterError(
                f"excitations: {t.size} times for as many rows of values; a row is held from one "
                "time to the next, so append the end of the last row to the times, or leave that "
                "row out"
            )
        if t.ndim != 1 or u.ndim != 2 or t.size != u.shape[0] + 1 or len(u) == 0:
            raise ParameterError(
                f"excitations: time {t.shape} and values {u.shape} do not fit: expected (k + 1,) "
                "and (k, m)"
            )
        if r.ndim != 2 or r.shape[0] != t.size:
            raise ParameterError(f"excitations: reserves {r.shape} do not fit time {t.shape}")
        for k, i in np.argwhere(~np.isfinite(u)):
            raise ParameterError(
                f"excitations: {u[k, i]} at t = {t[k]:g} s, in column {i} of the values, "
                "must be finite"
            )
        if not (np.isfinite(t).all() and np.isfinite(r).all()):
            raise ParameterError("excitations: time and reserves must be finite")
        if (np.diff(t) <= 0.0).any():
            raise ParameterError("excitations: time must increase")
        for name, value in (("time", t), ("values", u), ("reserves", r)):
            object.__setattr__(self, name, value)

    @classmethod
    def from_mapping(
        cls, time: ArrayLike, values: Mapping[str, ArrayLike], muscles: Sequence[str]
    ) -> Excitations:
        """Excitations that are given muscle by muscle.

        Parameters
        ----------
        time : (k + 1,) array_like
            Ends of the k windows [s].
        values : mapping of str to float or (k,) array_like
            u of every muscle, constant or in every window.
        muscles : sequence of str
            Names of the model's m muscles, in its order.

        Returns
        -------
        Excitations

        Raises
        ------
        ParameterError
            A muscle is missing or unknown, or its values do not fit the time; names it.
        """
        t = np.asarray(time, dtype=float)
        if set(values) != set(muscles):
            raise ParameterError(
                f"excitations: the names are {', '.join(map(str, values))}, expected "
                f"{', '.join(muscles)}"
            )
        expected = (max(t.size - 1, 0),)
        columns = []
        for name in muscles:
            try:
                column = np.asarray(values[name], dtype=float)
            except (TypeError, ValueError):
                column = np.array([[np.nan]])
            if column.shape not in ((), expected):
                raise ParameterError(
                    f"excitations: '{name}' has the shape {column.shape}, expected a number or "
                    f"{expected}, one value for each window between {t.size} times"
                )
            columns.append(np.broadcast_to(column, expected))
        return cls(t, np.column_stack(columns))

    @classmethod
    def from_file(
        cls, file: str | Path, muscles: Sequence[str], reserves: Sequence[Actuator] = ()
    ) -> Excitations:
        """Excitations from a file of controls as OpenSim's CMC writes it, and this package too.

        A row holds the controls of the window that ends there; those of the first do not matter,
        nor those of a row that only begins a window, next to the row that ends the one before.

        Parameters
        ----------
        file : str or Path
            As `read_storage` reads it.
        muscles : sequence of str
            Names of the m muscles; other columns do not matter.
        reserves : sequence of Reserve, PointActuator, TorqueActuator or PathActuator
            Those of the model, whose optimal forces the controls are multiplied with; their columns
            have their names.

        Returns
        -------
        Excitations

        Raises
        ------
        StorageError
            The file is damaged, lacks a column, or has only one row.
        ParameterError
            An excitation is not finite.
        FileNotFoundError
        """
        storage = read_storage(file)
        names = actuator_names(reserves)
        try:
            ends = np.diff(storage.time, prepend=-np.inf) > 2.0 * EDGE
            t, u, torques = (
                x[ends] for x in (storage.time, storage.controls(muscles), storage.controls(names))
            )
            if len(t) < 2:
                raise StorageError("controls need at least two rows, the ends of a window")
            return cls(t, u[1:], torques * [reserve.optimal_force for reserve in reserves])
        except (StorageError, ParameterError) as error:
            raise type(error)(f"{file}: {error}") from error

    def window(self, t: float) -> int:
        """Number of the window that contains a time; the last or first one outside.

        Parameters
        ----------
        t : float
            [s]

        Returns
        -------
        int
        """
        return min(max(int(self.time.searchsorted(t, "right")) - 1, 0), len(self.values) - 1)
