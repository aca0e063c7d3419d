"""The shortest way over an ellipsoid: a geodesic that touches the lines to P and to Q.

With D = diag(1/a^2, 1/b^2, 1/c^2) the ellipsoid is x^T D x = 1, and a geodesic of unit speed obeys

    x'' = -(x'^T D x') / |D x|^2  D x.

The points that lines through P touch are a circle in the coordinates in which the ellipsoid is a
unit sphere. Unknown are the angle phi on it and the arc s. How the end moves with phi says the
Jacobi field, j'' + K j = 0 with Gauss's curvature K = det(D) / |D x|^4 (do Carmo: Differential
Geometry of Curves and Surfaces, 1976, sections 3-3 and 5-5). A Newton iteration makes the
geodesic's end touch the line to Q.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import DOP853

from ..kernel import kernel
from .great_circle import plane_of_arc

# OpenSim mirrors the middle of a path on the wrong side; that takes it to the other side of the
# center if it was further than 45 deg off.
WRONG_SIDE = math.sqrt(0.5)
ITERATIONS = 40
ACCURACY = 1e-13  # of the angle, and of the arc relative to the ellipsoid
STEP = 0.45  # of the integration, in smallest radii of curvature

# Dormand and Prince's method of order 8: Hairer, Norsett, Wanner: Solving ODEs I (1993), II.5.
STAGES = 12
A, B = np.ascontiguousarray(DOP853.A[:STAGES, :STAGES]), np.ascontiguousarray(DOP853.B)


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
            for column in range(8):
                total = 0.0
                for k in range(i):
                    total += A[i, k] * stages[k, column]
                z[column] = y[column] + h * total
            geodesic_rate(z, inverse_squares, stages[i])
        for column in range(8):
            total = 0.0
            for k in range(STAGES):
                total += B[k] * stages[k, column]
            y[column] += h * total


@kernel
def steps_over(radii, arc):
    """Steps that a geodesic takes."""
    smallest = min(radii[0], radii[1], radii[2])
    largest = max(radii[0], radii[1], radii[2])
    return int(arc * largest / (STEP * smallest * smallest)) + 1


@kernel
def wrap_over_ellipsoid(radii, axis, side, P, Q, contact, work):
    """The geodesic, from the great circle in the sphere's coordinates as a guess.

    `work` (16, 8). Returns whether the line cuts the ellipsoid, and the arc, which is NaN if none
    was found.
    """
    y, stages = work[0], work[1:14]
    inverse_squares, scaled_P, scaled_Q = work[14, 0:3], work[14, 3:6], work[15, 0:3]
    for k in range(3):
        inverse_squares[k] = 1.0 / (radii[k] * radii[k])
        scaled_P[k], scaled_Q[k] = P[k] / radii[k], Q[k] / radii[k]
    wraps, angle = plane_of_arc(1.0, axis, side, WRONG_SIDE, scaled_P, scaled_Q, contact)
    if not wraps:
        return False, 0.0
    # The circle of touching points, |scaled_P| = p: center P/p^2, radius rho, axes e and f.
    p = math.sqrt(dot(scaled_P, scaled_P))
    rho = math.sqrt((p - 1.0) * (p + 1.0)) / p
    c_x, c_y, c_z = scaled_P[0] / p, scaled_P[1] / p, scaled_P[2] / p
    # e continues the direction in which the guess leaves the circle's axis.
    e_x, e_y, e_z = contact[2, 0], contact[2, 1], contact[2, 2]
    along = e_x * c_x + e_y * c_y + e_z * c_z
    e_x, e_y, e_z = e_x - along * c_x, e_y - along * c_y, e_z - along * c_z
    norm = math.sqrt(e_x * e_x + e_y * e_y + e_z * e_z)
    e_x, e_y, e_z = e_x / norm, e_y / norm, e_z / norm
    f_x, f_y, f_z = c_y * e_z - c_z * e_y, c_z * e_x - c_x * e_z, c_x * e_y - c_y * e_x
    arc = great_circle_length(radii, angle, contact)
    steps = steps_over(radii, arc)
    size = min(radii[0], radii[1], radii[2])
    phi = 0.0
    for _ in range(ITERATIONS):
        cos, sin = math.cos(phi), math.sin(phi)
        # Direction w from P, and what it and the point change by with phi: g and rho g.
        g_x = radii[0] * (cos * f_x - sin * e_x)
        g_y = radii[1] * (cos * f_y - sin * e_y)
        g_z = radii[2] * (cos * f_z - sin * e_z)
        w_x = radii[0] * (cos * e_x + sin * f_x - rho * p * c_x)
        w_y = radii[1] * (cos * e_y + sin * f_y - rho * p * c_y)
        w_z = radii[2] * (cos * e_z + sin * f_z - rho * p * c_z)
        norm = math.sqrt(w_x * w_x + w_y * w_y + w_z * w_z)
        y[3], y[4], y[5] = w_x / norm, w_y / norm, w_z / norm
        y[0] = P[0] + rho * w_x
        y[1] = P[1] + rho * w_y
        y[2] = P[2] + rho * w_z
        b_x, b_y, b_z = binormal(y, inverse_squares)
        across = g_x * b_x + g_y * b_y + g_z * b_z
        slide = rho * (g_x * y[3] + g_y * y[4] + g_z * y[5])
        y[6], y[7] = rho * across, across / norm
        for k in range(6):
            contact[k // 3 * 2, k % 3] = y[k]
        follow_geodesic(y, inverse_squares, arc, steps, stages)
        # The line to Q is to lie along the geodesic's end: nothing of it along n and b.
        d_x, d_y, d_z = Q[0] - y[0], Q[1] - y[1], Q[2] - y[2]
        n_x = inverse_squares[0] * y[0]
        n_y = inverse_squares[1] * y[1]
        n_z = inverse_squares[2] * y[2]
        norm = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
        n_x, n_y, n_z = n_x / norm, n_y / norm, n_z / norm
        b_x, b_y, b_z = binormal(y, inverse_squares)
        above = d_x * n_x + d_y * n_y + d_z * n_z
        beside = d_x * b_x + d_y * b_y + d_z * b_z
        ahead = d_x * y[3] + d_y * y[4] + d_z * y[5]
        turn_v = turning(y[3], y[4], y[5], n_x, n_y, n_z, d_x, d_y, d_z, above, inverse_squares)
        turn_b = turning(b_x, b_y, b_z, n_x, n_y, n_z, d_x, d_y, d_z, above, inverse_squares)
        above_s, above_phi = turn_v / norm, (turn_v * slide + turn_b * y[6]) / norm
        beside_phi = -y[6] - y[7] * ahead
        if abs(above) + abs(beside) < ACCURACY * size:
            for k in range(6):
                contact[k // 3 * 2 + 1, k % 3] = y[k]
            return True, arc
        d_phi = max(-0.3, min(0.3, -beside / beside_phi))
        d_arc = -(above + above_phi * d_phi) / above_s
        phi += d_phi
        # An arc stays one: at most halved and never more than half of the way around longer.
        arc = max(0.5 * arc, min(arc + d_arc, arc + size))
    return True, math.nan


@kernel
def binormal(y, inverse_squares):
    """n x x', the direction on the surface across the geodesic."""
    n_x, n_y, n_z = inverse_squares[0] * y[0], inverse_squares[1] * y[1], inverse_squares[2] * y[2]
    norm = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
    n_x, n_y, n_z = n_x / norm, n_y / norm, n_z / norm
    return n_y * y[5] - n_z * y[4], n_z * y[3] - n_x * y[5], n_x * y[4] - n_y * y[3]


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
