"""The curves of Thelen (2003) in the exact form of OpenSim's `Thelen2003Muscle`.

D. G. Thelen, "Adjustment of muscle mechanics model parameters to simulate dynamic contractions in
older adults", Journal of Biomechanical Engineering 125 (2003), 70-77.

The maximum contraction velocity grows with activation, v_max (0.25 + 0.75 a), and the passive and
the tendon curve have kinks where they become taut.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...numerics.curves import Curve
from .law import STRONGEST, HillCurves, MuscleLaw

K_TOE, F_TOE = 3.0, 0.33  # tendon: exponent of the toe, and force at its end
LONGEST = 3.0  # farther end of the fibre's curves [optimal fibre lengths]


@dataclass(frozen=True, kw_only=True)
class Thelen2003(MuscleLaw):
    """OpenSim's `Thelen2003Muscle`; models before version 4 often carry af = 0.3, flen = 1.8,
    kshape_active = 0.5, kshape_passive = 4 and a tendon strain of 0.033.

    Parameters
    ----------
    fmax_muscle_strain : float
        Passive fibre strain at F0.
    kshape_active, kshape_passive : float
        Width of f_l, exponent of f_PE.
    af : float
        Shape of the force-velocity curve.
    flen : float
        Force of the lengthening fibre at most, over the isometric one.
    fv_linear_extrap_threshold : float
        Part of `flen` from which the force-velocity curve goes on along its tangent.
    """

    fmax_muscle_strain: float = 0.6
    kshape_active: float = 0.45
    kshape_passive: float = 5.0
    af: float = 0.25
    flen: float = 1.4
    fv_linear_extrap_threshold: float = 0.95

    # Not fields: every unit of this law has them.
    tendon_strain_at_one_norm_force = 0.04
    speed_without_activation = 0.25

    def __post_init__(self) -> None:
        for name, low, high in (
            ("fmax_muscle_strain", 0.01, 10.0),
            ("kshape_active", 0.15, 10.0),
            ("kshape_passive", 0.1, 20.0),
            ("af", 0.01, 10.0),
            ("flen", 1.01, 10.0),
        ):
            self.keep_number(name, low, high)
        # From 1/flen on the tangent begins in the lengthening part.
        self.keep_number("fv_linear_extrap_threshold", 1.0 / self.flen + 1e-3, 0.999)

    def make_curves(self, elastic: bool) -> HillCurves:
        A, F, top = self.af, self.flen, self.fv_linear_extrap_threshold * self.flen
        C = 2.0 + 2.0 / A
        fastest = (top - 1.0) * (F - 1.0) / (C * (F - top))
        # Slopes of the velocity over the force at both ends, where the tangents begin.
        shortening_slope, lengthening_slope = 1.0 + 1.0 / A, (F - 1.0) ** 2 / (C * (F - top) ** 2)
        e, k = self.fmax_muscle_strain, self.kshape_passive
        # Toe's end and slope behind it, over the strain at one F0: 99 e^3 / (166 e^3 - 67).
        toe = 99.0 * math.exp(3.0) / (166.0 * math.exp(3.0) - 67.0)
        stiffness = 0.67 / (1.0 - toe)

        def velocity(f):
            shortening = (f - 1.0) / (1.0 + np.minimum(f, 1.0) / A)
            lengthening = (f - 1.0) * (F - 1.0) / (C * (F - np.maximum(f, 1.0)))
            return np.where(f <= 1.0, shortening, lengthening)

        def force(v):
            shortening = (1.0 + v) / (1.0 - np.minimum(v, 0.0) / A)
            w = np.maximum(v, 0.0)
            lengthening = (F - 1.0 + w * C * F) / (F - 1.0 + w * C)
            return np.where(v <= 0.0, shortening, lengthening)

        def tendon(s):
            curved = F_TOE * np.expm1(K_TOE * np.minimum(s, toe) / toe) / math.expm1(K_TOE)
            return curved + stiffness * np.maximum(s - toe, 0.0)

        longest = min(LONGEST, 1.0 + e * math.log1p(STRONGEST * math.expm1(k)) / k)
        return HillCurves(
            Curve(
                lambda x: np.exp(-((x - 1.0) ** 2) / self.kshape_active),
                (0.0, LONGEST),
                (0.0, 0.0),
            ),
            Curve(force, (-1.0, 0.0, fastest), (1.0 / shortening_slope, 1.0 / lengthening_slope)),
            Curve(velocity, (0.0, 1.0, top), (shortening_slope, lengthening_slope)),
            Curve(
                lambda x: np.expm1(k * (x - 1.0) / e) / math.expm1(k), (1.0, longest), (0.0, None)
            ),
            Curve(tendon, (0.0, toe, 2.0), (0.0, stiffness)),
        )
