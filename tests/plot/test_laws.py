import matplotlib.pyplot as plt
import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import plot
from exudyn_muscles.errors import ParameterError

from .legends import legend

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
