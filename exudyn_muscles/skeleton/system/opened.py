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

from collections.abc import Iterator

import exudyn as exu
import numpy as np

from ...errors import ModelError, SimulationError
from ..ahead import TRAPEZOIDAL, Rule
from ..constrained import ConstrainedEquations, Factors, inverse, short_time
from ..contacts import Contacts
from ..opened import Dynamics
from ..state import State
from .frame_list import FrameList, read_marker
from .frames import Frames
from .geometry import Pose
from .measuring import measure_pose, rate_along
from .poses import Poses
from .singular import check_mobility, explain_singular
from .tracked_rows import TrackedRows


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
    turns : (n,) ndarray
        Coordinates of the last pose, from which angles are counted.
    passive : int
        Number of directions in which it moves besides.
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
        self.turns = np.zeros(len(names)) if near is None else np.array(near, dtype=float)
        self._object, self._order = forces
        self._load = np.zeros(n)
        self._last: list = []  # x, x', t of the last `dynamics`, and its place
        self.turns[:] = self.pose().z
        self.passive = self._directions() - len(names)
        self._poses = Poses(
            self._equations, self._factors, self.state, self._pose, names, self.passive > 0
        )

    # Kinematics.

    def pose(self) -> Pose:
        """At the current state, angles near those of the last pose."""
        pose = self._pose(self.turns)
        self.turns[:] = pose.z
        return pose

    def _pose(self, near: np.ndarray) -> Pose:
        x, tables, n = self.state.q, self._tables, len(self._names)
        R, p, J = self._R.copy(), self._p.copy(), np.empty((tables.indices.size, 6))
        for k, marker, turns in self._markers:
            own = J[tables.starts[k] : tables.starts[k + 1]]
            p[k] = read_marker(self._mbs, marker, own, R[k] if turns else None)
        z, T = np.empty(n), np.empty((n, x.size))
        measure_pose(self._tracked.table, *tables, x, near, R, p, J, z, T)
        for k, function in self._tracked.functions.items():
            z[k], T[k] = function.value(self._mbs), function.rate(self._mbs)
        return Pose(x.copy(), self.state.v.copy(), tables, Frames(R, p, J), z, T)

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
        return self._equations.lacking_now(velocity)

    def _solved(self, K: np.ndarray, right: np.ndarray) -> np.ndarray:
        """x'' parts (N, k) of the solutions for right-hand sides (N + c, k)."""
        return self._factors(K).solve(right)[: self.state.q.size]

    def _factors(self, K: np.ndarray) -> Factors:
        found = Factors.of(K)
        if found is None:
            explain_singular(self._mbs, K, self.state.q.size)
            raise SimulationError(f"the equations of motion are singular at q = {self.pose().z}")
        return found

    def _acting(self) -> np.ndarray:
        """Q - H (N,) without the muscles' load, where the equations are free."""
        return self._equations.forces() - self._load

    def dynamics(self) -> Dynamics:
        """M_z and H_z - Q_z at the current state."""
        with self._equations.free():
            acting = self._acting()
        there = self._responding(self._equations.matrix(), acting)
        self._last[:] = *self._now(), there.place
        return there

    @property
    def place(self) -> tuple:
        """What geometry is computed from at the current state, and the directions B there."""
        if self._last and all(map(np.array_equal, self._now(), self._last)):
            return self._last[-1]  # of an accepted step, where the last iterate was
        return self.dynamics().place

    def _now(self) -> tuple:
        return self.state.q.copy(), self.state.v.copy(), self._data.GetTime()

    def dynamics_ahead(
        self, q: np.ndarray, v: np.ndarray, t: float, rule: Rule, step_end: float
    ) -> Dynamics:
        """M_z and H_z - Q_z where the state at the start of the step, which ends at `step_end`,
        leads and z, z' are `q`, `v`.

        What is passive responds as in a step of the rule, in which M has the slopes of forces with
        it. At once it would respond by its mass alone: muscles would be asked to drive flexible
        modes at their own frequencies, which forces that are held over the step cannot, and which
        between two points of a body would be unstable even if they could.
        """
        if not self.passive:
            self.go_to(q, v, t)
            self.contacts.settle_ahead(step_end)
            return self.dynamics()
        h = t - self._data.GetTime(exu.ConfigurationType.StartOfStep)
        acting, x_tt = self._go_ahead(h, t, rule, step_end)
        self.go_to(q, v, t)
        self.contacts.settle_ahead(step_end)
        K, n = self._stiff(h, rule), x_tt.size
        if rule is not TRAPEZOIDAL:  # which takes Exudyn's own step; others take what is there
            with self._equations.free():
                acting = self._acting() + (K - self._equations.matrix())[:n, :n] @ x_tt
        return self._responding(K, acting)

    def dynamics_held(self) -> Dynamics:
        """M_z and H_z - Q_z at the current state where passive directions are held, as `go_to`
        takes them from pose to pose."""
        pose, n = self.pose(), self.state.q.size
        M = self._equations.matrix()[:n, :n]
        with self._equations.free():
            acting, demanded = self._acting(), self._equations.demanded()
        heading = self._poses.heading(pose.T)
        B, c = heading.B, heading.towards(pose.T, -demanded, -self.rate(pose))
        return _at(pose, B.T @ M @ B, B.T @ (M @ c - acting), B, M @ B)

    def _responding(self, K: np.ndarray, acting: np.ndarray) -> Dynamics:
        """M_z and H_z - Q_z of the equations with the matrix K and forces (N,)."""
        pose, n = self.pose(), self.state.q.size
        with self._equations.free():
            right = np.append(acting, self._equations.demanded())
        x_tt, W = self._responses(K, pose, right)
        M = inverse(pose.T @ W)
        bias = -M @ (pose.T @ x_tt + self.rate(pose))
        B = W @ M
        return _at(pose, M, bias, B, K[:n, :n] @ B)

    def _responses(
        self, K: np.ndarray, pose: Pose, right: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """x'' parts (N,) of the solution for a right-hand side (N + c,), and W (N, n)."""
        sides = np.zeros((K.shape[0], 1 + len(self._names)))
        sides[:, 0], sides[: self.state.q.size, 1:] = right, pose.T.T
        response = self._solved(K, sides)
        return response[:, 0], response[:, 1:]

    def accelerations(self, load: np.ndarray) -> np.ndarray:
        """x'' (N,) at the current state under a further load (N,)."""
        return self._under(load)[0][: load.size]

    def constraint_forces(self, load: np.ndarray) -> np.ndarray:
        """What every equation of the constraints does (c, N) to x under a further load (N,)."""
        solution, K = self._under(load)
        n = load.size
        return -solution[n:, None] * K[n:, :n]

    def _under(self, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x'' with -mu behind it (N + c,) under a further load (N,), and the equations' matrix."""
        K = self._equations.matrix()
        with self._equations.free():
            right = np.append(self._acting() + load, self._equations.demanded())
        return self._factors(K).solve(right[:, None])[:, 0], K

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

    def fastest(self) -> float:
        """With how much the system swings at most [rad/s]; see `ConstrainedEquations`."""
        return self._equations.fastest()

    @property
    def constrained(self) -> bool:
        """Whether there are constraints."""
        return self._equations.number > 0

    def _directions(self) -> int:
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
        factors = Factors.of(K)
        if factors is None or factors.may_be_singular(K):
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
        self._data.SetTime(t)
        pose = self._poses.find(q, t)
        self.turns[:] = q
        self._poses.speed(pose.T, v)

    def rest_along(self, q: np.ndarray) -> Iterator[Pose]:
        """Poses at rest at coordinates `q` (k, n) of a motion, at the current time."""
        self.state.v[:] = 0.0
        return self._poses.follow(q, self._data.GetTime())

    def _go_ahead(
        self, h: float, t: float, rule: Rule, step_end: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Put the system where the state at the start of the step leads with the load held, by one
        linearly implicit step of a rule; returns Q - H (N,) before x'' at its end comes into it,
        and this x''.

        Extrapolated, fast passive directions would leave all bounds.
        """
        state = self.state
        for array, values in zip(state.current, state.at_start, strict=True):
            array[:] = values
        K = self._stiff(h, rule)
        _, v_0, a_0 = state.at_start
        self._equations.advance(h * v_0 + rule.x_0 * h * h * a_0)
        state.v[:] = v_0 + rule.v_0 * h * a_0
        self._data.SetTime(t)
        self.contacts.settle_ahead(step_end)
        with self._equations.free():
            acting, lack = self._acting(), self._equations.lacking(velocity=True)
        right = np.append(acting + self._load, -lack / (rule.v_1 * h))
        a_1 = self._solved(K, right[:, None])[:, 0]
        self._equations.advance(rule.x_1 * h * h * a_1)
        state.v[:] += rule.v_1 * h * a_1
        return acting, a_1

    def _stiff(self, h: float, rule: Rule) -> np.ndarray:
        """[[M, G^T], [G, D]] as one step of a rule has it, x'' at its end being unknown."""
        return self._equations.matrix(-rule.x_1 * h * h, -rule.v_1 * h)

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


def _at(
    pose: Pose, M: np.ndarray, bias: np.ndarray, B: np.ndarray, momenta: np.ndarray
) -> Dynamics:
    return Dynamics(M, bias, (pose.z, pose.T @ pose.x_t, pose, B, momenta))
