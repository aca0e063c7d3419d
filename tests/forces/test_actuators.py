"""Ideal actuators: what they are on the coordinates."""

import dataclasses
import re

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import (
    LoadForceVector,
    LoadTorqueVector,
    MarkerKinematicTreeRigid,
    SensorMarker,
)

import exudyn_muscles as em
from exudyn_muscles.forces.actuators import actuator_names

from .. import leg
from ..path.trees import add_tree, random_links
from ..skeleton.system.joints import prismatic

VECTOR, POINT = np.array([2.0, -1.0, 2.0]) / 3.0, np.array([0.1, -0.2, 0.05])
SIZE = 7.0


def tree_of(seed, n=5):
    mbs = exu.SystemContainer().AddSystem()
    rng = np.random.default_rng(seed)
    tree = add_tree(mbs, rng, random_links(rng, n))
    return mbs, tree, (rng.uniform(-1.0, 1.0, n), rng.uniform(-1.0, 1.0, n))


def muscle():
    size = {"max_isometric_force": 1.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.1}
    path = [em.PathPoint([0.0, 0.0, 0.0]), em.PathPoint([0.2, 0.0, 0.0], link=1)]
    return em.Muscle("unit", **size, path=path)


def bias(mbs, tree, state, **more):
    """H - Q (n,) of the system as it is."""
    mbs.Assemble()
    model = em.MusculoskeletalModel(mbs, tree, [muscle()], **more)
    with model.skeleton.opened():
        return model, model.skeleton.dynamics_at(*state, 0.0)[1]


def frame(seed, link):
    """Rotation and position of a link in Exudyn at the state of this seed."""
    mbs, tree, (q, v) = tree_of(seed)
    marker = mbs.AddMarker(exu_marker(tree, link))
    sensors = [
        mbs.AddSensor(SensorMarker(markerNumber=marker, outputVariableType=kind, writeToFile=False))
        for kind in (exu.OutputVariableType.RotationMatrix, exu.OutputVariableType.Position)
    ]
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates(q)
    rotation, position = (mbs.GetSensorValues(sensor) for sensor in sensors)
    return np.reshape(rotation, (3, 3)), np.array(position)


def exu_marker(tree, link, at=(0.0, 0.0, 0.0)):
    return MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link, localPosition=list(at))


def add_load(mbs, tree, kind, link, vector, at=(0.0, 0.0, 0.0), fixed=False):
    """A load of Exudyn's own on a link."""
    marker = mbs.AddMarker(exu_marker(tree, link, at))
    mbs.AddLoad(kind(markerNumber=marker, loadVector=list(SIZE * vector), bodyFixed=fixed))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("point_is_global", [False, True])
@pytest.mark.parametrize("force_is_global", [False, True])
def test_point_actuator_is_exudyns_load(seed, point_is_global, force_is_global):
    R, p = frame(seed, 4)
    local = R.T @ (POINT - p) if point_is_global else POINT
    mbs, tree, state = tree_of(seed)
    actuator = em.PointActuator(
        "FX", link=4, point=POINT, direction=3.0 * VECTOR, optimal_force=2.0,
        point_is_global=point_is_global, force_is_global=force_is_global,
    )  # fmt: skip
    model, without = bias(mbs, tree, state, reserves=[actuator])
    mbs, tree, _ = tree_of(seed)
    add_load(mbs, tree, LoadForceVector, 4, VECTOR, local, fixed=not force_is_global)
    _, loaded = bias(mbs, tree, state)
    torque = model.columns(state[0])[:, 0] * SIZE
    assert np.abs(torque).max() > 0.5
    np.testing.assert_allclose(torque, without - loaded, atol=1e-10)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("against", [-1, 3])
@pytest.mark.parametrize("torque_is_global", [False, True])
def test_torque_actuator_is_exudyns_load_and_its_opposite(seed, against, torque_is_global):
    R, _ = frame(seed, 4)
    axis = VECTOR if torque_is_global else R @ VECTOR
    mbs, tree, state = tree_of(seed)
    actuator = em.TorqueActuator(
        "MZ", link=4, axis=VECTOR, optimal_force=2.0, against=against,
        torque_is_global=torque_is_global,
    )  # fmt: skip
    model, without = bias(mbs, tree, state, reserves=[em.Reserve("q2", 1.0), actuator])
    mbs, tree, _ = tree_of(seed)
    add_load(mbs, tree, LoadTorqueVector, 4, axis)
    if against >= 0:
        add_load(mbs, tree, LoadTorqueVector, against, -axis)
    _, loaded = bias(mbs, tree, state)
    columns = model.columns(state[0])
    np.testing.assert_array_equal(columns[:, 0], [0.0, 0.0, 1.0, 0.0, 0.0])
    np.testing.assert_allclose(columns[:, 1] * SIZE, without - loaded, atol=1e-10)


def test_a_reserve_on_a_dependent_coordinate():
    """A force along the sliding of a leg's knee is one on the knee, and virtual work."""
    built = leg.build()
    name = next(each.coordinate for each in leg.dependent_coordinates())
    model = em.MusculoskeletalModel(
        built.mbs, built.skeleton.object, built.muscles, coordinates=leg.NAMES,
        dependent_coordinates=leg.dependent_coordinates(), reserves=[em.Reserve(name, 1.0)],
    )  # fmt: skip
    k = model.skeleton.tree_coordinates.index(name)
    q, d = np.array([0.3, -0.8]), 1e-5
    column = model.geometry(q, np.zeros(2)).columns[:, 0]
    for j in range(2):
        step = d * np.eye(2)[j]
        moved = [model.state_of_tree(x)[0][k] for x in (q + step, q - step)]
        assert column[j] == pytest.approx((moved[0] - moved[1]) / (2 * d), abs=1e-9)
    assert np.abs(column).max() > 1e-4


def test_dependent_coordinates_hand_the_force_on():
    """A force on the foot of a leg whose knee slides is one on hip and knee."""
    found = []
    for loaded in (False, True):

        def extend(mbs, tree, loaded=loaded):
            if loaded:
                add_load(mbs, tree, LoadForceVector, 4, VECTOR, POINT)

        built = leg.build(extend=extend)
        model = em.MusculoskeletalModel(
            built.mbs, built.skeleton.object, built.muscles, coordinates=leg.NAMES,
            dependent_coordinates=leg.dependent_coordinates(),
            reserves=[
                em.PointActuator(
                    "FX", link=4, point=POINT, direction=VECTOR, force_is_global=True,
                    optimal_force=1.0,
                )
            ],
        )  # fmt: skip
        with model.skeleton.opened():
            found.append(model.skeleton.dynamics_at(np.array([0.3, -0.8]), np.zeros(2), 0.0)[1])
    torque = model.geometry(np.array([0.3, -0.8]), np.zeros(2)).columns[:, 0] * SIZE
    assert np.abs(torque).min() > 1.0
    np.testing.assert_allclose(torque, found[0] - found[1], atol=1e-10)


@pytest.mark.parametrize("force", [0.0, -1.0, np.nan, np.inf])
def test_bad_optimal_force(force):
    with pytest.raises(em.ParameterError, match=r"reserve on 'hip': optimal_force = .* is outside"):
        em.Reserve("hip", force)


@pytest.mark.parametrize("controls", [(0.1, 1.0), (-1.0, -0.1), (np.nan, 1.0), (-1.0, np.nan)])
def test_bad_controls(controls):
    with pytest.raises(em.ParameterError, match=r"reserve on 'hip': controls \["):
        em.Reserve("hip", 1.0, *controls)


POINT_ACTUATOR = {"link": 0, "point": [0, 0, 0], "direction": [1, 0, 0], "optimal_force": 1.0}
TORQUE_ACTUATOR = {"link": 0, "axis": [0, 0, 1], "optimal_force": 1.0}


@pytest.mark.parametrize(
    ("kind", "wrong", "message"),
    [
        (em.PointActuator, {"link": -1}, "point actuator 'X': link is the number of a link"),
        (em.PointActuator, {"point": [0, np.nan, 0]}, "point actuator 'X': point is three finite"),
        (em.PointActuator, {"direction": [0, 0, 0]}, "direction has no length"),
        (em.PointActuator, {"optimal_force": 0}, "point actuator 'X': optimal_force = 0"),
        (em.PointActuator, {"min_control": 1.0}, "point actuator 'X': controls [1.0, inf] must"),
        (em.TorqueActuator, {"axis": [1, 0]}, "torque actuator 'X': axis is three finite numbers"),
        (
            em.TorqueActuator,
            {"against": 1.5},
            "torque actuator 'X': against is the number of a link",
        ),
        (em.TorqueActuator, {"against": 0}, "torque actuator 'X': link and against are both 0"),
        (em.TorqueActuator, {"torque_is_global": "no"}, "torque_is_global is True or False, got"),
        (em.PointActuator, {"point_is_global": "false"}, "point_is_global is True or False, got"),
        (em.PointActuator, {"optimal_force": 1e-4}, "optimal_force = 0.0001 is outside [0.001,"),
    ],
)
def test_actuators_that_are_none(kind, wrong, message):
    usual = POINT_ACTUATOR if kind is em.PointActuator else TORQUE_ACTUATOR
    with pytest.raises(em.ParameterError, match=re.escape(message)):
        kind("X", **{**usual, **wrong})


@pytest.mark.parametrize(
    "actuator",
    [
        em.PointActuator("X", **{**POINT_ACTUATOR, "link": 5}),
        em.TorqueActuator("X", **TORQUE_ACTUATOR, against=5),
    ],
)
def test_a_link_that_does_not_exist(actuator):
    mbs, tree, _ = tree_of(0)
    mbs.Assemble()
    with pytest.raises(em.ParameterError, match="'X' is on link 5, but the tree has links 0 to 4"):
        em.MusculoskeletalModel(mbs, tree, [muscle()], reserves=[actuator])


@pytest.mark.parametrize(("pushes", "sign"), [(False, 1.0), (True, -1.0)])
def test_path_actuators_pull_as_muscles_do_on_a_tree(pushes, sign):
    mbs, tree, (q, v) = tree_of(3)
    mbs.Assemble()
    path = [em.PathPoint([0.3, -0.2, 0.1]), em.PathPoint([0.2, 0.1, 0.0], link=4)]
    wrap = em.WrapSphere(0.03, position=[0.05, 0.0, 0.0], link=1)
    cable = em.PathActuator("cable", path=path, wraps=[wrap], optimal_force=2.0, pushes=pushes)
    given = [em.Reserve("q1", 1.0), cable, em.PointActuator("X", **POINT_ACTUATOR)]
    wrapped = dataclasses.replace(muscle(), path=path, wraps=[wrap])
    model = em.MusculoskeletalModel(mbs, tree, [wrapped], reserves=given)
    geometry = model.geometry(q, v)
    r = geometry.moment_arms[0]
    assert np.abs(r).max() > 0.01
    np.testing.assert_array_equal(geometry.columns[:, 1], sign * r)
    np.testing.assert_array_equal(geometry.columns[:, 0], [0.0, 1.0, 0.0, 0.0, 0.0])
    alone = em.MusculoskeletalModel(mbs, tree, [muscle()], reserves=given[2:])
    np.testing.assert_array_equal(geometry.columns[:, 2], alone.columns(q)[:, 0])


@pytest.mark.parametrize(("pushes", "sign"), [(False, 1.0), (True, -1.0)])
def test_path_actuators_pull_as_muscles_do_on_bodies(pushes, sign):
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    tracked, paths, z = prismatic(mbs, ground, exu.NodeType.RotationEulerParameters)
    mbs.Assemble()
    cables = [
        em.PathActuator(f"cable{k}", path=path, optimal_force=1.0, pushes=pushes)
        for k, path in enumerate(paths)
    ]
    muscles = [
        dataclasses.replace(muscle(), name=f"unit{k}", path=path) for k, path in enumerate(paths)
    ]
    model = em.MusculoskeletalModel(mbs, tracked, muscles, reserves=cables)
    geometry = model.geometry(np.array(z), np.zeros(1))
    assert np.abs(geometry.moment_arms).min() > 0.1
    np.testing.assert_array_equal(geometry.columns.T, sign * geometry.moment_arms)


def test_a_path_actuator_needs_a_path():
    mbs, tree, _ = tree_of(0)
    mbs.Assemble()
    cable = em.PathActuator("cable", path=[em.PathPoint([0.0, 0.0, 0.0])], optimal_force=1.0)
    with pytest.raises(em.ParameterError, match="actuator 'cable': a path needs at least two"):
        em.MusculoskeletalModel(mbs, tree, [muscle()], reserves=[cable])


def test_names():
    given = [em.Reserve("hip", 1.0), em.Reserve("hip", 2.0), em.Reserve("hip", 1.0, name="motor")]
    assert actuator_names(given) == ("hip_reserve", "hip_reserve_2", "motor")
    given = [em.Reserve("hip", 1.0, name=name) for name in ("a", "a_2", "a")]
    assert actuator_names(given) == ("a", "a_2", "a_3")


def test_directions_of_any_length():
    for length in (1e-300, 1.0, 1e200):
        given = em.PointActuator(
            "X", **{**POINT_ACTUATOR, "direction": [0.0, 3 * length, 4 * length]}
        )
        np.testing.assert_allclose(given.direction, [0.0, 0.6, 0.8])
        given = em.PointActuator(
            "X", **{**POINT_ACTUATOR, "direction": [0.0, -3 * length, -4 * length]}
        )
        np.testing.assert_allclose(given.direction, [0.0, -0.6, -0.8])
