import dataclasses

import matplotlib.pyplot as plt
import numpy as np
import pytest

from exudyn_muscles import plot
from exudyn_muscles.errors import ParameterError

from .legends import legend


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


def many(trajectory, muscles=92, coordinates=29):
    """The same trajectory with so many muscles and coordinates, each of its own size."""
    strong = 1.0 / (1.0 + (7 * np.arange(muscles)) % muscles)
    of_muscles = (
        "activations", "tendon_forces", "musculotendon_lengths", "fiber_lengths",
        "excitation_values", "force_min", "force_max", "force_optimal",
    )  # fmt: skip
    changed = {name: getattr(trajectory, name)[:, :1] * strong for name in of_muscles}
    off = trajectory.tracking_errors() * np.linspace(1.0, 2.0, coordinates)
    changed["desired_coordinates"] = np.repeat(trajectory.desired_coordinates, coordinates, axis=1)
    changed["coordinates"] = changed["desired_coordinates"] - off
    return dataclasses.replace(
        trajectory,
        muscle_names=tuple(f"muscle_{k}" for k in range(muscles)),
        coordinate_names=tuple(f"q_{k}" for k in range(coordinates)),
        coordinate_units=("rad", "m") * (coordinates // 2) + ("rad",),
        **changed,
    )


@pytest.mark.parametrize("draw", [plot.excitations, plot.activations, plot.forces])
def test_of_many_muscles_those_with_the_most_have_panels(results, draw):
    one = many(results["csf"])
    axes = draw(one)
    strongest = sorted(range(92), key=lambda k: (7 * k) % 92)[:15]
    shown = [panel.get_title() for panel in axes]
    assert shown == [f"muscle_{k}" for k in sorted(strongest)]
    figure = axes[0].get_figure(root=True)
    width, height = figure.get_size_inches()
    assert width <= 7.0 and height <= 11.0  # A4 has 11.7
    table = [text.get_text() for text in figure.subfigs[1].texts]
    assert set(table[1::2]) == {f"muscle_{k}" for k in range(92)} - set(shown)
    values = [float(text) for text in table[2::2]]
    assert values == sorted(values, reverse=True)
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.subfigs[1].texts]
    for k, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:k])
    assert min(box.y0 for box in boxes) >= 0.0


def test_of_many_coordinates_those_with_the_largest_errors_have_panels(results):
    """Radians beside metres: a degree is no larger than a centimetre because it says 1."""
    one = many(results["csf"])
    axes = plot.tracking_errors(one)
    assert [panel.get_title().split()[0] for panel in axes] == [f"q_{k}" for k in range(14, 29)]
    table = axes[0].get_figure(root=True).subfigs[1].texts
    told = dict(zip((x.get_text() for x in table[1::2]), table[2::2], strict=True))
    largest = np.abs(one.tracking_errors()[:, [0, 1]]).max(axis=0)
    assert float(told["q_0 [deg]"].get_text()) == pytest.approx(np.degrees(largest[0]), rel=1e-2)
    assert float(told["q_1 [m]"].get_text()) == pytest.approx(largest[1], rel=1e-2)


def test_comparison_of_many_is_one_page(results):
    figure = plot.comparison(*(many(results[name]) for name in ("cmc", "csf")))
    assert len(figure.axes) == 18
    assert figure.get_size_inches()[1] < 10.5


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
