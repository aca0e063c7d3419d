"""Tracking tasks of OpenSim's CMC: gains and weights of coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ..methods.tracking import TrackingSettings
from .document import read_document
from .element import Element

# About points and bodies, or about the weight that OpenSim's slow target gives to effort.
WITHOUT_INFLUENCE = ("wrt_body", "express_body", "r0", "r1", "r2", "limit")
# Of what a task leaves out, as OpenSim 4.6 prints them.
DEFAULTS = {"kp": 1.0, "kv": 0.5, "ka": 1.0, "weight": 1.0}


class Task(NamedTuple):
    """Gains [1/s^2, 1/s] and weight of a coordinate, and where the file has them."""

    kp: float
    kv: float
    weight: float
    element: Element


def read_tasks(file: str | Path) -> Mapping[str, Task]:
    """The tasks that are on and active, by their coordinates.

    As in OpenSim, a task is on unless its file says otherwise, but active only if its file says so.

    Raises
    ------
    ModelFileError
        The file is damaged, or holds what cannot be represented: tasks that are not about a
        coordinate, a feed-forward gain other than 1, gains or weights outside their ranges.
    FileNotFoundError
    """
    tasks: dict[str, Task] = {}
    # The data file is for tasks about muscles, which are refused.
    for element in read_document(file, "CMC_TaskSet").members("datafile"):
        if not element.flag("on", True):
            continue
        if element.tag != "CMC_Joint":
            element.refuse()
        element.allow("on", "active", "coordinate", *DEFAULTS, *WITHOUT_INFLUENCE)
        active = element.find("active")
        if active is None or not any(active.flags()[:1]):
            continue
        kp, kv, ka, weight = (_first(element, tag) for tag in ("kp", "kv", "ka", "weight"))
        if ka != 1.0:
            raise element.get("ka").error(f"{ka:g}: only 1 can be represented")
        with element.blamed():
            TrackingSettings(kp=kp, kv=kv, coordinate_weights=weight)
        coordinate = element.word("coordinate")
        if coordinate in tasks:
            line = tasks[coordinate].element.line
            raise element.error(f"'{coordinate}' has another task, in line {line}")
        tasks[coordinate] = Task(kp, kv, weight, element)
    return tasks


def _first(element: Element, tag: str) -> float:
    """The first of up to three numbers, which is a coordinate's."""
    found = element.find(tag)
    return float(found.numbers()[0]) if found is not None and found.text else DEFAULTS[tag]
