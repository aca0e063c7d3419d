import dataclasses

import matplotlib.pyplot as plt
import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import plot
from exudyn_muscles.errors import ParameterError
from exudyn_muscles.plot.fibers import _fiber_force
from models import pendulum


@pytest.mark.parametrize("law", [em.Thelen2003(), em.Millard2012(), em.DeGrooteFregly2016()])
def test_the_force_that_is_drawn_is_the_fibers(law):
    unit = em.Muscle("unit", max_isometric_force=200, optimal_fiber_length=0.1,
                     tendon_slack_length=0.2, law=law, ignore_tendon_compliance=True)  # fmt: skip
    muscles = em.MuscleSet([unit])
    x, v = np.array([0.6, 1.0, 1.3]), np.array([-0.7, 0.0, 0.2])
    found = _fiber_force(unit, 0.4, x, v)
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
