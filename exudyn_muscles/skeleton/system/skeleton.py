"""The skeleton in general: any assembled Exudyn system, and what is tracked of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import exudyn as exu
import numpy as np

from ...errors import ModelError, ParameterError
from ...forces.actuator_table import ActuatorTable
from ...path.paths import Paths
from ..ahead import Rule
from ..base import ExudynSkeleton
from ..geometry import Geometry, Mounted
from ..hold import Hold, hold
from ..opened import Dynamics, agree
from ..reading import check_assembled, original, raise_as_itself
from ..segments import Segments
from ..shown import OwnGraphics
from .coordinates import Tracked
from .frame_list import FrameList
from .geometry import GeometryOnAll, Pose, compile_loads, torques_by
from .load_object import force_object
from .names import system_names
from .opened import OpenedSystem
from .recorded import recorded
from .shown import frames_shown, system_graphics, system_segments
from .tracked_rows import tracked_rows


class GeneralSkeleton(ExudynSkeleton):
    """An assembled Exudyn system of bodies, joints and whatever else it has.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    tracked : mapping
        Name -> ObjectIndex of a joint with one free axis, or another kind of `Tracked`.

    Attributes
    ----------
    coordinates : tuple of str
        Names of the n tracked coordinates z.
    units : tuple of str
        rad or m.
    rows, free : slice
        All N coordinates x of the system.

    Raises
    ------
    ModelError
        The system is not assembled, or has nothing that moves.
    ParameterError
        A tracked coordinate is none; names it.
    """

    def __init__(
        self, mbs: exu.MainSystem, tracked: Mapping[str, Tracked | exu.ObjectIndex]
    ) -> None:
        super().__init__(mbs)
        self.check_assembled()
        if not tracked or not all(isinstance(name, str) for name in tracked):
            raise ParameterError(
                "the skeleton needs at least one tracked coordinate, each with a text as its name; "
                f"got {list(tracked)}"
            )
        self._frames = FrameList(mbs)
        self._forces = force_object(mbs)
        self.tracked = dict(tracked)
        self._tracked = tracked_rows(mbs, self._frames, tracked)
        self.coordinates = self.tree_coordinates = tuple(tracked)
        self.units = self._tracked.units
        self.system_names = system_names(mbs)
        self._size = mbs.systemData.ODE2Size()
        self.rows = self.free = slice(0, self._size)
        self._opened: OpenedSystem | None = None

    @property
    def known_to_exudyn(self) -> bool:
        return True

    @property
    def width(self) -> int:
        return self._size

    def check_assembled(self) -> None:
        check_assembled(self.mbs)

    def frame_number(self, what: str, link: int) -> int:
        return self._frames.number(what, link)

    def mount(self, paths: Paths, muscles: Sequence[str], actuators: ActuatorTable) -> Mounted:
        loads, m = compile_loads(paths, muscles, actuators), len(muscles)

        def geometry(q: np.ndarray, v: np.ndarray, *there: Any) -> Geometry:
            pose, B, _ = there or self._place_at(q, v)[2:]
            return GeometryOnAll(*loads(pose), B)

        return Mounted(geometry, lambda pose: loads(pose)[2][m:].T, torques_by(loads), loads)

    @property
    def others(self) -> int:
        with self.apart(None) as system:
            return system.passive

    def state_of_tree(self, *state: np.ndarray) -> tuple[np.ndarray, ...]:
        return state

    def frames_shown(self, near: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return frames_shown(self.mbs, self._frames, self._tracked, near)

    def own_graphics(self) -> OwnGraphics:
        return system_graphics(self.mbs)

    def segments(self) -> Segments:
        return system_segments(self.mbs)

    # The initial state.

    def initial_state(self) -> tuple[np.ndarray, np.ndarray]:
        with self.apart(None) as system:
            pose = system.pose()
            return pose.z, pose.T @ pose.x_t

    def set_initial_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Set the system's initial state to the nearest one with coordinates and speeds (n,) that
        meets the constraints."""
        with self.apart(q) as system:
            system.go_to(q, v, self.mbs.systemData.GetTime())
            x, x_t = (array.copy() for array in system.state.current[:2])
        self.set_initial_arrays(x, x_t)

    @contextmanager
    def apart(self, near: np.ndarray | None) -> Iterator[OpenedSystem]:
        """The system at its initial state, without a hold on it; its current state stays."""
        before = self.snapshot()
        try:
            yield self._system(near)
        finally:
            self.restore(before)

    def _system(self, near: np.ndarray | None) -> OpenedSystem:
        system = OpenedSystem(
            self.mbs, self._frames, self._tracked, self.coordinates, self._forces, near
        )
        system.check()
        return system

    # Opening.

    @contextmanager
    def opened(self, near: np.ndarray | None = None) -> Iterator[GeneralSkeleton]:
        with hold(self.mbs) as held:
            held.keep(partial(self.restore, self.snapshot()))
            self.open(held, near)
            yield self

    def open(self, held: Hold, near: np.ndarray | None = None) -> None:
        self.check_assembled()
        if self.mbs.systemData.ODE2Size() != self._size:
            raise ModelError(
                f"the mbs had {self._size} coordinates when the model was built and has "
                f"{self.mbs.systemData.ODE2Size()} now; build the MusculoskeletalModel anew"
            )
        try:
            self._opened = self._system(near)
            held.keep(self._opened.leave)
            self._opened.contacts.begin(held)
        except exu.ExudynError as error:
            raise_as_itself(original(error), error)

    @property
    def now(self) -> OpenedSystem:
        """The opened system; ModelError before."""
        if self._opened is None:
            raise ModelError("the skeleton is not open yet: evaluate it within skeleton.opened()")
        return self._opened

    # The current state.

    @property
    def q(self) -> np.ndarray:
        return self.now.pose().z

    @property
    def v(self) -> np.ndarray:
        return self.now.pose().T @ self.now.state.v

    @property
    def acceleration(self) -> np.ndarray:
        pose = self.now.pose()
        return pose.T @ self.now.state.a + self.now.rate(pose)

    @property
    def start(self) -> tuple[np.ndarray, ...]:
        state = self.now.state
        before = state.snapshot()
        try:
            for array, values in zip(state.current, state.at_start, strict=True):
                array[:] = values
            return self.q, self.v, self.acceleration
        finally:
            state.restore(before)
            self.now.pose()

    @property
    def x(self) -> np.ndarray:
        return self.now.state.q.copy()

    @property
    def x_t(self) -> np.ndarray:
        return self.now.state.v.copy()

    @property
    def drift(self) -> float:
        return float(np.abs(self.now.equations(velocity=False)).max(initial=0.0))

    def project(self, by_rule: bool) -> bool:
        # The rule that Exudyn applies to x is exact to another order on what x is constrained to:
        # left as it is, z would not be the integral of its rate there.
        now, data = self.now, self.mbs.systemData
        if not now.constrained:
            return False
        t, q, v = data.GetTime(), self.q, self.v
        if by_rule:
            h = t - data.GetTime(exu.ConfigurationType.StartOfStep)
            q_0, v_0, a_0 = self.start
            now.state.a[:] = now.accelerations(now.load)
            v = v_0 + 0.5 * h * (a_0 + self.acceleration)
            q = q_0 + 0.5 * h * (v_0 + v)
        now.go_to(q, v, t)
        now.state.a[:] = now.accelerations(now.load)
        return True

    @property
    def place(self) -> tuple:
        return self.now.place

    def _place_at(self, q: np.ndarray, v: np.ndarray) -> tuple:
        with self.apart(q) as system:
            system.go_to(q, v, self.mbs.systemData.GetTime())
            return system.dynamics().place

    def along(self, q: np.ndarray) -> Iterator[tuple]:
        with self.apart(q[0]) as system:
            for pose in system.rest_along(q):
                yield (pose,)

    def places_of(
        self, q: np.ndarray, v: np.ndarray, x: np.ndarray, x_t: np.ndarray, t: np.ndarray
    ) -> Iterator[tuple]:
        with self.apart(q[0]) as system:
            for _ in recorded(self.mbs, system.state, x, x_t, t):
                yield system.dynamics().place

    def pose(self) -> Pose:
        """The current one."""
        return self.now.pose()

    def dynamics(self) -> Dynamics:
        return self.now.dynamics()

    def dynamics_held(self) -> Dynamics:
        return self.now.dynamics_held()

    def _dynamics_there(
        self, q: np.ndarray, v: np.ndarray, t: float, ahead: Rule | None
    ) -> Dynamics:
        now = self.now
        before = now.state.snapshot()
        try:
            if ahead is not None:
                return now.dynamics_ahead(q, v, t, ahead, before[1])
            now.go_to(q, v, t)
            return self.dynamics()
        finally:
            now.state.restore(before)
            if ahead is not None:
                now.contacts.settle_at_start()
            now.pose()

    def go_to(self, q: np.ndarray, v: np.ndarray, t: float) -> None:
        self.now.go_to(q, v, t)
        self.now.contacts.settle()

    # In a run.

    def begin(self, load: np.ndarray) -> None:
        self.now.state.a[:] = self.now.accelerations(load)
        self.now.apply(load)

    def settle(self, newmark: bool) -> None:
        needed = self.now.state.a
        found = needed.copy()
        needed[:] = self.now.accelerations(self.now.load)
        if not (newmark or agree(found, needed)):
            raise ParameterError(
                "generalized alpha starts from initial accelerations of its own, which do not "
                "balance the initial loads here; use TrapezoidalIndex2 or "
                "generalizedAlpha.computeInitialAccelerations = True"
            )

    def ideal_load(self, there: Dynamics, torque: np.ndarray) -> np.ndarray:
        return torque @ there.place[2].T

    def apply(self, load: np.ndarray | None, here: Dynamics | None = None) -> None:
        if load is not None:
            self.now.apply(load)

    @property
    def memory(self) -> tuple[np.ndarray, ...]:
        return self.now.load.copy(), self.now.turns.copy()

    def recall(self, memory: tuple[np.ndarray, ...]) -> None:
        load, turns = memory
        self.now.apply(load)
        self.now.turns[:] = turns
        self.now.contacts.settle_general()

    def applied(self, place: tuple) -> np.ndarray:
        return self.now.load @ place[3]

    def imbalance(self, there: Dynamics, a: np.ndarray, torque: np.ndarray) -> np.ndarray:
        return -torque  # the rest is in Exudyn's own matrix

    def rows_of_law(
        self,
        exact: np.ndarray,
        here: Dynamics,
        mass: float,
        kp: float | np.ndarray,
        kv: float | np.ndarray,
    ) -> np.ndarray:
        # By (15) the torques follow z by -(kp dq + kv dv) M_z, and make up for what H - Q changes.
        _, _, pose, B, momenta = here.place
        rows, n = exact.copy(), self._size
        follows = B.T @ exact[:, :n] - mass * momenta.T + (here.M * (kp + kv)) @ pose.T
        rows[:, :n] -= pose.T.T @ follows
        return rows

    def rows_of_slopes(
        self, exact: np.ndarray, here: Dynamics, mass: float, slopes: np.ndarray
    ) -> np.ndarray:
        T, rows = here.place[2].T, exact.copy()
        rows[:, self.free] -= T.T @ slopes @ T
        return rows
