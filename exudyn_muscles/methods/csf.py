"""Full co-simulation (CSF): the muscles are recruited in every corrector iteration."""

from __future__ import annotations

import numpy as np

from ..model import MusculoskeletalModel
from ..simulation.solver import request_jacobian
from ..skeleton.geometry import Geometry
from ..skeleton.opened import Dynamics
from .cosimulation_settings import CosimulationSettings, FirstIterate
from .coupled import CoupledScheme, S
from .recruiting import Excited

DIFFERENCE = 1e-6  # rad or m; torques are smooth to 1e-12 of their size


class FullScheme(CoupledScheme[S]):
    """The torque follows the iterate, so that the Newton matrix has to know it."""

    feeds_back = True

    def __init__(self, model: MusculoskeletalModel, settings: CosimulationSettings) -> None:
        super().__init__(model, settings)
        self._demand_first = settings.first_iterate is FirstIterate.DEMAND

    def ready(self, state: S, step: float) -> None:
        """Any step will do."""

    def open_step(self, state: S) -> None:
        state.recruited = None
        request_jacobian(self.model.mbs)  # cheaper than one recruitment more, with modified Newton

    def torque(self, state: S, t: float, first: bool) -> np.ndarray:
        state.here = here = self.skeleton.dynamics()
        Q_m = self.demand(state, t, here)
        if first and self._demand_first:
            state.recruited = None
            return self.skeleton.ideal_load(here, Q_m)
        return self.recruit(state, Q_m, here)

    def demand(self, state: S, t: float, there: Dynamics) -> np.ndarray:
        """The torques (n,) that are asked for at a state."""
        return state.tracking.demand(t, there)

    def jacobian(
        self, state: S, exact: np.ndarray, mass: float, dq: float, dv: float
    ) -> np.ndarray:
        skeleton, tracking, here = self.skeleton, state.tracking, state.here
        if state.recruited is None or state.recruited.recruitment.met:
            return skeleton.rows_of_law(exact, here, mass, tracking.kp * dq, tracking.kv * dv)
        return skeleton.rows_of_slopes(exact, here, mass, dq * self._slopes(state, dv / dq))

    def _slopes(self, state: S, speed: float) -> np.ndarray:
        """Of the imbalance (n, n), by differences along the solver's own directions: q_j and, with
        it, `speed` times as much q_j'."""
        skeleton, t = self.skeleton, self.model.mbs.systemData.GetTime()
        q, v, a = (x.copy() for x in (skeleton.q, skeleton.v, skeleton.acceleration))

        def imbalance(q: np.ndarray, v: np.ndarray) -> np.ndarray:
            there = skeleton.dynamics_at(q, v, t)
            served = self.serve(state, self.demand(state, t, there), there)
            return skeleton.imbalance(there, a, served.recruitment.torque)

        columns = np.eye(q.size) * DIFFERENCE
        here = imbalance(q, v)
        slopes = [(imbalance(q + d, v + d * speed) - here) / DIFFERENCE for d in columns]
        return np.array(slopes).T

    def excite(self, state: S) -> tuple[Excited, Geometry]:
        recruited = state.served()
        return state.muscles.excite(recruited), recruited.reached.geometry
