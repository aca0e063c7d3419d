"""What the skeleton is asked to do: feedback around the desired motion, and its settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..checks import number_within
from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..motion import Motion, check_motion, warn_of_angles
from ..muscle.window import DEFAULT_TOLERANCE, Integrator, check_integration
from ..recruitment.limits import ControlLimits
from ..recruitment.normalizers import Normalizer, ReachableMaximum
from ..recruitment.optimization import Solver

# 1/h^2 of the shortest step: a larger kp would ask for more than any step can follow.
LARGEST_GAIN = 1e12


@dataclass(frozen=True, kw_only=True)
class RecruitmentSettings:
    """How forces are found, common to static optimization, CMC and co-simulation.

    Parameters
    ----------
    normalizer : Normalizer
        Of the objective (10); the reachable maximum as in the paper.
    weights : mapping of str to float
        Of muscles in the objective (10), by name; 1 for those that are not named. An ideal
        actuator's weight is its optimal force.
    coordinate_weights : float or (n,) sequence of float
        Where a demand is out of reach, coordinates with larger weights come nearer to theirs; only
        their ratios matter.
    control_limits : mapping of str to ControlLimits
        Of muscles and ideal actuators, by name; for the others see `MusculoskeletalModel`.
    solver : Solver
        Of the quadratic program.
    window_tolerance : float
        Of the muscle integration, over F0.
    integrator : Integrator
        Of the muscles over a window.
    raise_on_unmet_torque : bool
        Stop with UnmetTorqueError instead of recording and going on.

    Raises
    ------
    ParameterError
        A value is outside its range; names it.
    """

    normalizer: Normalizer = ReachableMaximum()  # noqa: RUF009 (frozen, too)
    weights: Mapping[str, float] = field(default_factory=dict)
    coordinate_weights: float | Sequence[float] = 1.0
    control_limits: Mapping[str, ControlLimits] = field(default_factory=dict)
    solver: Solver = Solver.DAQP
    window_tolerance: float = DEFAULT_TOLERANCE
    integrator: Integrator = Integrator.TRAPEZOIDAL
    raise_on_unmet_torque: bool = False

    def __post_init__(self) -> None:
        check_integration(self.window_tolerance, self.integrator)
        if not isinstance(self.solver, Solver):
            raise ParameterError(f"solver = {self.solver!r} is not one of {list(Solver)}")
        if not callable(self.normalizer):
            raise ParameterError(f"normalizer = {self.normalizer!r} is not a function")
        self._keep_each("coordinate_weights", 1e-6, 1e6)
        for name in ("weights", "control_limits"):
            if not isinstance(getattr(self, name), Mapping):
                raise ParameterError(
                    f"{name} = {getattr(self, name)!r} is no mapping of names, such as a dict"
                )
        for name, weight in self.weights.items():
            number_within(f"weights: '{name}'", weight, 1e-6, 1e6)
        for name, limits in self.control_limits.items():
            if not isinstance(limits, ControlLimits):
                raise ParameterError(f"control_limits: '{name}' = {limits!r} is no ControlLimits")

    def _keep_each(self, name: str, low: float, high: float, unit: str = "") -> None:
        """Check and keep one number, or a tuple with one for each coordinate."""
        given = getattr(self, name)
        if isinstance(given, str) or np.ndim(given) == 0:
            kept: float | tuple[float, ...] = number_within(name, given, low, high, unit)
        else:
            kept = tuple(
                number_within(f"{name}[{j}]", value, low, high, unit)
                for j, value in enumerate(given)
            )
        object.__setattr__(self, name, kept)


@dataclass(frozen=True, kw_only=True)
class TrackingSettings(RecruitmentSettings):
    """Feedback gains, common to CMC and co-simulation.

    Parameters
    ----------
    kp : float or (n,) sequence of float
        Position gain [1/s^2], one for all coordinates or one for each; 100 as usual in OpenSim.
    kv : float or (n,) sequence of float, optional
        Velocity gain [1/s]; 2 sqrt(kp) if left out, critical damping.
    """

    kp: float | Sequence[float] = 100.0
    kv: float | Sequence[float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        self._keep_each("kp", 0.0, LARGEST_GAIN, "1/s^2")
        if self.kv is not None:
            self._keep_each("kv", 0.0, LARGEST_GAIN, "1/s")

    @property
    def velocity_gain(self) -> float | np.ndarray:
        """k_v [1/s], one number or one for each coordinate."""
        return 2.0 * np.sqrt(self.kp) if self.kv is None else _as_one_or_each(self.kv)


def _as_one_or_each(values: ArrayLike) -> float | np.ndarray:
    array = np.asarray(values, dtype=float)
    return array if array.ndim else float(array)


def check_sizes(settings: RecruitmentSettings, coordinates: Sequence[str]) -> None:
    """Raise ParameterError unless what is given for each coordinate fits the coordinates."""
    for name in ("kp", "kv", "coordinate_weights"):
        size = np.size(getattr(settings, name, 1.0))
        if size not in (1, len(coordinates)):
            raise ParameterError(
                f"{name} has {size} values for the {len(coordinates)} coordinates "
                f"{', '.join(coordinates)}"
            )


def check_settings(settings: object, kind: type) -> None:
    """Raise ParameterError unless the settings are an instance of `kind`."""
    if not isinstance(settings, kind):
        raise ParameterError(f"settings must be {kind.__name__}(...), got {settings!r}")


def check_step(name: str, value: float) -> None:
    """Raise ParameterError unless a time step or window is positive and at most 1 s."""
    number_within(name, value, 1e-6, 1.0, "s")


def tracking_start(
    model: MusculoskeletalModel, motion: Motion, settings: TrackingSettings, start: float | None
) -> float:
    """Start of a run that tracks the motion from `start`, or from its beginning.

    Raises
    ------
    MotionError, ParameterError
        Motion or settings do not fit the model, or muscles do not fit their paths in it.
    """
    check_motion(motion, model.coordinates)
    check_sizes(settings, model.coordinates)
    warn_of_angles(motion, model.coordinates, model.skeleton.units)
    start = motion.start if start is None else start
    model.check_lengths(motion(np.linspace(start, motion.end, 101))[0])
    return start


class Tracking:
    """The control law; the motion is evaluated once for every time."""

    def __init__(self, motion: Motion, settings: TrackingSettings) -> None:
        self._motion = motion
        self._known: dict[float, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
        self.kp, self.kv = _as_one_or_each(settings.kp), settings.velocity_gain

    def desired(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """q_d, q_d', q_d'' (n,) at `t`."""
        if t not in self._known:
            if len(self._known) > 1:  # both ends of a step are all that is asked for again
                self._known.pop(next(iter(self._known)))
            self._known[t] = self._motion(t)
        return self._known[t]

    def acceleration(self, t: float, t_error: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """q_d''(t) + k_v e' + k_p e with the errors of `q`, `v` at `t_error`: (12) and (15)."""
        q_d, v_d, _ = self.desired(t_error)
        _, _, a_d = self.desired(t)
        return a_d + self.kv * (v_d - v) + self.kp * (q_d - q)
