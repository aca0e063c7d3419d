"""Excitation (11): the u that, held over the window, ends in the wanted force.

F_end(u) increases as long as the fibre pulls; driven to shorten faster than it can, it resists the
more the more it is activated, and the bounds may cross, by some per cent of F0: the lower one is
then delivered.

Where u passes the activation at the start, F_end(u) has a kink: activation rises faster than it
falls. The search is for x(u), which has the same kink, so that F_end(x) is smooth. The guess is the
cubic through both bounds and their slopes; one Newton step with the sensitivity dF/du and secant
steps, kept inside a shrinking bracket, do the rest. The last of them needs no integration, as the
end of the window goes along the secant with it.
"""

from __future__ import annotations

import math

from ..muscle.activation import activation_rate
from ..muscle.contraction import tendon_force
from ..muscle.parameters import ACTIVATION, F_0, SWITCH, TAU_A, TAU_D
from ..muscle.window import integrate
from ..numerics.kernel import kernel

ITERATIONS = 60
CONVERGED = 1e-9  # |F_end - F_opt| over F0
NARROW = 1e-12  # bracket of u in which F_end jumps, by less than the tolerance, if it does
NEAR = 1e-9  # how far from the kink the rates on both its sides are taken
# Secants over a kink of a muscle's curves are no tangents: their slope is off the sensitivity's,
# which is good to some per cent, by more than this part of it.
TANGENT = 0.1


@kernel
def excitations(
    method, tables, a, l_t, limits, wanted, low, high, l_0, v_0, l_1, v_1, h, tolerance, mesh, u,
    end,
):  # fmt: skip
    """Solve (11) for all m muscles.

    `limits` (2, m) are the lowest and highest excitations, `low` and `high`, each (4, m), a, l_t, F
    and dF/du at the window's end for these. `u` (m,) and `end` (3, m), the a, l_t and F reached,
    are written; wanted forces outside the bounds give the nearest bound. `mesh` is scratch of
    MAX_STEPS. Returns (number of integrations, first muscle that failed or -1).
    """
    integrations = 0
    for i in range(a.size):
        F0 = tables.table[i, F_0]
        close = CONVERGED * F0
        u_low, u_high = limits[0, i], limits[1, i]
        # The bounds are never below zero: a muscle that is slack either way rests.
        if wanted[i] <= max(low[2, i], 0.0) + close:
            u[i], end[0, i], end[1, i], end[2, i] = u_low, low[0, i], low[1, i], low[2, i]
            continue
        if wanted[i] >= high[2, i] - close:
            u[i], end[0, i], end[1, i], end[2, i] = u_high, high[0, i], high[1, i], high[2, i]
            continue
        rise = rising(tables, i, a[i], h)
        x_low, x_high = stretched(u_low, a[i], rise), stretched(u_high, a[i], rise)
        slope_low, slope_high = low[3, i], high[3, i]
        if u_low > a[i]:
            slope_low /= rise
        if u_high > a[i]:
            slope_high /= rise
        # Half the second derivative of x(F), times the slope, as the bounds' slopes have it.
        bend = 0.5 * abs(slope_high - slope_low) / (x_high - x_low)
        x_n = inverse_cubic(wanted[i], x_low, x_high, low[2, i], high[2, i], slope_low, slope_high)
        x_last, error_last, a_last, l_last = 0.0, 0.0, 0.0, 0.0
        steps = 0
        found = False
        for _ in range(ITERATIONS):
            u_n = a[i] + (x_n / rise if x_n > 0.0 else x_n)
            n, a_1, l_t1, F_1, F_u = integrate(
                method, tables, i, a[i], l_t[i], u_n, l_0[i], v_0[i], l_1[i], v_1[i], h, tolerance,
                mesh, steps,
            )  # fmt: skip
            integrations += 1
            if n < 0:
                if steps == 0:
                    break
                steps = 0
                continue
            error = F_1 - wanted[i]
            if abs(error) <= close or x_high - x_low < NARROW:
                found = True
                break
            if error > 0.0:
                x_high = x_n
            else:
                x_low = x_n
            tangent = F_u / rise if x_n > 0.0 else F_u
            slope = tangent
            # The sensitivity is good to some per cent; two integrations on the same steps know
            # better.
            secant = steps > 0 and error != error_last
            if secant:
                slope = (error - error_last) / (x_n - x_last)
            x_next = x_n - error / slope
            steps = n  # the same steps from now on: F_end(u) is smooth
            if not x_low < x_next < x_high:
                x_next = 0.5 * (x_low + x_high)
            elif secant and abs(slope - tangent) < TANGENT * slope:
                rest = abs(error * error_last) * max(bend / (slope * slope), 1.0 / F0)
                along = (x_next - x_n) / (x_n - x_last)
                a_2, l_t2 = a_1 + along * (a_1 - a_last), l_t1 + along * (l_t1 - l_last)
                F_2, _, _, _, _ = tendon_force(tables, i, a_2, l_t2, l_1[i], v_1[i])
                if rest <= close and abs(F_2 - wanted[i]) <= close:
                    u_n = a[i] + (x_next / rise if x_next > 0.0 else x_next)
                    a_1, l_t1, F_1 = a_2, l_t2, F_2
                    found = True
                    break
            x_last, error_last, a_last, l_last = x_n, error, a_1, l_t1
            x_n = x_next
        if not found:
            return integrations, i
        u[i], end[0, i], end[1, i], end[2, i] = u_n, a_1, l_t1, F_1
    return integrations, -1


@kernel(inline=True)
def rising(tables, i, a, h):
    """How many times as far as one below `a` an excitation above it moves the activation in `h`."""
    law, b = tables.table[i, ACTIVATION], tables.table[i, SWITCH]
    tau_a, tau_d = tables.table[i, TAU_A], tables.table[i, TAU_D]
    up = activation_rate(law, a, a + NEAR, tau_a, tau_d, b)[2]
    down = activation_rate(law, a, a - NEAR, tau_a, tau_d, b)[2]
    return math.expm1(-h * up) / math.expm1(-h * down)


@kernel(inline=True)
def stretched(u, a, rise):
    """x(u)."""
    return (u - a) * rise if u > a else u - a


@kernel
def inverse_cubic(F, u_0, u_1, F_low, F_high, slope_0, slope_1):
    """u(F) by the cubic through both ends with slopes 1/(dF/du), kept inside the ends."""
    d = F_high - F_low
    s = (F - F_low) / d
    m_0 = d / slope_0
    m_1 = d / slope_1
    delta = u_1 - u_0
    u = u_0 + s * (m_0 + s * (3.0 * delta - 2.0 * m_0 - m_1 + s * (m_0 + m_1 - 2.0 * delta)))
    margin = 1e-3 * delta
    if not u_0 + margin < u < u_1 - margin:
        return u_0 + s * delta
    return u
