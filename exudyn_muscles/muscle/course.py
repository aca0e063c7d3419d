"""How l runs through a window, where its steps end, and how they depend on u."""

from __future__ import annotations

from ..numerics.kernel import kernel

MAX_STEPS = 10000  # of one window
# An error of l_t counts with no less than this part of F0 per stretch at F0: a slack tendon bears
# nothing now, but soon may.
LEAST_STIFFNESS = 0.3


@kernel(inline=True)
def cubic(l_0, v_0, l_1, v_1, h):
    """Coefficients in t of the cubic through both ends' lengths and speeds."""
    mean = (l_1 - l_0) / h
    return l_0, v_0, (3.0 * mean - 2.0 * v_0 - v_1) / h, (v_0 + v_1 - 2.0 * mean) / (h * h)


@kernel(inline=True)
def length_at(c, t):
    """l, l' and l'' at the time `t` in the window."""
    return (
        c[0] + t * (c[1] + t * (c[2] + t * c[3])),
        c[1] + t * (2.0 * c[2] + 3.0 * t * c[3]),
        2.0 * c[2] + 6.0 * t * c[3],
    )


@kernel(inline=True)
def next_end(t, h_n, h):
    """Where a step from `t` ends of which `h_n` is wanted: at the window's end or well before."""
    rest = h - t
    if h_n > 0.999 * rest:
        return h
    if h_n > 0.5 * rest:
        return t + 0.5 * rest
    return t + h_n


@kernel(inline=True)
def sensitivity(x_u, J_0, J_1, s_0, s_1, h):
    """dx/du after a step of x' = f(x, u), with df/dx and the rest of df/du at both its ends.

    Exact where df/dx is constant and the rest is linear, and damped like an L-stable rule: exp(z)
    is 1 / (1 - z + z^2/2 - z^3/6 + z^4/24), the same to fourth order.
    """
    z = 0.5 * h * (J_0 + J_1)
    first = 0.5 - z * (1.0 / 6.0 - z / 24.0)
    last = 0.5 - z * (1.0 / 3.0 - z * (0.125 - z / 24.0))
    per_exp = 1.0 - z * (1.0 - z * (0.5 - z * (1.0 / 6.0 - z / 24.0)))
    return (x_u + h * (first * s_0 + last * s_1)) / per_exp
