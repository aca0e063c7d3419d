"""The L-stable integrator: RODASP, a Rosenbrock method of order 4 with an embedded one of order 3
that keeps their orders where stiff equations are driven from outside, as tendons are.

G. Steinebach, "Order-reduction of ROW-methods for DAEs and method of lines applications", preprint
1741, TH Darmstadt (1995); E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II",
section IV.7. Coefficients as in their code RODAS, where it is the third method.

Activation and tendon length form a triangular system, so that every stage is one division each:
six evaluations a step, no iteration.
"""

from __future__ import annotations

import math

from ..numerics.kernel import kernel
from .activation import activation_rate
from .contraction import at_stop, drift, tendon_rate
from .course import LEAST_STIFFNESS, length_at
from .parameters import ACTIVATION, PER_STRETCH, SWITCH, TAU_A, TAU_D

GAMMA = 0.25
A21 = 3.0
A31, A32 = 1.831036793486759, 0.4955183967433795
A41, A42, A43 = 2.304376582692669, -0.05249275245743001, -1.176798761832782
A51, A52, A53, A54 = -7.170454962423024, -4.741636671481785, -16.31002631330971, -1.062004044111401
C21 = -12.0
C31, C32 = -8.791795173947035, -2.207865586973518
C41, C42, C43 = 10.81793056857153, 6.780270611428266, 19.53485944642410
C51, C52, C53, C54 = 34.19095006749676, 15.49671153725963, 54.74760875964130, 14.16005392148534
C61, C62, C63 = 34.62605830930532, 15.30084976114473, 56.99955578662667
C64, C65 = 18.40807009793095, -5.714285714285717
# Time of the stages and their weights of the explicit time derivative.
T2, T3, T4 = 0.75, 0.21, 0.63
G1, G2, G3, G4 = 0.25, -0.5, -0.023504, -0.0362

# Part of the tolerance that one time constant's steps may use up together; set so that the force at
# the end of the window meets the tolerance in 99 % of the whole box of states that
# tests/muscle/test_window.py draws from.
SHARE = 0.9
SAFETY, GROWTH = 0.9, 3.0
# The estimate of the activation's error counts the more the longer a step is for its time constant:
# stages beyond u lie on lines.
LONG = 2.0
# First step: this many times the one whose square times the curvature is the tolerance.
START = 12.0
# Fewest steps of a window, more or less: tendons that are stiff follow a path that bends.
FEWEST = 3.0
# The estimate passes through zero now and then. It is therefore taken to be at least this part of
# what the last step makes expect, and at least this many times the correction that came before it,
# which is of an order less, to the power of 3/2. For what comes next it is not below `LEAST`.
MEMORY = 0.1
LEAST = 1e-3
SECOND = 3.0


@kernel(inline=True)
def stage_rate(law, a, c, u, tau_a, tau_d, b, slope):
    """f_a at a stage `a`; beyond `c`, the nearest place between the step's start and u, on a line
    with the slope of the start."""
    return activation_rate(law, c, u, tau_a, tau_d, b)[0] + slope * (a - c)


@kernel(inline=True)
def activation_step(tables, i, a, u, h):
    """One step of the activation: its five later stages, its end and six increments, the last of
    which is the estimate of the error.

    Stages of a step far beyond the time constants cross u, which a does not: there the law is
    another one, or none. The stages and the end that are returned lie between a and u.
    """
    law, b = tables.table[i, ACTIVATION], tables.table[i, SWITCH]
    tau_a, tau_d = tables.table[i, TAU_A], tables.table[i, TAU_D]
    low, high = min(a, u), max(a, u)
    rate, slope, _ = activation_rate(law, a, u, tau_a, tau_d, b)
    w, d = 1.0 / (1.0 / (GAMMA * h) - slope), 1.0 / h
    u_1 = w * rate
    a_2 = a + A21 * u_1
    c_2 = min(max(a_2, low), high)
    u_2 = w * (stage_rate(law, a_2, c_2, u, tau_a, tau_d, b, slope) + d * C21 * u_1)
    a_3 = a + A31 * u_1 + A32 * u_2
    c_3 = min(max(a_3, low), high)
    u_3 = w * (stage_rate(law, a_3, c_3, u, tau_a, tau_d, b, slope) + d * (C31 * u_1 + C32 * u_2))
    a_4 = a + A41 * u_1 + A42 * u_2 + A43 * u_3
    c_4 = min(max(a_4, low), high)
    u_4 = w * (
        stage_rate(law, a_4, c_4, u, tau_a, tau_d, b, slope)
        + d * (C41 * u_1 + C42 * u_2 + C43 * u_3)
    )
    a_5 = a + A51 * u_1 + A52 * u_2 + A53 * u_3 + A54 * u_4
    c_5 = min(max(a_5, low), high)
    u_5 = w * (
        stage_rate(law, a_5, c_5, u, tau_a, tau_d, b, slope)
        + d * (C51 * u_1 + C52 * u_2 + C53 * u_3 + C54 * u_4)
    )
    a_6 = a_5 + u_5
    c_6 = min(max(a_6, low), high)
    u_6 = w * (
        stage_rate(law, a_6, c_6, u, tau_a, tau_d, b, slope)
        + d * (C61 * u_1 + C62 * u_2 + C63 * u_3 + C64 * u_4 + C65 * u_5)
    )
    end = min(max(a_6 + u_6, low), high)
    return c_2, c_3, c_4, c_5, c_6, end, u_1, u_2, u_3, u_4, u_5, u_6


@kernel(inline=True)
def activation_end(tables, i, a, u, h):
    """Activation after one step, and the error of it."""
    _, _, _, _, _, end, _, _, _, _, _, u_6 = activation_step(tables, i, a, u, h)
    return end, abs(u_6)


@kernel
def moving_step(tables, i, a, u, l_t, start, c, t, h_n):
    """One step from `t` of a fibre that is not at its stop, with the rate there from `start`.

    Returns a, l_t, the errors of both, and df_SE/dl_t at the end.
    """
    _, rate, r_a, r_t, r_l, _ = start
    a_2, a_3, a_4, a_5, a_6, a_1, u_1, u_2, u_3, u_4, u_5, u_6 = activation_step(
        tables, i, a, u, h_n
    )
    _, speed, acceleration = length_at(c, t)
    w, d = 1.0 / (1.0 / (GAMMA * h_n) - r_t), 1.0 / h_n
    moved = h_n * drift(tables, i, r_l, speed, acceleration)
    y_1 = w * (rate + r_a * u_1 + G1 * moved)

    l, v, _ = length_at(c, t + T2 * h_n)
    y = l_t + A21 * y_1
    beyond = y - at_stop(tables, i, y, l)
    f = tendon_rate(tables, i, a_2, y, l, v)[0]
    nearer = max(rate - speed, f - v)
    y_2 = w * (f + r_a * u_2 + G2 * moved + d * C21 * y_1)
    l, v, _ = length_at(c, t + T3 * h_n)
    y = l_t + A31 * y_1 + A32 * y_2
    beyond = max(beyond, y - at_stop(tables, i, y, l))
    f = tendon_rate(tables, i, a_3, y, l, v)[0]
    nearer = max(nearer, f - v)
    y_3 = w * (f + r_a * u_3 + G3 * moved + d * (C31 * y_1 + C32 * y_2))
    l, v, _ = length_at(c, t + T4 * h_n)
    y = l_t + A41 * y_1 + A42 * y_2 + A43 * y_3
    beyond = max(beyond, y - at_stop(tables, i, y, l))
    f = tendon_rate(tables, i, a_4, y, l, v)[0]
    nearer = max(nearer, f - v)
    y_4 = w * (f + r_a * u_4 + G4 * moved + d * (C41 * y_1 + C42 * y_2 + C43 * y_3))
    l, v, _ = length_at(c, t + h_n)
    y = l_t + A51 * y_1 + A52 * y_2 + A53 * y_3 + A54 * y_4
    beyond = max(beyond, y - at_stop(tables, i, y, l))
    f = tendon_rate(tables, i, a_5, y, l, v)[0]
    nearer = max(nearer, f - v)
    y_5 = w * (f + r_a * u_5 + d * (C51 * y_1 + C52 * y_2 + C53 * y_3 + C54 * y_4))
    y += y_5
    rate, _, _, _, f_t = tendon_rate(tables, i, a_6, y, l, v)
    y_6 = w * (rate + r_a * u_6 + d * (C61 * y_1 + C62 * y_2 + C63 * y_3 + C64 * y_4 + C65 * y_5))
    end = at_stop(tables, i, y + y_6, l)
    second = abs(y_5) * math.sqrt(abs(y_5) * tables.table[i, PER_STRETCH])
    error = max(abs(end - at_stop(tables, i, y, l)), SECOND * second)
    if end == y + y_6:
        # The stop was not there for a fibre that came back from beyond it; but no farther than it
        # moves itself, as one that bears nothing does not.
        error = max(error, min(beyond, h_n * nearer))
    return a_1, end, abs(u_6), error, f_t


@kernel
def stopped_step(tables, i, a, u, c, t, h_n):
    """One step from `t` of a fibre at its stop; the error is what it misses if it leaves.

    Returns a, l_t, the errors of both, and df_SE/dl_t at the end.
    """
    a_1, error_a = activation_end(tables, i, a, u, h_n)
    l, v, _ = length_at(c, t + h_n)
    end = at_stop(tables, i, math.inf, l)
    leaving = max(v - tendon_rate(tables, i, a_1, end, l, v)[0], 0.0)
    return a_1, end, error_a, 0.5 * h_n * leaving, 0.0


@kernel(inline=True)
def first_step(tables, i, start, second, growth, h, tolerance):
    """The first step wanted of a window `h`: l_t'' and activation's `growth` |a'|/a at its start
    make it one within tolerance.

    What a fibre does follows the ratio of its load and its activation, so that one whose activation
    grows tenfold in the window needs shorter steps than its l_t'' says.
    """
    stiffness = max(start[5], LEAST_STIFFNESS * tables.table[i, PER_STRETCH])
    bend = stiffness * abs(second) * (1.0 + h * growth)
    return START * min(h, math.sqrt(SHARE * tolerance / (bend + 1e-300)))


@kernel(inline=True)
def window_step(tables, i, a, u, l_t, start, f_a, c, t, h_n, h, tolerance):
    """One step of a window `h` from the rate `start`, as `stopped_rate` has it, and df_a/da.

    Returns a, l_t and the error over what of it is allowed.
    """
    if start[0]:
        a_1, l_t1, error_a, error_t, f_t = stopped_step(tables, i, a, u, c, t, h_n)
    else:
        a_1, l_t1, error_a, error_t, f_t = moving_step(tables, i, a, u, l_t, start, c, t, h_n)
    # Errors older than a time constant 1/|df/dx| have decayed by the window's end, so that one
    # time constant's (or the window's) steps share the tolerance.
    share = SHARE * tolerance
    least = LEAST_STIFFNESS * tables.table[i, PER_STRETCH]
    error_a *= 1.0 + LONG * h_n * abs(f_a)
    error_a /= share * min(h_n * max(abs(f_a), 1.0 / h), 1.0)
    error_t *= max(start[5], f_t, least) / (share * min(h_n * max(abs(start[3]), 1.0 / h), 1.0))
    if not error_a + error_t < math.inf:  # the maximum may lose a NaN
        return a_1, l_t1, math.inf
    return a_1, l_t1, max(error_a, error_t)


@kernel(inline=True)
def step_factor(error, trend):
    """What the step is to be multiplied by, after one with this error, of which the part that does
    not depend on the step has become 1 / `trend` of what it was in the step before.

    It is taken to do so again: a transient that dies away lets steps grow from one to the next.
    """
    if error <= 1.0:
        return min(SAFETY * math.sqrt(math.sqrt(trend / (error + 1e-300))), GROWTH)
    factor = SAFETY / math.sqrt(math.sqrt(error))
    return factor if 0.1 < factor < 1.0 else 0.1
