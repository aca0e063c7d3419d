"""Dependent coordinates: which coordinate of a tree is which function of which other one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import NamedTuple

import numpy as np

from ..errors import ParameterError, warn
from ..numerics.curves import Curve


@dataclass(frozen=True)
class DependentCoordinate:
    """A coordinate of the tree that is a function of another one.

    Parameters
    ----------
    coordinate : str
        The coordinate that depends.
    of : str
        The one that it follows: an independent coordinate, or another dependent one.
    function : Curve
        Of Exudyn's coordinates, which are without the node's reference coordinates: `simm_spline`,
        `linear_function` or any other. Forces jump where its slope does.

    Raises
    ------
    ParameterError
        The function is not a curve.
    """

    coordinate: str
    _: KW_ONLY
    of: str
    function: Curve

    def __post_init__(self) -> None:
        if not isinstance(self.function, Curve):
            raise ParameterError(
                f"dependent coordinate '{self.coordinate}': its function is a Curve, such as "
                f"simm_spline(...) or linear_function(...), got {self.function!r}"
            )


class Follower(DependentCoordinate):
    """Former name of `DependentCoordinate`."""

    def __post_init__(self) -> None:
        warn("Follower is now DependentCoordinate", DeprecationWarning)
        super().__post_init__()


def linear_function(slope: float, intercept: float = 0.0) -> Curve:
    """The straight line slope x + intercept, as of OpenSim's coordinate couplers.

    A slope of zero locks what follows it.

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

    `tied` (k,) depend, those that are followed first; they follow `followed` (k,) by the k
    `functions`. `roots` (N,) are the independent coordinates that all depend on in the end.
    """

    tied: np.ndarray
    followed: np.ndarray
    functions: list[Curve]
    roots: np.ndarray


def chains(given: Sequence[DependentCoordinate], names: Sequence[str]) -> Chains:
    """The dependent ones among coordinates of these names, in order.

    Raises
    ------
    ParameterError
        One of them or what it follows is no coordinate, has several functions, or follows itself.
    """
    functions: dict[int, tuple[int, Curve]] = {}
    for each in given:
        d, e = (_number(each, name, names) for name in (each.coordinate, each.of))
        if d in functions:
            raise ParameterError(f"coordinate '{each.coordinate}' depends on more than one")
        functions[d] = e, each.function
    order: list[int] = []
    roots = np.arange(len(names))
    for d in functions:
        chain = [d]
        while chain[-1] in functions:
            e = functions[chain[-1]][0]
            if e in chain:
                raise ParameterError(
                    "dependent coordinates in a circle: " + ", ".join(names[i] for i in [*chain, e])
                )
            chain.append(e)
        roots[d] = chain[-1]
        order += [i for i in reversed(chain[:-1]) if i not in order]
    return Chains(
        np.array(order, dtype=np.int64),
        np.array([functions[d][0] for d in order], dtype=np.int64),
        [functions[d][1] for d in order],
        roots,
    )


def _number(dependent: DependentCoordinate, name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise ParameterError(
            f"dependent coordinate '{dependent.coordinate}' of '{dependent.of}': the tree has no "
            f"coordinate '{name}', only {', '.join(names)}"
        )
    return list(names).index(name)
