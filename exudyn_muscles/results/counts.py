"""How a run ended, and how much work it was."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum


class Status(Enum):
    """How a run ended."""

    COMPLETE = "complete"
    INCOMPLETE = "incomplete: the trajectory ends where the run stopped, see its message"
    LOST = "lost: the run has left the motion that it was to track, see its message"


@dataclass
class Counts:
    """Work done.

    Attributes
    ----------
    steps : int
        Accepted steps of the skeleton.
    rejected_steps : int
        Steps that Exudyn tried and gave up.
    recruitments : int
        Solutions of (10), the start's included.
    not_preferred : int
        Those with forces of the least squares, because what the criterion prefers was not found.
    window_integrations : int
        Integrations of one muscle over one window, for bounds and excitations.
    newton_iterations : int
        Newton iterations of the skeleton, those of rejected steps included.
    """

    steps: int = 0
    rejected_steps: int = 0
    recruitments: int = 0
    not_preferred: int = 0
    window_integrations: int = 0
    newton_iterations: int = 0

    def copy(self) -> Counts:
        """These numbers, which then stay.

        Returns
        -------
        Counts
        """
        return replace(self)

    def recall(self, before: Counts) -> None:
        """Go on from these numbers.

        Parameters
        ----------
        before : Counts
        """
        vars(self).update(vars(before))
