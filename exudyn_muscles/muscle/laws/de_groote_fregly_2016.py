"""The curves of De Groote et al. (2016), in two sets of constants.

F. De Groote, A. L. Kinney, A. V. Rao, B. J. Fregly, "Evaluation of direct collocation optimal
control problem formulations for solving the muscle redundancy problem", Annals of Biomedical
Engineering 44 (2016), 2922-2936.

`DeGrooteFregly2016` has the constants of OpenSim's class of that name, changed so that the curves
pass exactly through f_l(1) = 1, f_v(-1) = 0, f_v(0) = 1 and f_SE(1) = 0.
`DeGrooteFregly2016Published` has those of the authors' own code.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...numerics.curves import Curve
from .law import STRONGEST, HillCurves, MuscleLaw

# Active force-length: three Gaussians, rows (b1, b2, b3, b4); OpenSim changed the first b1.
GAUSSIANS = (
    (0.814483478343008, 1.05503342897057, 0.162384573599574, 0.0633034484654646),
    (0.433004984392647, 0.716775413397760, -0.0299471169706956, 0.200356847296188),
    (0.1, 1.0, 0.5 * math.sqrt(0.5), 0.0),
)
OPENSIM_GAUSSIANS = (
    (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
    (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
    (0.1, 1.0, 0.353553390593274, 0.0),
)
# Force-velocity: d1, d2, d3, d4.
FORCE_VELOCITY = (-0.318323436899127, -8.14915604347525, -0.374121508647863, 0.885644059915004)
OPENSIM_FORCE_VELOCITY = (-0.3211346127989808, -8.149, -0.374, 0.8825327733249912)
# Passive fibre: exponent k_PE, and the strain at one maximum isometric force.
K_PE, STRAIN = 4.0, 0.6
ZERO_LENGTH = 0.2  # fibre length where the passive force is zero, and the shortest one in use
# Tendon: f_SE = c1 exp(k_T (l_t - c2)) - c3; OpenSim changed c2 to 1, too.
C_1, C_2, C_3, K_T = 0.2, 0.995, 0.25, 35.0
OPENSIM_C_3 = 0.2
# Beyond ten times the maximum contraction velocity, faster than any motion is, f_v and its inverse
# go on along their tangents: the inverse grows exponentially, and with it the stiffness of weak
# fibres under high force, beyond what can be integrated. Few units get beyond the usual range,
# which has its pieces to itself.
USUAL, FASTEST = 2.0, 10.0
# Farther ends of the curves: normalised fibre length, and tendon strain over e0.
LONGEST = 3.0
TENDON = (-20.0, 3.0)


def active_force_length(x, gaussians, width_scale=1.0):
    """f_l: a sum of Gaussians whose width grows with the length."""
    s = (x - 1.0) / width_scale + 1.0
    return sum(
        b_1 * np.exp(-0.5 * ((s - b_2) / (b_3 + b_4 * s)) ** 2) for b_1, b_2, b_3, b_4 in gaussians
    )


def force_velocity(v, d_1, d_2, d_3, d_4):
    """f_v; the logarithm of the source is an inverse hyperbolic sine."""
    return d_1 * np.arcsinh(d_2 * v + d_3) + d_4


def inverse_force_velocity(f, d_1, d_2, d_3, d_4):
    """Closed-form inverse of `force_velocity`."""
    return (np.sinh((f - d_4) / d_1) - d_3) / d_2


def force_velocity_curves(constants: tuple[float, float, float, float]) -> tuple[Curve, Curve]:
    """f_v and its inverse."""
    v = [-FASTEST, -USUAL, USUAL, FASTEST]
    f = force_velocity(np.array(v), *constants).tolist()
    return (
        Curve(lambda v: force_velocity(v, *constants), v),
        Curve(lambda f: inverse_force_velocity(f, *constants), f),
    )


@dataclass(frozen=True, kw_only=True)
class DeGrooteFregly2016(MuscleLaw):
    """OpenSim's `DeGrooteFregly2016Muscle`.

    Parameters
    ----------
    active_force_width_scale : float
        Stretches f_l about the optimal length, at least 1.
    passive_fiber_strain_at_one_norm_force : float
        Fibre strain at which the passive force is F0.
    fiber_damping : float
        OpenSim ignores it in units with an elastic tendon in its explicit form.
    ignore_passive_fiber_force : bool
        The passive fibre pulls with nothing.
    """

    active_force_width_scale: float = 1.0
    passive_fiber_strain_at_one_norm_force: float = STRAIN
    fiber_damping: float = 0.0
    ignore_passive_fiber_force: bool = False

    # Not fields: every unit of this law has them.
    tendon_strain_at_one_norm_force = 0.049
    shortest_fiber = ZERO_LENGTH

    def __post_init__(self) -> None:
        for name, low, high in (
            ("active_force_width_scale", 1.0, 10.0),
            ("passive_fiber_strain_at_one_norm_force", 0.01, 10.0),
            ("fiber_damping", 0.0, 10.0),
        ):
            self.keep_number(name, low, high)

    def make_curves(self, elastic: bool) -> HillCurves:
        strain = self.passive_fiber_strain_at_one_norm_force
        offset = math.exp(K_PE * (ZERO_LENGTH - 1.0) / strain)
        longest = min(LONGEST, 1.0 + strain * (math.log(STRONGEST) / K_PE + 1.0))
        full = math.inf if self.ignore_passive_fiber_force else math.exp(K_PE) - offset
        growth = math.log((1.0 + OPENSIM_C_3) / C_1)  # k_T times the strain at one F0
        return HillCurves(
            Curve(
                lambda x: active_force_length(x, OPENSIM_GAUSSIANS, self.active_force_width_scale),
                (0.0, LONGEST),
                (0.0, 0.0),
            ),
            *force_velocity_curves(OPENSIM_FORCE_VELOCITY),
            Curve(
                lambda x: (np.exp(K_PE * (x - 1.0) / strain) - offset) / full,
                (0.0, longest),
            ),
            Curve(lambda s: C_1 * np.exp(growth * s) - OPENSIM_C_3, TENDON),
        )


@dataclass(frozen=True, kw_only=True)
class DeGrooteFregly2016Published(MuscleLaw):
    """The constants of the authors' code: f_l(1) = 0.9993, and f_SE reaches one F0 at 4.7 %.

    Parameters
    ----------
    tendon_stiffness : float
        k_T of the tendon's exponential; muscles give no tendon strain.
    """

    tendon_stiffness: float = K_T

    shortest_fiber = ZERO_LENGTH

    def __post_init__(self) -> None:
        self.keep_number("tendon_stiffness", 1.0, 1000.0)

    def make_curves(self, elastic: bool) -> HillCurves:
        offset = math.exp(K_PE * (ZERO_LENGTH - 1.0) / STRAIN)
        ends = [s * 0.05 * K_T / self.tendon_stiffness for s in TENDON]
        return HillCurves(
            Curve(lambda x: active_force_length(x, GAUSSIANS), (0.0, LONGEST), (0.0, 0.0)),
            *force_velocity_curves(FORCE_VELOCITY),
            Curve(
                lambda x: (np.exp(K_PE * (x - 1.0) / STRAIN) - offset) / (math.exp(K_PE) - 1.0),
                (0.0, LONGEST),
            ),
            Curve(lambda e: C_1 * np.exp(self.tendon_stiffness * (e + (1.0 - C_2))) - C_3, ends),
        )
