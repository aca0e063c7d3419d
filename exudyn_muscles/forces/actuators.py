"""Ideal actuators beside the muscles: reserves on coordinates, forces and torques on links, and
tensions along paths.

Their torques on the coordinates are S f with the forces f (r,) and the columns S (n, r), as the
muscles' are r^T F. A reserve's column is constant if its coordinate is independent; those of forces
and torques on links depend on the coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import NamedTuple

import numpy as np

from ..checks import link_number, number_within, three_numbers
from ..errors import ParameterError
from ..numerics.kernel import kernel
from ..path.frames import GROUND, turned
from ..path.functions import FunctionPath
from ..path.paths import LinkNumbers, Paths, collect_paths
from ..path.points import MovingPathPoint, PathPoint
from ..path.pulls import FORCE, ON_LINK, PULL_COLUMNS, Pulls, pull_coordinate
from ..path.surfaces import PathWrap, WrapSurface
from .jacobian import ON_LINK_AS_TORQUE, generalized

# Columns of the table of actuators: what, on which coordinate or link, against which link, and in
# whose frame position and direction are.
KIND, ON, AGAINST, POINT_FRAME, FRAME, POSITION, DIRECTION, COLUMNS = (
    0, 1, 2, 3, 4, slice(5, 8), slice(8, 11), 11
)  # fmt: skip
COORDINATE, POINT_FORCE, TORQUE, TENSION = 0.0, 1.0, 2.0, 3.0
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
    """An ideal tension along a path, as of a cable; a negative one pushes.

    Parameters
    ----------
    name : str
    path, wraps : sequence or FunctionPath
        As a muscle's.
    optimal_force : float
        Tension [N] at control 1: the larger, the cheaper.
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
    min_control: float = -np.inf
    max_control: float = np.inf

    def __post_init__(self) -> None:
        _check(self, f"path actuator '{self.name}'")
        if not isinstance(self.path, FunctionPath):
            object.__setattr__(self, "path", tuple(self.path))
        object.__setattr__(self, "wraps", tuple(self.wraps))


Actuator = Reserve | PointActuator | TorqueActuator | PathActuator


class ActuatorTable(NamedTuple):
    """Actuators as `columns` takes them.

    `rows` (r, COLUMNS) are of all of them, `paths` of those that have one, whose `names` these are.
    """

    rows: np.ndarray
    paths: Paths
    names: tuple[str, ...]

    @property
    def along(self) -> np.ndarray:
        """Which of the rows have the paths."""
        return np.flatnonzero(self.rows[:, KIND] == TENSION)


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


def actuator_table(
    actuators: Sequence[Actuator],
    names: Sequence[str],
    number: LinkNumbers,
) -> ActuatorTable:
    """The actuators as tables.

    Parameters
    ----------
    actuators : sequence of Actuator
    names : sequence of str
        Of all coordinates of the tree.
    number : callable
        As `links` of `collect_paths`.

    Raises
    ------
    ParameterError
        An actuator acts on a coordinate or link that does not exist, or has no path.
    """
    along = [actuator for actuator in actuators if isinstance(actuator, PathActuator)]
    own = tuple(actuator.name for actuator in along)
    paths = collect_paths(
        own, [each.path for each in along], [each.wraps for each in along], number, names,
        kind="actuator",
    )  # fmt: skip
    rows = [_row(actuator, names, number) for actuator in actuators]
    return ActuatorTable(np.array(rows).reshape(-1, COLUMNS), paths, own)


@kernel(allocates=True)
def columns(joints, parents, R, p, axes, table, S):
    """Write S (N, r) of all coordinates of a tree, whose links have the frames R, p, axes; zero for
    those that have paths."""
    generalized(joints, parents, p, axes, actuator_pulls(R, p, table), S.T)


@kernel(allocates=True)
def actuator_pulls(R, p, table):
    """The `Pulls` of a unit in every actuator, on links with the frames R, p."""
    r = table.shape[0]
    kinds, links = np.empty(2 * r, np.int64), np.empty(2 * r, np.int64)
    values = np.empty((2 * r, PULL_COLUMNS))
    pulls = Pulls(kinds, links, values, 2 * np.arange(r), 2 * np.arange(r) + 2)
    for i in range(r):
        k, row = 2 * i, table[i]
        if row[KIND] == COORDINATE:
            pulls.lasts[i] = pull_coordinate(pulls, k, int(row[ON]), 1.0)
            continue
        if row[KIND] == TENSION:
            pulls.lasts[i] = k
            continue
        kinds[k : k + 2] = ON_LINK_AS_TORQUE if row[KIND] == TORQUE else ON_LINK
        links[k], links[k + 1] = int(row[ON]), int(row[AGAINST])
        turned(R, int(row[FRAME]), row[DIRECTION], values[k, FORCE:])
        at = int(row[POINT_FRAME])
        turned(R, at, row[POSITION], values[k, :FORCE])
        if at >= 0:
            values[k, :FORCE] += p[at]
        values[k + 1] = -values[k]  # at most a torque, which has no point
    return pulls


def _row(actuator: Actuator, names: Sequence[str], number: LinkNumbers) -> np.ndarray:
    """An actuator's row of the table."""
    row = np.zeros(COLUMNS)
    row[AGAINST] = row[POINT_FRAME] = row[FRAME] = GROUND
    if isinstance(actuator, Reserve):
        if actuator.coordinate not in names:
            raise ParameterError(
                f"reserve on '{actuator.coordinate}': the coordinates are {list(names)}"
            )
        row[KIND], row[ON] = COORDINATE, list(names).index(actuator.coordinate)
        return row
    if isinstance(actuator, PathActuator):
        row[KIND] = TENSION
        return row
    what = f"actuator '{actuator.name}'"
    row[ON] = link = number(what, actuator.link)
    if isinstance(actuator, TorqueActuator):
        row[AGAINST] = number(what, actuator.against)
        row[KIND], row[DIRECTION] = TORQUE, actuator.axis
        row[FRAME] = GROUND if actuator.torque_is_global else link
        return row
    row[KIND], row[POSITION], row[DIRECTION] = POINT_FORCE, actuator.point, actuator.direction
    row[POINT_FRAME] = GROUND if actuator.point_is_global else link
    row[FRAME] = GROUND if actuator.force_is_global else link
    return row


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
