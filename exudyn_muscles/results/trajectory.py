"""Trajectory: what a method found, with names, status and counts; save, load, compare."""

from __future__ import annotations

import dataclasses
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from importlib.metadata import version
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ParameterError, ResultFileError, StorageError
from ..files.storage import read_storage
from ..forces.actuators import actuator_names
from ..muscle.dynamics import fiber_lengths, tendon_forces
from .storing import other_kinds, read_fields, write_fields

if TYPE_CHECKING:
    import pandas

    from ..forces.actuators import Actuator
    from ..model import MusculoskeletalModel
    from ..motion import Motion
    from ..skeleton.geometry import Geometry

# Muscles with less than this share of a coordinate's longest moment arm do not matter to it.
SMALL_ARM = 1e-3

PACKAGES = ("exudyn_muscles", "exudyn", "numpy", "scipy", "numba", "qpsolvers", "daqp", "osqp")


class Status(Enum):
    """How a run ended."""

    COMPLETE = "complete"
    INCOMPLETE = "incomplete: the trajectory ends where the run stopped, see its message"


@dataclass
class Counts:
    """Work done.

    Attributes
    ----------
    steps : int
        Accepted steps of the skeleton.
    rejected_steps : int
        Steps that Exudyn tried and gave up.
    recruitments : int
        Solutions of (10), the start's included.
    window_integrations : int
        Integrations of one muscle over one window, for bounds and excitations.
    newton_iterations : int
        Newton iterations of the skeleton, those of rejected steps included.
    """

    steps: int = 0
    rejected_steps: int = 0
    recruitments: int = 0
    window_integrations: int = 0
    newton_iterations: int = 0


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

    Raises
    ------
    ParameterError
        Shapes that do not fit, times that do not increase, or values not finite.
    """

    time: np.ndarray
    values: np.ndarray
    reserves: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    initial: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None = None

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
        if not (np.isfinite(t).all() and np.isfinite(u).all() and np.isfinite(r).all()):
            raise ParameterError("excitations: time, values and reserves must be finite")
        if (np.diff(t) <= 0.0).any():
            raise ParameterError("excitations: time must increase")
        for name, value in (("time", t), ("values", u), ("reserves", r)):
            object.__setattr__(self, name, value)

    @classmethod
    def from_file(
        cls, file: str | Path, muscles: Sequence[str], reserves: Sequence[Actuator] = ()
    ) -> Excitations:
        """Excitations from a file of controls as OpenSim's CMC writes it, and this package too.

        A row holds the controls of the window that ends there; those of the first do not matter.

        Parameters
        ----------
        file : str or Path
            As `read_storage` reads it.
        muscles : sequence of str
            Names of the m muscles; other columns do not matter.
        reserves : sequence of Reserve, PointActuator or TorqueActuator
            Those of the model, whose optimal forces the controls are multiplied with; their columns
            have their names.

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
            u, torques = storage.controls(muscles)[1:], storage.controls(names)
            if len(u) == 0:
                raise StorageError("controls need at least two rows, the ends of a window")
            return cls(storage.time, u, torques * [reserve.optimal_force for reserve in reserves])
        except (StorageError, ParameterError) as error:
            raise type(error)(f"{file}: {error}") from error

    def window(self, t: float) -> int:
        """Number of the window that contains `t`; the last or first one outside."""
        return int(np.clip(np.searchsorted(self.time, t, "right") - 1, 0, len(self.values) - 1))


class Difference(NamedTuple):
    """The first place where two trajectories differ by more than allowed.

    `size` and `tolerance` are those of `quantity` at `time` [s]; None for a difference in names or
    shapes.
    """

    quantity: str
    time: float | None
    size: float | None
    tolerance: float | None

    def __str__(self) -> str:
        if self.time is None:
            return f"{self.quantity} differ"
        return (
            f"{self.quantity} differ by {self.size:.3g} at t = {self.time:.6g} s, "
            f"allowed is {self.tolerance:.3g}"
        )


# Quantities of one row a time point, and of one row a window, with the tolerance of `compare`. The
# window integration may choose other steps on another machine: excitations, activations and CMC's
# motion then differ within its tolerance of 1e-4, less than the methods differ among each other.
POINTS = {
    "coordinates": 1e-6,
    "speeds": 1e-5,
    "accelerations": 1e-3,
    "activations": 2e-4,
    "tendon_forces": 2e-4,
    "musculotendon_lengths": 1e-6,
    "tendon_lengths": 1e-5,
    "fiber_lengths": 1e-5,
    "torques_delivered": 1e-2,
    "desired_coordinates": 1e-9,
}
WINDOWS = {
    "excitations": 2e-4,
    "torques_demanded": 1e-3,
    "torques_unmet": 1e-2,
    "force_min": 2e-4,
    "force_max": 2e-4,
    "force_optimal": 2e-4,
    "reserves": 1e-3,
}
# Compared relative to the largest tendon force of the reference.
FORCES = {"tendon_forces", "force_min", "force_max", "force_optimal"}
OF_COORDINATES = {
    "coordinates", "speeds", "accelerations", "torques_delivered", "desired_coordinates",
    "torques_demanded", "torques_unmet",
}  # fmt: skip
FIELDS = {"excitations": "excitation_values"}


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """The result of a method: T time points, K windows, n coordinates, m muscles, r reserves.

    Attributes
    ----------
    time : (T,) ndarray
        [s].
    coordinates, speeds, accelerations : (T, n) ndarray
        q [rad or m], q', q''.
    activations, tendon_forces : (T, m) ndarray
        a and F [N].
    musculotendon_lengths, tendon_lengths, fiber_lengths : (T, m) ndarray
        l, l_t and l_m [m].
    torques_delivered : (T, n) ndarray
        What the skeleton got, J_m F with the reserves [N m]. CSS takes both from the predicted
        state, so that they differ from those of the recorded forces by the order of its error.
    desired_coordinates : (T, n) ndarray
        q_d; NaN where nothing was desired.
    window_time : (K + 1,) ndarray
        Ends of the windows [s].
    excitation_values : (K, m) ndarray
        u, held over each window.
    torques_demanded, torques_unmet : (K, n) ndarray
        Q_m at the windows' ends, and what of it was out of reach [N m].
    force_min, force_optimal, force_max : (K, m) ndarray
        Bounds (8), (9) and recruited forces (10) [N], at the accepted state or, with CSS, at the
        predicted one.
    reserves : (K + 1, r) ndarray
        Reserve torques at the windows' ends [N m].
    start_unmet : (n,) ndarray
        Unmet torque of the recruitment at the start.
    saturated : tuple of n tuples of str
        For every coordinate that fell short, the muscles that could do no more for it where it did
        most.
    coordinate_units : tuple of str
        rad or m.
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
    muscle_names: tuple[str, ...]
    reserve_names: tuple[str, ...]
    time: np.ndarray
    coordinates: np.ndarray
    speeds: np.ndarray
    accelerations: np.ndarray
    activations: np.ndarray
    tendon_forces: np.ndarray
    musculotendon_lengths: np.ndarray
    tendon_lengths: np.ndarray
    fiber_lengths: np.ndarray
    torques_delivered: np.ndarray
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
        return Excitations(self.window_time, self.excitation_values, self.reserves, initial)

    def tracking_errors(self) -> np.ndarray:
        """q_d - q, (T, n) [rad or m]."""
        return self.desired_coordinates - self.coordinates

    def tracking_error_rms(self) -> np.ndarray:
        """Root mean square of the tracking errors over all time points, (n,) [rad or m]."""
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

    def unmet_torque_report(self) -> str:
        """One line a coordinate that fell short: how often, how far, when; empty if none did."""
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
            Quantity -> largest allowed absolute difference, in place of the defaults in `POINTS`
            and `WINDOWS`.

        Returns
        -------
        Difference or None
            None if the two agree.

        Raises
        ------
        ParameterError
            A tolerance is given for a quantity that does not exist.
        """
        scale = np.abs(reference.tendon_forces).max(initial=0.0)
        allowed = {
            name: tolerance * scale if name in FORCES else tolerance
            for name, tolerance in {**POINTS, **WINDOWS}.items()
        } | dict(tolerances or {})
        unknown = set(allowed) - set(POINTS) - set(WINDOWS)
        if unknown:
            raise ParameterError(f"tolerances: no such quantities: {sorted(unknown)}")
        for name in (
            "method", "coordinate_names", "coordinate_units", "muscle_names", "reserve_names",
            "status",
        ):  # fmt: skip
            if getattr(self, name) != getattr(reference, name):
                return Difference(name, None, None, None)
        if other_kinds(self.settings, reference.settings):
            return Difference("kinds of settings", None, None, None)
        for name in ("time", "window_time"):
            mine, other = getattr(self, name), getattr(reference, name)
            if mine.shape != other.shape:
                return Difference(name, None, None, None)
            if (np.abs(mine - other) > 1e-9).any():
                k = int(np.argmax(np.abs(mine - other) > 1e-9))
                return Difference(name, float(other[k]), float(abs(mine[k] - other[k])), 1e-9)
        for name, tolerance in allowed.items():
            mine, other = (getattr(x, FIELDS.get(name, name)) for x in (self, reference))
            if mine.shape != other.shape:
                return Difference(name, None, None, None)
            gap = np.abs(mine - other)
            gap[np.isnan(mine) & np.isnan(other)] = 0.0
            rows = ~(gap <= tolerance).all(axis=1)
            if rows.any():
                k = int(rows.argmax())
                clock = reference.time if name in POINTS else reference.window_time
                late = len(clock) - len(rows)
                return Difference(name, float(clock[k + late]), float(gap[k].max()), tolerance)
        return None

    def to_dataframe(self) -> pandas.DataFrame:
        """Time points as rows, `quantity/name` as columns; windows are those that end there.

        Raises
        ------
        ImportError
            pandas is not installed.
        """
        import pandas

        columns: dict[str, np.ndarray] = {"time": self.time}
        for quantity in POINTS:
            array = getattr(self, quantity)
            for k, name in enumerate(self._names_of(quantity)):
                columns[f"{quantity}/{name}"] = array[:, k]
        if self.windows:
            window = np.searchsorted(self.window_time, self.time - 1e-12) - 1
            window = np.clip(window, 0, self.windows - 1)
            for quantity in WINDOWS:
                array = getattr(self, FIELDS.get(quantity, quantity))
                rows = array[window + (quantity == "reserves")]
                for k, name in enumerate(self._names_of(quantity)):
                    columns[f"{quantity}/{name}"] = rows[:, k]
        return pandas.DataFrame(columns)

    def _check_shapes(self, file: str | Path) -> None:
        """Raise ResultFileError unless all fields fit each other."""
        points, windows, n = self.time.size, self.window_time.size - 1, len(self.coordinate_names)
        expected: dict[str, tuple[int, ...]] = {
            "time": (points,),
            "window_time": (windows + 1,),
            "start_unmet": (n,),
        }
        for name in (*POINTS, *WINDOWS):
            rows = points if name in POINTS else windows + (name == "reserves")
            expected[FIELDS.get(name, name)] = (rows, len(self._names_of(name)))
        for name, shape in expected.items():
            found = getattr(self, name).shape
            if found != shape:
                raise ResultFileError(f"{file}: {name} of shape {found}, expected {shape}")
        for name in ("coordinate_units", "saturated"):
            if len(getattr(self, name)) != n:
                raise ResultFileError(f"{file}: {name} are not {n}, one for each coordinate")
        for name in ("time", "window_time"):
            clock = getattr(self, name)
            if clock.size == 0 or not np.isfinite(clock).all() or (np.diff(clock) <= 0.0).any():
                raise ResultFileError(f"{file}: {name} does not increase, or is empty")

    def _names_of(self, quantity: str) -> tuple[str, ...]:
        if quantity == "reserves":
            return self.reserve_names
        return self.coordinate_names if quantity in OF_COORDINATES else self.muscle_names

    def save(self, file: str | Path) -> None:
        """Write everything to an `.npz` file, whole or not at all.

        Raises
        ------
        OSError
            It cannot be written; names it. An earlier file of this name is as it was.
        """
        values = {item.name: getattr(self, item.name) for item in dataclasses.fields(self)}
        values |= {"status": self.status.name, "counts": dataclasses.asdict(self.counts)}
        write_fields(file, values)

    @classmethod
    def load(cls, file: str | Path) -> Trajectory:
        """Read a file that `save` wrote.

        Raises
        ------
        ResultFileError
            The file is damaged, is not a trajectory, or is of another version; names it.
        FileNotFoundError
        """
        content = read_fields(file)
        missing = {item.name for item in dataclasses.fields(cls)} - set(content)
        if missing:
            raise ResultFileError(f"{file}: truncated, without {sorted(missing)}")
        try:
            content["status"] = Status[content["status"]]
            content["counts"] = Counts(**content["counts"])
            for name in ("coordinate_names", "coordinate_units", "muscle_names", "reserve_names"):
                content[name] = tuple(content[name])
            content["saturated"] = tuple(map(tuple, content["saturated"]))
            trajectory = cls(**content)
        except (TypeError, KeyError) as error:
            raise ResultFileError(f"{file}: damaged header ({error!r})") from error
        trajectory._check_shapes(file)
        return trajectory


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
        begun, reserve, start_unmet = self.start
        window_time, reserves, windows = [begun], [reserve], []
        for row in self._rows[1:]:
            if row.window is not None:
                windows.append(row.window)
                window_time.append(row.time)
                reserves.append(row.reserve)
            else:
                window_time[-1], reserves[-1] = row.time, row.reserve
        points = _stacked([row.point for row in self._rows], (n, n, n, m, m, n))
        q, v, a, activation, tendon, delivered = points
        geometry = [model.geometry(*row) for row in zip(q, v, strict=True)]
        lengths = np.array([row.length for row in geometry])
        force, fiber = np.empty((2, *tendon.shape))
        for k, (l, l_rate, *_) in enumerate(geometry):
            tendon_forces(model.muscles.tables, activation[k], tendon[k], l, l_rate, force[k])
            fiber_lengths(model.muscles.tables, tendon[k], l, fiber[k])
        time = np.array([row.time for row in self._rows])
        desired = np.full_like(q, np.nan) if self._motion is None else self._motion(time)[0]
        u, demanded, unmet, low, optimal, high = _stacked(windows, (m, n, n, m, m, m))
        ends = np.array(window_time)
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
            musculotendon_lengths=lengths,
            tendon_lengths=tendon,
            fiber_lengths=fiber,
            torques_delivered=delivered,
            desired_coordinates=desired,
            window_time=ends,
            excitation_values=u,
            torques_demanded=demanded,
            torques_unmet=unmet,
            force_min=low,
            force_optimal=optimal,
            force_max=high,
            reserves=np.array(reserves),
            start_unmet=start_unmet,
            saturated=_saturated(
                model.muscles.names, time, ends[1:], geometry, unmet, optimal, high
            ),
            status=self.status,
            message=self.message,
            counts=dataclasses.replace(self._counts),
            cpu_time=ended - self.begun,
            settings=_plain(self._settings),
            versions=dict(_versions()),
        )


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


@cache
def _versions() -> dict[str, str]:
    """Versions of everything that may change a result."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


def _plain(settings: Any) -> dict[str, Any]:
    """Settings as JSON can hold them."""
    return {
        item.name: _value(getattr(settings, item.name))
        for item in dataclasses.fields(settings)
        if item.init
    }


def _value(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, Mapping):
        return {name: _value(item) for name, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_value(item) for item in np.asarray(value).tolist()]
    if dataclasses.is_dataclass(value) and any(item.init for item in dataclasses.fields(value)):
        return _plain(value)
    return value if isinstance(value, (bool, int, float, str, type(None))) else repr(value)
