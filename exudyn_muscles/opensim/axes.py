"""An axis of a joint."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..motion.coordinate import Coordinate
from ..numerics.curves import Curve
from .element import Element
from .functions import Line, as_curve


class Axis(NamedTuple):
    """One axis of a joint.

    `rotates` about or moves along `direction` (3,), of length one, by the `function` of
    `coordinate`, which is None for constants. `element` is its place in the file. `pure`: OpenSim
    takes it for what its coordinate is, which a `LinearFunction` of slope 1 or -1 says.
    """

    rotates: bool
    direction: np.ndarray
    coordinate: Coordinate | None
    function: Line | Curve
    element: Element
    pure: bool = True

    @property
    def fixed(self) -> float | None:
        """Its value if it does not move, else None."""
        if isinstance(self.function, Line) and self.function.slope == 0.0:
            return self.function.value
        if self.coordinate is not None and not self.coordinate.locked:
            return None
        at = 0.0 if self.coordinate is None else self.coordinate.default_value
        return float(as_curve(self.function)(at))

    @property
    def backwards(self) -> Axis:
        """The same axis from behind."""
        given = self.function
        if isinstance(given, Line):
            return self._replace(function=Line(-given.slope, -given.value))
        opposite = Curve(lambda q: -given(q), np.unique(given.pieces[1:, 0]).tolist())
        return self._replace(function=opposite)

    @property
    def is_own(self) -> bool:
        """Whether it moves by its coordinate itself, to either side."""
        return self.pure and self.fixed is None
