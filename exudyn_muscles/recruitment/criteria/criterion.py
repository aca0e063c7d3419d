"""What a criterion is.

It makes a problem of every demand; how that is asked of a solver and how the answer is judged is
the same for all, as is what torque is delivered out of reach.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ...model import MusculoskeletalModel
from ..demand import Demand
from ..problem import ScaledProblem

Problems = Callable[[Demand], ScaledProblem]

# Of what a criterion adds, beside the squares; beyond it these are rounding.
LARGEST_WEIGHT = 1e6


class Criterion(Protocol):
    """Anything with a `prepare`; see `SquaredForces`."""

    def prepare(self, model: MusculoskeletalModel) -> Problems:
        """What makes a problem of every demand of a run; its solution is preferred.

        Parameters
        ----------
        model : MusculoskeletalModel

        Returns
        -------
        Problems
            A function of a Demand (arms, torques, limits, activations, time, place) that gives its
            problem.

        Raises
        ------
        ParameterError
            The criterion speaks of something that the model has not; names it.
        """
        ...
