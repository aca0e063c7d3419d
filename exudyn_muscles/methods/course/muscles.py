"""The muscles from one time within a step to the next: what they really do there.

Each is integrated with its excitation held, over the cubic of l through both states there: paths
may bend within a step as they like.
"""

from __future__ import annotations

from ...muscle.contraction import pull
from ...muscle.parameters import PER_STRETCH
from ...muscle.window import ROSENBROCK, check_window, integrate
from ...numerics.kernel import kernel
from ...recruitment.windows import OpenWindow

# Whatever integrates the windows of a run, here the L-stable integrator does, with this tolerance:
# one step of it from one time to the next mostly suffices, and takes less than the other ones.
TOLERANCE = 1e-5
ONE_STEP = 0.1  # of the tolerance: steps that are given may have ten times as much
# A path that is off its own speeds by this part of its tendon's stretch at F0, from one time to
# the next, has jumped there, as at a point that comes or goes. The tendon keeps its length, which
# is the state, and the fibre jumps, as in forward dynamics.
JUMP = 1e-3


@kernel
def muscles_go_on(tables, u, h, states, before, now, mesh, F):
    """Integrate m muscles over the time `h` [s], 0 where they begin, from l, l' `before` (2, m) to
    those of `now`.

    `states` (2, m) are a, l_t, which are brought up to date, and the forces written to `F` (m,),
    with `mesh` for the work. Returns -1 or the first muscle that could not be integrated.
    """
    for i in range(u.size):
        a, l_t, l, l_rate = states[0, i], states[1, i], now[0, i], now[1, i]
        if h == 0.0:
            F[i] = max(pull(tables, i, a, l_t, l, l_rate)[0], 0.0)
        else:
            l_0, v_0 = before[0, i], before[1, i]
            off = l - l_0 - 0.5 * h * (v_0 + l_rate)
            if abs(off) * tables.table[i, PER_STRETCH] > JUMP:
                l_0 += off
            mesh[0] = h
            n, a, l_t, pulled, _ = integrate(
                ROSENBROCK, tables, i, a, l_t, u[i], l_0, v_0, l, l_rate, h, ONE_STEP * TOLERANCE,
                mesh, 1,
            )  # fmt: skip
            if n < 0:
                n, a, l_t, pulled, _ = integrate(
                    ROSENBROCK, tables, i, states[0, i], states[1, i], u[i], l_0, v_0, l, l_rate,
                    h, TOLERANCE, mesh, 0,
                )  # fmt: skip
            if n < 0:
                return i
            states[0, i], states[1, i], F[i] = a, l_t, max(pulled, 0.0)
    return -1


def check_integrated(failed: int, window: OpenWindow) -> None:
    """Raise WindowError if a muscle could not be integrated; names it."""
    check_window(failed, window.windows.muscles, *window.start, window.h)
