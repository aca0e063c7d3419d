"""Excitation (11): the u that, held over the window, ends in the wanted force.

F_end(u) increases as long as the fibre pulls; driven to shorten faster than it can, it resists the
more the more it is activated, and the bounds may cross, by some per cent of F0: the lower one is
then delivered. The guess is the cubic through both bounds and their slopes; one Newton step with
the sensitivity dF/du and secant steps, kept inside a shrinking bracket, do the rest.
"""

from __future__ import annotations

from ..muscle.parameters import F_0
from ..muscle.window import integrate
from ..numerics.kernel import kernel

ITERATIONS = 60
CONVERGED = 1e-9  # |F_end - F_opt| over F0
NARROW = 1e-12  # bracket of u in which F_end jumps, by less than the tolerance, if it does


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
        close = CONVERGED * tables.table[i, F_0]
        u_low, u_high = limits[0, i], limits[1, i]
        # The bounds are never below zero: a muscle that is slack either way rests.
        if wanted[i] <= max(low[2, i], 0.0) + close:
            u[i], end[0, i], end[1, i], end[2, i] = u_low, low[0, i], low[1, i], low[2, i]
            continue
        if wanted[i] >= high[2, i] - close:
            u[i], end[0, i], end[1, i], end[2, i] = u_high, high[0, i], high[1, i], high[2, i]
            continue
        u_n = inverse_cubic(wanted[i], u_low, u_high, low[2, i], high[2, i], low[3, i], high[3, i])
        u_last, error_last = 0.0, 0.0
        steps = 0
        found = False
        for _ in range(ITERATIONS):
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
            if abs(error) <= close or u_high - u_low < NARROW:
                found = True
                break
            if error > 0.0:
                u_high = u_n
            else:
                u_low = u_n
            # The sensitivity is good to some per cent; two integrations on the same steps know
            # better.
            slope = F_u
            if steps > 0 and error != error_last:
                slope = (error - error_last) / (u_n - u_last)
            steps = n  # the same steps from now on: F_end(u) is smooth
            u_last, error_last = u_n, error
            u_n -= error / slope
            if not u_low < u_n < u_high:
                u_n = 0.5 * (u_low + u_high)
        if not found:
            return integrations, i
        u[i], end[0, i], end[1, i], end[2, i] = u_n, a_1, l_t1, F_1
    return integrations, -1


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
