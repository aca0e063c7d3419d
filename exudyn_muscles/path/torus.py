"""The way through the hole of a torus, over the tube on one side of it.

As in OpenSim it is a helix over a cylinder that is the tube's at one place of its circle, with the
tube's radius and on its inner side. OpenSim takes the place next to the line from P to Q. Here that
is where the search begins, and the place is the one that holds the muscle most: of all such
cylinders, which are one turned about the torus's axis, it makes the muscle longest. So the length
is stationary, the muscle's moment about the axis is the same before and behind the tube, as of a
geodesic on any surface of revolution, and moment arms are -dl/dq.
"""

from __future__ import annotations

import math

from ..numerics.kernel import kernel
from .cylinder import FREE, wrap_over_cylinder

# Steps of the search for the place: the first one [rad], how many, and what is left of a moment
# over a way.
FIRST_STEP, MOST_STEPS, AT_REST = 1e-3, 80, 1e-15


@kernel
def wrap_over_torus(tube, circle, axis, side, P, Q, contact, work):
    """Write the contact (4, 3) and return FREE, WRAPPED or CUT, and the arc.

    `tube` and `circle` are the radii of the tube and of the circle that it is around, which has the
    z axis; a `side` asks the line to pass the circle there. `work` (20, 8).
    """
    place, found = place_next_to(circle, axis, side, P, Q)
    if not found:
        return FREE, 0.0
    status, moment, arc = at_place(place, tube, circle, P, Q, contact, work)
    if status == FREE:
        return FREE, 0.0
    size = AT_REST * (abs(P[0]) + abs(P[1]) + abs(Q[0]) + abs(Q[1]))
    # From place to place the muscle gets longer as long as the moment is positive.
    step = math.copysign(FIRST_STEP, moment)
    other, other_moment = place, moment
    for _ in range(MOST_STEPS):
        if abs(moment) <= size:
            return status, arc
        other = place + step
        status, other_moment, arc = at_place(other, tube, circle, P, Q, contact, work)
        if other_moment * moment <= 0.0:
            break
        place, moment, step = other, other_moment, 2.0 * step
    # Regula falsi, with half of an end's moment if it stays (Illinois); where an end is free of the
    # cylinder, by halves.
    for _ in range(MOST_STEPS):
        middle = 0.5 * (place + other)
        if other_moment != 0.0:
            middle = (other * moment - place * other_moment) / (moment - other_moment)
        status, middle_moment, arc = at_place(middle, tube, circle, P, Q, contact, work)
        if status != FREE and (abs(middle_moment) <= size or middle in (place, other)):
            return status, arc
        if middle_moment * moment > 0.0:
            place, moment = middle, middle_moment
            other_moment *= 0.5
        else:
            other, other_moment = middle, middle_moment
            moment *= 0.5
    status, moment, arc = at_place(place, tube, circle, P, Q, contact, work)
    return status, arc


@kernel
def place_next_to(circle, axis, side, P, Q):
    """The angle of the place on the circle that is next to the line through P and Q, and whether
    there is any.

    Along the line from P by t the square of the distance has the slope 2 g,
    g = t + c - circle (a t + b) / rho, and on either side of the circle's axis one minimum at most.
    """
    n_x, n_y, n_z = Q[0] - P[0], Q[1] - P[1], Q[2] - P[2]
    length = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
    if length == 0.0:
        return 0.0, False
    n_x, n_y, n_z = n_x / length, n_y / length, n_z / length
    a, b = n_x * n_x + n_y * n_y, P[0] * n_x + P[1] * n_y
    c = b + P[2] * n_z
    least, place, found = math.inf, 0.0, False
    for way in (-1.0, 1.0):
        # From beyond the minimum, where Newton's method runs towards it.
        t = way * circle * math.sqrt(a) - c
        if a > 0.0 and way * (t + b / a) < 0.0:
            t = -b / a
        for _ in range(50):
            x, y = P[0] + t * n_x, P[1] + t * n_y
            rho = math.sqrt(x * x + y * y)
            if rho == 0.0:
                break
            g = t + c - circle * (a * t + b) / rho
            slope = 1.0 - circle * (a - (a * t + b) ** 2 / (rho * rho)) / rho
            if slope <= 0.0:
                break
            t -= g / slope
            if abs(g) <= 1e-14 * (circle + abs(t)):
                break
        x, y, z = P[0] + t * n_x, P[1] + t * n_y, P[2] + t * n_z
        rho = math.sqrt(x * x + y * y)
        value = x if axis == 0 else y if axis == 1 else z
        away = (rho - circle) ** 2 + z * z
        if rho > 0.0 and away < least and side * value >= 0.0:
            least, place, found = away, math.atan2(y, x), True
    return place, found


@kernel
def at_place(place, tube, circle, P, Q, contact, work):
    """Write the contact with the cylinder at a place; returns FREE, WRAPPED or CUT, by how much the
    moment about the circle's axis differs before and behind it, and the arc."""
    cos, sin = math.cos(place), math.sin(place)
    p, q, own = work[0, :3], work[1, :3], work[2:6, :3]
    # Its axes in the torus: x towards the center, y along -z.
    for given, local in ((P, p), (Q, q)):
        local[0] = circle - cos * given[0] - sin * given[1]
        local[1] = -given[2]
        local[2] = sin * given[0] - cos * given[1]
    status, arc = wrap_over_cylinder(tube, math.inf, 0, 1.0, 0.0, p, q, own)
    if status == FREE:
        return FREE, 0.0, 0.0
    for row in range(4):
        x = own[row, 0] - circle if row < 2 else own[row, 0]
        contact[row, 0] = sin * own[row, 2] - cos * x
        contact[row, 1] = -sin * x - cos * own[row, 2]
        contact[row, 2] = -own[row, 1]
    moment = contact[0, 0] * contact[2, 1] - contact[0, 1] * contact[2, 0]
    moment -= contact[1, 0] * contact[3, 1] - contact[1, 1] * contact[3, 0]
    return status, moment, arc
