"""Simplified co-simulation (CSS): the muscles are recruited once a step, at a predicted state."""

from __future__ import annotations

import numpy as np

from ..errors import StabilityWarning, warn
from ..skeleton.geometry import Geometry
from .cosimulation_settings import CosimulationSettings, Predictor
from .coupled import CoupledScheme, CoupledState
from .recruiting import Excited


class SimplifiedScheme(CoupledScheme[CoupledState]):
    """The torque is the same in all iterations of a step."""

    feeds_back = False

    def ready(self, state: CoupledState, step: float) -> None:
        warn_of_instability(self.settings, step)

    def open_step(self, state: CoupledState) -> None:
        state.recruited = None

    def torque(self, state: CoupledState, t: float, first: bool) -> np.ndarray | None:
        if state.recruited is not None:
            return None
        q, v = self._predicted(state)
        ahead = self.skeleton.dynamics_ahead(q, v, t)
        return self.recruit(state, state.tracking.demand(t, ahead), ahead)

    def _predicted(self, state: CoupledState) -> tuple[np.ndarray, np.ndarray]:
        """q, q' at the step's end from the state at its start."""
        h = state.step
        q, v, a = self.skeleton.start
        if self.settings.predictor is Predictor.CONSTANT_ACCELERATION or state.last is None:
            return q + h * v + 0.5 * h * h * a, v + h * a
        a_last, h_last = state.last
        a_next = a + (a - a_last) * (h / h_last)
        return q + h * v + 0.25 * h * h * (a + a_next), v + 0.5 * h * (a + a_next)

    def jacobian(
        self, state: CoupledState, exact: np.ndarray, mass: float, dq: float, dv: float
    ) -> np.ndarray:
        return exact

    def excite(self, state: CoupledState) -> tuple[Excited, Geometry]:
        state.last = (self.skeleton.start[2].copy(), state.step)
        geometry = self.model.geometry(*self.skeleton.place)
        at = state.muscles.reach(state.opened, geometry)
        return state.muscles.excite(state.served(), at), geometry


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


def warn_of_instability(settings: CosimulationSettings, step: float) -> None:
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
