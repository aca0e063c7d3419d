"""Ideal actuators beside the muscles: reserves on coordinates, forces and torques on links, and
tensions along paths.

Their torques on the coordinates are S f with the forces f (r,) and the columns S (n, r), as the
muscles' are r^T F. A reserve's column is constant if its coordinate is independent; those of forces
and torques on links depend on the coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np

from ..checks import link_number, number_within, three_numbers
from ..errors import ParameterError
from ..path.frames import GROUND
from ..path.functions import FunctionPath
from ..path.points import MovingPathPoint, PathPoint
from ..path.surfaces import PathWrap, WrapSurface

# Beyond these, quadratic programs no longer see what the muscles cost, or can do, beside it.
OPTIMAL_FORCES = 1e-3, 1e6


@dataclass(frozen=True)
class Reserve:
    """An ideal torque on one coordinate that helps where the muscles do not suffice.

    Parameters
    ----------
    coordinate : str
        The coordinate's name in the model; it may be one that depends on others.
    optimal_force : float
        Torque [N m] or force [N] at control 1: the larger, the cheaper.
    min_control, max_control : float
        Limits of torque over optimal force.
    name : str, optional
        `<coordinate>_reserve` if left out.

    Raises
    ------
    ParameterError
        The optimal force is not positive and finite, or the limits do not enclose zero.
    """

    coordinate: str
    optimal_force: float
    min_control: float = -np.inf
    max_control: float = np.inf
    name: str = ""

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", f"{self.coordinate}_reserve")
        _check(self, f"reserve on '{self.coordinate}'")


@dataclass(frozen=True)
class PointActuator:
    """An ideal force on a point of a link, as the residual forces on a pelvis.

    Parameters
    ----------
    name : str
    link : int, ObjectIndex or MarkerIndex
        Number of the link in the kinematic tree, from 0; in other systems a body or marker.
    point : (3,) sequence of float
        In the frame of the link, or where the point is in ground [m].
    direction : (3,) sequence of float
        Of a positive force, in the frame of the link or in ground; any length but zero.
    optimal_force : float
        Force [N] at control 1: the larger, the cheaper.
    point_is_global, force_is_global : bool
        Point and direction are in ground.
    min_control, max_control : float
        Limits of force over optimal force.

    Raises
    ------
    ParameterError
        As `Reserve`, or a link, point or direction is not one.
    """

    name: str
    _: KW_ONLY
    link: int
    point: Sequence[float]
    direction: Sequence[float]
    optimal_force: float
    point_is_global: bool = False
    force_is_global: bool = False
    min_control: float = -np.inf
    max_control: float = np.inf

    def __post_init__(self) -> None:
        what = f"point actuator '{self.name}'"
        _check(self, what)
        object.__setattr__(self, "link", link_number(f"{what}: link", self.link, 0))
        _check_flags(
            what, point_is_global=self.point_is_global, force_is_global=self.force_is_global
        )
        object.__setattr__(self, "point", three_numbers(f"{what}: point", self.point))
        object.__setattr__(self, "direction", _unit(f"{what}: direction", self.direction))


@dataclass(frozen=True)
class TorqueActuator:
    """An ideal torque between two links, or between a link and ground.

    Parameters
    ----------
    name : str
    link : int, ObjectIndex or MarkerIndex
        What gets the torque, as in `PointActuator`.
    axis : (3,) sequence of float
        Of a positive torque, in ground or in the frame of the link; any length but zero.
    optimal_force : float
        Torque [N m] at control 1: the larger, the cheaper.
    against : int, ObjectIndex or MarkerIndex
        What gets the opposite torque; ground if left out.
    torque_is_global : bool
        The axis is in ground.
    min_control, max_control : float
        Limits of torque over optimal force.

    Raises
    ------
    ParameterError
        As `Reserve`, or a link or axis is not one.
    """

    name: str
    _: KW_ONLY
    link: int
    axis: Sequence[float]
    optimal_force: float
    against: int = GROUND
    torque_is_global: bool = True
    min_control: float = -np.inf
    max_control: float = np.inf

    def __post_init__(self) -> None:
        what = f"torque actuator '{self.name}'"
        _check(self, what)
        object.__setattr__(self, "link", link_number(f"{what}: link", self.link, 0))
        object.__setattr__(self, "against", link_number(f"{what}: against", self.against))
        if self.against == self.link:
            raise ParameterError(f"{what}: link and against are both {self.link}")
        _check_flags(what, torque_is_global=self.torque_is_global)
        object.__setattr__(self, "axis", _unit(f"{what}: axis", self.axis))


@dataclass(frozen=True)
class PathActuator:
    """An ideal tension along a path, as of a cable; a negative one pushes, or the other way round.

    Parameters
    ----------
    name : str
    path, wraps : sequence or FunctionPath
        As a muscle's.
    optimal_force : float
        Tension [N] at control 1: the larger, the cheaper.
    pushes : bool
        A positive control pushes the ends of the path apart.
    min_control, max_control : float
        Limits of tension over optimal force.

    Raises
    ------
    ParameterError
        As `Reserve`.
    """

    name: str
    _: KW_ONLY
    path: Sequence[PathPoint | MovingPathPoint] | FunctionPath
    optimal_force: float
    wraps: Sequence[PathWrap | WrapSurface] = ()
    pushes: bool = False
    min_control: float = -np.inf
    max_control: float = np.inf

    def __post_init__(self) -> None:
        what = f"path actuator '{self.name}'"
        _check(self, what)
        _check_flags(what, pushes=self.pushes)
        if not isinstance(self.path, FunctionPath):
            object.__setattr__(self, "path", tuple(self.path))
        object.__setattr__(self, "wraps", tuple(self.wraps))


Actuator = Reserve | PointActuator | TorqueActuator | PathActuator


def actuator_names(actuators: Sequence[Actuator]) -> tuple[str, ...]:
    """The actuators' names; from the second on of the same name with a number."""
    names: list[str] = []
    for actuator in actuators:
        name, number = actuator.name, 1
        while name in names:
            number += 1
            name = f"{actuator.name}_{number}"
        names.append(name)
    return tuple(names)


# Checks.


def _check(actuator: Actuator, what: str) -> None:
    number_within(f"{what}: optimal_force", actuator.optimal_force, *OPTIMAL_FORCES)
    low, high = actuator.min_control, actuator.max_control
    try:
        enclosed = low <= 0.0 <= high
    except TypeError:
        enclosed = False
    if not enclosed:
        raise ParameterError(f"{what}: controls [{low!r}, {high!r}] must enclose 0")


def _check_flags(what: str, **flags: object) -> None:
    for name, value in flags.items():
        if not isinstance(value, (bool, np.bool_)):
            raise ParameterError(f"{what}: {name} is True or False, got {value!r}")


def _unit(what: str, value: Sequence[float]) -> tuple[float, float, float]:
    vector = np.array(three_numbers(what, value))
    largest = np.abs(vector).max()
    if largest == 0.0:
        raise ParameterError(f"{what} has no length")
    vector /= largest  # whose square is finite
    x, y, z = (vector / np.linalg.norm(vector)).tolist()
    return x, y, z
