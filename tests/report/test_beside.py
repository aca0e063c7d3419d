"""What analyses add to a page."""

import json
import re

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import analysis

from .pages import NO_PLAYER, needs, of_pedalling


@pytest.fixture(scope="module")
def case():
    needs("k3d", "plotly", reason=NO_PLAYER)
    return of_pedalling()


def data_of(file):
    return json.loads(re.search(r'id="data">(.*?)</script>', file.read_text(), re.S)[1])


def test_curves_of_analyses_are_in_the_page(case, tmp_path):
    pytest.importorskip("highspy")
    model, result = case
    loads = analysis.joint_loads(model, result, ["hip", "pedal"])
    ranges = analysis.feasible_forces(model, result)
    emg = analysis.EMG(("one",), result.time, np.cos(result.time)[:, None])
    em.report(
        result, tmp_path / "page.html", model=model, joint_loads=loads, feasible=ranges, emg=emg,
        measured={"vasti": "one"},
    )  # fmt: skip
    data = data_of(tmp_path / "page.html")
    (curves,) = data["results"]
    assert data["joints"] == ["hip", "pedal"]
    size = np.linalg.norm(loads["force/pedal"], axis=1)
    np.testing.assert_allclose(curves["loads"][1], size, rtol=1e-4)
    np.testing.assert_allclose(curves["load_time"], result.time, rtol=1e-4)
    for end in ("least", "largest"):
        np.testing.assert_allclose(
            np.transpose(curves[end]), ranges[f"force_{end}"], rtol=1e-4, atol=1e-8
        )
    (number,) = curves["measured"]
    assert result.muscle_names[int(number)] == "vasti"
    np.testing.assert_allclose(
        curves["measured"][number], np.cos(result.window_time[1:]), rtol=1e-3
    )


def test_without_them_it_is_as_before(case, tmp_path):
    model, result = case
    em.report(result, tmp_path / "page.html", model=model)
    data = data_of(tmp_path / "page.html")
    (curves,) = data["results"]
    assert not (data["joints"] or curves["loads"] or curves["least"] or curves["measured"])


def test_tables_of_others_are_refused(case, tmp_path):
    model, result = case
    loads = analysis.joint_loads(model, result)
    file = tmp_path / "page.html"
    with pytest.raises(em.ParameterError, match="joint_loads: 2 tables for 1 trajectories"):
        em.report(result, file, model=model, joint_loads=[loads, loads])
    with pytest.raises(em.ParameterError, match="no column or quantity 'force_least'"):
        em.report(result, file, model=model, feasible=loads)
    other = analysis.joint_loads(model, result, ["hip"])
    with pytest.raises(em.ParameterError, match="the tables are of different joints"):
        em.report([result, result], file, model=model, joint_loads=[loads, other])
