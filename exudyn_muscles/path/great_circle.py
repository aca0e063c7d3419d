"""Where a muscle leaves a sphere about the origin: tangent points on a great circle."""

from __future__ import annotations

import math

from ..numerics.kernel import kernel

# What is so little inside, beyond an edge or on the wrong side is not [radii, or of a direction].
ROUNDING = 1e-9
INSIDE = 1.0 - ROUNDING


@kernel
def plane_of_arc(radius, axis, side, tolerance, around, P, Q, contact):
    """Whether the line from P to Q cuts a sphere; the arc's angle; whether it is the shorter way.

    Writes the contact (4, 3). It is the longer way where the line passes the center on the wrong
    side, further than `tolerance` of its distance; or the way that turns about `around` (3,), if
    that is not zero.
    """
    p = math.sqrt(P[0] * P[0] + P[1] * P[1] + P[2] * P[2])
    q = math.sqrt(Q[0] * Q[0] + Q[1] * Q[1] + Q[2] * Q[2])
    if min(p, q) < INSIDE * radius:
        return False, 0.0, True
    p, q = max(p, radius), max(q, radius)
    n_x, n_y, n_z = P[1] * Q[2] - P[2] * Q[1], P[2] * Q[0] - P[0] * Q[2], P[0] * Q[1] - P[1] * Q[0]
    cross = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
    d_x, d_y, d_z = Q[0] - P[0], Q[1] - P[1], Q[2] - P[2]
    square = d_x * d_x + d_y * d_y + d_z * d_z
    along = -(P[0] * d_x + P[1] * d_y + P[2] * d_z) / square if square > 0.0 else 0.0
    if not 0.0 < along < 1.0 or not cross * cross < radius * radius * square:
        return False, 0.0, True
    angle = math.atan2(cross, P[0] * Q[0] + P[1] * Q[1] + P[2] * Q[2])
    # How far the line passes the center on the right side.
    passes = side * (P[axis] + along * (Q[axis] - P[axis]))
    wrong = passes < -tolerance * cross / math.sqrt(square)
    if around[0] != 0.0 or around[1] != 0.0 or around[2] != 0.0:
        wrong = n_x * around[0] + n_y * around[1] + n_z * around[2] < 0.0
    shorter = True
    if cross <= 1e-12 * p * q:
        # Straight through the center: towards the side, or any axis across the line.
        k, sign = axis, side
        if side == 0.0 or abs(P[axis]) > 0.9 * p:
            k, sign = (0 if abs(P[0]) < 0.9 * p else 1), 1.0
        i, j = (k + 1) % 3, (k + 2) % 3
        contact[0, k], contact[0, i], contact[0, j] = 0.0, sign * P[j], -sign * P[i]
        n_x, n_y, n_z = contact[0, 0], contact[0, 1], contact[0, 2]
        cross = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
    elif wrong:
        angle, cross, shorter = 2.0 * math.pi - angle, -cross, False
    n_x, n_y, n_z = n_x / cross, n_y / cross, n_z / cross
    a, b = math.sqrt(p * p - radius * radius), math.sqrt(q * q - radius * radius)
    turn = angle - math.atan2(a, radius) - math.atan2(b, radius)
    if not turn > 0.0:
        return False, 0.0, True
    for row, X, distance, tangent in ((0, P, p, a), (1, Q, q, -b)):
        scale = radius / (distance * distance)
        contact[row, 0] = scale * (radius * X[0] + tangent * (n_y * X[2] - n_z * X[1]))
        contact[row, 1] = scale * (radius * X[1] + tangent * (n_z * X[0] - n_x * X[2]))
        contact[row, 2] = scale * (radius * X[2] + tangent * (n_x * X[1] - n_y * X[0]))
        x, y, z = contact[row, 0] / radius, contact[row, 1] / radius, contact[row, 2] / radius
        contact[row + 2, 0] = n_y * z - n_z * y
        contact[row + 2, 1] = n_z * x - n_x * z
        contact[row + 2, 2] = n_x * y - n_y * x
    return True, turn, shorter
