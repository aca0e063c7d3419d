"""Functions of several coordinates: sums of products, each factor a function of one of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ParameterError
from .curves import Curve, evaluate
from .kernel import kernel

# Columns of a table of factors: number and coefficient of the term; coordinate, -1 for none;
# exponent or curve, -1 for the other.
TERM, COEFFICIENT, FACTOR_COORDINATE, EXPONENT, CURVE, FACTOR_COLUMNS = range(6)

Terms = Sequence[tuple[float, Mapping[Any, int | Curve]]]


@dataclass(frozen=True)
class SumOfProducts:
    """A function of several variables, by their numbers from 0.

    Parameters
    ----------
    terms : sequence of (float, mapping)
        Coefficient, and an exponent from 0 or a `Curve` for each variable by its number.

    Examples
    --------
    0.3 - 0.02 x_1 + 0.01 x_0 x_1^2:

    >>> function = SumOfProducts([(0.3, {}), (-0.02, {1: 1}), (0.01, {0: 1, 1: 2})])
    >>> round(function([2.0, 3.0]), 12)
    0.42
    """

    terms: Terms

    def __post_init__(self) -> None:
        terms = checked_terms("a function", self.terms)
        for _, factors in terms:
            for k in factors:
                if not isinstance(k, (int, np.integer)) or isinstance(k, bool) or k < 0:
                    raise ParameterError(f"a function's variables are numbers from 0, got {k!r}")
        object.__setattr__(self, "terms", terms)

    @property
    def count(self) -> int:
        """How many variables it is of."""
        return 1 + max((int(k) for _, factors in self.terms for k in factors), default=-1)

    def __call__(self, x: Sequence[float]) -> float:
        """Its value where the variables are `x`."""
        return math.fsum(
            math.prod((_value(factor, x[k]) for k, factor in factors.items()), start=coefficient)
            for coefficient, factors in self.terms
        )

    def times(self, factor: float) -> SumOfProducts:
        """The function times a factor.

        Parameters
        ----------
        factor : float

        Returns
        -------
        SumOfProducts
        """
        return SumOfProducts([(factor * coefficient, of) for coefficient, of in self.terms])

    def fixed(self, values: Mapping[int, float], count: int) -> SumOfProducts:
        """The function of those variables whose values are not given, numbered anew.

        Parameters
        ----------
        values : mapping of int to float
            Number of a variable -> its value.
        count : int
            Of variables in all.

        Returns
        -------
        SumOfProducts
        """
        left = {k: number for number, k in enumerate(k for k in range(count) if k not in values)}
        terms = []
        for coefficient, factors in self.terms:
            for k, value in values.items():
                if k in factors:
                    coefficient *= _value(factors[k], value)
            terms.append((coefficient, {left[k]: f for k, f in factors.items() if k in left}))
        return SumOfProducts(terms)


def _value(factor: int | Curve, x: float) -> float:
    return float(factor(x)) if isinstance(factor, Curve) else x**factor


def checked_terms(what: str, given: Terms) -> tuple[tuple[float, dict[Any, int | Curve]], ...]:
    """The terms of a sum of products.

    Raises
    ------
    ParameterError
        There are none, or one is not a finite number with exponents and curves; names `what` has
        it.
    """
    terms = []
    for term in given:
        try:
            coefficient, factors = term
            coefficient, factors = float(coefficient), dict(factors)
        except (TypeError, ValueError):
            coefficient, factors = math.nan, {}
        if not math.isfinite(coefficient):
            raise ParameterError(
                f"{what}'s term is a finite number and a mapping of coordinates, got {term!r}"
            )
        for factor in factors.values():
            whole = isinstance(factor, (int, np.integer)) and factor >= 0
            if not whole and not isinstance(factor, Curve):
                raise ParameterError(
                    f"{what}'s factor is an exponent from 0 or a Curve, got {factor!r}"
                )
        terms.append((coefficient, factors))
    if not terms:
        raise ParameterError(f"{what} needs at least one term, got none")
    return tuple(terms)


def factor_rows(
    terms: Terms, number: Callable[[Any], int], curves: dict[Curve, int]
) -> list[list[float]]:
    """The rows of terms, with the `number` of a variable's coordinate; adds curves to those that
    have a number."""
    rows = []
    for term, (coefficient, factors) in enumerate(terms):
        if not factors:
            rows.append([term, coefficient, -1.0, -1.0, -1.0])
        for variable, factor in factors.items():
            if isinstance(factor, Curve):
                exponent, curve = -1, curves.setdefault(factor, len(curves))
            else:
                exponent, curve = int(factor), -1
            rows.append([term, coefficient, number(variable), exponent, curve])
    return rows


@kernel(inline=True)
def factor_at(factors, curves, k, q):
    """Value, slope and curvature of the factor in row `k`."""
    j = int(factors[k, FACTOR_COORDINATE])
    if j < 0:
        return 1.0, 0.0, 0.0
    if factors[k, CURVE] >= 0.0:
        return evaluate(curves, int(factors[k, CURVE]), q[j])
    exponent = int(factors[k, EXPONENT])
    if exponent == 0:
        return 1.0, 0.0, 0.0
    power = q[j] ** (exponent - 1)
    curvature = exponent * (exponent - 1) * q[j] ** (exponent - 2) if exponent > 1 else 0.0
    return power * q[j], exponent * power, curvature


@kernel(inline=True)
def term_at(factors, curves, row, last, q):
    """The row behind the term that begins with `row`, and its value."""
    end = row
    value = factors[row, COEFFICIENT]
    while end < last and factors[end, TERM] == factors[row, TERM]:
        one, _, _ = factor_at(factors, curves, end, q)
        value *= one
        end += 1
    return end, value
