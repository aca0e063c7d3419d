"""The joints of a model, and what they bear under the forces of its muscles and ideal actuators."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .errors import ParameterError
from .forces.actuators import Reserve, actuator_table
from .model import MusculoskeletalModel
from .skeleton.joints import JointLoads
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
    def along(self, states: Recorded) -> Iterator[tuple[np.ndarray, JointLoads]]:
        """Lengths (m,) of the muscles, and loads, at each of these states."""

    @abstractmethod
    def now(
        self, q: np.ndarray, v: np.ndarray, t: float, F: np.ndarray, f: np.ndarray
    ) -> JointLoads:
        """Loads at the current state of a run, where coordinates and speeds are `q`, `v` (n,),
        under forces of muscles (m,) and ideal actuators (r,)."""


def joint_names(model: MusculoskeletalModel) -> tuple[str, ...]:
    """What the joints are called whose loads are known.

    A joint of a tree ends with a link that has a mass and is called by that link's coordinate; any
    other coordinate stands for a joint that ends there. One between bodies is called by what is
    tracked of it, if that is one coordinate, or else as in the `mbs`.
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
    if isinstance(model.skeleton, Skeleton):
        return _OnTree(model, model.skeleton, tuple(wanted), found)
    return _OnBodies(model, model.skeleton, tuple(wanted), found)


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
        actuators = actuator_table(model.reserves, skeleton.tree_coordinates, skeleton.frame_number)
        own = [joint for joint in joints if isinstance(joint, TreeJoint)]
        self._loads = TreeJointLoads(skeleton, own, model.paths, model.muscles.names, actuators)

    def along(self, states: Recorded) -> Iterator[tuple[np.ndarray, JointLoads]]:
        t, z, v, _, _, F, f = states
        for k, time in enumerate(t.tolist()):
            loads, lengths = self._loads(z[k], v[k], time, F[k], f[k])
            yield lengths, loads

    def now(
        self, q: np.ndarray, v: np.ndarray, t: float, F: np.ndarray, f: np.ndarray
    ) -> JointLoads:
        return self._loads(q, v, t, F, f)[0]


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

    def along(self, states: Recorded) -> Iterator[tuple[np.ndarray, JointLoads]]:
        t, z, _, x, x_t, F, f = states
        with self._skeleton.apart(z[0]) as system:
            for k, _ in enumerate(recorded(self._model.mbs, system.state, x, x_t, t)):
                system.contacts.settle()
                yield self._at(system, F[k], f[k])

    def now(
        self, q: np.ndarray, v: np.ndarray, t: float, F: np.ndarray, f: np.ndarray
    ) -> JointLoads:
        return self._at(self._skeleton.now, F, f)[1]

    def _at(
        self, system: OpenedSystem, F: np.ndarray, f: np.ndarray
    ) -> tuple[np.ndarray, JointLoads]:
        pose, loads = system.pose(), self._model.loads
        assert loads is not None
        lengths, _, units = loads(pose)
        load = np.append(F, f) @ units
        return lengths, self._loads(system, pose, load, self._reserves @ f)
