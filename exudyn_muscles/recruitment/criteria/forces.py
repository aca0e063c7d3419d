"""The paper's criterion: forces over their normalising forces, squared."""

from __future__ import annotations

from dataclasses import dataclass

from ...model import MusculoskeletalModel
from ..problem import ScaledProblem
from .criterion import Problems


@dataclass(frozen=True)
class SquaredForces:
    """(10): the least sum of (F_i / N_i)^2, as in the paper."""

    def prepare(self, model: MusculoskeletalModel) -> Problems:
        """See `Criterion`.

        Parameters
        ----------
        model : MusculoskeletalModel

        Returns
        -------
        Problems
        """
        return ScaledProblem
