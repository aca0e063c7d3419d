"""Dependent coordinates: which coordinate of a tree is which function of which other ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import NamedTuple

import numpy as np

from ..errors import ParameterError, warn
from ..numerics.curves import Curve
from ..numerics.products import SumOfProducts


@dataclass(frozen=True)
class DependentCoordinate:
    """A coordinate of the tree that is a function of others.

    Parameters
    ----------
    coordinate : str
        The coordinate that depends.
    of : str or sequence of str
        What it follows: independent coordinates, or other dependent ones. One alone is kept as str.
    function : Curve or SumOfProducts
        Of Exudyn's coordinates, which are without the node's reference coordinates: of one,
        `simm_spline`, `linear_function` or any other, of several, a sum of products, whose
        variables are these in order. Forces jump where its slope does.

    Raises
    ------
    ParameterError
        The function is no curve and no sum of products of so many coordinates.
    """

    coordinate: str
    _: KW_ONLY
    of: str | Sequence[str]
    function: Curve | SumOfProducts

    def __post_init__(self) -> None:
        what = f"dependent coordinate '{self.coordinate}'"
        of = (self.of,) if isinstance(self.of, str) else tuple(self.of)
        object.__setattr__(self, "of", of[0] if len(of) == 1 else of)
        if isinstance(self.function, SumOfProducts):
            if self.function.count > len(self.followed):
                raise ParameterError(
                    f"{what}: its function has {self.function.count} variables, more than "
                    f"{self.followed}"
                )
        elif not isinstance(self.function, Curve) or len(self.followed) != 1:
            raise ParameterError(
                f"{what}: its function is a Curve, such as simm_spline(...) or "
                "linear_function(...), or of several coordinates a SumOfProducts, got "
                f"{self.function!r} of {self.of!r}"
            )

    @property
    def followed(self) -> tuple[str, ...]:
        """The coordinates that it follows."""
        return (self.of,) if isinstance(self.of, str) else tuple(self.of)


class Follower(DependentCoordinate):
    """Former name of `DependentCoordinate`."""

    def __post_init__(self) -> None:
        warn("Follower is now DependentCoordinate", DeprecationWarning)
        super().__post_init__()


def linear_function(slope: float, intercept: float = 0.0) -> Curve:
    """The straight line slope x + intercept, as of OpenSim's coordinate couplers.

    A slope of zero locks what follows it.

    Parameters
    ----------
    slope, intercept : float

    Returns
    -------
    Curve

    Raises
    ------
    ParameterError
        One is no finite number.

    Examples
    --------
    >>> linear_function(0.5, 0.25)(3.0)
    array(1.75)
    """
    if not np.isfinite([slope, intercept]).all():
        raise ParameterError(
            f"a linear function's slope and intercept are finite, got {slope!r}, {intercept!r}"
        )
    return Curve.line(slope, intercept)


class Chains(NamedTuple):
    """What depends on what, by numbers of the tree's N coordinates.

    `tied` (k,) depend, those that are followed first; each follows the `followed` ones by its
    function. `needs` (N, N) says on which independent coordinates each depends in the end, and
    `several` (N,) whether that is by a function of several ones on the way.
    """

    tied: np.ndarray
    followed: list[tuple[int, ...]]
    functions: list[Curve | SumOfProducts]
    needs: np.ndarray
    several: np.ndarray


def chains(given: Sequence[DependentCoordinate], names: Sequence[str]) -> Chains:
    """The dependent ones among coordinates of these names, in order.

    Raises
    ------
    ParameterError
        One of them or what it follows is no coordinate, has several functions, or follows itself.
    """
    functions: dict[int, tuple[tuple[int, ...], Curve | SumOfProducts]] = {}
    for each in given:
        d, *followed = (_number(each, name, names) for name in (each.coordinate, *each.followed))
        if d in functions:
            raise ParameterError(f"coordinate '{each.coordinate}' depends on more than one")
        functions[d] = tuple(followed), each.function
    order: list[int] = []
    needs = np.eye(len(names), dtype=bool)
    several = np.zeros(len(names), dtype=bool)

    def settle(d: int, chain: list[int]) -> None:
        followed, function = functions[d]
        for e in followed:
            if e in chain:
                raise ParameterError(
                    "dependent coordinates in a circle: " + ", ".join(names[i] for i in [*chain, e])
                )
            if e in functions and e not in order:
                settle(e, [*chain, e])
        order.append(d)
        needs[d] = needs[list(followed)].any(axis=0)
        several[d] = isinstance(function, SumOfProducts) or several[list(followed)].any()

    for d in functions:
        if d not in order:
            settle(d, [d])
    return Chains(
        np.array(order, dtype=np.int64),
        [functions[d][0] for d in order],
        [functions[d][1] for d in order],
        needs,
        several,
    )


def _number(dependent: DependentCoordinate, name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise ParameterError(
            f"dependent coordinate '{dependent.coordinate}' of "
            f"{', '.join(map(repr, dependent.followed))}: the tree has no coordinate '{name}', "
            f"only {', '.join(names)}"
        )
    return list(names).index(name)
