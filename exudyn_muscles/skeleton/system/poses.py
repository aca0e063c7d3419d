"""Poses of a system that meet its constraints and have given values of what is tracked."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ...errors import ModelError
from ..constrained import ConstrainedEquations, Factors
from ..state import State
from .geometry import Pose
from .singular import check_mobility

CLOSE = 1e-12  # m or rad, of poses; Newton's method squares it once more
# Exudyn's Jacobian of a joint on a flexible body leaves out how its frame turns with the modes, so
# that poses there are approached by a factor in every iteration only.
CLOSE_ENOUGH, ENOUGH_ITERATIONS, MOST_ITERATIONS = 1e-8, 20, 300
FOR_LENGTHS = 1e-6  # m or rad, of poses whose lengths are compared with limits, to four digits
FARTHEST = 0.5  # rad or m, of one iteration towards a pose
SLOW = 0.1  # factor by which an iteration comes closer, above which a new matrix pays
# As poses follow each other, passive directions that swing within this time keep their place [s].
# Longer, and the gravity of what stands on its head, g / l at l = 0.1 m, would weigh against its
# mass; shorter, and the modes of a flexible body would give way.
SWING = 0.03


class Heading:
    """The way from pose to pose near one of them: steps (N,) of least M-norm, with the stiffness of
    passive directions in M.

    Parameters
    ----------
    factors : Factors
        Of [[M, G^T], [G, D]] there.
    T : (n, N) ndarray
        Rates of what is tracked there.

    Attributes
    ----------
    W : (N, n) ndarray
        Accelerations by unit forces on what is tracked.
    """

    def __init__(self, factors: Factors, T: np.ndarray) -> None:
        self._factors, self._size = factors, T.shape[1]
        right = np.zeros((factors.size, len(T)))
        right[: self._size] = T.T
        self.W = factors.solve(right)[: self._size]
        self.B = self.W @ np.linalg.inv(T @ self.W)

    def towards(self, T: np.ndarray, lack: np.ndarray, away: np.ndarray) -> np.ndarray:
        """The step that takes what is lacking off and z `away` (n,) on."""
        right = np.zeros(self._factors.size)
        right[self._size :] = -lack
        back = self._factors.solve(right)[: self._size]
        return back + self.B @ (away - T @ back)


class Poses:
    """Finds them, by Newton's method.

    Parameters
    ----------
    equations : ConstrainedEquations
    factors : callable
        Of a matrix; raises what is wrong with it.
    state : State
    pose : callable
        near (n,) -> Pose at the current state, with angles near these.
    names : sequence of str
        Of what is tracked, for messages.
    passive : bool
        Whether the system moves in other directions.
    """

    def __init__(
        self,
        equations: ConstrainedEquations,
        factors: Callable[[np.ndarray], Factors],
        state: State,
        pose: Callable[[np.ndarray], Pose],
        names: Sequence[str],
        passive: bool,
    ) -> None:
        self._equations, self._factors, self._passive = equations, factors, passive
        self._state, self._pose, self._names = state, pose, names

    def heading(self, T: np.ndarray) -> Heading:
        """At the current state."""
        stiffness = -SWING * SWING if self._passive else 0.0
        return Heading(self._factors(self._equations.matrix(stiffness)), T)

    def find(self, q: np.ndarray, t: float) -> Pose:
        """Put the system in the pose nearest to the current one that has the coordinates `q` (n,)
        and meets the constraints at the time `t`.

        Raises
        ------
        ModelError
            There is none; names the coordinate.
        """
        return self._found(q, t, None, CLOSE)[0]

    def follow(self, q: np.ndarray, t: float) -> Iterator[Pose]:
        """The poses of `find` at coordinates `q` (k, n) of a motion, which are near each other, as
        close as lengths need it.

        Raises
        ------
        ModelError
            As `find`.
        """
        heading = None
        for row in q:
            pose, heading = self._found(row, t, heading, FOR_LENGTHS)
            yield pose

    def _found(
        self, q: np.ndarray, t: float, heading: Heading | None, close: float
    ) -> tuple[Pose, Heading | None]:
        """The pose of `find`, and the way there for the next one; `heading` is one from nearby."""
        before = np.inf
        for turn in range(MOST_ITERATIONS):
            pose = self._pose(q)
            lack, away = self._equations.lacking_now(velocity=False), q - pose.z
            off = np.abs(np.concatenate((lack, away))).max()
            if off <= (close if turn < ENOUGH_ITERATIONS else CLOSE_ENOUGH):
                return pose, heading
            if heading is None or off > SLOW * before:
                heading = self.heading(pose.T)
            step, before = heading.towards(pose.T, lack, away), off
            if np.abs(step).max() <= CLOSE * max(1.0, np.abs(pose.x).max()):
                return pose, heading
            step *= min(1.0, FARTHEST / np.abs(step).max())
            self._equations.advance(step)
        check_mobility(self._names, pose.T, self.heading(pose.T).W)
        j = int(np.abs(away).argmax())
        raise ModelError(
            f"coordinate '{self._names[j]}' = {q[j]:.6g}: the constraints of the mbs leave no "
            f"pose there at t = {t:g} s; the nearest found has {pose.z[j]:.6g}"
        )

    def speed(self, T: np.ndarray, v: np.ndarray) -> None:
        """Give what is tracked the speeds `v` (n,) there."""
        lack = self._equations.lacking_now(velocity=True)
        self._state.v[:] += self.heading(T).towards(T, lack, v - T @ self._state.v)
