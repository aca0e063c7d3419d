"""How what nobody tracks is predicted: one step of a rule from the start of Exudyn's step."""

from __future__ import annotations

from typing import NamedTuple


class Rule(NamedTuple):
    """What x / h^2 and x' / h get of x'' at the start of a step of length h and at its end."""

    x_0: float
    v_0: float
    x_1: float
    v_1: float


# Exudyn's own, for its next step: what swings faster goes on swinging, as it will there.
TRAPEZOIDAL = Rule(0.25, 0.5, 0.25, 0.5)
# Over many of its steps: what swings faster has come to rest, since its phase cannot be told.
IMPLICIT_EULER = Rule(0.0, 0.0, 1.0, 1.0)
