"""Results and pictures of a skeleton of bodies and joints, one of which nobody tracks."""

import dataclasses

import exudyn as exu
import numpy as np
import pytest
from exudyn import graphics
from exudyn.utilities import (
    InertiaCuboid,
    MarkerBodyRigid,
    NodeRigidBody2D,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
    SetSolutionState,
)
from matplotlib.image import imread

import exudyn_muscles as em
from exudyn_muscles import view
from exudyn_muscles.cli.report import summary
from exudyn_muscles.errors import ParameterError
from exudyn_muscles.skeleton.system.shown import system_graphics, system_segments
from exudyn_muscles.view.colors import BONE, TENDON
from models import pendulum

VISUALIZATION = exu.ConfigurationType.Visualization
UPPER, LOWER = 0.4, 0.3
AUTOMATIC, OWN = tuple(graphics.color.defaultBody), (0.1, 0.9, 0.2, 1.0)


def build():
    """An upper body of which Exudyn makes a shape, a lower one with graphics, and two muscles."""
    mbs = exu.SystemContainer().AddSystem()
    ground, bodies, above = mbs.CreateGround(), [], 0.0
    box = graphics.Brick(size=[0.06, LOWER, 0.06], color=list(OWN))
    for name, length, own in (("upper", UPPER, []), ("lower", LOWER, [box])):
        bodies.append(
            mbs.CreateRigidBody(
                name=name, inertia=InertiaCuboid(1100.0, [0.06, length, 0.06]),
                referencePosition=[0.0, above - 0.5 * length, 0.0], gravity=[0.0, -9.81, 0.0],
                graphicsDataList=own,
            )
        )  # fmt: skip
        above -= length
    joints = [
        mbs.CreateRevoluteJoint(
            itemNumbers=pair, position=[0.0, y, 0.0], axis=[0, 0, 1], useGlobalFrame=True
        )
        for pair, y in (([ground, bodies[0]], 0.0), (bodies, -UPPER))
    ]
    heel = mbs.AddMarker(
        MarkerBodyRigid(bodyNumber=bodies[1], localPosition=[-0.03, 0.5 * LOWER, 0.0])
    )
    mbs.Assemble()
    front = [em.PathPoint([0.1, 0.05, 0.0]), em.PathPoint([0.05, 0.0, 0.0], link=bodies[0])]
    back = [em.PathPoint([-0.1, 0.05, 0.0]), em.PathPoint([0.0, 0.0, 0.0], link=heel)]
    sizes = ({"optimal_fiber_length": 0.15, "tendon_slack_length": x} for x in (0.11, 0.31))
    muscles = [
        em.Muscle(name, max_isometric_force=800.0, path=path, **size)
        for (name, path), size in zip((("front", front), ("back", back)), sizes, strict=True)
    ]
    return em.MusculoskeletalModel(mbs, {"hip": joints[0]}, muscles)


def motion():
    t = np.linspace(0.0, 0.2, 41)
    return em.Motion.from_samples(t, 0.1 * np.sin(5.0 * t)[:, None])


@pytest.fixture(scope="module")
def trajectory():
    return em.cosimulate(
        build(), motion(), settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=534.0)
    )


@pytest.fixture
def model():
    return build()


def drawn(model):
    """Colors and points of everything that Exudyn would draw now."""
    data = model.mbs.GetSystemContainer().renderer.GetGraphicsData(flatShapes=True)["triangles"]
    return np.array(data["colors"]).reshape(-1, 4), np.array(data["points"]).reshape(-1, 3)


def has_color(colors, rgba):
    return bool((np.abs(colors - np.array(rgba)) < 1e-5).all(axis=1).any())


def bodies(model, x):
    """Ends of the lower body at coordinates `x`, by Exudyn."""
    data, (_, lower) = (
        model.mbs.systemData,
        (model.mbs.GetObjectNumber(n) for n in ("upper", "lower")),
    )
    before = np.array(data.GetODE2Coordinates(configuration=VISUALIZATION))
    data.SetODE2Coordinates(x, configuration=VISUALIZATION)
    found = [
        model.mbs.GetObjectOutputBody(
            lower, exu.OutputVariableType.Position, [0.0, y, 0.0], VISUALIZATION
        )
        for y in (0.5 * LOWER, -0.5 * LOWER)
    ]
    data.SetODE2Coordinates(before, configuration=VISUALIZATION)
    return np.array(found)


def test_the_whole_system_is_recorded(model, trajectory):
    """With the body that nobody tracks, which swings, as the joint between the two allows."""
    x = trajectory.system_coordinates
    assert x.shape == (21, 14) and trajectory.system_names == model.skeleton.system_names
    assert trajectory.system_names[0].endswith("'upper': 0")
    assert trajectory.system_names[13].endswith("'lower': 6")
    for k in (0, 10, 20):
        angle, (knee, foot) = trajectory.coordinates[k, 0], bodies(model, x[k])
        at = UPPER * np.array([np.sin(angle), -np.cos(angle), 0.0])
        np.testing.assert_allclose(knee, at, atol=3.0 * trajectory.max_constraint_drift + 1e-12)
        assert np.linalg.norm(foot - knee) == pytest.approx(
            LOWER, abs=trajectory.max_constraint_drift
        )
    lags = bodies(model, x[20])
    assert lags[1, 0] - lags[0, 0] < -0.01


def test_the_drift_is_of_second_order(trajectory):
    drift = trajectory.constraint_drift
    assert drift[0] < 1e-12 and 0.0 < trajectory.max_constraint_drift < 2e-3
    assert trajectory.max_constraint_drift == drift.max()
    assert f"violation of constraints [m, rad, or 1]: {drift.max():.2g}" in summary("x", trajectory)
    fine = em.CosimulationSettings(scheme=em.Scheme.FULL, kp=534.0, step=0.005)
    finer = em.cosimulate(build(), motion(), settings=fine)
    assert finer.max_constraint_drift == pytest.approx(0.25 * drift.max(), rel=0.1)


def test_static_optimization_leaves_no_drift():
    with pytest.warns(em.FrozenBodiesWarning, match="1 coordinates"):
        result = em.static_optimization(build(), motion())
    assert result.max_constraint_drift < 1e-9


def test_it_is_stored_compared_and_tabulated(trajectory, tmp_path):
    trajectory.save(tmp_path / "x.npz")
    loaded = em.Trajectory.load(tmp_path / "x.npz")
    assert loaded.compare(trajectory) is None and loaded.system_names == trajectory.system_names
    for field in ("system_coordinates", "constraint_drift"):
        changed = dataclasses.replace(
            trajectory, **{field: getattr(trajectory, field) + np.linspace(0.0, 1e-5, 21).reshape(
                -1, *[1] * (getattr(trajectory, field).ndim - 1))}
        )  # fmt: skip
        assert loaded.compare(changed).quantity == field
    frame = trajectory.to_dataframe()
    np.testing.assert_array_equal(frame["constraint_drift"], trajectory.constraint_drift)
    column = f"system_coordinates/{trajectory.system_names[8]}"
    np.testing.assert_array_equal(frame[column], trajectory.system_coordinates[:, 8])


def test_of_a_tree_there_is_nothing_more():
    result = em.static_optimization(pendulum.build(), pendulum.motion().between(0.0, 0.03))
    assert result.system_names == () and result.system_coordinates.shape == (4, 0)
    assert (result.constraint_drift == 0.0).all() and "violation" not in summary("x", result)


def test_muscles_limbs_and_own_graphics(model, trajectory):
    """A body with no more than Exudyn's shape becomes a limb, and its joints are hidden."""
    before = drawn(model)
    assert has_color(before[0], AUTOMATIC) and has_color(before[0], OWN)
    with view.show_muscles(model):
        colors, _ = drawn(model)
        for seen in ((*view.UNKNOWN, 1.0), (*BONE, 1.0), OWN):
            assert has_color(colors, seen)
        assert not has_color(colors, AUTOMATIC)
    np.testing.assert_array_equal(drawn(model)[1], before[1])
    with view.show_muscles(model, sticks=False):
        colors, points = drawn(model)
    assert has_color(colors, AUTOMATIC) and not has_color(colors, (*BONE, 1.0))
    np.testing.assert_array_equal(points[: len(before[1])], before[1])


def test_results_are_undisturbed(model, trajectory):
    """By what is drawn meanwhile."""
    with view.show_muscles(model, trajectory):
        inside = em.cosimulate(
            model, motion(), settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=534.0)
        )
    assert np.array_equal(inside.system_coordinates, trajectory.system_coordinates)
    assert np.array_equal(inside.excitation_values, trajectory.excitation_values)


@pytest.mark.parametrize("row", [0, 20])
def test_drawing_follows_the_pose(model, trajectory, row):
    """Muscles on bodies and on markers."""
    model.mbs.systemData.SetODE2Coordinates(trajectory.system_coordinates[row])
    model.mbs.systemData.SetTime(trajectory.time[row])
    with view.show_muscles(model, trajectory):
        colors, points = drawn(model)
    for activation, end in zip(trajectory.activations[row], ends(model), strict=True):
        assert has_color(colors, view.activation_color(activation))
        tendons = points[(np.abs(colors - np.array((*TENDON, 1.0))) < 1e-5).all(axis=1)]
        assert np.linalg.norm(tendons - end, axis=1).min() < 1e-6


def ends(model):
    position, mbs = exu.OutputVariableType.Position, model.mbs
    upper, lower = (mbs.GetObjectNumber(name) for name in ("upper", "lower"))
    yield mbs.GetObjectOutputBody(upper, position, [0.05, 0.0, 0.0])
    yield mbs.GetObjectOutputBody(lower, position, [-0.03, 0.5 * LOWER, 0.0])


def test_solution_is_the_recorded_motion(model, trajectory):
    made, n = view.solution(trajectory, model), 14
    np.testing.assert_array_equal(made["data"][:, 1 : 1 + n], trajectory.system_coordinates)
    SetSolutionState(model.mbs, made, 15, VISUALIZATION)
    shown = model.mbs.systemData.GetODE2Coordinates(configuration=VISUALIZATION)
    np.testing.assert_array_equal(shown, trajectory.system_coordinates[15])


@pytest.mark.parametrize("sticks", [True, False])
def test_a_picture_holds_the_whole_system(model, trajectory, tmp_path, sticks):
    """Also graphics beyond all muscles and joints; what was current stays."""
    before = np.array(model.mbs.systemData.GetODE2Coordinates())
    file = tmp_path / "picture.png"
    view.render(model, trajectory, 0.1, file, size=(300, 240), sticks=sticks)
    image = imread(file)[..., :3]
    green = (image[..., 1] > image[..., 0] + 0.2) & (image[..., 1] > image[..., 2] + 0.2)
    blue = image[..., 2] > image[..., 0] + 0.3
    assert green.sum() > 500 and blue[:, :250].sum() > 100
    assert (image[-3:, :240] == 1.0).all()  # nothing is cut off
    np.testing.assert_array_equal(model.mbs.systemData.GetODE2Coordinates(), before)


def test_a_result_of_another_system_is_refused(model, trajectory):
    other = dataclasses.replace(trajectory, system_names=(), system_coordinates=np.empty((21, 0)))
    with pytest.raises(ParameterError, match="another model: its bodies' coordinates"):
        view.solution(other, model)


def test_a_center_of_mass_beside_the_origin():
    """A segment's inertia is about it."""
    mbs = exu.SystemContainer().AddSystem()
    cuboid = InertiaCuboid(1100.0, [0.1, 0.4, 0.2])
    body = mbs.CreateRigidBody(
        inertia=cuboid.Translated([0.0, -0.2, 0.1]), referencePosition=[1.0, 2.0, 3.0]
    )
    mbs.CreateRevoluteJoint(
        itemNumbers=[mbs.CreateGround(), body], position=[1.0, 2.0, 3.0], axis=[0, 0, 1],
        useGlobalFrame=True,
    )  # fmt: skip
    mbs.Assemble()
    (segment,), poses = system_segments(mbs)
    assert segment.number == int(body) and segment.mass == pytest.approx(cuboid.mass)
    np.testing.assert_allclose(segment.center, [0.0, -0.2, 0.1])
    np.testing.assert_allclose(segment.tensor, cuboid.inertiaTensor, atol=1e-12)
    np.testing.assert_allclose(segment.joints, np.zeros((1, 3)), atol=1e-12)
    np.testing.assert_allclose(poses()[0][:3, 3], [1.0, 2.0, 3.0])


def test_what_becomes_a_limb():
    """Planar bodies and mass points without graphics; a function that draws is graphics, too."""
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[0.0, -0.2, 0.0]))
    plane = mbs.AddObject(ObjectRigidBody2D(nodeNumber=node, mass=1.0, inertia=0.1))
    mass = mbs.CreateMassPoint(mass=1.0, referencePosition=[0.3, 0.0, 0.0])
    mbs.CreateRigidBody(
        inertia=InertiaCuboid(1100.0, [0.1] * 3), graphicsDataUserFunction=lambda mbs, k: []
    )
    markers = [
        mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=[0.0, y, 0.0]))
        for body, y in ((ground, 0.0), (plane, 0.2))
    ]
    joint = mbs.AddObject(ObjectJointRevolute2D(markerNumbers=markers))
    mbs.Assemble()
    own = system_graphics(mbs)
    assert own.limbs == (int(plane), int(mass))
    assert own.replaced == (int(plane), int(joint), int(mass))
