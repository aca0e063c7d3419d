"""Computed muscle control on the pendulum and the arm."""

import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum, planar_arm

from ..runs import KP, plugin_run, rms_deg, settings, start_at


@pytest.fixture(scope="module")
def model():
    return pendulum.build()


@pytest.fixture(scope="module")
def cmc(model):
    return em.computed_muscle_control(model, pendulum.motion(), settings=em.CMC(kp=KP))


@pytest.fixture(scope="module")
def csf(model):
    return em.cosimulate(model, pendulum.motion(), settings=em.Cosimulation(kp=KP))


def test_cmc_tracks_better_than_csf(cmc, csf):
    assert rms_deg(cmc)[0] < rms_deg(csf)[0]
    assert cmc.max_unmet_torque == 0.0
    assert len(cmc.time) == 1001 and len(cmc.excitation_values) == 100
    assert cmc.counts.recruitments == 101


def test_replayed_excitations_give_the_same_motion(model, cmc):
    replay = em.forward_dynamics(model, cmc.excitations)
    assert np.abs(replay.coordinates - cmc.coordinates).max() < 1e-10
    assert np.abs(replay.tendon_forces - cmc.tendon_forces).max() < 1e-6


def test_replay_without_reserves_differs_and_with_them_agrees():
    arm = planar_arm.build()
    model = em.MusculoskeletalModel(
        arm.mbs,
        0,
        list(arm.muscles),
        coordinates=["shoulder", "elbow"],
        reserves=[em.Reserve("elbow", optimal_force=20.0)],
    )
    cmc = em.computed_muscle_control(model, planar_arm.motion(), settings=em.CMC(kp=KP))
    assert np.abs(cmc.reserves).max() > 0.5
    replay = em.forward_dynamics(model, cmc.excitations)
    assert np.abs(replay.coordinates - cmc.coordinates).max() < 1e-10
    without = em.Excitations(
        cmc.window_time, cmc.excitation_values, 0.0 * cmc.reserves, cmc.excitations.initial
    )
    lost = em.forward_dynamics(model, without)
    assert np.abs(lost.coordinates - cmc.coordinates).max() > 0.01


def test_excitations_of_the_methods_are_very_close(model, cmc, csf):
    """The paper's figure 6: very close at coinciding times."""
    static = em.static_optimization(model, pendulum.motion())
    assert np.abs(static.excitation_values - csf.excitation_values).max() < 0.005
    assert np.abs(cmc.excitation_values - csf.excitation_values).max() < 0.005


def test_finer_steps_within_the_windows_change_little(model, cmc):
    fine = em.computed_muscle_control(
        model, pendulum.motion(), settings=em.CMC(kp=KP, step=0.00025)
    )
    assert rms_deg(fine)[0] == pytest.approx(rms_deg(cmc)[0], rel=0.2)
    assert rms_deg(fine)[0] > 0.0


def test_the_planar_arm():
    cmc = em.computed_muscle_control(
        planar_arm.build(), planar_arm.motion(), settings=em.CMC(kp=KP)
    )
    assert (rms_deg(cmc) < 0.05).all()
    assert cmc.max_unmet_torque == 0.0


def test_the_motion_ends_with_its_last_whole_window(model):
    result = em.computed_muscle_control(
        model, em.Motion.from_waypoints([0.0, 0.037], [np.pi, np.pi]), settings=em.CMC(kp=KP)
    )
    assert result.time[-1] == pytest.approx(0.03)
    assert result.status is em.Status.COMPLETE


@pytest.mark.parametrize("step", [0.003, 0.004, 0.02])
def test_steps_that_do_not_divide_the_window_are_refused(step):
    with pytest.raises(em.ParameterError, match="must be a whole number of steps"):
        em.CMC(step=step)


def test_in_a_users_run_windows_follow_the_steps_and_can_be_replayed(model):
    motion = pendulum.motion()
    start_at(model, motion)
    plugin = em.CMCPlugin(model, motion, em.CMC(kp=KP))
    result = plugin_run(model, plugin, settings(0.003, 0.3))
    assert np.allclose(np.diff(result.window_time)[:-1], 0.012)
    assert result.window_time[-1] == result.time[-1]
    replay = em.forward_dynamics(model, result.excitations, settings=em.Forward(step=0.003))
    assert np.abs(replay.coordinates - result.coordinates).max() < 1e-8


@pytest.mark.parametrize("step", [0.001, 0.003, 0.004])
def test_reserves_replay_with_steps_that_straddle_the_windows(step):
    arm, motion = planar_arm.build(), planar_arm.motion()
    model = em.MusculoskeletalModel(
        arm.mbs,
        0,
        list(arm.muscles),
        coordinates=["shoulder", "elbow"],
        reserves=[em.Reserve("elbow", optimal_force=20.0)],
    )
    start_at(model, motion)
    s = settings(step, 60 * 0.012)
    s.timeIntegration.newton.relativeTolerance = 1e-10
    cmc = plugin_run(model, em.CMCPlugin(model, motion, em.CMC(kp=KP)), s)
    assert np.abs(cmc.reserves).max() > 0.5
    for _ in range(2):  # a replay can be replayed
        again = em.forward_dynamics(model, cmc.excitations, settings=em.Forward(step=step))
        assert np.abs(again.coordinates - cmc.coordinates).max() < 1e-8
        np.testing.assert_allclose(again.reserves[-1], cmc.reserves[-1], atol=1e-9)
        cmc = again


@pytest.mark.parametrize("name", ["window", "step"])
def test_bad_settings_are_named(name):
    with pytest.raises(em.ParameterError, match=f"{name} = -1"):
        em.CMC(**{name: -1})
