"""Excitations or activations that are measured, as by EMG, and followed as far as torques allow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...checks import number_within
from ...errors import ParameterError
from ...model import MusculoskeletalModel
from ..certificate import ACCEPTED
from ..demand import Demand
from ..limits import course_at, course_nodes
from ..problem import Answer, ScaledProblem
from ..program import Program
from .criterion import LARGEST_WEIGHT, Problems
from .quantity import Quantity, counted


class FollowedProblem(ScaledProblem):
    """min sum (q_i^2 + w_i (q_i - e_i)^2) / 2 with the quantities q; w_i and e_i (m,) are zero of
    what is not measured."""

    accepted = ACCEPTED
    of_squares = False

    def __init__(
        self, demand: Demand, quantity: Quantity, weight: np.ndarray, target: np.ndarray
    ) -> None:
        demand, zero, size = counted(quantity, demand)
        super().__init__(demand)
        pull = weight * size * size
        self._stiffness = 1.0 + pull
        self._least = zero + pull * target / size / self._stiffness

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """How the cost grows with every unknown (m,)."""
        return self._stiffness * (x - self._least)

    def solved(self, ask: Callable[[Program], Answer]) -> Answer:
        """The solution of one quadratic program."""
        P, q = np.diag(self._stiffness), -self._stiffness * self._least
        return ask(self.program(P, q))


@dataclass(frozen=True)
class Followed:
    """The least sum of q_i^2 of all muscles and of weight (q_i - e_i)^2 of those that are measured,
    with the activations or excitations q.

    What is measured is followed as far as the demanded torques allow, and where they do not say
    which of several muscles does it, the others are recruited as by the sum of squares.

    Parameters
    ----------
    courses : mapping of str to (times, values)
        Of muscles by name: [s], and activations or excitations within [0, 1]. Between the times
        they run linearly, before and after them they stay.
    weight : float
        Of the squared distances, up to 1e6.
    quantity : Quantity
        `ACTIVATION` or `EXCITATION`.

    Raises
    ------
    ParameterError
        Something is outside its range; names the muscle.
    """

    courses: Mapping[str, tuple[ArrayLike, ArrayLike]]
    weight: float = 10.0
    quantity: Quantity = Quantity.ACTIVATION

    def __post_init__(self) -> None:
        number_within("weight", self.weight, 0.0, LARGEST_WEIGHT)
        if self.quantity not in (Quantity.ACTIVATION, Quantity.EXCITATION):
            raise ParameterError(f"quantity = {self.quantity!r} is not what EMG can tell")
        if not isinstance(self.courses, Mapping):
            raise ParameterError(f"courses = {self.courses!r} is no mapping of muscles' names")
        kept = {}
        for name, course in self.courses.items():
            t, x = course_nodes(f"courses: '{name}'", course)
            if not ((x >= 0.0) & (x <= 1.0)).all():
                raise ParameterError(
                    f"courses: '{name}' has values from {x.min():g} to {x.max():g}, which are "
                    "outside [0, 1]"
                )
            kept[name] = t, x
        object.__setattr__(self, "courses", kept)

    def prepare(self, model: MusculoskeletalModel) -> Problems:
        """See `Criterion`.

        Parameters
        ----------
        model : MusculoskeletalModel

        Returns
        -------
        Problems

        Raises
        ------
        ParameterError
            A muscle is none of the model's.
        """
        names = model.muscles.names
        for name in self.courses:
            if name not in names:
                raise ParameterError(f"courses of '{name}': the muscles are {', '.join(names)}")
        rows = [names.index(name) for name in self.courses]
        courses = list(self.courses.values())
        weight = np.zeros(len(names) + len(model.reserves))
        weight[rows] = self.weight

        def problem(demand: Demand) -> ScaledProblem:
            target = np.zeros(weight.size)
            for i, (t, x) in zip(rows, courses, strict=True):
                target[i] = course_at(demand.t, t, x, False)
            return FollowedProblem(demand, self.quantity, weight, target)

        return problem
