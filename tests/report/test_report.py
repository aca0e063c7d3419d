"""What a page is made of, without a browser."""

import json
import re
import sys

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.cli import commands, main
from exudyn_muscles.cli.arguments import build_parser
from exudyn_muscles.report import scene
from exudyn_muscles.report.frames import RATE, sampled

from ..files.test_meshes import GIVEN
from ..opensim import ABSENT
from .pages import GAIT, NO_PLAYER, of_gait, of_leg, of_pedalling


@pytest.mark.parametrize("make", [of_leg, of_pedalling])
def test_frames_are_the_results(make):
    model, result = make()
    x = np.array(model.mbs.systemData.GetODE2Coordinates())
    frames = sampled(model, result)
    assert np.diff(frames.time).max() < 1.5 / RATE
    rows = np.searchsorted(result.time, frames.time)
    for i, name in enumerate(result.muscle_names):
        lengths = [
            np.linalg.norm(np.diff(lines[i], axis=0), axis=1).sum() for lines in frames.paths
        ]
        expected = result.musculotendon_lengths[rows, i]
        np.testing.assert_allclose(lengths, expected, rtol=2e-3, err_msg=name)
    np.testing.assert_array_equal(model.mbs.systemData.GetODE2Coordinates(), x)


def test_external_forces_begin_where_they_act():
    if not GAIT.exists():
        pytest.skip(ABSENT)
    model, result = of_gait()
    frames = sampled(model, result)
    record = em.read_storage(GAIT.parent / "subject01_walk1_grf.mot")
    seen = 0
    for shown in frames.forces.values():
        for side in ("", "1_"):
            point, force = (record.vector(f"{side}ground_force_{kind}") for kind in ("p", "v"))
            if np.interp(frames.time[5], record.time, force[:, 1]) == pytest.approx(
                shown[5, 1, 1], abs=2.0
            ):
                for values, part in ((point, 0), (force, 1)):
                    expected = [np.interp(frames.time[5], record.time, v) for v in values.T]
                    np.testing.assert_allclose(shown[5, part], expected, atol=[2e-3, 2.0][part])
                seen += 1
    assert len(frames.forces) == 2 and seen >= 1


def test_results_stand_side_by_side():
    model, result = of_leg()
    frames = sampled(model, result)
    (first, none), (second, offset) = scene._apart([frames, frames], np.array([1.0, 0.0, 0.0]))
    assert (none == 0.0).all() and (first.bodies == frames.bodies).all()
    moved = second.bodies[..., :3, 3] - first.bodies[..., :3, 3]
    np.testing.assert_allclose(moved, np.broadcast_to(offset, moved.shape), atol=1e-12)
    left, right = (np.vstack(one.paths[0])[:, 0] for one in (first, second))
    assert left.max() < right.min()


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    for module in ("k3d", "plotly"):
        pytest.importorskip(module, reason=NO_PLAYER)
    model, result = of_leg()
    file = tmp_path_factory.mktemp("page") / "leg.html"
    em.report(result, file, model=model)
    return result, file.read_text()


def test_the_curves_are_the_results(page):
    result, text = page
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
    assert data["muscles"] == list(result.muscle_names)
    (curves,) = data["results"]
    np.testing.assert_allclose(
        curves["errors"], np.degrees(result.tracking_errors()).T, rtol=1e-4, atol=1e-12
    )
    for name, values in (
        ("time", result.time),
        ("forces", result.tendon_forces.T),
        ("excitations", result.excitation_values.T),
        ("low", result.force_min.T),
        ("high", result.force_max.T),
        ("unmet", result.torques_unmet.T),
        ("ideal", result.torques_ideal.T),
    ):
        np.testing.assert_allclose(np.array(curves[name], float), values, rtol=1e-4, err_msg=name)


def test_a_page_is_small_and_names_no_other_place(page):
    _, text = page
    assert len(text) < 6e6
    own = re.sub(r'<script type="text/plain".*?</script>', "", text, flags=re.S)
    assert not re.search(r"https?://|src=|@import", own)
    assert "default-src 'none'" in own


def test_what_is_wrong_is_said(tmp_path, monkeypatch):
    model, result = of_leg()
    with pytest.raises(em.ParameterError, match="another model"):
        em.report(result, tmp_path / "x.html", model=of_pedalling()[0])
    with pytest.raises(em.ParameterError, match="'calf' names soleus_r; the muscles are"):
        em.report(result, tmp_path / "x.html", model=model, groups={"calf": ["soleus_r"]})
    with pytest.raises(em.ParameterError, match="no trajectory"):
        em.report([], tmp_path / "x.html", model=model)
    corner = np.eye(3)
    for meshes, message in (
        ({6: (corner, [[0, 1, 2]])}, r"6 is no segment with a mass; these are -1, 2, 5, 7"),
        ({2: (corner, [[0, 1, 3]])}, "corners of 2 are rows of its 3 vertices, got 0 to 3"),
        ({2: (corner[:, :2], [[0, 1, 2]])}, r"2 needs vertices \(v, 3\)"),
        ({2: (corner * np.nan, [[0, 1, 2]])}, "vertices of 2 must be finite"),
        ({2: None}, "meshes: of 2"),
    ):
        with pytest.raises(em.ParameterError, match=message):
            em.report(result, tmp_path / "x.html", model=model, meshes=meshes)
    with pytest.raises(em.ParameterError, match="directions"):
        em.report(result, tmp_path / "x.html", model=model, directions=np.ones((3, 3)))
    monkeypatch.setitem(sys.modules, "k3d", None)
    with pytest.raises(em.DisplayError, match=r"needs k3d: pip install 'exudyn_muscles\[report\]'"):
        em.report(result, tmp_path / "x.html", model=model)
    assert not list(tmp_path.iterdir())


def test_the_command_line_writes_it(tmp_path, capsys):
    for module in ("k3d", "plotly"):
        pytest.importorskip(module, reason=NO_PLAYER)
    _, result = of_leg()
    result.save(tmp_path / "leg.npz")
    model = em.__file__.replace("exudyn_muscles/__init__.py", "models/leg.py")
    assert main(["report", str(tmp_path / "leg.npz"), model]) == 0
    assert (tmp_path / "leg.html").stat().st_size > 1e6
    assert f"wrote {tmp_path / 'leg.html'}" in capsys.readouterr().out
    (tmp_path / "bone.vtp").write_text("<VTKFile/>")
    with pytest.raises(em.ModelFileError, match="not a readable mesh"):
        em.report(
            of_leg()[1], tmp_path / "x.html", model=of_leg()[0], meshes={2: tmp_path / "bone.vtp"}
        )
    other = tmp_path / "folder" / "page.html"
    assert main(["report", str(tmp_path / "leg.npz"), model, "--out", str(other)]) == 0
    assert other.exists()


def test_the_command_line_takes_bones(tmp_path, monkeypatch):
    """Those that the model names, from a folder."""
    if not GAIT.exists():
        pytest.skip(ABSENT)
    _, result = of_gait()
    result.save(tmp_path / "gait.npz")
    (tmp_path / "femur_r.vtp").write_text(GIVEN["vtp"])
    given = {}
    room = sys.modules["exudyn_muscles.report"]  # as an attribute it is the function
    monkeypatch.setattr(room, "report", lambda *_, **options: given.update(options))
    with pytest.warns(em.ModelFileWarning, match="sacrum.vtp, pelvis.vtp"):
        commands.report(
            build_parser().parse_args(
                ["report", str(tmp_path / "gait.npz"), str(GAIT), "--geometry", str(tmp_path)]
            )
        )
    ((link, (vertices, _)),) = given["meshes"].items()
    thigh = next(each for each in given["model"].skeleton.segments().bodies if each.number == link)
    assert len(vertices) == 5 and thigh.mass == pytest.approx(9.3014, rel=0.2)
