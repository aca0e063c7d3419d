"""The record of a run, from its first accepted row to a trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from ..forces.actuators import actuator_names
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..muscle.dynamics import forces_and_fibers
from ..skeleton.geometry import Geometry
from .counts import Counts, Status
from .provenance import plain, versions
from .quantities import QUANTITIES
from .trajectory import Trajectory

# Muscles with less than this share of a coordinate's longest moment arm do not matter to it.
SMALL_ARM = 1e-3


# The fields of a trajectory that a row's point and its window have, in their order.
POINT = (
    "coordinates", "speeds", "accelerations", "system_coordinates", "system_speeds",
    "constraint_drift", "activations", "tendon_lengths", "torques_delivered",
)  # fmt: skip
WINDOW = (
    "excitation_values", "torques_demanded", "torques_unmet", "force_min", "force_optimal",
    "force_max",
)  # fmt: skip


class Window(NamedTuple):
    """What is recorded of a window, as WINDOW."""

    excitation: np.ndarray
    demanded: np.ndarray
    unmet: np.ndarray
    force_min: np.ndarray
    force_optimal: np.ndarray
    force_max: np.ndarray


class Row(NamedTuple):
    """What is recorded of an accepted time: the point there, and the window that leads to it."""

    time: float
    point: tuple[np.ndarray | float, ...]  # as POINT
    reserve: np.ndarray
    window: Window | None  # None: the one before goes on
    place: tuple  # what the model's geometry takes there


class Recorded(NamedTuple):
    """What was accepted up to some time: the `start` of a `Recorder`, and its rows."""

    start: tuple[float, np.ndarray, np.ndarray]
    rows: tuple[Row, ...]


class Recorder:
    """Collects a run's accepted rows; the only place where they wait until it ends.

    Its CPU time counts from when it is made until `stop`. Only its own methods change it.

    Attributes
    ----------
    status, message
        How the run has ended, as far as is known.
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
        self._begun = process_time()
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
    def excitation(self) -> np.ndarray | None:
        """u (m,) of the window that leads to the last recorded time, if there is any."""
        windows = (row.window for row in reversed(self._rows))
        return next((window.excitation for window in windows if window is not None), None)

    @property
    def reserve(self) -> np.ndarray:
        """Those (r,) at the last recorded time, or at the start."""
        return self._rows[-1].reserve if self._rows else self.start[1]

    @property
    def fell_short(self) -> bool:
        """Whether any torque was out of reach."""
        windows = (row.window.unmet for row in self._rows if row.window is not None)
        return any(unmet.any() for unmet in (self.start[2], *windows))

    @property
    def strayed(self) -> float:
        """The largest tracking error [rad or m]; 0 if nothing is tracked."""
        if self._motion is None or not self._rows:
            return 0.0
        time = np.array([row.time for row in self._rows])
        q = np.array([row.point[0] for row in self._rows])
        return float(np.abs(self._motion(time)[0] - q).max())

    def begin(self, t: float, reserve: np.ndarray, unmet: np.ndarray) -> None:
        """The first window begins at `t`, with these reserves (r,) and unmet torques (n,)."""
        self.start = t, reserve, unmet

    def add(self, row: Row) -> None:
        """An accepted time, all of it at once, so that an interrupt cannot tear it."""
        self._rows.append(row)

    def complete(self) -> None:
        """The run has reached its end."""
        self.status = Status.COMPLETE

    def go_on(self) -> None:
        """The run goes on, from its start or from where it had ended."""
        self.status = Status.INCOMPLETE

    @property
    def recorded(self) -> Recorded:
        """What was accepted so far."""
        return Recorded(self.start, tuple(self._rows))

    def go_back(self, recorded: Recorded) -> None:
        """Have this instead, up to the end of a run."""
        self.start, self._rows[:] = recorded.start, recorded.rows
        self.status, self.message = Status.COMPLETE, ""

    def lose(self, how: str) -> None:
        """The run has left its motion."""
        self.status, self.message = Status.LOST, how

    def note(self, why: str) -> None:
        """The run ended before its end."""
        self.message = why

    def fail(self, error: BaseException, where: str) -> None:
        """Note why the run ended; the error carries what was found up to then as `trajectory`."""
        self.note(f"{type(error).__name__} {where}: {error}")
        if self._rows:
            vars(error)["trajectory"] = trajectory = self.trajectory()
            if self.fell_short:
                error.add_note(f"unmet torque before: {trajectory.unmet_torque_report()}")
            if off := trajectory.tracking_report():
                error.add_note(f"tracking before: {off}")

    def stop(self) -> None:
        """The run is over: its CPU time counts up to here."""
        self._ended = process_time()

    def trajectory(self) -> Trajectory:
        """Everything so far."""
        ended = process_time() if self._ended is None else self._ended
        model = self._model
        names: dict[str, Any] = {
            "coordinate_names": model.coordinates,
            "coordinate_units": model.skeleton.units,
            "system_names": model.skeleton.system_names,
            "muscle_names": model.muscles.names,
            "reserve_names": actuator_names(model.reserves),
        }
        window_time, reserves, rows = self._windows()
        points = _stacked(POINT, [row.point for row in self._rows], names)
        windows = _stacked(WINDOW, rows, names)
        time, q = np.array([row.time for row in self._rows]), points["coordinates"]
        geometry = [model.geometry(*row.place) for row in self._rows]
        a, l_t = points["activations"], points["tendon_lengths"]
        length, speed = (np.array([g[k] for g in geometry]).reshape(l_t.shape) for k in range(2))
        force, fiber = np.empty((2, *l_t.shape))
        forces_and_fibers(model.muscles.tables, a, l_t, length, speed, force, fiber)
        desired = np.full_like(q, np.nan) if self._motion is None else self._motion(time)[0]
        ideal = [
            g.columns @ row.reserve if row.reserve.size else np.zeros(q.shape[1])
            for g, row in zip(geometry, self._rows, strict=True)
        ]
        return Trajectory(
            **names,
            **points,
            **windows,
            time=time,
            window_time=window_time,
            tendon_forces=force,
            musculotendon_lengths=length,
            fiber_lengths=fiber,
            torques_ideal=np.array(ideal).reshape(q.shape),
            desired_coordinates=desired,
            reserves=reserves,
            start_unmet=self.start[2],
            saturated=_saturated(
                model.muscles.names, time, window_time[1:], geometry, windows["torques_unmet"],
                windows["force_optimal"], windows["force_max"],
            ),
            method=self._method,
            status=self.status,
            message=self.message,
            counts=self._counts.copy(),
            cpu_time=ended - self._begun,
            settings=plain(self._settings),
            versions=dict(versions()),
        )  # fmt: skip

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


def _stacked(
    fields: Sequence[str], rows: Sequence[tuple[np.ndarray | float, ...]], names: dict[str, Any]
) -> dict[str, Any]:
    """The fields whose rows these are."""
    if rows:
        return dict(zip(fields, map(np.array, zip(*rows, strict=True)), strict=True))
    declared = [one for one in QUANTITIES if one.field in fields]
    return {one.field: np.empty((0, len(one.columns(names)))) for one in declared}
