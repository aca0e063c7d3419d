"""Muscles that work together: activations along modes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...checks import number_within
from ...errors import ParameterError
from ...model import MusculoskeletalModel
from ..certificate import ACCEPTED
from ..demand import Demand
from ..problem import Answer, ScaledProblem
from ..program import Program
from .criterion import LARGEST_WEIGHT, Problems
from .quantity import Quantity, counted


class SynergyProblem(ScaledProblem):
    """min |a|^2 / 2 + weight |a - W z|^2 / 2 over z >= 0 as well, with the activations a of the
    muscles and f / f_optimal of ideal actuators; W (m, k) has zeros in the rows of these."""

    accepted = ACCEPTED
    of_squares = False

    def __init__(self, demand: Demand, W: np.ndarray, weight: float) -> None:
        demand, zero, size = counted(Quantity.ACTIVATION, demand)
        super().__init__(demand)
        self._zero, self._factor = zero, size
        self._W, self._weight = W, np.where(W.any(axis=1), weight, 0.0)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """How the cost grows with every unknown (m,), with the z that is best for `x`."""
        from scipy.optimize import nnls

        a = self._factor * (x - self._zero)
        z, _ = nnls(self._W, np.where(self._weight > 0.0, a, 0.0))
        return x - self._zero + self._weight * self._factor * (a - self._W @ z)

    def solved(self, ask: Callable[[Program], Answer]) -> Answer:
        """The solution of one quadratic program in x and z."""
        (n, m), k = self.A.shape, self._W.shape[1]
        w, s, W, c = self._weight, self._factor, self._W, self._zero
        to_modes = -(w * s)[:, None] * W
        P = np.block([[np.diag(1.0 + w * s * s), to_modes], [to_modes.T, (w[:, None] * W).T @ W]])
        q = np.append(-c - w * s * s * c, -to_modes.T @ c)
        answer = ask(
            Program(
                P, q, A=np.hstack([self.A, np.zeros((n, k))]), b=self.b,
                lb=np.append(self.lb, np.zeros(k)), ub=np.append(self.ub, np.full(k, np.inf)),
            )
        )  # fmt: skip
        return None if answer is None else (answer[0][:m], answer[1])


@dataclass(frozen=True)
class Synergies:
    """The least sum of squared activations, and of `weight` times their squared distance from what
    modes with amplitudes of at least zero can do.

    With a small weight modes are preferred, with a large one left only where torques demand it; a
    torque that modes cannot deliver is delivered all the same.

    Parameters
    ----------
    modes : mapping of str to (k,) sequence of float
        Of every muscle, by name: its activation in each of the k modes, at least zero. The sizes of
        the modes do not matter.
    weight : float
        Up to 1e6.

    Raises
    ------
    ParameterError
        Numbers of modes that differ, values below zero, or modes that are combinations of others.
    """

    modes: Mapping[str, Sequence[float]]
    weight: float = 100.0

    def __post_init__(self) -> None:
        number_within("weight", self.weight, 0.0, LARGEST_WEIGHT)
        if not (isinstance(self.modes, Mapping) and self.modes):
            raise ParameterError(f"modes = {self.modes!r} is no mapping of muscles' names")
        count = np.size(next(iter(self.modes.values())))
        kept = {}
        for name, row in self.modes.items():
            try:
                kept[name] = tuple(float(x) for x in np.atleast_1d(row))
            except (TypeError, ValueError):
                kept[name] = (-1.0,)
            if not 0 < len(kept[name]) == count or not all(0.0 <= x < np.inf for x in kept[name]):
                raise ParameterError(
                    f"modes: '{name}' has {row!r}, expected {max(count, 1)} numbers of at least 0"
                )
        W = np.array(list(kept.values()))
        if np.linalg.matrix_rank(W) < count:
            raise ParameterError(
                f"modes: of {count} modes of {len(kept)} muscles some are combinations of others"
            )
        object.__setattr__(self, "modes", kept)

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
            A muscle has no modes, or modes are those of no muscle.
        """
        names = model.muscles.names
        if set(names) != set(self.modes):
            differ = sorted(set(names) ^ set(self.modes))
            raise ParameterError(
                f"modes are to be given of every muscle: {', '.join(differ)} are either no muscles "
                "or have no modes"
            )
        W = np.array(
            [self.modes[name] for name in names] + [[0.0] * self.count] * len(model.reserves)
        )
        W /= np.linalg.norm(W, axis=0)
        return partial(SynergyProblem, W=W, weight=self.weight)

    @property
    def count(self) -> int:
        """Number of modes."""
        return len(next(iter(self.modes.values())))
