"""What the skeleton is asked to do: feedback around the desired motion, and its settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..model import MusculoskeletalModel
from ..motion import Motion, check_motion, warn_of_angles
from ..numerics.kernel import kernel
from ..recruitment.settings import RecruitmentSettings, check_fit
from ..simulation.settings import RunSettings
from ..skeleton.opened import Dynamics

# 1/h^2 of the shortest step: a larger kp would ask for more than any step can follow.
LARGEST_GAIN = 1e12


@dataclass(frozen=True, kw_only=True)
class TrackingSettings(RunSettings, RecruitmentSettings):
    """Feedback gains and more, common to CMC and co-simulation.

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
        RunSettings.__post_init__(self)
        RecruitmentSettings.__post_init__(self)
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
    check_fit(settings, model)
    warn_of_angles(motion, model.coordinates, model.skeleton.units)
    start = motion.start if start is None else start
    model.check_lengths(motion(np.linspace(start, motion.end, 101))[0])
    return start


@kernel
def by_law(q_d, v_d, a_d, q, v, kp, kv, a):
    """Write the law's accelerations `a` (n,)."""
    for j in range(a.size):
        a[j] = a_d[j] + kv[j] * (v_d[j] - v[j]) + kp[j] * (q_d[j] - q[j])


class Tracking:
    """The control law; the motion is evaluated once for every time."""

    def __init__(self, motion: Motion, settings: TrackingSettings) -> None:
        self._motion = motion
        self._known: dict[float, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
        self.kp, self.kv = _as_one_or_each(settings.kp), settings.velocity_gain
        self._each = np.zeros((2, len(motion))) + np.array([self.kp, self.kv]).reshape(2, -1)

    def desired(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """q_d, q_d', q_d'' (n,) at `t`."""
        if t not in self._known:
            if len(self._known) > 1:  # both ends of a step are all that is asked for again
                self._known.pop(next(iter(self._known)))
            self._known[t] = self._motion(t)
        return self._known[t]

    def acceleration(self, t: float, t_error: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """q_d''(t) + k_v e' + k_p e with the errors of `q`, `v` at `t_error`: (12) and (15)."""
        q_d, v_d, a_d = self.desired(t_error)
        if t != t_error:
            a_d = self.desired(t)[2]
        found = np.empty(q.size)
        by_law(q_d, v_d, a_d, q, v, *self._each, found)
        return found

    def expected_error(self, t: float, t_0: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """q - q_d (n,) at `t` of what is at `q`, `v` at `t_0`, if it does as the law asks."""
        q_d, v_d, _ = self.desired(t_0)
        e, e_t, h = q - q_d, v - v_d, t - t_0
        return e + h * e_t - 0.5 * h * h * (self.kv * e_t + self.kp * e)

    def demand(self, t: float, there: Dynamics) -> np.ndarray:
        """Q_m (n,) of (15) at a state."""
        return there.torque(self.acceleration(t, t, *there.place[:2]))
