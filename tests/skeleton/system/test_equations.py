"""M, H - Q and moment arms of what is tracked, against Exudyn's own accelerations."""

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em

from .models import PASSIVE, Arm, exudyns_accelerations, spring_hand


@pytest.mark.parametrize("passive", list(PASSIVE))
def test_equations_of_motion(passive):
    """Under any load the tracked coordinate accelerates as Exudyn has it, passive ones with it."""
    arm = Arm(PASSIVE[passive])
    model = arm.model()
    skeleton = model.skeleton
    rng = np.random.default_rng(0)
    with skeleton.opened():
        skeleton.go_to(np.array([0.4]), np.array([1.5]), 0.0)
        M, bias, place = skeleton.dynamics()
        pose, B = place[2:4]
        geometry = model.geometry(*place)
        forces = rng.uniform(100.0, 800.0, 3)
        for load in (np.zeros(pose.x.size), 3.0 * pose.T[0], forces @ geometry.loads):
            x_tt = exudyns_accelerations(model, load)
            found = pose.T @ x_tt + skeleton.now.rate(pose)
            expected = np.linalg.solve(M, load @ B - bias)
            np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-8)
        torque = geometry.moment_arms.T @ forces[:2] + geometry.columns @ forces[2:]
        np.testing.assert_allclose(torque, forces @ geometry.loads @ B, rtol=1e-12)
        np.testing.assert_allclose(geometry.columns, [[1.0]], rtol=0, atol=1e-12)
        assert skeleton.acceleration.shape == (1,)


@pytest.mark.parametrize("passive", list(PASSIVE))
def test_the_basis_is_what_constraints_allow(passive):
    """T B = 1, G B = 0, and of all such directions the one of least kinetic energy."""
    skeleton = Arm(PASSIVE[passive]).model().skeleton
    with skeleton.opened():
        skeleton.go_to(np.array([0.4]), np.array([1.5]), 0.0)
        M, _, (_, _, pose, B, _) = skeleton.dynamics()
        K = skeleton.now._equations.matrix()
        n = pose.x.size
        np.testing.assert_allclose(pose.T @ B, [[1.0]], rtol=0, atol=1e-12)
        np.testing.assert_allclose(K[n:, :n] @ B, 0.0, rtol=0, atol=1e-12)
        free = np.linalg.svd(np.vstack([K[n:, :n], pose.T]))[2]
        rank = np.linalg.matrix_rank(np.vstack([K[n:, :n], pose.T]))
        np.testing.assert_allclose(free[rank:] @ K[:n, :n] @ B, 0.0, rtol=0, atol=1e-9)
        np.testing.assert_allclose(B.T @ K[:n, :n] @ B, M, rtol=1e-10)


@pytest.mark.parametrize(
    ("passive", "number"), [("nothing", 0), ("wobbling mass", 3), ("spring hand", 1), ("cable", 5)]
)
def test_passive_directions_are_counted(passive, number):
    model = Arm(PASSIVE[passive]).model()
    assert model.skeleton.others == number
    if number:
        with pytest.warns(em.FrozenBodiesWarning, match=f"holds the {number} coordinates"):
            em.static_optimization(model, em.Motion.from_waypoints([0.0, 0.1], [[0.0], [0.1]]))


def test_two_tracked_coordinates():
    arm = Arm(spring_hand)
    model = arm.model({"elbow": arm.elbow, "wrist": arm.wrist})
    skeleton = model.skeleton
    with skeleton.opened():
        skeleton.go_to(np.array([0.4, -0.3]), np.array([1.5, 0.5]), 0.0)
        np.testing.assert_allclose(skeleton.q, [0.4, -0.3], rtol=0, atol=1e-12)
        np.testing.assert_allclose(skeleton.v, [1.5, 0.5], rtol=0, atol=1e-12)
        M, bias, (_, _, pose, B, _) = skeleton.dynamics()
        load = np.array([2.0, -1.0]) @ pose.T
        found = pose.T @ exudyns_accelerations(model, load) + skeleton.now.rate(pose)
        expected = np.linalg.solve(M, [2.0, -1.0] - bias)
        np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_rotation_vectors_compose():
    """A pose far away is met through many rotations about changing axes."""
    mbs = exu.SystemContainer().AddSystem()
    arm = Arm(node_type=exu.NodeType.RotationRotationVector)
    del mbs
    skeleton = arm.model().skeleton
    with skeleton.opened():
        for q in (2.0, 4.0, 6.0, -3.0):
            skeleton.go_to(np.array([q]), np.array([1.0]), 0.0)
            assert np.abs(skeleton.now.equations(velocity=False)).max() < 1e-11
            assert np.abs(skeleton.now.equations(velocity=True)).max() < 1e-11


# Errors name what is wrong.


def second_hinge(arm):
    arm.hinge("another", arm.ground, arm.forearm, 0.0)


def rod(arm):
    arm.mbs.CreateDistanceConstraint(
        itemNumbers=[arm.ground, arm.forearm], localPosition0=[0.4, 0.4, 0],
        localPosition1=[0.2, 0, 0],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("add", "message"),
    [
        (second_hinge, r"redundant.*object \d+ 'elbow', a JointRevoluteZ; object \d+ 'another'"),
        (rod, "coordinate 'elbow': nothing can move it"),
    ],
)
def test_constraints_that_cannot_be_served(add, message):
    model = Arm(add).model()
    with pytest.raises(em.ModelError, match=message):
        em.cosimulate(
            model,
            em.Motion.from_waypoints([0.0, 0.1], [[0.0], [0.1]]),
            settings=em.CosimulationSettings(scheme=em.Scheme.FULL),
        )


def test_two_coordinates_that_are_the_same():
    arm = Arm()
    model = arm.model({"elbow": arm.elbow, "same": em.JointCoordinate(arm.elbow, "rz")})
    with (
        pytest.raises(em.ModelError, match="coordinates 'elbow', 'same' move only together"),
        model.skeleton.opened(),
    ):
        pass


@pytest.mark.parametrize(
    ("tracked", "message"),
    [
        ({}, "at least one tracked coordinate"),
        ({"a": 3}, "coordinate 'a' is the ObjectIndex of a joint, .* got 3"),
        ({"a": exu.NodeIndex(0)}, "got NodeIndex.0., one of the mbs's nodes"),
        ({"a": exu.ObjectIndex(1)}, "object 1 'forearm', a RigidBody, is no joint"),
        ({"a": exu.ObjectIndex(99)}, "coordinate 'a': the mbs has no object 99"),
        ({"a": em.NodeCoordinate(exu.NodeIndex(0), 9)}, "has the coordinates 0 to 6, got 9"),
    ],
)
def test_what_cannot_be_tracked(tracked, message):
    with pytest.raises(em.ParameterError, match=message):
        Arm().model(tracked, reserve=None)


def test_axes_of_a_joint_with_several_have_to_be_said():
    arm = Arm()
    joint = arm.mbs.CreateGenericJoint(
        name="ball", itemNumbers=[arm.ground, arm.forearm], position=[0, 0, 0],
        constrainedAxes=[1, 1, 1, 0, 1, 0],
    )  # fmt: skip
    arm.mbs.Assemble()
    for one, message in ((joint, "needs its axis="), (em.JointCoordinate(joint, "ry"), "not ry")):
        with pytest.raises(em.ParameterError, match=f"'ball', .* are rx, rz, .*{message}"):
            arm.model({"a": one}, reserve=None)


def test_links_are_bodies_and_bodies_are_no_links():
    arm = Arm()
    point = em.PathPoint([0, 0, 0])
    plain = em.Muscle("plain", path=[point, em.PathPoint([1, 0, 0], link=0)], **muscle_size())
    with pytest.raises(em.ParameterError, match="'plain': path point 1 is on link 0, but"):
        em.MusculoskeletalModel(arm.mbs, {"elbow": arm.elbow}, [plain])
    lost = em.PathPoint([1, 0, 0], link=exu.ObjectIndex(77))
    with pytest.raises(em.ParameterError, match="on object 77, which the mbs lacks"):
        em.MusculoskeletalModel(
            arm.mbs, {"elbow": arm.elbow}, [em.Muscle("lost", path=[point, lost], **muscle_size())]
        )


def muscle_size():
    return {"max_isometric_force": 1.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.1}


def test_trees_options_are_not_those_of_systems():
    arm = Arm()
    tracked = {"elbow": arm.elbow}
    with pytest.raises(em.ParameterError, match="coordinates= are those of a kinematic tree"):
        em.MusculoskeletalModel(arm.mbs, tracked, arm.muscles(), coordinates=["elbow"])
    follows = em.DependentCoordinate("slide", of="elbow", function=em.linear_function(0.5))
    with pytest.raises(
        em.ParameterError, match=r"of 'slide' .*CoordinateVectorConstraint.* docs/skeletons\.md"
    ):
        em.MusculoskeletalModel(arm.mbs, tracked, arm.muscles(), dependent_coordinates=[follows])
