"""The record of a run, from its first accepted row to a trajectory."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from time import process_time
from typing import NamedTuple

import numpy as np

from ..forces.actuators import actuator_names
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..muscle.dynamics import fiber_lengths, tendon_forces
from ..path.geometry import Geometry
from .counts import Counts, Status
from .provenance import plain, versions
from .trajectory import Trajectory

# Muscles with less than this share of a coordinate's longest moment arm do not matter to it.
SMALL_ARM = 1e-3


class Window(NamedTuple):
    """What is recorded of a window: u, demanded and unmet torque, F_min, F_opt, F_max."""

    excitation: np.ndarray
    demanded: np.ndarray
    unmet: np.ndarray
    force_min: np.ndarray
    force_optimal: np.ndarray
    force_max: np.ndarray


class Row(NamedTuple):
    """What is recorded of an accepted time: the point there, and the window that leads to it."""

    time: float
    point: tuple[np.ndarray, ...]  # q, q', q'', a, l_t and the delivered torque
    reserve: np.ndarray
    window: Window | None  # None: the one before goes on


class Recorder:
    """Collects a run's accepted rows; the only place where they wait until it ends.

    Attributes
    ----------
    start : tuple of float and two ndarray
        Time at which the first window begins, reserves (r,) and unmet torque (n,) there.
    """

    def __init__(
        self,
        method: str,
        model: MusculoskeletalModel,
        settings: object,
        counts: Counts,
        motion: Motion | None,
    ) -> None:
        self.status = Status.INCOMPLETE
        self.message = ""
        self.begun = process_time()
        self._ended: float | None = None
        self.start = 0.0, np.zeros(len(model.reserves)), np.zeros(len(model.coordinates))
        self._method, self._model, self._settings, self._counts = method, model, settings, counts
        self._motion = motion
        self._rows: list[Row] = []

    @property
    def reached(self) -> float | None:
        """The last recorded time, if there is any."""
        return self._rows[-1].time if self._rows else None

    @property
    def fell_short(self) -> bool:
        """Whether any torque was out of reach."""
        windows = (row.window.unmet for row in self._rows if row.window is not None)
        return any(unmet.any() for unmet in (self.start[2], *windows))

    def add(self, row: Row) -> None:
        """An accepted time, all of it at once, so that an interrupt cannot tear it."""
        self._rows.append(row)

    def fail(self, error: BaseException, where: str) -> None:
        """Note why the run ended; the error carries what was found up to then as `trajectory`."""
        self.message = f"{type(error).__name__} {where}: {error}"
        if self._rows:
            vars(error)["trajectory"] = trajectory = self.trajectory()
            if self.fell_short:
                error.add_note(f"unmet torque before: {trajectory.unmet_torque_report()}")

    def stop(self) -> None:
        """The run is over: its CPU time counts up to here."""
        self._ended = process_time()

    def trajectory(self) -> Trajectory:
        """Everything so far."""
        ended = process_time() if self._ended is None else self._ended
        model = self._model
        n, m = len(model.coordinates), len(model.muscles)
        points = _stacked([row.point for row in self._rows], (n, n, n, m, m, n))
        q, v, a, activation, tendon, delivered = points
        geometry = [model.geometry(*row) for row in zip(q, v, strict=True)]
        force, fiber = _forces_and_fibers(model, geometry, activation, tendon)
        time = np.array([row.time for row in self._rows])
        window_time, reserves, windows = self._windows()
        u, demanded, unmet, low, optimal, high = _stacked(windows, (m, n, n, m, m, m))
        return Trajectory(
            method=self._method,
            coordinate_names=model.coordinates,
            coordinate_units=model.skeleton.units,
            muscle_names=model.muscles.names,
            reserve_names=actuator_names(model.reserves),
            time=time,
            coordinates=q,
            speeds=v,
            accelerations=a,
            activations=activation,
            tendon_forces=force,
            musculotendon_lengths=np.array([row.length for row in geometry]),
            tendon_lengths=tendon,
            fiber_lengths=fiber,
            torques_delivered=delivered,
            desired_coordinates=(
                np.full_like(q, np.nan) if self._motion is None else self._motion(time)[0]
            ),
            window_time=window_time,
            excitation_values=u,
            torques_demanded=demanded,
            torques_unmet=unmet,
            force_min=low,
            force_optimal=optimal,
            force_max=high,
            reserves=reserves,
            start_unmet=self.start[2],
            saturated=_saturated(
                model.muscles.names, time, window_time[1:], geometry, unmet, optimal, high
            ),
            status=self.status,
            message=self.message,
            counts=dataclasses.replace(self._counts),
            cpu_time=ended - self.begun,
            settings=plain(self._settings),
            versions=dict(versions()),
        )

    def _windows(self) -> tuple[np.ndarray, np.ndarray, list[Window]]:
        """Ends of the windows (K + 1,), reserves there, and the windows; each goes on until the
        next one begins."""
        begun, reserve, _ = self.start
        window_time, reserves, windows = [begun], [reserve], []
        for row in self._rows[1:]:
            if row.window is not None:
                windows.append(row.window)
                window_time.append(row.time)
                reserves.append(row.reserve)
            else:
                window_time[-1], reserves[-1] = row.time, row.reserve
        return np.array(window_time), np.array(reserves), windows


def _forces_and_fibers(
    model: MusculoskeletalModel, geometry: list[Geometry], a: np.ndarray, l_t: np.ndarray
) -> np.ndarray:
    """Tendon forces and fibre lengths (2, T, m) of states (T, m)."""
    found = np.empty((2, *l_t.shape))
    for k, (l, l_rate, *_) in enumerate(geometry):
        tendon_forces(model.muscles.tables, a[k], l_t[k], l, l_rate, found[0, k])
        fiber_lengths(model.muscles.tables, l_t[k], l, found[1, k])
    return found


def _saturated(
    names: Sequence[str], time: np.ndarray, ends: np.ndarray, geometry: list[Geometry],
    unmet: np.ndarray, optimal: np.ndarray, high: np.ndarray,
) -> tuple[tuple[str, ...], ...]:  # fmt: skip
    """Muscles at their limit whose arm would help, where each coordinate fell short most."""
    found = []
    for j, short in enumerate(unmet.T):
        helping: tuple[str, ...] = ()
        if short.any():
            k = int(np.abs(short).argmax())
            at = min(int(np.searchsorted(time, ends[k] - 1e-9)), len(geometry) - 1)
            arms = geometry[at].moment_arms[:, j] * np.sign(short[k])
            full = optimal[k] >= high[k] * (1.0 - 1e-9)
            helps = arms > SMALL_ARM * np.abs(arms).max()
            helping = tuple(np.array(names)[full & helps].tolist())
        found.append(helping)
    return tuple(found)


def _stacked(rows: Sequence[tuple[np.ndarray, ...]], widths: tuple[int, ...]) -> list[np.ndarray]:
    """Columns of a list of rows, each (len(rows), width)."""
    if not rows:
        return [np.empty((0, width)) for width in widths]
    return [np.array(column) for column in zip(*rows, strict=True)]
