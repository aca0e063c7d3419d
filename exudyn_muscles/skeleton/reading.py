"""What an Exudyn system tells about its kinematic tree, its constraints and its errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

import exudyn as exu
import numpy as np

from ..checks import item_shown
from ..errors import ModelError
from .tree import Tree

JOINTS = {
    exu.JointType.RevoluteX: 0,
    exu.JointType.RevoluteY: 1,
    exu.JointType.RevoluteZ: 2,
    exu.JointType.PrismaticX: 3,
    exu.JointType.PrismaticY: 4,
    exu.JointType.PrismaticZ: 5,
}


def tree_item(mbs: exu.MainSystem, tree: int) -> dict:
    """What Exudyn tells about a kinematic tree.

    Raises
    ------
    ModelError
        There is no such object, it is another one, or the number is one of another list.
    """
    try:
        if isinstance(tree, bool):
            raise TypeError
        item = mbs.GetObject(tree)
    except Exception as error:
        shown = tree if isinstance(tree, exu.ObjectIndex) else item_shown(tree)
        raise ModelError(f"tree = {shown} is not an object of this mbs") from error
    if item["objectType"] != "KinematicTree":
        raise ModelError(
            f"tree = {tree!r} is an object of type {item['objectType']}; "
            "the skeleton must be an ObjectKinematicTree"
        )
    return item


def read_tree(mbs: exu.MainSystem, tree: int) -> Tree:
    """The kinematic tree as arrays.

    Raises
    ------
    ModelError
        As `tree_item`, or a joint is of another type.
    """
    item = tree_item(mbs, tree)
    n = len(item["jointTypes"])
    for number, joint in enumerate(item["jointTypes"]):
        if joint not in JOINTS:
            raise ModelError(f"link {number}: joint type {joint} is not one of {list(JOINTS)}")
    reference = mbs.GetNodeParameter(item["nodeNumber"], "referenceCoordinates")
    return Tree(
        joints=np.array([JOINTS[joint] for joint in item["jointTypes"]], dtype=np.int64),
        parents=np.array(item["linkParents"], dtype=np.int64),
        rotations=np.array(item["jointTransformations"].GetPythonObject()).reshape(n, 3, 3),
        offsets=np.array(item["jointOffsets"].GetPythonObject(), dtype=float).reshape(n, 3),
        base=np.array(item["baseOffset"], dtype=float),
        reference=np.zeros(n) + (reference if np.size(reference) else 0.0),
    )


def check_assembled(mbs: exu.MainSystem) -> None:
    """Raise ModelError unless Exudyn can solve the system."""
    if not mbs.systemIsConsistent:
        raise ModelError("the mbs is not assembled: call mbs.Assemble() first")


def check_unconstrained(mbs: exu.MainSystem, tree: int) -> None:
    """Raise ModelError if algebraic constraints act on a tree's coordinates; others do no harm."""
    data = mbs.systemData
    if data.AEsize() == 0:
        return
    own = set(data.GetObjectLTGODE2(tree))
    numbers = [
        k
        for k in range(data.NumberOfObjects())
        if len(data.GetObjectLTGAE(k)) and own & set(data.GetObjectLTGODE2(k))
    ]
    if numbers:
        items = {k: mbs.GetObject(k) for k in numbers}
        shown = [f"{one['objectType']} '{one['name']}' (object {k})" for k, one in items.items()]
        raise ModelError(
            f"algebraic constraints act on the kinematic tree, of {', '.join(shown)}, so that its "
            "coordinates are not independent. Give the model a mapping of what is tracked in place "
            "of the tree, such as {'knee': em.NodeCoordinate(node, 1)}, or dependent_coordinates "
            "in place of constraints between its coordinates"
        )


def original(error: BaseException) -> BaseException:
    """The exception that a user function raised, which Exudyn wraps, once for every solver.

    An interrupt in compiled code may come as SystemError.
    """
    while isinstance(error, (exu.ExudynError, SystemError)) and error.__cause__ is not None:
        error = error.__cause__
    return error


def raise_as_itself(raised: BaseException, caught: BaseException) -> NoReturn:
    """Raise the `original` of a caught exception with the context that it had."""
    if raised is caught:
        raise raised
    context, hidden = raised.__context__, raised.__suppress_context__
    try:
        raise raised
    finally:
        raised.__context__, raised.__suppress_context__ = context, hidden


def check_mass_matrix(M: np.ndarray, coordinates: Sequence[str]) -> None:
    """Raise ModelError unless M (n, n) of these coordinates is positive definite."""
    if not np.isfinite(M).all():
        raise ModelError(
            "the mass matrix is not finite: check masses and inertias of the links; the last link "
            "of a chain needs a mass"
        )
    values, vectors = np.linalg.eigh(M)
    if not values[0] > 1e-12 * values[-1]:
        j = int(np.abs(vectors[:, 0]).argmax())
        raise ModelError(
            f"the mass matrix is not positive definite (smallest eigenvalue {values[0]:.3g}), "
            f"mostly in coordinate '{coordinates[j]}': check masses, centers of mass and inertias "
            "of the links"
        )
