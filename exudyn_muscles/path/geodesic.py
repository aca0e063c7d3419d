"""The shortest way over an ellipsoid: a geodesic that touches the lines to P and to Q.

With D = diag(1/a^2, 1/b^2, 1/c^2) the ellipsoid is x^T D x = 1, and a geodesic of unit speed obeys

    x'' = -(x'^T D x') / |D x|^2  D x.

The points that lines through P touch are a circle in the coordinates in which the ellipsoid is a
unit sphere. Unknown are the angle phi on it and the arc s. How the end moves with phi says the
Jacobi field, j'' + K j = 0 with Gauss's curvature K = det(D) / |D x|^4 (do Carmo: Differential
Geometry of Curves and Surfaces, 1976, sections 3-3 and 5-5). A Newton iteration makes the
geodesic's end touch the line to Q: Q is to lie in the tangent plane there. Two places fulfil that,
one before and one behind Q, and close to the surface these are too near each other for Newton's
method. There the iteration goes by the angle under which the end and Q are seen from the center.
"""

from __future__ import annotations

import math

from ..numerics.kernel import kernel
from .dormand_prince import STAGES, A, B
from .great_circle import plane_of_arc

# OpenSim mirrors the middle of a path on the wrong side; that takes it to the other side of the
# center if it was further than 45 deg off.
WRONG_SIDE = math.sqrt(0.5)
ITERATIONS = 25
LARGEST_TURN = 0.3  # of phi in one of them
PARTS = (1, 4, 16)  # of the way from the sphere to the ellipsoid
ACCURACY = 1e-13  # with which the end touches the line to Q, relative to their sizes
CLOSE = 1e-3  # that angle in the sphere's coordinates [rad] where Q counts as close
STEP = 0.35  # of the integration, in smallest radii of curvature


@kernel
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def geodesic_rate(y, inverse_squares, dy):
    """y = (x, x', j, j')."""
    d_x, d_y, d_z = inverse_squares[0], inverse_squares[1], inverse_squares[2]
    n_x, n_y, n_z = d_x * y[0], d_y * y[1], d_z * y[2]
    square = 1.0 / (n_x * n_x + n_y * n_y + n_z * n_z)
    pull = -(d_x * y[3] * y[3] + d_y * y[4] * y[4] + d_z * y[5] * y[5]) * square
    dy[0], dy[1], dy[2] = y[3], y[4], y[5]
    dy[3], dy[4], dy[5] = pull * n_x, pull * n_y, pull * n_z
    dy[6] = y[7]
    dy[7] = -d_x * d_y * d_z * square * square * y[6]


@kernel
def follow_geodesic(y, inverse_squares, arc, steps, stages):
    """Go on by `arc` from y (8,); `stages` (13, 8) is for the work."""
    h = arc / steps
    z = stages[STAGES]
    for _ in range(steps):
        for i in range(STAGES):
            weighted(A[i], stages, i, z)
            for column in range(8):
                z[column] = y[column] + h * z[column]
            geodesic_rate(z, inverse_squares, stages[i])
        weighted(B, stages, STAGES, z)
        for column in range(8):
            y[column] += h * z[column]


@kernel(inline=True)
def weighted(weights, stages, count, z):
    """Write the sum (8,) of the first stages with these weights; written out, as processors add
    several columns at once."""
    a = b = c = d = e = f = g = h = 0.0
    for k in range(count):
        weight = weights[k]
        if weight != 0.0:
            a, b, c = (
                a + weight * stages[k, 0],
                b + weight * stages[k, 1],
                c + weight * stages[k, 2],
            )
            d, e, f = (
                d + weight * stages[k, 3],
                e + weight * stages[k, 4],
                f + weight * stages[k, 5],
            )
            g, h = g + weight * stages[k, 6], h + weight * stages[k, 7]
    z[0], z[1], z[2], z[3], z[4], z[5], z[6], z[7] = a, b, c, d, e, f, g, h


@kernel
def steps_over(radii, arc):
    """Steps that a geodesic takes."""
    smallest = min(radii[0], radii[1], radii[2])
    largest = max(radii[0], radii[1], radii[2])
    return int(arc * largest / (STEP * smallest * smallest)) + 1


@kernel
def wrap_over_ellipsoid(radii, axis, side, around, P, Q, contact, work):
    """The geodesic, from the great circle in the sphere's coordinates as a guess.

    Where that is too far off, the sphere is deformed into the ellipsoid in steps. `work` (20, 8).
    Returns whether the line cuts the ellipsoid, and the arc, which is NaN if none was found.
    """
    shape, scaled_P, scaled_Q, frame = work[14, :3], work[14, 3:6], work[15, :3], work[16:19, :3]
    scaled_around = work[16, 3:6]
    for k in range(3):
        scaled_P[k], scaled_Q[k] = P[k] / radii[k], Q[k] / radii[k]
        scaled_around[k] = around[k] * radii[k]  # of a cross product but for a factor
    wraps, angle, shortest = plane_of_arc(
        1.0, axis, side, WRONG_SIDE, scaled_around, scaled_P, scaled_Q, contact
    )
    if not wraps:
        return False, 0.0
    # Axes of the circle of touching points: c towards P, and e continues the guess.
    p = max(1.0, math.sqrt(dot(scaled_P, scaled_P)))
    along = dot(contact[2], scaled_P) / (p * p)
    for k in range(3):
        frame[0, k] = scaled_P[k] / p
        frame[1, k] = contact[2, k] - along * scaled_P[k]
    norm = math.sqrt(dot(frame[1], frame[1]))
    for k in range(3):
        frame[1, k] /= norm
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        frame[2, k] = frame[0, i] * frame[1, j] - frame[0, j] * frame[1, i]
    guess = work[19]
    for k in range(6):
        guess[k] = contact[k // 3 * 2, k % 3]
    mean = (radii[0] * radii[1] * radii[2]) ** (1.0 / 3.0)
    # Where the tangent plane leads nowhere the angle does.
    for by_angle in (dot(scaled_Q, scaled_Q) < 1.0 + CLOSE * CLOSE, True):
        for parts in PARTS:
            phi, ratio, found = 0.0, 1.0, True
            for part in range(1, parts + 1):
                for k in range(3):
                    shape[k] = radii[k]
                    if part < parts:
                        shape[k] = mean * (radii[k] / mean) ** (part / parts)
                    contact[0, k], contact[2, k] = guess[k], guess[3 + k]
                length = great_circle_length(shape, angle, contact)
                found, phi, arc = touch(
                    shape, scaled_P, scaled_Q, p, frame, shortest, by_angle, phi, ratio * length,
                    contact, work,
                )  # fmt: skip
                if not found:
                    break
                ratio = arc / length
            if found:
                return True, arc
    return True, math.nan


@kernel
def touch(radii, scaled_P, scaled_Q, p, frame, shortest, by_angle, phi, arc, contact, work):
    """Newton's iteration for phi and the arc; returns whether it found them, and both.

    A geodesic may also be the longest among its neighbours, a saddle over the large axis of the
    ellipsoid. Where the `shortest` is wanted the iteration goes downhill and on from there.
    """
    y, stages, inverse_squares = work[0], work[1:14], work[15, 3:6]
    rho = math.sqrt((p - 1.0) * (p + 1.0)) / p
    for k in range(3):
        inverse_squares[k] = 1.0 / (radii[k] * radii[k])
    c, e, f = frame[0], frame[1], frame[2]
    size = min(radii[0], radii[1], radii[2])
    steps = 1
    for _ in range(ITERATIONS):
        cos, sin = math.cos(phi), math.sin(phi)
        # w from P to the tangent point is the direction there, g its change with phi.
        w_w = g_w = 0.0
        for k in range(3):
            w = radii[k] * (cos * e[k] + sin * f[k] - rho * p * c[k])
            g = radii[k] * (cos * f[k] - sin * e[k])
            w_w, g_w = w_w + w * w, g_w + g * w
            y[k] = radii[k] * scaled_P[k] + rho * w
            y[3 + k] = w
        norm = math.sqrt(w_w)
        for k in range(3):
            y[3 + k] /= norm
        b_x, b_y, b_z = binormal(y, inverse_squares)
        across = b_x * radii[0] * (cos * f[0] - sin * e[0])
        across += b_y * radii[1] * (cos * f[1] - sin * e[1])
        across += b_z * radii[2] * (cos * f[2] - sin * e[2])
        slide = rho * g_w / norm
        y[6], y[7] = rho * across, across / norm
        for k in range(6):
            contact[k // 3 * 2, k % 3] = y[k]
        steps = max(steps, steps_over(radii, arc))
        follow_geodesic(y, inverse_squares, arc, steps, stages)
        # The line to Q is to lie along the geodesic's end: nothing of it along n and b.
        d_x, d_y = radii[0] * scaled_Q[0] - y[0], radii[1] * scaled_Q[1] - y[1]
        d_z = radii[2] * scaled_Q[2] - y[2]
        n_x, n_y = inverse_squares[0] * y[0], inverse_squares[1] * y[1]
        n_z = inverse_squares[2] * y[2]
        norm = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
        n_x, n_y, n_z = n_x / norm, n_y / norm, n_z / norm
        b_x, b_y, b_z = binormal(y, inverse_squares)
        above = d_x * n_x + d_y * n_y + d_z * n_z
        beside = d_x * b_x + d_y * b_y + d_z * b_z
        ahead = d_x * y[3] + d_y * y[4] + d_z * y[5]
        # The second derivative of the length by phi, but for a factor: the end's Jacobi field.
        bend = y[6] + y[7] * ahead
        missing, sway = above, 0.0
        if by_angle:
            missing, sway = arc_to_go(y, b_x, b_y, b_z, radii, inverse_squares, scaled_Q)
        if abs(missing) + abs(beside) < ACCURACY * (size + abs(ahead)):
            if shortest and bend < 0.0:
                phi += LARGEST_TURN
                continue
            for k in range(6):
                contact[k // 3 * 2 + 1, k % 3] = y[k]
            return by_angle or ahead > -size * ACCURACY, phi, arc
        d_phi = beside / (abs(bend) if shortest else bend)
        d_phi = max(-LARGEST_TURN, min(LARGEST_TURN, d_phi))
        if by_angle:
            arc_ahead = missing - (slide + sway * y[6]) * d_phi
        else:
            turn_v = turning(y[3], y[4], y[5], n_x, n_y, n_z, d_x, d_y, d_z, above, inverse_squares)
            turn_b = turning(b_x, b_y, b_z, n_x, n_y, n_z, d_x, d_y, d_z, above, inverse_squares)
            arc_ahead = -(above * norm + (turn_v * slide + turn_b * y[6]) * d_phi) / turn_v
        phi += d_phi
        arc = max(0.5 * arc, min(arc + arc_ahead, arc + size))
    return False, phi, arc


@kernel
def binormal(y, inverse_squares):
    """n x x', the direction on the surface across the geodesic."""
    n_x, n_y, n_z = inverse_squares[0] * y[0], inverse_squares[1] * y[1], inverse_squares[2] * y[2]
    norm = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
    n_x, n_y, n_z = n_x / norm, n_y / norm, n_z / norm
    return n_y * y[5] - n_z * y[4], n_z * y[3] - n_x * y[5], n_x * y[4] - n_y * y[3]


@kernel
def arc_to_go(y, b_x, b_y, b_z, radii, inverse_squares, scaled_Q):
    """How much arc is missing for the end to see Q under the right angle from the center, in the
    sphere's coordinates, and how much of it a move by one along the binormal brings."""
    D_x, D_y, D_z = inverse_squares[0] * y[3], inverse_squares[1] * y[4], inverse_squares[2] * y[5]
    square = y[3] * D_x + y[4] * D_y + y[5] * D_z
    speed = math.sqrt(square)
    below = ahead = 0.0
    for k in range(3):
        below += y[k] / radii[k] * scaled_Q[k]
        ahead += y[3 + k] / radii[k] * scaled_Q[k]
    angle = math.atan2(ahead / speed, below)
    right = math.atan(math.sqrt(max(dot(scaled_Q, scaled_Q) - 1.0, 0.0)))
    return (angle - right) / speed, (b_x * D_x + b_y * D_y + b_z * D_z) / square


@kernel
def turning(t_x, t_y, t_z, n_x, n_y, n_z, d_x, d_y, d_z, above, inverse_squares):
    """d . (change of the normal along t), times |D x|."""
    D_x, D_y, D_z = inverse_squares[0] * t_x, inverse_squares[1] * t_y, inverse_squares[2] * t_z
    return d_x * D_x + d_y * D_y + d_z * D_z - above * (n_x * D_x + n_y * D_y + n_z * D_z)


@kernel
def great_circle_length(radii, angle, contact):
    """Length on the ellipsoid of the sphere's arc from contact[0] along contact[2]: chords."""
    length = 0.0
    last_x, last_y, last_z = contact[0, 0], contact[0, 1], contact[0, 2]
    for k in range(1, 9):
        cos, sin = math.cos(angle * k / 8.0), math.sin(angle * k / 8.0)
        x = cos * contact[0, 0] + sin * contact[2, 0]
        y = cos * contact[0, 1] + sin * contact[2, 1]
        z = cos * contact[0, 2] + sin * contact[2, 2]
        length += math.sqrt(
            (radii[0] * (x - last_x)) ** 2
            + (radii[1] * (y - last_y)) ** 2
            + (radii[2] * (z - last_z)) ** 2
        )
        last_x, last_y, last_z = x, y, z
    return length
