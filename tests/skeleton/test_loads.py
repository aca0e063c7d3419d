"""External forces over time: part of Q in Exudyn's own runs, in the plugin's and in the methods."""

import dataclasses
import itertools

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import HTtranslate, RigidBodyInertia, TreeLink
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import exudyn_muscles as em
from exudyn_muscles.skeleton.skeleton import Skeleton
from exudyn_muscles.skeleton.tree import tree_frames

from .. import leg
from ..differences import gradient
from .test_skeleton import System

BASE, LENGTH = np.array([0.1, 0.2, 0.0]), np.array([0.6, 0.0, 0.0])
MASS, MOMENT, CENTER, GRAVITY = 1.3, 0.2, 0.25, 9.81  # of each link; moment about its origin


def pendulum(links=2, forces=(), **initial):
    """An assembled system of revolute links with forces, and its tree."""
    mbs = exu.SystemContainer().AddSystem()
    inertia = RigidBodyInertia(
        mass=MASS,
        inertiaTensor=np.eye(3) * MOMENT,
        com=[CENTER, 0.0, 0.0],
        inertiaTensorAtCOM=False,
    )
    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=[
            TreeLink(
                jointType=exu.JointType.RevoluteZ,
                parent=k - 1,
                jointHT=HTtranslate(LENGTH if k else BASE),
                linkInertia=inertia,
            )
            for k in range(links)
        ],
        gravity=[0.0, -GRAVITY, 0.0],
        **initial,
    )
    for force in forces:
        em.add_external_force(mbs, tree, force)
    mbs.Assemble()
    return mbs, tree


def as_model(mbs, tree):
    muscles = [
        em.Muscle(
            name, max_isometric_force=4000.0, optimal_fiber_length=0.2, tendon_slack_length=0.3,
            path=[em.PathPoint([0.1, 0.2 + side, 0.0]), em.PathPoint([0.4, 0.0, 0.0], link=0)],
        )
        for name, side in (("up", 0.3), ("down", -0.3))
    ]  # fmt: skip
    return em.MusculoskeletalModel(mbs, tree, muscles)


def generalized_force(build, forces, states):
    """Q of forces at states (q, t), from the inverse dynamics with and without them."""
    plain, loaded = (Skeleton(*build(given)) for given in ((), forces))
    found = []
    with plain.opened(), loaded.opened():
        for q, t in states:
            (M, without), (M_loaded, within) = (
                each.dynamics_at(q, 0.3 * q, t)[:2] for each in (plain, loaded)
            )
            np.testing.assert_array_equal(M, M_loaded)
            np.testing.assert_array_equal(loaded.dynamics_ahead(q, 0.3 * q, t)[1], within)
            found.append(without - within)
    return np.array(found)


def record(rng, k=7):
    times = np.cumsum(rng.uniform(0.05, 0.2, k))
    force, point, torque = rng.normal(size=(3, k, 3)) * np.array([50.0, 0.5, 5.0])[:, None, None]
    return {"times": times, "force": force, "point": point, "torque": torque}


@pytest.mark.parametrize(
    ("link", "force_in", "point_in"), list(itertools.product((0, 1), (-1, 0, 1), (-1, 0, 1)))
)
def test_the_double_pendulums_Q(link, force_in, point_in):
    """Q_j = z . ((p - o_j) x f + tau) of the joints up to the link, in any frames."""
    rng = np.random.default_rng(5)
    data = record(rng)
    force = em.ExternalForce(
        "push", link, **data, force_expressed_in=force_in, point_expressed_in=point_in
    )
    states = [(rng.uniform(-2.0, 2.0, 2), k) for k in range(len(data["times"]))]
    found = generalized_force(
        lambda forces: pendulum(2, forces), [force], [(q, data["times"][k]) for q, k in states]
    )
    for (q, k), Q in zip(states, found, strict=True):
        R = [Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix() for angle in np.cumsum(q)]
        R.append(np.eye(3))  # of ground, which is -1
        o = [BASE, BASE + R[0] @ LENGTH, np.zeros(3)]
        f, tau = R[force_in] @ data["force"][k], R[force_in] @ data["torque"][k]
        p = o[point_in] + R[point_in] @ data["point"][k]
        expected = [
            (np.cross(p - o[j], f) + tau)[2] if j <= link else 0.0 for j in range(2)
        ]  # fmt: skip
        np.testing.assert_allclose(Q, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_Q_of_trees_of_all_joints(seed):
    """J^T of the point and of the link's rotation by differences of the kinematics."""
    rng = np.random.default_rng(seed)
    data = record(rng)
    link, force_in, point_in = 4, *rng.integers(-1, 5, 2)
    force = em.ExternalForce(
        "push", link, **data, force_expressed_in=int(force_in), point_expressed_in=int(point_in)
    )
    systems = [
        System(seed, extend=extend)
        for extend in (None, lambda s: em.add_external_force(s.mbs, s.number, force))
    ]
    tree = systems[0].skeleton.tree

    def orientation(x):
        return tree_frames(tree, x)[0][link]

    for k, t in enumerate(data["times"]):
        q, v = systems[0].state()
        (_, plain), (_, loaded) = (each.skeleton.dynamics_at(q, v, t)[:2] for each in systems)
        R, o, _ = tree_frames(tree, q)
        R, o = np.append(R, [np.eye(3)], 0), np.append(o, [np.zeros(3)], 0)  # ground is -1
        f, tau = R[force_in] @ data["force"][k], R[force_in] @ data["torque"][k]
        p = o[point_in] + R[point_in] @ data["point"][k]
        on_link = R[link].T @ (p - o[link])

        def point(x, r=on_link):
            return tree_frames(tree, x)[1][link] + orientation(x) @ r

        J = gradient(point, q, 1e-3)
        spin = np.einsum("abk,cb->ack", gradient(orientation, q, 1e-3), R[link])
        W = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        np.testing.assert_allclose(plain - loaded, J.T @ f + W.T @ tau, rtol=0, atol=1e-8)


# Between the samples, and outside.


def torques(times, values, at):
    """What a torque about z with these samples does at other times."""
    torque = np.zeros((len(times), 3))
    torque[:, 2] = values
    force = em.ExternalForce("twist", 0, times, torque=torque)
    states = [(np.zeros(1), t) for t in at]
    return generalized_force(lambda forces: pendulum(1, forces), [force], states)[:, 0]


def test_the_natural_spline_runs_through_the_samples():
    """The cubic B-spline is one: it has no curvature at its ends."""
    at = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.5, 4.0])
    expected = np.array([0.0, 1.0, 8.0, 23.0, 32.0, 23.0, 1.0, 0.0]) / 48.0
    samples = np.array([0.0, 1.0, 4.0, 1.0, 0.0]) / 6.0
    found = torques(np.arange(5.0), samples, at)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("k", [2, 3])
def test_a_few_samples_are_joined_by_lines(k):
    times, values = np.array([0.0, 1.0, 3.0])[:k], np.array([2.0, 5.0, -1.0])[:k]
    at = np.linspace(0.0, times[-1], 11)
    found = torques(times, values, at)
    np.testing.assert_allclose(found, np.interp(at, times, values), rtol=0, atol=1e-14)


def test_there_is_no_force_outside_of_the_record():
    """But there is at its ends, however they were added up."""
    times = np.array([0.1, 0.2, 0.3, 0.4])
    at = [0.0999, 0.1 - 1e-12, 0.1, 0.4, 0.4 + 1e-12, 0.4001, -1.0, 9.0]
    found = torques(times, [3.0, 4.0, 5.0, 6.0], at)
    expected = [0.0, 3.0, 3.0, 6.0, 6.0, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


# Runs.


def push(**changes):
    """On the last link of a double pendulum from 0 to 1 s, at a point that wanders in ground."""
    t = np.linspace(0.0, 1.0, 11)
    given = {
        "force": np.stack([20.0 * np.sin(5.0 * t), 30.0 * np.cos(3.0 * t), 0.0 * t], axis=1),
        "point": np.stack([0.5 + 0.3 * t, -0.2 * t, 0.1 + 0.0 * t], axis=1),
        "torque": np.stack([0.0 * t, 0.0 * t, 4.0 * t], axis=1),
    }
    return em.ExternalForce("push", 0, t, **given | changes)


def spline(x, t, h=0.1):
    """The natural spline through samples every h from its definition: slopes m with
    m_{k-1} + 4 m_k + m_{k+1} = 3 (x_{k+1} - x_{k-1}) / h, and 2 m_0 + m_1 = 3 (x_1 - x_0) / h."""
    k = len(x)
    A = 4.0 * np.eye(k) + np.eye(k, k=1) + np.eye(k, k=-1)
    A[0, 0] = A[-1, -1] = 2.0
    right = np.empty((k, 3))
    right[1:-1] = 3.0 * (x[2:] - x[:-2]) / h
    right[0], right[-1] = 3.0 * (x[1] - x[0]) / h, 3.0 * (x[-1] - x[-2]) / h
    m = np.linalg.solve(A, right)
    i = min(int(t / h), k - 2)
    s = t / h - i
    values = (1 + 2 * s) * (1 - s) ** 2 * x[i] + s * s * (3 - 2 * s) * x[i + 1]
    return values + h * s * (1 - s) ** 2 * m[i] - h * s * s * (1 - s) * m[i + 1]


def test_exudyns_own_run_is_that_of_the_equation():
    """By an explicit and by the implicit solver; without any muscle or plugin."""
    data = push()

    def rate(t, y):
        f, tau = (spline(x, t) for x in (data.force, data.torque))
        p = spline(data.point, t)
        M = np.cross(p - BASE, f) + tau
        return y[1], (M[2] - MASS * GRAVITY * CENTER * np.cos(y[0])) / MOMENT

    y = np.array([0.4, -1.0])
    for i in range(10):  # from sample to sample, between which all is smooth
        y = solve_ivp(rate, (0.1 * i, 0.1 * (i + 1)), y, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]

    def run(solver, steps):
        mbs, _ = pendulum(1, [data], initialCoordinates=[0.4], initialCoordinates_t=[-1.0])
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = steps, 1.0
        settings.timeIntegration.verboseMode = 0
        settings.solution.file.write = False
        mbs.SolveDynamic(settings, solverType=solver)
        state = mbs.systemData
        return np.r_[state.GetODE2Coordinates(), state.GetODE2Coordinates_t()] - y

    kind = exu.DynamicSolverType
    assert np.abs(run(kind.RK44, 1000)).max() < 1e-9
    errors = [np.abs(run(kind.TrapezoidalIndex2, steps)).max() for steps in (200, 400, 800)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert errors[-1] < 1e-4 and np.all(np.abs(orders - 2.0) < 0.05)


@pytest.mark.filterwarnings("ignore::exudyn_muscles.PathWarning")
def test_a_leg_with_dependent_coordinates_is_pushed():
    """At its toes by a constant force of ground, and at a fixed point by another."""
    start, force, at = (np.array([0.1, -0.6]), np.array([0.5, -2.0])), [30.0, -50.0], [0.2, -0.9]
    t = np.linspace(0.2, 0.8, 5)
    rows = np.ones((5, 1))
    pushes = [
        em.ExternalForce("toes", 5, t, rows * [*force, 0.0]),
        em.ExternalForce("foot", 4, t, rows * [*force, 0.0], rows * [*at, 0.0]),
    ]

    def extend(mbs, tree):
        for each in pushes:
            em.add_external_force(mbs, tree, each)

    def Q(z):
        total = np.zeros(2)
        for j, unit in enumerate(np.eye(2)):
            _, _, (_, _, toes, angle) = leg.bodies(z, unit, np.zeros(2))[1:]
            from_ankle = leg.turned(angle, leg.fixed(leg.ANKLE_TO_TOES))
            ankle = [x - y for x, y in zip(toes, from_ankle, strict=True)]
            lever = at - ankle[0]
            moment = lever[0] * force[1] - lever[1] * force[0]
            total[j] = (toes[1] + ankle[1]) @ force + angle[1] * moment
        return total

    model = leg.build([leg.idle()], extend=extend)
    plain = leg.build([leg.idle()])
    rng = np.random.default_rng(0)
    with model.skeleton.opened(), plain.skeleton.opened():
        for z in rng.uniform([-1.0, -1.5], [1.0, 0.0], (5, 2)):
            (_, without), (_, loaded) = (
                each.skeleton.dynamics_at(z, 0.5 * z, 0.4)[:2] for each in (plain, model)
            )
            np.testing.assert_allclose(without - loaded, Q(z), rtol=0, atol=1e-11)

    def rate(_, y):
        M, bias = leg.equations(y[:2], y[2:])
        return np.r_[y[2:], np.linalg.solve(M, Q(y[:2]) - bias)]

    end = solve_ivp(rate, (0.2, 0.6), np.r_[start], "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    ends = []
    for step in (0.002, 0.001):
        model.skeleton.set_initial_state(*start)
        excitations = em.Excitations(np.array([0.2, 0.6]), np.array([[0.5]]))
        result = em.forward_dynamics(model, excitations, settings=em.ForwardSettings(step=step))
        ends.append(np.r_[result.coordinates[-1], result.speeds[-1]])
    coarse, fine = np.subtract(ends, end)
    np.testing.assert_allclose(coarse / fine, 4.0, rtol=0, atol=0.005)
    np.testing.assert_allclose(fine + (fine - coarse) / 3.0, 0.0, rtol=0, atol=2e-6)


def held(start=0.2, end=0.8):
    """A motion of the single pendulum."""
    times = np.linspace(start, end, 4)
    return em.Motion.from_waypoints(times, np.array([[0.0], [0.2], [0.1], [0.05]]))


METHODS = {
    "static": em.static_optimization,
    "cmc": em.computed_muscle_control,
    "csf": em.cosimulate,
}


@pytest.mark.parametrize("name", METHODS)
def test_the_methods_know_the_force(name):
    """The muscles deliver what the motion needs beyond it, so that they track as well as without;
    the force stays in the mbs, and a second run gives the same bits."""
    method, motion = METHODS[name], held()
    mbs, tree = pendulum(1, [push()])
    loaded, plain = as_model(mbs, tree), as_model(*pendulum(1))
    first, without = method(loaded, motion), method(plain, motion)
    assert np.abs(first.torques_delivered - without.torques_delivered).max() > 5.0
    assert first.tracking_error_rms() <= 1.5 * without.tracking_error_rms() + 1e-12
    if name == "static":
        for k, t in enumerate(first.time):
            q, _, a = motion(t)
            f, p, tau = (spline(x, t) for x in (push().force, push().point, push().torque))
            Q = np.cross(p - BASE, f) + tau
            needed = MOMENT * a + MASS * GRAVITY * CENTER * np.cos(q) - Q[2]
            np.testing.assert_allclose(first.torques_delivered[k], needed, rtol=0, atol=1e-7)
    assert mbs.systemData.NumberOfLoads() == 2 and mbs.systemIsConsistent
    np.testing.assert_array_equal(method(loaded, motion).torques_delivered, first.torques_delivered)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize(("start", "end"), [(0.1, 0.5), (0.5, 1.3)])
def test_the_methods_stay_within_the_record(name, start, end):
    later = dataclasses.replace(push(), times=push().times + 0.2)
    model = as_model(*pendulum(1, [later]))
    u = em.Excitations(np.array([start, end]), np.array([[0.1, 0.1]]))
    message = r"external force 'push': its record spans \[0.2, 1.2\] s, the run \["
    with pytest.raises(em.ParameterError, match=message):
        METHODS[name](model, held(start, end))
    with pytest.raises(em.ParameterError, match=message):
        em.forward_dynamics(model, u)
    METHODS[name](model, held(0.2, 1.2))


def test_other_loads_are_left_alone():
    mbs, tree = pendulum(1)
    marker = mbs.AddMarker(
        exu.itemInterface.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=0)
    )
    for function in (0, lambda mbs, t, load: load):
        mbs.AddLoad(
            exu.itemInterface.LoadForceVector(
                markerNumber=marker, loadVector=[0.0, 5.0, 0.0], loadVectorUserFunction=function
            )
        )
    loads = em.add_external_force(mbs, tree, push())
    assert [mbs.GetLoad(load)["name"] for load in loads] == ["push: force", "push: torque"]
    mbs.Assemble()
    assert as_model(mbs, tree).coordinates == ("q0",)
    em.static_optimization(as_model(mbs, tree), held())


def test_only_the_loads_that_are_needed_are_made():
    kinds = []
    for changes in (
        {"torque": None},
        {"point": None, "torque": None},
        {"force": None, "point": None},
    ):
        mbs, _ = pendulum(1, [push(**changes)])
        numbers = range(mbs.systemData.NumberOfLoads())
        kinds.append([mbs.GetLoad(number)["loadType"] for number in numbers])
    assert kinds == [["ForceVector", "TorqueVector"], ["ForceVector"], ["TorqueVector"]]


# What users give.


def test_a_record_from_a_file(tmp_path):
    data = push()
    labels = [f"{what}{x}" for what in ("v", "p", "t_") for x in "xyz"]
    table = np.hstack([data.force, data.point, data.torque])
    file = tmp_path / "plate.mot"
    em.Storage("plate", ["other", *labels], data.times, np.insert(table, 0, 7.0, 1)).write(file)
    read = em.ExternalForce.from_file("plate", 0, file, force="v", point="p", torque="t_")
    for name in ("times", "force", "point", "torque"):
        np.testing.assert_array_equal(getattr(read, name), getattr(data, name))
    assert em.ExternalForce.from_file("plate", 0, file, torque="v").force is None
    with pytest.raises(em.StorageError, match=r"plate\.mot: 0 columns begin with 'w'"):
        em.ExternalForce.from_file("plate", 0, file, force="w")
    with pytest.raises(em.ParameterError, match=r"plate\.mot: external force 'p': needs a force"):
        em.ExternalForce.from_file("p", 0, file)


BAD = np.ones((11, 3))
BAD[4, 1] = np.nan


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"force": None, "torque": None, "point": None}, "needs a force or a torque"),
        ({"force": None}, "needs a force at its point"),
        ({"times": [0.0]}, r"times must be \(k,\) with k >= 2, got \(1,\)"),
        ({"times": np.zeros(11)}, "times must increase, 0 s is followed by 0 s"),
        ({"force": np.ones((3, 11))}, r"force must be \(11, 3\), got \(3, 11\)"),
        ({"torque": BAD}, "torque must be finite, row 4 is"),
        ({"point": "here"}, "point must be an array of numbers"),
        ({"link": -1}, "link is the number of a link .*from 0, got -1"),
        ({"link": 0.5}, "link is the number of a link .*, got 0.5"),
        ({"point_expressed_in": -2}, r"point_expressed_in is .*\(-1 is ground\), got -2"),
    ],
)
def test_bad_records(changes, message):
    with pytest.raises(em.ParameterError, match=f"external force 'push': {message}"):
        dataclasses.replace(push(), **changes)


def test_records_that_do_not_fit_the_tree():
    for name in ("link", "force_expressed_in", "point_expressed_in"):
        with pytest.raises(
            em.ParameterError, match=f"'push': {name} is on link 1, but the tree has links 0 to 0"
        ):
            pendulum(1, [dataclasses.replace(push(), **{name: 1})])
    mbs, tree = pendulum(1)
    with pytest.raises(em.ModelError, match="not an object of this mbs"):
        em.add_external_force(mbs, 77, push())
    with pytest.raises(em.ModelError, match="object of type Ground"):
        em.add_external_force(mbs, mbs.CreateGround(), push())
    em.add_external_force(mbs, tree, push())
    with pytest.raises(em.ModelError, match="not assembled"):
        as_model(mbs, tree)


def test_records_cannot_be_changed():
    force = push()
    with pytest.raises(ValueError, match="read-only"):
        force.force[0] = 1.0
