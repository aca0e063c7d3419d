"""Figures of what analyses found."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import analysis, plot
from models import planar_arm


@pytest.fixture(scope="module")
def case():
    model, motion = planar_arm.build(), planar_arm.motion()
    return model, em.static_optimization(model, motion)


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def legend(axes):
    figure = axes[0].get_figure()
    return [text.get_text() for each in figure.legends for text in each.get_texts()]


def test_loads_of_joints(case):
    loads = analysis.joint_loads(*case)
    axes = plot.joint_loads(loads)
    assert [each.get_title() for each in axes] == ["shoulder", "elbow"]
    assert legend(axes) == ["x", "y", "z", "size"]
    *parts, size = (line.get_ydata() for line in axes[1].lines)
    np.testing.assert_array_equal(np.transpose(parts), loads["force/elbow"])
    np.testing.assert_allclose(size, np.linalg.norm(loads["force/elbow"], axis=1))


def test_loads_of_joints_in_one_panel(case):
    loads = analysis.joint_loads(*case)
    _, panel = plt.subplots()
    axes = plot.joint_loads(loads, panel)
    assert axes[0] is panel and len(panel.lines) == 2
    assert [text.get_text() for text in panel.get_legend().get_texts()] == ["shoulder", "elbow"]
    with pytest.raises(em.ParameterError, match="no column or quantity 'force'"):
        plot.joint_loads(analysis.power(*case))


def test_emg_beside_excitations(case):
    _, result = case
    muscle = result.muscle_names[0]
    emg = analysis.EMG(("surface",), result.time, np.abs(np.sin(9.0 * result.time))[:, None])
    axes = plot.excitations(result, emg=emg, measured={muscle: "surface"})
    assert "EMG" in legend(axes)
    assert [len(each.collections) for each in axes] == [1] + [0] * (len(axes) - 1)
    with pytest.raises(em.ParameterError, match="measured: the result has no muscle 'toe'"):
        plot.excitations(result, emg=emg, measured={"toe": "surface"})


def test_what_would_have_done_beside_forces(case):
    pytest.importorskip("highspy")
    ranges = analysis.feasible_forces(*case)
    axes = plot.forces(case[1], feasible=ranges)
    _, least, largest = axes[0].lines
    muscle = case[1].muscle_names[0]
    np.testing.assert_array_equal(least.get_ydata(), ranges[f"force_least/{muscle}"])
    np.testing.assert_array_equal(largest.get_ydata(), ranges[f"force_largest/{muscle}"])
    assert "would have done" in legend(axes)
