"""What both schemes of co-simulation share: the state of a run, and recruiting within a step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from ..errors import SimulationError
from ..model import MusculoskeletalModel
from ..simulation.state import HANDED_ON
from ..skeleton.geometry import Geometry
from ..skeleton.opened import Dynamics
from .cosimulation_settings import CosimulationSettings
from .recruiting import Excited, Opened, Recruited, Started
from .tracked import TrackedState

NOTHING_RECRUITED = "the solver accepted a step without a corrector iteration"


@dataclass(eq=False, kw_only=True)
class CoupledState(TrackedState):
    """State of a run of co-simulation.

    Attributes
    ----------
    opened : Opened
        The window of the step being tried.
    recruited : Recruited, optional
        For the torque that the skeleton has now; None: it has the demand itself, be it within reach
        or not, or that of the step before.
    here : Dynamics
        Those of the last iterate; CSS has none.
    by_law, led : bool
        The step's first iterate is where the control law leads; it is there.
    last : tuple of (n,) ndarray and float, optional
        q'' at the start of the step before, and its length.
    """

    opened: Opened = field(init=False)
    recruited: Recruited | None = None
    here: Dynamics = field(init=False)
    by_law: bool = False
    led: bool = False
    last: tuple[np.ndarray, float] | None = field(default=None, metadata=HANDED_ON)

    def served(self) -> Recruited:
        """What was recruited in the step; SimulationError if nothing was."""
        if self.recruited is None:
            raise SimulationError(NOTHING_RECRUITED)
        return self.recruited


S = TypeVar("S", bound=CoupledState)


class CoupledScheme(ABC, Generic[S]):
    """When within a step the muscles are recruited, and for which torque."""

    feeds_back: bool
    goes_by_rule = True
    state_kind: type[CoupledState] = CoupledState

    def __init__(self, model: MusculoskeletalModel, settings: CosimulationSettings) -> None:
        self.model, self.skeleton, self.settings = model, model.skeleton, settings

    @abstractmethod
    def ready(self, state: S, step: float) -> None:
        """See `Plugin`."""

    def begin(self, state: S, start: Started, t: float) -> None:
        """The run begins at the system's current state at the time `t`, the muscles as they are."""

    @abstractmethod
    def open_step(self, state: S) -> None:
        """See `Plugin`; the window is open."""

    @abstractmethod
    def torque(self, state: S, t: float, first: bool) -> np.ndarray | None:
        """See `Plugin`."""

    @abstractmethod
    def jacobian(
        self, state: S, exact: np.ndarray, mass: float, dq: float, dv: float
    ) -> np.ndarray:
        """See `Plugin`."""

    @abstractmethod
    def excite(self, state: S) -> tuple[Excited, Geometry]:
        """The muscles at the end of the accepted step, and their geometry there."""

    def recruit(self, state: S, Q_m: np.ndarray, there: Dynamics) -> np.ndarray:
        """J_m F_opt for the demand at a state."""
        state.recruited = self.serve(state, Q_m, there)
        return state.recruited.load

    def serve(self, state: S, Q_m: np.ndarray, there: Dynamics) -> Recruited:
        """The forces that serve `Q_m` (n,) best where the step ends."""
        reached = state.muscles.reach(state.opened, self.model.geometry(*there.place))
        served = state.muscles.recruit(reached, Q_m, there.place)
        state.opened = state.opened.after(served.recruitment)
        return served
