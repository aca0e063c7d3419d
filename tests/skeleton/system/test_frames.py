"""Frames of bodies and markers, and what is measured between them, against Exudyn's own outputs."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import (
    Cable2D,
    HomogeneousTransformation,
    InertiaCuboid,
    MarkerBodyRigid,
    MarkerNodeRigid,
    NodePoint2DSlope1,
    RotXYZ2RotationMatrix,
)

import exudyn_muscles as em
from exudyn_muscles.checks import BodyNumber, MarkerNumber
from exudyn_muscles.skeleton.rotations import advance

from ...differences import gradient
from .convert import EULER, TAIT_BRYAN, VECTOR

INERTIA = InertiaCuboid(density=1000, sideLengths=[0.3, 0.1, 0.2])
NODE_TYPES = pytest.mark.parametrize("node_type", [EULER, TAIT_BRYAN, VECTOR])
ROTATION, POSITION = exu.OutputVariableType.RotationMatrix, exu.OutputVariableType.Position


class Pair:
    """Two bodies anywhere, of which markers and what is tracked are given by a function."""

    def __init__(self, node_type, tracked, seed=0):
        self.rng = rng = np.random.default_rng(seed)
        self.mbs = mbs = exu.SystemContainer().AddSystem()
        self.ground = mbs.CreateGround(referencePosition=[0.1, 0.2, 0.3])
        self.bodies = [
            mbs.CreateRigidBody(
                inertia=INERTIA,
                referencePosition=rng.normal(size=3),
                referenceRotationMatrix=RotXYZ2RotationMatrix(rng.uniform(-1, 1, 3)),
                nodeType=node_type,
            )
            for _ in range(2)
        ]
        self.markers = [
            mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=rng.normal(size=3)))
            for body in self.bodies
        ]
        mbs.Assemble()
        self.model = em.MusculoskeletalModel(mbs, tracked(self), [muscle(*self.bodies)])
        self.skeleton = self.model.skeleton

    def disturb(self, size=0.3):
        """Any state that is not far away; unit Euler parameters."""
        state = self.skeleton.now.state
        state.q[:] = size * self.rng.uniform(-1, 1, state.q.size)
        for own, reference in self._parameters():
            theta = state.q[own] + reference
            state.q[own] = theta / np.linalg.norm(theta) - reference
        state.v[:] = self.tangent() @ self.rng.normal(size=state.v.size)

    def tangent(self):
        """The directions that leave Euler parameters their length: a projection (N, N)."""
        x = self.skeleton.now.state.q
        projection = np.eye(x.size)
        for own, reference in self._parameters():
            theta = x[own] + reference
            projection[own, own] -= np.outer(theta, theta)
        return projection

    def _parameters(self):
        reference = self.skeleton.pose().tables.reference
        if reference.size == 14:
            for own in (slice(3, 7), slice(10, 14)):
                yield own, reference[own]


def muscle(first, second):
    size = {"max_isometric_force": 1.0, "optimal_fiber_length": 1.0, "tendon_slack_length": 0.5}
    points = [
        em.PathPoint([0.1, 0.0, 0.05], link=first),
        em.PathPoint([0.0, 0.1, 0.0], link=second),
    ]
    return em.Muscle("any", **size, path=points)


def relative(pair):
    return {
        "turn": em.RelativeRotation(*pair.markers, axis=[1.0, 2.0, -0.5]),
        "way": em.RelativePosition(*pair.markers, axis=[0.0, 1.0, 1.0]),
    }


def moved(skeleton, dx):
    """x with a small displacement along Exudyn's speeds."""
    x, equations = skeleton.now.state.q.copy(), skeleton.now._equations
    advance(equations.vectors, equations.reference, x, dx)
    return x


@NODE_TYPES
def test_frames_are_exudyns(node_type):
    pair = Pair(node_type, relative)
    skeleton = pair.skeleton
    numbers = [skeleton.frame_number("x", BodyNumber(int(body))) for body in pair.bodies]
    own = skeleton.frame_number("x", MarkerNumber(int(pair.markers[0])))
    with skeleton.opened():
        pair.disturb()
        pose = skeleton.pose()
        for number, marker in zip([*numbers, own], [*pair.markers, pair.markers[0]], strict=True):
            R = pair.mbs.GetMarkerOutput(marker, ROTATION).reshape(3, 3)
            np.testing.assert_allclose(pose.frames.R[number], R, rtol=0, atol=1e-14)
            place = pair.mbs.GetMarkerOutput(marker, POSITION)
            local = pair.mbs.GetMarker(marker)["localPosition"] if number != own else np.zeros(3)
            found = pose.frames.p[number] + R @ local
            np.testing.assert_allclose(found, place, rtol=0, atol=1e-14)
            rows = slice(*pose.tables.starts[number : number + 2])
            x_t = pose.x_t[pose.tables.indices[rows]]
            velocity = pair.mbs.GetMarkerOutput(marker, exu.OutputVariableType.Velocity)
            omega = pose.frames.J[rows, 3:].T @ x_t
            speed = pose.frames.J[rows, :3].T @ x_t + np.cross(omega, R @ local)
            np.testing.assert_allclose(speed, velocity, rtol=0, atol=1e-13)
            turning = pair.mbs.GetMarkerOutput(marker, exu.OutputVariableType.AngularVelocityLocal)
            np.testing.assert_allclose(R.T @ omega, turning, rtol=0, atol=1e-13)


@NODE_TYPES
def test_rates_are_derivatives(node_type):
    """Of what is tracked, of l, and of the rates themselves along a motion."""
    pair = Pair(node_type, relative)
    skeleton = pair.skeleton
    with skeleton.opened():
        pair.disturb()
        state, x_t = skeleton.now.state, skeleton.now.state.v.copy()
        x, pose = state.q.copy(), skeleton.pose()
        loads = pair.model.loads(pose)[2]

        def measured(dx):
            state.q[:] = moved(skeleton, dx)
            now = skeleton.pose()
            state.q[:] = x
            return np.append(now.z, pair.model.loads(now)[0])

        tangent = pair.tangent()
        slopes = gradient(lambda s: measured(tangent @ s), np.zeros(x.size), 1e-4)
        found = np.vstack([pose.T, -loads]) @ tangent
        np.testing.assert_allclose(found, slopes, rtol=0, atol=1e-9)

        def rates(time):
            state.q[:] = moved(skeleton, time[0] * x_t)
            rate = skeleton.pose().T @ x_t
            state.q[:] = x
            return rate

        found = skeleton.now.rate(pose)
        expected = gradient(rates, np.zeros(1), 1e-5)[:, 0]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("turns", [-1.3, 0.7, 4.4])
def test_angles_go_on_beyond_a_turn(turns):
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    body = mbs.CreateRigidBody(inertia=INERTIA)
    hinge = mbs.CreateRevoluteJoint(itemNumbers=[ground, body], position=[0, 0, 0], axis=[0, 0, 1])
    mbs.Assemble()
    skeleton = em.MusculoskeletalModel(mbs, {"hinge": hinge}, [muscle(ground, body)]).skeleton
    target = 2.0 * np.pi * turns
    skeleton.set_initial_state(np.array([target]), np.array([2.0]))
    with skeleton.opened(near=np.array([target])):
        assert skeleton.q[0] == pytest.approx(target, abs=1e-12)
        assert skeleton.v[0] == pytest.approx(2.0, abs=1e-12)
        for k in range(1, 50):
            skeleton.go_to(np.array([target + 0.3 * k]), np.zeros(1), 0.0)
            assert skeleton.q[0] == pytest.approx(target + 0.3 * k, abs=1e-11)


LOCKED = {
    "rx": [1, 1, 1, 0, 1, 1], "ry": [1, 1, 1, 1, 0, 1], "rz": [1, 1, 1, 1, 1, 0],
    "rx ry": [1, 1, 1, 0, 0, 1], "ry rz": [1, 1, 1, 1, 0, 0], "rx rz": [1, 1, 1, 0, 1, 0],
    "rx ry rz": [1, 1, 1, 0, 0, 0], "tx rz": [0, 1, 1, 1, 1, 0], "tz": [1, 1, 0, 1, 1, 1],
    "tx ty tz rx ry rz": [0, 0, 0, 0, 0, 0],
}  # fmt: skip


@pytest.mark.parametrize("free", list(LOCKED))
@NODE_TYPES
def test_free_axes_of_joints(node_type, free):
    """Posed by its coordinates a joint has the rotation R_x R_y R_z and the translation of them."""
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    turned = RotXYZ2RotationMatrix([0.4, -0.7, 0.2])
    body = mbs.CreateRigidBody(inertia=INERTIA, nodeType=node_type, referenceRotationMatrix=turned)
    joint = mbs.CreateGenericJoint(
        itemNumbers=[ground, body],
        position=[0, 0, 0],
        rotationMatrixAxes=RotXYZ2RotationMatrix([0.5, 0.1, 0.3]),
        constrainedAxes=LOCKED[free],
        useGlobalFrame=True,
    )
    mbs.Assemble()
    names = free.split()
    tracked = {name: em.JointCoordinate(joint, name) for name in names}
    skeleton = em.MusculoskeletalModel(mbs, tracked, [muscle(ground, body)]).skeleton
    assert skeleton.units == tuple("m" if name[0] == "t" else "rad" for name in names)
    wanted = np.array([0.3, -0.5, 0.7, 0.4, -0.6, 0.9])[
        [("tx", "ty", "tz", "rx", "ry", "rz").index(name) for name in names]
    ]
    markers = mbs.GetObject(joint)["markerNumbers"]
    with skeleton.opened():
        skeleton.go_to(wanted, 0.1 * wanted, 0.0)
        np.testing.assert_allclose(skeleton.q, wanted, rtol=0, atol=1e-12)
        first, second = (mbs.GetMarkerOutput(one, ROTATION).reshape(3, 3) for one in markers)
        p = mbs.GetMarkerOutput(markers[1], POSITION)
    of = dict(zip(names, wanted, strict=True))
    angles = [of.get(name, 0.0) for name in ("rx", "ry", "rz")]
    way = [of.get(name, 0.0) for name in ("tx", "ty", "tz")]
    np.testing.assert_allclose(first.T @ second, RotXYZ2RotationMatrix(angles), rtol=0, atol=1e-12)
    np.testing.assert_allclose(first.T @ p, way, rtol=0, atol=1e-12)


def test_functions_of_the_state():
    def tracked(pair):
        return {
            "first": em.NodeCoordinate(exu.NodeIndex(0), 1, unit="m"),
            "sum": em.ScalarFunction(
                lambda mbs: float(mbs.systemData.GetODE2Coordinates()[7:9].sum()),
                lambda mbs: np.eye(14)[7] + np.eye(14)[8],
                unit="m",
            ),
        }

    pair = Pair(EULER, tracked)
    with pair.skeleton.opened():
        pair.disturb()
        state = pair.skeleton.now.state
        np.testing.assert_allclose(
            pair.skeleton.q, [state.q[1], state.q[7] + state.q[8]], rtol=1e-15
        )
        np.testing.assert_allclose(
            pair.skeleton.v, [state.v[1], state.v[7] + state.v[8]], rtol=1e-15
        )


def test_an_ancf_cables_marker_is_a_frame():
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    nodes = [mbs.AddNode(NodePoint2DSlope1(referenceCoordinates=[x, 0, 1, 0])) for x in (0.0, 0.5)]
    cable = mbs.AddObject(
        Cable2D(
            nodeNumbers=nodes, length=0.5, massPerLength=1.0,
            bendingStiffness=2.0, axialStiffness=500.0,
        )
    )  # fmt: skip
    marker = mbs.AddMarker(MarkerBodyRigid(bodyNumber=cable, localPosition=[0.3, 0, 0]))
    mbs.Assemble()
    tracked = {"tip": em.NodeCoordinate(nodes[1], 1, unit="m")}
    with pytest.raises(em.ParameterError, match=r"object \d+ .* a ANCFCable2D.* MarkerIndex"):
        em.MusculoskeletalModel(mbs, tracked, [muscle(ground, cable)])
    model = em.MusculoskeletalModel(mbs, tracked, [muscle(ground, marker)])
    skeleton = model.skeleton
    with skeleton.opened():
        state = skeleton.now.state
        x = 0.1 * np.random.default_rng(0).uniform(-1, 1, state.q.size)

        def length(at):
            state.q[:] = at
            return model.loads(skeleton.pose())[0]

        slopes = gradient(length, x, 1e-5)
        state.q[:] = x
        np.testing.assert_allclose(-model.loads(skeleton.pose())[2], slopes, rtol=0, atol=1e-8)


def test_markers_may_be_turned_and_on_nodes():
    """Where a marker is and how it is turned is part of what lies between two of them."""
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    body = mbs.CreateRigidBody(inertia=INERTIA, referencePosition=[0.3, 0.1, 0.2])
    node = mbs.GetObject(body)["nodeNumber"]
    frame = HomogeneousTransformation(RotXYZ2RotationMatrix([0.5, 0.1, 0.3]), [0.1, 0.2, 0.3])
    base = mbs.AddMarker(MarkerBodyRigid(bodyNumber=ground, localHT=frame))
    turned = frame.copy()
    turned[:3, 3] = 0.0
    on_body = mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localHT=frame))
    on_node = mbs.AddMarker(MarkerNodeRigid(nodeNumber=node, localHT=turned))
    mbs.Assemble()
    axis = [1.0, 0.0, 0.0]
    tracked = {
        "turn": em.RelativeRotation(base, on_body, axis=axis),
        "way": em.RelativePosition(base, on_body, axis=axis),
    }
    skeleton = em.MusculoskeletalModel(mbs, tracked, [muscle(ground, body)]).skeleton
    other = em.RelativeRotation(base, on_node, axis=axis)
    twin = em.MusculoskeletalModel(mbs, {"turn": other}, [muscle(ground, body)]).skeleton
    with skeleton.opened():
        skeleton.go_to(np.array([0.4, 0.7]), np.zeros(2), 0.0)
        R, S = (mbs.GetMarkerOutput(k, ROTATION).reshape(3, 3) for k in (base, on_body))
        way = mbs.GetMarkerOutput(on_body, POSITION) - mbs.GetMarkerOutput(base, POSITION)
        A = R.T @ S
        assert np.arctan2(A[2, 1], A[1, 1]) == pytest.approx(0.4, abs=1e-12)
        assert R[:, 0] @ way == pytest.approx(0.7, abs=1e-12)
        x = skeleton.now.state.q.copy()
    with twin.opened():
        twin.now.state.q[:] = x
        assert twin.q[0] == pytest.approx(0.4, abs=1e-12)
