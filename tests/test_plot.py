import dataclasses

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.errors import ParameterError
from exudyn_muscles.plot import figures as plot
from models import pendulum


@pytest.fixture(scope="module")
def results():
    """Short runs of the methods on the pendulum, and a replay."""
    model, motion = pendulum.build(), pendulum.motion()
    gain = {"kp": 534.0}
    cmc = em.computed_muscle_control(model, motion, settings=em.CMCSettings(**gain))
    return {
        "static": em.static_optimization(model, motion),
        "cmc": cmc,
        "csf": em.cosimulate(model, motion, settings=em.CosimulationSettings(**gain)),
        "css": em.cosimulate(
            model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.SIMPLIFIED, **gain)
        ),
        "forward": em.forward_dynamics(model, cmc.excitations),
    }


@pytest.fixture(autouse=True)
def closed_figures():
    yield
    plt.close("all")


def six_muscles(trajectory):
    """The same trajectory with each muscle three times and its coordinate twice."""
    of_muscles = (
        "activations", "tendon_forces", "musculotendon_lengths", "fiber_lengths",
        "excitation_values", "force_min", "force_max", "force_optimal",
    )  # fmt: skip
    changed = {name: np.tile(getattr(trajectory, name), 3) for name in of_muscles}
    for name in ("coordinates", "desired_coordinates"):
        changed[name] = np.tile(getattr(trajectory, name), 2)
    return dataclasses.replace(
        trajectory,
        muscle_names=tuple("abcdef"),
        coordinate_names=("shoulder", "elbow"),
        **changed,
    )


def legend(axes):
    """Texts of the one legend of the figure of these axes."""
    figure = axes[0].figure
    found = [*figure.legends, *(a.get_legend() for a in figure.axes if a.get_legend())]
    assert len(found) == 1
    return [text.get_text() for text in found[0].get_texts()]


def test_tracking_errors_are_drawn_in_degrees(results):
    axes = plot.tracking_errors(results["cmc"], results["css"])
    assert axes.shape == (1,)
    assert axes[0].get_ylabel() == "tracking error [deg]"
    assert axes[0].get_xlabel() == "time [s]"
    for line, name in zip(axes[0].lines, ("cmc", "css"), strict=True):
        one = results[name]
        np.testing.assert_array_equal(line.get_xdata(), one.time)
        error = 180.0 / np.pi * (one.desired_coordinates - one.coordinates)[:, 0]
        np.testing.assert_allclose(line.get_ydata(), error, rtol=1e-13, atol=1e-15)
    assert legend(axes) == ["CMC", "CSS"]


def test_static_has_no_tracking_error(results):
    axes = plot.tracking_errors(results["static"], results["csf"])
    assert [line.get_label() for line in axes[0].lines] == ["CSF"]
    with pytest.raises(ParameterError, match="need a trajectory of CMC, CSF or CSS"):
        plot.tracking_errors(results["static"])


def test_no_tracking_error_without_a_desired_motion(results):
    with pytest.raises(ParameterError, match="'forward' has no desired coordinates"):
        plot.tracking_errors(results["cmc"], results["forward"])


def test_excitations_hold_over_their_windows(results):
    one = results["csf"]
    axes = plot.excitations(one)
    for i, panel in enumerate(axes):
        (line,) = panel.lines
        assert line.get_drawstyle() == "steps-post"
        np.testing.assert_array_equal(line.get_xdata(), one.window_time)
        np.testing.assert_array_equal(line.get_ydata()[:-1], one.excitation_values[:, i])
        assert line.get_ydata()[-1] == one.excitation_values[-1, i]
        assert panel.get_title() == one.muscle_names[i]
    assert axes[0].get_ylabel() == "excitation [-]"


def test_methods_look_different_and_the_same_in_every_figure(results):
    def look(line):
        return line.get_color(), line.get_linestyle(), line.get_linewidth()

    together = plot.excitations(*(results[name] for name in ("static", "cmc", "csf", "css")))
    looks = [look(line) for line in together[0].lines]
    assert len(set(looks)) == 4
    two = plot.activations(results["csf"], results["cmc"])
    assert [look(line) for line in two[0].lines] == [looks[2], looks[1]]


def test_two_of_one_method_are_told_apart(results):
    axes = plot.activations(results["csf"], results["csf"])
    assert legend(axes) == ["CSF (1)", "CSF (2)"]
    assert len({line.get_color() for line in axes[0].lines}) == 2


def test_activations_are_those_of_the_trajectory(results):
    one = results["forward"]
    axes = plot.activations(one)
    assert axes[0].get_ylabel() == "activation [-]"
    for i, panel in enumerate(axes):
        np.testing.assert_array_equal(panel.lines[0].get_xdata(), one.time)
        np.testing.assert_array_equal(panel.lines[0].get_ydata(), one.activations[:, i])


def test_one_given_axes_takes_all_muscles(results):
    _, given = plt.subplots()
    axes = plot.excitations(results["cmc"], results["csf"], axes=given)
    assert list(axes) == [given, given]
    assert len(given.lines) == 4
    assert legend(axes) == ["left", "right", "CMC", "CSF"]
    colors = [line.get_color() for line in given.lines]
    assert colors[0] == colors[2] != colors[1] == colors[3]


def test_given_axes_must_fit(results):
    _, given = plt.subplots(3)
    with pytest.raises(ParameterError, match="one for each of left, right; got 3"):
        plot.activations(results["cmc"], axes=given)


def test_forces_lie_in_their_band(results):
    one = results["csf"]
    axes = plot.forces(one)
    assert axes[0].get_ylabel() == "tendon force [N]"
    for i, panel in enumerate(axes):
        (line,), (band,) = panel.lines, panel.collections
        np.testing.assert_array_equal(line.get_xdata(), one.window_time[1:])
        np.testing.assert_array_equal(line.get_ydata(), one.force_optimal[:, i])
        edge = band.get_paths()[0].vertices
        assert edge[:, 1].max() == one.force_max[:, i].max()
        assert edge[:, 1].min() == one.force_min[:, i].min()


def test_no_forces_without_recruitment(results):
    with pytest.raises(ParameterError, match="'forward' has no recruited forces"):
        plot.forces(results["forward"])


def test_comparison_is_figure_6(results):
    figure = plot.comparison(*(results[name] for name in ("static", "cmc", "csf", "css")))
    errors, *muscles = figure.axes
    assert [line.get_label() for line in errors.lines] == ["CMC", "CSF", "CSS"]
    assert [panel.get_title() for panel in muscles] == ["left", "right"]
    for panel in muscles:
        assert [line.get_label() for line in panel.lines] == ["CMC", "CSF"]
    figure.canvas.draw()


def test_comparison_of_six_muscles_and_two_coordinates(results):
    figure = plot.comparison(*(six_muscles(results[name]) for name in ("cmc", "csf")))
    titles = [panel.get_title() for panel in figure.axes]
    assert titles == ["shoulder", "elbow", *"abcdef"]
    with_time = [panel.get_title() for panel in figure.axes if panel.get_xlabel() == "time [s]"]
    assert with_time == ["elbow", *"def"]
    figure.canvas.draw()
    boxes = [panel.get_tightbbox() for panel in figure.axes]
    for k, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:k])


def test_comparison_leaves_no_figure_behind_on_errors(results):
    with pytest.raises(ParameterError):
        plot.comparison(results["forward"])
    assert not plt.get_fignums()


def test_trajectories_must_have_the_same_names(results):
    with pytest.raises(ParameterError, match="differ in their muscle_names"):
        plot.excitations(results["cmc"], six_muscles(results["csf"]))
    with pytest.raises(ParameterError, match="no trajectory"):
        plot.activations()


def test_empty_trajectory(results):
    one = results["csf"]
    nothing = dataclasses.replace(
        one, window_time=one.window_time[:1], excitation_values=one.excitation_values[:0]
    )
    with pytest.raises(ParameterError, match="'csf' has no windows"):
        plot.excitations(nothing)


def test_translations_are_not_drawn_in_degrees(results):
    slider = dataclasses.replace(results["csf"], coordinate_units=("m",))
    (panel,) = plot.tracking_errors(slider)
    (line,) = panel.get_lines()
    np.testing.assert_array_equal(line.get_ydata(), slider.tracking_errors()[:, 0])
    text = panel.get_ylabel() + panel.get_title()
    assert "[m]" in text and "[deg]" not in text


# Laws and muscles.

LAWS = {
    "DeGrooteFregly2016": em.DeGrooteFregly2016(),
    "Thelen2003, af = 0.3": em.Thelen2003(af=0.3),
    "Millard2012, fiber_damping = 0.0": em.Millard2012(fiber_damping=0.0),
    "mine": em.CustomLaw(
        "mine",
        active_force_length=lambda x: np.exp(-4 * (x - 1) ** 2),
        force_velocity=lambda v: 1 + v,
        passive_force_length=lambda x: 0.0,
    ),
}


def test_curves_of_a_law_and_their_derivatives():
    law = em.Thelen2003()
    axes = plot.curves(law)
    figure = axes[0].figure
    found = law.curves()
    curves = [found.active_force_length, found.force_velocity, found.passive_force_length]
    for panel, right, curve in zip(axes, figure.axes[4:], curves, strict=False):
        (value,), (slope,) = panel.lines, right.lines
        np.testing.assert_array_equal(value.get_ydata(), curve(value.get_xdata()))
        np.testing.assert_array_equal(slope.get_ydata(), curve.derivative(slope.get_xdata()))
        # Both have their zero at the same height.
        low, high = panel.get_ylim()
        assert right.get_ylim()[0] / low == pytest.approx(right.get_ylim()[1] / high)
    (tendon,), (slope,) = axes[3].lines, figure.axes[7].lines
    length = tendon.get_xdata()
    np.testing.assert_allclose(np.interp(1.04, length, tendon.get_ydata()), 1.0, rtol=0, atol=1e-4)
    np.testing.assert_allclose(
        np.interp(1.03, length, slope.get_ydata()), 0.67 / (0.04 - 0.02434462), rtol=1e-6
    )
    assert [panel.get_xlabel() for panel in axes] == [
        "fiber length / optimal length",
        "fiber velocity / maximum velocity",
        "fiber length / optimal length",
        "tendon length / slack length",
    ]
    assert legend(axes) == ["Thelen2003", "derivative, scale on the right"]


@pytest.mark.parametrize("elastic", [True, False])
@pytest.mark.parametrize("name", LAWS)
def test_every_law_can_be_drawn(name, elastic):
    axes = plot.curves(LAWS[name], elastic=elastic)
    assert axes.shape == (4 if elastic and name != "mine" else 3,)
    assert legend(axes)[0] == name + ("" if elastic else ", rigid tendon")
    figure = axes[0].figure
    figure.canvas.draw()
    boxes = [panel.get_tightbbox() for panel in axes]
    for k, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:k])


def test_several_laws_in_one_figure():
    axes = plot.curves(*LAWS.values())
    assert [len(panel.lines) for panel in axes] == [4, 4, 4, 3]
    assert legend(axes) == [*LAWS, "derivative, scale on the right"]
    assert len({line.get_color() for line in axes[0].lines}) == 4


def test_curves_in_given_axes():
    _, given = plt.subplots(2, 2)
    axes = plot.curves(em.Millard2012(), axes=given)
    assert list(axes) == list(given.ravel())
    with pytest.raises(ParameterError, match=r"one for each of active_.*; got 4"):
        plot.curves(em.Millard2012(), elastic=False, axes=given)


@pytest.mark.parametrize(
    ("laws", "message"),
    [
        ((), "there is no muscle law to draw"),
        ((em.Millard2012,), "a muscle law is drawn, got <class"),
        ((em.Thelen2003(), "Millard2012"), "a muscle law is drawn, got 'Millard2012'"),
    ],
)
def test_only_laws_have_curves(laws, message):
    with pytest.raises(ParameterError, match=message):
        plot.curves(*laws)


@pytest.mark.parametrize("law", [em.Thelen2003(), em.Millard2012(), em.DeGrooteFregly2016()])
def test_the_force_that_is_drawn_is_the_fibers(law):
    unit = em.Muscle("unit", max_isometric_force=200, optimal_fiber_length=0.1,
                     tendon_slack_length=0.2, law=law, ignore_tendon_compliance=True)  # fmt: skip
    muscles = em.MuscleSet([unit])
    x, v = np.array([0.6, 1.0, 1.3]), np.array([-0.7, 0.0, 0.2])
    found = plot._fiber_force(unit, 0.4, x, v)
    for j in range(3):
        for k in range(3):
            now = em.muscle_dynamics(muscles, [0.4], [0.2], [0.2 + 0.1 * x[k]], [v[j]])
            force = (now.active_fiber_force + now.passive_fiber_force) / 200.0
            assert found[j, k] == pytest.approx(force[0], rel=1e-12)


def test_muscle_with_the_path_of_a_motion(results):
    unit = next(iter(pendulum.build().muscles))
    one = results["csf"]
    axes = plot.muscle(unit, one)
    path, start = axes.lines
    length = one.fiber_lengths[:, 0] / unit.optimal_fiber_length
    np.testing.assert_array_equal(path.get_xdata(), length)
    speed = path.get_ydata() * unit.max_contraction_velocity
    np.testing.assert_allclose(speed[1:-1], (length[2:] - length[:-2]) / 0.02, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(start.get_xydata(), path.get_xydata()[:1])
    assert axes.get_title() == "left, activation 1"
    assert axes.get_xlabel() == "fiber length / optimal length [-]"
    axes.figure.canvas.draw()


def test_muscle_alone_in_given_axes(results):
    _, given = plt.subplots()
    unit = next(iter(pendulum.build().muscles))
    axes = plot.muscle(unit, activation=0.3, axes=given)
    assert axes is given
    assert not axes.lines
    assert axes.get_xlim() == (0.4, 1.6) and axes.get_ylim() == (-1.0, 1.0)


def test_muscle_shows_the_whole_path(results):
    one = results["csf"]
    far = dataclasses.replace(
        one, fiber_lengths=one.fiber_lengths * np.linspace(1.0, 2.5, 101)[:, None]
    )
    axes = plot.muscle(next(iter(pendulum.build().muscles)), far)
    x, y = axes.lines[0].get_data()
    assert axes.get_xlim()[1] == x.max() > 1.6
    assert axes.get_ylim()[0] <= y.min() and axes.get_ylim()[1] >= y.max()


def test_muscle_needs_what_it_draws(results):
    one = results["csf"]
    unit = next(iter(pendulum.build().muscles))
    stranger = dataclasses.replace(unit, name="soleus")
    with pytest.raises(ParameterError, match=r"'soleus' is not in .* are left, right"):
        plot.muscle(stranger, one)
    with pytest.raises(ParameterError, match="'csf' has 1 time points: a path needs two"):
        plot.muscle(unit, dataclasses.replace(one, time=one.time[:1]))
    with pytest.raises(ParameterError, match=r"activation = 1.5 is outside \[0, 1\]"):
        plot.muscle(unit, activation=1.5)
    with pytest.raises(ParameterError, match="a Muscle is drawn, got 'left'"):
        plot.muscle("left")
    assert not plt.get_fignums()
