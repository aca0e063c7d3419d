"""Tensions along paths: springs and ligaments that wrap as muscles do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field

import numpy as np

from ...numerics.curves import Curve, evaluate
from ...numerics.kernel import kernel
from ...path.functions import FunctionPath
from ...path.points import MovingPathPoint, PathPoint
from ...path.surfaces import PathWrap, WrapSurface
from .expressions import Program, program, run
from .on_coordinates import LARGEST, LEAST, check_numbers, smooth_step

# Columns of their table: what, its numbers, the number of its curve or program.
KIND, GIVEN, NUMBER, COLUMNS = 0, 1, 5, 6
PATH_SPRING, LIGAMENT, BLANKEVOORT, TWO_POINTS, FORMULA = 0.0, 1.0, 2.0, 3.0, 4.0
# Blankevoort's damping fades out below this strain, in OpenSim.
DAMPED = 0.01

Path = Sequence[PathPoint | MovingPathPoint] | FunctionPath
Wraps = Sequence[PathWrap | WrapSurface]


@dataclass(frozen=True)
class PathSpring:
    """A spring along a path that bears no compression, as OpenSim's.

    With the stretch x = max(l - l_0, 0) its tension is k x (1 + d l').

    Parameters
    ----------
    name : str
    path, wraps
        As of `Muscle`.
    resting_length : float
        l_0 [m]
    stiffness : float
        k [N/m]
    dissipation : float
        d [s/m]

    Raises
    ------
    ParameterError
        A number is negative or not finite.
    """

    name: str
    _: KW_ONLY
    path: Path
    resting_length: float
    stiffness: float
    dissipation: float = 0.0
    wraps: Wraps = ()

    def __post_init__(self) -> None:
        check_numbers(self, dict.fromkeys(("resting_length", "stiffness", "dissipation"), 0.0))


@dataclass(frozen=True)
class Ligament:
    """A ligament as OpenSim's: a curve of its length over the resting one, times a force.

    Parameters
    ----------
    name : str
    path, wraps
        As of `Muscle`.
    resting_length : float
        Up to which it is slack [m]; more than zero.
    pcsa_force : float
        [N]
    force_length : Curve

    Raises
    ------
    ParameterError
        A number is out of its range.
    """

    name: str
    _: KW_ONLY
    path: Path
    resting_length: float
    pcsa_force: float
    force_length: Curve
    wraps: Wraps = ()

    def __post_init__(self) -> None:
        check_numbers(self, {"resting_length": LEAST, "pcsa_force": 0.0})


@dataclass(frozen=True)
class BlankevoortLigament:
    """A ligament with a quadratic toe and a linear region, Blankevoort and Huiskes (1991).

    With the strain e = l / l_0 - 1 its tension is k e^2 / (2 e_t) up to the transition e_t, then
    k (e - e_t / 2), and c e' where it lengthens under tension.

    Parameters
    ----------
    name : str
    path, wraps
        As of `Muscle`.
    slack_length : float
        l_0 [m]; more than zero.
    linear_stiffness : float
        k [N] for a strain of one.
    transition_strain : float
        e_t
    damping_coefficient : float
        c [N s]

    Raises
    ------
    ParameterError
        A number is out of its range.
    """

    name: str
    _: KW_ONLY
    path: Path
    slack_length: float
    linear_stiffness: float
    transition_strain: float = 0.06
    damping_coefficient: float = 0.003
    wraps: Wraps = ()

    def __post_init__(self) -> None:
        others = ("linear_stiffness", "transition_strain", "damping_coefficient")
        check_numbers(self, {"slack_length": LEAST, **dict.fromkeys(others, 0.0)})


@dataclass(frozen=True)
class PointToPointSpring:
    """A linear spring between two points, which bears compression too: k (l - l_0).

    Parameters
    ----------
    name : str
    path : sequence of two PathPoint
    rest_length : float
        l_0 [m]
    stiffness : float
        k [N/m]

    Raises
    ------
    ParameterError
        A number is not finite.
    """

    name: str
    _: KW_ONLY
    path: Path
    rest_length: float
    stiffness: float
    wraps: Wraps = field(default=(), init=False)

    def __post_init__(self) -> None:
        check_numbers(self, dict.fromkeys(("rest_length", "stiffness"), -LARGEST))


@dataclass(frozen=True)
class PointToPointFormula:
    """A force that draws two points together [N], as a formula of their distance d and of ddot.

    Parameters
    ----------
    name : str
    path : sequence of two PathPoint
    formula : str
        As in `expressions`.

    Raises
    ------
    ParameterError
        It is none.
    """

    name: str
    _: KW_ONLY
    path: Path
    formula: str
    wraps: Wraps = field(default=(), init=False)

    def __post_init__(self) -> None:
        _ = self.program

    @property
    def program(self) -> Program:
        """Of the formula."""
        return program(self.formula, ("d", "ddot"))


PathForce = PathSpring | Ligament | BlankevoortLigament | PointToPointSpring | PointToPointFormula


def path_row(force: PathForce, number: int) -> np.ndarray:
    """A force's row, with the number of its curve or program."""
    row = np.zeros(COLUMNS)
    match force:
        case PathSpring():
            row[:4] = PATH_SPRING, force.resting_length, force.stiffness, force.dissipation
        case Ligament():
            row[:3] = LIGAMENT, force.resting_length, force.pcsa_force
        case BlankevoortLigament():
            row[:5] = (
                BLANKEVOORT, force.slack_length, force.linear_stiffness, force.transition_strain,
                force.damping_coefficient,
            )  # fmt: skip
        case PointToPointSpring():
            row[:3] = TWO_POINTS, force.rest_length, force.stiffness
        case PointToPointFormula():
            row[KIND] = FORMULA
    row[NUMBER] = number
    return row


@kernel
def tension(row, curves, programs, l, l_rate, stack):
    """The tension of a row at its path's length and lengthening speed."""
    kind, rest = row[KIND], row[GIVEN]
    if kind == FORMULA:
        stack[-2], stack[-1] = l, l_rate
        return run(programs, int(row[NUMBER]), stack[-2:], stack)
    if kind == TWO_POINTS:
        return row[GIVEN + 1] * (l - rest)
    if l <= rest:
        return 0.0
    if kind == PATH_SPRING:
        return row[GIVEN + 1] * (l - rest) * (1.0 + row[GIVEN + 2] * l_rate)
    if kind == LIGAMENT:
        return row[GIVEN + 1] * evaluate(curves, int(row[NUMBER]), l / rest)[0]
    e, k, toe = l / rest - 1.0, row[GIVEN + 1], row[GIVEN + 2]
    elastic = 0.5 * k / toe * e * e if e < toe else k * (e - 0.5 * toe)
    return elastic + row[GIVEN + 3] * max(l_rate, 0.0) / rest * smooth_step(e / DAMPED)
