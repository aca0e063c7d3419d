"""Where a muscle leaves a sphere about the origin: tangent points on a great circle."""

from __future__ import annotations

import math

from ..kernel import kernel


@kernel
def plane_of_arc(radius, axis, side, tolerance, P, Q, contact):
    """Whether the line from P to Q cuts a sphere, the arc's angle, and the contact."""
    p = math.sqrt(P[0] * P[0] + P[1] * P[1] + P[2] * P[2])
    q = math.sqrt(Q[0] * Q[0] + Q[1] * Q[1] + Q[2] * Q[2])
    if p < radius or q < radius:
        return False, 0.0
    n_x, n_y, n_z = P[1] * Q[2] - P[2] * Q[1], P[2] * Q[0] - P[0] * Q[2], P[0] * Q[1] - P[1] * Q[0]
    cross = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
    d_x, d_y, d_z = Q[0] - P[0], Q[1] - P[1], Q[2] - P[2]
    square = d_x * d_x + d_y * d_y + d_z * d_z
    along = -(P[0] * d_x + P[1] * d_y + P[2] * d_z) / square if square > 0.0 else 0.0
    if not 0.0 < along < 1.0 or not cross * cross < radius * radius * square:
        return False, 0.0
    angle = math.atan2(cross, P[0] * Q[0] + P[1] * Q[1] + P[2] * Q[2])
    # How far the line passes the center on the right side, of its distance.
    passes = side * (P[axis] + along * (Q[axis] - P[axis]))
    if cross <= 1e-12 * p * q:
        # Straight through the center: towards the side, or any fixed way.
        k = axis if side != 0.0 else 0
        if side == 0.0 and abs(P[0]) > 0.9 * p:
            k = 1
        b_x = (1.0 if k == 0 else 0.0) * (side if side != 0.0 else 1.0)
        b_y = (1.0 if k == 1 else 0.0) * (side if side != 0.0 else 1.0)
        b_z = (1.0 if k == 2 else 0.0) * (side if side != 0.0 else 1.0)
        n_x, n_y, n_z = P[1] * b_z - P[2] * b_y, P[2] * b_x - P[0] * b_z, P[0] * b_y - P[1] * b_x
        cross = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
        if cross <= 1e-12 * p:
            return False, 0.0
    elif passes < -tolerance * cross / math.sqrt(square):
        angle, cross = 2.0 * math.pi - angle, -cross
    n_x, n_y, n_z = n_x / cross, n_y / cross, n_z / cross
    a, b = math.sqrt(p * p - radius * radius), math.sqrt(q * q - radius * radius)
    turn = angle - math.atan2(a, radius) - math.atan2(b, radius)
    if not turn > 0.0:
        return False, 0.0
    for row, X, distance, tangent in ((0, P, p, a), (1, Q, q, -b)):
        scale = radius / (distance * distance)
        contact[row, 0] = scale * (radius * X[0] + tangent * (n_y * X[2] - n_z * X[1]))
        contact[row, 1] = scale * (radius * X[1] + tangent * (n_z * X[0] - n_x * X[2]))
        contact[row, 2] = scale * (radius * X[2] + tangent * (n_x * X[1] - n_y * X[0]))
        x, y, z = contact[row, 0] / radius, contact[row, 1] / radius, contact[row, 2] / radius
        contact[row + 2, 0] = n_y * z - n_z * y
        contact[row + 2, 1] = n_z * x - n_x * z
        contact[row + 2, 2] = n_x * y - n_y * x
    return True, turn
