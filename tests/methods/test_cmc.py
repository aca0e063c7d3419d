"""Computed muscle control on the pendulum and the arm."""

import dataclasses

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
    return em.computed_muscle_control(model, pendulum.motion(), settings=em.CMCSettings(kp=KP))


@pytest.fixture(scope="module")
def csf(model):
    return em.cosimulate(
        model, pendulum.motion(), settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    )


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
    cmc = em.computed_muscle_control(model, planar_arm.motion(), settings=em.CMCSettings(kp=KP))
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
    assert np.abs(static.excitation_values - csf.excitation_values).max() < 0.002
    assert np.abs(cmc.excitation_values - csf.excitation_values).max() < 0.004


def test_finer_steps_within_the_windows_change_little(model, cmc):
    fine = em.computed_muscle_control(
        model, pendulum.motion(), settings=em.CMCSettings(kp=KP, step=0.00025)
    )
    assert rms_deg(fine)[0] == pytest.approx(rms_deg(cmc)[0], rel=0.01)
    assert rms_deg(fine)[0] > 0.0


def test_the_planar_arm():
    cmc = em.computed_muscle_control(
        planar_arm.build(), planar_arm.motion(), settings=em.CMCSettings(kp=KP)
    )
    assert (rms_deg(cmc) < 0.004).all()
    assert cmc.max_unmet_torque == 0.0


def test_the_motion_ends_with_its_last_whole_window(model):
    result = em.computed_muscle_control(
        model,
        em.Motion.from_waypoints([0.0, 0.037], [np.pi, np.pi]),
        settings=em.CMCSettings(kp=KP),
    )
    assert result.time[-1] == pytest.approx(0.03)
    assert result.status is em.Status.COMPLETE


@pytest.mark.parametrize("step", [0.003, 0.004, 0.02])
def test_steps_that_do_not_divide_the_window_are_refused(step):
    with pytest.raises(em.ParameterError, match="must be a whole number of steps"):
        em.CMCSettings(step=step)


def test_in_a_users_run_windows_follow_the_steps_and_can_be_replayed(model):
    motion = pendulum.motion()
    start_at(model, motion)
    plugin = em.CMCPlugin(model, motion, em.CMCSettings(kp=KP))
    result = plugin_run(model, plugin, settings(0.003, 0.3))
    assert np.allclose(np.diff(result.window_time)[:-1], 0.012)
    assert result.window_time[-1] == result.time[-1]
    replay = em.forward_dynamics(model, result.excitations, settings=em.ForwardSettings(step=0.003))
    assert np.abs(replay.coordinates - result.coordinates).max() < 1e-8


def test_controls_of_ones_own_are_recorded_as_they_were_used(model):
    """In windows of their own where they change within one, so that they can be replayed."""

    class Eager(em.CMCPlugin):
        def controls(self, t_0, t_1):
            return super().controls(t_0, t_1) * (1.0 if round(1000 * t_0) % 10 < 5 else 1.1)

    motion = pendulum.motion()
    start_at(model, motion)
    result = plugin_run(model, Eager(model, motion, em.CMCSettings(kp=KP)), settings(0.001, 0.2))
    np.testing.assert_allclose(np.diff(result.window_time), 0.005, atol=1e-12)
    u = result.excitation_values
    np.testing.assert_array_equal(u[1::2], 1.1 * u[::2])
    replay = em.forward_dynamics(model, result.excitations)
    np.testing.assert_array_equal(replay.coordinates, result.coordinates)


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
    cmc = plugin_run(model, em.CMCPlugin(model, motion, em.CMCSettings(kp=KP)), s)
    assert np.abs(cmc.reserves).max() > 0.5
    for _ in range(2):  # a replay can be replayed
        again = plugin_run(model, em.ForwardPlugin(model, cmc.excitations), s)
        assert np.abs(again.coordinates - cmc.coordinates).max() < 1e-10
        np.testing.assert_allclose(again.reserves[-1], cmc.reserves[-1], rtol=0, atol=1e-9)
        cmc = again


def test_a_new_matrix_in_every_step_where_it_saves_iterations():
    counts = em.computed_muscle_control(planar_arm.build(), planar_arm.motion()).counts
    assert counts.newton_iterations < 3.0 * counts.steps


@pytest.mark.parametrize("name", ["window", "step"])
def test_bad_settings_are_named(name):
    with pytest.raises(em.ParameterError, match=f"{name} = -1"):
        em.CMCSettings(**{name: -1})


def test_a_start_in_the_middle_of_a_motion_is_no_worse_than_going_on():
    """The muscles start in motion, so that the first windows are like any other."""
    model, motion = planar_arm.build(), planar_arm.motion()
    whole = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP))
    part = em.computed_muscle_control(
        model, motion.between(0.4, 1.0), settings=em.CMCSettings(kp=KP)
    )
    again = em.forward_dynamics(model, part.excitations)
    np.testing.assert_allclose(again.coordinates, part.coordinates, rtol=0, atol=1e-10)
    errors = np.abs(part.tracking_errors()).max(axis=0)
    assert (errors < 1.2 * np.abs(whole.tracking_errors()).max(axis=0)).all()


def test_desired_prediction_tracks_better_than_the_shifted_one():
    model, motion = planar_arm.build(), planar_arm.motion()
    rms = {
        prediction: em.computed_muscle_control(
            model, motion, settings=em.CMCSettings(kp=100.0, prediction=prediction)
        ).tracking_error_rms()
        for prediction in em.Prediction
    }
    assert (rms[em.Prediction.DESIRED] < 0.8 * rms[em.Prediction.SHIFTED]).all()
    assert (rms[em.Prediction.SHIFTED] < 3e-4).all()


def test_gains_of_every_coordinate():
    """One number for all is the same to the bit; a softer elbow errs more, the shoulder alike."""
    model, motion = planar_arm.build(), planar_arm.motion()
    one = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP))
    same = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=[KP, KP]))
    np.testing.assert_array_equal(one.coordinates, same.coordinates)
    soft = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=[KP, 20.0]))
    ratio = soft.tracking_error_rms() / one.tracking_error_rms()
    assert ratio[1] > 2.0 > 1.3 > ratio[0]
    assert soft.settings["kp"] == [KP, 20.0]
    with pytest.raises(em.ParameterError, match="kp has 3 values for the 2 coordinates shoulder"):
        em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=[1.0, 2.0, 3.0]))
    with pytest.raises(em.ParameterError, match=r"kv\[1\] = -1"):
        em.CMCSettings(kv=[1.0, -1.0])
    assert em.CMCSettings(kp=np.array([1.0, 2.0])) == em.CMCSettings(kp=[1, 2])
    assert em.CMCSettings(kp=np.array(3.0)).kp == 3.0
    for name in ("weights", "control_limits"):
        for given in ([1, 2], None):
            with pytest.raises(em.ParameterError, match=f"{name} = .* is no mapping of names"):
                em.CMCSettings(**{name: given})


def test_control_limits_hold_over_time():
    model, motion = planar_arm.build(), planar_arm.motion()
    usual = em.CMCSettings(kp=KP, normalizer=em.MaximumIsometricForce())
    free = em.computed_muscle_control(model, motion, settings=usual).excitation_values
    order = free.max(axis=0).argsort()
    rested, strongest = order[0], order[-1]
    names, end = model.muscles.names, 0.5 * free[:, strongest].max()
    limits = {
        names[rested]: em.ControlLimits(([0.0, 1.0], [0.05, 0.1]), 1.0),
        names[strongest]: em.ControlLimits(0.0, ([0.0, 1.0], [end, 0.8 * end])),
    }
    limited = dataclasses.replace(usual, control_limits=limits)
    held = em.computed_muscle_control(model, motion, settings=limited)
    times, u = held.window_time[1:], held.excitation_values
    low = np.array([limits[names[rested]].at(t)[0] for t in times])
    high = np.array([limits[names[strongest]].at(t)[1] for t in times])
    assert (u[:, rested] > low - 1e-12).all() and (u[:, rested] < low + 1e-12).any()
    assert (u[:, strongest] < high + 1e-12).all() and (u[:, strongest] > high - 1e-12).any()
    assert (free[:, rested] < low).any() and (free[:, strongest] > high).any()


def test_limits_are_stored_with_the_result():
    model, motion = planar_arm.build(), planar_arm.motion()
    limits = {"elbow_flexor": em.ControlLimits(([0.0, 1.0], [0.05, 0.1]), 1.0)}
    result = em.static_optimization(
        model, motion, settings=em.StaticSettings(control_limits=limits)
    )
    assert result.settings["control_limits"]["elbow_flexor"] == {
        "minimum": [[0.0, 1.0], [0.05, 0.1]], "maximum": 1.0, "steps": False,
    }  # fmt: skip


@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
@pytest.mark.parametrize("step", [0.004, 0.007, 0.008])
def test_reserves_keep_their_limits_where_steps_do_not_divide_the_window(step):
    arm, motion = planar_arm.build(), planar_arm.motion()
    weak = [
        dataclasses.replace(muscle, max_isometric_force=0.1 * muscle.max_isometric_force)
        for muscle in arm.muscles
    ]
    reserves = [em.Reserve(name, 10.0, -0.3, 0.3) for name in ("shoulder", "elbow")]
    model = em.MusculoskeletalModel(
        arm.mbs, 0, weak, coordinates=["shoulder", "elbow"], reserves=reserves
    )
    start_at(model, motion)
    with pytest.warns(em.UnmetTorqueWarning):
        cmc = plugin_run(
            model, em.CMCPlugin(model, motion, em.CMCSettings(kp=KP)), settings(step, 100 * step)
        )
    assert np.abs(cmc.reserves).max() == pytest.approx(3.0)


@pytest.mark.parametrize(("motion_end", "aim"), [(0.096, 0.096), (1.0, 0.1)])
def test_a_window_is_aimed_at_its_own_end(motion_end, aim):
    """Also where a run ends before, because another one may go on; beyond the motion there is
    nothing, and the last window is as long as what is left."""
    model, motion = planar_arm.build(), planar_arm.motion().between(0.0, motion_end)
    start_at(model, motion)
    cmc = plugin_run(
        model, em.CMCPlugin(model, motion, em.CMCSettings(kp=KP)), settings(0.001, 0.096)
    )
    assert cmc.window_time[-2:] == pytest.approx([0.09, 0.096])
    q, v, a = motion(aim)
    M, bias = inverse_dynamics(model, q, v)
    start = cmc.time.searchsorted(0.09 - 1e-9)
    q_d, v_d, _ = motion(0.09)
    a = a + KP * (q_d - cmc.coordinates[start]) + 2 * KP**0.5 * (v_d - cmc.speeds[start])
    np.testing.assert_allclose(cmc.torques_demanded[-1], M @ a + bias, rtol=1e-9)


def test_a_window_is_aimed_at_nothing_unknown():
    """Where the record of an external force ends with the run, and would be zero beyond."""
    model, motion = planar_arm.build(), planar_arm.motion()
    record = em.ExternalForce("held", 1, [0.0, 0.096], torque=np.tile([0.0, 0.0, 5.0], (2, 1)))
    em.add_external_force(model.mbs, model.skeleton.object, record)
    model.mbs.Assemble()
    start_at(model, motion)
    cmc = plugin_run(model, em.CMCPlugin(model, motion), settings(0.001, 0.096))
    assert cmc.torques_demanded[:, 1].max() < 0.0
    assert np.abs(np.diff(cmc.torques_demanded[-3:, 1])).max() < 0.3


def inverse_dynamics(model, q, v):
    with model.skeleton.opened():
        return model.skeleton.dynamics_at(q, v, 0.0)[:2]


def test_weights_spare_a_muscle():
    model, motion = planar_arm.build(), planar_arm.motion()
    plain = em.static_optimization(model, motion)
    spared = em.static_optimization(
        model, motion, settings=em.StaticSettings(weights={"shoulder_flexor": 25.0})
    )
    i = model.muscles.names.index("shoulder_flexor")
    active = plain.force_optimal[:, i] > plain.force_min[:, i] + 5.0
    assert active.any()
    assert (spared.force_optimal[active, i] < 0.6 * plain.force_optimal[active, i]).all()
    np.testing.assert_allclose(spared.torques_delivered, plain.torques_delivered, rtol=0, atol=1e-6)
    with pytest.raises(
        em.ParameterError, match="weights of 'toe': the muscles are shoulder_flexor"
    ):
        em.static_optimization(model, motion, settings=em.StaticSettings(weights={"toe": 1.0}))


def test_forces_on_links_act_in_the_run_as_in_the_recruitment():
    """An arm whose muscles get help from a force at the hand: it tracks, and the replay agrees."""
    arm, motion = planar_arm.build(), planar_arm.motion()
    residual = em.PointActuator(
        "hand", link=1, point=[0.0, -planar_arm.FOREARM_LENGTH, 0.0], direction=[1.0, 0.0, 0.0],
        force_is_global=True, optimal_force=50.0,
    )  # fmt: skip
    model = em.MusculoskeletalModel(
        arm.mbs, 0, list(arm.muscles), coordinates=["shoulder", "elbow"], reserves=[residual]
    )
    cmc = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP))
    assert np.abs(cmc.reserves).max() > 5.0
    assert cmc.reserve_names == ("hand",)
    assert (rms_deg(cmc) < 0.006).all()
    replay = em.forward_dynamics(model, cmc.excitations)
    np.testing.assert_allclose(replay.coordinates, cmc.coordinates, rtol=0, atol=1e-10)
    csf = em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    )
    assert (rms_deg(csf) < 0.007).all()
    np.testing.assert_allclose(csf.reserves[::20], cmc.reserves[::20], rtol=0, atol=0.06)
    # J_m F and S f are what the skeleton got.
    k = 50
    geometry = model.geometry(csf.coordinates[k], csf.speeds[k])
    torque = geometry.moment_arms.T @ csf.tendon_forces[k] + geometry.columns @ csf.reserves[k]
    np.testing.assert_allclose(torque, csf.torques_delivered[k], rtol=0, atol=1e-5)
