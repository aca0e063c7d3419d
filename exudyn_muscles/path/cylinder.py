"""The way over a cylinder about the z axis: a helix."""

from __future__ import annotations

import math

from ..numerics.kernel import kernel
from .great_circle import INSIDE, ROUNDING

# Nothing wraps; it does but could be elsewhere; the straight line cuts the surface.
FREE, WRAPPED, CUT = range(3)

# Rows of `contact`: tangent points and the unit directions of the muscle there, from P to Q.
FIRST_POINT, SECOND_POINT, FIRST_DIRECTION, SECOND_DIRECTION = range(4)


@kernel
def wrap_over_cylinder(radius, half_length, axis, side, around, P, Q, contact):
    """A helix, which is straight in the plane into which the cylinder unrolls."""
    p, q = math.hypot(P[0], P[1]), math.hypot(Q[0], Q[1])
    if min(p, q) < INSIDE * radius:
        return FREE, 0.0
    p, q = max(p, radius), max(q, radius)
    # Seen along the axis: where the line passes the center, and the way around it.
    d_x, d_y = Q[0] - P[0], Q[1] - P[1]
    square = d_x * d_x + d_y * d_y
    cross = P[0] * Q[1] - P[1] * Q[0]
    foot = -(P[0] * d_x + P[1] * d_y)  # from P, in units of square
    between = 0.0 < foot < square
    cuts = between and cross * cross < radius * radius * square
    shorter = 1.0 if cross >= 0.0 else -1.0
    sense = shorter  # counterclockwise if positive
    if around != 0.0:
        sense = 1.0 if around > 0.0 else -1.0
    elif side != 0.0 and axis == 2:
        sense = sense_along_axis(side, P[2], Q[2], foot, square, cuts, shorter)
        if sense == 0.0:
            return FREE, 0.0
    elif side != 0.0:
        if between:
            leans = side * (d_y if axis == 0 else -d_x)
            if leans * leans > ROUNDING * ROUNDING * square:
                sense = 1.0 if leans > 0.0 else -1.0
        elif side * (P[axis] if foot <= 0.0 else Q[axis]) < -ROUNDING * radius:
            sense = -shorter
    angle = math.atan2(abs(cross), P[0] * Q[0] + P[1] * Q[1])
    if sense != shorter:
        angle = 2.0 * math.pi - angle
    a, b = math.sqrt(p * p - radius * radius), math.sqrt(q * q - radius * radius)
    turn = angle - math.atan2(a, radius) - math.atan2(b, radius)
    if not turn > 0.0:
        return FREE, 0.0
    flat, rise = a + radius * turn + b, Q[2] - P[2]
    z_1, z_2 = P[2] + rise * (a / flat), Q[2] - rise * (b / flat)
    half_length += ROUNDING * radius
    if abs(z_1) > half_length and abs(z_2) > half_length:
        return FREE, 0.0
    length = math.hypot(flat, rise)
    # The tangent points are seen from the axis at acos(radius / p) from P and likewise from Q.
    for row, x, y, distance, tangent, z in (
        (FIRST_POINT, P[0], P[1], p, sense * a, z_1),
        (SECOND_POINT, Q[0], Q[1], q, -sense * b, z_2),
    ):
        scale = radius / (distance * distance)
        contact[row, 0] = scale * (radius * x - tangent * y)
        contact[row, 1] = scale * (radius * y + tangent * x)
        contact[row, 2] = z
        around = sense * flat / (length * radius)
        contact[row + 2, 0] = -around * contact[row, 1]
        contact[row + 2, 1] = around * contact[row, 0]
        contact[row + 2, 2] = rise / length
    return CUT if cuts else WRAPPED, radius * turn * length / flat


@kernel
def sense_along_axis(side, z_P, z_Q, foot, square, cuts, shorter):
    """The way around a cylinder whose side is one of z, as OpenSim's comes about: 0 if none.

    With one end on that side, or both, muscles wrap that cut the cylinder, or whose ends are on
    different sides while the point next to the axis is not on the given one; with none of them all
    muscles wrap, the longer way.
    """
    on_P, on_Q = (z_P >= 0.0) == (side > 0.0), (z_Q >= 0.0) == (side > 0.0)
    if not (on_P or on_Q):
        return -shorter
    nearest = z_P + (foot / square) * (z_Q - z_P) if square > 0.0 else z_P
    if not cuts and (on_P == on_Q or (nearest >= 0.0) == (side > 0.0)):
        return 0.0
    return -1.0 if on_Q else 1.0
