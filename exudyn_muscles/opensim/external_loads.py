"""External loads of OpenSim: forces over time on bodies of a model."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import ParameterError, StorageError
from ..files.storage import Storage, read_storage
from ..forces.external import ExternalForce
from ..numerics.splines import told_apart
from ..path.frames import GROUND
from .bodies import Bodies
from .components import named_apart
from .document import read_document
from .element import NOT_GIVEN, ON, Element
from .frames import Place

# Once the kinematics by which points in ground were transformed to the body. OpenSim 4 ignores
# them, and applies such a point at the pose that the body has.
IGNORED = (
    "external_loads_model_kinematics_file", "lowpass_cutoff_frequency_for_load_kinematics",
)  # fmt: skip
FRAMES = ("applied_to_body", "force_expressed_in_body", "point_expressed_in_body")
IDENTIFIERS = ("force_identifier", "point_identifier", "torque_identifier")


def read_external_loads(file: str | Path, bodies: Bodies) -> list[ExternalForce]:
    """The forces of an external loads file that are switched on, with their data.

    The data file is looked for from this file's folder.

    Raises
    ------
    ModelFileError
        The file is damaged, or holds what cannot be represented; names it and its place.
    StorageError
        The data file is damaged.
    FileNotFoundError
    """
    loads = read_document(file, "ExternalLoads")
    loads.allow("objects", "datafile", *IGNORED)
    forces = [force for force in loads.get("objects").children if force.is_on]
    if not forces:
        return []
    data_file = Path(file).parent / loads.word("datafile").replace("\\", "/")
    if not os.path.isfile(data_file):
        raise loads.get("datafile").error(f"there is no file {data_file}")
    data = read_storage(data_file)
    kept = told_apart(data.time)
    data = replace(data, time=data.time[kept], values=data.values[kept])
    read = (_read_force(force, bodies, data, data_file) for force in named_apart(forces))
    return [force for force in read if force is not None]


def _read_force(
    element: Element, bodies: Bodies, data: Storage, data_file: Path
) -> ExternalForce | None:
    """A force of a file, None if it acts on ground."""
    if element.tag != "ExternalForce":
        element.refuse()
    element.allow(*FRAMES, *IDENTIFIERS, "data_source_name", "isDisabled", *ON)
    element.word("applied_to_body")
    on, force_in, point_in = (_place(element, tag, bodies) for tag in FRAMES)
    if on.link == GROUND:
        element.get("applied_to_body").warn("ground does not move, and the force is left out")
        return None
    force, point, torque = (_vector(element, tag, data, data_file) for tag in IDENTIFIERS)
    point, torque = (_known(element, each, force) for each in (point, torque))
    if force is not None and point is None:  # at the body's origin
        point, point_in = np.zeros_like(force), on
    R = force_in.pose[:3, :3]
    try:
        return ExternalForce(
            element.name,
            on.link,
            data.time,
            force=None if force is None else force @ R.T,
            point=None if point is None else point_in.at(point),
            torque=None if torque is None else torque @ R.T,
            force_expressed_in=force_in.link,
            point_expressed_in=point_in.link,
        )
    except ParameterError as error:
        raise element.error(f"{data_file}: {error}") from None


def _place(element: Element, tag: str, bodies: Bodies) -> Place:
    """Where a frame is; ground if none is named."""
    found = element.find(tag)
    if found is None or not found.text:
        return Place(GROUND, np.eye(4))
    return bodies.place(found)


def _vector(element: Element, tag: str, data: Storage, data_file: Path) -> np.ndarray | None:
    """The columns (k, 3) that an element identifies, if it does."""
    identifier = element.word(tag, default="")
    if identifier in NOT_GIVEN:
        return None
    try:
        return data.vector(identifier)
    except StorageError as error:
        raise element.get(tag).error(f"{data_file}: {error}") from None


def _known(
    element: Element, values: np.ndarray | None, force: np.ndarray | None
) -> np.ndarray | None:
    """Points or torques (k, 3), those of the rows before where there is no force and they are
    unknown; what comes first is zero."""
    if values is None or force is None:
        return values
    unknown = ~np.isfinite(values).all(axis=1) & ~force.any(axis=1)
    if unknown.any():
        element.warn("unknown points and torques where there is no force stay as before")
        last = np.maximum.accumulate(np.where(unknown, -1, np.arange(len(values))))
        values = np.where((last >= 0)[:, None], values[last], 0.0)
    return values
