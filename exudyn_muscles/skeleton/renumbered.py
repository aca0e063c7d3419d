"""A tree in which links stand between those of another one: what was on a link there, here."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..forces.actuator_table import (
    AGAINST,
    COORDINATE,
    FRAME,
    KIND,
    ON,
    POINT_FORCE,
    POINT_FRAME,
    TORQUE,
    ActuatorTable,
)
from ..numerics.products import FACTOR_COORDINATE
from ..path.paths import COORDINATE as RULE_COORDINATE
from ..path.paths import Paths
from ..path.surfaces import LINK


class Renumbering(NamedTuple):
    """New numbers of n links, and of their coordinates.

    Attributes
    ----------
    links, coordinates : (n,) int ndarray
    """

    links: np.ndarray
    coordinates: np.ndarray

    def link(self, old: ArrayLike) -> np.ndarray:
        """New numbers of links; ground stays what it is."""
        return np.append(self.links, -1)[np.asarray(old).astype(int)]

    def coordinate(self, old: ArrayLike) -> np.ndarray:
        """New numbers of coordinates; -1, which stands for none, stays what it is."""
        return np.append(self.coordinates, -1)[np.asarray(old).astype(int)]

    def on_links(self, table: np.ndarray, columns: slice | int) -> np.ndarray:
        """A table whose `columns` are links."""
        return _with(table, columns, self.link(table[:, columns]))

    def on_coordinates(self, table: np.ndarray, column: int) -> np.ndarray:
        """A table of which a column are coordinates."""
        return _with(table, column, self.coordinate(table[:, column]))

    def paths(self, paths: Paths) -> Paths:
        """The same paths there."""
        return paths._replace(
            links=self.link(paths.links),
            rules=self.on_coordinates(paths.rules, RULE_COORDINATE),
            wraps=self.on_links(paths.wraps, LINK),
            factors=self.on_coordinates(paths.factors, FACTOR_COORDINATE),
        )

    def actuators(self, given: ActuatorTable) -> ActuatorTable:
        """The same actuators there."""
        rows = given.rows.copy()
        for column in (AGAINST, POINT_FRAME, FRAME):
            rows[:, column] = self.link(rows[:, column])
        kinds = given.rows[:, KIND]
        of_coordinate = kinds == COORDINATE
        on_link = (kinds == POINT_FORCE) | (kinds == TORQUE)
        rows[of_coordinate, ON] = self.coordinate(given.rows[of_coordinate, ON])
        rows[on_link, ON] = self.link(given.rows[on_link, ON])
        return given._replace(rows=rows, paths=self.paths(given.paths))


def _with(table: np.ndarray, columns: slice | int, values: np.ndarray) -> np.ndarray:
    changed = table.copy()
    changed[:, columns] = values
    return changed
