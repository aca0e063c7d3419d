"""Full co-simulation (CSF): the muscles are recruited in every corrector iteration."""

from __future__ import annotations

import numpy as np

from ..simulation.solver import request_jacobian
from ..skeleton.geometry import Geometry
from .cosimulation_settings import FirstIterate
from .coupled import CoupledScheme, CoupledState
from .recruiting import Excited

DIFFERENCE = 1e-6  # rad or m; torques are smooth to 1e-12 of their size


class FullScheme(CoupledScheme):
    """The torque follows the iterate, so that the Newton matrix has to know it."""

    feeds_back = True

    def ready(self, step: float) -> None:
        """Any step will do."""

    def open_step(self, state: CoupledState) -> None:
        state.recruited = None
        request_jacobian(self.model.mbs)  # cheaper than one recruitment more, with modified Newton

    def torque(self, state: CoupledState, t: float, first: bool) -> np.ndarray:
        q, v = self.skeleton.q, self.skeleton.v
        state.M, bias = self.skeleton.dynamics()
        Q_m = state.tracking.demand(t, q, v, state.M, bias)
        if first and self.settings.first_iterate is FirstIterate.DEMAND:
            state.recruited = None
            return Q_m
        return self.recruit(state, Q_m, q, v)

    def jacobian(
        self, state: CoupledState, exact: np.ndarray, mass: float, dq: float, dv: float
    ) -> np.ndarray:
        wanted, free, tracking = np.zeros_like(exact), self.skeleton.free, state.tracking
        if state.recruited is None or not state.recruited.recruitment.unmet.any():
            # With the demand met the residual is M (q'' - q''_CTC), whatever else acts on the
            # skeleton.
            wanted[:, free] = state.M * (mass - tracking.kp * dq - tracking.kv * dv)
            return wanted
        wanted[:] = exact
        wanted[:, free] = self._saturated_jacobian(state, mass, dq, dv)
        return wanted

    def _saturated_jacobian(
        self, state: CoupledState, mass: float, dq: float, dv: float
    ) -> np.ndarray:
        """By differences along the solver's own directions: q_j and, with it, q_j'."""
        skeleton, t = self.skeleton, self.model.mbs.systemData.GetTime()
        q, v, a = (x.copy() for x in (skeleton.q, skeleton.v, skeleton.acceleration))

        def imbalance(q: np.ndarray, v: np.ndarray) -> np.ndarray:
            M, bias = skeleton.dynamics_at(q, v, t)
            Q_m = state.tracking.demand(t, q, v, M, bias)
            return M @ a + bias - self.serve(state, Q_m, q, v).recruitment.torque

        columns = np.eye(q.size) * DIFFERENCE
        here = imbalance(q, v)
        slopes = [(imbalance(q + d, v + d * (dv / dq)) - here) / DIFFERENCE for d in columns]
        return mass * state.M - dq * np.array(slopes).T

    def excite(self, state: CoupledState) -> tuple[Excited, Geometry]:
        recruited = state.served()
        return state.muscles.excite(recruited), recruited.reached.geometry
