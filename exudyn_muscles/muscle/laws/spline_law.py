"""OpenSim's `RigidTendonMuscle`: splines through points, as in SIMM (S. L. Delp, 1990), on a rigid
tendon."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...numerics.curves import Curve
from ...numerics.splines import Points, checked_points, simm_spline, spline_breaks
from .law import HillCurves, MuscleLaw
from .schutte_1993 import ACTIVE, LONGEST

# OpenSim's where a file gives none: the generic curves of SIMM.
PASSIVE: Points = (
    (-5.0, 0.998, 0.999, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.601, 1.602, 5.0),
    (0.0, 0.0, 0.0, 0.0, 0.035, 0.12, 0.26, 0.55, 1.17, 2.0, 2.0, 2.0, 2.0),
)
FORCE_VELOCITY: Points = (
    (-1.001, -1.0, -0.95, -0.9, -0.85, -0.8, -0.75, -0.7, -0.65, -0.6, -0.55, -0.5, -0.45, -0.4,
     -0.35, -0.3, -0.25, -0.2, -0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4,
     0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0),
    (0.0, 0.0, 0.010417, 0.021739, 0.034091, 0.047619, 0.0625, 0.078947, 0.097222, 0.117647,
     0.140625, 0.166667, 0.196429, 0.230769, 0.270833, 0.318182, 0.375, 0.444444, 0.53125, 0.642857,
     0.791667, 1.0, 1.482014, 1.601571, 1.655791, 1.686739, 1.706751, 1.720753, 1.731099, 1.739055,
     1.745365, 1.75049, 1.754736, 1.758312, 1.761364, 1.763999, 1.766298, 1.768321, 1.770115,
     1.771717, 1.773155, 1.774455),
)  # fmt: skip
MOST_PASSIVE = 10.0  # F0


@dataclass(frozen=True, kw_only=True)
class SplineLaw(MuscleLaw):
    """OpenSim's `RigidTendonMuscle`: curves through points, for rigid tendons.

    f_v is of the speed of the whole unit over the maximum contraction velocity, whatever its
    pennation, and not bounded by -1.

    Parameters
    ----------
    active_force_length, passive_force_length : pair (x, y) of sequences of float
        Points of `simm_spline`: f_l and f_PE of the fibre length over the optimal one; f_PE is
        zero where the spline is below, and at most 10.
    force_velocity : pair
        Likewise f_v.

    Raises
    ------
    ParameterError
        Points are no spline's; names the curve.
    """

    active_force_length: Points = field(default=ACTIVE, repr=False)
    passive_force_length: Points = field(default=PASSIVE, repr=False)
    force_velocity: Points = field(default=FORCE_VELOCITY, repr=False)

    velocity_along_tendon = True  # not a field

    def __post_init__(self) -> None:
        for name in ("active_force_length", "passive_force_length", "force_velocity"):
            points = checked_points(f"SplineLaw: {name}", getattr(self, name))
            object.__setattr__(self, name, points)

    def make_curves(self, elastic: bool) -> HillCurves:
        passive = simm_spline(*self.passive_force_length)
        return HillCurves(
            simm_spline(*self.active_force_length),
            simm_spline(*self.force_velocity),
            Curve.line(1.0, -1.0),  # rough: with a rigid tendon nothing inverts f_v
            Curve(
                lambda x: np.clip(passive(x), 0.0, MOST_PASSIVE),
                spline_breaks(passive, (0.0, LONGEST), (0.0, MOST_PASSIVE)),
            ),
            None,
        )
