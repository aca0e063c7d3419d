"""Sensors of Exudyn that show muscles."""

import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum

from ..runs import TRAPEZOIDAL, csf, plugin_run, settings, start_at
from ..skeleton.system.models import MOTION, Arm

QUANTITIES = ["activations", "tendon_forces", "musculotendon_lengths", "fiber_lengths"]


def run(model, plugin, step=0.01, end=0.1):
    s = settings(step, end)
    s.solution.sensors.writePeriod = step
    return plugin_run(model, plugin, s)


def cmc(model, motion):
    return em.CMCPlugin(model, motion, em.CMCSettings(kp=534.0))


def replayed(model, motion):
    u = em.Excitations(np.linspace(0.0, 0.1, 4), [[0.3, 0.1], [0.1, 0.5], [0.2, 0.2]])
    return em.ForwardPlugin(model, u)


@pytest.mark.parametrize("make", [csf, cmc, replayed])
def test_sensors_store_what_is_in_the_result(make):
    model, motion = pendulum.build(), pendulum.motion()
    start_at(model, motion)
    plugin = make(model, motion)
    sensors = {name: em.muscle_sensor(plugin, name) for name in (*QUANTITIES, "excitations")}
    q, v = model.skeleton.initial_state()
    assert q == motion(0.0)[0] and v == motion(0.0)[1], "the initial state stays"
    result = run(model, plugin, 0.001 if make is not csf else 0.01)
    stored = {name: model.mbs.GetSensorStoredData(sensor) for name, sensor in sensors.items()}
    for name in QUANTITIES:
        np.testing.assert_array_equal(stored[name][:, 0], result.time)
        np.testing.assert_array_equal(stored[name][:, 1:], getattr(result, name))
    window = np.searchsorted(result.window_time, result.time[1:] - 1e-9) - 1
    held = stored["excitations"]
    assert np.isnan(held[0, 1:]).all()
    if make is replayed:
        np.testing.assert_array_equal(held[1:, 1:], result.excitation_values[window])
    else:  # of the last window that was recorded
        assert set(held[1:, 1]) == set(result.excitation_values[:, 0])


def test_one_muscle_is_plotted_with_exudyns_own_means():
    model, motion = pendulum.build(), pendulum.motion()
    start_at(model, motion)
    plugin = csf(model, motion)
    force = em.muscle_sensor(plugin, "tendon_forces", "right")
    speed = em.muscle_sensor(plugin, "lengthening_speeds")
    assert model.mbs.GetSensor(force)["name"] == "tendon_forces of right"
    result = run(model, plugin)
    stored = model.mbs.GetSensorStoredData(force)
    np.testing.assert_array_equal(stored[:, 1], result.tendon_forces[:, 1])
    speeds = [
        model.geometry(*state).lengthening_speed
        for state in zip(result.coordinates, result.speeds, strict=True)
    ]
    np.testing.assert_allclose(
        model.mbs.GetSensorStoredData(speed)[:, 1:], speeds, rtol=0, atol=1e-12
    )
    _, _, axes, _ = model.mbs.PlotSensor([force, speed], components=[0, 1], closeAll=True)
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), result.tendon_forces[:, 1])
    np.testing.assert_allclose(axes.lines[1].get_ydata(), np.array(speeds)[:, 1], atol=1e-12)


def test_before_a_run_there_is_nothing_to_show():
    model = pendulum.build()
    sensor = em.muscle_sensor(csf(model, pendulum.motion()), "activations")
    assert np.isnan(model.mbs.GetSensorValues(sensor)).all()
    model.mbs.SolveDynamic(settings(end=0.02), solverType=TRAPEZOIDAL)
    assert np.isnan(model.mbs.GetSensorStoredData(sensor)[:, 1:]).all()


def test_of_bodies_and_joints_and_with_the_same_bits():
    plain, watched = Arm().model(), Arm().model()
    plugin = em.CosimulationPlugin(watched, MOTION, em.CosimulationSettings(scheme=em.Scheme.FULL))
    sensor = em.muscle_sensor(plugin, "activations", "flexor")
    first, second = (
        run(
            plain,
            em.CosimulationPlugin(plain, MOTION, em.CosimulationSettings(scheme=em.Scheme.FULL)),
        ),
        run(watched, plugin),
    )
    np.testing.assert_array_equal(first.system_coordinates, second.system_coordinates)
    stored = watched.mbs.GetSensorStoredData(sensor)
    np.testing.assert_array_equal(stored[:, 1], second.activations[:, 0])


def test_what_does_not_exist_is_named():
    model, motion = pendulum.build(), pendulum.motion()
    start_at(model, motion)
    plugin = csf(model, motion)
    with pytest.raises(em.ParameterError, match="'sweat': the quantities are activations, exc"):
        em.muscle_sensor(plugin, "sweat")
    with pytest.raises(em.ParameterError, match="'toe': the muscles are left, right"):
        em.muscle_sensor(plugin, "activations", "toe")
    with plugin.attached(), pytest.raises(em.ModelError, match="another run is attached"):
        em.muscle_sensor(plugin, "activations")
