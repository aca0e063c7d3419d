"""A tree that is open for evaluations: views of its state, M and H - Q of all its coordinates.

A second solver object assembles them from the whole system, so that springs, loads, user functions
and contacts are all part of Q. It reads and leaves the system's current state as it finds it.
"""

from __future__ import annotations

from typing import NamedTuple, NoReturn

import exudyn as exu
import numpy as np

from ..errors import ModelError

COORDINATES = ("ODE2Coords", "ODE2Coords_t", "ODE2Coords_tt")


class Dynamics(NamedTuple):
    """The equations of motion M z'' + (H - Q) = Q_m of n coordinates z at a state.

    `M` (n, n), `bias` H - Q (n,); `place` is what `MusculoskeletalModel.geometry` takes there.
    """

    M: np.ndarray
    bias: np.ndarray
    place: tuple


def hermite(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights (k, 4) of q_0, h q_0', q_1, h q_1' in q and h q' of a cubic, at parts (k,) of h."""
    value = [(1.0 + 2.0 * s) * (1.0 - s) ** 2, s * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s)]
    slope = [6.0 * s * (s - 1.0), (1.0 - s) * (1.0 - 3.0 * s), 6.0 * s * (1.0 - s)]
    return (
        np.column_stack([*value, s * s * (s - 1.0)]),
        np.column_stack([*slope, s * (3.0 * s - 2.0)]),
    )


class State:
    """Views of Exudyn's arrays, which dangle once the system has grown.

    Attributes
    ----------
    current, at_start : tuple of three ndarray
        The whole system's coordinates, speeds and accelerations, and those at the step's start.
    q, v, a : (N,) ndarray
        The tree's part of the current ones.
    start : tuple of three (N,) ndarray
        Its part of those at the start of the step.
    """

    def __init__(self, mbs: exu.MainSystem, rows: slice) -> None:
        self._data = mbs.systemData
        self.current, self.at_start = (
            tuple(
                self._data.GetSystemStateDict(configuration=kind, reference=True)[name]
                for name in COORDINATES
            )
            for kind in (exu.ConfigurationType.Current, exu.ConfigurationType.StartOfStep)
        )
        self.q, self.v, self.a = (array[rows] for array in self.current)
        self.start = tuple(array[rows] for array in self.at_start)

    def snapshot(self) -> tuple[list[np.ndarray], float]:
        """The system's current coordinates, speeds, accelerations and time."""
        return [array.copy() for array in self.current], self._data.GetTime()

    def restore(self, snapshot: tuple[list[np.ndarray], float]) -> None:
        """Put a snapshot back."""
        arrays, time = snapshot
        for array, values in zip(self.current, arrays, strict=True):
            array[:] = values
        self._data.SetTime(time)

    def go_on_until(self, t: float) -> None:
        """Put all bodies where their state at the start of the step leads with constant
        acceleration, which is of second order."""
        h = t - self._data.GetTime(exu.ConfigurationType.StartOfStep)
        q_0, v_0, a_0 = self.at_start
        self.current[0][:] = q_0 + h * v_0 + 0.5 * h * h * a_0
        self.current[1][:] = v_0 + h * a_0

    def go_back_to(self, t: float) -> None:
        """Put all bodies where the cubic through the start of the step and the current state has
        them at a time within the step."""
        t_0 = self._data.GetTime(exu.ConfigurationType.StartOfStep)
        h = self._data.GetTime() - t_0
        value, slope = hermite(np.array([(t - t_0) / h]))
        (q_0, v_0, _), (q_1, v_1, _) = self.at_start, self.current
        ends = np.array([q_0, h * v_0, q_1, h * v_1])
        q_1[:], v_1[:] = value[0] @ ends, slope[0] @ ends / h


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

    Attributes
    ----------
    rows : slice
    state : State
    """

    def __init__(self, mbs: exu.MainSystem, tree: int, rows: slice, known_to_exudyn: bool) -> None:
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
        self._set = mbs.SetObjectParameter
        torque = mbs.GetObjectParameter(tree, "jointForceVector")
        self._user_torque = np.zeros(self.state.q.size) + (torque if np.size(torque) else 0.0)
        self._total = self._user_torque.copy()

    def leave(self) -> None:
        """Give the tree back with the user's own joint torques alone."""
        self._total[:] = self._user_torque
        self._set(self._tree, "jointForceVector", self._total)

    def apply(self, torque: np.ndarray) -> None:
        """Set torques (N,) on top of the user's own `jointForceVector`."""
        np.add(self._user_torque, torque, out=self._total)
        self._set(self._tree, "jointForceVector", self._total)

    @property
    def applied(self) -> np.ndarray:
        """The torques (N,) that Exudyn has now, without the user's own."""
        return self._total - self._user_torque

    def dynamics(self) -> tuple[np.ndarray, np.ndarray]:
        """M (N, N) and H - Q (N,), without `apply`'s torques, at the system's current state."""
        solver, mbs = self._solver, self._mbs
        solver.ComputeMassMatrix(mbs)
        solver.ComputeODE2RHS(mbs)
        M = solver.GetSystemMassMatrix()[self.rows, self.rows]
        return M, self._total - self._user_torque - solver.GetSystemResidual()[self.rows]

    def accelerate_others(self) -> None:
        """Set the accelerations of the bodies outside the tree at the last `dynamics`."""
        accelerations = self.state.current[2]
        rest = np.delete(np.arange(accelerations.size), self.rows)
        if rest.size:
            M = self._solver.GetSystemMassMatrix()[np.ix_(rest, rest)]
            accelerations[rest] = np.linalg.solve(M, self._solver.GetSystemResidual()[rest])
