"""Passive forces on a kinematic tree, in the Exudyn system itself.

They are the tree's `forceUserFunction`, so that Exudyn's own runs have them, and Q with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import exudyn as exu
import numpy as np

from ..checks import check_link_exists
from ..errors import ModelError, ParameterError, WrappingError
from ..forces.passive.along_paths import COLUMNS as PATH_COLUMNS
from ..forces.passive.along_paths import (
    Ligament,
    PathForce,
    PointToPointFormula,
    path_row,
    tension,
)
from ..forces.passive.between_frames import COLUMNS as BUSHING_COLUMNS
from ..forces.passive.between_frames import LINKS, POSES, Bushing, add_bushing, bushing_row
from ..forces.passive.contact import COLUMNS as CONTACT_COLUMNS
from ..forces.passive.contact import LINKS as SPHERE_LINKS
from ..forces.passive.contact import POSE, SphereContact, add_contact, contact_row
from ..forces.passive.expressions import STACK, Program, Programs, pack_programs
from ..forces.passive.on_coordinates import COLUMNS as COORDINATE_COLUMNS
from ..forces.passive.on_coordinates import (
    ON,
    CoordinateForce,
    CoordinateFormula,
    coordinate_force,
    coordinate_row,
)
from ..numerics.curves import Curve, PackedCurves, pack
from ..numerics.kernel import kernel
from ..path.paths import NO_CURVE, Paths, collect_paths
from .geometry import geometry_tables, tree_geometry
from .reading import read_tree, tree_item
from .renumbered import Renumbering
from .tree import Tree, link_frames

VARIABLES = 8  # of a program, behind its stack
BUSHING_LINKS, CONTACT_LINKS = slice(LINKS, POSES), slice(SPHERE_LINKS, POSE)
PassiveForce = CoordinateForce | PathForce | Bushing | SphereContact


class PassiveTables(NamedTuple):
    """Passive forces as the kernels take them: a row each, their curves, and their programs."""

    on_coordinates: np.ndarray
    along_paths: np.ndarray
    between_frames: np.ndarray
    contacts: np.ndarray
    curves: PackedCurves
    programs: Programs


@kernel(allocates=True)
def add_to_frames(joints, parents, rotations, offsets, reference, tables, q, v, stack, Q):
    """Add all but tensions along paths to Q (n,) at q, q' (n,)."""
    n = joints.size
    for row in tables.on_coordinates:
        j = int(row[ON])
        Q[j] += coordinate_force(row, tables.programs, q[j], v[j], stack)
    if tables.between_frames.size + tables.contacts.size == 0:
        return
    R, p, axes = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    link_frames(joints, parents, rotations, offsets, reference, q, R, p, axes)
    for row in tables.between_frames:
        add_bushing(joints, parents, R, p, axes, row, tables.programs, v, stack, Q)
    for row in tables.contacts:
        add_contact(joints, parents, R, p, axes, row, v, Q)


@kernel
def add_tensions(tables, l, l_rate, r, stack, Q):
    """Add the tensions along paths with lengths, speeds (k,) and moment arms (k, n) to Q (n,)."""
    for i in range(l.size):
        F = tension(tables.along_paths[i], tables.curves, tables.programs, l[i], l_rate[i], stack)
        for j in range(Q.size):
            Q[j] += r[i, j] * F


def add_passive_forces(
    mbs: exu.MainSystem, tree: int, forces: Sequence[PassiveForce], coordinates: Sequence[str]
) -> None:
    """Add forces to a kinematic tree, before `mbs.Assemble()`.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    tree : ObjectIndex
        Of an `ObjectKinematicTree` without a force user function.
    forces : sequence of PassiveForce
    coordinates : sequence of str
        Names of all of the tree's.

    Raises
    ------
    ModelError
        The object is no such tree.
    ParameterError
        A force names a link or coordinate that the tree does not have.
    """
    if not forces:
        return
    if tree_item(mbs, tree)["forceUserFunction"] != 0:
        raise ModelError(f"tree = {tree!r} has a force user function already")
    function = passive_torque(mbs, tree, forces, coordinates)
    mbs.SetObjectParameter(tree, "forceUserFunction", function.for_exudyn)


class PassiveTorque:
    """The function (q, q') -> torques (n,) of passive forces on a tree.

    When called it raises WrappingError where a path finds no way over an ellipsoid.
    """

    def __init__(
        self, tree: Tree, tables: PassiveTables, along: Sequence[str], paths: Paths | None
    ) -> None:
        self._given = tables, along, paths
        self._tree, self._n = tree.tables(), len(tree)
        self._of_paths = None if paths is None else geometry_tables(tree, paths)
        self._stack = np.empty(STACK + VARIABLES)

    def __call__(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        (tables, along, _), n, k = self._given, self._n, len(self._given[1])
        Q = np.zeros(n)
        add_to_frames(*self._tree, tables, q, v, self._stack, Q)
        if self._of_paths is not None:
            l, l_rate, r = np.empty(k), np.empty(k), np.empty((k, n))
            failed = tree_geometry(*self._of_paths, q, v, l, l_rate, r)
            if failed >= 0:
                raise WrappingError(
                    f"force '{along[failed]}': found no way over an ellipsoid at q = {q}"
                )
            add_tensions(tables, l, l_rate, r, self._stack, Q)
        return Q

    def for_exudyn(self, mbs: exu.MainSystem, t: float, _: int, q: list, v: list) -> np.ndarray:
        """The same as a user function."""
        return self(np.array(q), np.array(v))

    def on(self, tree: Tree, new: Renumbering) -> PassiveTorque:
        """The same forces on a tree with other numbers."""
        tables, along, paths = self._given
        tables = tables._replace(
            on_coordinates=new.on_coordinates(tables.on_coordinates, ON),
            between_frames=new.on_links(tables.between_frames, BUSHING_LINKS),
            contacts=new.on_links(tables.contacts, CONTACT_LINKS),
        )
        return PassiveTorque(tree, tables, along, None if paths is None else new.paths(paths))


def passive_torque(
    mbs: exu.MainSystem, tree: int, forces: Sequence[PassiveForce], coordinates: Sequence[str]
) -> PassiveTorque:
    """The function of `add_passive_forces`, which raises the same errors."""
    links = read_tree(mbs, tree)
    tables, along = _tables(forces, coordinates, len(links))
    paths, names = None, [force.name for force in along]
    if along:
        paths = collect_paths(
            names,
            [force.path for force in along],
            [force.wraps for force in along],
            len(links),
            coordinates,
            kind="force",
        )
    return PassiveTorque(links, tables, names, paths)


def _tables(
    forces: Sequence[PassiveForce], coordinates: Sequence[str], links: int
) -> tuple[PassiveTables, list[PathForce]]:
    """The forces' rows, and those along paths in the order of theirs."""
    numbers = {name: number for number, name in enumerate(coordinates)}
    programs: list[Program] = []
    curves: list[Curve] = [NO_CURVE]
    along: list[tuple[PathForce, np.ndarray]] = []
    on_coordinates, between, contacts = [], [], []
    for force in forces:
        what = f"force '{force.name}'"
        if isinstance(force, CoordinateForce):
            if force.coordinate not in numbers:
                raise ParameterError(
                    f"{what}: there is no coordinate '{force.coordinate}', those are "
                    f"{', '.join(coordinates)}"
                )
            number = numbers[force.coordinate]
            on_coordinates.append(coordinate_row(force, number, len(programs)))
            if isinstance(force, CoordinateFormula):
                programs.append(force.program)
        elif isinstance(force, Bushing):
            for link in force.links:
                check_link_exists(what, link, links)
            between.append(bushing_row(force, len(programs)))
            programs += force.programs
        elif isinstance(force, SphereContact):
            for link in (force.sphere, force.half_space):
                check_link_exists(what, link, links)
            contacts.append(contact_row(force))
        elif isinstance(force, Ligament):
            along.append((force, path_row(force, len(curves))))
            curves.append(force.force_length)
        else:
            along.append((force, path_row(force, len(programs))))
            if isinstance(force, PointToPointFormula):
                programs.append(force.program)
    tables = PassiveTables(
        _rows(on_coordinates, COORDINATE_COLUMNS), _rows([row for _, row in along], PATH_COLUMNS),
        _rows(between, BUSHING_COLUMNS), _rows(contacts, CONTACT_COLUMNS),
        PackedCurves(*(array.copy() for array in pack(curves))), pack_programs(programs),
    )  # fmt: skip
    return tables, [force for force, _ in along]


def _rows(rows: list[np.ndarray], columns: int) -> np.ndarray:
    return np.array(rows).reshape(-1, columns)
