"""Ideal actuators as tables, and what a unit of each is on the coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import ParameterError
from ..numerics.kernel import kernel
from ..path.frames import GROUND, turned
from ..path.paths import LinkNumbers, Paths, collect_paths
from ..path.pulls import FORCE, ON_LINK, PULL_COLUMNS, Pulls, pull_coordinate
from .actuators import Actuator, PathActuator, Reserve, TorqueActuator
from .jacobian import ON_LINK_AS_TORQUE, generalized

# Columns of the table of actuators: what, on which coordinate or link, against which link, and in
# whose frame position and direction are; of a tension its sign.
KIND, ON, AGAINST, POINT_FRAME, FRAME, POSITION, DIRECTION, COLUMNS = (
    0, 1, 2, 3, 4, slice(5, 8), slice(8, 11), 11
)  # fmt: skip
PULL = ON
COORDINATE, POINT_FORCE, TORQUE, TENSION = 0.0, 1.0, 2.0, 3.0


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

    @property
    def signs(self) -> np.ndarray:
        """Of these, whether a positive force pulls (1) or pushes (-1)."""
        return np.asarray(self.rows[self.along, PULL])


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
        row[KIND], row[PULL] = TENSION, -1.0 if actuator.pushes else 1.0
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
