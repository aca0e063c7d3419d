"""The bones that a model's file names."""

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.opensim.bodies import Bodies
from exudyn_muscles.opensim.document import read_document

from ..files.test_meshes import GIVEN
from ..opensim_files import BODY, write_model

NEW = r"""<attached_geometry><Mesh name="a"><scale_factors>2 1 1</scale_factors>
<mesh_file>..\{file}</mesh_file></Mesh></attached_geometry>"""
OLD = """<VisibleObject><GeometrySet><objects><DisplayGeometry><geometry_file>{file}</geometry_file>
<transform>0 0 1.5707963267948966 0.1 0 0</transform><scale_factors>1 1 1</scale_factors>
</DisplayGeometry></objects></GeometrySet><scale_factors>2 1 1</scale_factors>
<transform>0 0 0 0 0 0.5</transform></VisibleObject>"""


def written(folder, shown):
    """A model's file whose body shows this, and its folder of geometry with a pyramid."""
    geometry = folder / "Geometry"
    geometry.mkdir()
    (geometry / "bone.vtp").write_text(GIVEN["vtp"])
    return write_model(folder / "x.osim", bodies=BODY.format(name="body", inside=shown)), geometry


@pytest.mark.parametrize(
    ("shown", "low", "high"), [(NEW, (0, 0, 0), (2, 1, 2)), (OLD, (-0.9, 0, 0.5), (0.1, 2, 2.5))]
)
def test_geometry_of_new_and_old_files(tmp_path, shown, low, high):
    """Scaled, turned and moved; of the name only the last part counts."""
    file, geometry = written(tmp_path, shown.format(file="bone.vtp"))
    ((link, (vertices, corners)),) = em.opensim.load_meshes(file, geometry).items()
    place = Bodies(read_document(file)).places["/bodyset/body"]
    assert link == place.link and len(corners) == 6
    on_body = (vertices - place.pose[:3, 3]) @ place.pose[:3, :3]
    np.testing.assert_allclose(on_body.min(axis=0), low, atol=1e-12)
    np.testing.assert_allclose(on_body.max(axis=0), high, atol=1e-12)


def test_what_is_absent_is_told(tmp_path):
    file, geometry = written(tmp_path, NEW.format(file="none.vtp"))
    with pytest.warns(em.ModelFileWarning, match=r"geometry that is not in .*: none.vtp"):
        assert em.opensim.load_meshes(file, geometry) == {}
    with pytest.raises(em.ParameterError, match="there is no folder"):
        em.opensim.load_meshes(file, tmp_path / "elsewhere")
