"""Drawing beside the user's system.

The muscles are drawn by a second, empty system in the container of the user's `mbs`: Exudyn renders
all systems of a container together, and the user's own one is neither extended nor assembled anew.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import exudyn as exu
import numpy as np
from exudyn.utilities import ObjectGround, VObjectGround

from ..skeleton.skeleton import Skeleton
from .scene import Scene

LAYER = "exudyn_muscles.view"


@contextmanager
def drawn(scene: Scene, container: exu.SystemContainer) -> Iterator[None]:
    """Let a container draw a scene; sticks replace the tree meanwhile."""
    mbs = scene.model.mbs
    layer = _layer(container)
    hidden = _own_graphics(scene.model.skeleton) if scene.sticks else []
    shown = [mbs.GetObjectParameter(number, "Vshow") for number in hidden]
    try:
        for number in hidden:
            # Unlike VshowLinks and VshowJoints, this acts after assembly.
            mbs.SetObjectParameter(number, "Vshow", False)
        layer.AddObject(
            ObjectGround(visualization=VObjectGround(graphicsDataUserFunction=scene.draw))
        )
        layer.Assemble()
        yield
    finally:
        layer.Reset()
        layer.variables[LAYER] = True
        for number, before in zip(hidden, shown, strict=True):
            mbs.SetObjectParameter(number, "Vshow", before)


def _own_graphics(skeleton: Skeleton) -> list[int]:
    """The tree, and the ground that `CreateKinematicTree` makes just before it.

    That one has a block to every first joint that is not at the base, no name, and the base for its
    position.
    """
    mbs, tree = skeleton.mbs, skeleton.tree
    number = int(skeleton.object)
    blocks = int((tree.offsets[tree.parents < 0] != 0.0).any(axis=1).sum())
    if number == 0 or blocks == 0:
        return [number]
    before = mbs.GetObject(number - 1)
    is_own = (
        before["objectType"] == "Ground"
        and before["name"] == f"object{number - 1}"
        and np.array_equal(before["referencePosition"], tree.base)
        and len(before["VgraphicsData"]) == blocks
    )
    return [number, number - 1] if is_own else [number]


def _layer(container: exu.SystemContainer) -> exu.MainSystem:
    """An empty system to draw with: one left by an earlier call, as Exudyn cannot remove one."""
    for number in range(container.NumberOfSystems()):
        system = container.GetSystem(number)
        if LAYER in system.variables and system.systemData.NumberOfObjects() == 0:
            return system
    return container.AddSystem()
