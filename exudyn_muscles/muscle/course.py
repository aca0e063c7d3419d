"""What both integrators share: how l runs through a window, and how the end depends on u."""

from __future__ import annotations

from ..kernel import kernel

MAX_STEPS = 10000  # of one window
# Shortest step over the window. Weak fibres under high force have time constants of 1e-9 s, and a
# kink takes a small part of that.
SHORTEST = 1e-15


@kernel(inline=True)
def cubic(l_0, v_0, l_1, v_1, h):
    """Coefficients in t/h of the cubic through both ends' lengths and speeds."""
    return l_0, h * v_0, 3.0 * (l_1 - l_0) - h * (2.0 * v_0 + v_1), h * (v_0 + v_1) - 2.0 * (
        l_1 - l_0
    )


@kernel(inline=True)
def length_at(c, s, h):
    """l, l' and l'' at the part `s` of the window."""
    return (
        c[0] + s * (c[1] + s * (c[2] + s * c[3])),
        (c[1] + s * (2.0 * c[2] + 3.0 * s * c[3])) / h,
        (2.0 * c[2] + 6.0 * s * c[3]) / (h * h),
    )


@kernel(inline=True)
def next_step(h_n, rest):
    """The step that is taken of the one wanted: it ends at the window's end or well before."""
    if h_n > 0.999 * rest:
        return rest
    if h_n > 0.5 * rest:
        return 0.5 * rest
    return h_n


@kernel(inline=True)
def sensitivity(x_u, J_0, J_1, s_0, s_1, h):
    """dx/du after a step of x' = f(x, u), with df/dx and the rest of df/du at both its ends.

    Second order and damped like an L-stable rule: exp(z) is 1 / (1 - z + z^2/2).
    """
    z = 0.5 * h * (J_0 + J_1)
    return (x_u + 0.5 * h * (s_0 + (1.0 - z) * s_1)) / (1.0 - z + 0.5 * z * z)
