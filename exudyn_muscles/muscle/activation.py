"""Activation dynamics (5), a' = f_a(a, u), by one of four laws; the excitation is held.

linear filter   a' = (u - a) / tau, tau = tau_a where u > a, tau_d elsewhere
first order     the same with tau_a (0.5 + 1.5 a) and tau_d / (0.5 + 1.5 a)
smooth          both first-order rates at once, weighted by a smooth switch tanh(b (u - a))
bilinear        a' = (u - a) (u / tau_a + (1 - u) / tau_d) where u > a, (u - a) / tau_d elsewhere

Sources: the paper's low-pass filter; J. M. Winters (1995) and D. G. Thelen (2003), as in OpenSim's
Thelen2003Muscle and Millard2012EquilibriumMuscle; F. De Groote et al. (2016), as in OpenSim's
DeGrooteFregly2016Muscle; F. E. Zajac (1989), Critical Reviews in Biomedical Engineering 17, as in
OpenSim's Schutte1993Muscle_Deprecated. With the excitation held, a approaches u without crossing
it.
"""

from __future__ import annotations

import math
from enum import Enum

from ..numerics.kernel import kernel

LINEAR_FILTER, FIRST_ORDER, SMOOTH, BILINEAR = range(4)
NEWTON = 20  # iterations of a trapezoidal step; linear: one, otherwise three or four
CONVERGED = 1e-15


class ActivationDynamics(Enum):
    """How activation follows excitation."""

    LINEAR_FILTER = LINEAR_FILTER
    FIRST_ORDER = FIRST_ORDER
    SMOOTH = SMOOTH
    BILINEAR = BILINEAR


@kernel(inline=True)
def activation_rate(law, a, u, tau_a, tau_d, b):
    """f_a [1/s] and its derivatives with respect to a and u."""
    if law == LINEAR_FILTER:
        rate = 1.0 / (tau_a if u > a else tau_d)
        return rate * (u - a), -rate, rate
    if law == BILINEAR:
        rate, rate_u = 1.0 / tau_d, 0.0
        if u > a:
            rate_u = 1.0 / tau_a - rate
            rate += rate_u * u
        return rate * (u - a), -rate, rate_u * (u - a) + rate
    z = 0.5 + 1.5 * a
    rise, fall = 1.0 / (tau_a * z), z / tau_d
    rise_a, fall_a = -1.5 * rise / z, 1.5 / tau_d
    if law == FIRST_ORDER:
        rate, rate_a = (rise, rise_a) if u > a else (fall, fall_a)
        return rate * (u - a), rate_a * (u - a) - rate, rate
    f = 0.5 - 1.0 / (1.0 + math.exp(2.0 * b * (u - a)))  # 0.5 tanh(b (u - a)), in half the time
    f_u = b * (0.5 - 2.0 * f * f)
    rate = (f + 0.5) * rise + (0.5 - f) * fall
    rate_u = f_u * (rise - fall)
    rate_a = (f + 0.5) * rise_a + (0.5 - f) * fall_a - rate_u
    return rate * (u - a), rate_a * (u - a) - rate, rate_u * (u - a) + rate


@kernel
def trapezoidal(law, a, u, tau_a, tau_d, b, h):
    """Activation after one step of the trapezoidal rule."""
    rate, rate_a, _ = activation_rate(law, a, u, tau_a, tau_d, b)
    a_1 = a + h * rate / (1.0 - 0.5 * h * rate_a)
    # A step far beyond the time constants would cross u, which a does not.
    low, high = min(a, u), max(a, u)
    for _ in range(NEWTON):
        a_1 = min(max(a_1, low), high)
        end, end_a, _ = activation_rate(law, a_1, u, tau_a, tau_d, b)
        correction = (a + 0.5 * h * (rate + end) - a_1) / (1.0 - 0.5 * h * end_a)
        a_1 += correction
        if abs(correction) < CONVERGED:
            break
    return min(max(a_1, low), high)
