"""What the joints of a kinematic tree bear.

A copy of the system has a tree whose joints give way: behind every joint stand six links without
mass, three prismatic and three revolute ones, which are at rest. With its M, H and Q, all that
Exudyn knows of the system among them, muscles and ideal actuators, and q'' of the joints,

    load = M q'' + H - Q

in the six rows is what holds them there, the force and torque on what lies behind, about the joint.
It has the torque that acts on the joint's own coordinate in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import exudyn as exu
import numpy as np

from ..errors import ModelError, ParameterError
from ..forces.actuator_table import ActuatorTable
from ..path.frames import GROUND
from ..path.paths import Paths
from .closed import Closed
from .closures import closure_equations
from .geometry import compile_columns, compile_geometry
from .hold import hold
from .joints import Balance, JointLoads
from .opened import Opened
from .passive import PassiveTorque
from .reading import JOINTS
from .renumbered import Renumbering
from .skeleton import Skeleton
from .tree import Tree, tree_frames

GIVEN_WAY = (3, 4, 5, 0, 1, 2)  # joint codes of the six links
JOINT_TYPES = {number: kind for kind, number in JOINTS.items()}


class TreeJoint(NamedTuple):
    """A joint of one link or several, all but the last without mass.

    Attributes
    ----------
    name : str
        Of its last coordinate.
    link : int
        The child.
    first : int
        The first link of the joint.
    parent : int
        The body that it is on, or ground.
    """

    name: str
    link: int
    first: int
    parent: int


def tree_joints(skeleton: Skeleton) -> list[TreeJoint]:
    """The joints of links that have a mass; links without are part of the joint behind them."""
    return [tree_joint(skeleton, link) for link in np.flatnonzero(_masses(skeleton) > 0.0).tolist()]


def tree_joint(skeleton: Skeleton, link: int) -> TreeJoint:
    """The joint that ends with a link, be it without mass."""
    masses, parents, first = _masses(skeleton), skeleton.tree.parents.tolist(), link
    while (parent := parents[first]) != GROUND and masses[parent] == 0.0:
        first = parent
    return TreeJoint(skeleton.tree_coordinates[link], link, first, parent)


def _masses(skeleton: Skeleton) -> np.ndarray:
    return np.array(skeleton.mbs.GetObject(int(skeleton.object))["linkMasses"], dtype=float)


class TreeJointLoads:
    """Loads of joints of a tree.

    Parameters
    ----------
    skeleton : Skeleton
    joints : sequence of TreeJoint
    paths : Paths
        Of the muscles.
    muscles : sequence of str
        Their names.
    actuators : ActuatorTable

    Raises
    ------
    ModelError
        There is something beside the tree whose state nobody knows afterwards, or that cannot be
        copied, or a run is attached to the `mbs`.
    ParameterError
        A marker is on all coordinates of the tree's node.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        joints: Sequence[TreeJoint],
        paths: Paths,
        muscles: Sequence[str],
        actuators: ActuatorTable,
    ) -> None:
        if skeleton.others:
            raise ModelError(
                "joint loads: the mbs has bodies beside the kinematic tree, of whose state results "
                "know nothing; give the model a mapping of what is tracked in place of the tree"
            )
        if skeleton.mbs.NumberOfGeneralContacts():
            raise ModelError("joint loads: a GeneralContact on a kinematic tree is not known there")
        self._skeleton, self._joints = skeleton, tuple(joints)
        self._new, self._rows = _numbers(skeleton.tree, [joint.link for joint in joints])
        tree = _given_way(skeleton.tree, self._new, self._rows)
        self._tree, self._n = tree, len(tree)
        mbs, number = _copy(skeleton, tree, self._new)
        self._mbs = mbs  # lives as long as its views
        self._opened = Opened(mbs, number, slice(0, self._n), known_to_exudyn=False)
        self._geometry = compile_geometry(tree, self._new.paths(paths), muscles)
        self._columns = compile_columns(tree, self._new.actuators(actuators))
        self._closed = skeleton.basis if isinstance(skeleton.basis, Closed) else None

    def __call__(
        self, z: np.ndarray, v: np.ndarray, t: float, F: np.ndarray, f: np.ndarray
    ) -> Balance:
        """What is at coordinates and speeds (n,) and the time `t`
        under forces of muscles `F` (m,) and of ideal actuators `f` (r,)."""
        own, state = self._new.coordinates, self._opened.state
        slopes = self._go_to(z, v, t)
        M, acting, _ = self._opened.dynamics()
        geometry = self._geometry(state.q, state.v)
        acting = geometry.moment_arms.T @ F - acting
        if f.size:
            acting = acting + self._columns(state.q) @ f
        load, M_z, z_tt = self._balance(M, acting, *slopes)
        if self._closed is not None:
            load -= self._closing(self._closed, load[own], state.q[own], state.v[own])
        return Balance(self._in_ground(load, state.q), geometry.length, M_z, z_tt)

    def forces_by(self, z: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Forces on the children in ground without muscles and ideal actuators (k, 3) [N], and what
        a unit of each of them adds (k, 3, m + r), at coordinates and speeds (n,) and the time `t`.

        Accelerations are those that follow. Not of trees whose loops are closed.
        """
        state = self._opened.state
        R, bent = self._go_to(z, v, t)
        M, bias, _ = self._opened.dynamics()
        arms = self._geometry(state.q, state.v).moment_arms
        acting = np.column_stack([-bias, arms.T, self._columns(state.q)])
        alone = np.zeros((bent.size, acting.shape[1]))
        alone[:, 0] = bent
        load, _, _ = self._balance(M, acting, R, alone)
        links = self._new.link([joint.link for joint in self._joints])
        force = tree_frames(self._tree, state.q)[0][links] @ load[self._rows[:, :3]]
        return force[..., 0], force[..., 1:]

    def _go_to(self, z: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Put the copy where coordinates and speeds (n,) are at the time `t`; returns R = dq/dz of
        the tree's own coordinates (N, n), and R' z' (N,)."""
        own, state, n = self._new.coordinates, self._opened.state, z.size
        q, q_t, q_tt = self._skeleton.state_of_tree(
            np.tile(z, (n + 1, 1)), np.tile(v, (n + 1, 1)), np.eye(n + 1, n, -1)
        )
        state.q[:], state.v[:] = 0.0, 0.0
        state.q[own], state.v[own] = q[0], q_t[0]
        self._mbs.systemData.SetTime(t)
        self._opened.contacts.settle()
        return (q_tt[1:] - q_tt[0]).T, q_tt[0]

    def _balance(
        self, M: np.ndarray, acting: np.ndarray, R: np.ndarray, bent: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Loads on all coordinates of the copy under what acts there (all, ...), M_z and z''."""
        own = self._new.coordinates
        M = M[:, own]
        within = R.T @ M[own]
        M_z = within @ R
        z_tt = np.linalg.solve(M_z, R.T @ acting[own] - within @ bent)
        a = bent + R @ z_tt
        return M @ a - acting, M_z, z_tt

    def _closing(
        self, closed: Closed, missing: np.ndarray, q: np.ndarray, q_t: np.ndarray
    ) -> np.ndarray:
        """What the forces in the closures of loops are on all coordinates, from what they are on
        the tree's own (N,)."""
        rows = closed.equations_on(self._new)
        phi, G, gamma = np.empty(len(rows)), np.empty((len(rows), self._n)), np.empty(len(rows))
        all_q, all_q_t = np.zeros((2, self._n))
        all_q[self._new.coordinates], all_q_t[self._new.coordinates] = q, q_t
        closure_equations(*self._tree.tables(), rows, all_q, all_q_t, phi, G, gamma)
        return G.T @ closed.multipliers(G[:, self._new.coordinates], missing, q)

    def _in_ground(self, load: np.ndarray, q: np.ndarray) -> JointLoads:
        R, p, _ = tree_frames(self._tree, q)
        links = self._new.link([joint.link for joint in self._joints])
        parents = self._new.link([joint.parent for joint in self._joints])
        # With ground at the end, where -1 is.
        turns = np.concatenate([R, np.eye(3)[None]])
        places = np.concatenate([p, np.zeros((1, 3))])
        first = np.array([joint.first for joint in self._joints])
        tree, old = self._skeleton.tree, self._skeleton.tree.parents[first]
        offsets = np.where(old[:, None] < 0, tree.base + tree.offsets[first], tree.offsets[first])
        above = self._new.link(old)
        center = places[above] + np.einsum("kij,kj->ki", turns[above], offsets)
        local = load[self._rows].reshape(-1, 2, 3)
        force, torque = (np.einsum("kij,kj->ki", R[links], local[:, k]) for k in range(2))
        return JointLoads(force, torque, p[links], center, R[links], turns[parents])


def _numbers(tree: Tree, links: Sequence[int]) -> tuple[Renumbering, np.ndarray]:
    """New numbers where six links are put behind each of these, and those of the six (k, 6)."""
    extra = np.zeros(len(tree), dtype=int)
    extra[list(links)] = len(GIVEN_WAY)
    behind = np.cumsum(extra)
    coordinates = np.arange(len(tree)) + behind - extra
    carrying = coordinates + extra
    rows = coordinates[list(links), None] + 1 + np.arange(len(GIVEN_WAY))
    return Renumbering(carrying, coordinates), rows


def _given_way(tree: Tree, new: Renumbering, rows: np.ndarray) -> Tree:
    """The tree with the six links."""
    n, own = new.coordinates.size + rows.size, new.coordinates
    joints, parents = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    rotations, offsets, reference = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)), np.zeros(n)
    joints[own], parents[own] = tree.joints, new.link(tree.parents)
    rotations[own], offsets[own], reference[own] = tree.rotations, tree.offsets, tree.reference
    joints[rows], parents[rows] = GIVEN_WAY, rows - 1
    return replace(
        tree, joints=joints, parents=parents, rotations=rotations, offsets=offsets,
        reference=reference,
    )  # fmt: skip


def _copy(skeleton: Skeleton, tree: Tree, new: Renumbering) -> tuple[exu.MainSystem, int]:
    """A copy of the system with this tree in place of its own, and the tree's number."""
    number, n = int(skeleton.object), len(tree)
    with hold(skeleton.mbs):
        content, functions = _content(skeleton.mbs)
    item = content["objectList"][number] = dict(content["objectList"][number])
    item |= _links(item, tree, new)
    node = content["nodeList"][item["nodeNumber"]]
    content["nodeList"][item["nodeNumber"]] = node | {
        "referenceCoordinates": tree.reference,
        "numberOfODE2Coordinates": n,
        "initialCoordinates": np.zeros(n),
        "initialCoordinates_t": np.zeros(n),
    }
    content["markerList"] = [
        _marker(marker, number, int(item["nodeNumber"]), new) for marker in content["markerList"]
    ]
    content["sensorList"] = []
    content["systemVariables"] = {}
    mbs = exu.SystemContainer().AddSystem()
    mbs.SetDictionary(content)
    for kind in ("PreStep", "PostStep", "PostNewton", "PreNewtonResidual", "SystemJacobian"):
        getattr(mbs, f"Set{kind}UserFunction")(0)
    for (k, kind), function in functions.items():
        own = _user_function(function, tree, new) if k == number else function
        mbs.SetObjectParameter(k, kind, own)
    mbs.Assemble()
    return mbs, number


def _content(mbs: exu.MainSystem) -> tuple[dict[str, Any], dict[tuple[int, str], Any]]:
    """What Exudyn tells of a system, and the user functions of its objects, by their numbers and
    kinds, with which it tells nothing."""
    functions: dict[tuple[int, str], Any] = {}
    for k in range(mbs.systemData.NumberOfObjects()):
        for kind, function in mbs.GetObject(k).items():
            if kind.endswith("UserFunction") and not kind.startswith("V") and function != 0:
                known = function["function"] if isinstance(function, dict) else function
                functions[k, kind] = known
    try:
        for number, kind in functions:
            mbs.SetObjectParameter(number, kind, 0)
        return mbs.GetDictionary(), functions
    except exu.ExudynError as error:
        raise ModelError(f"joint loads: the mbs cannot be copied: {error}") from error
    finally:
        for (number, kind), function in functions.items():
            mbs.SetObjectParameter(number, kind, function)


def _links(item: dict[str, Any], tree: Tree, new: Renumbering) -> dict[str, Any]:
    """What a kinematic tree's object says of its links, with those that are new."""
    n = len(tree)
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = tree.rotations, tree.offsets
    masses, centers, tensors = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3))
    masses[new.links] = item["linkMasses"]
    centers[new.links] = item["linkCOMs"].GetPythonObject()
    tensors[new.links] = item["linkInertiasCOM"].GetPythonObject()
    changed: dict[str, Any] = {
        "jointTypes": [JOINT_TYPES[code] for code in tree.joints.tolist()],
        "linkParents": tree.parents.tolist(),
        "jointTransformations": exu.Matrix3DList(list(tree.rotations)),
        "jointOffsets": exu.Vector3DList(list(tree.offsets)),
        "jointHTs": list(poses),
        "linkMasses": masses,
        "linkCOMs": exu.Vector3DList(list(centers)),
        "linkInertiasCOM": exu.Matrix3DList(list(tensors)),
    }
    for name in item:
        given = np.asarray(item[name]) if name.startswith("joint") and "Vector" in name else None
        if given is not None and given.size:
            changed[name] = np.zeros(n)
            changed[name][new.coordinates] = given
    return changed


def _marker(marker: dict[str, Any], tree: int, node: int, new: Renumbering) -> dict[str, Any]:
    """A marker where it was."""
    kind = marker["markerType"]
    if kind == "KinematicTreeRigid" and int(marker["objectNumber"]) == tree:
        return marker | {"linkNumber": int(new.link([marker["linkNumber"]])[0])}
    if int(marker.get("nodeNumber", -1)) != node:
        return marker
    if kind == "NodeCoordinate":
        return marker | {"coordinate": int(new.coordinates[marker["coordinate"]])}
    raise ParameterError(
        f"joint loads: marker '{marker['name']}' is on all coordinates of the tree's node"
    )


def _user_function(function: Any, tree: Tree, new: Renumbering) -> Any:
    """A tree's force user function on the one with other numbers."""
    of = getattr(function, "__self__", None)
    if isinstance(of, PassiveTorque):
        return of.on(tree, new).for_exudyn
    own = new.coordinates

    def of_coordinates(mbs: exu.MainSystem, t: float, i: int, q: list, v: list) -> np.ndarray:
        Q = np.zeros(len(q))
        Q[own] = function(mbs, t, i, np.array(q)[own], np.array(v)[own])
        return Q

    return of_coordinates
