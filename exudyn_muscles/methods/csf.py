"""Full co-simulation (CSF): the muscles are recruited in every corrector iteration.

Where a demand is met the step leads to where the control law has it, of which each coordinate is
one linear equation. Of a tree that is alone, by Newmark's rule, the first iterate is therefore put
there, if no user functions look on; Newton's method only goes on where muscles fall short.
"""

from __future__ import annotations

import numpy as np

from ..model import MusculoskeletalModel
from ..simulation.solver import (
    goes_by_newmark,
    newton_factors,
    request_jacobian,
    running_solver,
)
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
        mbs = self.model.mbs
        state.by_law = (
            self._demand_first
            and state.alone is not None
            and not state.watched
            and goes_by_newmark(mbs)
        )
        request_jacobian(mbs)  # cheaper than one recruitment more, with modified Newton

    def torque(self, state: S, t: float, first: bool) -> np.ndarray | None:
        state.replaced = first and state.by_law
        if first:
            state.led, state.recruited = False, None
            if state.replaced:
                return None
        elif state.by_law and not state.led:
            self._lead(state, t)
        state.here = here = self.skeleton.dynamics()
        Q_m = self.demand(state, t, here)
        if first and self._demand_first:
            return self.skeleton.ideal_load(here, Q_m)
        return self.recruit(state, Q_m, here)

    def acceleration(self, state: S, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The accelerations (n,) that are asked for at the coordinates and speeds (n,)."""
        return state.tracking.acceleration(t, t, q, v)

    def demand(self, state: S, t: float, there: Dynamics) -> np.ndarray:
        """The torques (n,) that are asked for at a state."""
        return there.torque(self.acceleration(state, t, *there.place[:2]))

    def newmark_predictor(self, state: S, dq: float, dv: float) -> tuple[np.ndarray, np.ndarray]:
        """Where the step leads if q'' at its end is zero, by a rule that takes `dq`, `dv` times as
        much off q and q'."""
        (q, v, a), h = self.skeleton.start, state.step
        return q + h * v + (0.5 * h * h + dq) * a, v + (h + dv) * a

    def _lead(self, state: S, t: float) -> None:
        """Put the iterate where q'' is what the law asks for."""
        mbs, law = self.model.mbs, state.tracking
        assert state.alone is not None
        mass, dq, dv = newton_factors(running_solver(mbs))
        q, v = self.newmark_predictor(state, dq, dv)
        a = self.acceleration(state, t, q, v) / (mass - law.kp * dq - law.kv * dv)
        state.alone.put(q - dq * a, v - dv * a, a)
        state.led = True
        request_jacobian(mbs)  # should Newton's method go on: there was no matrix yet

    def jacobian(
        self, state: S, exact: np.ndarray, mass: float, dq: float, dv: float
    ) -> np.ndarray:
        skeleton, tracking, here = self.skeleton, state.tracking, state.here
        if state.replaced:  # any matrix will do
            rows = np.zeros(exact.shape)
            rows[:, skeleton.free] = np.eye(len(rows))
            return rows
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
