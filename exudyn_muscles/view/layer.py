"""Drawing beside the user's system.

The muscles are drawn by a second, empty system in the container of the user's `mbs`: Exudyn renders
all systems of a container together, and the user's own one is neither extended nor assembled anew.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import exudyn as exu
from exudyn.utilities import ObjectGround, VObjectGround

from .scene import Scene

LAYER = "exudyn_muscles.view"


@contextmanager
def drawn(scene: Scene, container: exu.SystemContainer) -> Iterator[None]:
    """Let a container draw a scene; what it replaces is hidden meanwhile."""
    mbs = scene.model.mbs
    layer = _layer(container)
    shown = {number: mbs.GetObjectParameter(number, "Vshow") for number in scene.replaced}
    try:
        for number in shown:
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
        for number, before in shown.items():
            mbs.SetObjectParameter(number, "Vshow", before)


def _layer(container: exu.SystemContainer) -> exu.MainSystem:
    """An empty system to draw with: one left by an earlier call, as Exudyn cannot remove one."""
    for number in range(container.NumberOfSystems()):
        system = container.GetSystem(number)
        if LAYER in system.variables and system.systemData.NumberOfObjects() == 0:
            return system
    return container.AddSystem()
