"""Trajectory: what a method found, with names, status and counts; save, load, compare."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .comparison import Difference, first_difference
from .counts import Counts, Status
from .excitations import Excitations, SystemStart
from .quantities import DIMENSIONS, NAMES_OF, QUANTITIES, When, listing
from .storing import read_fields, write_fields
from .tracking import LOST, promised_errors, tracking_report

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    __doc__ = f"""The result of a method.

    It has T points of time, K windows, n coordinates, m muscles and r reserves; of a skeleton that
    is no tree also the N coordinates of the whole system, passive ones among them.

    Attributes
    ----------
{listing()}
    saturated : tuple of n tuples of str
        For every coordinate that fell short, the muscles that could do no more for it where it did
        most.
    coordinate_names, muscle_names, reserve_names : tuple of str
        In the order of the columns.
    coordinate_units : tuple of str
        rad or m.
    system_names : tuple of N str
        Of the coordinates of the whole system, by their nodes; empty for a tree.
    status, message
        How the run ended.
    counts : Counts
    cpu_time : float
        CPU seconds of the run.
    method, settings, versions
        What produced it.
    """

    method: str
    coordinate_names: tuple[str, ...]
    coordinate_units: tuple[str, ...]
    system_names: tuple[str, ...]
    muscle_names: tuple[str, ...]
    reserve_names: tuple[str, ...]
    time: np.ndarray
    coordinates: np.ndarray
    speeds: np.ndarray
    accelerations: np.ndarray
    system_coordinates: np.ndarray
    system_speeds: np.ndarray
    constraint_drift: np.ndarray
    activations: np.ndarray
    tendon_forces: np.ndarray
    musculotendon_lengths: np.ndarray
    tendon_lengths: np.ndarray
    fiber_lengths: np.ndarray
    torques_delivered: np.ndarray
    torques_ideal: np.ndarray
    desired_coordinates: np.ndarray
    window_time: np.ndarray
    excitation_values: np.ndarray
    torques_demanded: np.ndarray
    torques_unmet: np.ndarray
    force_min: np.ndarray
    force_optimal: np.ndarray
    force_max: np.ndarray
    reserves: np.ndarray
    start_unmet: np.ndarray
    saturated: tuple[tuple[str, ...], ...]
    status: Status
    message: str
    counts: Counts
    cpu_time: float
    settings: Mapping[str, Any]
    versions: Mapping[str, str]

    def __repr__(self) -> str:
        return (
            f"<Trajectory {self.method}, {self.status.name.lower()}: {len(self.time)} points and "
            f"{self.windows} windows from {self.time[0]:g} to {self.time[-1]:g} s, coordinates "
            f"{', '.join(self.coordinate_names)}, muscles {', '.join(self.muscle_names)}>"
        )

    @property
    def excitations(self) -> Excitations:
        """The excitations, with the start that belongs to them: `forward_dynamics` replays them."""
        q, v, a, l_t = self.coordinates, self.speeds, self.activations, self.tendon_lengths
        initial = (q[0], v[0], a[0], l_t[0])
        whole = SystemStart(self.system_names, self.system_coordinates[0], self.system_speeds[0])
        return Excitations(
            self.window_time,
            self.excitation_values,
            self.reserves,
            initial,
            whole if whole.known else None,
        )

    def tracking_errors(self) -> np.ndarray:
        """q_d - q.

        Returns
        -------
        (T, n) ndarray
            [rad or m]
        """
        return self.desired_coordinates - self.coordinates

    def tracking_error_rms(self) -> np.ndarray:
        """Root mean square of the tracking errors over all time points.

        Returns
        -------
        (n,) ndarray
            [rad or m]
        """
        return np.sqrt(np.mean(self.tracking_errors() ** 2, axis=0))

    @property
    def windows(self) -> int:
        """Number of windows K."""
        return len(self.excitation_values)

    @property
    def max_unmet_torque(self) -> float:
        """Largest torque out of reach [N m], of all coordinates and windows."""
        return float(
            max(np.abs(self.torques_unmet).max(initial=0.0), np.abs(self.start_unmet).max())
        )

    @property
    def max_constraint_drift(self) -> float:
        """Largest violation of the system's constraints [rad, m or 1]; zero without."""
        return float(np.fmax.reduce(self.constraint_drift, initial=0.0))

    def unmet_torque_report(self) -> str:
        """One line a coordinate that fell short: how often, how far, when; empty if none did.

        Returns
        -------
        str
        """
        lines = []
        for j, name in enumerate(self.coordinate_names):
            short = np.abs(self.torques_unmet[:, j])
            if self.start_unmet[j]:
                lines.append(f"{name}: {self.start_unmet[j]:.4g} short at the start")
            if short.any():
                k, names = int(short.argmax()), self.saturated[j]
                lines.append(
                    f"{name}: demand out of reach in {np.count_nonzero(short)} of {len(short)} "
                    f"windows, by up to {short[k]:.4g} at t = {self.window_time[k + 1]:.4g} s"
                    + (f", where {', '.join(names)} pulled at most" if names else "")
                )
        return "; ".join(lines)

    def tracking_report(self) -> str:
        """One line a coordinate whose errors are beyond what the control law promises: since when,
        and how large; empty if none is, or nothing was tracked.

        Returns
        -------
        str
        """
        return tracking_report(vars(self), self._tracking_excess())

    @property
    def has_lost_its_motion(self) -> bool:
        """Whether errors are beyond what the law promises by 0.2 rad or m anywhere."""
        return bool((self._tracking_excess() > LOST).any())

    def _tracking_excess(self) -> np.ndarray:
        """By how much errors (T, n) are larger than the control law promises."""
        errors = self.tracking_errors()
        if "kp" not in self.settings or self.time.size < 2:
            return np.zeros_like(errors)
        desired, time = self.desired_coordinates[:3], self.time[:3]
        v_d = np.gradient(desired, time, axis=0, edge_order=2 if time.size == 3 else 1)[0]
        e_t = v_d - self.speeds[0]
        return np.abs(errors) - np.abs(promised_errors(self.time, errors[0], e_t, self.settings))

    def reserve_report(self) -> str:
        """One line a coordinate on which reserves or residuals act: their share of the demand, by
        root mean squares, and their peak; empty if there are none.

        Returns
        -------
        str
        """
        lines = []
        demand = np.sqrt(np.mean(self.torques_demanded**2, axis=0))
        for j, name in enumerate(self.coordinate_names):
            torque = np.abs(self.torques_ideal[:, j])
            if np.nan_to_num(torque).any():  # NaN: of a file that did not store it yet
                unit = "N m" if self.coordinate_units[j] == "rad" else "N"
                peak = f"up to {torque.max():.3g} {unit}"
                share = np.sqrt(np.mean(torque**2)) / demand[j] if demand[j] else np.nan
                asked = np.isfinite(share)  # a replay demands nothing
                lines.append(f"{name}: " + (f"{share:.1%} of the demand, " if asked else "") + peak)
        return "; ".join(lines)

    def compare(
        self, reference: Trajectory, tolerances: Mapping[str, float] | None = None
    ) -> Difference | None:
        """The first difference from a reference that is larger than its tolerance.

        Method, names, units, status and the kinds of settings come first, then times, motion,
        muscles and windows. How much work it was does not matter.

        Parameters
        ----------
        reference : Trajectory
        tolerances : mapping, optional
            Quantity -> largest allowed absolute difference, in place of the defaults, which
            `docs/results.md` lists: those of forces and torques are relative to the largest ones
            of the reference.

        Returns
        -------
        Difference or None
            None if the two agree.

        Raises
        ------
        ParameterError
            A tolerance is given for a quantity that does not exist.
        """
        return first_difference(vars(self), vars(reference), tolerances or {})

    def to_dataframe(self) -> pandas.DataFrame:
        """Time points as rows, `quantity/name` as columns; windows are those that end there.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        ImportError
            pandas is not installed.
        """
        import pandas

        window = np.searchsorted(self.window_time, self.time - 1e-12) - 1
        window = np.clip(window, 0, self.windows - 1)
        rows = {When.POINTS: slice(None), When.WINDOWS: window, When.ENDS: window + 1}
        columns: dict[str, np.ndarray] = {}
        for quantity in QUANTITIES:
            if quantity.when is When.START or not (self.windows or quantity.when is When.POINTS):
                continue
            array = getattr(self, quantity.field)[rows[quantity.when]]
            if array.ndim == 1 and quantity.when is When.POINTS:
                columns[quantity.name] = array
            for k, name in enumerate(quantity.columns(vars(self))):
                columns[f"{quantity.name}/{name}"] = array[:, k]
        return pandas.DataFrame(columns)

    def to_xarray(self) -> xarray.Dataset:
        """All quantities over named dimensions, `units` in the attributes of each.

        Dimensions are `time` for points, `window` (where it ends) and `window_end` (the start as
        well), and `coordinate`, `muscle`, `reserve`, `system_coordinate`, with their names; angles
        and translations have their units in the coordinate `coordinate_unit`. Method, status and
        versions are in the attributes of the whole.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        ImportError
            xarray is not installed.
        """
        import xarray

        fields = vars(self)
        times = {
            When.POINTS: ("time", self.time),
            When.WINDOWS: ("window", self.window_time[1:]),
            When.ENDS: ("window_end", self.window_time),
        }
        coords: dict[str, Any] = {name: t for name, t in times.values() if t.size}
        coords |= {
            DIMENSIONS[o]: list(fields[name]) for o, name in NAMES_OF.items() if fields[name]
        }
        coords["coordinate_unit"] = "coordinate", list(self.coordinate_units)
        arrays: dict[str, Any] = {}
        for quantity in QUANTITIES:
            if quantity.name in ("time", "window_time"):
                continue
            rows = () if quantity.when is When.START else (times[quantity.when][0],)
            columns = () if quantity.owner is None else (DIMENSIONS[quantity.owner],)
            dimensions = (*rows, *columns)
            if all(dimension in coords for dimension in dimensions):
                attributes = {"units": quantity.unit, "long_name": quantity.description}
                arrays[quantity.name] = dimensions, getattr(self, quantity.field), attributes
        whole = {"method": self.method, "status": self.status.name, **self.versions}
        return xarray.Dataset(arrays, coords, whole)

    def save(self, file: str | Path) -> None:
        """Write everything to an `.npz` file, whole or not at all.

        Parameters
        ----------
        file : str or Path

        Raises
        ------
        OSError
            It cannot be written; names it. An earlier file of this name is as it was.
        """
        write_fields(file, vars(self))

    @classmethod
    def load(cls, file: str | Path) -> Trajectory:
        """Read a file that `save` wrote, of this or an earlier version of the package.

        What the earlier version did not store is NaN: `tendon_lengths` of format version 1.

        Parameters
        ----------
        file : str or Path

        Returns
        -------
        Trajectory

        Raises
        ------
        ResultFileError
            The file is damaged, is not a trajectory, or is of another version; names it.
        FileNotFoundError
        """
        return cls(**read_fields(file))
