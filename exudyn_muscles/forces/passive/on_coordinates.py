"""Forces on one coordinate: limits, springs, formulas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, fields
from typing import Any

import numpy as np

from ...checks import number_within
from ...numerics.kernel import kernel
from .expressions import Program, program, run

# Columns of their table: what, on which coordinate, its numbers in the order of the fields.
KIND, ON, GIVEN, COLUMNS = 0, 1, 2, 8
LIMIT, SPRING, FORMULA = 0.0, 1.0, 2.0
LARGEST = 1e12  # no skeleton bears a millionth of it
LEAST = 1e-9  # of what is divided by [m or rad]


@dataclass(frozen=True)
class CoordinateLimitForce:
    """A force that keeps a coordinate within its limits, as OpenSim's.

    Beyond a limit the stiffness grows from 0 to its value over the transition, by the step s of
    fifth degree, and the damping with it: f = -K_up s_up (q - q_up) + K_low s_low (q_low - q)
    - (s_up + s_low) c q'.

    Parameters
    ----------
    name, coordinate : str
    upper_limit, lower_limit : float
        [rad or m]
    upper_stiffness, lower_stiffness : float
        [N m/rad or N/m]
    transition : float
        Way from no stiffness to the whole one [rad or m].
    damping : float
        [N m s/rad or N s/m]

    Raises
    ------
    ParameterError
        A number is not finite, a stiffness or the damping negative, or the transition not positive.
    """

    name: str
    coordinate: str
    _: KW_ONLY
    upper_limit: float
    upper_stiffness: float
    lower_limit: float
    lower_stiffness: float
    transition: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        of_limits = dict.fromkeys(("upper_limit", "lower_limit"), -LARGEST)
        stiff = dict.fromkeys(("upper_stiffness", "lower_stiffness", "damping"), 0.0)
        check_numbers(self, {**of_limits, **stiff, "transition": LEAST})


@dataclass(frozen=True)
class CoordinateSpring:
    """A spring and a damper on a coordinate: f = -k (q - q_0) - c q'.

    Parameters
    ----------
    name, coordinate : str
    stiffness : float
        k [N m/rad or N/m]
    rest : float
        q_0 [rad or m]
    viscosity : float
        c [N m s/rad or N s/m]

    Raises
    ------
    ParameterError
        A number is not finite.
    """

    name: str
    coordinate: str
    _: KW_ONLY
    stiffness: float
    rest: float = 0.0
    viscosity: float = 0.0

    def __post_init__(self) -> None:
        check_numbers(self, dict.fromkeys(("stiffness", "rest", "viscosity"), -LARGEST))


@dataclass(frozen=True)
class CoordinateFormula:
    """A force on a coordinate [N m or N], as a formula of q and qdot.

    Parameters
    ----------
    name, coordinate : str
    formula : str
        As in `expressions`.

    Raises
    ------
    ParameterError
        It is none.
    """

    name: str
    coordinate: str
    formula: str

    def __post_init__(self) -> None:
        _ = self.program

    @property
    def program(self) -> Program:
        """Of the formula."""
        return program(self.formula, ("q", "qdot"))


CoordinateForce = CoordinateLimitForce | CoordinateSpring | CoordinateFormula


def coordinate_row(force: CoordinateForce, coordinate: int, formula: int) -> np.ndarray:
    """A force's row, with the numbers of its coordinate and its program."""
    row = np.zeros(COLUMNS)
    row[ON] = coordinate
    if isinstance(force, CoordinateFormula):
        row[KIND], row[GIVEN] = FORMULA, formula
    else:
        given = [getattr(force, each.name) for each in fields(force)[2:]]
        row[KIND] = LIMIT if isinstance(force, CoordinateLimitForce) else SPRING
        row[GIVEN : GIVEN + len(given)] = given
    return row


def check_numbers(force: Any, lowest: Mapping[str, float]) -> None:
    """Raise ParameterError unless these numbers of a force are at least so much; names it."""
    for name, low in lowest.items():
        number_within(f"force '{force.name}': {name}", getattr(force, name), low, LARGEST)


@kernel
def smooth_step(x):
    """From 0 at 0 to 1 at 1, with two derivatives that vanish there."""
    if x <= 0.0:
        return 0.0
    if x >= 1.0:
        return 1.0
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@kernel
def coordinate_force(row, programs, q, v, stack):
    """The force of a row at a coordinate and its speed."""
    if row[KIND] == FORMULA:
        stack[-2], stack[-1] = q, v
        return run(programs, int(row[GIVEN]), stack[-2:], stack)
    if row[KIND] == SPRING:
        return -row[GIVEN] * (q - row[GIVEN + 1]) - row[GIVEN + 2] * v
    upper, lower, transition = row[GIVEN], row[GIVEN + 2], row[GIVEN + 4]
    up = smooth_step((q - upper) / transition)
    low = smooth_step((lower - q) / transition)
    return (
        -row[GIVEN + 1] * up * (q - upper)
        + row[GIVEN + 3] * low * (lower - q)
        - row[GIVEN + 5] * (up + low) * v
    )
