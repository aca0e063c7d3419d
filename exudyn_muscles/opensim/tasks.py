"""Tracking tasks of OpenSim's CMC: gains and weights of coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from .document import Element, read_document

# About points and bodies, or about the weight that OpenSim's slow target gives to effort.
WITHOUT_INFLUENCE = ("wrt_body", "express_body", "r0", "r1", "r2", "limit")


class Task(NamedTuple):
    """Gains [1/s^2, 1/s] and weight of a coordinate, and where the file has them."""

    kp: float
    kv: float
    weight: float
    element: Element


def read_tasks(file: str | Path) -> Mapping[str, Task]:
    """The tasks that are switched on, by their coordinates.

    Raises
    ------
    ModelFileError
        The file is damaged, or holds what cannot be represented: tasks that are not about a
        coordinate, or a feed-forward gain other than 1.
    FileNotFoundError
    """
    tasks: dict[str, Task] = {}
    for element in read_document(file, "CMC_TaskSet").members():
        if not element.flag("on", True):
            continue
        if element.tag != "CMC_Joint":
            element.refuse()
        element.allow("on", "active", "weight", "kp", "kv", "ka", "coordinate", *WITHOUT_INFLUENCE)
        if element.word("active", default="true").split()[0].lower() != "true":
            continue
        kp, kv, ka, weight = (_first(element, tag) for tag in ("kp", "kv", "ka", "weight"))
        if ka != 1.0:
            raise element.get("ka").error(f"{ka:g}: only 1 can be represented")
        coordinate = element.word("coordinate")
        if coordinate in tasks:
            line = tasks[coordinate].element.line
            raise element.error(f"'{coordinate}' has another task, in line {line}")
        tasks[coordinate] = Task(kp, kv, weight, element)
    return tasks


def _first(element: Element, tag: str) -> float:
    """The first of up to three numbers, which is a coordinate's; 1 if there is none."""
    found = element.find(tag)
    return float(found.numbers()[0]) if found is not None and found.text else 1.0
