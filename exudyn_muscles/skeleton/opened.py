"""A tree that is open for evaluations: views of its state, M and H - Q of all its coordinates.

A second solver object assembles them from the whole system, so that springs, loads, user functions
and contacts are all part of Q. It reads and leaves the system's current state as it finds it.
"""

from __future__ import annotations

from typing import NamedTuple, NoReturn

import exudyn as exu
import numpy as np

from ..errors import ModelError
from .carried import Carrier
from .constrained import ConstrainedEquations, solved
from .contacts import Contacts
from .state import State


class Dynamics(NamedTuple):
    """The equations of motion M z'' + (H - Q) = Q_m of n coordinates z at a state.

    `M` (n, n), `bias` H - Q (n,); `place` is what `MusculoskeletalModel.geometry` takes there.
    """

    M: np.ndarray
    bias: np.ndarray
    place: tuple

    def torque(self, a: np.ndarray) -> np.ndarray:
        """Q_m (n,) of accelerations z'' (n,)."""
        return self.M @ a + self.bias


class ForceSlopes(NamedTuple):
    """What forces on a tree take off (N, all) for a unit of the system's coordinates and speeds."""

    stiffness: np.ndarray
    damping: np.ndarray


class Assembled(NamedTuple):
    """M (N, N) and H - Q (N,) of all coordinates of a tree; which part of Q is carried (N,)."""

    M: np.ndarray
    bias: np.ndarray
    carried: np.ndarray | None


class NotOpen:
    """In place of an `Opened` before there is one: its state can be read, nothing evaluated."""

    def __init__(self, mbs: exu.MainSystem, rows: slice) -> None:
        self._mbs, self._rows = mbs, rows

    @property
    def state(self) -> State:
        """Views of the arrays as they are now."""
        return State(self._mbs, self._rows)

    def __getattr__(self, name: str) -> NoReturn:
        raise ModelError("the skeleton is not open yet: evaluate it within skeleton.opened()")


class Opened:
    """A tree from the opening of its skeleton on.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    tree : ObjectIndex
    rows : slice
        The tree's coordinates within the system.
    known_to_exudyn : bool
        Whether Exudyn can compute initial accelerations; of a tree with dependent coordinates M may
        be singular.
    carried : Carrier, optional
        External forces that Exudyn has not got itself.

    Attributes
    ----------
    rows : slice
    state : State
    contacts : Contacts
    total, load : (N,) ndarray
        The torques that Exudyn has now, with the user's own, and what of them is carried.
    """

    def __init__(
        self,
        mbs: exu.MainSystem,
        tree: int,
        rows: slice,
        known_to_exudyn: bool,
        carried: Carrier | None = None,
    ) -> None:
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.active = False
        integration = settings.timeIntegration
        integration.verboseMode = 0
        integration.generalizedAlpha.computeInitialAccelerations = known_to_exudyn
        self._mbs, self._tree, self.rows = mbs, tree, rows
        self._solver = exu.MainSolverImplicitSecondOrder()
        self._solver.InitializeSolver(mbs, settings)
        self.state = State(mbs, rows)
        self.contacts = Contacts(mbs, self._solver, settings, self.state)
        self._set = mbs.SetObjectParameter
        torque = mbs.GetObjectParameter(tree, "jointForceVector")
        self._user_torque = np.zeros(self.state.q.size) + (torque if np.size(torque) else 0.0)
        self.total = self._user_torque.copy()
        self._carried, self.load = carried, np.zeros(self.state.q.size)

    def leave(self) -> None:
        """Give the tree back with the user's own joint torques alone."""
        self.recall((self._user_torque, np.zeros_like(self.load)))

    def apply(self, torque: np.ndarray | None, carried: np.ndarray | None = None) -> None:
        """Set torques (N,) on top of the user's own `jointForceVector` and of what is `carried` at
        the current state, if that is known; None: the last ones stay."""
        if torque is None:
            if self._carried is None:
                return
            torque = self.applied
        np.add(self._user_torque, torque, out=self.total)
        if self._carried is not None:
            self.load[:] = self.carried_here() if carried is None else carried
            np.add(self.total, self.load, out=self.total)
        self._set(self._tree, "jointForceVector", self.total)

    @property
    def applied(self) -> np.ndarray:
        """The torques (N,) that Exudyn has now, without the user's own and what is carried."""
        return self.total - self._user_torque - self.load

    @property
    def memory(self) -> tuple[np.ndarray, np.ndarray]:
        """What Exudyn has now, and what of it is carried."""
        return self.total.copy(), self.load.copy()

    def recall(self, memory: tuple[np.ndarray, ...]) -> None:
        """Have the `memory` of another time back."""
        self.total[:], self.load[:] = memory
        self._set(self._tree, "jointForceVector", self.total)

    def check_carried(self) -> None:
        """Raise ModelError if loads whose forces are carried were changed."""
        if self._carried is not None:
            self._carried.check()

    def carried_here(self) -> np.ndarray:
        """What is carried (N,) at the current state."""
        if self._carried is None:
            return self.load
        return self._carried(self.state.q, self._mbs.systemData.GetTime())

    def dynamics(self) -> Assembled:
        """The equations without `apply`'s torques at the system's current state."""
        self._solver.ComputeMassMatrix(self._mbs)
        M = np.asarray(self._solver.GetSystemMassMatrix()[self.rows, self.rows])
        self._solver.ComputeODE2RHS(self._mbs)
        bias = self.total - self._user_torque - self._solver.GetSystemResidual()[self.rows]
        if self._carried is None:
            return Assembled(M, bias, None)
        carried = self.carried_here().copy()
        return Assembled(M, bias - carried, carried)

    def slopes(self) -> ForceSlopes:
        """Those of the forces at the current state, with torques held."""
        found = []
        for factors in ((-1.0, 0.0), (0.0, -1.0)):
            self._solver.ComputeJacobianODE2RHS(self._mbs, *factors, 0.0)
            found.append(np.array(self._solver.GetSystemJacobian())[self.rows])
        return ForceSlopes(*found)

    def accelerate_others(self) -> None:
        """Set the accelerations of the bodies outside the tree at the last `dynamics`."""
        accelerations = self.state.current[2]
        n = accelerations.size
        rest = np.delete(np.arange(n), self.rows)
        if not rest.size:
            return
        if self._mbs.systemData.AEsize() == 0:
            M = self._solver.GetSystemMassMatrix()[np.ix_(rest, rest)]
            accelerations[rest] = np.linalg.solve(M, self._solver.GetSystemResidual()[rest])
            return
        equations = ConstrainedEquations(self._mbs, self._solver, self.state)
        with equations.free():
            forces = equations.forces()[rest]
            gamma = equations.demanded()
        kept = np.r_[rest, n : n + equations.number]
        found = solved(equations.matrix()[np.ix_(kept, kept)], np.append(forces, gamma)[:, None])
        if found is None:
            raise ModelError("constraints of the mbs beside the skeleton are redundant")
        accelerations[rest] = found[: rest.size, 0]


def agree(found: np.ndarray, needed: np.ndarray) -> bool:
    """Whether accelerations that a solver starts with are those that balance the forces."""
    return bool(np.abs(found - needed).max() <= 1e-6 * np.abs(needed).max() + 1e-9)


def fastest(M: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> float:
    """With how much a system swings at most [rad/s], or half of what it settles with, for small
    motions with these matrices (n, n)."""
    pulled, damped = (
        float(np.linalg.eigvals(np.linalg.solve(M, slopes)).real.max())
        for slopes in (stiffness, damping)
    )
    return max(max(pulled, 0.0) ** 0.5, 0.5 * damped)
