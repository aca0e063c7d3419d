"""Characteristic curves of De Groote et al. (2016) with the constants of OpenSim's
`DeGrooteFregly2016Muscle`.

All curves are normalised: lengths by the optimal fibre length or the tendon slack length, forces
by the maximum isometric force, velocities by the maximum contraction velocity. Every kernel
returns the value and its derivative.

Source: F. De Groote, A. L. Kinney, A. V. Rao, B. J. Fregly, "Evaluation of direct collocation
optimal control problem formulations for solving the muscle redundancy problem", Annals of
Biomedical Engineering 44 (2016), 2922-2936. OpenSim changed b11, d1, d2, d3, d4, c2 and c3 so that
the curves pass exactly through f_l(1) = 1, f_v(-1) = 0, f_v(0) = 1 and f_SE(1) = 0.
"""

from __future__ import annotations

import math

from ..kernel import kernel

# Active force-length: sum of three Gaussians, rows (b1, b2, b3, b4) of OpenSim.
B11, B21, B31, B41 = 0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465
B12, B22, B32, B42 = 0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188
B13, B23, B33 = 0.1, 1.0, 0.3535533905932738  # b43 = 0, b33 = sqrt(1/2)/2

# Force-velocity, OpenSim.
D1, D2, D3, D4 = -0.3211346127989808, -8.149, -0.374, 0.8825327733249912

# Passive fibre: exponent k_PE and strain e_0 at one maximum isometric force.
K_PE, E_0 = 4.0, 0.6
PASSIVE_OFFSET = math.exp(K_PE * (0.2 - 1.0) / E_0)  # the curve is zero at 0.2 optimal lengths

# Tendon: f_SE = c1 exp(k_T (l_t - c2)) - c3.
C1, C2, C3 = 0.2, 1.0, 0.2

# Outside these two limits the inverses continue along their tangents: f_v^-1 grows
# exponentially and would overflow at small activation, and the logarithm of the tendon law ends
# at f = -c3. Twice the maximum contraction velocity and a slack tendon lie well inside.
V_TANGENT = 2.0
SLACK_TANGENT = 0.02

# Constants that follow from these.
PASSIVE_SCALE = 1.0 / (math.exp(K_PE) - PASSIVE_OFFSET)
F_V_LOW = D1 * math.asinh(-D2 * V_TANGENT + D3) + D4
F_V_HIGH = D1 * math.asinh(D2 * V_TANGENT + D3) + D4
SLACK_LENGTH = math.log(SLACK_TANGENT / C1)  # times 1/k_T, beyond c2


def tendon_stiffness(strain_at_one_norm_force: float) -> float:
    """Exponent k_T of the tendon law from the strain at one maximum isometric force."""
    return math.log((1.0 + C3) / C1) / (1.0 + strain_at_one_norm_force - C2)


@kernel
def active_force_length(x):
    """f_l at the normalised fibre length `x`."""
    d1 = B31 + B41 * x
    d2 = B32 + B42 * x
    z1 = (x - B21) / d1
    z2 = (x - B22) / d2
    z3 = (x - B23) / B33
    g1 = B11 * math.exp(-0.5 * z1 * z1)
    g2 = B12 * math.exp(-0.5 * z2 * z2)
    g3 = B13 * math.exp(-0.5 * z3 * z3)
    slope = -g1 * z1 * (1.0 - z1 * B41) / d1 - g2 * z2 * (1.0 - z2 * B42) / d2 - g3 * z3 / B33
    return g1 + g2 + g3, slope


@kernel
def passive_force_length(x):
    """f_PE at the normalised fibre length `x`."""
    e = math.exp(K_PE * (x - 1.0) / E_0)
    return (e - PASSIVE_OFFSET) * PASSIVE_SCALE, e * PASSIVE_SCALE * K_PE / E_0


@kernel
def force_velocity(v):
    """f_v at the normalised fibre velocity `v`, the inverse of `inverse_force_velocity`."""
    w = min(max(v, -V_TANGENT), V_TANGENT)
    z = D2 * w + D3
    slope = D1 * D2 / math.sqrt(z * z + 1.0)
    return D1 * math.asinh(z) + D4 + slope * (v - w), slope


@kernel
def inverse_force_velocity(f):
    """Normalised fibre velocity at the force-velocity multiplier `f`."""
    g = min(max(f, F_V_LOW), F_V_HIGH)
    z = (g - D4) / D1
    sinh = math.sinh(z)
    slope = math.sqrt(1.0 + sinh * sinh) / (D1 * D2)  # cosh z
    return (sinh - D3) / D2 + slope * (f - g), slope


@kernel
def tendon_length(f, k_T):
    """Normalised tendon length at the normalised tension `f`."""
    g = f + C3
    if g < SLACK_TANGENT:
        slope = 1.0 / (k_T * SLACK_TANGENT)
        return C2 + SLACK_LENGTH / k_T + slope * (g - SLACK_TANGENT), slope
    return C2 + math.log(g / C1) / k_T, 1.0 / (k_T * g)


@kernel
def tendon_force(x, k_T):
    """f_SE at the normalised tendon length `x`, the inverse of `tendon_length`."""
    slack = C2 + SLACK_LENGTH / k_T
    if x < slack:
        slope = k_T * SLACK_TANGENT
        return SLACK_TANGENT - C3 + slope * (x - slack), slope
    e = C1 * math.exp(k_T * (x - C2))
    return e - C3, k_T * e
