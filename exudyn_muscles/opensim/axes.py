"""An axis of a joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..motion.coordinate import Coordinate
from ..numerics.curves import Curve
from ..numerics.products import SumOfProducts
from .element import Element
from .functions import Line, as_curve, without_locked


class Axis(NamedTuple):
    """One axis of a joint.

    `rotates` about or moves along `direction` (3,), of length one, by the `function` of
    `coordinate`, which is None for constants. `element` is its place in the file. `pure`: OpenSim
    takes it for what its coordinate is, which a `LinearFunction` of slope 1 or -1 says. `of` names
    what the function is of where that is not the coordinate alone. An axis that does not `carry`
    moves nothing: others follow it.
    """

    rotates: bool
    direction: np.ndarray
    coordinate: Coordinate | None
    function: Line | Curve | SumOfProducts
    element: Element
    pure: bool = True
    of: tuple[str, ...] = ()
    carries: bool = True

    @property
    def followed(self) -> tuple[str, ...]:
        """The names of what it is a function of."""
        return self.of or (() if self.coordinate is None else (self.coordinate.name,))

    @property
    def follower(self) -> str:
        """The name that its own coordinate has in the tree if it follows others."""
        assert self.coordinate is not None
        return f"{self.coordinate.name}/{self.element.name}"

    @property
    def fixed(self) -> float | None:
        """Its value if it does not move, else None."""
        if isinstance(self.function, Line) and self.function.slope == 0.0:
            return self.function.value
        if self.coordinate is not None and not self.coordinate.locked:
            return None
        assert not isinstance(self.function, SumOfProducts)
        at = 0.0 if self.coordinate is None else self.coordinate.default_value
        return float(as_curve(self.function)(at))

    @property
    def backwards(self) -> Axis:
        """The same axis from behind."""
        given = self.function
        if not self.carries:
            return self
        if isinstance(given, Line):
            return self._replace(function=Line(-given.slope, -given.value))
        if isinstance(given, SumOfProducts):
            return self._replace(function=given.times(-1.0))
        opposite = Curve(lambda q: -given(q), np.unique(given.pieces[1:, 0]).tolist())
        return self._replace(function=opposite)

    @property
    def is_own(self) -> bool:
        """Whether it moves by its coordinate itself, to either side."""
        return self.pure and self.fixed is None


def axis_of_several(
    rotates: bool,
    direction: np.ndarray,
    of: Sequence[Coordinate],
    function: SumOfProducts,
    element: Element,
) -> Axis:
    """An axis by a function of several coordinates, of which some may be locked."""
    locked = {each.name: each.default_value for each in of if each.locked}
    function, left = without_locked(function, [each.name for each in of], locked)
    if not left:
        return Axis(rotates, direction, None, Line(0.0, function([])), element, pure=False)
    first = next(each for each in of if not each.locked)
    return Axis(rotates, direction, first, function, element, pure=False, of=tuple(left))
