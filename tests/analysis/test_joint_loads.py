"""Loads of joints against OpenSim's JointReaction, Newton's laws, Exudyn's own outputs, and each
other: of trees, of bodies with joints, and within runs."""

from itertools import pairwise

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import (
    CoordinateSpringDamper,
    HTtranslate,
    LoadForceVector,
    MarkerBodyPosition,
    MarkerKinematicTreeRigid,
    MarkerNodeCoordinate,
    RigidBodyInertia,
    SpringDamper,
    TreeLink,
)

import exudyn_muscles as em
from exudyn_muscles import analysis
from exudyn_muscles.forces.actuators import actuator_names
from exudyn_muscles.joints import Recorded, model_joints
from exudyn_muscles.skeleton.hold import hold
from exudyn_muscles.skeleton.joints import JointFrame
from exudyn_muscles.skeleton.tree import tree_frames
from models import leg, pedalling, pendulum, planar_arm

from ..make_analyses import ROWS
from ..opensim import loop_models, passive_models
from ..own_models import FOLDER
from ..runs import KP, csf, plugin_run, settings, start_at
from ..skeleton.system import test_contact as standing
from ..skeleton.system.convert import TAIT_BRYAN, as_bodies
from ..skeleton.system.robots import RandomChain
from .opensims import NAMES, opensims


def loaded(tmp_path, text, **more):
    file = tmp_path / "model.osim"
    file.write_text(text)
    return em.opensim.load_model(file, **more)


def written(model, t, q, v, F, f, *, on_parent=False):
    """Names of all joints, and force, torque and center (k, joints, 9) in ground."""
    joints, none = model_joints(model), np.empty((len(t), 0))
    each = joints.along(Recorded(np.asarray(t), q, v, none, none, F, f))
    return joints.names, np.array(
        [there.loads.written(JointFrame.GROUND, on_parent) for there in each]
    )


def compared(names, numbers):
    """Pairs of the number of a joint here and there, by a coordinate of OpenSim's joint."""
    theirs = [each.split() for each in numbers["joint_coordinates"].tolist()]
    for k, name in enumerate(names):
        yield k, next(j for j, each in enumerate(theirs) if name.split("/")[0] in each)


@pytest.mark.parametrize("kind", ["", "_wrapping"])
@pytest.mark.parametrize("name", NAMES)
def test_loads_are_those_of_joint_reaction(name, kind, tmp_path):
    """OpenSim's tangent points on surfaces are 1e-6 to 3e-5 m off the shortest way, and where an
    ellipsoid shares a segment with a cylinder, more: the forces there point elsewhere by a
    hundredth. Without what wraps nothing is left of it."""
    model, numbers = opensims(name, tmp_path)
    at = [numbers["coordinate_names"].tolist().index(each) for each in model.coordinates]
    every = numbers["actuator_names"].tolist()
    muscles, others = (
        [every.index(each) for each in some]
        for some in (model.muscles.names, actuator_names(model.reserves))
    )
    forces = numbers["forces"].copy()
    wrapping = np.flatnonzero(numbers["wrapping"])
    if not kind:
        forces[:, wrapping] = 0.0
    close = 1e-6 if not (kind and wrapping.size) else 0.02
    states = numbers["time"], numbers["coordinates"][:, at], numbers["speeds"][:, at]
    for side in ("child", "parent"):
        names, found = written(
            model, *states, forces[:, muscles], forces[:, others], on_parent=side == "parent"
        )
        assert len(names) == len(set(numbers["joint_coordinates"]) - {""})
        expected = numbers[f"on_{side}{kind}"]
        for k, j in compared(names, numbers):
            for part in (slice(0, 3), slice(3, 6)):
                size = np.abs(expected[:, :, part]).max()
                np.testing.assert_allclose(
                    found[:, k, part], expected[:, j, part], rtol=0, atol=close * size
                )
            if side == "child":
                center = numbers["centers"][:, j]
                np.testing.assert_allclose(found[:, k, 6:], center, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", loop_models.CONSTRAINTS)
def test_what_closes_loops_bears_its_part(name, tmp_path):
    model, numbers = loaded(tmp_path, loop_models.model(name)), np.load(FOLDER / "loops.npz")
    every = list(loop_models.DEFAULTS)
    at = [every.index(each) for each in model.coordinates]
    q, u, F = (numbers[f"{name}_{key}"][:ROWS] for key in "quF")
    names, found = written(model, np.zeros(ROWS), q[:, at], u[:, at], F, np.empty((ROWS, 0)))
    expected = np.load(FOLDER / "joint_loads.npz")[f"loops_{name}"]
    assert names == ("b", "e", "g")
    if name in loop_models.AT_REST:  # where OpenSim's accelerations are of them
        assert not u[0].any()
        found, expected = found[:1], expected[:1]
    np.testing.assert_allclose(found[..., :6], expected, rtol=0, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("name", [each for each in passive_models.FORCES if each != "wrapped"])
def test_passive_forces_are_part_of_it(name, tmp_path):
    model, numbers = loaded(tmp_path, passive_models.model(name)), np.load(FOLDER / "passive.npz")
    at = [numbers["names"].tolist().index(each) for each in model.coordinates]
    F = np.full((ROWS, len(model.muscles)), 50.0)
    states = np.zeros(ROWS), numbers["q"][:ROWS, at], numbers["u"][:ROWS, at]
    _, found = written(model, *states, F, np.empty((ROWS, 0)))
    expected = np.load(FOLDER / "joint_loads.npz")[f"passive_{name}"]
    np.testing.assert_allclose(found[..., :6], expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def both_forms(source, step=0.01):
    """Model, result and loads of the same model as a tree and as bodies."""
    run = em.CosimulationSettings(kp=KP, scheme=em.Scheme.FULL, step=step)
    found = []
    for model in (source.build(), as_bodies(source.build(), TAIT_BRYAN)):
        result = em.cosimulate(model, source.motion(), settings=run)
        found.append((model, result, analysis.joint_loads(model, result)))
    return found


@pytest.fixture(scope="module", params=[pendulum, planar_arm])
def forms(request):
    return both_forms(request.param)


def test_a_tree_and_bodies_bear_the_same_but_for_the_discretisation():
    """Which is of second order."""
    apart = []
    for step in (0.01, 0.005):
        (_, _, of_tree), (_, _, of_bodies) = both_forms(planar_arm, step)
        assert of_tree.columns == of_bodies.columns
        difference = np.abs(of_tree["force"] - of_bodies["force"]).max()
        apart.append(difference / np.abs(of_tree["force"]).max())
    assert apart[0] < 2e-4
    assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("seed", range(6))
def test_random_chains_bear_the_same_in_equal_states(seed):
    """On joints of all kinds in space, with reserves; constraints are met at the start."""
    chain = RandomChain(seed)
    tree, bodies, found = chain.tree(), chain.bodies(), []
    rng, n = np.random.default_rng(seed), chain.size
    F, f = rng.uniform(0.0, 200.0, (1, 2 * n)), rng.uniform(-20.0, 20.0, (1, n))
    for model in (tree, bodies):
        model.skeleton.set_initial_state(chain.q, chain.v)
        x, x_t = (each[None] for each in model.skeleton.initial_arrays())
        states = Recorded(np.zeros(1), chain.q[None], chain.v[None], x, x_t, F, f)
        (there,) = model_joints(model, chain.names).along(states)
        found.append((there.loads.force, there.loads.torque, there.acceleration))
    for ours, theirs in zip(*found, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-7 * np.abs(theirs).max())


def test_what_stands_on_the_ground_bears_its_weight():
    """Contact is part of it: a torso is between its base and two hips, and feet hold it up."""
    model = standing.model(driven=True)
    reserves = [em.Reserve(name, 100.0) for name in model.coordinates]
    model = model.replace(muscles=[], reserves=reserves)
    run = em.CosimulationSettings(scheme=em.Scheme.FULL)
    result = em.cosimulate(model, standing.squat(True).between(0.0, 0.4), settings=run)
    assert analysis.joint_names(model)[1:] == ("left hip", "left knee", "right hip", "right knee")
    table = analysis.joint_loads(model, result)
    mass, gravity = 30.0, np.array([0.0, -9.81, 0.0])
    hips = table["force/left hip"] + table["force/right hip"]
    place = result.system_coordinates[:, :3]  # of the torso's center
    change = mass * (place[2:] - 2.0 * place[1:-1] + place[:-2]) / run.step**2
    acting = (table["force/base"] - hips + mass * gravity)[1:-1]
    np.testing.assert_allclose(acting, change, rtol=0, atol=0.01 * mass * 9.81)
    # Without the ground hips would pull at the torso, which has legs of 22 kg below it.
    assert hips[:, 1].max() < -0.7 * mass * 9.81
    knees = table["force/left knee/y"] + table["force/right knee/y"]
    assert (knees[1:] > -1.3 * standing.WEIGHT).all() and knees.max() < -0.5 * standing.WEIGHT


def test_reserves_bear_on_joints_alike():
    """A torque on the coordinate between two bodies is part of what their joint bears."""
    found = []
    for make in (lambda model: model, as_bodies):
        model = planar_arm.build()
        reserves = [em.Reserve("shoulder", 1.0), em.Reserve("elbow", 1.0)]
        model = make(model.replace(muscles=[], reserves=reserves))
        result = em.static_optimization(model, planar_arm.motion())
        found.append(analysis.joint_loads(model, result)["torque"])
        np.testing.assert_allclose(
            found[-1].reshape(result.time.size, 2, 3)[..., 2], result.torques_delivered,
            rtol=0, atol=1e-6,
        )  # fmt: skip
    np.testing.assert_allclose(*found, rtol=0, atol=1e-5)


def test_bodies_bear_what_exudyn_says():
    """Its joints' outputs, where the multipliers are those of a run."""
    model, motion = pedalling.build(), pedalling.motion()
    start_at(model, motion)
    mbs, plugin = model.mbs, csf(model, motion)
    knee = next(
        k for k in range(mbs.systemData.NumberOfObjects()) if mbs.GetObject(k)["name"] == "knee"
    )
    sensor = em.joint_load_sensor(plugin, "knee", expressed_in=JointFrame.PARENT)
    own = mbs.AddSensor(
        {
            "sensorType": "Object", "name": "own", "objectNumber": knee, "storeInternal": True,
            "outputVariableType": exu.OutputVariableType.ForceLocal, "writeToFile": False,
        }
    )  # fmt: skip
    mbs.Assemble()
    start_at(model, motion)
    s = settings(0.01, 0.2)
    s.solution.sensors.writePeriod = 0.01
    result = plugin_run(model, plugin, s)
    force = mbs.GetSensorStoredData(own)[1:, 1:4]
    found = mbs.GetSensorStoredData(sensor)[1:, 1:]
    assert np.abs(force).max() > 50.0
    lengths = [np.linalg.norm(each, axis=1) for each in (force, found[:, :3])]
    np.testing.assert_allclose(*lengths, rtol=0, atol=1e-5 * np.abs(force).max())
    table = analysis.joint_loads(model, result, ["knee"], expressed_in=JointFrame.PARENT)
    np.testing.assert_allclose(found[:, :3], table["force/knee"][1:], rtol=0, atol=1e-6)


@pytest.mark.parametrize("source", [leg, pedalling])
def test_a_sensor_shows_it_as_the_run_goes_on(source):
    model, motion = source.build(), source.motion()
    joint = analysis.joint_names(model)[1]
    start_at(model, motion)
    plugin = csf(model, motion)
    sensor = em.joint_load_sensor(plugin, joint, on_parent=True)
    assert model.mbs.GetSensor(sensor)["name"] == f"load of {joint}"
    s = settings(0.01, 0.1)
    s.solution.sensors.writePeriod = 0.01
    result = plugin_run(model, plugin, s)
    stored = model.mbs.GetSensorStoredData(sensor)
    table = analysis.joint_loads(model, result, [joint], on_parent=True)
    expected = np.hstack([table[f"force/{joint}"], table[f"torque/{joint}"]])
    np.testing.assert_array_equal(stored[:, 0], result.time)
    np.testing.assert_allclose(stored[:, 1:], expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_with_the_weight_they_make_the_momentum_change():
    """Of everything behind the shoulder: its load, muscles that begin in ground, and gravity."""
    model, motion = planar_arm.build(), planar_arm.motion()
    result = em.static_optimization(model, motion)
    outside = analysis.joint_loads(model, result, ["shoulder"])["force/shoulder"].copy()
    for i, muscle in enumerate(model.muscles):
        for k, q in enumerate(result.coordinates):
            outside[k] += result.tendon_forces[k, i] * _outward(model, muscle, q)
    item = model.mbs.GetObject(model.skeleton.object)
    outside += np.sum(item["linkMasses"]) * np.array(item["gravity"])
    e = 1e-3  # s, for differences
    before, now, after = (_moment(model, motion(result.time[1:-1] + s)[0]) for s in (-e, 0.0, e))
    change = (after - 2.0 * now + before) / e**2
    assert np.abs(change).max() > 3.0
    np.testing.assert_allclose(outside[1:-1], change, rtol=0, atol=1e-4)


def _frames(model, q):
    return tree_frames(model.skeleton.tree, q)


def _outward(model, muscle, q):
    """The pull of a muscle's ends on links, a unit of force, of those whose other end is ground."""
    R, p, _ = _frames(model, q)
    points = [
        np.array(point.position) if point.link < 0
        else p[point.link] + R[point.link] @ np.array(point.position)
        for point in muscle.path
    ]  # fmt: skip
    total = np.zeros(3)
    for (a, here), (b, there) in pairwise(zip(muscle.path, points, strict=True)):
        e = (there - here) / np.linalg.norm(there - here)
        total += (a.link >= 0) * e - (b.link >= 0) * e
    return total


def _moment(model, places):
    """Mass times place of the center (k, 3) at coordinates (k, n)."""
    item = model.mbs.GetObject(model.skeleton.object)
    masses, centers = np.array(item["linkMasses"]), item["linkCOMs"].GetPythonObject()
    found = []
    for q in places:
        R, p, _ = _frames(model, q)
        found.append(sum(m * (p[k] + R[k] @ centers[k]) for k, m in enumerate(masses)))
    return np.array(found)


def test_a_joint_bears_no_torque_about_an_axis_that_nothing_drives(forms):
    """Its power on the coordinate is that of the reserves there, of which there are none."""
    for model, _, table in forms:
        for name in model.coordinates:
            torque = np.abs(table[f"torque/{name}/z"]).max()
            assert torque <= 1e-8 * np.abs(table["force"]).max()


def test_an_ideal_joint_does_no_work():
    """A knee slides as it bends: force and torque on what follows the angle are in balance. Of
    muscles whose points do not move on their links, which the knee's angle would push along."""
    model, motion = leg.build(), leg.motion()
    fixed = [
        muscle
        for muscle in model.muscles
        if not any(isinstance(point, em.MovingPathPoint) for point in muscle.path)
    ]
    model, t = model.replace(muscles=fixed), np.linspace(0.1, 0.9, 20)
    q, v, _ = motion(t)
    F, none = np.full((t.size, len(fixed)), 100.0), np.empty((t.size, 0))
    states = Recorded(t, q, v, none, none, F, none)
    each = [there.loads for there in model_joints(model, ["knee"]).along(states)]
    load = np.array([one.written(JointFrame.PARENT, on_parent=False)[0] for one in each])
    angle, speed = (x[:, model.coordinates.index("knee")] for x in (q, v))
    slides = [each.function.derivative(angle) * speed for each in model.dependent_coordinates]
    of_force = load[:, 0] * slides[0] + load[:, 1] * slides[1]
    assert np.abs(of_force).max() > 0.5
    np.testing.assert_allclose(of_force, -load[:, 5] * speed, rtol=0, atol=1e-9)


def test_frames_and_sides(forms):
    _, result, table = forms[0]
    model, name = forms[0][0], analysis.joint_names(forms[0][0])[-1]
    child, parent = (
        analysis.joint_loads(model, result, {"it": name}, expressed_in=frame)
        for frame in (JointFrame.CHILD, JointFrame.PARENT)
    )
    R = np.array([_frames(model, q)[0][-1] for q in result.coordinates])
    turned = np.einsum("kij,kj->ki", R, child["force/it"])
    np.testing.assert_allclose(turned, table[f"force/{name}"], rtol=0, atol=1e-9)
    sizes = [np.linalg.norm(each["force/it"], axis=1) for each in (child, parent)]
    np.testing.assert_allclose(*sizes, rtol=1e-12)
    other = analysis.joint_loads(model, result, {"it": name}, on_parent=True)
    np.testing.assert_allclose(other["force/it"], -table[f"force/{name}"], rtol=0, atol=1e-12)
    assert other.units[:3] == ("N",) * 3 and other.units[-1] == "m"


def test_a_massless_link_is_asked_for_by_its_coordinate():
    """The talus: its ankle bears the same force as the joint behind it, about its own center."""
    model = leg.build()
    result = em.static_optimization(model, leg.motion())
    table = analysis.joint_loads(model, result, ["ankle", "subtalar"])
    assert "ankle" not in analysis.joint_names(model)
    force, ankle = table["force/ankle"], table["center/ankle"]
    way = table["center/subtalar"] - ankle
    np.testing.assert_allclose(force, table["force/subtalar"], rtol=0, atol=1e-9)
    torque = table["torque/subtalar"] + np.cross(way, force)
    np.testing.assert_allclose(torque, table["torque/ankle"], rtol=0, atol=1e-9)
    assert np.linalg.norm(way, axis=1).min() > 0.05


def beside(mbs, tree):
    mbs.CreateMassPoint(mass=1.0, gravity=[0.0, -1.0, 0.0])


def sprung(mbs, tree):
    """A user's own loads and springs on a link of a tree."""
    ground = mbs.CreateGround()
    there = mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground, localPosition=[0.3, 0.1, 0.2]))
    here = mbs.AddMarker(
        MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=0, localPosition=[0.1, -0.2, 0.05])
    )
    mbs.AddObject(
        SpringDamper(
            markerNumbers=[there, here], stiffness=300.0, referenceLength=0.1,
            springForceUserFunction=lambda mbs, t, item, x, x_t, k, d, f: k * x,
        )
    )  # fmt: skip
    mbs.AddLoad(LoadForceVector(markerNumber=here, loadVector=[3.0, -4.0, 5.0]))
    none = mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground))
    angle = mbs.AddMarker(
        MarkerNodeCoordinate(nodeNumber=mbs.GetObject(tree)["nodeNumber"], coordinate=0)
    )
    fixed = mbs.AddNode({"nodeType": "PointGround", "name": "fixed"})
    still = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0))
    mbs.AddObject(CoordinateSpringDamper(markerNumbers=[still, angle], stiffness=7.0))
    return none


def swing(extend, **more):
    """A hinge with a body, and what else acts."""
    mbs = exu.SystemContainer().AddSystem()
    link = TreeLink(
        jointType=exu.JointType.RevoluteZ, parent=-1, jointHT=HTtranslate([0.1, 0.2, 0.3]),
        linkInertia=RigidBodyInertia(
            mass=2.0, inertiaTensor=np.diag([0.1, 0.2, 0.3]), com=[0.0, -0.4, 0.1],
            inertiaTensorAtCOM=True,
        ),
    )  # fmt: skip
    tree = mbs.CreateKinematicTree(listOfTreeLinks=[link], gravity=[0.0, -9.81, 0.0], **more)
    extend(mbs, tree)
    mbs.Assemble()
    return em.MusculoskeletalModel(mbs, tree, [], coordinates=["swing"])


def test_a_users_own_forces_are_part_of_it():
    """By hand: a body with a load, a spring, a torque and a torsional spring on its coordinate, and
    gravity."""
    model = swing(sprung, jointForceVector=[2.0])
    q, v = np.array([[0.4]]), np.array([[1.3]])
    none = np.empty((1, 0))
    _, found = written(model, [0.0], q, v, none, none)
    force, torque, o = found[0, 0, :3], found[0, 0, 3:6], np.array([0.1, 0.2, 0.3])
    c, s = np.cos(0.4), np.sin(0.4)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    center, point = R @ [0.0, -0.4, 0.1], R @ [0.1, -0.2, 0.05]
    way = np.array([0.3, 0.1, 0.2]) - (o + point)
    length = np.linalg.norm(way)
    acting = np.array([3.0, -4.0, 5.0]) + 300.0 * (length - 0.1) * way / length
    weight = np.array([0.0, -9.81 * 2.0, 0.0])
    drive = (np.cross(point, acting) + np.cross(center, weight))[2] + 2.0 - 7.0 * 0.4
    alpha = drive / (0.3 + 2.0 * 0.4**2)
    z = np.array([0.0, 0.0, 1.0])
    a = alpha * np.cross(z, center) + 1.3**2 * np.cross(z, np.cross(z, center))
    np.testing.assert_allclose(force, 2.0 * a - acting - weight, rtol=0, atol=1e-10)
    spin = 0.3 * alpha * z + 2.0 * np.cross(center, a)
    expected = spin - np.cross(point, acting) - np.cross(center, weight)
    np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-10)
    np.testing.assert_allclose(torque[2], 2.0 - 7.0 * 0.4, rtol=0, atol=1e-10)


def test_a_cable_bears_as_exudyns_spring_does():
    """An ideal tension along a path, and the same force between the same points."""
    here, there = [0.1, -0.2, 0.05], [0.3, 0.1, 0.2]

    def tied(mbs, tree):
        ground = mbs.AddMarker(
            MarkerBodyPosition(bodyNumber=mbs.CreateGround(), localPosition=there)
        )
        link = mbs.AddMarker(
            MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=0, localPosition=here)
        )
        mbs.AddObject(
            SpringDamper(
                markerNumbers=[ground, link], referenceLength=1.0, stiffness=0.0, force=30.0
            )
        )

    path = [em.PathPoint(there), em.PathPoint(here, link=0)]
    cable = em.PathActuator("cable", path=path, optimal_force=1.0)
    found = []
    for model, f in (
        (swing(tied), np.empty((1, 0))),
        (swing(lambda mbs, tree: None).replace(reserves=[cable]), np.array([[30.0]])),
    ):
        at = [0.0], np.array([[0.4]]), np.array([[1.3]]), np.empty((1, 0))
        found.append(written(model, *at, f)[1])
    assert np.abs(found[0]).max() > 20.0
    np.testing.assert_allclose(*found, rtol=0, atol=1e-10)


def test_forces_of_user_functions_are_missed():
    """What PreStep sets in a run nobody knows after it."""

    def pushed(mbs, tree):
        here = mbs.AddMarker(
            MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=0, localPosition=[0, -0.3, 0])
        )
        load = mbs.AddLoad(LoadForceVector(markerNumber=here, loadVector=[0.0, 0.0, 0.0]))

        def push(mbs, t):
            mbs.SetLoadParameter(load, "loadVector", [20.0 * np.sin(9.0 * t), 0.0, 0.0])
            return True

        mbs.SetPreStepUserFunction(push)

    model = swing(pushed).replace(reserves=[em.Reserve("swing", 10.0)])
    motion = em.Motion.from_waypoints([0.0, 0.5], [[0.0], [0.3]])
    result = em.static_optimization(model, motion)
    with pytest.warns(em.UnknownForcesWarning, match="more on 'swing' are needed"):
        analysis.joint_loads(model, result)


def test_what_cannot_be_told_is_refused():
    model = planar_arm.build()
    result = em.static_optimization(model, planar_arm.motion())
    with pytest.raises(em.ParameterError, match="no joint 'wrist'; the joints are shoulder, elbow"):
        analysis.joint_loads(model, result, ["wrist"])
    with pytest.raises(em.ParameterError, match="joints is a sequence of names or a mapping"):
        analysis.joint_loads(model, result, "elbow")
    with pytest.raises(em.ParameterError, match="the trajectory has the coordinates"):
        analysis.joint_loads(pendulum.build(), result)
    with pytest.raises(em.ParameterError, match="there is none, or none was named"):
        analysis.joint_loads(model, result, [])
    for frame in ("ground", None):
        with pytest.raises(em.ParameterError, match=f"expressed_in = {frame!r} is not one of"):
            analysis.joint_loads(model, result, expressed_in=frame)
    with pytest.raises(em.ParameterError, match="expressed_in = 'child' is not one of"):
        em.joint_load_sensor(csf(model, planar_arm.motion()), "elbow", expressed_in="child")
    with hold(model.mbs), pytest.raises(em.ModelError, match="another run is attached"):
        analysis.joint_loads(model, result)
    with pytest.raises(em.ModelError, match="bodies beside the kinematic tree"):
        model_joints(swing(beside))
