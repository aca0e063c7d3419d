"""The L-stable integrator: RODAS, a Rosenbrock method of order 4 with an embedded one of order 3.

E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", second edition, section IV.7
(coefficients in its table 7.? as used by the code RODAS, method 1).

Activation and tendon length form a triangular system, so that every stage is one division each.
Six evaluations a step, no iteration.
"""

from __future__ import annotations

import math

from ..kernel import kernel
from .activation import activation_rate
from .contraction import at_stop, stopped_rate, tendon_force, tendon_rate
from .course import MAX_STEPS, SHORTEST, cubic, length_at, next_step, sensitivity
from .parameters import ACTIVATION, F_0, SWITCH, TAU_A, TAU_D

GAMMA = 0.25
A21 = 1.544
A31, A32 = 0.9466785280815826, 0.2557011698983284
A41, A42, A43 = 3.314825187068521, 2.896124015972201, 0.9986419139977817
A51, A52, A53, A54 = 1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950
C21 = -5.6688
C31, C32 = -2.430093356833875, -0.2063599157091915
C41, C42, C43 = -0.1073529058151375, -9.594562251023355, -20.47028614809616
C51, C52, C53, C54 = 7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160
C61, C62, C63 = 8.083246795921522, -7.981132988064893, -31.52159432874371
C64, C65 = 16.31930543123136, -6.058818238834054
# Time of the stages and their weights of the explicit time derivative.
T2, T3, T4 = 0.386, 0.21, 0.63
G1, G2, G3, G4 = 0.25, -0.1043, 0.1035, -0.0362

# Part of the tolerance that one time constant's steps may use up together; set so that the force at
# the end of the window meets the tolerance over the whole box of states that
# tests/muscle/test_window.py draws from.
SHARE = 0.6
GROWTH, SAFETY = 5.0, 0.9


@kernel(inline=True)
def activation_step(units, i, a, u, h):
    """One step of the activation: the five later stages, their six increments and its error."""
    law, b = units.table[i, ACTIVATION], units.table[i, SWITCH]
    tau_a, tau_d = units.table[i, TAU_A], units.table[i, TAU_D]
    rate, slope, _ = activation_rate(law, a, u, tau_a, tau_d, b)
    w, d = 1.0 / (1.0 / (GAMMA * h) - slope), 1.0 / h
    u_1 = w * rate
    a_2 = a + A21 * u_1
    u_2 = w * (activation_rate(law, a_2, u, tau_a, tau_d, b)[0] + d * C21 * u_1)
    a_3 = a + A31 * u_1 + A32 * u_2
    u_3 = w * (activation_rate(law, a_3, u, tau_a, tau_d, b)[0] + d * (C31 * u_1 + C32 * u_2))
    a_4 = a + A41 * u_1 + A42 * u_2 + A43 * u_3
    u_4 = w * (
        activation_rate(law, a_4, u, tau_a, tau_d, b)[0] + d * (C41 * u_1 + C42 * u_2 + C43 * u_3)
    )
    a_5 = a + A51 * u_1 + A52 * u_2 + A53 * u_3 + A54 * u_4
    u_5 = w * (
        activation_rate(law, a_5, u, tau_a, tau_d, b)[0]
        + d * (C51 * u_1 + C52 * u_2 + C53 * u_3 + C54 * u_4)
    )
    a_6 = a_5 + u_5
    u_6 = w * (
        activation_rate(law, a_6, u, tau_a, tau_d, b)[0]
        + d * (C61 * u_1 + C62 * u_2 + C63 * u_3 + C64 * u_4 + C65 * u_5)
    )
    return a_2, a_3, a_4, a_5, a_6, u_1, u_2, u_3, u_4, u_5, u_6


@kernel
def rosenbrock_step(units, i, a, u, l_t, start, c, t, h_n, h):
    """One step from `t` of a fibre that is not at its stop, with the rate there from `start`.

    Returns a, l_t and the errors of both.
    """
    _, rate, r_a, r_t, r_l = start
    a_2, a_3, a_4, a_5, a_6, u_1, u_2, u_3, u_4, u_5, u_6 = activation_step(units, i, a, u, h_n)
    _, speed, acceleration = length_at(c, t / h, h)
    w, d = 1.0 / (1.0 / (GAMMA * h_n) - r_t), 1.0 / h_n
    drift = h_n * (r_l * speed + acceleration)
    y_1 = w * (rate + r_a * u_1 + G1 * drift)

    l, v, _ = length_at(c, (t + T2 * h_n) / h, h)
    y = l_t + A21 * y_1
    beyond = y - at_stop(units, i, y, l)
    y_2 = w * (
        tendon_rate(units, i, a_2, y, l, v)[0] + r_a * u_2 + G2 * drift + d * C21 * y_1
    )
    l, v, _ = length_at(c, (t + T3 * h_n) / h, h)
    y = l_t + A31 * y_1 + A32 * y_2
    beyond = max(beyond, y - at_stop(units, i, y, l))
    y_3 = w * (
        tendon_rate(units, i, a_3, y, l, v)[0]
        + r_a * u_3
        + G3 * drift
        + d * (C31 * y_1 + C32 * y_2)
    )
    l, v, _ = length_at(c, (t + T4 * h_n) / h, h)
    y = l_t + A41 * y_1 + A42 * y_2 + A43 * y_3
    beyond = max(beyond, y - at_stop(units, i, y, l))
    y_4 = w * (
        tendon_rate(units, i, a_4, y, l, v)[0]
        + r_a * u_4
        + G4 * drift
        + d * (C41 * y_1 + C42 * y_2 + C43 * y_3)
    )
    l, v, _ = length_at(c, (t + h_n) / h, h)
    y = l_t + A51 * y_1 + A52 * y_2 + A53 * y_3 + A54 * y_4
    beyond = max(beyond, y - at_stop(units, i, y, l))
    y_5 = w * (
        tendon_rate(units, i, a_5, y, l, v)[0]
        + r_a * u_5
        + d * (C51 * y_1 + C52 * y_2 + C53 * y_3 + C54 * y_4)
    )
    y += y_5
    y_6 = w * (
        tendon_rate(units, i, a_6, y, l, v)[0]
        + r_a * u_6
        + d * (C61 * y_1 + C62 * y_2 + C63 * y_3 + C64 * y_4 + C65 * y_5)
    )
    end = at_stop(units, i, y + y_6, l)
    error = abs(end - at_stop(units, i, y, l))
    if end == y + y_6:  # the stop was not there for a fibre that came back from beyond it
        error = max(error, beyond)
    return a_6 + u_6, end, abs(u_6), error


@kernel
def stopped_step(units, i, a, u, t, h_n, c, h):
    """One step from `t` of a fibre at its stop: what it would have moved since it left is the error.

    Returns a, l_t and the errors of both.
    """
    stages = activation_step(units, i, a, u, h_n)
    a_1 = stages[4] + stages[10]
    l, v, _ = length_at(c, (t + h_n) / h, h)
    end = at_stop(units, i, math.inf, l)
    leaving = max(v - tendon_rate(units, i, a_1, end, l, v)[0], 0.0)
    return a_1, end, abs(stages[10]), 0.5 * h_n * leaving


@kernel
def integrate_rosenbrock(
    units, i, a, l_t, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, steps
):  # fmt: skip
    """Integrate muscle `i` over a window; see `window.integrate`."""
    law, b = units.table[i, ACTIVATION], units.table[i, SWITCH]
    tau_a, tau_d = units.table[i, TAU_A], units.table[i, TAU_D]
    F0 = units.table[i, F_0]
    c = cubic(l_0, v_0, l_1, v_1, h)
    chosen = steps == 0
    t, n, h_n = 0.0, 0, 0.0
    a_u, y_u = 0.0, 0.0
    start = stopped_rate(units, i, a, l_t, l_0, v_0)
    rate_a, f_a, f_u = activation_rate(law, a, u, tau_a, tau_d, b)
    F, F_a, F_t, _, _ = tendon_force(units, i, a, l_t, l_0, v_0)
    if chosen:
        # A first step whose curvature is within the tolerance.
        _, _, l_tt = length_at(c, 0.0, h)
        curvature = start[2] * rate_a + start[3] * start[1] + start[4] * v_0 + l_tt
        h_n = min(h, math.sqrt(SHARE * tolerance * F0 / (abs(F_t * curvature) + 1e-300)))
    for _ in range(4 * MAX_STEPS):
        if chosen:
            rest = h - t
            h_n = next_step(h_n, rest)
            end = h if h_n == rest else t + h_n
        else:
            end = mesh[n]
        h_n = end - t  # from the mesh: using it again gives the same bits
        if start[0]:
            a_1, l_t1, error_a, error_t = stopped_step(units, i, a, u, t, h_n, c, h)
        else:
            a_1, l_t1, error_a, error_t = rosenbrock_step(
                units, i, a, u, l_t, start, c, t, h_n, h
            )
        l, v, _ = length_at(c, end / h, h)
        F_1, F_a1, F_t1, _, _ = tendon_force(units, i, a_1, l_t1, l, v)
        if chosen:
            error = max(F0 * error_a, max(F_t, F_t1) * error_t)
            # Errors older than the time constant 1/|df/dx| have decayed by the window's end, so
            # that one time constant's (or the window's) steps share the tolerance.
            allowed = SHARE * tolerance * F0 * min(h_n * max(abs(start[3]), 1.0 / h), 1.0)
            factor = SAFETY * math.sqrt(math.sqrt(allowed / (error + 1e-300)))
            if not error <= allowed:
                h_n *= factor if 0.1 < factor < 1.0 else 0.1
                if h_n < SHORTEST * h:
                    return -1, a, l_t, F, 0.0
                continue
            if n == MAX_STEPS:
                return -1, a, l_t, F, 0.0
            mesh[n] = end
        start_1 = stopped_rate(units, i, a_1, l_t1, l, v)
        _, f_a1, f_u1 = activation_rate(law, a_1, u, tau_a, tau_d, b)
        a_u1 = sensitivity(a_u, f_a, f_a1, f_u, f_u1, h_n)
        y_u = sensitivity(y_u, start[3], start_1[3], start[2] * a_u, start_1[2] * a_u1, h_n)
        a, l_t, start, a_u, f_a, f_u = a_1, l_t1, start_1, a_u1, f_a1, f_u1
        F, F_a, F_t, t = F_1, F_a1, F_t1, end
        n += 1
        if (chosen and end == h) or n == steps:
            return n, a, l_t, F, F_t * y_u + F_a * a_u
        if chosen:
            h_n *= min(factor, GROWTH)
    return -1, a, l_t, F, 0.0
