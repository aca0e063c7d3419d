"""Muscles without physiology: the activation times F0, whatever length and speed are."""

from __future__ import annotations

from dataclasses import dataclass

from ...numerics.curves import Curve
from .law import HillCurves, MuscleLaw


@dataclass(frozen=True)
class ConstantStrength(MuscleLaw):
    """A fibre that bears a F0 at any length and speed, on a rigid tendon."""

    bears_no_activation = True  # nothing is divided by it

    def make_curves(self, elastic: bool) -> HillCurves:
        one, none = Curve.line(0.0, 1.0), Curve.line(0.0, 0.0)
        return HillCurves(one, one, one, none, None)
