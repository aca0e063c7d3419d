"""The implicit trapezoidal rule, as the paper's ode23t.

    x_1 = x_0 + h/2 (f(x_0) + f(x_1)),    x = l_t,

one scalar equation for every muscle, since activation does not depend on force. Two uses:
`integrate_trapezoidal` takes as many steps as its tolerance asks for, with an activation far more
exact than that; `step` takes one step for a and l_t together, as a monolithic integrator of
skeleton and muscles does.
"""

from __future__ import annotations

import math

import numpy as np

from ..numerics.kernel import kernel
from .activation import activation_rate, trapezoidal
from .contraction import at_stop, drift, pull, stopped_rate, tendon_force, tendon_rate
from .course import (
    LEAST_STIFFNESS,
    MAX_STEPS,
    REUSE,
    SHORTEST,
    cubic,
    length_at,
    next_step,
    sensitivity,
)
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


@kernel
def integrate_trapezoidal(
    tables, i, a, l_t, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, steps
):  # fmt: skip
    """Integrate muscle `i` over a window; see `window.integrate`."""
    law, b = tables.table[i, ACTIVATION], tables.table[i, SWITCH]
    tau_a, tau_d = tables.table[i, TAU_A], tables.table[i, TAU_D]
    F0 = tables.table[i, F_0]
    least = LEAST_STIFFNESS * F0 * tables.table[i, PER_STRETCH]
    c = cubic(l_0, v_0, l_1, v_1, h)
    chosen = steps == 0
    t, n, h_n, h_p, rate_p = 0.0, 0, 0.0, 0.0, 0.0
    a_u, y_u = 0.0, 0.0
    _, r, r_a, r_t, r_l, _ = stopped_rate(tables, i, a, l_t, l_0, v_0)
    rate_a, f_a, f_u = activation_rate(law, a, u, tau_a, tau_d, b)
    F, F_a, F_t, _, _ = tendon_force(tables, i, a, l_t, l_0, v_0)
    # l_t'' at the start serves the first error estimate and the first step.
    second = r_a * rate_a + r_t * r + drift(tables, i, r_l, v_0, length_at(c, 0.0)[2])
    if chosen:
        allowed = SHARE * tolerance * F0
        third = max(F_t, least) * abs(second) * (abs(r_t) + 1.0 / h)
        h_n = min(h, np.cbrt(12.0 * allowed / (third + 1e-300)))
    for _ in range(4 * MAX_STEPS):
        if chosen:
            rest = h - t
            h_n = next_step(min(h_n, LONGEST), rest)
            end = h if h_n == rest else t + h_n
        else:
            end = mesh[n]
        h_n = end - t  # from the mesh: using it again gives the same bits
        a_1, error_a = activation_end(tables, i, a, u, h_n)
        l, v, _ = length_at(c, end)
        guess = l_t + h_n * (r + 0.5 * h_n * second)
        converged, l_t1, stopped, q, q_a, q_t, _ = implicit_step(
            tables, i, l_t, r, a_1, l, v, h_n, guess
        )
        F_1, F_a1, F_t1, _, _ = tendon_force(tables, i, a_1, l_t1, l, v)
        # Local error h^3 x'''/12, x''' from divided differences of the slopes; the factor
        # (1 - h/2 df/dx)^-1 keeps fast components from being overrated.
        if n == 0:
            third = 2.0 * ((q - r) / h_n - second) / h_n
        else:
            third = 2.0 * ((q - r) / h_n - (r - rate_p) / h_p) / (h_n + h_p)
        error = abs(third) * h_n * h_n * h_n / 12.0 / (1.0 + 0.5 * h_n * abs(q_t))
        error = max(F0 * error_a, max(F_t, F_t1, least) * error)
        if stopped:  # its length is known
            error = F0 * error_a
        # Errors older than the time constant 1/|df/dx| have decayed by the window's end, so that
        # one time constant's (or the window's) steps share the tolerance.
        allowed = SHARE * tolerance * F0 * min(h_n * max(abs(q_t), 1.0 / h), 1.0)
        if chosen:
            if not converged or not error <= allowed:
                shrink = 0.25
                if converged and error < 1e6 * allowed:
                    shrink = max(0.8 * np.cbrt(allowed / error), 0.1)
                h_n *= shrink
                if h_n < SHORTEST * h:
                    return -1, a, l_t, F, 0.0
                continue
            if n == MAX_STEPS:
                return -1, a, l_t, F, 0.0
            mesh[n] = end
        elif not converged or not error <= REUSE * allowed:
            return -1, a, l_t, F, 0.0
        _, f_a1, f_u1 = activation_rate(law, a_1, u, tau_a, tau_d, b)
        a_u1 = sensitivity(a_u, f_a, f_a1, f_u, f_u1, h_n)
        y_u = sensitivity(y_u, r_t, q_t, r_a * a_u, q_a * a_u1, h_n)
        second = (q - r) / h_n
        rate_p, h_p = r, h_n
        a, l_t, a_u, f_a, f_u = a_1, l_t1, a_u1, f_a1, f_u1
        r, r_a, r_t = q, q_a, q_t
        F, F_a, F_t, t = F_1, F_a1, F_t1, end
        n += 1
        if (chosen and end == h) or n == steps:
            return n, a, l_t, F, F_t * y_u + F_a * a_u
        if chosen:
            h_n *= min(0.85 * np.cbrt(allowed / (error + 1e-300)), 4.0)
    return -1, a, l_t, F, 0.0


@kernel
def step(tables, i, a_0, l_t, u, l_0, v_0, l_1, v_1, h):
    """One step of a and l_t.

    Returns (converged, a, l_t, F, dF/dl_1, dF/dl_1'), the last three zero if the tendon is slack.
    """
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
    guess = l_t + h * r / (1.0 - min(h * r_t, 0.0))
    converged, l_t1, stopped, _, _, r_t, r_l = implicit_step(
        tables, i, l_t, r, a_1, l_1, v_1, h, guess
    )
    if not converged:
        converged, l_t1, r_t, r_l = bisect_step(tables, i, l_t, r, a_1, l_1, v_1, h)
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
