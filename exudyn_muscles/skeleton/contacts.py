"""Contacts and friction, which Exudyn keeps open or closed, sticking or sliding, while it iterates.

It settles them in PostNewton, when Newton's iterations are over: those of objects in the system's
data coordinates, those of a GeneralContact within it. Forces at other states than a run's need them
settled there, and the run needs them as they were.
"""

from __future__ import annotations

import exudyn as exu
import numpy as np

from ..errors import ModelError
from .hold import Hold
from .state import State

SAME_TIME = 1e-9  # s


class Contacts:
    """All of a system; without any, nothing is done.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    solver : exudyn.MainSolverImplicitSecondOrder
        Initialized with it.
    settings : exudyn.SimulationSettings
        The solver's.
    state : State

    Raises
    ------
    ModelError
        A GeneralContact remembers friction.
    """

    def __init__(
        self,
        mbs: exu.MainSystem,
        solver: exu.MainSolverImplicitSecondOrder,
        settings: exu.SimulationSettings,
        state: State,
    ) -> None:
        self._mbs, self._solver, self._settings, self._state = mbs, solver, settings, state
        self._general = [mbs.GetGeneralContact(k) for k in range(mbs.NumberOfGeneralContacts())]
        self._any = bool(self._general) or state.data.size > 0
        for number, contact in enumerate(self._general):
            if contact.isActive and contact.sphereSphereFrictionRecycle:
                raise ModelError(
                    f"GeneralContact {number} of the mbs takes its friction from the step before, "
                    "so that it is unknown at the states that muscles are recruited for: set its "
                    "sphereSphereFrictionRecycle = False"
                )

    def begin(self, held: Hold) -> None:
        """Settle at the current state, which is the initial one, also for a run from there."""
        if not self._any:
            return
        data, initial = self._mbs.systemData, exu.ConfigurationType.Initial
        before = np.array(data.GetDataCoordinates(configuration=initial))
        self.settle()
        settled = self._state.data.copy()

        def put_back() -> None:
            now = data.GetDataCoordinates(configuration=initial)
            if np.array_equal(now, settled):  # else the run has left them
                data.SetDataCoordinates(before, configuration=initial)
            self._settle_general(
                data.GetODE2Coordinates(configuration=initial),
                data.GetODE2Coordinates_t(configuration=initial),
            )

        held.keep(put_back)
        data.SetDataCoordinates(settled, configuration=initial)

    def settle(self) -> None:
        """At the current state; the user's own PostNewton function is not called."""
        if not self._any:
            return
        stored = self._mbs.GetPostNewtonUserFunction()
        own = stored["function"] if isinstance(stored, dict) else stored
        iterations = self._settings.timeIntegration.discontinuous
        try:
            self._mbs.SetPostNewtonUserFunction(0)
            for _ in range(iterations.maxIterations):
                error = self._solver.PostNewton(self._mbs, self._settings)
                if error <= iterations.iterationTolerance:
                    break
        finally:
            self._mbs.SetPostNewtonUserFunction(own)

    def settle_ahead(self, step_end: float) -> None:
        """At the current state, where a run is to be whose step being tried ends at `step_end`.

        Within that step a GeneralContact stays as it was when the step began: its PostNewton asks
        for no iteration.
        """
        self.settle()
        if self._mbs.systemData.GetTime() <= step_end + SAME_TIME:
            self.settle_at_start()

    def settle_at_start(self) -> None:
        """Every GeneralContact as it was when the step began."""
        self._settle_general(*self._state.at_start[:2])

    def settle_general(self) -> None:
        """Every GeneralContact at the current state, where a step is to begin."""
        self._settle_general(*self._state.current[:2])

    def _settle_general(self, coordinates: np.ndarray, speeds: np.ndarray) -> None:
        if not self._general:
            return
        before = self._state.snapshot()
        try:
            self._state.current[0][:], self._state.current[1][:] = coordinates, speeds
            for contact in self._general:
                contact.UpdateContacts(self._mbs)
        finally:
            self._state.restore(before)
