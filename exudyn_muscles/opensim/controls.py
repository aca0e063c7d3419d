"""Limits of controls in OpenSim's files of control constraints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..errors import ParameterError
from ..recruitment.limits import ControlLimits, Course
from .document import Element, read_document

# OpenSim's defaults of a ControlLinear.
MINIMUM, MAXIMUM = 0.02, 1.0
# First guesses, and what PID controls or filters do. OpenSim would go on along a straight line
# outside of the nodes if `extrapolate` is set; here a limit stays.
WITHOUT_INFLUENCE = (
    "x_nodes", "is_model_control", "extrapolate", "filter_on", "kp", "kv",
)  # fmt: skip
READ = ("default_min", "default_max", "use_steps", "min_nodes", "max_nodes")


def read_controls(file: str | Path, names: Sequence[str]) -> dict[str, ControlLimits]:
    """The limits in a file with a `ControlSet`, by the names of actuators.

    Parameters
    ----------
    file : str or Path
    names : sequence of str
        Of all actuators; a control is called as one of them, or with `.excitation` behind.

    Raises
    ------
    ModelFileError
        The file is damaged or names an actuator that there is not.
    FileNotFoundError
    """
    controls = read_document(file, "ControlSet")
    defaults = controls.find("defaults")
    usual = defaults.find("ControlLinear") if defaults is not None else None
    limits: dict[str, ControlLimits] = {}
    for element in controls.get("objects").children:
        if element.tag != "ControlLinear":
            element.refuse()
        element.allow(*READ, *WITHOUT_INFLUENCE)
        name = element.name.removesuffix(".excitation")
        if name not in names:
            raise element.error(f"there is no actuator '{name}', only {', '.join(names)}")
        if name in limits:
            raise element.error("given before")
        try:
            limits[name] = ControlLimits(
                _course(element, usual, "min", MINIMUM),
                _course(element, usual, "max", MAXIMUM),
                steps=_owner(element, usual, "use_steps").flag("use_steps"),
            )
        except ParameterError as error:
            raise element.error(str(error)) from None
    return limits


def _owner(element: Element, usual: Element | None, tag: str) -> Element:
    """The control itself if it has a property, otherwise the file's default control."""
    return element if usual is None or element.find(tag) is not None else usual


def _course(element: Element, usual: Element | None, which: str, default: float) -> Course:
    nodes = element.find(f"{which}_nodes")
    if nodes is None or not nodes.children:
        tag = f"default_{which}"
        return _owner(element, usual, tag).number(tag, default)
    members = sorted(nodes.members(), key=lambda node: node.number("t"))
    return [node.number("t") for node in members], [node.number("value") for node in members]
