"""Limits of controls in OpenSim's files of control constraints."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from ..forces.actuators import actuator_names
from ..model import MusculoskeletalModel
from ..recruitment.limits import ControlLimits, Course, Limits
from .document import read_document
from .element import Element

# OpenSim's defaults of a ControlLinear.
MINIMUM, MAXIMUM = 0.02, 1.0
# First guesses, and what PID controls or filters do. OpenSim would go on along a straight line
# outside of the nodes if `extrapolate` is set; here a limit stays.
WITHOUT_INFLUENCE = (
    "x_nodes", "is_model_control", "extrapolate", "filter_on", "kp", "kv",
)  # fmt: skip

READ = ("default_min", "default_max", "use_steps", "min_nodes", "max_nodes")


def read_controls(
    file: str | Path, model: MusculoskeletalModel, idle: Collection[str] = ()
) -> dict[str, ControlLimits]:
    """The limits in a file with a `ControlSet`, by the names of actuators.

    Parameters
    ----------
    file : str or Path
    model : MusculoskeletalModel
        A control is called as one of its actuators, or with `.excitation` behind.
    idle : collection of str
        Names of other actuators, whose controls do not matter.

    Raises
    ------
    ModelFileError
        The file is damaged, or has limits that do not fit an actuator.
    FileNotFoundError

    Warns
    -----
    ModelFileWarning
        Controls of actuators that there are not, or second ones, which are left out.
    """
    controls = read_document(file, "ControlSet")
    names = [*model.muscles.names, *actuator_names(model.reserves)]
    limits: dict[str, ControlLimits] = {}
    for element in controls.members():
        if element.tag != "ControlLinear":
            element.refuse()
        element.allow(*READ, *WITHOUT_INFLUENCE)
        name = element.name.removesuffix(".excitation")
        if name not in names:
            if name not in idle:
                element.warn("there is no such actuator, and the control is left out")
            continue
        if name in limits:
            element.warn("this actuator has a control before, which alone counts")
            continue
        with element.blamed():
            limits[name] = ControlLimits(
                _course(element, "min", MINIMUM),
                _course(element, "max", MAXIMUM),
                steps=element.flag("use_steps"),
            )
            Limits({name: limits[name]}, model.muscles, model.reserves)
    return limits


def _course(element: Element, which: str, default: float) -> Course:
    nodes = element.find(f"{which}_nodes")
    if nodes is None or not nodes.children:
        return element.number(f"default_{which}", default)
    members = sorted(nodes.members(), key=lambda node: node.number("t"))
    for node in members:
        node.allow("t", "value")
    return [node.number("t") for node in members], [node.number("value") for node in members]
