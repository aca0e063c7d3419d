"""Bones from files: OpenSim's `.vtp`, and what trimesh reads."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ..errors import DisplayError, ModelFileError
from .disk import read_file

LARGEST = 100e6  # bytes; the largest bone of OpenSim's has 0.5 MB
ENDINGS = (".vtp", ".stl", ".obj")

Mesh = tuple[np.ndarray, np.ndarray]  # vertices (v, 3) [m], corners of triangles (t, 3)


def read_mesh(file: str | Path) -> Mesh:
    """Vertices and triangles of a file.

    Parameters
    ----------
    file : str or Path
        `.vtp` whose numbers are text, as OpenSim's, `.stl` or `.obj`.

    Raises
    ------
    ModelFileError
        It is damaged, or of another kind.
    DisplayError
        trimesh is needed and not installed.
    FileNotFoundError
    """
    ending = Path(file).suffix.lower()
    if ending not in ENDINGS:
        raise ModelFileError(f"{file}: a mesh is a file {', '.join(ENDINGS)}")
    content = read_file(file, LARGEST, ModelFileError)
    try:
        vertices, corners = _polygons(content) if ending == ".vtp" else _trimesh(content, ending)
        if not len(corners) or corners.min() < 0 or corners.max() >= len(vertices):
            raise ValueError("no triangles, or corners that are no vertices")
    except ModuleNotFoundError:
        raise DisplayError(
            f"{file}: reading it needs trimesh: pip install 'exudyn_muscles[report]'"
        ) from None
    except Exception as error:  # of XML and of what trimesh makes of a damaged file
        raise ModelFileError(f"{file}: not a readable mesh ({error})") from error
    return vertices, corners


def _polygons(content: bytes) -> Mesh:
    """Of VTK's XML: polygons become triangles about their first corner."""
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise ValueError("a DOCTYPE is refused")
    piece = ElementTree.fromstring(content).find("./PolyData/Piece")
    if piece is None:
        raise ValueError("it has no PolyData")
    vertices = _numbers(piece, "./Points/DataArray", float).reshape(-1, 3)
    connectivity, ends = (
        _numbers(piece, f"./Polys/DataArray[@Name='{name}']", np.int64)
        for name in ("connectivity", "offsets")
    )
    found = []
    for polygon in np.split(connectivity, ends[:-1]):
        first = np.full(len(polygon) - 2, polygon[0])
        found.append(np.column_stack([first, polygon[1:-1], polygon[2:]]))
    return vertices, np.vstack(found)


def _numbers(piece: ElementTree.Element, path: str, kind: type) -> np.ndarray:
    array = piece.find(path)
    if array is None or array.get("format") != "ascii":
        raise ValueError(f"it has no {path} as text")
    return np.array((array.text or "").split(), dtype=kind)


def _trimesh(content: bytes, ending: str) -> Mesh:
    import trimesh

    made = trimesh.load(
        BytesIO(content), file_type=ending[1:], force="mesh", process=False, skip_materials=True
    )
    return np.array(made.vertices, dtype=float), np.array(made.faces, dtype=np.int64)
