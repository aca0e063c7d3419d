"""The implicit trapezoidal rule, as the paper's ode23t.

    x_1 = x_0 + h/2 (f(x_0) + f(x_1)),    x = l_t,

one scalar equation for every muscle, since activation does not depend on force. Two uses:
`window_step` is one of as many steps as a window's tolerance asks for, with an activation far more
exact than that; `step` takes one step for a and l_t together, as a monolithic integrator of
skeleton and muscles does.
"""

from __future__ import annotations

import math

import numpy as np

from ..numerics.kernel import kernel
from .activation import trapezoidal
from .contraction import at_stop, pull, stopped_rate, tendon, tendon_rate
from .course import LEAST_STIFFNESS
from .parameters import ACTIVATION, F_0, L_TS, PER_STRETCH, RIGID, SWITCH, TAU_A, TAU_D
from .rosenbrock import activation_end

NEWTON = 12  # iterations of one step; two or three are usual
CONVERGED = 1e-10  # last Newton correction over the tendon's stretch at F0: the next is its square
LARGEST = 0.5  # Newton correction over that stretch

# Part of the tolerance that one time constant's steps may use up together; set so that the force at
# the end of the window meets the tolerance in 99 % of the whole box of states that
# tests/muscle/test_window.py draws from.
SHARE = 0.35
# Longest step [s], a twentieth of the usual activation time constant: a longer one may straddle a
# change that the error estimate, made from the slopes at its ends, does not see.
LONGEST = 8e-4


@kernel
def implicit_step(tables, i, l_t, rate, a_1, l_1, v_1, h, guess):
    """Solve one step from `l_t` with the slope `rate`.

    Returns (converged, l_t, whether the fibre is at its stop, the rate and its derivatives to a,
    l_t and l).
    """
    stretch = 1.0 / tables.table[i, PER_STRETCH]
    stop = at_stop(tables, i, math.inf, l_1)
    x = min(guess, stop)
    r, r_a, r_t, r_l = 0.0, 0.0, 0.0, 0.0
    for _ in range(NEWTON):
        r, r_a, r_t, r_l, _ = tendon_rate(tables, i, a_1, x, l_1, v_1)
        rest = l_t + 0.5 * h * (rate + r) - x
        if x == stop and rest >= 0.0:
            return True, x, True, v_1, 0.0, 0.0, 0.0
        gradient = 1.0 - 0.5 * h * r_t
        if not gradient > 0.0:  # only at the stop may the solution still be
            if x == stop:
                break
            x = stop
            continue
        correction = min(max(rest / gradient, -LARGEST * stretch), LARGEST * stretch)
        x += correction
        if abs(correction) < CONVERGED * stretch:
            return True, x, False, r + r_t * correction, r_a, r_t, r_l
        x = min(x, stop)
    return False, x, False, r, r_a, r_t, r_l


@kernel(inline=True)
def first_step(tables, i, start, second, h, tolerance):
    """The first step wanted of a window `h`, with l_t'' at its start."""
    _, _, _, r_t, _, f_t = start
    F0 = tables.table[i, F_0]
    least = LEAST_STIFFNESS * F0 * tables.table[i, PER_STRETCH]
    third = max(F0 * f_t, least) * abs(second) * (abs(r_t) + 1.0 / h)
    return min(h, np.cbrt(12.0 * (SHARE * tolerance * F0) / (third + 1e-300)))


@kernel(inline=True)
def window_step(tables, i, a, u, l_t, start, second, h_p, l, v, h_n, h, tolerance):
    """One step of a window `h` from the rate `start`, as `stopped_rate` has it, to `l`, `v`.

    `second` is l_t'' before it: at the window's start, or the mean over the step `h_p` that came
    before. Returns a, l_t, the rate there, the error, infinite if the step failed, and what of it
    is allowed [N].
    """
    _, r, _, _, _, f_t = start
    F0 = tables.table[i, F_0]
    least = LEAST_STIFFNESS * F0 * tables.table[i, PER_STRETCH]
    a_1, error_a = activation_end(tables, i, a, u, h_n)
    guess = l_t + h_n * (r + 0.5 * h_n * second)
    converged, l_t1, stopped, q, q_a, q_t, q_l = implicit_step(
        tables, i, l_t, r, a_1, l, v, h_n, guess
    )
    f_t1 = 0.0 if tables.table[i, RIGID] else tendon(tables, i, l_t1)[1]
    # Local error h^3 x'''/12, x''' from divided differences of the slopes; the factor
    # (1 - h/2 df/dx)^-1 keeps fast components from being overrated.
    third = 2.0 * ((q - r) / h_n - second) / (h_n + h_p)
    error = abs(third) * h_n * h_n * h_n / 12.0 / (1.0 + 0.5 * h_n * abs(q_t))
    error = max(F0 * error_a, max(F0 * f_t, F0 * f_t1, least) * error)
    if stopped:  # its length is known
        error = F0 * error_a
    if not converged:
        error = math.inf
    # Errors older than the time constant 1/|df/dx| have decayed by the window's end, so that
    # one time constant's (or the window's) steps share the tolerance.
    allowed = SHARE * tolerance * F0 * min(h_n * max(abs(q_t), 1.0 / h), 1.0)
    return a_1, l_t1, (stopped, q, q_a, q_t, q_l, f_t1), error, allowed


@kernel(inline=True)
def step_factor(error, allowed):
    """What the step is to be multiplied by, after one with this error."""
    if error <= allowed:
        return min(0.85 * np.cbrt(allowed / (error + 1e-300)), 4.0)
    if error < 1e6 * allowed:
        return max(0.8 * np.cbrt(allowed / error), 0.1)
    return 0.25


@kernel
def step(tables, i, a_0, l_t, u, l_0, v_0, l_1, v_1, h):
    """One step of a and l_t.

    Returns (converged, a, l_t, F, dF/dl_1, dF/dl_1'), the last three zero if the tendon is slack.
    """
    a_1, rate, guess = begun_step(tables, i, a_0, l_t, u, l_0, v_0, h)
    return ended_step(tables, i, l_t, a_1, rate, guess, l_1, v_1, h)


@kernel(inline=True)
def begun_step(tables, i, a_0, l_t, u, l_0, v_0, h):
    """What of a `step` does not depend on where it ends: (a there, l_t' here, a guess of l_t)."""
    a_1 = trapezoidal(
        tables.table[i, ACTIVATION],
        a_0,
        u,
        tables.table[i, TAU_A],
        tables.table[i, TAU_D],
        tables.table[i, SWITCH],
        h,
    )
    _, r, _, r_t, _, _ = stopped_rate(tables, i, a_0, l_t, l_0, v_0)
    return a_1, r, l_t + h * r / (1.0 - min(h * r_t, 0.0))


@kernel(inline=True)
def ended_step(tables, i, l_t, a_1, rate, guess, l_1, v_1, h):
    """The rest of it."""
    converged, l_t1, stopped, _, _, r_t, r_l = implicit_step(
        tables, i, l_t, rate, a_1, l_1, v_1, h, guess
    )
    if not converged:
        converged, l_t1, r_t, r_l = bisect_step(tables, i, l_t, rate, a_1, l_1, v_1, h)
    F, _, F_t, F_l, F_v = pull(tables, i, a_1, l_t1, l_1, v_1)
    if stopped:
        F_l = F_t
    elif not tables.table[i, RIGID]:
        gain = 0.5 * h / (1.0 - 0.5 * h * r_t)
        F_l, F_v = F_t * gain * r_l, F_t * gain
    return converged, a_1, l_t1, F, F_l, F_v


@kernel
def bisect_step(tables, i, l_t, rate, a_1, l_1, v_1, h):
    """The same equation as `implicit_step` by bisection, for steps that are long for the muscle."""
    least = 0.5 * tables.table[i, L_TS]
    low, high = least, max(at_stop(tables, i, math.inf, l_1), least)
    r_t, r_l = 0.0, 0.0
    for _ in range(60):
        x = 0.5 * (low + high)
        r, _, r_t, r_l, _ = tendon_rate(tables, i, a_1, x, l_1, v_1)
        if l_t + 0.5 * h * (rate + r) > x:
            low = x
        else:
            high = x
    return low > least, x, r_t, r_l
