"""What runs that track a motion have in common: their state, and how the muscles start."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..model import MusculoskeletalModel
from ..motion import Motion
from ..results.tracking import ABSURD
from ..simulation.state import HANDED_ON, RunState
from .recruiting import MuscleOptimization, Started
from .tracking import Tracking, TrackingSettings


@dataclass(eq=False, kw_only=True)
class TrackedState(RunState):
    """State of a run that tracks.

    Attributes
    ----------
    muscles : MuscleOptimization
    tracking : Tracking
    at_bounds : (m + r,) ndarray
        The bounds that forces were at last, see `Recruitment`.
    middle, widest : (n,) ndarray
        Of the coordinates that the run may have.
    """

    muscles: MuscleOptimization
    tracking: Tracking
    at_bounds: np.ndarray = field(init=False, metadata=HANDED_ON)
    middle: np.ndarray
    widest: np.ndarray = field(metadata=HANDED_ON)

    def handed_on(self) -> dict[str, Any]:
        return super().handed_on() | {"integrations": self.integrations}

    @property
    def integrations(self) -> int:
        """Of one muscle over one window, up to now."""
        return self.muscles.windows.tally[0]

    @integrations.setter
    def integrations(self, number: int) -> None:
        self.muscles.windows.tally[0] = number

    def is_absurd(self, q: np.ndarray) -> bool:
        off = (q - self.middle) / self.widest
        # The norm first, which takes a third of the time.
        return off.dot(off) > 1.0 and bool((np.abs(off) > 1.0).any())


def tracked(
    model: MusculoskeletalModel, motion: Motion, settings: TrackingSettings, common: dict[str, Any]
) -> dict[str, Any]:
    """What such a state begins with; `common` is what every run's does."""
    muscles = MuscleOptimization(model, settings, common["counts"])
    q = motion(np.linspace(motion.start, motion.end, 101))[0]
    low, high = q.min(axis=0), q.max(axis=0)
    return {
        **common, "muscles": muscles, "tracking": Tracking(motion, settings),
        "middle": 0.5 * (low + high), "widest": 0.5 * (high - low) + ABSURD,
    }  # fmt: skip


def start_tracking(
    state: TrackedState, model: MusculoskeletalModel, q: np.ndarray, v: np.ndarray, t: float
) -> Started:
    """The muscles' steady state that serves the demand at q, q' (n,) best, and its geometry, which
    is the state's from now on; opens the record."""
    there = model.skeleton.dynamics_at(q, v, t)
    state.geometry = model.geometry(*there.place)
    Q_m = state.tracking.demand(t, there)
    start = state.muscles.start(state.geometry, Q_m, t, there.place)
    off = np.abs(q - state.middle)
    state.widest = np.maximum(state.widest, off + ABSURD)
    state.at_bounds = start.at_bounds
    state.record.begin(t, start.reserve, start.unmet)
    return start
