"""Co-simulation, section 6 of the paper: full (CSF) and simplified (CSS).

Exudyn integrates the skeleton. In every corrector iteration (CSF), or once at a predicted state
(CSS), the plugin recruits the muscles for the torque of the control law (15),

    q''_CTC = q_d'' + k_v e' + k_p e,    Q_m = M q''_CTC + H - Q,

and hands J_m F_opt to Exudyn. After acceptance the excitations are solved and the muscles
committed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..errors import ParameterError, StabilityWarning, warn
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..results.recorder import Window
from ..results.trajectory import Trajectory
from ..simulation.plugin import Plugin
from ..simulation.run import simulate
from .control import (
    Tracking,
    TrackingSettings,
    check_settings,
    check_step,
    tracking_start,
)
from .recruiting import MuscleOptimization


class Scheme(Enum):
    """How often the muscles are recruited within a step."""

    FULL = "csf"
    SIMPLIFIED = "css"


class Predictor(Enum):
    """The state at which CSS recruits, from the start of the step.

    CONSTANT_ACCELERATION: q + h q' + h^2/2 q'', q' + h q''.
    EXTRAPOLATED_ACCELERATION: q'' continues linearly from the last step and the trapezoidal rule
    leads to q and q'; more accurate, with a lower limit of stability.
    """

    CONSTANT_ACCELERATION = "constant"
    EXTRAPOLATED_ACCELERATION = "extrapolated"


class FirstIterate(Enum):
    """What CSF does at Exudyn's predictor, whose q'' is zero.

    DEMAND: the demanded torque itself goes to Exudyn; recruitment begins with the next iterate. The
    converged step is the same, with one recruitment less.
    RECRUIT: recruit there too, as the paper has it.
    """

    DEMAND = "demand"
    RECRUIT = "recruit"


@dataclass(frozen=True, kw_only=True)
class Cosimulation(TrackingSettings):
    """Settings of `cosimulate` and `CosimulationPlugin`.

    Parameters
    ----------
    scheme : Scheme
    step : float
        Step of the skeleton [s]; with the plugin, Exudyn's settings decide.
    predictor : Predictor
        Of the simplified scheme.
    first_iterate : FirstIterate
        Of the full scheme.
    """

    scheme: Scheme = Scheme.FULL
    step: float = 0.01
    predictor: Predictor = Predictor.CONSTANT_ACCELERATION
    first_iterate: FirstIterate = FirstIterate.DEMAND

    def __post_init__(self) -> None:
        super().__post_init__()
        check_step("step", self.step)
        kinds = {"scheme": Scheme, "predictor": Predictor, "first_iterate": FirstIterate}
        for name, kind in kinds.items():
            if not isinstance(getattr(self, name), kind):
                raise ParameterError(f"{name} = {getattr(self, name)!r} is not a {kind.__name__}")


DIFFERENCE = 1e-6  # rad or m; torques are smooth to 1e-12 of their size


def cosimulate(
    model: MusculoskeletalModel,
    motion: Motion,
    *,
    settings: Cosimulation = Cosimulation(),
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Track a motion by co-simulation of Exudyn's skeleton and the muscles.

    Starts at the motion's first state and runs in fixed steps to its end; a last incomplete step is
    left out.

    Parameters
    ----------
    model : MusculoskeletalModel
    motion : Motion
        Of the model's n coordinates.
    settings : Cosimulation
    progress : callable, optional
        Called with the time reached after every step.

    Returns
    -------
    Trajectory

    Raises
    ------
    MotionError, ModelError, ParameterError
        Bad input, before anything is simulated.
    SimulationError, WindowError, RecruitmentError
        In the middle; the result up to then is the exception's `trajectory`.

    Warns
    -----
    MotionWarning
        Angles that cannot be radians.
    UnmetTorqueWarning
        The muscles could not deliver the demanded torques; names the coordinates.
    StabilityWarning
        CSS with gains and step outside its stability limit; names the limit.
    """
    plugin = CosimulationPlugin(model, motion, settings, progress=progress)
    return simulate(plugin, settings.step, motion(motion.start)[:2], modified_newton=False)


class CosimulationPlugin(Plugin):
    """Co-simulation in the user's own run of `mbs.SolveDynamic`; see `Plugin`.

    The run starts from the initial state of the `mbs` at the motion's start, or at `start`.

    Parameters
    ----------
    model : MusculoskeletalModel
    motion : Motion
    settings : Cosimulation
    start : float, optional
        startTime of the run [s]; the motion's start if left out.
    progress : callable, optional
    """

    settings: Cosimulation
    motion: Motion

    def __init__(
        self,
        model: MusculoskeletalModel,
        motion: Motion,
        settings: Cosimulation = Cosimulation(),
        *,
        start: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        check_settings(settings, Cosimulation)
        start = tracking_start(model, motion, settings, start)
        self.method = settings.scheme.value
        super().__init__(model, start, motion.end, settings, motion, progress)
        self._simplified = settings.scheme is Scheme.SIMPLIFIED
        self.feeds_back = not self._simplified

    def begin(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        settings, t = self.settings, self.start_time
        self._muscles = MuscleOptimization(self.model, settings, self.counts)
        self._tracking = Tracking(self.motion, settings)
        M, bias = self.skeleton.dynamics_at(q, v, t)
        Q_m = M @ self._tracking.acceleration(t, t, q, v) + bias
        self.geometry = self.model.geometry(q, v)
        self.a, self.l_t, reserve = self._muscles.start(self.geometry, Q_m, self.record, t)
        self._last_acceleration: tuple[np.ndarray, float] | None = None
        return self.model.torque(self.geometry, self.a, self.l_t, reserve)

    def ready(self, step: float) -> None:
        if self._simplified:
            warn_of_instability(self.settings, step)

    def open_step(self, t_0: float, t_1: float) -> None:
        self._muscles.open(self.a, self.l_t, self.geometry, t_0, t_1)
        self._waiting = True
        self._unmet = False
        if self.feeds_back:
            self.request_jacobian()  # cheaper than one recruitment more, with modified Newton

    def torque(self, t: float, first: bool) -> np.ndarray | None:
        if self._simplified:
            if not self._waiting:
                return None
            self._waiting = False
            return self._recruit(t, *self._predicted())
        q, v = self.skeleton.q, self.skeleton.v
        if first and self.settings.first_iterate is FirstIterate.DEMAND:
            self._unmet = False
            return self._demand(t, q, v)
        return self._recruit(t, q, v)

    def _demand(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Q_m of (15) at a state."""
        if self._simplified:
            self._M, bias = self.skeleton.dynamics_ahead(q, v, t)
        else:
            self._M, bias = self.skeleton.dynamics()
        return self._M @ self._tracking.acceleration(t, t, q, v) + bias

    def _recruit(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """J_m F_opt for the demand at a state."""
        Q_m = self._demand(t, q, v)
        self._trial = self.model.geometry(q, v)
        recruitment = self._muscles.recruit(self._trial, Q_m)
        self._unmet = bool(recruitment.unmet.any())
        return recruitment.torque

    def _predicted(self) -> tuple[np.ndarray, np.ndarray]:
        """q, q' at the step's end from the state at its start."""
        h = self.step
        q, v, a = self.skeleton.start
        if (
            self.settings.predictor is Predictor.CONSTANT_ACCELERATION
            or self._last_acceleration is None
        ):
            return q + h * v + 0.5 * h * h * a, v + h * a
        a_last, h_last = self._last_acceleration
        a_next = a + (a - a_last) * (h / h_last)
        return q + h * v + 0.25 * h * h * (a + a_next), v + 0.5 * h * (a + a_next)

    def jacobian(self, exact: np.ndarray, mass: float, dq: float, dv: float) -> np.ndarray:
        free = self.skeleton.free
        if self._unmet:
            wanted = exact.copy()
            wanted[:, free] = self._saturated_jacobian(mass, dq, dv)
            return wanted
        # With the demand met the residual is M (q'' - q''_CTC), whatever else acts on the skeleton.
        wanted = np.zeros_like(exact)
        wanted[:, free] = self._M * (mass - self._tracking.kp * dq - self._tracking.kv * dv)
        return wanted

    def _saturated_jacobian(self, mass: float, dq: float, dv: float) -> np.ndarray:
        """By differences along the solver's own directions: q_j and, with it, q_j'."""
        t = self.model.mbs.systemData.GetTime()
        q, v, a = (x.copy() for x in (self.skeleton.q, self.skeleton.v, self.skeleton.acceleration))

        def imbalance(q: np.ndarray, v: np.ndarray) -> np.ndarray:
            M, bias = self.skeleton.dynamics_at(q, v, t)
            Q_m = M @ self._tracking.acceleration(t, t, q, v) + bias
            return M @ a + bias - self._muscles.torque(self.model.geometry(q, v), Q_m)

        columns = np.eye(q.size) * DIFFERENCE
        here = imbalance(q, v)
        slopes = [(imbalance(q + d, v + d * (dv / dq)) - here) / DIFFERENCE for d in columns]
        return mass * self._M - dq * np.array(slopes).T

    def accept(self, t_0: float, t_1: float) -> tuple[np.ndarray, Window]:
        if self._simplified:
            self._last_acceleration = (self.skeleton.start[2].copy(), self.step)
            self._trial = self.model.geometry(self.skeleton.q, self.skeleton.v)
            self._muscles.limit(self._trial)
        _, self.a, self.l_t, _ = self._muscles.excite(t_1)
        self.geometry = self._trial
        return self._muscles.reserve, self._muscles.window


def css_growth(kp: float, kv: float, step: float, predictor: Predictor) -> float:
    """Growth of the tracking error over one step of CSS, free of disturbances; unstable above 1.

    The largest eigenvalue of the trapezoidal rule on q'' = -(k_p q + k_v q') of the predicted
    state; q'' at the end follows the predicted state at once because the torques cancel M, H and Q.
    """
    h = step
    if predictor is Predictor.CONSTANT_ACCELERATION:
        ahead = np.array([0.0, 0.0, 1.0, 0.0])  # the q'' that the predictor assumes
        weights = (0.0, 0.5, 0.0, 1.0)
    else:
        ahead = np.array([0.0, 0.0, 2.0, -1.0])
        weights = (0.25, 0.25, 0.5, 0.5)
    q, v, a, a_last = np.eye(4)
    q_p = q + h * v + h * h * (weights[0] * a + weights[1] * ahead)
    v_p = v + h * (weights[2] * a + weights[3] * ahead)
    a_1 = -(kp * q_p + kv * v_p)
    q_1 = q + h * v + 0.25 * h * h * (a + a_1)
    v_1 = v + 0.5 * h * (a + a_1)
    return float(np.abs(np.linalg.eigvals(np.array([q_1, v_1, a_1, a]))).max())


def css_limit(step: float, predictor: Predictor) -> float:
    """Largest stable k_p [1/s^2] of CSS with critical damping, k_v = 2 sqrt(k_p).

    Examples
    --------
    >>> round(css_limit(0.01, Predictor.CONSTANT_ACCELERATION))
    2020
    """
    low, high = 0.0, 16.0 / step**2
    for _ in range(60):
        kp = 0.5 * (low + high)
        if css_growth(kp, 2.0 * np.sqrt(kp), step, predictor) < 1.0:
            low = kp
        else:
            high = kp
    return low


def warn_of_instability(settings: Cosimulation, step: float) -> None:
    """StabilityWarning if CSS is unstable with these gains and this step."""
    for kp, kv in np.broadcast(settings.kp, settings.velocity_gain):
        # Without position feedback the position is neutral, with an eigenvalue of one.
        if css_growth(kp, kv, step, settings.predictor) <= 1.0 + 1e-9:
            continue
        limit = css_limit(step, settings.predictor)
        warn(
            f"CSS with {settings.predictor.name} is unstable at kp = {kp:g}, kv = {kv:.4g}, step = "
            f"{step:g} s: critically damped gains, kv = 2 sqrt(kp), are stable up to kp = "
            f"{limit:.4g} 1/s^2, kv = {2.0 * limit**0.5:.4g} 1/s at this step (kp step^2 = "
            f"{limit * step**2:.4g}); use smaller gains, a smaller step or CSF",
            StabilityWarning,
        )
        return
