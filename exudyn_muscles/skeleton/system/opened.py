"""A system that is open for evaluations: equations of motion of what is tracked.

The system's `ConstrainedEquations` are solved for the forces that act and for a unit of force T^T
along each tracked z, z' = T x':

    x''_0 and W = dx''/df    M_z = (T W)^-1    B = W M_z    H_z - Q_z = -M_z (T x''_0 + T' x')

M_z z'' + H_z - Q_z = B^T f are the equations of motion of z under further forces f on x. What
nobody tracks moves as the dynamics have it: B is the system's response to z'', passive directions
with it, and without them it is the basis of what the constraints leave. Of all x'' with the same
z'' it has the least M-norm, so that poses for given z are found along it as well.
"""

from __future__ import annotations

import exudyn as exu
import numpy as np

from ...errors import ModelError, SimulationError
from ..constrained import ConstrainedEquations, short_time, solved
from ..contacts import Contacts
from ..opened import Dynamics
from ..state import State
from .frame_list import FrameList
from .frames import Frames
from .geometry import Pose
from .measuring import measure_pose, rate_along
from .singular import check_mobility, explain_singular
from .tracked_rows import TrackedRows

CLOSE = 1e-12  # m or rad, of poses; Newton's method squares it once more
# Exudyn's Jacobian of a joint on a flexible body leaves out how its frame turns with the modes, so
# that poses there are approached by a factor in every iteration only.
CLOSE_ENOUGH, ENOUGH_ITERATIONS, MOST_ITERATIONS = 1e-8, 20, 300
FARTHEST = 0.5  # rad or m, of one iteration towards a pose


class OpenedSystem:
    """A system from the opening of its skeleton on.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    frames : FrameList
    tracked : TrackedRows
    names : tuple of str
        Of the tracked coordinates, for messages.
    forces : tuple of ObjectIndex and ndarray
        As of `force_object`.
    near : (n,) array_like, optional
        Values from which the turns of angles are counted.

    Attributes
    ----------
    state : State
    contacts : Contacts
    """

    def __init__(
        self,
        mbs: exu.MainSystem,
        frames: FrameList,
        tracked: TrackedRows,
        names: tuple[str, ...],
        forces: tuple[exu.ObjectIndex, np.ndarray],
        near: np.ndarray | None,
    ) -> None:
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.active = False
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        self._mbs, self._data, self._names = mbs, mbs.systemData, names
        self._solver = exu.MainSolverImplicitSecondOrder()
        self._solver.InitializeSolver(mbs, settings)
        n = self._data.ODE2Size()
        self.state = State(mbs, slice(0, n))
        self.contacts = Contacts(mbs, self._solver, settings, self.state)
        self._equations = ConstrainedEquations(mbs, self._solver, self.state)
        self._tables, self._R, self._p = frames.tables()
        self._markers, self._tracked = frames.markers, tracked
        self._rigid = not (frames.markers or tracked.functions)  # frames are those of bodies alone
        self._turns = np.zeros(len(names))
        self._object, self._order = forces
        self._load = np.zeros(n)
        if near is not None:
            self._turns[:] = near
        self._turns[:] = self.pose().z

    # Kinematics.

    def pose(self) -> Pose:
        """At the current state, angles near those of the last pose."""
        pose = self._pose(self._turns)
        self._turns[:] = pose.z
        return pose

    def _pose(self, near: np.ndarray) -> Pose:
        x, tables, n = self.state.q, self._tables, len(self._names)
        R, p, J = self._R.copy(), self._p.copy(), np.empty((tables.indices.size, 6))
        for k, marker, turns in self._markers:
            self._read_marker(k, marker, turns, R, p, J)
        z, T = np.empty(n), np.empty((n, x.size))
        measure_pose(self._tracked.table, *tables, x, near, R, p, J, z, T)
        for k, function in self._tracked.functions.items():
            z[k], T[k] = function.value(self._mbs), function.rate(self._mbs)
        return Pose(x.copy(), self.state.v.copy(), tables, Frames(R, p, J), z, T)

    def _read_marker(
        self, k: int, marker: exu.MarkerIndex, turns: bool, R: np.ndarray, p: np.ndarray,
        J: np.ndarray,
    ) -> None:  # fmt: skip
        own = J[self._tables.starts[k] : self._tables.starts[k + 1]]
        output, item = self._mbs.GetMarkerOutput, self._mbs.ComputeItem
        p[k] = output(marker, exu.OutputVariableType.Position)
        own[:, :3] = np.asarray(item(marker, exu.ComputeItemType.PositionJacobian)).T
        own[:, 3:] = 0.0
        if turns:
            R[k] = np.reshape(output(marker, exu.OutputVariableType.RotationMatrix), (3, 3))
            own[:, 3:] = np.asarray(item(marker, exu.ComputeItemType.RotationJacobian)).T

    def rate(self, pose: Pose) -> np.ndarray:
        """T' x' (n,) there, by central differences along the motion."""
        if self._rigid:
            rate = np.empty(len(self._names))
            rate_along(
                self._tracked.table, *self._tables, self._equations.vectors, pose.x, pose.x_t,
                short_time(pose.x_t), *pose.frames, rate,
            )  # fmt: skip
            return rate
        return self._equations.derivative(lambda: self._pose(pose.z).T @ pose.x_t)

    # Dynamics.

    def equations(self, velocity: bool) -> np.ndarray:
        """What the constraints lack, at position or velocity level."""
        with self._equations.free():
            return self._equations.lacking(velocity)

    def _solved(self, K: np.ndarray, right: np.ndarray) -> np.ndarray:
        """x'' parts (N, k) of the solutions for right-hand sides (N + c, k)."""
        solution = solved(K, right)
        if solution is None:
            explain_singular(self._mbs, K, self.state.q.size)
            raise SimulationError(f"the equations of motion are singular at q = {self.pose().z}")
        return solution[: self.state.q.size]

    def _acting(self) -> np.ndarray:
        """Q - H (N,) without the muscles' load, where the equations are free."""
        return self._equations.forces() - self._load

    def dynamics(self) -> Dynamics:
        """M_z and H_z - Q_z at the current state."""
        pose, n = self.pose(), self.state.q.size
        K = self._equations.matrix()
        right = np.zeros((K.shape[0], 1 + len(self._names)))
        with self._equations.free():
            right[:n, 0], right[n:, 0] = self._acting(), self._equations.demanded()
        right[:n, 1:] = pose.T.T
        response = self._solved(K, right)
        M = _inverse(pose.T @ response[:, 1:])
        bias = -M @ (pose.T @ response[:, 0] + self.rate(pose))
        B = response[:, 1:] @ M
        return Dynamics(M, bias, (pose.z, pose.T @ pose.x_t, pose, B, K[:n, :n] @ B))

    def accelerations(self, load: np.ndarray) -> np.ndarray:
        """x'' (N,) at the current state under a further load (N,)."""
        K = self._equations.matrix()
        with self._equations.free():
            right = np.append(self._acting() + load, self._equations.demanded())
        return self._solved(K, right[:, None])[:, 0]

    def followed(self, dx: np.ndarray, dv: np.ndarray, h: float) -> np.ndarray:
        """What of changes (2, N) of x and x' the system follows in a step h [s] of the trapezoidal
        rule: speeds as the constraints allow, and both as far as its own stiffness lets it."""
        n, equations = dx.size, self._equations
        M = equations.matrix()[:n, :n]
        K = equations.matrix(-0.25 * h * h, -0.5 * h)
        right = np.zeros((K.shape[0], 2))
        right[:n] = M @ np.column_stack([dx, dv])
        right[n:, 0] = K[n:, :n] @ dx
        return self._solved(K, right).T

    @property
    def constrained(self) -> bool:
        """Whether there are constraints."""
        return self._equations.number > 0

    @property
    def directions(self) -> int:
        """In how many the constraints let the system move."""
        n = self.state.q.size
        G = self._equations.matrix()[n:, :n]
        return n - int(G.any(axis=1).sum())  # the others keep multipliers alone

    def check(self) -> None:
        """Raise ModelError if constraints are redundant, something has no mass, or a tracked
        coordinate cannot move or is the same as others."""
        K, T, n = self._equations.matrix(), self.pose().T, self.state.q.size
        if not np.isfinite(K).all():
            raise ModelError(
                "the mass matrix is not finite: check masses and inertias of the bodies"
            )
        explain_singular(self._mbs, K, n)
        right = np.zeros((K.shape[0], len(T)))
        right[:n] = T.T
        check_mobility(self._names, T, self._solved(K, right))

    # Elsewhere.

    def go_to(self, q: np.ndarray, v: np.ndarray, t: float) -> None:
        """Put the system in the pose nearest to the current one that has the coordinates `q` and
        speeds `v` (n,) and meets the constraints.

        Raises
        ------
        ModelError
            There is none; names the coordinate.
        """
        state = self.state
        self._data.SetTime(t)
        for turn in range(MOST_ITERATIONS):
            pose = self._pose(q)
            lack, away = self.equations(velocity=False), q - pose.z
            step = self._towards(pose, lack, away)
            off = max(np.abs(lack).max(initial=0.0), np.abs(away).max())
            still = np.abs(step).max() <= CLOSE * max(1.0, np.abs(pose.x).max())
            if still or off <= (CLOSE if turn < ENOUGH_ITERATIONS else CLOSE_ENOUGH):
                break
            step *= min(1.0, FARTHEST / np.abs(step).max())
            self._equations.advance(step)
        else:
            j = int(np.abs(away).argmax())
            raise ModelError(
                f"coordinate '{self._names[j]}' = {q[j]:.6g}: the constraints of the mbs leave no "
                f"pose there at t = {t:g} s; the nearest found has {pose.z[j]:.6g}"
            )
        self._turns[:] = q
        lack = self.equations(velocity=True)
        state.v[:] += self._towards(pose, lack, v - pose.T @ state.v)

    def go_ahead(self, t: float) -> None:
        """Put the system where the state at the start of the step leads with the load held.

        By one linearly implicit step of the trapezoidal rule, which is of second order and lets
        fast passive directions come to rest; extrapolated they would leave all bounds.
        """
        state = self.state
        h = t - self._data.GetTime(exu.ConfigurationType.StartOfStep)
        for array, values in zip(state.current, state.at_start, strict=True):
            array[:] = values
        K = self._equations.matrix(-0.25 * h * h, -0.5 * h)
        _, v_0, a_0 = state.at_start
        self._equations.advance(h * v_0 + 0.25 * h * h * a_0)
        state.v[:] = v_0 + 0.5 * h * a_0
        self._data.SetTime(t)
        with self._equations.free():
            right = np.append(
                self._acting() + self._load, -2.0 / h * self._equations.lacking(velocity=True)
            )
        a_1 = self._solved(K, right[:, None])[:, 0]
        self._equations.advance(0.25 * h * h * a_1)
        state.v[:] += 0.5 * h * a_1

    def _towards(self, pose: Pose, lack: np.ndarray, away: np.ndarray) -> np.ndarray:
        """The step (N,) of least M-norm that takes what is lacking off and z `away` (n,) on."""
        K, n = self._equations.matrix(), self.state.q.size
        right = np.zeros((K.shape[0], 1 + away.size))
        right[n:, 0], right[:n, 1:] = -lack, pose.T.T
        response = self._solved(K, right)
        back, W = response[:, 0], response[:, 1:]
        return back + W @ np.linalg.solve(pose.T @ W, away - pose.T @ back)

    # In a run.

    def apply(self, load: np.ndarray) -> None:
        """Set generalized forces (N,) on x."""
        self._load[:] = load
        self._mbs.SetObjectParameter(self._object, "forceVector", load[self._order])

    @property
    def load(self) -> np.ndarray:
        """The last ones."""
        return self._load

    def leave(self) -> None:
        """Give the system back without them."""
        self.apply(np.zeros(self._load.size))


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Of a symmetric matrix."""
    inverse = np.linalg.inv(matrix)
    return 0.5 * (inverse + inverse.T)
