"""Tracking tasks of OpenSim's CMC: gains and weights of coordinates."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

from ..methods.tracking import TrackingSettings
from .document import read_document
from .element import Element

# About points and bodies, or about the weight that OpenSim's slow target gives to effort.
WITHOUT_INFLUENCE = ("wrt_body", "express_body", "r0", "r1", "r2", "limit")
# Of what a task leaves out, as OpenSim 4.6 prints them.
DEFAULTS = {"kp": 1.0, "kv": 0.5, "ka": 1.0, "weight": 1.0}


# How the name of a task about a muscle ends.
ACTIVATION = ".activation"


class Task(NamedTuple):
    """Gains [1/s^2, 1/s] and weight of a coordinate, and where the file has them."""

    kp: float
    kv: float
    weight: float
    element: Element


class Tasks(NamedTuple):
    """What is to be tracked.

    Attributes
    ----------
    coordinates : dict of str to Task
    activations : dict of str to Element
        By muscles, each with its place in the file.
    data : Path or None
        The storage file with these activations.
    """

    coordinates: dict[str, Task]
    activations: dict[str, Element]
    data: Path | None


def read_tasks(file: str | Path) -> Tasks:
    """The tasks that are on and active.

    As in OpenSim, a task is on unless its file says otherwise, but active only if its file says so.

    Raises
    ------
    ModelFileError
        The file is damaged, or holds what cannot be represented: tasks that are not about a
        coordinate, a feed-forward gain other than 1, gains or weights outside their ranges.
    FileNotFoundError
    """
    tasks: dict[str, Task] = {}
    activations: dict[str, Element] = {}
    task_set = read_document(file, "CMC_TaskSet")
    for element in task_set.members("datafile"):
        if not element.flag("on", True):
            continue
        if element.tag not in ("CMC_Joint", "MuscleStateTrackingTask"):
            element.refuse()
        element.allow("on", "active", "coordinate", *DEFAULTS, *WITHOUT_INFLUENCE)
        active = element.find("active")
        if active is None or not any(active.flags()[:1]):
            continue
        if element.tag == "MuscleStateTrackingTask":
            if not element.name.endswith(ACTIVATION):
                element.refuse()
            activations[element.name.removesuffix(ACTIVATION)] = element
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
    return Tasks(tasks, activations, _data(task_set) if activations else None)


def _data(task_set: Element) -> Path:
    """The file with the activations."""
    path = Path(task_set.file).parent / task_set.word("datafile").replace("\\", "/")
    if not os.path.isfile(path):
        raise task_set.get("datafile").error(f"there is no file {path}")
    return path


def _first(element: Element, tag: str) -> float:
    """The first of up to three numbers, which is a coordinate's."""
    found = element.find(tag)
    return float(found.numbers()[0]) if found is not None and found.text else DEFAULTS[tag]
