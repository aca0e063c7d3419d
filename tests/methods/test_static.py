"""Static optimization: torques, physiological bounds, replay in a forward simulation."""

import dataclasses

import exudyn as exu
import numpy as np
import pytest
from exudyn.rigidBodyUtilities import HomogeneousTransformation, RotationMatrixX
from exudyn.utilities import InertiaCylinder, RigidBodyInertia, TreeLink

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
            M, bias = model.skeleton.dynamics_at(q, v, static.time[k])[:2]
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
    settings = em.StaticSettings(normalizer=em.MaximumIsometricForce())
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
        em.static_optimization(model, motion, settings=em.StaticSettings(solver=solver))
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
        em.cosimulate(
            model, pendulum.motion(), settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
        )


def test_the_step_is_the_settings_or_the_arguments():
    model, motion = pendulum.build(), pendulum.motion().between(0.0, 0.1)
    settings = em.StaticSettings(step=0.02)
    runs = (
        em.static_optimization(model, motion, settings=settings),
        em.static_optimization(model, motion, settings=settings, step=0.05),
    )
    for result, step in zip(runs, (0.02, 0.05), strict=True):
        np.testing.assert_allclose(np.diff(result.time), step)


@pytest.mark.parametrize("forces", [np.zeros(2), np.ones(3), np.array([1.0, np.nan])])
def test_a_normalizer_that_does_not_fit_is_named(forces):
    settings = em.StaticSettings(normalizer=lambda muscles, F_max, geometry: forces)
    with pytest.raises(em.ParameterError, match=r"normalizer: .* must return 2 positive forces"):
        em.static_optimization(pendulum.build(), pendulum.motion(), settings=settings)


@pytest.mark.parametrize(
    "options", [{"window_tolerance": "a"}, {"normalizer": 3}, {"solver": "daqp"}]
)
def test_bad_settings_are_named(options):
    with pytest.raises(em.ParameterError):
        em.StaticSettings(**options)


@pytest.mark.parametrize("crosses", [False, True], ids=["no arm", "arms of 1e-18 m"])
def test_a_strong_reserve_does_not_hide_a_joint_without_an_actuator(crosses):
    """Shoulder with a reserve of 1e6 N m, elbow with muscles, a hand on a wrist with nothing: the
    muscles end before its axis, or on it."""
    length = 0.26
    arm = InertiaCylinder(density=1100, length=length, outerRadius=0.03, axis=1)
    arm = arm.Translated([0, -0.5 * length, 0])
    hand = RigidBodyInertia(mass=0.4, inertiaTensor=1e-3 * np.eye(3), com=[0, 0, 0])
    hand = hand.Translated([0.03, -0.05, 0.0])
    mbs = exu.SystemContainer().AddSystem()
    places = [
        (RotationMatrixX(0.3), [0.0, 0.0, 0.0], arm),
        (np.eye(3), [0.0, -length, 0.0], arm),
        (np.eye(3), [0.0, -length, 0.0], hand),
    ]
    links = [
        TreeLink(
            jointType=exu.JointType.RevoluteZ, parent=k - 1, linkInertia=inertia,
            jointHT=HomogeneousTransformation(R, p),
        )
        for k, (R, p, inertia) in enumerate(places)
    ]  # fmt: skip
    tree = mbs.CreateKinematicTree(listOfTreeLinks=links, gravity=[0, -9.81, 0])
    mbs.Assemble()
    size = {"max_isometric_force": 2e3, "optimal_fiber_length": 0.16, "tendon_slack_length": 0.15}
    end = em.PathPoint([0, 0, 0.01], link=2) if crosses else em.PathPoint([0, -0.2, 0.01], link=1)
    muscles = [
        em.Muscle(name, **size, path=[em.PathPoint([x, -0.15, 0.01], link=0), end])
        for name, x in (("flexor", 0.05), ("extensor", -0.05))
    ]
    model = em.MusculoskeletalModel(
        mbs, tree, muscles, coordinates=["shoulder", "elbow", "wrist"],
        reserves=[em.Reserve("shoulder", 1e6), em.Reserve("elbow", 1.0)],
    )  # fmt: skip
    q = np.radians([0.0, 30.0, 10.0])
    arms = model.geometry(q, np.zeros(3)).moment_arms[:, 2]
    assert 1e-19 < np.abs(arms).max() < 1e-16 if crosses else not arms.any()
    motion = em.Motion.from_waypoints([0.0, 0.1], [q, q])
    with pytest.raises(em.UnmetTorqueError, match=r"short by \{'wrist': "):
        em.static_optimization(
            model, motion, settings=em.StaticSettings(raise_on_unmet_torque=True)
        )
    with pytest.warns(em.UnmetTorqueWarning, match="wrist: demand out of reach in 10 of 10"):
        result = em.static_optimization(model, motion)
    assert (result.torques_unmet[:, :2] == 0.0).all()
    np.testing.assert_allclose(result.torques_unmet[:, 2], result.torques_demanded[:, 2], rtol=1e-9)
    assert 0.01 < np.abs(result.torques_unmet[:, 2]).min() < 0.3


@pytest.mark.parametrize(("to", "helps"), [(150.0, "left"), (210.0, "right")])
def test_the_report_names_the_muscle_that_would_help(to, helps):
    """Of two weak ones, by the sign of what is missing."""
    built = pendulum.build()
    weak = [dataclasses.replace(muscle, max_isometric_force=30.0) for muscle in built.muscles]
    model = em.MusculoskeletalModel(built.mbs, 0, weak, coordinates=["theta"])
    motion = em.Motion.from_waypoints([0.0, 0.4], np.radians([[180.0], [to]]))
    with pytest.warns(em.UnmetTorqueWarning, match=f"{helps} pulled at most"):
        result = em.static_optimization(model, motion)
    short = result.torques_unmet[np.abs(result.torques_unmet[:, 0]).argmax(), 0]
    arm = model.geometry(np.radians([0.5 * (180.0 + to)]), np.zeros(1)).moment_arms[:, 0]
    assert short * arm[["left", "right"].index(helps)] > 0.0
    assert result.saturated == ((helps,),)
