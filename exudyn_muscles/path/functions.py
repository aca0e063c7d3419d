"""Paths given by their length as a function of coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..numerics.curves import Curve
from ..numerics.kernel import kernel
from ..numerics.products import COEFFICIENT, FACTOR_COORDINATE, checked_terms, factor_at, term_at
from .pulls import pull_coordinate


@dataclass(frozen=True)
class FunctionPath:
    """A path whose length is a sum of products, each factor a function of one coordinate.

    Parameters
    ----------
    terms : sequence of (float, mapping)
        Coefficient, and an exponent from 0 or a `Curve` for each coordinate by its name or number.

    Examples
    --------
    l = 0.3 - 0.02 q_1 + 0.01 q_0 q_1^2 [m]:

    >>> path = FunctionPath([(0.3, {}), (-0.02, {1: 1}), (0.01, {0: 1, 1: 2})])
    """

    terms: Sequence[tuple[float, Mapping[str | int, int | Curve]]]

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", checked_terms("a path", self.terms))


@kernel
def function_pulls(factors, curves, first, last, q, pulls, k):
    """The length from the rows `first` to `last`, and the number of the row after its pulls, which
    begin with row `k`."""
    length = 0.0
    row = first
    while row < last:
        end, value = term_at(factors, curves, row, last, q)
        length += value
        for a in range(row, end):
            change = factors[row, COEFFICIENT]
            for b in range(row, end):
                one, slope, _ = factor_at(factors, curves, b, q)
                change *= slope if a == b else one
            if factors[a, FACTOR_COORDINATE] >= 0.0:
                k = pull_coordinate(pulls, k, int(factors[a, FACTOR_COORDINATE]), -change)
        row = end
    return length, k
