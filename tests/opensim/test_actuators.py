"""Actuators in files of OpenSim: their virtual work, from the poses of bodies by differences."""

import re
import warnings

import numpy as np
import pytest

import exudyn_muscles as em

from ..differences import gradient
from ..opensim_files import (
    BODY,
    GROUND_POINT,
    JOINT,
    LOCKED,
    Loaded,
    coordinates,
    joint,
    muscle,
    write_model,
)

# The frames of both bodies are off those of their links; `second` is on a frame of `body`.
SECOND = """
<PinJoint name="wrist"><socket_parent_frame>/bodyset/body</socket_parent_frame>
<socket_child_frame>on_second</socket_child_frame><coordinates>
<Coordinate name="c"/></coordinates><frames><PhysicalOffsetFrame name="on_second">
<socket_parent>/bodyset/second</socket_parent><translation>0.1 0 -0.3</translation>
<orientation>0.2 0.9 -0.4</orientation></PhysicalOffsetFrame></frames></PinJoint>"""
BODIES = BODY.format(name="body", inside="") + BODY.format(name="second", inside="")
JOINTS = joint("UniversalJoint", ["a", "b"]) + SECOND
Q = np.array([0.3, -0.8, 0.5])
POINT, VECTOR = np.array([0.1, -0.2, 0.05]), np.array([2.0, -1.0, 2.0])
UNIT = VECTOR / 3.0


def actuator(kind, name="actuator", **properties):
    inside = "".join(f"<{tag}> {value} </{tag}>" for tag, value in properties.items())
    return f'<{kind} name="{name}">{inside}</{kind}>'


def text(vector):
    return " ".join(map(str, vector))


@pytest.fixture
def load(tmp_path):
    def load_forces(*forces, joints=JOINTS):
        return Loaded(
            write_model(
                tmp_path / "model.osim", bodies=BODIES, joints=joints, forces="".join(forces)
            )
        )

    return load_forces


def turning(loaded, body):
    """W (3, n): how fast a body turns with the coordinates, zero for ground."""
    if body == "ground":
        return np.zeros((3, 3))
    R, _ = loaded.pose(Q, body)
    turns = gradient(lambda q: (loaded.pose(q, body)[0] @ R.T).ravel(), Q, 1e-3)
    return turns.reshape(3, 3, -1)[[2, 0, 1], [1, 2, 0]]


@pytest.mark.parametrize("point_is_global", [False, True])
@pytest.mark.parametrize("force_is_global", [False, True])
@pytest.mark.parametrize("body", ["body", "/bodyset/second"])
def test_a_point_actuator_works_on_its_point(body, force_is_global, point_is_global, load):
    loaded = load(
        muscle(),
        actuator(
            "PointActuator", body=body, point=text(POINT), direction=text(VECTOR),
            point_is_global=str(point_is_global).lower(), optimal_force=7,
            force_is_global=str(force_is_global).lower(),
        ),
    )  # fmt: skip
    (found,) = loaded.model.reserves
    assert (found.name, found.optimal_force) == ("actuator", 7.0)
    body = body.split("/")[-1]
    R, p = loaded.pose(Q, body)
    station = R.T @ (POINT - p) if point_is_global else POINT
    force = UNIT if force_is_global else R @ UNIT

    def point(q):
        R, p = loaded.pose(q, body)
        return p + R @ station

    expected = force @ gradient(point, Q, 1e-3)
    assert np.abs(expected).max() > 0.05
    np.testing.assert_allclose(loaded.model.columns(Q)[:, 0], expected, rtol=0, atol=1e-11)

    geometry, state = loaded.model.geometry(Q, np.zeros(3)), (np.array([0.5]), np.array([0.2]))
    pulled, alone = (
        loaded.model.torque(geometry, *state, np.array([force])) for force in (3.0, 0.0)
    )
    np.testing.assert_allclose(pulled - alone, 3.0 * expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("is_global", [False, True])
@pytest.mark.parametrize(
    ("on", "against"),
    [("body", "ground"), ("ground", "second"), ("second", "body"), ("body", "second")],
)
def test_a_torque_actuator_works_between_two_bodies(on, against, is_global, load):
    loaded = load(
        muscle(),
        actuator(
            "TorqueActuator", bodyA=on, bodyB=against, axis=text(VECTOR),
            torque_is_global=str(is_global).lower(),
        ),
    )  # fmt: skip
    axis = UNIT if is_global or on == "ground" else loaded.pose(Q, on)[0] @ UNIT
    expected = axis @ (turning(loaded, on) - turning(loaded, against))
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(loaded.model.columns(Q)[:, 0], expected, rtol=0, atol=1e-11)


def test_a_path_actuator_pulls_along_its_path(load):
    """With OpenSim's tension, positive."""
    path = "".join(muscle().partition("<GeometryPath>")[1:]).partition("</GeometryPath>")[0]
    cable = f'<PathActuator name="cable">{path}</GeometryPath><optimal_force>7</optimal_force>'
    loaded = load(muscle(), f"{cable}<max_control>2</max_control></PathActuator>")
    (found,) = loaded.model.reserves
    assert (found.optimal_force, found.min_control, found.max_control) == (7.0, -np.inf, 2.0)
    geometry = loaded.model.geometry(Q, np.zeros(3))
    assert np.abs(geometry.moment_arms).max() > 0.1
    np.testing.assert_array_equal(geometry.columns[:, 0], geometry.moment_arms[0])


def test_what_is_left_out_has_opensims_defaults(load):
    forces = (
        actuator("PointActuator", "a", body="body", optimal_force=""),
        actuator("TorqueActuator", "b", bodyA="body", bodyB="ground", min_control=""),
        actuator("CoordinateActuator", coordinate="b", max_control=""),
    )
    loaded = load(muscle(), *forces)
    point, torque, reserve = loaded.model.reserves
    place = loaded.places["/bodyset/body"]
    np.testing.assert_allclose(point.point, place.pose[:3, 3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(point.direction, place.pose[:3, 0], rtol=0, atol=1e-15)
    assert not point.point_is_global and not point.force_is_global
    assert torque.torque_is_global and torque.axis == (0.0, 0.0, 1.0)
    assert reserve == em.Reserve("b", 1.0, name="actuator")
    for each in (point, torque):
        limits = each.optimal_force, each.min_control, each.max_control
        assert limits == (1.0, -np.inf, np.inf)


def test_actuators_on_what_cannot_move_are_left_out(load):
    """As the residuals of a pelvis that is locked."""
    held = "".join(coordinates(name, inside=LOCKED) for name in "ab")
    joints = JOINT.format(kind="UniversalJoint", coordinates=held, inside="") + SECOND
    point = GROUND_POINT.replace("/ground", "/bodyset/second").replace('"a"', '"c"')
    loaded = load(
        muscle(points=GROUND_POINT + point),
        actuator("CoordinateActuator", "a", coordinate="a"),
        actuator("PointActuator", "b", body="body", direction="0 1 0"),
        actuator("PointActuator", "c", body="ground"),
        actuator("TorqueActuator", "d", bodyA="body", bodyB="ground"),
        actuator("TorqueActuator", bodyA="body", bodyB="second", torque_is_global="false"),
        joints=joints,
    )
    assert loaded.model.coordinates == ("c",)
    (left,) = loaded.model.reserves  # the second body's torque, about the first's axis
    assert isinstance(left, em.TorqueActuator)
    R, _ = loaded.pose([0.5], "body")
    turns = gradient(lambda q: loaded.pose(q, "second")[0].ravel(), np.array([0.5]), 1e-3)
    W = turns.reshape(3, 3) @ loaded.pose([0.5], "second")[0].T
    expected = -R[:, 2] @ [W[2, 1], W[0, 2], W[1, 0]]
    assert abs(expected) > 0.5
    assert loaded.model.columns(np.array([0.5]))[0, 0] == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize(
    ("kind", "properties", "message"),
    [
        ("PointActuator", {"body": "leg"}, "body: there is no frame 'leg'"),
        ("PointActuator", {"body": ""}, "body: it is empty"),
        ("PointActuator", {}, "there is no body in it"),
        ("PointActuator", {"body": "body", "point": "1 2"}, "point: expected 3 numbers, got 2"),
        ("PointActuator", {"body": "body", "direction": "0 0 0"}, "direction has no length"),
        ("TorqueActuator", {"bodyA": "body"}, "there is no bodyB in it"),
        ("TorqueActuator", {"bodyA": "body", "bodyB": "ground", "axis": "0 0 0"},
         "axis has no length"),
        ("TorqueActuator", {"bodyA": "body", "bodyB": "ground", "torque_is_global": "maybe"},
         "torque_is_global: expected true or false, got 'maybe'"),
        ("CoordinateActuator", {"coordinate": "knee"},
         "coordinate: there is no coordinate 'knee', those are a, b, c"),
        ("CoordinateActuator", {"coordinate": "a", "optimal_force": "0"},
         "optimal_force = 0.0 is outside"),
        ("CoordinateActuator", {"coordinate": "a", "optimal_force": "strong"},
         "optimal_force: expected numbers, got 'strong'"),
        ("CoordinateActuator", {"coordinate": "a", "min_control": "0.1"},
         "controls [0.1, inf] must enclose 0"),
    ],
)  # fmt: skip
def test_actuators_that_are_refused(kind, properties, message, load):
    start = rf"model\.osim, line \d+: ForceSet / {kind} 'actuator'.*"
    with pytest.raises(em.ModelFileError, match=start + re.escape(message)):
        load(muscle(), actuator(kind, **properties))


OLD = (
    '<PointActuator name="F"><body_A>ground</body_A><body_B>body</body_B><max_force>9</max_force>'
    "<point_A>1 1 1</point_A><point_B>0.1 0.2 0.3</point_B><direction_A>-1 0 2</direction_A>"
    "<optimal_force>7</optimal_force></PointActuator>"
    '<TorqueActuator name="M"><body_A>ground</body_A><body_B>body</body_B>'
    "<direction_A>0 -1 0</direction_A></TorqueActuator>"
    '<PointActuator name="plain"><body>body</body></PointActuator>'
)
NEW = (
    actuator("PointActuator", "F", body="body", point="0.1 0.2 0.3", direction="1 0 -2",
             force_is_global="true", optimal_force=7)
    + actuator("TorqueActuator", "M", bodyA="body", bodyB="ground", axis="0 1 0")
    + actuator("PointActuator", "plain", body="body", direction="-1 0 0", force_is_global="true")
)  # fmt: skip


def test_actuators_of_files_without_a_version(load, tmp_path):
    """OpenSim renames their properties, turns directions round and takes forces as in ground."""
    model = load(muscle()).model  # writes the file
    file, forces = tmp_path / "model.osim", tmp_path / "forces.xml"
    found = []
    defaults = (
        "<defaults><PointActuator><body_B/><direction_A>1 0 0</direction_A></PointActuator>"
        "</defaults>"
    )
    for text_of_set in (
        f"<ActuatorSet>{defaults}<objects>{OLD}</objects></ActuatorSet>",
        f'<OpenSimDocument Version="40000"><ForceSet><objects>{NEW}</objects></ForceSet>'
        "</OpenSimDocument>",
    ):
        forces.write_text(text_of_set)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            model = em.opensim.load_model(file, force_sets=[forces])
        found.append((model.reserves, model.columns(Q)))
        left_out = re.findall(r"/ (\w+): OpenSim", "".join(str(each.message) for each in caught))
        old = "body_B" in text_of_set
        assert set(left_out) == ({"max_force"} if old else set())
    assert found[0][0] == found[1][0]
    np.testing.assert_array_equal(found[0][1], found[1][1])
    assert [each.name for each in found[0][0]] == ["F", "M", "plain"]


def test_an_actuator_with_an_activation_is_one_without(load):
    """It is said what is left out."""
    slow = {"coordinate": "a", "optimal_force": 7, "activation_time_constant": 0.035}
    with pytest.warns(em.ModelFileWarning, match="at once here, in OpenSim within 0.035 s"):
        model = load(actuator("ActivationCoordinateActuator", "slow", **slow), muscle()).model
    assert model.reserves == (em.Reserve("a", 7.0, name="slow"),)
