"""The one place for what changes while a run goes on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

import numpy as np

from ..results.counts import Counts
from ..results.recorder import Recorder
from ..skeleton.geometry import Geometry
from ..skeleton.opened import Dynamics
from ..skeleton.skeleton import Skeleton

# Metadata of the fields that a step takes from the one before; what it needs besides is made for
# the run, or anew in every step.
HANDED_ON = {"handed_on": True}


class RunEnd(NamedTuple):
    """Where a run has reached its end: the time [s], all arrays of Exudyn's system by their names,
    and the `memory` of the skeleton."""

    time: float
    system: dict[str, np.ndarray]
    memory: tuple[np.ndarray, ...]


@dataclass(eq=False, kw_only=True)
class RunState:
    """State of one run; a method's own state adds to it.

    A run within `attached()` may go on where another one ended; it is then the same run.

    Attributes
    ----------
    counts : Counts
    record : Recorder
    end, rounding : float
        Of the run [s], and by how much accumulated time steps may miss it.
    known : float
        Until when all external forces are known [s].
    attached, running, open : bool
        The plugin is attached; Exudyn has begun a run and has not reached its end; a step is being
        tried.
    alone : Skeleton, optional
        The tree, if the run makes Newton's matrix of it itself.
    watched : bool
        User functions see its iterates, and may have changed them.
    change : (N, N) ndarray, optional
        If it has dependent coordinates, and the method gives slopes: how what forces are short of
        M q'' follows q'' in this step, with torques held.
    matrices : list of callable
        What gives solvers their own Newton matrices back.
    ended : RunEnd, optional
        Where the last run ended, if it reached its end.
    t_0, step : float
        Start and length of this step [s].
    calls, iteration : int
        Evaluations of the torque in this step, and the number of the last Newton iteration.
    replaced : bool
        The iterate is none that the method starts from, and is left as it is.
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
    rounding: float = 0.0
    known: float = math.inf
    attached: bool = False
    running: bool = False
    open: bool = False
    alone: Skeleton | None = None
    watched: bool = False
    change: np.ndarray | None = None
    matrices: list[Callable[[], None]] = field(default_factory=list)
    ended: RunEnd | None = None
    step: float = 0.0
    calls: int = 0
    iteration: int = -1
    replaced: bool = False
    here: Dynamics | None = None
    a: np.ndarray = field(init=False, metadata=HANDED_ON)
    l_t: np.ndarray = field(init=False, metadata=HANDED_ON)
    geometry: Geometry = field(init=False, metadata=HANDED_ON)

    def is_absurd(self, q: np.ndarray) -> bool:
        """Whether the coordinates q (n,) have nothing to do with the run's aim."""
        return False

    def begin_run(self, end: float, known: float) -> None:
        """Exudyn begins a run to the time `end` [s], the first one or one that goes on; external
        forces are `known` until then or longer."""
        self.running, self.open, self.ended = True, False, None
        self.end, self.rounding, self.known = end, 1e-9 * max(1.0, abs(end)), known
        self.record.go_on()

    def handed_on(self) -> dict[str, Any]:
        """What the next step takes from the last one, by the names of the fields."""
        return {one.name: getattr(self, one.name) for one in fields(self) if one.metadata}

    def recall(self, ended: RunEnd, handed_on: Mapping[str, Any], counts: Counts) -> None:
        """Be where a run has ended with these."""
        self.running, self.open, self.ended = False, False, ended
        self.counts.recall(counts)
        for name, value in handed_on.items():
            setattr(self, name, value)
