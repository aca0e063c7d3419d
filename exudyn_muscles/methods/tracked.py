"""What runs that track a motion have in common: their state, and how the muscles start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..model import MusculoskeletalModel
from ..motion import Motion
from ..results.tracking import ABSURD
from ..simulation.state import RunState
from .recruiting import MuscleOptimization, Started
from .tracking import Tracking, TrackingSettings


@dataclass(eq=False, kw_only=True)
class TrackedState(RunState):
    """State of a run that tracks.

    Attributes
    ----------
    muscles : MuscleOptimization
    tracking : Tracking
    started_off : float
        Largest tracking error at the start [rad or m].
    """

    muscles: MuscleOptimization
    tracking: Tracking
    started_off: float = 0.0

    def is_absurd(self, t: float, q: np.ndarray) -> bool:
        e = self.tracking.desired(t)[0] - q
        # The norm first, which takes a third of the time.
        return e @ e > ABSURD**2 and bool(np.abs(e).max() > ABSURD + self.started_off)


def tracked(
    model: MusculoskeletalModel, motion: Motion, settings: TrackingSettings, common: dict[str, Any]
) -> dict[str, Any]:
    """What such a state begins with; `common` is what every run's does."""
    muscles = MuscleOptimization(model, settings, common["counts"])
    return {**common, "muscles": muscles, "tracking": Tracking(motion, settings)}


def start_tracking(
    state: TrackedState, model: MusculoskeletalModel, q: np.ndarray, v: np.ndarray, t: float
) -> Started:
    """The muscles' steady state that serves the demand at q, q' (n,) best, and its geometry, which
    is the state's from now on; opens the record."""
    there = model.skeleton.dynamics_at(q, v, t)
    state.geometry = model.geometry(*there.place)
    start = state.muscles.start(state.geometry, state.tracking.demand(t, there), t)
    state.started_off = float(np.abs(state.tracking.desired(t)[0] - q).max())
    state.record.begin(t, start.reserve, start.unmet)
    return start
