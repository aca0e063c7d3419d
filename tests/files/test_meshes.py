"""Bones from files."""

import sys

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.files.meshes import read_mesh

# A pyramid of a square and four triangles.
POINTS = "0 0 0  1 0 0  1 1 0  0 1 0  0.5 0.5 2"
VTP = """<?xml version="1.0"?>
<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="5" NumberOfPolys="5">
<PointData Normals="normals"><DataArray Name="normals" format="ascii">1 2 3</DataArray></PointData>
<Points><DataArray NumberOfComponents="3" format="ascii">{points}</DataArray></Points>
<Polys><DataArray Name="connectivity" format="ascii">3 2 1 0  0 1 4  1 2 4  2 3 4  3 0 4</DataArray>
<DataArray Name="offsets" format="{format}">4 7 10 13 16</DataArray></Polys>
</Piece></PolyData></VTKFile>
"""
OBJ = """v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 2
f 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"""
STL = "solid x\n{}endsolid x\n".format(
    "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*point) for point in triangle)
        + "endloop\nendfacet\n"
        for triangle in (
            ((0, 1, 0), (1, 1, 0), (1, 0, 0)), ((0, 1, 0), (1, 0, 0), (0, 0, 0)),
            ((0, 0, 0), (1, 0, 0), (0.5, 0.5, 2)), ((1, 0, 0), (1, 1, 0), (0.5, 0.5, 2)),
            ((1, 1, 0), (0, 1, 0), (0.5, 0.5, 2)), ((0, 1, 0), (0, 0, 0), (0.5, 0.5, 2)),
        )
    )
)  # fmt: skip
GIVEN = {"vtp": VTP.format(points=POINTS, format="ascii"), "obj": OBJ, "stl": STL}


@pytest.mark.parametrize("ending", GIVEN)
def test_a_pyramid(tmp_path, ending):
    if ending != "vtp":
        pytest.importorskip("trimesh", reason="pip install 'exudyn_muscles[report]'")
    file = tmp_path / f"bone.{ending.upper()}"
    file.write_text(GIVEN[ending])
    vertices, corners = read_mesh(file)
    a, b, c = (vertices[corners[:, k]] for k in range(3))
    assert len(corners) == 6
    assert float((a * np.cross(b, c)).sum() / 6.0) == pytest.approx(2.0 / 3.0)  # seen from outside


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("x.vtp", VTP.format(points=POINTS, format="appended"), "offsets.* as text"),
        ("x.vtp", VTP.format(points="0 0 0 1 0 0", format="ascii"), "corners that are no vertices"),
        ("x.vtp", VTP.format(points="0 0 z", format="ascii"), "could not convert"),
        ("x.vtp", '<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "DOCTYPE"),
        ("x.vtp", "<VTKFile/>", "no PolyData"),
        ("x.vtp", "<VTKFile>", "not a readable mesh"),
        ("x.ply", "ply", "a mesh is a file .vtp, .stl, .obj"),
    ],
)
def test_what_is_damaged_is_said(tmp_path, name, content, message):
    (tmp_path / name).write_text(content)
    with pytest.raises(em.ModelFileError, match=message):
        read_mesh(tmp_path / name)


def test_without_trimesh(tmp_path, monkeypatch):
    (tmp_path / "x.obj").write_text(OBJ)
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(em.DisplayError, match="needs trimesh: pip install"):
        read_mesh(tmp_path / "x.obj")
