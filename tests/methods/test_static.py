"""Static optimization: torques, physiological bounds, replay in a forward simulation."""

import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum, planar_arm

from ..runs import KP


@pytest.fixture(scope="module", params=[pendulum, planar_arm], ids=["pendulum", "planar_arm"])
def case(request):
    model, motion = request.param.build(), request.param.motion()
    return model, motion, em.static_optimization(model, motion)


def test_the_delivered_torques_are_those_of_inverse_dynamics(case):
    model, motion, static = case
    with model.skeleton.opened():
        for k in range(0, 101, 10):
            q, v, a = motion(static.time[k])
            M, bias = model.skeleton.dynamics_at(q, v, static.time[k])
            np.testing.assert_allclose(static.torques_delivered[k], M @ a + bias, atol=1e-6)
    assert static.max_unmet_torque == 0.0
    assert np.array_equal(static.coordinates, static.desired_coordinates)


def test_forces_stay_between_their_reachable_bounds(case):
    _, _, static = case
    assert (static.force_optimal >= static.force_min - 1e-9).all()
    assert (static.force_optimal <= static.force_max + 1e-9).all()
    assert (static.excitation_values >= 0.01).all() and (static.excitation_values <= 1.0).all()
    np.testing.assert_allclose(static.tendon_forces[1:], static.force_optimal, rtol=0, atol=1e-5)


def test_replayed_in_a_forward_simulation_the_motion_is_followed_for_a_while(case):
    """Open loop nothing holds the motion, but for a tenth of a second it is the desired one."""
    model, _, static = case
    replay = em.forward_dynamics(model, static.excitations)
    first = replay.time <= 0.1
    desired = np.array(
        [np.interp(replay.time[first], static.time, q) for q in static.coordinates.T]
    )
    assert np.abs(replay.coordinates[first] - desired.T).max() < np.radians(0.07)


def test_a_failure_in_the_middle_keeps_what_was_found(case):
    model, motion, static = case

    class Stop(Exception):
        pass

    def progress(t):
        if t > 0.495:
            raise Stop

    with pytest.raises(Stop) as caught:
        em.static_optimization(model, motion, progress=progress)
    partial = caught.value.trajectory
    assert partial.status is em.Status.INCOMPLETE
    assert partial.cpu_time > 0.0
    np.testing.assert_array_equal(partial.tendon_forces, static.tendon_forces[:51])


def test_normalizers_change_the_sharing_not_the_torque():
    model, motion = planar_arm.build(), planar_arm.motion()
    settings = em.Static(normalizer=em.MaximumIsometricForce())
    paper, isometric = (
        em.static_optimization(model, motion),
        em.static_optimization(model, motion, settings=settings),
    )
    np.testing.assert_allclose(
        paper.torques_demanded, isometric.torques_demanded, rtol=0, atol=1e-12
    )
    assert np.abs(paper.force_optimal - isometric.force_optimal).max() > 1.0


def test_osqp_gives_the_same_forces():
    model, motion = planar_arm.build(), planar_arm.motion()
    daqp, osqp = (
        em.static_optimization(model, motion, settings=em.Static(solver=solver))
        for solver in em.Solver
    )
    np.testing.assert_allclose(daqp.force_optimal, osqp.force_optimal, rtol=0, atol=1e-5)


def test_a_tendon_too_long_for_the_motion_is_named():
    built = pendulum.build()
    muscles = [
        em.Muscle(
            "long",
            max_isometric_force=3000.0,
            optimal_fiber_length=0.15,
            tendon_slack_length=0.5,
            path=next(iter(built.muscles)).path,
        )
    ]
    model = em.MusculoskeletalModel(built.mbs, 0, muscles)
    with pytest.raises(
        em.ParameterError, match=r"'long': tendon_slack_length = 0\.5 m is too long"
    ):
        em.static_optimization(model, pendulum.motion())
    with pytest.raises(em.ParameterError, match="'long'"):
        em.cosimulate(model, pendulum.motion(), settings=em.Cosimulation(kp=KP))


@pytest.mark.parametrize("forces", [np.zeros(2), np.ones(3), np.array([1.0, np.nan])])
def test_a_normalizer_that_does_not_fit_is_named(forces):
    settings = em.Static(normalizer=lambda muscles, F_max, geometry: forces)
    with pytest.raises(em.ParameterError, match=r"normalizer: .* must return 2 positive forces"):
        em.static_optimization(pendulum.build(), pendulum.motion(), settings=settings)


@pytest.mark.parametrize(
    "options", [{"window_tolerance": "a"}, {"normalizer": 3}, {"solver": "daqp"}]
)
def test_bad_settings_are_named(options):
    with pytest.raises(em.ParameterError):
        em.Static(**options)
