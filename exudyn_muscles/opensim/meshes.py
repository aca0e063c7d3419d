"""The bones that a model's file names, from a folder of geometry."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..errors import ModelFileWarning, ParameterError, warn
from ..files.meshes import ENDINGS, Mesh, read_mesh
from ..path.frames import GROUND
from ..shapes.tubes import merged
from .bodies import Bodies
from .document import read_document
from .element import Element
from .setup_files import named_model

ONES = (1.0, 1.0, 1.0)


class Shown(NamedTuple):
    """A file of geometry: its name, how it is scaled (3,), and its pose (4, 4) on the body."""

    file: str
    scale: np.ndarray
    pose: np.ndarray


def load_meshes(file: str | Path, geometry: str | Path) -> dict[int, Mesh]:
    """The bones that an OpenSim model shows, for `em.report(..., meshes=...)`.

    Of the files' names only the last part counts. Bodies without mass are left out, as `em.report`
    draws none.

    Parameters
    ----------
    file : str or Path
        The model (`.osim`), or a set-up of its CMC (`.xml`).
    geometry : str or Path
        Folder with the files that it names (`.vtp`, `.stl`, `.obj`).

    Returns
    -------
    dict of int to (ndarray, ndarray)
        By links, -1 for ground: vertices (v, 3) [m] and corners (t, 3) of triangles.

    Raises
    ------
    ParameterError
        There is no such folder.
    ModelFileError
        The model or a file of geometry is damaged.
    DisplayError
        trimesh is needed, for `.stl` and `.obj`, and not installed.

    Warns
    -----
    ModelFileWarning
        Files that are not in the folder, all in one warning.
    """
    if not Path(geometry).is_dir():
        raise ParameterError(f"geometry: there is no folder {geometry}")
    if Path(file).suffix.lower() == ".xml":
        file = named_model(read_document(file, "CMCTool", "AnalyzeTool"))
    parts: dict[int, list[Mesh]] = {}
    absent = []
    bodies = Bodies(read_document(file))
    for owner, place in bodies.owners():
        if place.link != GROUND and bodies.links[place.link].inertia.mass == 0.0:
            continue
        for shown in [*_attached(owner), *_visible(owner)]:
            path = Path(geometry) / Path(shown.file.replace("\\", "/")).name
            if not path.is_file() or path.suffix.lower() not in ENDINGS:
                absent.append(path.name)
                continue
            vertices, corners = read_mesh(path)
            on_body = (vertices * shown.scale) @ shown.pose[:3, :3].T + shown.pose[:3, 3]
            parts.setdefault(place.link, []).append((place.at(on_body), corners))
    if absent:
        names = ", ".join(dict.fromkeys(absent))
        warn(f"{file}: geometry that is not in {geometry}: {names}", ModelFileWarning)
    return {link: merged(meshes) for link, meshes in parts.items()}


def _attached(owner: Element) -> Iterator[Shown]:
    """Since version 4."""
    attached = owner.find("attached_geometry")
    for each in [] if attached is None else attached.children:
        if each.tag == "Mesh":
            yield Shown(each.word("mesh_file"), _scale(each), np.eye(4))


def _visible(owner: Element) -> Iterator[Shown]:
    """Before version 4."""
    visible = owner.find("VisibleObject")
    if visible is None:
        return
    scale, pose = _scale(visible), _pose(visible)
    for name in visible.word("geometry_files", default="").split():
        yield Shown(name, scale, pose)
    for each in visible.items("GeometrySet"):
        yield Shown(each.word("geometry_file"), scale * _scale(each), pose @ _pose(each))


def _scale(element: Element) -> np.ndarray:
    return element.vector("scale_factors", default=ONES)


def _pose(element: Element) -> np.ndarray:
    """From `transform`: angles about x, y and z, and a position."""
    given = element.vector("transform", 6, default=(0.0,) * 6)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("XYZ", given[:3]).as_matrix()
    pose[:3, 3] = given[3:]
    return pose
