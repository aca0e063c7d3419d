"""Paths given by their length as a function of coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import ParameterError
from ..numerics.curves import Curve, evaluate
from ..numerics.kernel import kernel
from .pulls import pull_coordinate

# Columns of `Paths.factors`: number and coefficient of the term; coordinate, -1 for none; exponent
# or curve, -1 for the other.
TERM, COEFFICIENT, FACTOR_COORDINATE, EXPONENT, CURVE, FACTOR_COLUMNS = range(6)


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
        terms = []
        for term in self.terms:
            try:
                coefficient, factors = term
                coefficient, factors = float(coefficient), dict(factors)
            except (TypeError, ValueError):
                coefficient, factors = math.nan, {}
            if not math.isfinite(coefficient):
                raise ParameterError(
                    f"a path's term is a finite number and a mapping of coordinates, got {term!r}"
                )
            for factor in factors.values():
                whole = isinstance(factor, (int, np.integer)) and factor >= 0
                if not whole and not isinstance(factor, Curve):
                    raise ParameterError(
                        f"a path's factor is an exponent from 0 or a Curve, got {factor!r}"
                    )
            terms.append((coefficient, factors))
        if not terms:
            raise ParameterError("a path needs at least one term, got none")
        object.__setattr__(self, "terms", tuple(terms))


@kernel(inline=True)
def factor_at(factors, curves, k, q):
    """Value and slope of the factor in row `k`."""
    j = int(factors[k, FACTOR_COORDINATE])
    if j < 0:
        return 1.0, 0.0
    if factors[k, CURVE] >= 0.0:
        value, slope, _ = evaluate(curves, int(factors[k, CURVE]), q[j])
        return value, slope
    exponent = int(factors[k, EXPONENT])
    if exponent == 0:
        return 1.0, 0.0
    power = q[j] ** (exponent - 1)
    return power * q[j], exponent * power


@kernel
def function_pulls(factors, curves, first, last, q, pulls, k):
    """The length from the rows `first` to `last`, and the number of the row after its pulls, which
    begin with row `k`."""
    length = 0.0
    row = first
    while row < last:
        end = row
        value = factors[row, COEFFICIENT]
        while end < last and factors[end, TERM] == factors[row, TERM]:
            one, _ = factor_at(factors, curves, end, q)
            value *= one
            end += 1
        length += value
        for a in range(row, end):
            change = factors[row, COEFFICIENT]
            for b in range(row, end):
                one, slope = factor_at(factors, curves, b, q)
                change *= slope if a == b else one
            if factors[a, FACTOR_COORDINATE] >= 0.0:
                k = pull_coordinate(pulls, k, int(factors[a, FACTOR_COORDINATE]), -change)
        row = end
    return length, k
