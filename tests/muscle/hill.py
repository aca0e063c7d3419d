"""The muscle equations once more, in plain Python and written from the formulas of their sources.

An independent oracle: nothing here comes from the package except a muscle's parameters.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

import exudyn_muscles as em

WINDOW = 0.010


def active(x):
    rows = [
        (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
        (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
        (0.1, 1.0, 0.353553390593274, 0.0),
    ]
    return sum(b1 * math.exp(-0.5 * ((x - b2) / (b3 + b4 * x)) ** 2) for b1, b2, b3, b4 in rows)


def passive(x):
    offset = math.exp(4.0 * (0.2 - 1.0) / 0.6)
    return (math.exp(4.0 * (x - 1.0) / 0.6) - offset) / (math.exp(4.0) - offset)


def multiplier(v):
    """Force-velocity curve without its tangents, OpenSim's constants."""
    d1, d2, d3, d4 = -0.3211346127989808, -8.149, -0.374, 0.8825327733249912
    z = d2 * v + d3
    return d1 * math.log(z + math.sqrt(z * z + 1.0)) + d4


def velocity(f):
    """Inverse of `multiplier`, continued by its tangents beyond two maximum velocities."""
    d1, d2, d3, d4 = -0.3211346127989808, -8.149, -0.374, 0.8825327733249912
    for end in (-2.0, 2.0):
        edge = multiplier(end)
        if (f - edge) * end > 0.0:
            return end + (f - edge) * math.sqrt((d2 * end + d3) ** 2 + 1.0) / (d1 * d2)
    return (math.sinh((f - d4) / d1) - d3) / d2


def tendon(muscle, f):
    """Tendon length [m] at the normalised force `f`, and its derivative with respect to f."""
    k = math.log(6.0) / muscle.tendon_strain_at_one_norm_force
    g = max(f + 0.2, 0.02)  # a tangent below: the logarithm ends at f = -0.2
    strain = math.log(g / 0.2) / k + (f + 0.2 - g) / (k * g)
    return muscle.tendon_slack_length * (1.0 + strain), muscle.tendon_slack_length / (k * g)


def width(muscle):
    return muscle.optimal_fiber_length * math.sin(muscle.pennation_angle_at_optimal)


def shortest(muscle):
    """Projection of the shortest fibre: 0.2 optimal lengths or the maximum pennation."""
    fiber = 0.2 * muscle.optimal_fiber_length
    if width(muscle) > 0.0:
        fiber = max(fiber, width(muscle) / math.sin(muscle.maximum_pennation_angle))
    return math.sqrt(fiber**2 - width(muscle) ** 2)


def stop(muscle):
    """Range of the projection over which the fibre stops."""
    return 0.01 * muscle.optimal_fiber_length


def length(muscle, F, fiber):
    """Musculotendon length [m] of a unit with the tension `F` and the fibre length `fiber`."""
    p = math.sqrt(max(fiber**2 - width(muscle) ** 2, shortest(muscle) ** 2))
    return p + tendon(muscle, F / muscle.max_isometric_force)[0]


def load(muscle, F, l):
    """Fibre length over the optimal one, cos(alpha), and fibre force over F0, (3,)."""
    f = F / muscle.max_isometric_force
    p = max(l - tendon(muscle, f)[0], shortest(muscle))
    fiber = math.hypot(p, width(muscle))
    x = fiber / muscle.optimal_fiber_length
    return x, p / fiber, f / (p / fiber) - passive(x)


def rate(muscle, a, F, l, v):
    """F' of (4) [N/s]."""
    x, cos, active_force = load(muscle, F, l)
    v_m = velocity(active_force / (a * active(x)))
    v_m *= muscle.max_contraction_velocity * muscle.optimal_fiber_length
    taut, compliance = tendon(muscle, F / muscle.max_isometric_force)
    if v_m < 0.0:  # shortening dies out over the last hundredth of the optimal length
        v_m *= min(max((l - taut - shortest(muscle)) / stop(muscle), 0.0), 1.0)
    return muscle.max_isometric_force * (v - v_m / cos) / compliance


def activation(muscle, a, u, t):
    rises = u > a
    tau = muscle.activation_time_constant if rises else muscle.deactivation_time_constant
    return u + (a - u) * math.exp(-t / tau)


def cubic(t, h, l_0, v_0, l_1, v_1):
    """Length and speed at the time `t` of the cubic through both ends."""
    s = t / h
    l = (
        l_0 * (1 + 2 * s) * (1 - s) ** 2
        + h * v_0 * s * (1 - s) ** 2
        + l_1 * s * s * (3 - 2 * s)
        + h * v_1 * s * s * (s - 1)
    )
    v = 6 * s * (1 - s) * (l_1 - l_0) / h + v_0 * (1 - s) * (1 - 3 * s) + v_1 * s * (3 * s - 2)
    return l, v


def window(muscle, a, F, u, l_0, v_0, l_1, v_1, h=WINDOW):
    """Force at the end of a window with held excitation, to some 1e-11 F0."""
    F0 = muscle.max_isometric_force

    def slope(t, f):
        l, v = cubic(t, h, l_0, v_0, l_1, v_1)
        return [rate(muscle, activation(muscle, a, u, t), F0 * f[0], l, v) / F0]

    def jacobian(t, f):
        step = 1e-7
        return [[(slope(t, f + step)[0] - slope(t, f - step)[0]) / (2.0 * step)]]

    run = solve_ivp(slope, (0, h), [F / F0], method="Radau", jac=jacobian, rtol=1e-11, atol=1e-12)
    assert run.success, run.message
    return F0 * run.y[0, -1]


def draw(rng):
    """A unit and a window somewhere in the allowed box: (muscle, a, F, u, l_0, v_0, l_1, v_1)."""
    optimal = rng.uniform(0.04, 0.2)
    muscle = em.Muscle(
        "unit",
        max_isometric_force=10.0 ** rng.uniform(1.5, 4.0),
        optimal_fiber_length=optimal,
        tendon_slack_length=optimal * 10.0 ** rng.uniform(-1.0, 1.0),
        pennation_angle_at_optimal=rng.uniform(0.0, 0.5),
    )
    # Low activations are the hard ones: a third of the draws is spread over their logarithm.
    a = rng.uniform(0.01, 1.0) if rng.random() < 0.67 else 0.01 ** rng.random()
    u = rng.choice([0.01, 1.0, rng.uniform(0.01, 1.0)])
    F = rng.uniform(-0.1, 2.0) * muscle.max_isometric_force
    l_0 = length(muscle, F, rng.uniform(0.3, 1.8) * optimal)
    while True:
        # The speed is a parabola; all of it stays within 15 optimal lengths/s.
        v_0, middle, v_1 = 15.0 * optimal * rng.uniform(-1.0, 1.0, 3)
        s = np.linspace(0.0, 1.0, 101)
        speed = v_0 * (1 - s) * (1 - 2 * s) + middle * 4 * s * (1 - s) + v_1 * s * (2 * s - 1)
        if np.abs(speed).max() <= 15.0 * optimal:
            break
    l_1 = l_0 + WINDOW * (v_0 + 4.0 * middle + v_1) / 6.0
    return muscle, a, F, u, l_0, v_0, l_1, v_1
