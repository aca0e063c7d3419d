"""Files with leftovers, gaps and old names, read here and by OpenSim where it is there."""

import importlib.util
import warnings

import numpy as np
import pytest

import exudyn_muscles as em

from ..opensim_files import BODY, Loaded, joint, muscle, write_model

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("opensim") is None, reason="OpenSim's Python package is absent"
)


@pytest.fixture
def both(tmp_path):
    """A file as a model of ours and of OpenSim, with its state."""

    def load(**parts):
        import opensim

        opensim.Logger.setLevelString("Off")
        file = write_model(tmp_path / "model.osim", **parts)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", em.ModelFileWarning)
            ours = Loaded(file)
        theirs = opensim.Model(str(file))
        return ours, theirs, theirs.initSystem()

    return load


def pose(theirs, state, q):
    """Rotation and position of the body when the model's first coordinates have these values."""
    for number, value in enumerate(q):
        theirs.getCoordinateSet().get(number).setValue(state, value)
    theirs.realizePosition(state)
    H = theirs.getBodySet().get("body").getTransformInGround(state)
    R = [[H.R().get(i, j) for j in range(3)] for i in range(3)]
    return np.array(R), np.array([H.p().get(i) for i in range(3)])


def same_pose(ours, theirs, state, q):
    set_ = theirs.getCoordinateSet()
    names = [set_.get(k).getName() for k in range(set_.getSize())]
    ours_q = [q[names.index(name)] for name in ours.model.coordinates]
    for found, expected in zip(ours.pose(ours_q, "body"), pose(theirs, state, q), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


def axis(name, inside):
    return f'<TransformAxis name="{name}">{inside}</TransformAxis>'


NAMED = '<Constant name="function"><value>0.3</value></Constant>'
GIVEN = "<coordinates>angle</coordinates><axis>0 0 1</axis>"


@pytest.mark.parametrize(
    "axes",
    [
        axis("rotation3", GIVEN + "<function/>"),
        axis("rotation1", "<coordinates>angle</coordinates><function/>"),
        axis("rotation3", f"{GIVEN}<function/>") + axis("translation2", "<axis>0 1 0</axis>"),
        axis("rotation3", f"{GIVEN}<function><LinearFunction/></function>")
        + axis("rotation2", f"{NAMED}<axis>0 1 0</axis>")
        + axis("rotation1", "<Constant><value>0.3</value></Constant>")
        + axis("translation1", "<function><SimmSpline><x>-1 0 0 1</x><y>0 0.2 0.2 0</y>"
               "</SimmSpline></function><coordinates>angle</coordinates><axis>1 0 0</axis>"),
    ],
)  # fmt: skip
def test_axes(axes, both):
    joints = joint("CustomJoint", ["angle"], f"<SpatialTransform>{axes}</SpatialTransform>")
    ours, theirs, state = both(joints=joints)
    for angle in (-0.7, 0.3, 0.9):
        same_pose(ours, theirs, state, [angle])


@pytest.mark.parametrize("kind", ["PinJoint", "UniversalJoint", "SliderJoint"])
def test_a_joint_that_points_towards_ground(kind, both):
    names = ["angle", "b"] if kind == "UniversalJoint" else ["angle"]
    there = joint(kind, names)
    back = (
        there.replace(">before<", ">x<").replace(">behind<", ">before<").replace(">x<", ">behind<")
    )
    ours, theirs, state = both(joints=back)
    same_pose(ours, theirs, state, [0.4, -0.3][: len(names)])


@pytest.mark.parametrize(
    ("x", "y"),
    [
        ([-1, 0, 0, 1, 2], [0, 0.5, 0.5, 1, 0]),
        ([-1, 0, 0, 1, 2], [0, 0.5, 0.6, 1, 0]),
        ([0, 0, 1, 2], [0, 0, 1, 0]),
        ([0, 1, 1, 1, 2], [0, 1, 1, 1, 0]),
    ],
)
def test_splines_with_a_repeated_x(x, y):
    import opensim

    spline = opensim.SimmSpline()
    for point in zip(x, y, strict=True):
        spline.addPoint(*map(float, point))
    at = np.array([-1.3, -0.7, -0.2, 0.11, 0.5, 0.93, 1.2, 1.7, 2.4])
    expected = [spline.calcValue(opensim.Vector(1, float(each))) for each in at]
    np.testing.assert_allclose(em.simm_spline(x, y)(at), expected, rtol=0, atol=1e-6)


def test_what_is_left_out_of_a_body(both):
    """An inertia that is not there is none."""
    body = BODY.format(name="body", inside="").replace("<inertia>", "<!-- ").replace(
        "</inertia>", " -->"
    )  # fmt: skip
    ours, theirs, state = both(bodies=body)
    theirs.realizeVelocity(state)
    import opensim

    M = opensim.Matrix()
    theirs.getMatterSubsystem().calcM(state, M)
    assert ours.dynamics([0.0], [0.0])[0][0, 0] == pytest.approx(M.get(0, 0), rel=1e-12)


def test_names(both):
    """Of forces with one name, and of those without."""
    forces = muscle() + muscle() + muscle() + muscle("Millard2012EquilibriumMuscle")
    ours, theirs, _ = both(forces=forces)
    names = [theirs.getForceSet().get(k).getName() for k in range(4)]
    assert list(ours.model.muscles.names) == names


CURVES = (
    "<ForceVelocityCurve><concentric_curviness>0.4</concentric_curviness>"
    "<eccentric_curviness>0.8</eccentric_curviness></ForceVelocityCurve>"
    "<FiberForceLengthCurve><stiffness_at_low_force>0.3</stiffness_at_low_force>"
    "<stiffness_at_one_norm_force>3</stiffness_at_one_norm_force><curviness>0.6</curviness>"
    "<strain_at_zero_force>0.05</strain_at_zero_force></FiberForceLengthCurve>"
    "<TendonForceLengthCurve><strain_at_one_norm_force>0.06</strain_at_one_norm_force>"
    "<stiffness_at_one_norm_force>30</stiffness_at_one_norm_force>"
    "<norm_force_at_toe_end>0.5</norm_force_at_toe_end><curviness>0.4</curviness>"
    "</TendonForceLengthCurve>"
)


@pytest.mark.parametrize("tendon", ["elastic", "rigid"])
def test_curves_of_other_shapes(tendon, both):
    import opensim

    inside = CURVES + "<minimum_activation>0</minimum_activation><Flen>9</Flen>"
    inside += "<min_control>0</min_control>"
    if tendon == "rigid":
        inside += "<ignore_tendon_compliance>true</ignore_tendon_compliance>"
    ours, theirs, _ = both(forces=muscle("Millard2012EquilibriumMuscle", inside=inside))
    (found,) = ours.model.muscles
    assert found.minimum_activation == 0.0
    expected = opensim.Millard2012EquilibriumMuscle.safeDownCast(theirs.getMuscles().get(0))
    curves = found.law.curves(tendon == "elastic")
    for curve, theirs_curve, at in (
        (curves.force_velocity, expected.get_ForceVelocityCurve(), np.linspace(-1.1, 1.1, 23)),
        (curves.passive_force_length, expected.get_FiberForceLengthCurve(),
         np.linspace(0.9, 1.9, 21)),
    ):  # fmt: skip
        values = [theirs_curve.calcValue(float(x)) for x in at]
        np.testing.assert_allclose(curve(at), values, rtol=0, atol=2e-9)
    strain = np.linspace(-0.01, 0.08, 19)
    values = [expected.get_TendonForceLengthCurve().calcValue(float(1.0 + x)) for x in strain]
    ours_at = curves.tendon_force_length(strain / found.tendon_strain)
    np.testing.assert_allclose(ours_at, values, rtol=0, atol=2e-9)


OLD = (
    "<ActuatorSet><defaults><Force><body_B/><direction_A>1 0 0</direction_A></Force></defaults>"
    '<objects><Force name="F"><body_A>ground</body_A><body_B>body</body_B>'
    "<point_B>0.1 0.2 0.3</point_B><direction_A>-1 0 2</direction_A></Force>"
    '<PointActuator name="G"><body>body</body><direction>0 1 0</direction></PointActuator>'
    '<Torque name="M"><body_A>ground</body_A><body_B>body</body_B><direction_A>0 -1 0'
    "</direction_A></Torque></objects></ActuatorSet>"
)


def test_actuators_of_files_without_a_version(both, tmp_path):
    """What they do to the model's accelerations, on top of its weight."""
    import opensim

    free = joint("BallJoint", ["angle", "b", "c"])
    file = tmp_path / "forces.xml"
    file.write_text(OLD)
    ours, theirs, _ = both(joints=free)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", em.ModelFileWarning)
        model = em.opensim.load_model(tmp_path / "model.osim", force_sets=[file])
    actuators = opensim.ForceSet(str(file))
    F, G, M = (actuators.get(k) for k in range(3))
    F, G = (opensim.PointActuator.safeDownCast(each) for each in (F, G))
    M = opensim.TorqueActuator.safeDownCast(M)
    for found, expected in zip(model.reserves, (F, G), strict=False):
        direction = np.array([expected.get_direction().get(k) for k in range(3)])
        np.testing.assert_allclose(found.direction, direction / np.linalg.norm(direction))
        assert found.force_is_global == expected.get_force_is_global() is True
        point = np.array([expected.get_point().get(k) for k in range(3)])
        np.testing.assert_allclose(found.point, ours.places["/bodyset/body"].at(point))
    axis_of = np.array([M.get_axis().get(k) for k in range(3)])
    assert (M.get_bodyA(), M.get_bodyB()) == ("body", "ground")
    np.testing.assert_allclose(model.reserves[2].axis, axis_of)


def test_coordinates_coupled_by_straight_lines(both):
    line = "<PiecewiseLinearFunction><x>-1 0 1</x><y>0 1 3</y></PiecewiseLinearFunction>"
    rest = (
        "<ConstraintSet><objects><CoordinateCouplerConstraint name='c'>"
        f"<coupled_coordinates_function>{line}</coupled_coordinates_function>"
        "<independent_coordinate_names>angle</independent_coordinate_names>"
        "<dependent_coordinate_name>b</dependent_coordinate_name>"
        "</CoordinateCouplerConstraint></objects></ConstraintSet>"
    )
    ours, theirs, state = both(joints=joint("UniversalJoint", ["angle", "b"]), rest=rest)
    for angle in (-0.5, 0.4):
        theirs.getCoordinateSet().get("angle").setValue(state, angle)
        theirs.assemble(state)
        expected = theirs.getCoordinateSet().get("b").getValue(state)
        found = ours.model.state_of_tree(np.array([angle]))[0][1]
        assert found == pytest.approx(expected, abs=1e-8)


def test_coordinates_of_both_are_the_same(both):
    ours, theirs, _ = both(joints=joint("BallJoint", ["angle", "b", "c"],
                                        "<use_euler_angles>true</use_euler_angles>"))  # fmt: skip
    names = [theirs.getCoordinateSet().get(k).getName() for k in range(3)]
    assert list(ours.model.coordinates) == names
