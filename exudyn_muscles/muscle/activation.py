"""Activation dynamics (5): a first-order low-pass filter with two time constants,

    a' = (u - a) / tau,    tau = tau_a where u > a, tau_d elsewhere.

With the excitation held, a approaches u without crossing it, so that tau is constant and both
forms below are closed.
"""

from __future__ import annotations

import math

from ..kernel import kernel


@kernel
def time_constant(a, u, tau_a, tau_d):
    """The time constant [s] that applies at activation `a` and excitation `u`."""
    return tau_a if u > a else tau_d


@kernel
def held(a, u, tau, t):
    """Exact solution after the time `t`: a(t), da(t)/dt and da(t)/du."""
    decay = math.exp(-t / tau)
    return u + (a - u) * decay, (u - a) * decay / tau, 1.0 - decay


@kernel
def trapezoidal(a, u, tau, h):
    """One step of the trapezoidal rule."""
    return a + h * (u - a) / (tau + 0.5 * h)
