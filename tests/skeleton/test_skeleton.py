"""M and H - Q of Exudyn systems, at any state and in the middle of a run; what is refused."""

import exudyn as exu
import exudyn.rigidBodyUtilities as rigid
import numpy as np
import pytest
from exudyn.itemInterface import (
    LoadCoordinate,
    MarkerKinematicTreeRigid,
    MarkerNodeCoordinate,
    ObjectConnectorCoordinateSpringDamper,
)
from exudyn.kinematicTree import Inertia2T66, KinematicTree66
from exudyn.utilities import DistanceConstraint, MarkerBodyRigid, RigidBodyInertia

import exudyn_muscles as em
from exudyn_muscles.skeleton.hold import Hold
from exudyn_muscles.skeleton.skeleton import Skeleton
from exudyn_muscles.skeleton.tree import tree_frames
from models import pendulum

from ..differences import gradient
from ..path.trees import JOINTS, add_tree, random_links

GRAVITY = [0.3, -9.81, 0.5]  # of `add_tree`


class System:
    """A random tree in its own mbs; `extend(mbs, tree)` adds what else belongs to it."""

    def __init__(self, seed=0, n=5, extend=None, before=None, joints=None, **more):
        rng = np.random.default_rng(seed)
        self.rng, self.n = rng, n
        self.mbs = exu.SystemContainer().AddSystem()
        if before is not None:
            before(self.mbs)
        self.links = random_links(rng, n, joints)
        self.number = add_tree(self.mbs, rng, self.links, **more)
        self.node = self.mbs.GetObject(self.number)["nodeNumber"]
        if extend is not None:
            extend(self)
        self.mbs.Assemble()
        self.skeleton = Skeleton(self.mbs, self.number)
        self.held = Hold(self.mbs)
        self.skeleton.open(self.held)

    def state(self):
        return self.rng.uniform(-1.5, 1.5, (2, self.n))

    def coordinate_marker(self, j):
        return self.mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=self.node, coordinate=j))

    def ground_marker(self):
        node = self.mbs.AddNode(exu.itemInterface.NodePointGround())
        return self.mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))


REVOLUTE = tuple(JOINTS[k] for k in (2, 0, 1, 1, 2, 0, 1, 2, 0))


def featherstone(system, q, v):
    """M and H of a revolute tree by Exudyn's Python reference, an algorithm on its own.

    Not for prismatic joints below revolute ones: Exudyn 1.13.6 has their translation with the
    wrong sign in this reference. Its trees are right: `lagrange`.
    """
    tree = system.skeleton.tree
    transformations = [
        rigid.RotationTranslation2T66Inverse(
            A=tree.rotations[i],
            v=tree.offsets[i] + (tree.base if tree.parents[i] < 0 else 0.0),
        )
        for i in range(system.n)
    ]
    names = dict(zip(JOINTS[:3], ("Rx", "Ry", "Rz"), strict=True))
    reference = KinematicTree66(
        listOfJointTypes=[names[link.jointType] for link in system.links],
        listOfTransformations=transformations,
        listOfInertias=[Inertia2T66(link.linkInertia) for link in system.links],
        listOfParents=list(tree.parents),
        gravity=GRAVITY,
    )
    return reference.ComputeMassMatrixAndForceTerms(q + tree.reference, v)


def lagrange(system, q, v):
    """M and H from the kinetic and potential energy of the links, by differences."""
    tree, n = system.skeleton.tree, system.n

    def centres(x):
        R, p, _ = tree_frames(tree, x)
        return np.array([p[i] + R[i] @ link.linkInertia.com for i, link in enumerate(system.links)])

    def mass(x):
        R = tree_frames(tree, x)[0]
        J = gradient(centres, x, 1e-3)
        dR = gradient(lambda y: tree_frames(tree, y)[0], x, 1e-3)
        M = np.zeros((n, n))
        for i, link in enumerate(system.links):
            spin = np.einsum("abk,cb->ack", dR[i], R[i])  # dR R^T, the angular velocity's matrix
            W = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
            inertia = R[i] @ link.linkInertia.InertiaCOM() @ R[i].T
            M += link.linkInertia.mass * J[i].T @ J[i] + W.T @ inertia @ W
        return M

    def potential(x):
        masses = np.array([link.linkInertia.mass for link in system.links])
        return -masses @ centres(x) @ GRAVITY

    dM = gradient(mass, q, 1e-2)
    H = np.einsum("ijk,j,k->i", dM, v, v) - 0.5 * np.einsum("jki,j,k->i", dM, v, v)
    return mass(q), H + gradient(potential, q, 1e-3)


def test_before_it_is_opened():
    """The state can be read, as it is then; what has to be evaluated says how."""
    model = pendulum.build()
    skeleton, data = model.skeleton, model.mbs.systemData
    for q in ([0.3], [0.4]):
        data.SetODE2Coordinates(q)
        data.SetODE2Coordinates_t([2.0])
        assert skeleton.q == q and skeleton.v == [2.0]
    assert [len(values) for values in skeleton.start] == [1, 1, 1]
    for evaluate in (
        skeleton.dynamics,
        lambda: skeleton.dynamics_at(skeleton.q, skeleton.v, 0.0)[:2],
        lambda: skeleton.apply(np.zeros(1)),
    ):
        with pytest.raises(em.ModelError, match=r"not open yet: .* skeleton\.opened\(\)"):
            evaluate()
    with skeleton.opened():
        assert np.isfinite(skeleton.dynamics()[0]).all()


@pytest.mark.parametrize("seed", range(6))
def test_revolute_trees(seed):
    n = 4 + seed
    system = System(seed, n, joints=REVOLUTE)
    for _ in range(4):
        q, v = system.state()
        M, bias = system.skeleton.dynamics_at(q, v, 0.0)[:2]
        expected = featherstone(system, q, v)
        np.testing.assert_allclose(M, expected[0], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(bias, expected[1], rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("seed", range(6))
def test_trees_of_all_joints(seed):
    system = System(seed, n=4)
    q, v = system.state()
    M, bias = system.skeleton.dynamics_at(q, v, 0.0)[:2]
    expected = lagrange(system, q, v)
    np.testing.assert_allclose(M, expected[0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(bias, expected[1], rtol=0.0, atol=1e-7)


def test_the_users_torques_belong_to_Q():
    """Also while muscles' torques act: those are not part of it."""
    torque = np.array([1.0, -2.0, 3.0, 0.5, -0.1])
    system = System(joints=REVOLUTE, jointForceVector=torque)
    q, v = system.state()
    _, expected = featherstone(system, q, v)
    for muscles in (np.zeros(5), np.array([100.0, -50.0, 20.0, 10.0, 5.0])):
        system.skeleton.apply(muscles)
        applied = system.skeleton.applied(system.skeleton.place)
        np.testing.assert_array_equal(applied, torque + muscles - torque)
        _, bias = system.skeleton.dynamics_at(q, v, 0.0)[:2]
        np.testing.assert_allclose(bias, expected - torque, rtol=1e-12, atol=1e-11)
    system.held.release()
    given = system.mbs.GetObjectParameter(system.number, "jointForceVector")
    np.testing.assert_array_equal(given, torque)


def test_springs_and_dampers_belong_to_Q():
    k, d, offset = 37.0, 5.0, 0.2

    def spring(system):
        system.mbs.AddObject(
            ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[system.ground_marker(), system.coordinate_marker(2)],
                stiffness=k,
                damping=d,
                offset=offset,
            )
        )

    plain, sprung = System(seed=3), System(seed=3, extend=spring)
    for _ in range(3):
        q, v = plain.state()
        M, bias = plain.skeleton.dynamics_at(q, v, 0.0)[:2]
        M_spring, bias_spring = sprung.skeleton.dynamics_at(q, v, 0.0)[:2]
        np.testing.assert_array_equal(M, M_spring)
        # Q stands on the right, and a spring pulls back: H - Q rises with the elongation. Exudyn's
        # node coordinates are without the reference.
        force = k * (q[2] - offset) + d * v[2]
        assert (bias_spring - bias)[2] == pytest.approx(force, abs=1e-10)
        np.testing.assert_allclose(np.delete(bias_spring - bias, 2), 0.0, atol=1e-12)


def test_loads_of_time_belong_to_Q():
    def load(system):
        system.mbs.AddLoad(
            LoadCoordinate(
                markerNumber=system.coordinate_marker(1),
                load=2.0,
                loadUserFunction=lambda mbs, t, value: value * np.sin(7.0 * t),
            )
        )

    plain, loaded = System(seed=4), System(seed=4, extend=load)
    q, v = plain.state()
    _, bias = plain.skeleton.dynamics_at(q, v, 0.0)[:2]
    for t in (0.0, 0.1, 0.35):
        _, loaded_bias = loaded.skeleton.dynamics_at(q, v, t)[:2]
        expected = np.zeros(5)
        expected[1] = -2.0 * np.sin(7.0 * t)
        np.testing.assert_allclose(loaded_bias - bias, expected, atol=1e-12)


def test_forces_on_links_belong_to_Q():
    force = np.array([3.0, -1.0, 2.0])

    def push(system):
        marker = system.mbs.AddMarker(
            MarkerKinematicTreeRigid(
                objectNumber=system.number, linkNumber=4, localPosition=[0.1, 0.2, -0.1]
            )
        )
        system.marker = marker
        system.mbs.AddLoad(exu.itemInterface.Force(markerNumber=marker, loadVector=force))

    plain, pushed = System(seed=5), System(seed=5, extend=push)
    q, v = plain.state()
    _, bias = plain.skeleton.dynamics_at(q, v, 0.0)[:2]
    _, pushed_bias = pushed.skeleton.dynamics_at(q, v, 0.0)[:2]

    # The virtual power of the force: its point's Jacobian by differences of the marker.
    def position(x):
        pushed.mbs.systemData.SetODE2Coordinates(x)
        return np.array(pushed.mbs.GetMarkerOutput(pushed.marker, exu.OutputVariableType.Position))

    jacobian = gradient(position, q, 1e-3)
    np.testing.assert_allclose(pushed_bias - bias, -force @ jacobian, atol=1e-9)


def free_body(mbs):
    mbs.CreateRigidBody(
        referencePosition=[3.0, 0.0, 0.0],
        initialVelocity=[1.0, 0.0, 0.0],
        inertia=RigidBodyInertia(mass=2.0, inertiaTensor=np.eye(3)),
        gravity=[0.0, -9.81, 0.0],
        nodeType=exu.NodeType.RotationRxyz,
    )


@pytest.mark.parametrize("place", ["before", "extend"])
def test_other_bodies_beside_the_tree(place):
    alone = System(seed=6)
    add = free_body if place == "before" else lambda system: free_body(system.mbs)
    among = System(seed=6, **{place: add})
    assert among.skeleton.rows.start == (6 if place == "before" else 0)
    q, v = alone.state()
    for one, other in zip(
        alone.skeleton.dynamics_at(q, v, 0.0)[:2],
        among.skeleton.dynamics_at(q, v, 0.0)[:2],
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)


def test_initial_state_of_the_tree_alone():
    among = System(seed=6, before=free_body)
    before = among.mbs.systemData.GetODE2Coordinates_t(configuration=exu.ConfigurationType.Initial)
    q, v = among.state()
    among.skeleton.set_initial_state(q, v)
    np.testing.assert_array_equal(among.skeleton.initial_state(), [q, v])
    after = among.mbs.systemData.GetODE2Coordinates_t(configuration=exu.ConfigurationType.Initial)
    np.testing.assert_array_equal(after[:6], before[:6])
    assert after[0] == 1.0


def run(evaluate, joints=None):
    """Final state of a run in which `evaluate(system, t)` is called before every residual."""

    def load(system):
        system.mbs.AddLoad(
            LoadCoordinate(
                markerNumber=system.coordinate_marker(0),
                load=1.0,
                loadUserFunction=lambda mbs, t, value: value * np.sin(20.0 * t),
            )
        )

    system = System(seed=7, extend=load, before=free_body, joints=joints)
    calls = []

    def before_residual(mbs, t, iteration, discontinuous):
        calls.append(t)
        evaluate(system, t)
        return True

    system.mbs.SetPreNewtonResidualUserFunction(before_residual)
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = 0.5
    settings.timeIntegration.numberOfSteps = 50
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    system.mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    data = system.mbs.systemData
    parts = data.GetODE2Coordinates(), data.GetODE2Coordinates_t(), data.GetODE2Coordinates_tt()
    return np.concatenate(parts).tobytes(), calls


def test_evaluations_leave_a_run_as_it_is():
    reference, calls = run(lambda system, t: None)
    assert len(calls) > 100

    def at_the_iterate(system, t):
        M, bias = system.skeleton.dynamics()[:2]
        assert np.isfinite(bias).all()

    def elsewhere(system, t):
        q, v = system.state()
        now = system.skeleton.dynamics()[:2]
        system.skeleton.dynamics_at(q, v, t + 0.3)[:2]
        for one, other in zip(now, system.skeleton.dynamics()[:2], strict=True):
            np.testing.assert_array_equal(one, other)

    assert run(at_the_iterate) == (reference, calls)
    assert run(elsewhere) == (reference, calls)


def test_evaluations_in_a_run_are_those_of_the_iterate():
    """`dynamics` is `dynamics_at` the iterate's state and time, and what Featherstone gives."""

    def compare(system, t):
        q, v = system.skeleton.q.copy(), system.skeleton.v.copy()
        M, bias = (x.copy() for x in system.skeleton.dynamics()[:2])
        there = system.skeleton.dynamics_at(q, v, t)[:2]
        np.testing.assert_array_equal(M, there[0])
        np.testing.assert_array_equal(bias, there[1])
        if len(seen) < 5:
            seen.append(t)
            expected = featherstone(system, q, v)
            expected[1][0] -= np.sin(20.0 * t)
            np.testing.assert_allclose(M, expected[0], rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(bias, expected[1], rtol=1e-12, atol=1e-11)

    seen = []
    run(compare, REVOLUTE)
    assert len(seen) == 5


def test_the_state_survives_an_error_in_the_evaluation():
    def fail(system):
        def load(mbs, t, value):
            if t > 1.0:
                raise ValueError("too late")
            return value

        system.mbs.AddLoad(
            LoadCoordinate(
                markerNumber=system.coordinate_marker(0), load=1.0, loadUserFunction=load
            )
        )

    system = System(seed=8, extend=fail)
    q, v = system.skeleton.q.copy(), system.skeleton.v.copy()
    with pytest.raises(Exception, match="too late"):
        system.skeleton.dynamics_at(*system.state(), 2.0)[:2]
    np.testing.assert_array_equal(system.skeleton.q, q)
    np.testing.assert_array_equal(system.skeleton.v, v)
    assert system.mbs.systemData.GetTime() == 0.0


# -- what is refused ------------------------------------------------------------------------------


def unassembled(n=2):
    mbs = exu.SystemContainer().AddSystem()
    rng = np.random.default_rng(0)
    return mbs, add_tree(mbs, rng, random_links(rng, n))


def test_not_assembled():
    mbs, tree = unassembled()
    with pytest.raises(em.ModelError, match=r"not assembled: call mbs.Assemble\(\)"):
        Skeleton(mbs, tree)


def test_changed_after_assembling():
    mbs, tree = unassembled()
    mbs.Assemble()
    skeleton = Skeleton(mbs, tree)
    mbs.AddNode(exu.itemInterface.NodePointGround())
    with pytest.raises(em.ModelError, match="not assembled"):
        skeleton.open(Hold(mbs))


def test_not_a_tree():
    mbs = exu.SystemContainer().AddSystem()
    body = mbs.CreateMassPoint(mass=1.0)
    mbs.Assemble()
    with pytest.raises(em.ModelError, match="must be an ObjectKinematicTree"):
        Skeleton(mbs, body)


@pytest.mark.parametrize("number", [99, -1, None, "arm", True, 0.0, exu.ObjectIndex(99)])
def test_not_an_object(number):
    mbs, _ = unassembled()
    mbs.Assemble()
    with pytest.raises(em.ModelError, match="is not an object of this mbs"):
        Skeleton(mbs, number)


def test_a_number_of_another_list():
    mbs, tree = unassembled()
    node = mbs.GetObject(tree)["nodeNumber"]
    mbs.Assemble()
    with pytest.raises(em.ModelError, match=r"NodeIndex\(0\), one of the mbs's nodes is not"):
        Skeleton(mbs, node)


def test_algebraic_constraints():
    mbs, tree = unassembled()
    body = mbs.CreateRigidBody(
        referencePosition=[3.0, 0.0, 0.0],
        inertia=RigidBodyInertia(mass=2.0, inertiaTensor=np.eye(3)),
    )
    ground = mbs.CreateGround()
    mbs.CreateRevoluteJoint(itemNumbers=[ground, body], position=[3.0, 0.0, 0.0], axis=[0, 0, 1])
    mbs.Assemble()
    Skeleton(mbs, tree)  # which it does not touch
    hand = mbs.AddMarker(MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=1))
    wall = mbs.AddMarker(MarkerBodyRigid(bodyNumber=ground))
    rod = DistanceConstraint(name="rod", markerNumbers=[wall, hand], distance=1.0)
    number = int(mbs.AddObject(rod))
    mbs.Assemble()
    with pytest.raises(em.ModelError, match="algebraic constraints") as caught:
        Skeleton(mbs, tree)
    for what in (f"'rod' (object {number})", "mapping of what is tracked", "dependent_coordinates"):
        assert what in str(caught.value)
    assert "Ground" not in str(caught.value) and "Revolute" not in str(caught.value)


@pytest.mark.parametrize("names", [["shoulder"], ["a", "b", "c"], ["same", "same"], []])
def test_names_that_do_not_fit(names):
    mbs, tree = unassembled()
    mbs.Assemble()
    with pytest.raises(em.ModelError, match="needs 2 different names"):
        Skeleton(mbs, tree, names)


def test_names():
    mbs, tree = unassembled()
    mbs.Assemble()
    assert Skeleton(mbs, tree).coordinates == ("q0", "q1")
    assert Skeleton(mbs, tree, ["shoulder", "elbow"]).coordinates == ("shoulder", "elbow")
