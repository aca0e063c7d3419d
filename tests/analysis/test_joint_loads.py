"""Loads of joints against OpenSim's JointReaction, Newton's laws, Exudyn's own outputs, and each
other: of trees, of bodies with joints, and within runs."""

from itertools import pairwise

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import HTtranslate, RigidBodyInertia, TreeLink

import exudyn_muscles as em
from exudyn_muscles import analysis
from exudyn_muscles.forces.actuators import actuator_names
from exudyn_muscles.joints import Recorded, model_joints
from exudyn_muscles.skeleton.joints import JointFrame
from exudyn_muscles.skeleton.tree import tree_frames
from models import leg, pedalling, pendulum, planar_arm

from ..make_analyses import ROWS
from ..opensim import loop_models, passive_models
from ..own_models import FOLDER
from ..runs import KP, csf, plugin_run, settings, start_at
from ..skeleton.system.convert import TAIT_BRYAN, as_bodies
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
        [loads.written(JointFrame.GROUND, on_parent) for _, loads in each]
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


@pytest.fixture(scope="module", params=[pendulum, planar_arm])
def forms(request):
    """The same model as a tree and as bodies, and the loads of its joints."""
    source = request.param
    run = em.CosimulationSettings(kp=KP, scheme=em.Scheme.FULL)
    found = []
    for model in (source.build(), as_bodies(source.build(), TAIT_BRYAN)):
        result = em.cosimulate(model, source.motion(), settings=run)
        found.append((model, result, analysis.joint_loads(model, result)))
    return found


def test_a_tree_and_bodies_bear_the_same(forms):
    """But for the discretisation of their runs, which lets the coordinates differ as well."""
    (_, result, of_tree), (_, other, of_bodies) = forms
    assert of_tree.columns == of_bodies.columns
    apart = np.abs(result.tendon_forces - other.tendon_forces).max()
    apart /= result.tendon_forces.max()
    for quantity in ("force", "torque"):
        size = np.abs(of_tree[quantity]).max()
        difference = np.abs(of_tree[quantity] - of_bodies[quantity]).max()
        assert difference <= (10.0 * apart + 1e-6) * size + 1e-9


def test_states_of_bodies_bear_exactly_what_a_tree_does(forms):
    """At the same coordinates and forces there is no discretisation."""
    (tree, _, _), (bodies, result, table) = forms
    f = np.empty((result.time.size, 0))
    _, found = written(
        tree, result.time, result.coordinates, result.speeds, result.tendon_forces, f
    )
    for k, quantity in enumerate(("force", "torque")):
        ours, size = table[quantity], np.abs(table[quantity]).max() + 1e-6
        of_tree = found[..., 3 * k : 3 * k + 3].reshape(ours.shape)
        np.testing.assert_allclose(ours, of_tree, rtol=0, atol=1e-4 * size)


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
    from exudyn.utilities import (
        CoordinateSpringDamper,
        LoadForceVector,
        MarkerBodyPosition,
        MarkerKinematicTreeRigid,
        MarkerNodeCoordinate,
        SpringDamper,
    )

    ground = mbs.CreateGround()
    there = mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground, localPosition=[0.3, 0.1, 0.2]))
    here = mbs.AddMarker(
        MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=0, localPosition=[0.1, -0.2, 0.05])
    )
    mbs.AddObject(SpringDamper(markerNumbers=[there, here], stiffness=300.0, referenceLength=0.1))
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
    """By hand: a body with a load, a spring, a torsional spring on its coordinate, and gravity."""
    model = swing(sprung)
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
    drive = (np.cross(point, acting) + np.cross(center, weight))[2] - 7.0 * 0.4
    alpha = drive / (0.3 + 2.0 * 0.4**2)
    z = np.array([0.0, 0.0, 1.0])
    a = alpha * np.cross(z, center) + 1.3**2 * np.cross(z, np.cross(z, center))
    np.testing.assert_allclose(force, 2.0 * a - acting - weight, rtol=0, atol=1e-10)
    spin = 0.3 * alpha * z + 2.0 * np.cross(center, a)
    expected = spin - np.cross(point, acting) - np.cross(center, weight)
    np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-10)
    np.testing.assert_allclose(torque[2], -7.0 * 0.4, rtol=0, atol=1e-10)


def test_what_cannot_be_told_is_refused():
    model = planar_arm.build()
    result = em.static_optimization(model, planar_arm.motion())
    with pytest.raises(em.ParameterError, match="no joint 'wrist'; the joints are shoulder, elbow"):
        analysis.joint_loads(model, result, ["wrist"])
    with pytest.raises(em.ParameterError, match="joints is a sequence of names or a mapping"):
        analysis.joint_loads(model, result, "elbow")
    with pytest.raises(em.ParameterError, match="the trajectory has the coordinates"):
        analysis.joint_loads(pendulum.build(), result)
    with pytest.raises(em.ModelError, match="bodies beside the kinematic tree"):
        model_joints(swing(beside))
