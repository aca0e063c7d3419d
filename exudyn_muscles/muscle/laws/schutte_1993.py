"""OpenSim's `Schutte1993Muscle_Deprecated`: curves of the file, Hill's hyperbola and a damper.

L. M. Schutte, M. M. Rodgers, F. E. Zajac, R. M. Glaser, "Improving the efficacy of electrical
stimulation-induced leg cycle ergometry", IEEE Transactions on Rehabilitation Engineering 1 (1993),
109-125.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...errors import ParameterError
from ...numerics.curves import Curve
from ...numerics.splines import Points, checked_points, simm_spline, spline_breaks
from ..force_velocity import SCHUTTE, K, M, S
from .law import HillCurves, MuscleLaw

LONGEST = 3.0  # farther end of the fibre's curves [optimal fibre lengths]
LONGEST_TENDON = 1.0  # farther end of the tendon's curve [strain]
FASTEST = 1.0  # farther end of f_v
TAUT = 1e-9  # what the tendon's spline may bear at its slack length

# OpenSim's where a file gives none: the generic curves of SIMM (S. L. Delp, 1990).
ACTIVE: Points = (
    (-5.307692, -4.307692, -1.923077, -0.884615, -0.269231, 0.230769, 0.461538, 0.52725, 0.62875,
     0.71875, 0.86125, 1.045, 1.2175, 1.43875, 1.5, 1.615385, 2.0, 2.961538, 3.692308, 5.461538,
     9.901902),
    (0.012188, 0.021899, 0.036466, 0.052493, 0.075312, 0.114158, 0.157859, 0.226667, 0.636667,
     0.856667, 0.95, 0.993333, 0.77, 0.246667, 0.193821, 0.133252, 0.072683, 0.044417, 0.036341,
     0.021899, 0.007332),
)  # fmt: skip
TENDON: Points = (
    (-10.0, -0.002, -0.001, 0.0, 0.00131, 0.00281, 0.00431, 0.00581, 0.00731, 0.00881, 0.0103,
     0.0118, 0.0123, 9.2, 9.201, 9.202, 20.0),
    (0.0, 0.0, 0.0, 0.0, 0.0108, 0.0257, 0.0435, 0.0652, 0.0915, 0.123, 0.161, 0.208, 0.227, 345.0,
     345.0, 345.0, 345.0),
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Schutte1993(MuscleLaw):
    """OpenSim's `Schutte1993Muscle_Deprecated`.

    Its maximum contraction velocity is one optimal fibre length in the file's `time_scale`. A
    tendon that bears less than f_PE shortens the fibre no faster than one that bears as much.

    Parameters
    ----------
    fiber_damping : float
        beta.
    active_force_length : pair (x, y) of sequences of float
        Points of `simm_spline`: f_l of the fibre length over the optimal one, zero where the spline
        is below.
    passive_force_length : pair, optional
        Likewise f_PE; left out, it is exp(8 (x - 1) - 4).
    tendon_force_length : pair
        Likewise f_SE of the tendon strain, from zero on.

    Raises
    ------
    ParameterError
        Points are no spline's, or their f_SE does not rise from 0 to 1; names the curve.
    """

    fiber_damping: float = 0.1
    active_force_length: Points = field(default=ACTIVE, repr=False)
    passive_force_length: Points | None = field(default=None, repr=False)
    tendon_force_length: Points = field(default=TENDON, repr=False)

    force_velocity_form = (SCHUTTE, 0.0, 0.0)  # not a field

    def __post_init__(self) -> None:
        self.keep_number("fiber_damping", 1e-3, 10.0)
        for name in ("active_force_length", "passive_force_length", "tendon_force_length"):
            points = getattr(self, name)
            if points is not None:
                object.__setattr__(self, name, checked_points(f"Schutte1993: {name}", points))
        tendon = self._spline("tendon_force_length")
        start, end = tendon([0.0, LONGEST_TENDON])
        if abs(start) > TAUT or end < 1.0:
            raise ParameterError(
                f"Schutte1993: tendon_force_length is {start:g} at no strain and {end:g} at "
                f"{LONGEST_TENDON:g}; expected 0 and 1 at least"
            )

    def make_curves(self, elastic: bool) -> HillCurves:
        def multiplier(v):
            shortening = K * (1.0 + v) / (K - np.minimum(v, 0.0))
            w = np.maximum(v, 0.0)
            return np.where(v < 0.0, shortening, (S + M * w) / (S + w))

        def velocity(f):
            lengthening = S * (f - 1.0) / (M - np.maximum(f, 1.0))
            return np.where(f < 1.0, K * (f - 1.0) / (f + K), lengthening)

        most = float(multiplier(FASTEST))
        active = self._spline("active_force_length")
        taut = (0.0, LONGEST_TENDON)
        tendon = self._spline("tendon_force_length")
        return HillCurves(
            Curve(
                lambda x: np.maximum(active(x), 0.0),
                spline_breaks(active, (0.0, LONGEST), [0.0]),
                (0.0, 0.0),
            ),
            Curve(multiplier, (-1.0, 0.0, FASTEST)),
            Curve(velocity, (0.0, 1.0, most)),
            self._passive(),
            Curve(tendon, spline_breaks(tendon, taut), (0.0, None)),
        )

    def _passive(self) -> Curve:
        ends = (0.0, LONGEST)
        if self.passive_force_length is None:
            return Curve(lambda x: np.exp(8.0 * (x - 1.0) - 4.0), ends)
        passive = self._spline("passive_force_length")
        return Curve(passive, spline_breaks(passive, ends))

    def _spline(self, name: str) -> Curve:
        return simm_spline(*getattr(self, name))
