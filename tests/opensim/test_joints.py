"""Joints with coordinates that are no angles, and on ellipsoids, against OpenSim's numbers."""

import numpy as np
import pytest

import exudyn_muscles as em

from ..differences import difference
from ..opensim_files import Loaded, frame
from ..own_models import FOLDER
from . import joint_models

ALL = pytest.mark.parametrize("name", joint_models.JOINTS)


@pytest.fixture
def load(tmp_path):
    def of_text(text):
        file = tmp_path / "model.osim"
        file.write_text(text)
        return Loaded(file)

    return of_text


@pytest.fixture(scope="module")
def numbers():
    with np.load(FOLDER / "joints.npz") as stored:
        return dict(stored)


@ALL
def test_poses_and_accelerations_are_opensims(name, load, numbers):
    """With limit forces, which are in degrees where a coordinate is an angle."""
    loaded = load(joint_models.model(name))
    order = [list(numbers[f"{name}_names"]).index(each) for each in loaded.model.coordinates]
    q, u, a = (numbers[f"{name}_{key}"][:, order] for key in "qua")
    for k, places in enumerate(numbers[f"{name}_places"]):
        R, p = loaded.pose(q[k], "two")
        np.testing.assert_allclose([*R.ravel(), *p], places, rtol=0, atol=1e-13)
        if name in joint_models.WITHOUT_VELOCITIES:
            continue
        M, bias = loaded.dynamics(q[k], u[k])
        np.testing.assert_allclose(
            np.linalg.solve(M, -bias), a[k], rtol=0, atol=1e-8 * np.abs(a[k]).max()
        )


@pytest.mark.parametrize("name", joint_models.WITHOUT_VELOCITIES)
def test_masses_are_those_of_the_poses(name, load, numbers):
    """The kinetic energy of both bodies, whose velocities are differences of their poses."""
    loaded = load(joint_models.model(name))
    order = [list(numbers[f"{name}_names"]).index(each) for each in loaded.model.coordinates]
    inertias = {
        "one": (1.2, [0.02, -0.1, 0.05],
                [[0.02, 0.001, 0], [0.001, 0.03, 0.002], [0, 0.002, 0.04]]),
        "two": (3.1, [0.01, -0.2, 0.01], [[0.04, 0, 0.0003], [0, 0.005, 0], [0.0003, 0, 0.04]]),
    }  # fmt: skip
    for q, v in zip(*(numbers[f"{name}_{key}"][:, order] for key in "qu"), strict=True):
        energy = 0.0
        for body, (mass, center, inertia) in inertias.items():
            R, _ = loaded.pose(q, body)

            def at(t, q=q, v=v, body=body, center=center):
                R, p = loaded.pose(q + t * v, body)
                return np.append(p + R @ center, R)

            speeds = difference(at, 0.0, 1e-4)
            turning = (R.T @ speeds[3:].reshape(3, 3))[[2, 0, 1], [1, 2, 0]]
            energy += 0.5 * (mass * speeds[:3] @ speeds[:3] + turning @ np.array(inertia) @ turning)
        M, _ = loaded.dynamics(q, v)
        assert energy > 0.01
        assert 0.5 * v @ M @ v == pytest.approx(energy, rel=1e-9)


@ALL
def test_only_angles_are_in_degrees(name, load, numbers, tmp_path):
    angles = set(numbers[f"{name}_angles"])
    model = load(joint_models.model(name)).model
    described = em.opensim.read_coordinates(tmp_path / "model.osim")
    assert {each.name for each in described if each.rotates} == angles
    units = dict(zip(model.coordinates, model.skeleton.units, strict=True))
    assert {each for each, unit in units.items() if unit == "rad"} == angles
    rows = "\n".join(f"{t}\t" + "\t".join(["0.2"] * len(units)) for t in range(6))
    file = tmp_path / "motion.mot"
    labels = "\t".join(["time", *model.coordinates])
    file.write_text(
        f"m\nnRows=6\nnColumns={len(units) + 1}\ninDegrees=yes\nendheader\n{labels}\n{rows}\n"
    )
    q = em.Motion.from_file(file, model.coordinates, model.skeleton.units)(2.0)[0]
    expected = [np.radians(0.2) if each in angles else 0.2 for each in model.coordinates]
    np.testing.assert_allclose(q, expected, rtol=1e-12)


@pytest.mark.parametrize("locked", ["a", "b", "ab", "c"])
@pytest.mark.parametrize("name", ["several", "curved"])
def test_some_coordinates_of_an_axis_may_be_locked(name, locked, load):
    """The bodies are where they are with the others' values there."""
    text = joint_models.model(name)
    whole = load(text)
    for each in locked:
        held = f'<Coordinate name="{each}"><locked>1</locked><default_value>0.2</default_value>'
        text = text.replace(f'<Coordinate name="{each}">', held)
    held = load(text)
    values = {"z": 0.3, "a": 0.35, "b": -0.25, "c": 0.15} | dict.fromkeys(locked, 0.2)
    (R, p), (R_held, p_held) = (
        loaded.pose([values[each] for each in loaded.model.coordinates], "two")
        for loaded in (whole, held)
    )
    assert set(held.model.coordinates) == set("abcz") - set(locked)
    np.testing.assert_allclose(R_held, R, rtol=0, atol=1e-13)
    np.testing.assert_allclose(p_held, p, rtol=0, atol=1e-13)


def test_a_curved_joint_is_straight_where_its_angles_are_zero(load):
    """Where the formula is 0 / 0: a segment of its length, and masses that are finite."""
    text = joint_models.model("curved").replace("0.1 -0.15 0.2<", "0 0 0<")
    loaded = load(text)
    rest = np.zeros(4)
    M, bias = loaded.dynamics(rest, rest + 0.5)
    assert np.isfinite(M).all() and np.isfinite(bias).all()
    nearby, _ = loaded.dynamics(rest + 1e-7, rest + 0.5)
    np.testing.assert_allclose(M, nearby, rtol=0, atol=1e-6)


@pytest.mark.parametrize("kind", ["ellipsoid", "scapula", "curved"])
def test_joints_may_be_seen_from_their_other_side(kind, load):
    """Joints that point towards ground: the same relative pose the other way round."""
    text = joint_models.model(kind)
    there = text.replace(">own_before<", ">x<").replace(">own_behind<", ">own_before<")
    back = load(there.replace(">x<", ">own_behind<"))
    straight = load(text)
    q = np.linspace(-0.3, 0.4, len(straight.model.coordinates))
    values = dict(zip(straight.model.coordinates, q, strict=True))

    def joint_pose(loaded, inner, outer):
        R, p = loaded.pose([values[each] for each in loaded.model.coordinates], "one")
        H = np.eye(4)
        H[:3, :3], H[:3, 3] = R, p
        return np.linalg.inv(inner) @ H @ outer

    ground = frame([0.3, -0.2, 0.1], [0.1, 0.2, 0])
    body = frame([0.1, 0.2, -0.3], [0.02, 0.01, -0.03])
    H = joint_pose(straight, ground, body)
    np.testing.assert_allclose(joint_pose(back, ground, body), np.linalg.inv(H), rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("ellipsoid", "0.3 0.2 0.25", "0.3 0.25", "radii_x_y_z: expected 3 numbers, got 2"),
        ("ellipsoid", "<radii_x_y_z>0.3 0.2 0.25</radii_x_y_z>", "",
         "there is no radii_x_y_z in it"),
        ("scapula", '<Coordinate name="d"><range>-0.6 0.6</range></Coordinate>', "",
         "expected 4 coordinates, found 3"),
        ("scapula", "0.03 -0.02", "0.03", "scapula_winging_axis_origin: expected 2 numbers"),
    ],
)  # fmt: skip
def test_what_is_wrong(name, old, new, message, load):
    text = joint_models.model(name)
    assert old in text
    with pytest.raises(em.ModelFileError, match=message):
        load(text.replace(old, new))
