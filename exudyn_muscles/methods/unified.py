"""The unified mode: skeleton and muscles integrated together, with given or computed excitations.

In every Newton iteration of Exudyn's solver each muscle takes one trapezoidal step from its
committed state to the iterate's l, l'; its force enters the iterate's torque. At convergence this
is the trapezoidal rule for skeleton and muscles as one system, with the muscles' unknowns
eliminated.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..errors import WindowError
from ..model import MusculoskeletalModel
from ..muscle.parameters import MuscleTables
from ..muscle.trapezoidal import begun_step, ended_step
from ..numerics.curves import PackedCurves
from ..numerics.kernel import kernel
from ..results.recorder import Window
from ..simulation.plugin import Plugin
from ..simulation.solver import request_jacobian
from ..simulation.state import HANDED_ON, RunState
from ..skeleton.geometry import Geometry, geometry_tables, tree_geometry
from ..skeleton.opened import ForceSlopes
from ..skeleton.skeleton import Skeleton
from ..skeleton.tree_rows import TreeRows

# Steps for which slopes of Exudyn's forces are kept: with more the iterations that they cost are
# dearer than they are. Where a step has more evaluations than SLOW they are found anew.
KEPT, SLOW = 10, 6


@kernel
def begin_steps(table, grids, bins, pieces, found, start, begun, h):
    """Write what of a step of all muscles is the same in every iteration as `begun` (3, m): a at
    its end, l_t' at its start, and a guess of l_t."""
    tables = MuscleTables(table, PackedCurves(grids, bins, pieces), found)
    for i in range(start.shape[1]):
        begun[0, i], begun[1, i], begun[2, i] = begun_step(
            tables, i, start[0, i], start[1, i], start[2, i], start[3, i], start[4, i], h
        )


@kernel(inline=True)
def end_steps(tables, start, begun, trial, r, torque, h):
    """One step of all muscles, from `start` to l, l' in `trial`, as `unified_step` has them; adds
    their torques. Returns the first muscle whose step failed, or -1."""
    l, l_rate = trial[2], trial[3]
    for i in range(l.size):
        converged, a, l_t, F, F_l, F_v = ended_step(
            tables, i, start[1, i], begun[0, i], begun[1, i], begun[2, i], l[i], l_rate[i], h
        )
        if not converged:
            return i
        for j in range(torque.size):
            torque[j] += r[i, j] * F
        trial[0, i], trial[1, i], trial[4, i], trial[5, i] = a, l_t, F_l, F_v
    return -1


@kernel
def steps_on_frames(table, grids, bins, pieces, found, start, begun, trial, r, torque, h):
    """`end_steps`, where l, l' and r are known already."""
    tables = MuscleTables(table, PackedCurves(grids, bins, pieces), found)
    return end_steps(tables, start, begun, trial, r, torque, h)


@kernel
def unified_step(
    table, grids, bins, pieces, found, joints, parents, rotations, offsets, reference, positions,
    links, starts, bent, rules, path_grids, path_bins, path_pieces, wraps, wrap_starts, factors,
    factor_starts, integers, numbers, start, begun, trial, r, torque, q, v, h,
):  # fmt: skip
    """One step of all muscles to the iterate q, q'.

    `start` (5, m) holds a, l_t, u, l, l', and `begun` what `begin_steps` made of it; written are
    `trial` (6, m) with a, l_t, l, l', dF/dl, dF/dl', r (m, n) and the torque (n,). Returns the
    first muscle whose step failed, or -1.
    """
    # Handed over from Python as a tuple they would take a microsecond more.
    tables = MuscleTables(table, PackedCurves(grids, bins, pieces), found)
    l, l_rate = trial[2], trial[3]
    failed = tree_geometry(
        joints, parents, rotations, offsets, reference, positions, links, starts, bent,
        rules, path_grids, path_bins, path_pieces, wraps, wrap_starts, factors, factor_starts,
        integers, numbers, q, v, l, l_rate, r,
    )  # fmt: skip
    if failed >= 0:
        return failed
    torque[:] = 0.0
    return end_steps(tables, start, begun, trial, r, torque, h)


@kernel
def subtract_slopes(r, F_l, F_v, dq, dv, columns, wanted):
    """Subtract r^T diag(dq F_l + dv F_v) r in these columns of `wanted` (n, all)."""
    for i in range(r.shape[0]):
        slope = dq * F_l[i] + dv * F_v[i]
        for j in range(r.shape[1]):
            if r[i, j] != 0.0:
                for k in range(r.shape[1]):
                    wanted[j, columns[k]] -= r[i, j] * slope * r[i, k]


class StepRoom(NamedTuple):
    """Where a step of m muscles on a tree of N coordinates is computed, as `unified_step` has it:
    `start` (5, m), `begun` (3, m), `trial` (6, m), `arms` r (m, N), `torque` (N,). N is the
    skeleton's width."""

    start: np.ndarray
    begun: np.ndarray
    trial: np.ndarray
    arms: np.ndarray
    torque: np.ndarray


Advance = Callable[[np.ndarray, float], int]


def laws_of(model: MusculoskeletalModel) -> tuple[np.ndarray, ...]:
    """The arrays that the kernels of steps take first.

    Copies, because numba takes 0.2 us longer over every array that is read-only.
    """
    tables = model.muscles.tables
    return tuple(array.copy() for array in (tables.table, *tables.curves, tables.found))


def advancing(model: MusculoskeletalModel, laws: tuple[np.ndarray, ...], room: StepRoom) -> Advance:
    """The function that advances all muscles to the current iterate by a step [s].

    With ideal actuators' forces (r,) and the step; it writes the room, its torque with theirs, and
    returns the first muscle whose step failed, or -1.
    """
    skeleton, m, torque = model.skeleton, len(model.muscles), room.torque

    if isinstance(skeleton, Skeleton):
        arguments = (*laws, *geometry_tables(skeleton.tree, model.paths), *room)

        def on_a_tree(reserve: np.ndarray, h: float) -> int:
            q, v = skeleton.tree_state()
            failed = unified_step(*arguments, q, v, h)
            if reserve.size:
                np.add(torque, model.columns(q) @ reserve, out=torque)
            return failed

        return on_a_tree

    loads_of = model.loads
    assert loads_of is not None

    def on_frames(reserve: np.ndarray, h: float) -> int:
        room.trial[2], room.trial[3], loads = loads_of(skeleton.pose())
        room.arms[:] = loads[:m]
        torque[:] = reserve @ loads[m:]
        return steps_on_frames(*laws, *room, h)

    return on_frames


@dataclass(eq=False, kw_only=True)
class UnifiedState(RunState):
    """State of a run with the muscles integrated together with the skeleton.

    Attributes
    ----------
    room : StepRoom
        Of the step being tried.
    laws : tuple of ndarray
        As of `laws_of`.
    advance : callable
        As `advancing` returns it.
    reserve : (r,) ndarray
        Committed torques of the reserves.
    ramp : tuple of two float and two (r,) ndarray
        Times and reserves where the window begins and ends.
    reserve_now : (r,) ndarray
        At the end of the step being tried.
    recorded : Window
        The one that goes on.
    begins : bool
        It has no accepted step yet.
    slopes : ForceSlopes, optional
        Those of Exudyn's forces, of a run that makes Newton's matrix.
    age : int
        Steps since they were found.
    """

    room: StepRoom
    laws: tuple[np.ndarray, ...]
    advance: Advance
    reserve: np.ndarray = field(init=False, metadata=HANDED_ON)
    ramp: tuple[float, float, np.ndarray, np.ndarray] = field(init=False, metadata=HANDED_ON)
    reserve_now: np.ndarray = field(init=False)
    recorded: Window = field(init=False, metadata=HANDED_ON)
    begins: bool = False
    slopes: ForceSlopes | None = field(default=None, metadata=HANDED_ON)
    age: int = field(default=0, metadata=HANDED_ON)


class UnifiedPlugin(Plugin):
    """One trapezoidal step of the muscles in every Newton iteration of the skeleton."""

    state: UnifiedState

    def _unified(self) -> dict[str, Any]:
        """What such a run's state begins with."""
        m, n = len(self.model.muscles), self.skeleton.width
        start, begun, trial = np.empty((5, m)), np.empty((3, m)), np.empty((6, m))
        room = StepRoom(start, begun, trial, np.empty((m, n)), np.empty(n))
        laws = laws_of(self.model)
        advance = advancing(self.model, laws, room)
        return {**self._common(), "room": room, "laws": laws, "advance": advance}

    @abstractmethod
    def start_muscles(
        self, q: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """a, l_t (m,) and reserve torques (r,) at the start; sets the state's geometry and opens
        the record."""

    @abstractmethod
    def controls(self, t_0: float, t_1: float) -> np.ndarray:
        """Excitations (m,) over the step; where a window begins, `begin_window` is called."""

    def begin_window(self, t_0: float, t_1: float, reserve: np.ndarray, window: Window) -> None:
        """A window begins at `t_0` and is to end at `t_1` with these reserves.

        They run there linearly from their committed values, as the record is read; a last step
        beyond `t_1` goes on along the same line.
        """
        state = self.state
        state.ramp = (t_0, t_1, state.reserve, reserve)
        state.recorded, state.begins = window, True

    def begin(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        state = self.state
        state.a, state.l_t, state.reserve = self.start_muscles(q, v)
        return self.model.load(state.geometry, state.a, state.l_t, state.reserve)

    def ready(self, step: float) -> None:
        """Any step will do."""

    def open_step(self, t_0: float, t_1: float) -> None:
        # Two iterations instead of six with the matrix of an earlier step; one coordinate needs
        # hardly more than two either way.
        if self.skeleton.width > 1:
            request_jacobian(self.model.mbs)
        state, u = self.state, self.controls(t_0, t_1)
        if state.alone is not None and (state.slopes is None or state.age >= KEPT):
            state.slopes, state.age = state.alone.slopes(), 0
        begun, end, first, last = state.ramp
        state.reserve_now = first
        if first.size:
            state.reserve_now = first + (t_1 - begun) / (end - begun) * (last - first)
        length, speed = state.geometry[:2]
        start = state.room.start
        np.concatenate((state.a, state.l_t, u, length, speed), out=start.reshape(-1))
        begin_steps(*state.laws, start, state.room.begun, t_1 - t_0)

    def torque(self, t: float, first: bool) -> np.ndarray:
        state, skeleton = self.state, self.skeleton
        failed = state.advance(state.reserve_now, state.step)
        if failed >= 0:
            self.model.geometry(*skeleton.place)  # raises if it was that
            raise WindowError(
                f"muscle '{self.model.muscles.names[failed]}': no step of {state.step:g} s from "
                f"activation {state.a[failed]:.4g}, tendon length {state.l_t[failed]:.5g} m"
            )
        return skeleton.reduced(state.room.torque)

    def jacobian(self, exact: np.ndarray, mass: float, dq: float, dv: float) -> np.ndarray:
        # dF/dq = -F_l r and dF/dq' = -F_v r; how r changes matters little within a step.
        room = self.state.room
        r, F_l, F_v = self.skeleton.reduced(room.arms), room.trial[4], room.trial[5]
        wanted, columns = exact.copy(), np.arange(exact.shape[1])[self.skeleton.free]
        subtract_slopes(r, F_l, F_v, dq, dv, columns, wanted)
        return wanted

    def slopes(self, tree: TreeRows) -> ForceSlopes | None:
        state = self.state
        return tree.slopes() if state.calls > SLOW else state.slopes

    def accept(self, t_0: float, t_1: float) -> tuple[np.ndarray, Window | None]:
        state, room = self.state, self.state.room
        state.age = KEPT if state.calls > SLOW else state.age + 1
        state.a, state.l_t, length, speed = room.trial[:4].copy()
        state.geometry = Geometry(length, speed, self.skeleton.reduced(room.arms).copy())
        state.reserve = state.reserve_now
        # A window is what was held over accepted steps, wherever they end.
        u = room.start[2]
        if not state.begins and u.tobytes() == state.recorded.excitation.tobytes():
            return state.reserve, None
        state.recorded, state.begins = state.recorded._replace(excitation=u.copy()), False
        return state.reserve, state.recorded
