"""Models of OpenSim on Exudyn systems: against numbers of OpenSim 4.6, against formulas where no
reference model has a joint, and what is refused."""

import json
import re

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.opensim.bodies import Bodies
from exudyn_muscles.opensim.document import read_document
from exudyn_muscles.skeleton.geometry import Geometry

from ..differences import gradient
from ..opensim import REFERENCE, needs_opensim_files, numbers_of, with_opensims
from ..opensim_files import (
    BODY,
    BODY_POINT,
    GROUND_POINT,
    JOINT,
    LOCKED,
    PIN,
    Loaded,
    about,
    along,
    coordinates,
    frame,
    joint,
    muscle,
    write_model,
)
from ..opensim_models import load, path_of, rebuilt

BLOCKS = ["tug_of_war", "tug_of_war_millard", "twoMusclesOnBlock", "block_hanging_from_muscle"]
MODELS = with_opensims(["blocks", "arm"], [*BLOCKS, "arm26"])


def reference(name):
    labels = json.loads(numbers_of(name, "static.json").read_text())
    return np.load(numbers_of(name, "static.npz")), labels


def bias_of(table):
    """H - Q, (k, n)."""
    return table["bias"] if "bias" in table else table["tau_coriolis"] - table["tau_gravity"]


@pytest.fixture(scope="module")
def as_opensim_reads(tmp_path_factory):
    """The files as OpenSim reads them: it keeps six digits of the angles in files before version 4,
    which turns their axes by 4e-6 rad."""

    def write(name):
        text = path_of(name).read_text()
        if 'Version="4' not in text:
            text = re.sub(r"1\.570796\d*", "1.5708", text)
        file = tmp_path_factory.mktemp("models") / f"{name}.osim"
        file.write_text(text)
        return file

    return write


@pytest.mark.parametrize("name", MODELS)
def test_bodies_are_opensims(name, as_opensim_reads):
    loaded, (table, labels) = Loaded(as_opensim_reads(name)), reference(name)
    assert list(loaded.model.coordinates) == labels["coordinates"]
    np.testing.assert_array_equal(loaded.model.skeleton.initial_state()[0], table["q"][0])
    for k in range(len(table["q"])):
        q, v = table["q"][k], table["u"][k]
        M, h = loaded.dynamics(q, v)
        np.testing.assert_allclose(M, table["M"][k], rtol=0, atol=1e-13)
        np.testing.assert_allclose(h, bias_of(table)[k], rtol=0, atol=1e-10)
        for j, body in enumerate(labels["bodies"]):
            R, p = loaded.pose(q, body)
            np.testing.assert_allclose(R.ravel(), table["body_R"][k, j], rtol=0, atol=1e-14)
            np.testing.assert_allclose(p, table["body_pos"][k, j], rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", MODELS)
def test_paths_that_touch_nothing_are_opensims(name, as_opensim_reads):
    model, (table, labels) = em.opensim.load_model(as_opensim_reads(name)), reference(name)
    assert list(model.muscles.names) == labels["muscles"]
    points = [len(muscle.path) for muscle in model.muscles]
    for k in range(len(table["q"])):
        straight = table["npts"][k] == points
        found = model.geometry(table["q"][k], table["u"][k])
        for values, theirs in zip(found[:3], ("L", "V", "R"), strict=True):
            np.testing.assert_allclose(
                values[straight], table[theirs][k][straight], rtol=0, atol=1e-13
            )


@pytest.mark.parametrize(
    ("name", "muscle", "tolerance"),
    [
        ("arm", "over_cylinder", 1.3e-6),
        ("arm", "over_sphere", 1e-13),
        ("arm", "over_ellipsoid", 5e-6),
        *(
            pytest.param("arm26", muscle, tolerance, marks=needs_opensim_files)
            for muscle, tolerance in (
                ("TRIlat", 1.3e-6), ("TRImed", 1.3e-6), ("BRA", 3e-5), ("BIClong", 5e-6),
                ("BICshort", 1e-13),
            )
        ),
    ],
)  # fmt: skip
def test_wrapped_lengths_are_opensims(name, muscle, tolerance):
    """Cylinders, which OpenSim's tangents meet to 1e-6, and for BIClong an ellipsoid."""
    model, (table, labels) = load(name), reference(name)
    i = labels["muscles"].index(muscle)
    for k in range(len(table["q"])):
        length = model.geometry(table["q"][k], table["u"][k]).length[i]
        assert length == pytest.approx(table["L"][k, i], abs=tolerance)


@pytest.mark.parametrize("name", MODELS)
def test_accelerations_with_muscles_are_opensims(name, as_opensim_reads):
    """The arm's moved by OpenSim's own lengths and moment arms, which differ where it wraps."""
    loaded, (table, _) = Loaded(as_opensim_reads(name)), reference(name)
    model = loaded.model
    for k in range(len(table["q"])):
        q, v = table["q"][k], table["u"][k]
        geometry = Geometry(table["L"][k], table["V"][k], table["R"][k])
        if not name.startswith("arm"):
            geometry = model.geometry(q, v)
        l_t = em.tendon_length(model.muscles, table["lf"][k], geometry.length)
        M, h = loaded.dynamics(q, v)
        torque = model.torque(geometry, table["act"][k], l_t, np.empty(0))
        theirs = table["udot_muscle"][k]
        found = np.linalg.solve(M, torque - h)
        np.testing.assert_allclose(found, theirs, rtol=0, atol=1e-8 * np.abs(theirs).max())


# -- A knee that slides while it turns, and a patella coupled to it ------------------------------


class Leg(Loaded):
    """With OpenSim's numbers, whose M and forces are in all speeds, S times those of ours."""

    def __init__(self, name, knee, patella):
        super().__init__(path_of(name))
        self.table, labels = reference(name)
        names = labels["coordinates"]
        self.bodies = labels["bodies"]
        self.order = [names.index(name) for name in self.model.coordinates]
        self.S = np.eye(len(names))[:, self.order]
        self.S[names.index(patella), self.model.coordinates.index(knee)] = 1.0

    def states(self):
        return zip(*(self.table[x][:, self.order] for x in "qu"), strict=True)


@pytest.fixture(scope="module")
def leg():
    return Leg("leg6dof9musc", "knee_angle_r", "knee_angle_pat_r")


@pytest.fixture(scope="module", params=with_opensims(["leg"], ["leg6dof9musc"]))
def any_leg(request):
    if request.param == "leg":
        return Leg("leg", "knee_angle", "patella_angle")
    return request.getfixturevalue("leg")


@needs_opensim_files
def test_the_legs_coordinates(leg):
    model = leg.model
    tilt, shifts = "pelvis_tilt", ("pelvis_tx", "pelvis_ty")
    rest = ("hip_flexion_r", "knee_angle_r", "ankle_angle_r")
    assert model.coordinates == (*shifts, tilt, *rest)
    z, v = model.skeleton.initial_state()
    # Theirs is projected onto the coupler, from defaults 2e-8 apart.
    np.testing.assert_allclose(z, leg.table["q"][0, leg.order], rtol=0, atol=3e-8)
    whole = model.skeleton.initial_arrays()
    for found, expected in zip(whole, model.state_of_tree(z, v), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_the_legs_bodies_are_opensims(any_leg):
    bias = bias_of(any_leg.table)
    for k, (q, v) in enumerate(any_leg.states()):
        M, h = any_leg.dynamics(q, v)
        np.testing.assert_allclose(
            M, any_leg.S.T @ any_leg.table["M"][k] @ any_leg.S, rtol=0, atol=1e-13
        )
        np.testing.assert_allclose(h, any_leg.S.T @ bias[k], rtol=0, atol=1e-10)
        for j, body in enumerate(any_leg.bodies):
            R, p = any_leg.pose(q, body)
            np.testing.assert_allclose(R.ravel(), any_leg.table["body_R"][k, j], rtol=0, atol=1e-13)
            np.testing.assert_allclose(p, any_leg.table["body_pos"][k, j], rtol=0, atol=1e-13)


def test_the_legs_paths_are_opensims(any_leg):
    for k, (q, v) in enumerate(any_leg.states()):
        found = any_leg.model.geometry(q, v)
        expected = (
            any_leg.table["L"][k],
            any_leg.table["V"][k],
            any_leg.table["R"][k][:, any_leg.order],
        )
        for values, theirs in zip(found[:3], expected, strict=True):
            np.testing.assert_allclose(values, theirs, rtol=0, atol=1e-13)


def test_the_legs_accelerations_are_opensims(any_leg):
    model, nothing = any_leg.model, np.empty(0)
    for k, (q, v) in enumerate(any_leg.states()):
        geometry = model.geometry(q, v)
        l_t = em.tendon_length(model.muscles, any_leg.table["lf"][k], geometry.length)
        M, h = any_leg.dynamics(q, v)
        torque = model.torque(geometry, any_leg.table["act"][k], l_t, nothing)
        for moved_by, name in ((0.0, "udot_passive"), (torque, "udot_muscle")):
            theirs = any_leg.table[name][k, any_leg.order]
            found = np.linalg.solve(M, moved_by - h)
            np.testing.assert_allclose(found, theirs, rtol=0, atol=1e-8 * np.abs(theirs).max())


STANCE = REFERENCE.parent / "cmc" / "leg6dof9musc_stance"


@pytest.fixture(scope="module")
def old_leg():
    return em.opensim.load_model(STANCE / "leg6dof9musc_added_mass.osim")


@needs_opensim_files
def test_the_legs_file_before_version_4(leg, old_leg):
    """With other masses, and rounded numbers."""
    assert old_leg.coordinates == leg.model.coordinates
    for q, v in leg.states():
        found, expected = old_leg.geometry(q, v), leg.model.geometry(q, v)
        np.testing.assert_allclose(found.length, expected.length, rtol=0, atol=3e-6)
        np.testing.assert_allclose(found.moment_arms, expected.moment_arms, rtol=0, atol=1e-4)


@needs_opensim_files
def test_a_measured_step_is_tracked(old_leg):
    """By muscles alone below the pelvis, which residuals carry: here no ground pushes back."""
    strengths = {"pelvis_tx": 300.0, "pelvis_ty": 1000.0, "pelvis_tilt": 100.0}
    reserves = [em.Reserve(name, strength) for name, strength in strengths.items()]
    reserves += [em.Reserve(name, 1.0) for name in old_leg.coordinates[3:]]
    model = rebuilt(old_leg, old_leg.muscles, reserves)
    motion = em.Motion.from_file(
        STANCE / "leg6dof9musc_adjusted_Kinematics_q.sto", model.coordinates, model.skeleton.units
    )
    result = em.cosimulate(model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL))
    errors = result.coordinates - np.array([motion(t)[0] for t in result.time])
    assert np.sqrt(np.mean(errors**2, axis=0)).max() < 1.5e-4
    followers = model.state_of_tree(result.coordinates)[0]
    knee, patella = (
        model.skeleton.tree_coordinates.index(name) for name in ("knee_angle_r", "knee_angle_pat_r")
    )
    np.testing.assert_array_equal(followers[:, patella], followers[:, knee])


# -- Joints ---------------------------------------------------------------------------------------


@pytest.fixture
def write(tmp_path):
    """Writes a model of one body, changed here and there, and returns its file."""

    def write_file(**changes):
        return write_model(tmp_path / "model.osim", **changes)

    return write_file


def mass_and_weight(loaded, q, body):
    """A body's part of M and of H - Q at rest, from derivatives of its pose."""

    def center(q):
        R, p = loaded.pose(q, body)
        return p + R @ [0.1, -0.2, 0.05]

    R, _ = loaded.pose(q, body)
    J = gradient(center, q, 1e-4)
    turns = gradient(lambda x: (loaded.pose(x, body)[0] @ R.T).ravel(), q, 1e-4)
    W = turns.reshape(3, 3, -1)[[2, 0, 1], [1, 2, 0]]
    I = R @ [[0.04, 0.003, -0.002], [0.003, 0.05, 0.001], [-0.002, 0.001, 0.06]] @ R.T
    return 2.5 * J.T @ J + W.T @ I @ W, 2.5 * 9.80665 * J[1]


def constant(value):
    return f'<Constant name="function"><value>{value}</value></Constant>'


def axes(**given):
    """A SpatialTransform with some axes: coordinate, direction, function."""
    found = []
    for kind, directions in (("rotation", np.eye(3)), ("translation", np.eye(3))):
        for k, usual in enumerate(directions):
            name, direction, function = given.get(
                f"{kind}{k + 1}",
                ("", usual, '<Constant name="function"><value>0</value></Constant>'),
            )
            found.append(
                f'<TransformAxis name="{kind}{k + 1}"><coordinates>{name}</coordinates>'
                f"<axis>{' '.join(map(str, direction))}</axis>{function}</TransformAxis>"
            )
    return f"<SpatialTransform>{''.join(found)}</SpatialTransform>"


def line(slope, value):
    return (
        f'<LinearFunction name="function"><coefficients>{slope} {value}</coefficients>'
        "</LinearFunction>"
    )


TILTED = axes(
    rotation1=("a", (1.0, 2.0, 2.0), line(1, 0.25)),
    rotation2=("", (0.0, 1.0, 0.0), constant(0.5)),
    rotation3=("b", (0.0, -1.0, 1.0), line(-1, 0)),
    translation1=("", (1.0, 0.0, 0.0), constant(0.75)),
    translation2=(
        "c", (0.0, 3.0, 4.0),
        '<MultiplierFunction name="function"><function><LinearFunction><coefficients>2 1'
        "</coefficients></LinearFunction></function><scale>0.5</scale></MultiplierFunction>",
    ),
)  # fmt: skip
POLYNOMIAL = (
    '<PolynomialFunction name="function"><coefficients>0.2 -0.3 0.5 0.1</coefficients>'
    "</PolynomialFunction>"
)
SPLINE = '<SimmSpline name="function"><x>-2 0 1 2</x><y>0.1 0.2 0.1 0.3</y></SimmSpline>'
SLIDING = axes(  # a has an axis of its own, b has none
    rotation1=("a", (0.0, 0.0, 1.0), line(1, 0)),
    rotation2=("b", (0.0, 1.0, 0.0), line(2, 0.25)),
    translation1=("a", (1.0, 0.0, 0.0), POLYNOMIAL),
    translation2=("b", (0.0, 1.0, 0.0), SPLINE),
    translation3=("a", (0.0, 0.0, 1.0), line(-1, 0.5)),
)
spline = em.simm_spline([-2, 0, 1, 2], [0.1, 0.2, 0.1, 0.3])
X, Y, Z = np.eye(3)
KINDS = {
    "PinJoint": (["a"], "", lambda a: about(Z, a)),
    "SliderJoint": (["a"], "", lambda a: along(a, 0, 0)),
    "UniversalJoint": (["a", "b"], "", lambda a, b: about(X, a) @ about(Y, b)),
    "BallJoint": (["a", "b", "c"], "", lambda a, b, c: frame([a, b, c], np.zeros(3))),
    "GimbalJoint": (["a", "b", "c"], "", lambda a, b, c: frame([a, b, c], np.zeros(3))),
    "PlanarJoint": (["a", "b", "c"], "", lambda a, b, c: along(b, c, 0) @ about(Z, a)),
    "FreeJoint": (list("abcdef"), "", lambda a, b, c, d, e, f: frame([a, b, c], [d, e, f])),
    "CustomJoint": (
        ["a", "b", "c"],
        TILTED,
        lambda a, b, c: (
            along(0.75, 0.6 * (c + 0.5), 0.8 * (c + 0.5))
            @ about([1, 2, 2], a + 0.25)
            @ about(Y, 0.5)
            @ about([0, -1, 1], -b)
        ),
    ),
    "CustomJoint that slides": (
        ["a", "b"],
        SLIDING,
        lambda a, b: (
            along(0.2 * a**3 - 0.3 * a**2 + 0.5 * a + 0.1, float(spline(b)), 0.5 - a)
            @ about(Z, a)
            @ about(Y, 2 * b + 0.25)
        ),
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_joints_move_as_their_formulas_say(kind, write):
    """Poses, and the mass matrix from their derivatives."""
    names, inside, formula = KINDS[kind]
    loaded = Loaded(write(joints=joint(kind.split()[0], names, inside)))
    given = dict(zip(names, np.random.default_rng(1).uniform(-1.0, 1.0, len(names)), strict=True))
    q = np.array([given[name] for name in loaded.model.coordinates])
    assert set(loaded.model.coordinates) == set(names)
    before = frame([0.4, -0.5, 0.6], [0.1, 0.2, 0.3])
    behind = frame([-0.3, 0.2, 0.7], [-0.2, 0.1, 0.05])
    expected = before @ formula(**given) @ np.linalg.inv(behind)
    R, p = loaded.pose(q, "body")
    np.testing.assert_allclose(R, expected[:3, :3], rtol=0, atol=1e-14)
    np.testing.assert_allclose(p, expected[:3, 3], rtol=0, atol=1e-14)

    found = loaded.dynamics(q, np.zeros(len(q)))
    for mine, theirs in zip(found, mass_and_weight(loaded, q, "body"), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-9)


def test_a_locked_coordinate_is_welded_at_its_default_value(write):
    locked = "<default_value>0.3</default_value><locked>true</locked>"
    inside = coordinates("a", inside=locked) + coordinates("b")
    file = write(
        joints=JOINT.format(kind="UniversalJoint", coordinates=inside, inside=""),
    )
    loaded = Loaded(file)
    assert loaded.model.coordinates == ("b",)
    before = frame([0.4, -0.5, 0.6], [0.1, 0.2, 0.3])
    behind = frame([-0.3, 0.2, 0.7], [-0.2, 0.1, 0.05])
    expected = before @ about(X, 0.3) @ about(Y, 0.7) @ np.linalg.inv(behind)
    np.testing.assert_allclose(loaded.pose([0.7], "body")[1], expected[:3, 3], rtol=0, atol=1e-14)
    first, second = em.opensim.read_coordinates(file)
    assert first.locked and first.default_value == 0.3 and not second.locked


def test_a_locked_coordinate_holds_all_axes_that_it_moves(write):
    inside = coordinates("a", inside=LOCKED) + coordinates("b")
    loaded = Loaded(
        write(joints=JOINT.format(kind="CustomJoint", coordinates=inside, inside=SLIDING))
    )
    assert loaded.model.coordinates == ("b",)
    before = frame([0.4, -0.5, 0.6], [0.1, 0.2, 0.3])
    behind = frame([-0.3, 0.2, 0.7], [-0.2, 0.1, 0.05])
    moved = KINDS["CustomJoint that slides"][2](0.3, 0.7)
    expected = before @ moved @ np.linalg.inv(behind)
    R, p = loaded.pose([0.7], "body")
    np.testing.assert_allclose(R, expected[:3, :3], rtol=0, atol=1e-14)
    np.testing.assert_allclose(p, expected[:3, 3], rtol=0, atol=1e-14)


def test_a_coordinate_that_turns_and_slides_is_no_angle(write):
    """Nor is one that has no axis for its own value; `test_joints` has OpenSim's numbers."""
    skeleton = em.opensim.load_model(
        write(joints=joint("CustomJoint", ["a", "b"], SLIDING))
    ).skeleton
    assert skeleton.coordinates == ("b", "a") and skeleton.units == ("m", "m")
    shifts = ("a/translation1", "b/translation2", "a")
    assert skeleton.tree_coordinates == ("b", *shifts, "a/rotation1", "b/rotation2")


def test_a_coupled_coordinate_follows(write):
    """By a function times a factor, from the default value of what it follows."""
    joints = UNIVERSAL.replace('"angle">', '"angle"><default_value>0.2</default_value>')
    rest = COUPLER.format(coupled("b", function=POLYNOMIAL, scale=2.0))
    loaded = Loaded(write(joints=joints, rest=rest))
    model = loaded.model
    assert model.coordinates == ("angle",)
    followed = 2.0 * np.polyval([0.2, -0.3, 0.5, 0.1], [0.2, 0.7])
    start = model.skeleton.initial_arrays()[0]
    np.testing.assert_allclose(start, [0.2, followed[0]], rtol=0, atol=1e-14)
    whole = model.state_of_tree([0.7])[0]
    np.testing.assert_allclose(whole, [0.7, followed[1]], rtol=0, atol=1e-14)
    found = loaded.dynamics([0.7], [0.0])
    for mine, theirs in zip(found, mass_and_weight(loaded, [0.7], "body"), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-9)


def test_what_is_coupled_to_a_locked_coordinate_rests(write):
    inside = "".join(coordinates(name, inside=LOCKED * (name == "a")) for name in "abc")
    joints = JOINT.format(kind="BallJoint", coordinates=inside, inside="")
    model = em.opensim.load_model(write(joints=joints, rest=COUPLER.format(coupled("b", of="a"))))
    assert model.coordinates == ("c",)
    np.testing.assert_allclose(model.state_of_tree([0.7], [1.0]), [[0.4, 0.7], [0.0, 1.0]])


@pytest.mark.parametrize("active", [True, False])
def test_points_that_depend_on_a_locked_coordinate_stay(active, write):
    name = "<socket_{}coordinate>/jointset/joint/b</socket_{}coordinate>"
    sometimes = BODY_POINT.replace("PathPoint", "ConditionalPathPoint").replace(
        "</location>",
        f"</location>{name.format('', '')}<range>{'0 1' if active else '1 2'}</range>",
    )
    moving = (
        '<MovingPathPoint name="m"><socket_parent_frame>/bodyset/body</socket_parent_frame>'
        + "".join(name.format(f"{x}_", f"{x}_") for x in "xyz")
        + f"<x_location>{SPLINE}</x_location><y_location>{POLYNOMIAL}</y_location>"
        f"<z_location>{line(2, 0.1)}</z_location></MovingPathPoint>"
    )
    joints = UNIVERSAL.replace('"b">', f'"b">{LOCKED}')
    forces = muscle(points=GROUND_POINT + sometimes + moving)
    (found,) = em.opensim.load_model(write(joints=joints, forces=forces)).muscles
    assert all(type(point) is em.PathPoint for point in found.path)
    assert len(found.path) == 2 + active
    place = Bodies(read_document(write(joints=joints))).places["/bodyset/body"]
    last = [float(spline(0.3)), np.polyval([0.2, -0.3, 0.5, 0.1], 0.3), 0.7]
    np.testing.assert_allclose(
        found.path[-1].position, place.at(np.array(last)), rtol=0, atol=1e-14
    )


def test_a_moving_point_stays_where_it_is_beyond_its_coordinates_range(write):
    """As in OpenSim, whose lengths of gait2354 differ by 1e-16 there."""
    name = "".join(
        f"<socket_{x}_coordinate>/jointset/joint/angle</socket_{x}_coordinate>" for x in "xyz"
    )
    moving = (
        '<MovingPathPoint name="m"><socket_parent_frame>/bodyset/body</socket_parent_frame>'
        f"{name}<x_location>{SPLINE}</x_location><y_location>{line(0.5, 0.1)}</y_location>"
        f"<z_location>{line(0, 0.2)}</z_location></MovingPathPoint>"
    )
    joints = PIN.replace('"angle">', '"angle"><range>-0.5 0.8</range>')
    model = em.opensim.load_model(write(joints=joints, forces=muscle(points=GROUND_POINT + moving)))
    for angle, at in ((-0.9, -0.5), (0.3, 0.3), (0.8, 0.8), (1.4, 0.8)):
        x, y = float(spline(at)), 0.5 * at + 0.1
        still = BODY_POINT.replace("0 0.1 0.2", f"{x!r} {y!r} 0.2")
        fixed = write(joints=joints, forces=muscle(points=GROUND_POINT + still))
        q, rest = np.array([angle]), np.zeros(1)
        found, expected = model.geometry(q, rest), em.opensim.load_model(fixed).geometry(q, rest)
        np.testing.assert_allclose(found.length, expected.length, rtol=0, atol=1e-14)
        if angle != at:
            np.testing.assert_allclose(found.moment_arms, expected.moment_arms, atol=1e-14)


def test_coordinates_keep_what_the_file_says(write):
    inside = (
        "<default_value>0.3</default_value><default_speed_value>-2</default_speed_value>"
        "<range>-1 1.5</range><clamped>true</clamped>"
    )
    file = write(joints=PIN.replace('"angle">', f'"angle">{inside}'))
    (found,) = em.opensim.read_coordinates(file)
    expected = em.opensim.Coordinate(
        "angle", 0.3, -2.0, (-1.0, 1.5), True, False, joint="/jointset/joint"
    )
    assert found == expected
    assert em.opensim.load_model(file).skeleton.initial_state() == ([0.3], [-2.0])


def test_welded_bodies_join_a_link_and_frames_are_found(write):
    """A frame on a body, one on that frame, and a body welded to it."""
    inside = (
        '<components><PhysicalOffsetFrame name="f"><socket_parent>..</socket_parent>'
        "<translation>0 0 1</translation><components>"
        '<PhysicalOffsetFrame name="g"><socket_parent>..</socket_parent>'
        f"<orientation>{np.pi / 2} 0 0</orientation></PhysicalOffsetFrame>"
        "</components></PhysicalOffsetFrame></components>"
    )
    weld = (
        '<WeldJoint name="weld"><socket_parent_frame>/bodyset/body/f/g</socket_parent_frame>'
        "<socket_child_frame>/bodyset/second</socket_child_frame></WeldJoint>"
    )
    bodies = BODY.format(name="second", inside="") + BODY.format(name="body", inside=inside)
    loaded = Loaded(write(bodies=bodies, joints=weld + PIN))
    R, p = loaded.pose([0.4], "body")
    R_2, p_2 = loaded.pose([0.4], "second")
    np.testing.assert_allclose(p_2, p + R[:, 2], rtol=0, atol=1e-15)
    np.testing.assert_allclose(R_2, R @ about(X, np.pi / 2)[:3, :3], rtol=0, atol=1e-15)
    first, second = (mass_and_weight(loaded, [0.4], body) for body in ("body", "second"))
    M, h = loaded.dynamics([0.4], [0.0])
    np.testing.assert_allclose(M, first[0] + second[0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(h, first[1] + second[1], rtol=0, atol=1e-9)


# -- Muscles --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "law", "activation", "constants"),
    [
        ("Thelen2003Muscle", em.Thelen2003(), em.ActivationDynamics.FIRST_ORDER, (0.015, 0.05)),
        ("Millard2012EquilibriumMuscle", em.Millard2012(), em.ActivationDynamics.FIRST_ORDER,
         (0.010, 0.040)),
        ("DeGrooteFregly2016Muscle", em.DeGrooteFregly2016(), em.ActivationDynamics.SMOOTH,
         (0.015, 0.060)),
        ("Thelen2003Muscle_Deprecated", em.Thelen2003Deprecated(),
         em.ActivationDynamics.LINEAR_FILTER, (0.010, 0.040)),
        ("Schutte1993Muscle_Deprecated", em.Schutte1993(), em.ActivationDynamics.BILINEAR,
         (0.1 / (7.667 + 1.459854), 0.1 / 1.459854)),
        ("Schutte1993Muscle", em.Schutte1993(), em.ActivationDynamics.BILINEAR,
         (0.1 / (7.667 + 1.459854), 0.1 / 1.459854)),
    ],
)  # fmt: skip
def test_properties_that_are_left_out_have_opensims_defaults(
    kind, law, activation, constants, write
):
    (found,) = em.opensim.load_model(write(forces=muscle(kind))).muscles
    assert found.law == law and found.activation_dynamics is activation
    assert (found.activation_time_constant, found.deactivation_time_constant) == constants
    assert (found.max_isometric_force, found.optimal_fiber_length) == (1000.0, 0.1)
    assert (found.tendon_slack_length, found.max_contraction_velocity) == (0.2, 10.0)
    assert found.minimum_activation == 0.01 and not found.ignore_tendon_compliance


def test_properties_of_the_three_classes(write):
    thelen = "<Flen>1.8</Flen><FmaxTendonStrain>0.033</FmaxTendonStrain><Af>0.3</Af><Vmax>9</Vmax>"
    (found,) = em.opensim.load_model(write(forces=muscle(inside=thelen))).muscles
    assert found.law == em.Thelen2003(flen=1.8, af=0.3) and found.tendon_strain == 0.033
    millard = (
        "<fiber_damping>0</fiber_damping><FiberForceLengthCurve><strain_at_one_norm_force>0.6"
        "</strain_at_one_norm_force><curviness>0.75</curviness></FiberForceLengthCurve>"
        "<TendonForceLengthCurve><strain_at_one_norm_force>0.05</strain_at_one_norm_force>"
        "</TendonForceLengthCurve><ActiveForceLengthCurve><minimum_value>0.2</minimum_value>"
        "</ActiveForceLengthCurve><ignore_tendon_compliance>true</ignore_tendon_compliance>"
    )
    forces = muscle("Millard2012EquilibriumMuscle", inside=millard)
    (found,) = em.opensim.load_model(write(forces=forces)).muscles
    strains = {"fiber_strain_at_one_norm_force": 0.6, "minimum_value": 0.2}
    assert found.law == em.Millard2012(fiber_damping=0.0, **strains)
    assert found.tendon_strain == 0.05 and found.ignore_tendon_compliance
    de_groote = "<fiber_damping>0.02</fiber_damping><max_control>1</max_control>"
    forces = muscle("DeGrooteFregly2016Muscle", inside=de_groote)
    (found,) = em.opensim.load_model(write(forces=forces)).muscles
    assert found.law == em.DeGrooteFregly2016(fiber_damping=0.02)


def test_a_passive_fiber_that_is_ignored(write):
    ignored = "<ignore_passive_fiber_force>true</ignore_passive_fiber_force>"
    forces = muscle("DeGrooteFregly2016Muscle", inside=ignored)
    (found,) = em.opensim.load_model(write(forces=forces)).muscles
    assert found.law == em.DeGrooteFregly2016(ignore_passive_fiber_force=True)
    curves, usual = found.law.curves(), em.DeGrooteFregly2016().curves()
    at = np.linspace(0.3, 1.8, 16)
    assert not curves.passive_force_length(at).any()
    np.testing.assert_array_equal(curves.active_force_length(at), usual.active_force_length(at))
    with pytest.warns(em.ModelFileWarning, match="OpenSim does not know this"):
        (found,) = em.opensim.load_model(write(forces=muscle(inside=ignored))).muscles
    assert found.law == em.Thelen2003()


def test_limits_of_excitations_are_the_muscles(write):
    """Beyond 0 and 1 they mean these; elements of older classes mean nothing."""
    old = (
        "<MuscleFirstOrderActivationDynamicModel><a>0</a></MuscleFirstOrderActivationDynamicModel>"
    )
    for given, expected in ((("0.1", "0.5"), (0.1, 0.5)), (("-inf", "2"), (0.0, 1.0))):
        inside = "<min_control>{}</min_control><max_control>{}</max_control>".format(*given)
        (found,) = em.opensim.load_model(write(forces=muscle(inside=inside + old))).muscles
        assert (found.min_control, found.max_control) == expected


def test_passive_stiffness_that_follows_from_the_strains(write):
    inside = STIFFNESS.replace(">3<", ">4<")
    (found,) = em.opensim.load_model(
        write(forces=muscle("Millard2012EquilibriumMuscle", inside=inside))
    ).muscles
    given, usual = (
        law.curves().passive_force_length
        for law in (found.law, em.Millard2012(fiber_strain_at_one_norm_force=0.5))
    )
    np.testing.assert_array_equal(given.pieces, usual.pieces)


def test_properties_of_the_deprecated_classes(write):
    thelen = (
        "<Flen>1.6</Flen><FmaxTendonStrain>0.05</FmaxTendonStrain><damping>0.1</damping>"
        "<Vmax>8</Vmax><Vmax0>2</Vmax0><max_contraction_velocity>12</max_contraction_velocity>"
    )
    forces = muscle("Thelen2003Muscle_Deprecated", inside=thelen)
    (found,) = em.opensim.load_model(write(forces=forces)).muscles
    numbers = {"flen": 1.6, "fmax_tendon_strain": 0.05, "fiber_damping": 0.1}
    assert found.law == em.Thelen2003Deprecated(speed_without_activation=0.25, **numbers)
    assert found.max_contraction_velocity == 8.0
    schutte = (
        "<damping>0.05</damping><time_scale>0.125</time_scale><activation1>6</activation1>"
        "<activation2>2</activation2><max_contraction_velocity>12</max_contraction_velocity>"
        "<force_velocity_curve><natCubicSpline/></force_velocity_curve>"
    )
    # A property's object has its name, or is in an element of that.
    x, y = [0.5, 1.0, 1.5], [0.1, 1.0, 0.2]
    points = "<x>0.5 1 1.5</x><y>0.1 1 0.2</y>"
    for spline in (
        f'<SimmSpline name="active_force_length_curve">{points}</SimmSpline>'
        f'<SimmSpline name="passive_force_length_curve">{points}</SimmSpline>',
        "<active_force_length_curve><NaturalCubicSpline>"
        f"{points}</NaturalCubicSpline></active_force_length_curve><passive_force_length_curve>"
        f"<natCubicSpline>{points}</natCubicSpline></passive_force_length_curve>",
    ):
        forces = muscle("Schutte1993Muscle_Deprecated", inside=schutte + spline)
        (found,) = em.opensim.load_model(write(forces=forces)).muscles
        assert found.law == em.Schutte1993(
            fiber_damping=0.05, active_force_length=(x, y), passive_force_length=(x, y)
        )
        assert found.max_contraction_velocity == 8.0
        assert found.activation_time_constant == 0.125 / 8.0
        assert found.deactivation_time_constant == 0.125 / 2.0


def test_an_old_set_of_forces_without_a_data_file(write):
    file = write(forces=muscle())
    text = file.read_text()
    for inside, empty in (("<datafile> </datafile>", True), ("<datafile>a</datafile>", False)):
        file.write_text(changed(text, "</ForceSet>", f"{inside}</ForceSet>"))
        if empty:
            assert len(em.opensim.load_model(file).muscles) == 1
            continue
        with pytest.warns(em.ModelFileWarning, match="ForceSet / datafile: OpenSim does not know"):
            em.opensim.load_model(file)


def test_old_names_of_muscles(write):
    """Of versions up to 2.3.1: the angle's, the points', and points outside of a path."""
    new = muscle(inside="<pennation_angle_at_optimal>0.3</pennation_angle_at_optimal>")
    (expected,) = em.opensim.load_model(write(forces=new)).muscles
    named = new.replace("pennation_angle_at_optimal", "pennation_angle")
    inside = named.replace("PathPointSet", "MusclePointSet").replace("PathWrapSet", "MuscleWrapSet")
    outside = inside.replace("<GeometryPath>", "").replace("</GeometryPath>", "")
    outside = outside.replace("<PathPoint ", "<MusclePoint ").replace(
        "</PathPoint", "</MusclePoint"
    )
    for old in (named, inside, outside):
        (found,) = em.opensim.load_model(write(forces=old, version=20301)).muscles
        assert found == expected
    for old in (named, inside):
        with pytest.warns(em.ModelFileWarning, match="pennation_angle: OpenSim does not know"):
            em.opensim.load_model(write(forces=old, version=20302))


def test_actuators_of_coordinates_become_reserves_and_what_is_switched_off_is_left_out(write):
    actuator = (
        '<CoordinateActuator name="r"><coordinate>angle</coordinate><optimal_force>5'
        "</optimal_force><min_control>-inf</min_control><max_control>2</max_control>"
        "</CoordinateActuator>"
    )
    off = '<PointActuator name="p"><appliesForce>false</appliesForce></PointActuator>'
    uncoupled = COUPLER.format("<isEnforced>false</isEnforced>")
    model = em.opensim.load_model(write(forces=muscle() + actuator + off, rest=uncoupled))
    assert model.reserves == (em.Reserve("angle", 5.0, -np.inf, 2.0, name="r"),)


def test_points_of_all_kinds_are_where_the_file_puts_them(write):
    """On a body whose frame is not that of its link."""
    spline = "<SimmSpline><x>-2 0 1 2</x><y>0.1 0.2 0.1 0.3</y></SimmSpline>"
    moving = (
        '<MovingPathPoint name="m"><socket_parent_frame>/bodyset/body</socket_parent_frame>'
        + "".join(
            f"<socket_{x}_coordinate>/jointset/joint/angle</socket_{x}_coordinate>" for x in "xy"
        )
        + f"<x_location>{spline}</x_location><y_location><LinearFunction><coefficients>0.1 0.2"
        "</coefficients></LinearFunction></y_location><z_location><Constant><value>0.3</value>"
        "</Constant></z_location></MovingPathPoint>"
    )
    sometimes = BODY_POINT.replace("PathPoint", "ConditionalPathPoint").replace(
        "</location>", "</location><socket_coordinate>/jointset/joint/angle</socket_coordinate>"
        "<range>0 1</range>",
    )  # fmt: skip
    last = BODY_POINT.replace("0 0.1 0.2", "0.1 0 0")
    loaded = Loaded(write(forces=muscle(points=GROUND_POINT + moving + sometimes + last)))
    curve = em.simm_spline([-2, 0, 1, 2], [0.1, 0.2, 0.1, 0.3])
    for angle in (-0.5, 0.5):
        R, p = loaded.pose([angle], "body")
        points = [[0.5, 0.1, 0.0], p + R @ [float(curve(angle)), 0.1 * angle + 0.2, 0.3]]
        points += [p + R @ [0.0, 0.1, 0.2]] * (angle > 0) + [p + R @ [0.1, 0.0, 0.0]]
        expected = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        found = loaded.model.geometry(np.array([angle]), np.zeros(1)).length[0]
        assert found == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize(
    ("kind", "size", "expected"),
    [
        ("WrapCylinder", "<radius>0.02</radius><length>1</length>",
         em.WrapCylinder(0.02, 1.0, side="-x", name="w", link=-1, position=(1, 2, 3),
                         rotation=(0.1, 0.2, 0.3))),
        ("WrapSphere", "<radius>0.02</radius>",
         em.WrapSphere(0.02, side="-x", name="w", link=-1, position=(1, 2, 3),
                       rotation=(0.1, 0.2, 0.3))),
        ("WrapEllipsoid", "<dimensions>0.02 0.03 0.04</dimensions>",
         em.WrapEllipsoid((0.02, 0.03, 0.04), side="-x", name="w", link=-1, position=(1, 2, 3),
                          rotation=(0.1, 0.2, 0.3))),
        ("WrapTorus", "<inner_radius>0.02</inner_radius><outer_radius>0.05</outer_radius>",
         em.WrapTorus(0.02, 0.05, side="-x", name="w", link=-1, position=(1, 2, 3),
                      rotation=(0.1, 0.2, 0.3))),
    ],
)  # fmt: skip
def test_surfaces(kind, size, expected, write):
    ground = (
        f'<Ground name="ground"><WrapObjectSet><objects><{kind} name="w">{size}'
        "<quadrant>-x</quadrant><xyz_body_rotation>0.1 0.2 0.3</xyz_body_rotation>"
        f"<translation>1 2 3</translation></{kind}></objects></WrapObjectSet></Ground>"
    )
    wraps = '<PathWrap name="p"><wrap_object>w</wrap_object><range>1 -1</range></PathWrap>'
    model = em.opensim.load_model(write(ground=ground, forces=muscle(wraps=wraps)))
    (wrap,) = next(iter(model.muscles)).wraps
    assert (wrap.first, wrap.last) == (0, -1)
    np.testing.assert_allclose(wrap.row(2), em.PathWrap(expected).row(2), rtol=0, atol=1e-15)
    other = ground.replace(kind, "WrapCone")
    with pytest.raises(em.ModelFileError, match="Ground 'ground' / WrapObjectSet / WrapCone 'w'"):
        em.opensim.load_model(write(ground=other, forces=muscle(wraps=wraps)))


# -- What is refused ------------------------------------------------------------------------------

SPRING = '<ElasticFoundationForce name="spring"/>'
COUPLER = (
    '<ConstraintSet><objects><CoordinateCouplerConstraint name="c">{}'
    "</CoordinateCouplerConstraint></objects></ConstraintSet>"
)
UNIVERSAL = joint("UniversalJoint", ["angle", "b"])


HALF = line(0.5, 0.25)


def coupled(follower, of="angle", function=HALF, scale=1.0):
    return (
        f"<coupled_coordinates_function>{function}</coupled_coordinates_function>"
        f"<independent_coordinate_names>{of}</independent_coordinate_names>"
        f"<dependent_coordinate_name>{follower}</dependent_coordinate_name>"
        f"<scale_factor>{scale}</scale_factor>"
    )


SECOND = (
    f'<CoordinateCouplerConstraint name="d">{coupled("b")}</CoordinateCouplerConstraint></objects>'
)
SINE = '<Sine name="function"/>'
STIFFNESS = (
    "<FiberForceLengthCurve><stiffness_at_one_norm_force>3</stiffness_at_one_norm_force>"
    "<strain_at_one_norm_force>0.5</strain_at_one_norm_force></FiberForceLengthCurve>"
)
CONSTANT_CURVE = '<Constant name="tendon_force_length_curve"><value>1</value></Constant>'
CURVINESS = "<FiberForceLengthCurve><curviness>0.5</curviness></FiberForceLengthCurve>"


def changed(of, old, new):
    assert old in of
    return of.replace(old, new)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"forces": muscle() + SPRING}, "ForceSet / ElasticFoundationForce 'spring': this cannot"),
        ({"forces": muscle("Zajac1989Muscle")}, "Zajac1989Muscle 'muscle': this cannot"),
        ({"forces": muscle("Delp1990Muscle_Deprecated")},
         "Delp1990Muscle_Deprecated 'muscle': a mass moves between its fibre and its tendon"),
        ({"forces": muscle("Schutte1993Muscle", inside=CONSTANT_CURVE)},
         "Schutte1993Muscle 'muscle' / Constant 'tendon_force_length_curve': this cannot"),
        ({"forces": muscle("Schutte1993Muscle", inside=2 * CONSTANT_CURVE)},
         "expected one object as its tendon_force_length_curve, found 2"),
        ({"forces": muscle("Schutte1993Muscle", inside="<time_scale>0</time_scale>")},
         "Schutte1993Muscle 'muscle': time_scale = 0.0 s is outside [0.01, 10] s"),
        ({"forces": muscle("Thelen2003Muscle_Deprecated", inside="<Vmax>0</Vmax>")},
         "Thelen2003Muscle_Deprecated 'muscle': Vmax = 0.0 is outside [0.1, 100]"),
        ({"rest": COUPLER.format("")}, "ConstraintSet / CoordinateCouplerConstraint 'c'"),
        ({"joints": changed(PIN, "PinJoint", "ConstantCurvatureJoint")},
         "ConstantCurvatureJoint 'joint': expected 3 coordinates, found 1"),
        ({"joints": changed(PIN, "PinJoint", "SpringJoint")}, "SpringJoint 'joint': this cannot"),
        ({"joints": changed(PIN, "/bodyset/body", "/bodyset/leg")}, "no frame '/bodyset/leg'"),
        ({"joints": PIN + PIN}, "PhysicalOffsetFrame 'before': there is another one, in line 8"),
        ({"joints": ""}, "Body 'body': no joint leads to it"),
        ({"joints": changed(PIN, "<coordinates>", "<coordinates><Coordinate name='b'/>")},
         "expected 1 coordinates, found 2"),
        ({"joints": changed(PIN, '"angle">', '"angle"><locked>maybe</locked>')},
         "locked: expected true or false, got 'maybe'"),
        ({"rest": COUPLER.format(coupled("c"))}, "'c': there is no coordinate 'c'"),
        ({"rest": COUPLER.format(coupled("angle", of="angle"))}, "in a circle: angle"),
        ({"rest": COUPLER.format(coupled("angle", of="a b"))},
         "LinearFunction 'function' / coefficients: expected 3 numbers, got 2"),
        ({"rest": COUPLER.format(coupled("b")).replace("</objects>", SECOND), "joints": UNIVERSAL},
         "CoordinateCouplerConstraint 'd': coordinate 'b' is coupled already, in line"),
        ({"rest": COUPLER.format(coupled("b")), "joints": UNIVERSAL.replace(
            '"b">', '"b"><locked>true</locked>')}, "'c': coordinate 'b' is locked as well"),
        ({"rest": COUPLER.format(coupled("b")), "joints": UNIVERSAL.replace(
            '"angle">', '"angle"><locked>true</locked>')}, "'c': no coordinate is left"),
        ({"rest": "<ConstraintSet><objects><RollingOnSurfaceConstraint name='r'/></objects>"
                  "</ConstraintSet>"}, "RollingOnSurfaceConstraint 'r': this cannot"),
        ({"joints": joint("CustomJoint", ["a"], axes())}, "coordinate 'a' moves nothing"),
        ({"joints": joint("CustomJoint", ["a"], axes(rotation1=("b", Z, line(1, 0))))},
         "the joint has no coordinate 'b'"),
        ({"joints": joint("CustomJoint", ["a"], axes(rotation1=("a", Z, SINE)))},
         "TransformAxis 'rotation1' / Sine 'function': this cannot"),
        ({"bodies": changed(BODY, "2.5", "heavy").format(name="body", inside="")},
         "Body 'body' / mass: expected numbers, got 'heavy'"),
        ({"bodies": changed(BODY, "2.5", "nan").format(name="body", inside="")}, "got 'nan'"),
        ({"bodies": changed(BODY, "2.5", "-1").format(name="body", inside="")}, "-1 kg"),
        ({"forces": muscle(inside="<Flen>0.5</Flen>")}, "Thelen2003: flen = 0.5 is outside"),
        ({"forces": muscle(inside="<max_control>0</max_control>")}, "max_control = 0 is below"),
        ({"forces": muscle("Millard2012EquilibriumMuscle", inside=STIFFNESS.replace(">3<", ">1<"))},
         "passive force-length curve: no smooth corner"),
        ({"forces": muscle("Millard2012EquilibriumMuscle", inside=CURVINESS.replace("0.5", "2"))},
         "fiber_curviness = 2.0 is outside [0, 1]"),
        ({"forces": muscle(wraps='<PathWrap name="p"><wrap_object>w</wrap_object></PathWrap>')},
         "PathWrap 'p': expected one surface 'w', found 0"),
        ({"forces": muscle(points=GROUND_POINT)}, "a path needs at least two points"),
        ({"forces": changed(muscle(), "/bodyset/body", "leg")}, "there is no frame 'leg'"),
        ({"rest": "<ComponentSet><objects><Wind/></objects></ComponentSet>"},
         "ComponentSet / Wind: this cannot"),
        ({"version": 10900}, "format version '10900' is none that OpenSim 4 reads"),
    ],
)  # fmt: skip
def test_what_cannot_be_represented_is_refused_with_its_place(changes, text, write):
    with pytest.raises(em.ModelFileError, match=re.escape(text)) as caught:
        em.opensim.load_model(write(**changes))
    assert "model.osim, line" in str(caught.value)


def test_what_xml_forbids_and_opensim_reads(write):
    """Lines are counted as they are."""
    odd = (
        "<credits>Lenhart & Thelen &amp; others</credits>\n<!--\n<!-- of both --><publications/>\n"
    )
    file = write(rest=odd)
    assert em.opensim.load_model(file).coordinates == ("angle",)
    broken = file.read_text().replace(
        "<publications/>\n", "<publications/>\n<gravity>0 x 0</gravity>"
    )
    file.write_text(broken)
    line = broken[: broken.index("<gravity>0 x")].count("\n") + 1
    with pytest.raises(em.ModelFileError, match=f"line {line}: .*gravity: expected numbers"):
        em.opensim.load_model(file)
    file.write_text(file.read_text().replace("--><publications/>", ""))  # a comment without an end
    with pytest.raises(em.ModelFileError, match="not well-formed XML"):
        em.opensim.load_model(file)


ENTITIES = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"{ENTITIES}<OpenSimDocument>&b;</OpenSimDocument>", "line 1: a DOCTYPE is refused"),
        ('<!DOCTYPE x SYSTEM "http://example.org/x"><x/>', "a DOCTYPE is refused"),
        ("<Model>\n</Body>", "not well-formed XML: mismatched tag: line 2"),
        ("", "no element found"),
        ("<x/>", "line 1: x: this is not a model file"),
        ("<a>" * 300, "more than 200 elements within each other"),
        ('<OpenSimDocument Version="40000"/>', "there is no Model in it"),
    ],
)
def test_files_that_are_no_models_are_refused(text, message, tmp_path):
    file = tmp_path / "strange.osim"
    file.write_text(text)
    with pytest.raises(em.ModelFileError, match=re.escape(message)):
        em.opensim.load_model(file)
    with pytest.raises(FileNotFoundError):
        em.opensim.load_model(tmp_path / "nothing.osim")
