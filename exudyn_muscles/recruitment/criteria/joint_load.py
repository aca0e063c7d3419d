"""The force that a joint bears, beside what muscles do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...checks import number_within
from ...errors import ParameterError
from ...joints import joint_force
from ...model import MusculoskeletalModel
from ..certificate import ACCEPTED
from ..demand import Demand
from ..problem import Answer, ScaledProblem
from ..program import Program
from .criterion import LARGEST_WEIGHT, Problems

SMALLEST, LARGEST = 1e-9, 1e9  # N


class JointLoadProblem(ScaledProblem):
    """min (|x|^2 + |c + B x|^2) / 2 with the joint's force c (3,) without muscles and ideal
    actuators and what a unit of each of them adds, B N^-1 (3, m), both over the reference."""

    accepted = ACCEPTED
    of_squares = False

    def __init__(self, demand: Demand, constant: np.ndarray, by_forces: np.ndarray) -> None:
        super().__init__(demand)
        self._constant, self._slopes = constant, by_forces * demand.N

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """How the cost grows with every unknown (m,)."""
        return x + self._slopes.T @ (self._constant + self._slopes @ x)

    def solved(self, ask: Callable[[Program], Answer]) -> Answer:
        """The solution of one quadratic program."""
        B = self._slopes
        P, q = np.eye(B.shape[1]) + B.T @ B, B.T @ self._constant
        return ask(self.program(P, q))


@dataclass(frozen=True)
class JointLoad:
    """The least sum of (F_i / N_i)^2, and of (R / force)^2 with the size R of the force in a joint
    of a kinematic tree.

    R is that of `em.analysis.joint_loads`, of all that acts, with the accelerations that follow
    from the forces. What PreStep user functions set during a run is not known in it.

    Parameters
    ----------
    joint : str
        As `em.analysis.joint_names` calls it, or any coordinate of the tree.
    force : float
        The load that costs as much as one fully used muscle [N]: the smaller, the more the joint is
        spared. At least a thousandth of the largest F0.

    Raises
    ------
    ParameterError
        `force` is no positive number.
    """

    joint: str
    force: float

    def __post_init__(self) -> None:
        number_within("force", self.force, SMALLEST, LARGEST, "N")

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
            There is no such joint, or `force` is too small beside the muscles'.
        ModelError
            As `joint_force`.
        """
        force_at = joint_force(model, self.joint)
        largest = float(model.muscles.max_isometric_force.max(initial=0.0))
        if largest**2 > LARGEST_WEIGHT * self.force**2:
            raise ParameterError(
                f"force = {self.force:g} N is less than a thousandth of the strongest muscle's "
                f"{largest:g} N"
            )

        def problem(demand: Demand) -> ScaledProblem:
            q, v, *_ = demand.place
            constant, by_forces = force_at(q, v, demand.t)
            return JointLoadProblem(demand, constant / self.force, by_forces / self.force)

        return problem
