"""A law like another one, with a fibre that bears nothing passively or is active more widely."""

from __future__ import annotations

from dataclasses import dataclass

from ...numerics.curves import Curve
from .law import HillCurves, MuscleLaw

NOTHING = Curve.line(0.0, 0.0)
SAME = (
    "fiber_damping", "tendon_strain_at_one_norm_force", "shortest_fiber",
    "speed_without_activation", "force_velocity_form", "velocity_along_tendon",
)  # fmt: skip


@dataclass(frozen=True)
class ChangedLaw(MuscleLaw):
    """The curves of a law, some of them changed; see `exudyn_muscles.operators`.

    Parameters
    ----------
    law : MuscleLaw
    ignore_passive_fiber_force : bool
        f_PE is zero; a damper beside the fibre stays.
    active_force_width_scale : float
        Stretches f_l about the optimal length, at least 1.

    Raises
    ------
    ParameterError
        The scale is outside [1, 10].
    """

    law: MuscleLaw
    ignore_passive_fiber_force: bool = False
    active_force_width_scale: float = 1.0

    def __post_init__(self) -> None:
        self.keep_number("active_force_width_scale", 1.0, 10.0)
        for name in SAME:
            object.__setattr__(self, name, getattr(self.law, name))

    def make_curves(self, elastic: bool) -> HillCurves:
        curves = self.law.curves(elastic)
        if self.active_force_width_scale != 1.0:
            wide = curves.active_force_length.stretched(1.0, self.active_force_width_scale)
            curves = curves._replace(active_force_length=wide)
        if self.ignore_passive_fiber_force:
            curves = curves._replace(passive_force_length=NOTHING)
        return curves
