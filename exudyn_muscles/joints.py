"""The joints of a model, and what they bear under the forces of its muscles and ideal actuators."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .errors import ModelError, ParameterError
from .forces.actuator_table import actuator_table
from .forces.actuators import Reserve
from .model import MusculoskeletalModel
from .skeleton.closed import Closed
from .skeleton.joints import Balance, JointFrame, JointLoads
from .skeleton.skeleton import Skeleton
from .skeleton.system.joints import SystemJoint, SystemJointLoads, system_joints
from .skeleton.system.opened import OpenedSystem
from .skeleton.system.recorded import recorded
from .skeleton.system.skeleton import GeneralSkeleton
from .skeleton.tree_joints import TreeJoint, TreeJointLoads, tree_joint, tree_joints

Joint = TreeJoint | SystemJoint


class Recorded(NamedTuple):
    """States of a model, and the forces there.

    Attributes
    ----------
    t : (k,) ndarray
        [s]
    z, v : (k, n) ndarray
        Coordinates and speeds.
    x, x_t : (k, N) ndarray
        Those of a whole system that is no tree.
    F : (k, m) ndarray
        Of the muscles' tendons [N].
    f : (k, r) ndarray
        Of ideal actuators [N m or N].
    """

    t: np.ndarray
    z: np.ndarray
    v: np.ndarray
    x: np.ndarray
    x_t: np.ndarray
    F: np.ndarray
    f: np.ndarray


class Joints(ABC):
    """Joints of a model.

    Attributes
    ----------
    names : tuple of str
    """

    names: tuple[str, ...]

    @abstractmethod
    def along(self, states: Recorded) -> Iterator[Balance]:
        """What is at each of these states."""

    @abstractmethod
    def now(
        self, q: np.ndarray, v: np.ndarray, t: float, F: np.ndarray, f: np.ndarray
    ) -> JointLoads:
        """Loads at the current state of a run, where coordinates and speeds are `q`, `v` (n,),
        under forces of muscles (m,) and ideal actuators (r,)."""


def check_frame(expressed_in: JointFrame) -> None:
    """Raise ParameterError unless it is one."""
    if not isinstance(expressed_in, JointFrame):
        raise ParameterError(
            f"expressed_in = {expressed_in!r} is not one of {', '.join(map(str, JointFrame))}"
        )


def joint_names(model: MusculoskeletalModel) -> tuple[str, ...]:
    """What the joints are called whose loads are known.

    A joint of a tree ends with a link that has a mass and is called by that link's coordinate; any
    other coordinate stands for a joint that ends there. One between bodies is called by what is
    tracked of it, if that is one coordinate, or else as in the `mbs`.

    Parameters
    ----------
    model : MusculoskeletalModel

    Returns
    -------
    tuple of str
    """
    return tuple(joint.name for joint in _all(model))


def model_joints(
    model: MusculoskeletalModel, chosen: Sequence[str] | Mapping[str, str] | None = None
) -> Joints:
    """Joints of a model, all of them or those with the `chosen` names; a mapping gives them other
    ones.

    Raises
    ------
    ParameterError
        There is no such joint; lists them.
    ModelError
        As `TreeJointLoads`, `SystemJointLoads`.
    """
    each = _all(model)
    if chosen is None:
        wanted = {joint.name: joint.name for joint in each}
        if len(wanted) < len(each):
            raise ParameterError("several joints of the mbs have the same name")
    elif isinstance(chosen, str):
        raise ParameterError(f"joints is a sequence of names or a mapping, got '{chosen}'")
    else:
        wanted = dict(chosen) if isinstance(chosen, Mapping) else {name: name for name in chosen}
    found = [_named(model, each, name) for name in wanted.values()]
    if not found:
        raise ParameterError("joints: there is none, or none was named")
    if isinstance(model.skeleton, Skeleton):
        return _OnTree(model, model.skeleton, tuple(wanted), found)
    return _OnBodies(model, model.skeleton, tuple(wanted), found)


def joint_force(
    model: MusculoskeletalModel, joint: str
) -> Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]:
    """How the force in a joint follows the forces of muscles and ideal actuators.

    Parameters
    ----------
    model : MusculoskeletalModel
        Of a kinematic tree.
    joint : str
        As of `model_joints`.

    Returns
    -------
    callable
        q, q' (n,), t -> R_0 (3,) [N] and L (3, m + r), with which the force on the joint's child in
        ground is R_0 + L F, with the accelerations that follow from F.

    Raises
    ------
    ParameterError
        There is no such joint; lists them.
    ModelError
        The skeleton is no tree, or one whose loops are closed, or as `TreeJointLoads`.
    """
    skeleton = model.skeleton
    if not isinstance(skeleton, Skeleton) or isinstance(skeleton.basis, Closed):
        raise ModelError(
            f"joint '{joint}': how its force follows those of muscles is known of kinematic trees "
            "without loops alone"
        )
    loads = _tree_loads(model, skeleton, [_named(model, _all(model), joint)])

    def force(q: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        constant, by_forces = loads.forces_by(q, v, t)
        return constant[0], by_forces[0]

    return force


def _all(model: MusculoskeletalModel) -> list[Joint]:
    skeleton = model.skeleton
    if isinstance(skeleton, Skeleton):
        return [*tree_joints(skeleton)]
    return [*system_joints(skeleton.mbs, skeleton.tracked)]


def _named(model: MusculoskeletalModel, joints: Sequence[Joint], name: str) -> Joint:
    for joint in joints:
        if joint.name == name:
            return joint
    skeleton, known = model.skeleton, [joint.name for joint in joints]
    if isinstance(skeleton, Skeleton):
        if name in skeleton.tree_coordinates:
            return tree_joint(skeleton, skeleton.tree_coordinates.index(name))
        known = [*skeleton.tree_coordinates]
    raise ParameterError(f"there is no joint '{name}'; the joints are {', '.join(known)}")


def _tree_loads(
    model: MusculoskeletalModel, skeleton: Skeleton, joints: Sequence[Joint]
) -> TreeJointLoads:
    actuators = actuator_table(model.reserves, skeleton.tree_coordinates, skeleton.frame_number)
    own = [joint for joint in joints if isinstance(joint, TreeJoint)]
    return TreeJointLoads(skeleton, own, model.paths, model.muscles.names, actuators)


class _OnTree(Joints):
    """Those of a kinematic tree."""

    def __init__(
        self,
        model: MusculoskeletalModel,
        skeleton: Skeleton,
        names: tuple[str, ...],
        joints: Sequence[Joint],
    ) -> None:
        self.names = names
        self._loads = _tree_loads(model, skeleton, joints)

    def along(self, states: Recorded) -> Iterator[Balance]:
        t, z, v, _, _, F, f = states
        for k, time in enumerate(t.tolist()):
            yield self._loads(z[k], v[k], time, F[k], f[k])

    def now(
        self, q: np.ndarray, v: np.ndarray, t: float, F: np.ndarray, f: np.ndarray
    ) -> JointLoads:
        return self._loads(q, v, t, F, f).loads


class _OnBodies(Joints):
    """Those of the `mbs` between bodies."""

    def __init__(
        self,
        model: MusculoskeletalModel,
        skeleton: GeneralSkeleton,
        names: tuple[str, ...],
        joints: Sequence[Joint],
    ) -> None:
        self.names = names
        own = [joint for joint in joints if isinstance(joint, SystemJoint)]
        self._model, self._skeleton = model, skeleton
        self._loads = SystemJointLoads(model.mbs, own, model.coordinates)
        # What a unit of each ideal actuator is along a tracked coordinate of its own.
        self._reserves = np.zeros((len(model.coordinates), len(model.reserves)))
        for k, reserve in enumerate(model.reserves):
            if isinstance(reserve, Reserve):
                self._reserves[model.coordinates.index(reserve.coordinate), k] = 1.0

    def along(self, states: Recorded) -> Iterator[Balance]:
        t, z, _, x, x_t, F, f = states
        with self._skeleton.apart(z[0]) as system:
            for k, _ in enumerate(recorded(self._model.mbs, system.state, x, x_t, t)):
                system.contacts.settle()
                length, load, loads = self._at(system, F[k], f[k])
                pose, M = system.pose(), system.dynamics().M
                acceleration = pose.T @ system.accelerations(load) + system.rate(pose)
                yield Balance(loads, length, M, acceleration)

    def now(
        self, q: np.ndarray, v: np.ndarray, t: float, F: np.ndarray, f: np.ndarray
    ) -> JointLoads:
        return self._at(self._skeleton.now, F, f)[2]

    def _at(
        self, system: OpenedSystem, F: np.ndarray, f: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, JointLoads]:
        """Lengths (m,), forces on all coordinates (N,), and loads at the current state."""
        pose, loads = system.pose(), self._model.loads
        assert loads is not None
        length, _, units = loads(pose)
        load = np.append(F, f) @ units
        return length, load, self._loads(system, pose, load, self._reserves @ f)
