"""The muscles over a step of the skeleton: what they really do at times within it.

From one time to the next each muscle is integrated with its excitation held, over the cubic of l
through both states there: paths may bend within a step as they like.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..model import MusculoskeletalModel
from ..muscle.contraction import pull
from ..muscle.parameters import PER_STRETCH, MuscleTables
from ..muscle.window import ROSENBROCK, check_window, integrate
from ..numerics.curves import PackedCurves
from ..numerics.kernel import kernel
from ..recruitment.windows import OpenWindow
from ..skeleton.geometry import geometry_tables, tree_geometry
from ..skeleton.skeleton import Skeleton

# Whatever integrates the windows of a run, here the L-stable integrator does, with this tolerance:
# one step of it from one time to the next mostly suffices, and takes less than the other ones.
TOLERANCE = 1e-5
ONE_STEP = 0.1  # of the tolerance: steps that are given may have ten times as much
# A path that is off its own speeds by this part of its tendon's stretch at F0, from one time to
# the next, has jumped there, as at a point that comes or goes. The tendon keeps its length, which
# is the state, and the fibre jumps, as in forward dynamics.
JUMP = 1e-3


@kernel
def muscle_course(
    table, grids, bins, pieces, joints, parents, rotations, offsets, reference, positions,
    links, starts, bent, rules, path_grids, path_bins, path_pieces, wraps, wrap_starts, factors,
    factor_starts, integers, numbers, times, q, v, u, states, lengths, r, mesh, torques,
):  # fmt: skip
    """Integrate m muscles over the states q, q' (k, N) at k `times`.

    `states` (2, m) holds a, l_t at the first time and receives those at the last; `torques` (k, N)
    are written, with `lengths` (4, m), r (m, N) and `mesh` for the work. Returns whether a path
    jumped, and -1, the first muscle i that found no way, or m + i for one that could not be
    integrated.
    """
    tables = MuscleTables(table, PackedCurves(grids, bins, pieces))
    m = u.size
    l, l_rate, jumped = lengths[2], lengths[3], False
    for k in range(times.size):
        failed = tree_geometry(
            joints, parents, rotations, offsets, reference, positions, links, starts, bent,
            rules, path_grids, path_bins, path_pieces, wraps, wrap_starts, factors, factor_starts,
            integers, numbers, q[k], v[k], l, l_rate, r,
        )  # fmt: skip
        if failed >= 0:
            return jumped, failed
        torques[k] = 0.0
        for i in range(m):
            a, l_t = states[0, i], states[1, i]
            if k == 0:
                F = pull(tables, i, a, l_t, l[i], l_rate[i])[0]
            else:
                h = times[k] - times[k - 1]
                l_0, v_0 = lengths[0, i], lengths[1, i]
                off = l[i] - l_0 - 0.5 * h * (v_0 + l_rate[i])
                if abs(off) * tables.table[i, PER_STRETCH] > JUMP:
                    l_0, jumped = l_0 + off, True
                mesh[0] = h
                n, a, l_t, F, _ = integrate(
                    ROSENBROCK, tables, i, a, l_t, u[i], l_0, v_0, l[i], l_rate[i], h,
                    ONE_STEP * TOLERANCE, mesh, 1,
                )  # fmt: skip
                if n < 0:
                    n, a, l_t, F, _ = integrate(
                        ROSENBROCK, tables, i, states[0, i], states[1, i], u[i], l_0, v_0, l[i],
                        l_rate[i], h, TOLERANCE, mesh, 0,
                    )  # fmt: skip
                if n < 0:
                    return jumped, m + i
                states[0, i], states[1, i] = a, l_t
            for j in range(torques.shape[1]):
                torques[k, j] += r[i, j] * max(F, 0.0)
            lengths[0, i], lengths[1, i] = l[i], l_rate[i]
    return jumped, -1


class Course(NamedTuple):
    """Torques (k, N) of the muscles at the times of a step, and a, l_t (m,) at the last one; it is
    smooth if no path jumped."""

    is_smooth: bool
    torques: np.ndarray
    activation: np.ndarray
    tendon_length: np.ndarray


class MuscleCourse:
    """The muscles of a model over steps of its tree."""

    def __init__(self, model: MusculoskeletalModel, skeleton: Skeleton) -> None:
        tables, m = model.muscles.tables, len(model.muscles)
        # Copies, because numba takes 0.2 us longer over every array that is read-only.
        laws = (array.copy() for array in (tables.table, *tables.curves))
        self._tables = (*laws, *geometry_tables(skeleton.tree, model.paths))
        self._model, self._part = model, skeleton.basis.part
        self._work = np.empty((4, m)), np.empty((m, skeleton.width))

    def over(
        self, window: OpenWindow, u: np.ndarray, times: np.ndarray, q: np.ndarray, v: np.ndarray
    ) -> Course:
        """The muscles from the start of a window, with excitations u (m,), over states q, q'
        (k, N) of the tree at the `times` (k,) [s] from there on.

        Raises
        ------
        WindowError
            A muscle's equations could not be integrated; names it.
        WrappingError
            A muscle finds no way over an ellipsoid.
        """
        windows, (a, l_t, l, l_rate) = window.windows, window.start
        states, torques = np.array([a, l_t]), np.empty_like(q)
        jumped, failed = muscle_course(
            *self._tables, times, q, v, u, states, *self._work, windows.scratch, torques
        )
        windows.tally[0] += u.size
        if failed >= 0:
            for place in zip(q, v, strict=True):
                self._model.geometry(*map(self._part, place))  # raises if it was that
            check_window(failed - u.size, windows.muscles, a, l_t, l, l_rate, window.h)
        return Course(not jumped, torques, *states)
