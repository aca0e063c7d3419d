"""Where a step of a tree really leads.

With the excitations held the muscles are integrated over the step; at the nodes of a quadrature
their torques, M and H - Q give the accelerations q'' that the skeleton really has. The nodes of the
muscles' force are more than those of M and H - Q, which are smoother and whose values at both ends
are known.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...errors import SimulationError
from ...model import MusculoskeletalModel
from ...muscle.parameters import MuscleTables
from ...numerics.curves import PackedCurves
from ...numerics.kernel import kernel
from ...numerics.symmetric import divided, factorized
from ...skeleton.geometry import geometry_tables, tree_geometry
from ...skeleton.opened import Dynamics
from ...skeleton.skeleton import Skeleton
from ...skeleton.state import hermite
from .muscles import check_integrated, muscles_go_on
from .nodes import NODES, SMOOTH
from .step import Led, Step

# An iterate that is off by less [rad or m] keeps its excitations and is moved once more, which
# costs less than another iterate. What it leaves of the control law grows from step to step where
# muscles overshoot, until it is asked for again: chatter of this size at most.
NEAR = 5e-5
INNER = SMOOTH[1:-1]
INNER_VALUE, INNER_SLOPE = hermite(INNER)


@kernel
def tree_course(
    table, grids, bins, pieces, found, joints, parents, rotations, offsets, reference, positions,
    links, starts, bent, rules, path_grids, path_bins, path_pieces, wraps, wrap_starts, factors,
    factor_starts, integers, numbers, times, q, v, u, states, lengths, r, mesh, F, torques,
):  # fmt: skip
    """Integrate m muscles over k `times`, between whose first and last the states are q, q'
    (k - 2, N).

    `states` (2, m) holds a, l_t at the first time and receives those at the last; `lengths`
    (k, 2, m) holds l, l' at both, those between them are written, as are forces `F` (k, m) and
    between them their `torques` (k - 2, N), with `r` (m, N) and `mesh` for the work. Returns -1,
    the first muscle i that found no way, or m + i for one that could not be integrated.
    """
    tables = MuscleTables(table, PackedCurves(grids, bins, pieces), found)
    m, last = u.size, times.size - 1
    for k in range(last + 1):
        before, inner = max(k - 1, 0), 0 < k < last
        if inner:
            failed = tree_geometry(
                joints, parents, rotations, offsets, reference, positions, links, starts, bent,
                rules, path_grids, path_bins, path_pieces, wraps, wrap_starts, factors,
                factor_starts, integers, numbers, q[k - 1], v[k - 1], lengths[k, 0], lengths[k, 1],
                r,
            )  # fmt: skip
            if failed >= 0:
                return failed
        failed = muscles_go_on(
            tables, u, times[k] - times[before], states, lengths[before], lengths[k], mesh, F[k]
        )
        if failed >= 0:
            return m + failed
        if inner:
            for j in range(torques.shape[1]):
                torques[k - 1, j] = 0.0
                for i in range(m):
                    torques[k - 1, j] += r[i, j] * F[k, i]
    return -1


@kernel
def accelerations(Ms, biases, smooth, torques, M, a):
    """Write q'' (k, n) that `torques` (k, n) leave where M and H - Q are polynomials: of `Ms` and
    `biases` with the weights `smooth` (k, :), `M` (n, n) for the work. Returns whether M is
    regular everywhere."""
    for k in range(a.shape[0]):
        M[:] = 0.0
        for i in range(a.shape[1]):
            a[k, i] = torques[k, i]
            for p in range(smooth.shape[1]):
                a[k, i] -= smooth[k, p] * biases[p, i]
                for j in range(i + 1):
                    M[i, j] += smooth[k, p] * Ms[p, i, j]
        if not factorized(M):
            return False
        divided(M, a[k])
    return True


class TreeCourse:
    """The muscles and the tree of a model over steps; see `Course`."""

    passes = 2
    near = NEAR

    def __init__(self, model: MusculoskeletalModel, skeleton: Skeleton) -> None:
        tables, m = model.muscles.tables, len(model.muscles)
        # Copies, because numba takes 0.2 us longer over every array that is read-only.
        laws = (array.copy() for array in (tables.table, *tables.curves, tables.found))
        self._tables = (*laws, *geometry_tables(skeleton.tree, model.paths))
        self._arms = np.empty((m, skeleton.width))  # room for those of a node
        self._model, self._skeleton, self.size = model, skeleton, len(skeleton)

    def begin(self, t: float) -> Dynamics:
        return self._skeleton.dynamics_at(self._skeleton.q.copy(), self._skeleton.v.copy(), t)

    def fastest(self) -> float:
        return self._skeleton.fastest()

    def move(self, dq: np.ndarray, dv: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        self._skeleton.move(dq, dv)
        return dq, dv

    def is_settled(self, h: float) -> bool:
        return True

    def tracked(self, moved: np.ndarray) -> np.ndarray:
        return moved

    def moving(self, tracked: np.ndarray, here: Dynamics) -> np.ndarray:
        return tracked

    def over(self, step: Step) -> Led:
        skeleton, h, here = self._skeleton, step.window.h, step.here
        (q_0, v_0, _), q_1, v_1 = skeleton.start, skeleton.q, skeleton.v
        ends = np.array([q_0, h * v_0, q_1, h * v_1])
        inner = skeleton.dynamics_within(
            INNER_VALUE @ ends, INNER_SLOPE @ ends / h, step.end - (1.0 - INNER) * h
        )
        of_nodes = step.begun, *inner, here
        Ms, biases = np.array([x.M for x in of_nodes]), np.array([x.bias for x in of_nodes])
        torques, activation, tendon_length = self._muscles(step, h, ends)
        a = np.empty_like(torques)
        if not accelerations(Ms, biases, NODES.smooth, torques, np.empty_like(here.M), a):
            raise SimulationError(
                f"the mass matrix is singular between the states of the step to t = {step.end:g} s"
            )
        away = NODES.away(h, (q_0, v_0), (q_1, v_1), a)
        return Led(away, activation, tendon_length, here)

    def _muscles(self, step: Step, h: float, ends: np.ndarray) -> MuscleCourse:
        """With `ends` (4, n) of the cubic, q and h q' at both."""
        windows, (a, l_t, *_), u = step.window.windows, step.window.start, step.excitation
        q, v, reduced = self._skeleton.basis.along(
            NODES.value[1:-1] @ ends, NODES.slope[1:-1] @ ends / h
        )
        states, torques = np.array([a, l_t]), np.empty_like(q)
        forces, lengths = np.empty((NODES.s.size, u.size)), np.empty((NODES.s.size, 2, u.size))
        lengths[0], lengths[-1] = (known[:2] for known in step.geometry)
        failed = tree_course(
            *self._tables, h * NODES.s, q, v, u, states, lengths, self._arms, windows.scratch,
            forces, torques,
        )  # fmt: skip
        windows.tally[0] += u.size
        if failed >= 0:
            for place in zip(q, v, strict=True):
                self._model.geometry(
                    *map(self._skeleton.basis.part, place)
                )  # raises if it was that
            check_integrated(failed - u.size, step.window)
        held = step.reserves_at(NODES.s)
        if held.size:
            torques += np.matmul(self._model.columns(q), held[1:-1, :, None])[..., 0]
        of_all = np.empty((len(forces), self.size))
        of_all[1:-1] = reduced(torques)
        for k in (0, -1):
            of_all[k] = step.geometry[k].torque(forces[k], held[k])
        return MuscleCourse(of_all, *states)


class MuscleCourse(NamedTuple):
    """The torques (k, n) of muscles and ideal actuators at the nodes of a step, and a, l_t (m,) at
    its end."""

    torques: np.ndarray
    activation: np.ndarray
    tendon_length: np.ndarray
