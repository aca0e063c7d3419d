"""CMC where muscles, or a skeleton that topples, push away from the motion."""

import dataclasses
import importlib.util

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import InertiaCylinder, RigidBodyInertia, TreeLink

import exudyn_muscles as em
from exudyn_muscles.methods.recruiting import MuscleOptimization
from exudyn_muscles.methods.stiffness import cmc_growth, torque_against
from models import planar_arm

from ..opensim import REFERENCE
from ..runs import plugin_run, settings
from ..zoo import LAWS

P, J, Prediction = em.PathPoint, exu.JointType, em.Prediction
CASES = REFERENCE.parents[1] / "cases"
STILL = em.Motion.from_waypoints([0.0, 0.6], [[0.0], [0.0]])


def hinge(rod, gravity, muscles, reserves=()):
    mbs = exu.SystemContainer().AddSystem()
    link = TreeLink(jointType=J.RevoluteZ, parent=-1, jointHT=np.eye(4), linkInertia=rod)
    tree = mbs.CreateKinematicTree(listOfTreeLinks=[link], gravity=[0, -gravity, 0])
    mbs.Assemble()
    return em.MusculoskeletalModel(mbs, tree, muscles, coordinates=["hinge"], reserves=reserves)


def over_its_axis(rigid):
    """A rod without weight and two muscles from behind its hinge, which they pass over."""
    rod = InertiaCylinder(1000, 0.2, 0.01, axis=0).Translated([0.1, 0, 0])
    muscles = [
        em.Muscle(
            name, max_isometric_force=100.0, optimal_fiber_length=0.06, tendon_slack_length=0.06,
            path=[P([-0.1, y, 0]), P([0.02, y, 0], link=0)], minimum_activation=0.2,
            ignore_tendon_compliance=rigid,
        )
        for name, y in (("left", 0.004), ("right", -0.004))
    ]  # fmt: skip
    return hinge(rod, 0.0, muscles)


def finger():
    """A rod of 5 cm that stands upright between weak muscles."""
    rod = InertiaCylinder(1100, 0.05, 0.008, axis=1).Translated([0, 0.025, 0])
    muscles = [
        em.Muscle(
            name, max_isometric_force=20.0, optimal_fiber_length=0.05, tendon_slack_length=0.15,
            path=[P([x, -0.19, 0]), P([x, 0.0125, 0], link=0)],
        )
        for name, x in (("left", -0.005), ("right", 0.005))
    ]  # fmt: skip
    return hinge(rod, 9.81, muscles, [em.Reserve("hinge", optimal_force=10.0)])


def twisting_arm():
    """An arm that bends and turns about its own light axis, with muscles that cross both."""
    mbs = exu.SystemContainer().AddSystem()
    none = RigidBodyInertia(mass=0, inertiaTensor=np.zeros((3, 3)))
    arm = InertiaCylinder(1000, 0.3, 0.035, axis=1).Translated([0, -0.15, 0])
    links = [
        TreeLink(jointType=joint, parent=k - 1, jointHT=np.eye(4), linkInertia=inertia)
        for k, (joint, inertia) in enumerate(((J.RevoluteX, none), (J.RevoluteY, arm)))
    ]
    tree = mbs.CreateKinematicTree(listOfTreeLinks=links, gravity=[0, -9.81, 0])
    mbs.Assemble()
    paths = {
        "front": [P([0.0, 0.2, 0.03]), P([0.012, -0.05, 0.012], link=1)],
        "back": [P([0.0, 0.2, -0.03]), P([-0.012, -0.05, -0.012], link=1)],
        "around": [P([0.04, -0.01, 0.0], link=0), P([-0.018, -0.05, 0.008], link=1)],
        "against": [P([0.04, -0.01, 0.0], link=0), P([-0.018, -0.05, -0.008], link=1)],
    }

    def model(slack):
        muscles = [
            em.Muscle(
                name, max_isometric_force=500.0, optimal_fiber_length=0.05,
                tendon_slack_length=length, path=path,
            )
            for (name, path), length in zip(paths.items(), slack, strict=True)
        ]  # fmt: skip
        names = ["bend", "twist"]
        reserves = [em.Reserve("bend", optimal_force=1.0), em.Reserve("twist", optimal_force=0.1)]
        return em.MusculoskeletalModel(mbs, tree, muscles, coordinates=names, reserves=reserves)

    lengths = model([0.05] * 4).geometry(np.array([0.5, 0.0]), np.zeros(2)).length
    return model(np.maximum(lengths - 0.05, 0.01))


BEND = em.Motion.from_waypoints(
    [0.0, 0.5, 1.0, 1.5], [[0.3, 0.0], [1.0, 0.2], [0.5, -0.2], [1.0, 0.1]]
)
NOD = em.Motion.from_waypoints([0.0, 0.5, 1.0], [[0.0], [0.3], [0.0]])


def largest_error(model, motion, prediction, **options):
    """In degrees; a run that was lost altogether is as bad as it gets."""
    given = em.CMCSettings(prediction=prediction, **options)
    try:
        result = em.computed_muscle_control(model, motion, settings=given)
    except em.SimulationError:
        return np.inf
    return np.degrees(np.abs(result.tracking_errors()).max())


@pytest.mark.filterwarnings("ignore::exudyn_muscles.ExudynMusclesWarning")
@pytest.mark.parametrize(("build", "motion"), [(twisting_arm, BEND), (finger, NOD)])
def test_the_default_holds_where_the_desired_prediction_is_lost(build, motion):
    model = build()
    assert largest_error(model, motion, Prediction.DESIRED) > 5.0
    assert largest_error(model, motion, em.CMCSettings().prediction) < 0.3


@pytest.mark.skipif(not CASES.is_dir(), reason="the cases are not beside this repository")
@pytest.mark.parametrize(
    ("name", "arguments"), [("light_axis", ()), ("two_arms", (0,)), ("two_arms", (1,))]
)
def test_the_default_holds_in_cases_that_were_lost(name, arguments):
    spec = importlib.util.spec_from_file_location(name, CASES / f"{name}.py")
    case = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(case)
    result = em.computed_muscle_control(case.build(*arguments), case.motion())
    assert np.degrees(np.abs(result.tracking_errors()).max()) < 0.15
    assert result.max_unmet_torque == 0.0


def test_where_no_mode_is_negative_every_bit_is_that_of_the_desired_prediction():
    model, motion = planar_arm.build(), planar_arm.motion()
    one, other = (
        em.computed_muscle_control(model, motion, settings=em.CMCSettings(prediction=prediction))
        for prediction in (Prediction.BY_STIFFNESS, Prediction.DESIRED)
    )
    np.testing.assert_array_equal(one.coordinates, other.coordinates)
    np.testing.assert_array_equal(one.excitation_values, other.excitation_values)
    assert one.counts.recruitments == other.counts.recruitments


@pytest.mark.parametrize("name", ["end_slopes", "places_ahead"])
def test_where_nothing_can_be_evaluated_beside_a_state_the_run_goes_on(monkeypatch, name):
    model, motion = planar_arm.build(), planar_arm.motion().between(0.0, 0.2)
    desired = em.CMCSettings(prediction=Prediction.DESIRED)
    expected = em.computed_muscle_control(model, motion, settings=desired)

    def raises(*_):
        raise em.WindowError("no") if name == "end_slopes" else em.ModelError("no")

    monkeypatch.setattr(
        MuscleOptimization if name == "end_slopes" else type(model.skeleton), name, raises
    )
    found = em.computed_muscle_control(model, motion)
    np.testing.assert_array_equal(found.coordinates, expected.coordinates)


def test_a_system_of_bodies_holds_as_its_tree_does():
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    rod = mbs.CreateRigidBody(
        inertia=InertiaCylinder(1100, 0.05, 0.008, axis=1), referencePosition=[0, 0.025, 0],
        gravity=[0, -9.81, 0],
    )  # fmt: skip
    joint = mbs.CreateRevoluteJoint(
        itemNumbers=[ground, rod], position=[0, 0, 0], axis=[0, 0, 1], useGlobalFrame=True
    )
    mbs.Assemble()
    tree = finger()
    muscles = [
        dataclasses.replace(
            muscle, path=[P([x, -0.19, 0], link=ground), P([x, -0.0125, 0], link=rod)]
        )
        for muscle, x in zip(tree.muscles, (-0.005, 0.005), strict=True)
    ]
    bodies = em.MusculoskeletalModel(mbs, {"hinge": joint}, muscles, reserves=tree.reserves)
    expected = em.computed_muscle_control(tree, NOD).coordinates
    found = em.computed_muscle_control(bodies, NOD).coordinates
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


# Predicted growth against measured one.


def stiffness_and_damping(model, result):
    """lambda [1/s^2] and delta [1/s] of the last window of a run at rest, by differences."""
    q, v = np.zeros(1), np.zeros(1)
    geometry = model.geometry(q, v)
    l, r = geometry.length, geometry.moment_arms[:, 0]
    a, l_t, u = result.activations[-11], result.tendon_lengths[-11], result.excitation_values[-1]

    def torque(turn, speed):
        there = model.geometry(np.array([turn]), np.array([speed]))
        end = em.integrate_window(
            model.muscles, a, l_t, u, (l, there.length), (0.0 * l, there.lengthening_speed), 0.01,
            tolerance=1e-6,
        )  # fmt: skip
        return there.moment_arms[:, 0] @ end.force

    with model.skeleton.opened() as opened:
        mass = opened.dynamics_at(q, v, 0.0).M[0, 0]
    assert (r != 0.0).all()
    d = 1e-3
    slopes = (torque(d, 0.0) - torque(-d, 0.0), torque(0.0, d) - torque(0.0, -d))
    return tuple(-slope / (2.0 * d * mass) for slope in slopes)


def growth(model, kp, prediction):
    """Measured growth over a window of a small displacement, and the run."""
    model.skeleton.set_initial_state(np.array([1e-7]), np.zeros(1))
    plugin = em.CMCPlugin(model, STILL, em.CMCSettings(kp=kp, prediction=prediction))
    result = plugin_run(model, plugin, settings(0.001, 0.6))
    q = np.abs(result.coordinates[:, 0])
    return (q[400] / q[150]) ** (1 / 25), result


@pytest.mark.parametrize("rigid", [False, True])
def test_errors_grow_and_decay_as_the_stiffness_says(rigid):
    model = over_its_axis(rigid)
    measured, result = growth(model, 100.0, Prediction.DESIRED)
    stiffness, damping = stiffness_and_damping(model, result)
    assert stiffness < -500.0 and damping > 0.5
    expected = cmc_growth(100.0, 20.0, 0.01, stiffness, damping, False)
    assert expected > 1.15 and measured == pytest.approx(expected, rel=0.005)
    # The limit is -kp, whatever the muscles do within a window.
    for share in (0.9, 1.1):
        kp = -share * stiffness
        measured, _ = growth(model, kp, Prediction.DESIRED)
        expected = cmc_growth(kp, 2.0 * kp**0.5, 0.01, stiffness, damping, False)
        assert (measured < 1.0) == (share > 1.0)
        assert measured == pytest.approx(expected, rel=0.005)
    measured, _ = growth(model, 100.0, Prediction.BY_STIFFNESS)
    expected = cmc_growth(100.0, 20.0, 0.01, stiffness, damping, True)
    assert expected < 0.95 and measured == pytest.approx(expected, rel=0.005)


def test_the_expected_error_carries_further_than_that_at_the_start():
    """Kept out by the error that is expected, 20 kp are no more than one: third order in h."""
    usual = cmc_growth(100.0, 20.0, 0.01, 0.0, 0.0, True)
    for stiffness in (-100.0, -2000.0, -10000.0):
        assert cmc_growth(100.0, 20.0, 0.01, stiffness, 0.0, True) == pytest.approx(usual, abs=5e-3)


def test_modes_are_those_of_the_mass_matrix():
    rng = np.random.default_rng(3)
    A, B = rng.normal(size=(2, 4, 4))
    M, error = A @ A.T + np.eye(4), rng.normal(size=4)
    # A stiffness with known modes: K = W diag(values) W^T with W = M phi.
    L = np.linalg.cholesky(M)
    W = L @ np.linalg.qr(B)[0]
    values = np.array([-300.0, -10.0, 5.0, 200.0])
    K = (W * values) @ W.T
    expected = W[:, 0] * (-300.0 * (W[:, 0] @ error))
    np.testing.assert_allclose(torque_against(K, M, error, 25.0), expected, rtol=1e-9)
    assert torque_against(K, M, error, 400.0) is None


@pytest.mark.parametrize("rigid", [False, True])
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_late_lengthening_never_lowers_the_force(law, rigid):
    """Which is why no damping has to be kept out of the feedback."""
    rng = np.random.default_rng(5)
    muscle = em.Muscle(
        "m", max_isometric_force=1000.0, optimal_fiber_length=0.1, tendon_slack_length=0.2,
        law=law, ignore_tendon_compliance=rigid, path=[P([0, 0, 0]), P([1, 0, 0], link=0)],
    )  # fmt: skip
    count, d = 40, 1e-3
    muscles = em.MuscleSet([dataclasses.replace(muscle, name=f"m{i}") for i in range(count)])
    a, u = rng.uniform(0.05, 1.0, size=(2, count))
    l, v = rng.uniform(0.26, 0.33, size=count), rng.uniform(-0.2, 0.2, size=count)
    l_t = np.full(count, 0.2) if rigid else em.equilibrium(muscles, a, l).tendon_length
    forces = [
        em.integrate_window(muscles, a, l_t, u, (l, l + 0.01 * v), (v, v + x), 0.01, tolerance=1e-6)
        for x in (-d, d)
    ]
    assert (forces[1].force - forces[0].force > -1e-3).all()
