"""Where a step of a system of bodies really leads.

All coordinates x go on, those that nobody tracks as well: at the nodes of a quadrature the system's
own equations give the x'' that the muscles' forces there leave, by which constraints stay closed.
"""

from __future__ import annotations

import numpy as np

from ...errors import ModelError
from ...model import MusculoskeletalModel
from ...skeleton.constrained import rotation_vectors
from ...skeleton.opened import Dynamics
from ...skeleton.system.geometry import GeometryOnAll
from ...skeleton.system.skeleton import GeneralSkeleton
from .muscles import check_integrated, muscles_go_on
from .nodes import NODES
from .step import Led, Step

# An iterate whose constraints open by more than this in a step [rad or m] is still on its way.
SETTLED = 1e-7


class SystemCourse:
    """The muscles and a system of bodies over steps; see `Course`.

    Raises
    ------
    ModelError
        Nodes of the system are of rotation vectors, whose coordinates are not what speeds add to.
    """

    passes = 2
    near = 0.0  # a course takes about as long as an iterate, which tells more

    def __init__(self, model: MusculoskeletalModel, skeleton: GeneralSkeleton) -> None:
        if rotation_vectors(model.mbs).size:
            raise ModelError(
                "Scheme.CONSISTENT: the mbs has nodes of rotation vectors (NodeRigidBodyRotVecLG); "
                "use nodes of Euler parameters, or Scheme.FULL"
            )
        self._model, self._skeleton, self.size = model, skeleton, skeleton.width

    def begin(self, t: float) -> None:
        """The first step finds out for itself."""

    def fastest(self) -> float:
        return self._skeleton.now.fastest()

    def move(self, dq: np.ndarray, dv: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        # Speeds that leave the constraints would come back as accelerations across them, because
        # Exudyn's Newton makes a step's last speeds meet the constraints; stiff passive directions
        # would be thrown far from where they rest.
        system = self._skeleton.now
        dq, dv = system.followed(dq, dv, h)
        system.state.q[:] += dq
        system.state.v[:] += dv
        return dq, dv

    def is_settled(self, h: float) -> bool:
        lack = self._skeleton.now.equations(velocity=True)
        return h * float(np.abs(lack).max(initial=0.0)) <= SETTLED

    def tracked(self, moved: np.ndarray) -> np.ndarray:
        return moved @ self._skeleton.pose().T.T

    def moving(self, tracked: np.ndarray, here: Dynamics) -> np.ndarray:
        _, _, _, B, _ = here.place
        return tracked @ B.T

    def over(self, step: Step) -> Led:
        system, h = self._skeleton.now, step.window.h
        state = system.state
        start, end = ([x.copy() for x in ends[:2]] for ends in (state.at_start, state.current))
        times = step.end - (1.0 - NODES.s) * h
        loads, states = self._loads(step, NODES.s, times)
        a = np.empty_like(loads)
        for k, t in enumerate(times):
            if k == 0 and step.begun is not None:
                a[k] = step.begun
                continue
            with state.within(t):
                a[k] = system.accelerations(loads[k])
        return Led(NODES.away(h, start, end, a), states[0], states[1], a[-1])

    def _loads(self, step: Step, s: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Loads (k, N) at parts `s` (k,) of a step, and a, l_t (2, m) at its end."""
        windows, (a, l_t, *_) = step.window.windows, step.window.start
        tables, m = windows.muscles.tables, a.size
        states, held = np.array([a, l_t]), step.reserves_at(s)
        loads, lengths, forces = (
            np.empty((s.size, self.size)),
            np.empty((s.size, 2, m)),
            np.empty(m),
        )
        for k, t in enumerate(times):
            before = max(k - 1, 0)
            lengths[k], of_units = self._geometry(step, k, s.size, t)
            failed = muscles_go_on(
                tables, step.excitation, t - times[before], states, lengths[before], lengths[k],
                windows.scratch, forces,
            )  # fmt: skip
            check_integrated(failed, step.window)
            loads[k] = forces @ of_units[:m] + held[k] @ of_units[m:]
        windows.tally[0] += m
        return loads, states

    def _geometry(
        self, step: Step, k: int, count: int, t: float
    ) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        """l and l' (m,), and what unit forces are on all coordinates (m + r, N), at the node k."""
        if k in (0, count - 1):
            known = step.geometry[k > 0]
            assert isinstance(known, GeometryOnAll)
            return known[:2], known.loads
        assert self._model.loads is not None
        with self._skeleton.now.state.within(t):
            l, l_rate, of_units = self._model.loads(self._skeleton.pose())
        return (l, l_rate), of_units
