"""What a model has beside bodies, joints, constraints and forces."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from .element import Element

# They measure, mark or show, and do nothing to the motion.
PASSIVE = frozenset([
    "IMU", "Marker", "Station", "Point", "Arrow", "Brick", "Cone", "Cylinder", "Ellipsoid",
    "FrameGeometry", "Geometry", "LineGeometry", "Mesh", "Sphere", "Torus", "PathGeometry",
    "SignalGenerator", "TableReporter", "ConsoleReporter", "AccelerationIMU",
    "StatesTrajectoryReporter",
])  # fmt: skip
FRAMES = ("PhysicalOffsetFrame", "StationDefinedFrame")
STATIONS = ("Station", "Marker")
CONTROLS = (
    "it is left out: here the methods look for the controls of all actuators, which OpenSim's "
    "controllers would add to"
)


def warn_of_controllers(model: Element) -> None:
    """Warn of a model's controllers that are on."""
    for controller in model.items("ControllerSet"):
        if controller.is_on:
            controller.warn(CONTROLS)


def refuse_active(components: Iterable[Element]) -> None:
    """Refuse components that are neither passive, nor frames, nor switched off."""
    for component in components:
        if component.tag not in PASSIVE and component.tag not in FRAMES and component.is_on:
            component.refuse()


def named_apart(components: list[Element]) -> list[Element]:
    """The components, of which those without a name or with one that is taken get OpenSim's for it.

    Warns
    -----
    ModelFileWarning
        A name is taken.
    """
    found: dict[str, Element] = {}
    counts: dict[str, int] = {}
    for component in components:
        first = name = component.name or component.tag.lower()
        while name in found:
            number = counts.get(first, 0)
            name = f"{first}_{number}"
            counts[first] = number + 1
        if name != first:
            component.warn("this name is taken, and it gets a number, as in OpenSim")
        found[name] = component if name == component.name else replace(component, name=name)
    return list(found.values())
