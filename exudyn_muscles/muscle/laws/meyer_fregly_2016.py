"""OpenSim's `MeyerFregly2016Muscle`: curves as of De Groote et al. (2016), for rigid tendons.

A. J. Meyer, I. Eskinazi, J. N. Jackson, A. V. Rao, C. Patten, B. J. Fregly, "Muscle synergies
facilitate computational prediction of subject-specific walking motions", Frontiers in
Bioengineering and Biotechnology 4 (2016), 1055.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics.curves import Curve
from .de_groote_fregly_2016 import LONGEST, ZERO_LENGTH, active_force_length
from .law import HillCurves, MuscleLaw

# Those of OpenSim 4.6. Active force-length: three Gaussians, rows (b1, b2, b3, b4).
GAUSSIANS = (
    (0.8174335195120225, 1.054348561163096, 0.16194288662761705, 0.06381565266097716),
    (0.43130780147182907, 0.7163004817144202, -0.029060905806803296, 0.19835014521987723),
    (0.1, 1.0, 0.353553390593274, 0.0),
)
# Passive fibre: e1 log(exp(e2 (x - e3)) + 1).
PASSIVE = (0.232000797810576, 12.438535493526128, 1.329470475731338)
# Force-velocity: d1 + d2 atan(d3 + d4 atan(d5 + d6 v)).
FORCE_VELOCITY = (
    -32.51401019139919, 22.160392466960214, 18.7932134796918, 6.320952269683997,
    -0.27671677680513945, 8.053304562566995,
)  # fmt: skip
FASTEST = 10.0  # f_v goes on along its tangents beyond
INVERTED = 1.0  # and its inverse, which rises without bound, beyond this


def force_velocity(v):
    """f_v."""
    d_1, d_2, d_3, d_4, d_5, d_6 = FORCE_VELOCITY
    return d_1 + d_2 * np.arctan(d_3 + d_4 * np.arctan(d_5 + d_6 * v))


def inverse_force_velocity(f):
    """Closed-form inverse of `force_velocity`."""
    d_1, d_2, d_3, d_4, d_5, d_6 = FORCE_VELOCITY
    return (np.tan((np.tan((f - d_1) / d_2) - d_3) / d_4) - d_5) / d_6


@dataclass(frozen=True, kw_only=True)
class MeyerFregly2016(MuscleLaw):
    """OpenSim's `MeyerFregly2016Muscle`, for rigid tendons.

    Parameters
    ----------
    active_force_width_scale : float
        Stretches f_l about the optimal length, at least 1.
    fiber_damping : float
        beta.
    ignore_passive_fiber_force : bool
        The passive fibre pulls with nothing.
    """

    active_force_width_scale: float = 1.0
    fiber_damping: float = 0.0
    ignore_passive_fiber_force: bool = False

    shortest_fiber = ZERO_LENGTH  # not a field: every unit of this law has it

    def __post_init__(self) -> None:
        self.keep_number("active_force_width_scale", 1.0, 10.0)
        self.keep_number("fiber_damping", 0.0, 10.0)

    def make_curves(self, elastic: bool) -> HillCurves:
        e_1, e_2, e_3 = PASSIVE
        strength = 0.0 if self.ignore_passive_fiber_force else e_1
        ends = [-INVERTED, INVERTED]
        return HillCurves(
            Curve(
                lambda x: active_force_length(x, GAUSSIANS, self.active_force_width_scale),
                (0.0, LONGEST),
                (0.0, 0.0),
            ),
            Curve(force_velocity, [-FASTEST, *ends, FASTEST]),
            Curve(inverse_force_velocity, force_velocity(np.array(ends)).tolist()),
            Curve(lambda x: strength * np.logaddexp(e_2 * (x - e_3), 0.0), (0.0, LONGEST)),
            None,
        )
