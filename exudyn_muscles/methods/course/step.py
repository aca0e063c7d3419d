"""A step that is tried, and where it really leads."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from ...recruitment.windows import OpenWindow
from ...skeleton.geometry import Geometry
from ...skeleton.opened import Dynamics


class Step(NamedTuple):
    """A step that ends at the current state and the time `end` [s].

    `excitation` (m,) are held; the ideal actuators' forces (2, r) go from one to the other.
    `geometry` are those at both ends, `here` is the `Dynamics` at the end, `begun` what the step
    before has left for this one.
    """

    window: OpenWindow
    end: float
    excitation: np.ndarray
    reserves: tuple[np.ndarray, np.ndarray]
    geometry: tuple[Geometry, Geometry]
    here: Dynamics
    begun: Any

    def reserves_at(self, s: np.ndarray) -> np.ndarray:
        """Forces (k, r) of the ideal actuators at parts `s` (k,) of the step."""
        return (1.0 - s)[:, None] * self.reserves[0] + s[:, None] * self.reserves[1]


class Led(NamedTuple):
    """Where a step really leads.

    `away`, q and h q' (2, N), is how far that is from the iterate; a, l_t (m,) are the muscles' at
    the end, and `begun` is for the next step.
    """

    away: np.ndarray
    activation: np.ndarray
    tendon_length: np.ndarray
    begun: Any


class Course(Protocol):
    """The muscles and the skeleton of a model over steps.

    Attributes
    ----------
    size : int
        Number N of the coordinates that a step is moved by.
    passes : int
        How often an iterate is moved at most.
    near : float
        What an iterate may be off [rad or m] at most to keep its excitations.
    """

    size: int
    passes: int
    near: float

    def begin(self, t: float) -> Any:
        """What the first step needs of its start, which is the current state."""

    def fastest(self) -> float:
        """With how much the skeleton may swing at most [rad/s], or half of what it settles with."""

    def over(self, step: Step) -> Led:
        """Where a step really leads.

        Raises
        ------
        WindowError
            A muscle's equations could not be integrated; names it.
        WrappingError
            A muscle finds no way over an ellipsoid.
        """

    def move(self, dq: np.ndarray, dv: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Add to the coordinates and speeds (N,) of the current state, as far as it follows within
        a step h [s]; returned is what was added."""

    def is_settled(self, h: float) -> bool:
        """Whether the iterate of a step h [s] meets the constraints well enough to say more."""

    def tracked(self, moved: np.ndarray) -> np.ndarray:
        """Changes (..., N) of coordinates or speeds as those of what is tracked (..., n)."""

    def moving(self, tracked: np.ndarray, here: Dynamics) -> np.ndarray:
        """Changes (..., N) by which these are reached (..., n); what is passive goes with them."""
