"""Contraction dynamics (4) of a Hill unit with constant width, and its force.

The state is the tendon length l_t: the tendon force F = F0 f_SE(l_t / l_ts - 1) of the paper
follows from it alone, and unlike the force it keeps its meaning where the tendon is slack. With the
fibre's projection p = l - l_t on the tendon, the fibre length l_m = sqrt(p^2 + w^2),
w = l_m0 sin(alpha_0), cos(alpha) = p / l_m and V = v_max l_m0, the fibre velocity V v balances

    a f_l f_v(v / s) + beta v + f_PE = f_SE / cos(alpha),    s = r + (1 - r) a,

where s is the share of v_max that the activation leaves (r = 1 but for Thelen's laws; the damped
fibres of `force_velocity.py` balance by their own formulas), and

    l_t' = l' - V v / cos(alpha),    F' = F0 f_SE' l_t' / l_ts.

The fibre velocity is divided by cos(alpha), not multiplied: the pennation angle changes with the
fibre length. The fibre stops at its shortest length; a path that is shorter still leaves the
tendon slack. Some curves f_SE go on below zero there (De Groote's as far as -0.2): the equations
take them as they are, smooth as they have to be, but nothing pushes: what a unit does to the world
is `pull`. A rigid tendon has no state: l_t = l_ts, and the force follows from a, l and l'. Tension
and lengthening are positive.
"""

from __future__ import annotations

import math

from ..numerics.curves import is_in, piece_at, polynomial
from ..numerics.kernel import kernel
from .force_velocity import load_of_velocity, velocity_of_load
from .parameters import (
    AF,
    ALONG,
    BETA,
    F_0,
    F_L,
    F_PE,
    F_SE,
    F_V,
    FLEN,
    FORM,
    INVERSE_F_V,
    P_MIN,
    PER_E,
    PER_L_M0,
    PER_STRETCH,
    RIGID,
    V_M,
    V_REST,
    WIDTH,
)

ITERATIONS = 60  # iterations for the velocity of a damped fibre; two are usual
STILL = 1e-12  # velocity over the maximum one
CONVERGED = 1e-5  # last correction of it: the next one would be its cube


@kernel(inline=True)
def curve_at(tables, i, column, x):
    """Value, slope and curvature at `x` of the muscle's curve in this column."""
    pieces, k = tables.curves.pieces, tables.found[i, column - F_L]
    if not is_in(pieces, k, x):
        k = piece_at(tables.curves, int(tables.table[i, column]), x)
        tables.found[i, column - F_L] = k
    return polynomial(pieces, k, x)


@kernel(inline=True)
def tendon(tables, i, l_t):
    """f_SE at the tendon length `l_t`, and its derivative [1/m]."""
    per_stretch = tables.table[i, PER_STRETCH]
    f, slope, _ = curve_at(tables, i, F_SE, l_t * per_stretch - tables.table[i, PER_E])
    return f, slope * per_stretch


@kernel(inline=True)
def fiber(tables, i, p):
    """Fibre length and 1/cos(alpha) at the projection `p`, and how cos(alpha) changes with p."""
    w = tables.table[i, WIDTH]
    if w == 0.0:
        return p, 1.0, 0.0
    per_p = 1.0 / p
    l_m = math.sqrt(p * p + w * w)
    return l_m, l_m * per_p, w * w / (l_m * l_m * l_m)


@kernel(inline=True)
def fiber_velocity(tables, i, a, f_l, load):
    """v of a fibre that bears the `load` beside f_PE, and dv/da, dv/df_l, dv/dload."""
    r, beta = tables.table[i, V_REST], tables.table[i, BETA]
    s = r + (1.0 - r) * a
    capacity = a * f_l
    if tables.table[i, FORM] != 0.0:
        v_s, v_capacity, v_load = velocity_of_load(
            tables.table[i, FORM], tables.table[i, AF], tables.table[i, FLEN], beta, capacity, load
        )
        v_capacity, v_load = s * v_capacity, s * v_load
        return s * v_s, f_l * v_capacity + (1.0 - r) * v_s, a * v_capacity, v_load
    if beta == 0.0:
        per_capacity = 1.0 / capacity
        f_v = load * per_capacity
        v_s, slope, _ = curve_at(tables, i, INVERSE_F_V, f_v)
        v = s * v_s
        v_load = s * slope * per_capacity
    else:
        v, f_v, slope = damped_velocity(tables, i, s, capacity, load)
        v_load = 1.0 / (capacity * slope / s + beta)
        v_s = capacity * slope * v / (s * s) * v_load
    v_capacity = -f_v * v_load
    return v, f_l * v_capacity + (1.0 - r) * v_s, a * v_capacity, v_load


@kernel
def damped_velocity(tables, i, s, capacity, load):
    """The v at which capacity f_v(v / s) + beta v is the load, f_v and its slope there:
    Chebyshev's third-order method in a bracket."""
    beta = tables.table[i, BETA] * s
    # A step of it for f_v by the inverse curve comes first, from where f_v would be as 1 + w.
    f_v = (load + beta) / (capacity + beta)
    w, w_f, w_ff = curve_at(tables, i, INVERSE_F_V, f_v)
    step = chebyshev(capacity * f_v + beta * w - load, capacity + beta * w_f, beta * w_ff)
    w += step * (w_f + 0.5 * step * w_ff)
    low, high, slope = -math.inf, math.inf, 0.0
    for _ in range(ITERATIONS):
        f_v, slope, curvature = curve_at(tables, i, F_V, w)
        error = capacity * f_v + beta * w - load
        if error > 0.0:
            high = w
        else:
            low = w
        step = chebyshev(error, capacity * slope + beta, capacity * curvature)
        w += step
        if abs(step) <= CONVERGED * (1.0 + abs(w)):
            f_v += step * (slope + 0.5 * step * curvature)
            return s * w, f_v, slope + step * curvature
        if not low < w < high:
            w = 0.5 * (low + high)
    return s * w, f_v, slope


@kernel(inline=True)
def chebyshev(value, slope, curvature):
    """Step to where a function is zero by Chebyshev's method, from half to twice Newton's."""
    per_slope = 1.0 / slope
    step = -value * per_slope
    return step * min(max(1.0 - 0.5 * step * curvature * per_slope, 0.5), 2.0)


@kernel(inline=True)
def tendon_rate(tables, i, a, l_t, l, l_rate):
    """l_t' [m/s], its derivatives with respect to a, l_t and l (that to l' is one), df_SE/dl_t.

    The fibre runs on through its shortest length, with the properties that it has there: a step
    needs a smooth rate, and its end is put back to the stop.
    """
    if tables.table[i, RIGID]:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    f, f_t = tendon(tables, i, l_t)
    p, moves = l - l_t, 1.0
    if l_t >= l - tables.table[i, P_MIN]:
        p, moves = tables.table[i, P_MIN], 0.0
    l_m, per_cos, cos_p = fiber(tables, i, p)
    x = l_m * tables.table[i, PER_L_M0]
    f_l, f_l_x, _ = curve_at(tables, i, F_L, x)
    f_PE, f_PE_x, _ = curve_at(tables, i, F_PE, x)
    v, v_a, v_fl, v_load = fiber_velocity(tables, i, a, f_l, f * per_cos - f_PE)
    cos_p *= per_cos
    v_p = (v_fl * f_l_x - v_load * f_PE_x) * tables.table[i, PER_L_M0] / per_cos
    v_p -= v_load * f * per_cos * cos_p
    V = tables.table[i, V_M] * per_cos
    rate_p = -V * (v_p - v * cos_p) * moves
    rate_t = -V * v_load * f_t * per_cos - rate_p
    return l_rate - V * v, -V * v_a, rate_t, rate_p, f_t


@kernel(inline=True)
def drift(tables, i, r_l, l_rate, l_rate_rate):
    """How l_t' changes with the time because l and l' do, with `tendon_rate`'s derivative to l."""
    if tables.table[i, RIGID]:
        return 0.0
    return r_l * l_rate + l_rate_rate


@kernel(inline=True)
def at_stop(tables, i, l_t, l):
    """The tendon length that leaves the fibre at its shortest or longer."""
    if tables.table[i, RIGID]:
        return l_t
    return min(l_t, l - tables.table[i, P_MIN])


@kernel(inline=True)
def stopped_rate(tables, i, a, l_t, l, l_rate):
    """Whether the fibre rests at its shortest length, and `tendon_rate` with that stop."""
    rate, r_a, r_t, r_l, f_t = tendon_rate(tables, i, a, l_t, l, l_rate)
    # A fibre that bears nothing there rests, too, whatever rounding makes of it.
    shortens = rate > l_rate - STILL * tables.table[i, V_M]
    if shortens and l_t >= at_stop(tables, i, math.inf, l):
        return True, l_rate, 0.0, 0.0, 0.0, f_t
    return False, rate, r_a, r_t, r_l, f_t


@kernel(inline=True)
def pull(tables, i, a, l_t, l, l_rate):
    """`tendon_force` and its derivatives, but nothing where the tendon is slack."""
    F, F_a, F_t, F_l, F_v = tendon_force(tables, i, a, l_t, l, l_rate)
    if F > 0.0:
        return F, F_a, F_t, F_l, F_v
    return 0.0, 0.0, 0.0, 0.0, 0.0


@kernel(inline=True)
def tendon_force(tables, i, a, l_t, l, l_rate):
    """F [N] by the tendon's curve, and its derivatives with respect to a, l_t, l and l'."""
    if tables.table[i, RIGID]:
        return rigid_force(tables, i, a, l - l_t, l_rate)
    f, f_t = tendon(tables, i, l_t)
    return tables.table[i, F_0] * f, 0.0, tables.table[i, F_0] * f_t, 0.0, 0.0


@kernel
def rigid_force(tables, i, a, p, l_rate):
    """`tendon_force` of a rigid tendon: what the fibre bears at the projection `p`."""
    if p <= tables.table[i, P_MIN]:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    F0, V = tables.table[i, F_0], tables.table[i, V_M]
    l_m, per_cos, cos_p = fiber(tables, i, p)
    cos = 1.0 / per_cos
    share, share_p = cos, cos_p  # of the speed that the fibre has
    if tables.table[i, ALONG]:
        share, share_p = 1.0, 0.0
    v = l_rate * share / V
    f, f_a, f_x, f_v = fiber_force(tables, i, a, l_m * tables.table[i, PER_L_M0], v)
    if f < 0.0:  # a fibre does not push: damping acts only against what the fibre bears
        return 0.0, 0.0, 0.0, 0.0, 0.0
    f_p = f_x * cos * tables.table[i, PER_L_M0] + f_v * l_rate / V * share_p
    return (
        F0 * f * cos,
        F0 * f_a * cos,
        0.0,
        F0 * (f_p * cos + f * cos_p),
        F0 * f_v * share * cos / V,
    )


@kernel
def fiber_force(tables, i, a, x, v):
    """Fibre force over F0 at normalised length and velocity; derivatives to a, x and v."""
    r, beta = tables.table[i, V_REST], tables.table[i, BETA]
    s = r + (1.0 - r) * a
    f_l, f_l_x, _ = curve_at(tables, i, F_L, x)
    f_PE, f_PE_x, _ = curve_at(tables, i, F_PE, x)
    if tables.table[i, FORM] != 0.0:
        f, f_capacity, f_v = load_of_velocity(
            tables.table[i, FORM], tables.table[i, AF], tables.table[i, FLEN], beta, a * f_l, v / s
        )
        return (
            f + f_PE,
            f_l * f_capacity - f_v * v / (s * s) * (1.0 - r),
            a * f_l_x * f_capacity + f_PE_x,
            f_v / s,
        )
    f_v, slope, _ = curve_at(tables, i, F_V, v / s)
    return (
        a * f_l * f_v + f_PE + beta * v,
        f_l * (f_v - a * slope * v / (s * s) * (1.0 - r)),
        a * f_l_x * f_v + f_PE_x,
        a * f_l * slope / s + beta,
    )
