"""OpenSim's `Thelen2003Muscle_Deprecated`: Thelen's curves as files had them before OpenSim 3, with
a damper, passive forces at all lengths, and a tendon that never is quite slack."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...numerics.curves import Curve
from ..force_velocity import THELEN
from .law import HillCurves, MuscleLaw
from .thelen_2003 import K_TOE, Thelen2003

TOE, F_TOE = 0.609, 0.333333  # end of the tendon's toe over the strain at F0, and the force there
STIFFNESS = 1.712  # of the tendon behind it, times the strain at F0
SLACK = 0.001  # what the tendon bears at its slack length [F0], in proportion to its length


@dataclass(frozen=True, kw_only=True)
class Thelen2003Deprecated(MuscleLaw):
    """OpenSim's `Thelen2003Muscle_Deprecated`.

    The force does not part into a curve of the velocity and a linear damper: the formula is in
    `muscle/force_velocity.py`.

    Parameters
    ----------
    fmax_tendon_strain, fmax_muscle_strain : float
        Tendon strain and passive fibre strain at F0.
    kshape_active, kshape_passive : float
        Width of f_l, exponent of f_PE.
    fiber_damping : float
        beta.
    af : float
        Shape of the force-velocity curve.
    flen : float
        Force of the lengthening fibre at most, over the isometric one.
    speed_without_activation : float
        Share of the maximum contraction velocity at zero activation: `Vmax0` over `Vmax`.
    """

    fmax_tendon_strain: float = 0.033
    fmax_muscle_strain: float = 0.6
    kshape_active: float = 0.5
    kshape_passive: float = 4.0
    fiber_damping: float = 0.05
    af: float = 0.3
    flen: float = 1.8
    speed_without_activation: float = 0.5

    def __post_init__(self) -> None:
        for name, low, high in (
            ("fmax_tendon_strain", 1e-3, 1.0),
            ("fmax_muscle_strain", 0.01, 10.0),
            ("kshape_active", 0.15, 10.0),
            ("kshape_passive", 0.1, 20.0),
            ("fiber_damping", 0.0, 10.0),
            ("af", 0.01, 10.0),
            ("flen", 1.06, 10.0),  # 95 % of it are more than the isometric force
            ("speed_without_activation", 0.01, 1.0),
        ):
            self.keep_number(name, low, high)

    @property
    def force_velocity_form(self) -> tuple[int, float, float]:  # type: ignore[override]
        return THELEN, self.af, self.flen

    def make_curves(self, elastic: bool) -> HillCurves:
        e, k, e_t = self.fmax_muscle_strain, self.kshape_passive, self.fmax_tendon_strain
        toe = TOE * e_t

        def tendon(strain):
            curved = F_TOE * np.expm1(K_TOE * np.clip(strain / toe, 0.0, 1.0)) / math.expm1(K_TOE)
            straight = STIFFNESS / e_t * np.maximum(strain - toe, 0.0)
            return curved + straight + SLACK * (1.0 + strain)

        undamped = Thelen2003(kshape_active=self.kshape_active, af=self.af, flen=self.flen)
        return undamped.make_curves(elastic)._replace(
            passive_force_length=Curve(lambda x: np.exp(k * ((x - 1.0) / e - 1.0)), (0.0, 1.0 + e)),
            tendon_force_length=Curve(tendon, (0.0, toe, 2.0 * e_t), (SLACK, None)),
        )
