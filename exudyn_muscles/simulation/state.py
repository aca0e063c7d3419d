"""The one place for what changes while a run goes on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..results.counts import Counts
from ..results.recorder import Recorder
from ..skeleton.geometry import Geometry
from ..skeleton.opened import Dynamics


@dataclass(eq=False, kw_only=True)
class RunState:
    """State of one run; a method's own state adds to it.

    Attributes
    ----------
    counts : Counts
    record : Recorder
    end : float
        Of the run [s].
    started, open : bool
        The run has begun; a step is being tried.
    t_0, step : float
        Start and length of this step [s].
    calls, iteration : int
        Evaluations of the torque in this step, and the number of the last Newton iteration.
    here : Dynamics, optional
        Those at the iterate, of methods that find them for every torque.
    a, l_t : (m,) ndarray
        The muscles' committed state.
    geometry : Geometry
        The committed one.
    """

    counts: Counts
    record: Recorder
    end: float
    t_0: float
    started: bool = False
    open: bool = False
    step: float = 0.0
    calls: int = 0
    iteration: int = -1
    here: Dynamics | None = None
    a: np.ndarray = field(init=False)
    l_t: np.ndarray = field(init=False)
    geometry: Geometry = field(init=False)

    def is_absurd(self, q: np.ndarray) -> bool:
        """Whether the coordinates q (n,) have nothing to do with the run's aim."""
        return False
