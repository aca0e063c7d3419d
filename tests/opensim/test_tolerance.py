"""What OpenSim ignores, completes or renames is read so here, with a warning where the author of a
file may have expected more of it."""

import re

import numpy as np
import pytest

import exudyn_muscles as em

from ..benchmarks.public_models import counted, distinct, load
from ..opensim_files import (
    JOINT,
    PIN,
    Loaded,
    coordinates,
    frame,
    joint,
    muscle,
    write_model,
)

AXIS = '<TransformAxis name="{}">{}</TransformAxis>'
TURN = (
    '<coordinates>{}</coordinates><axis>0 0 1</axis><LinearFunction name="function">'
    "<coefficients>1 0</coefficients></LinearFunction>"
)
TURNS = TURN.format("angle")
TURN_OF = "<coordinates>angle</coordinates><axis>0 0 1</axis>"

MOTOR = '<CoordinateActuator name="m"><coordinate>angle</coordinate></CoordinateActuator>'


@pytest.fixture
def write(tmp_path):
    return lambda **changes: write_model(tmp_path / "model.osim", **changes)


def told(file, **arguments):
    """The model and the texts of all warnings."""
    with pytest.warns(em.ModelFileWarning) as caught:
        model = em.opensim.load_model(file, **arguments)
    return model, [str(each.message) for each in caught]


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"rest": "<Wind>1</Wind>"}, "Wind: OpenSim does not know this and ignores it"),
        ({"forces": muscle(inside="<fiber_damping>1</fiber_damping>")}, "fiber_damping: OpenSim d"),
        ({"forces": muscle(inside="<ActiveForceLengthCurve><a/></ActiveForceLengthCurve>")},
         "ActiveForceLengthCurve: OpenSim does not know"),
        ({"forces": muscle("Millard2012EquilibriumMuscle", inside="<Flen>9</Flen>")},
         "Flen: OpenSim does not know"),
        ({"forces": muscle("DeGrooteFregly2016Muscle", inside="<Af>9</Af>")}, "Af: OpenSim does"),
        ({"forces": muscle("Schutte1993Muscle", inside="<Flen>9</Flen>")}, "Flen: OpenSim does"),
        ({"forces": muscle("Thelen2003Muscle_Deprecated",
                           inside="<minimum_activation>0.2</minimum_activation>")},
         "minimum_activation: OpenSim does not know"),
        ({"joints": PIN.replace('"angle">', '"angle"><stiffness>1</stiffness>')},
         "Coordinate 'angle' / stiffness: OpenSim does not know"),
        ({"rest": "<ForceSet><objects/><Wind/></ForceSet>"}, "ForceSet: it is given before"),
        ({"forces": muscle().replace("<GeometryPath>", "<GeometryPath><Wind/>")},
         "GeometryPath / Wind: OpenSim does not know"),
        ({"rest": "<ControllerSet><objects><ToyReflexController name='r'/></objects>"
          "</ControllerSet>"}, "ToyReflexController 'r': it is left out"),
    ],
)  # fmt: skip
def test_what_opensim_ignores_is_ignored_with_a_warning(changes, text, write):
    model, (message,) = told(write(**changes))
    assert re.search(r"model\.osim, line \d+: ", message) and text in message
    assert model.coordinates == ("angle",) and len(model.muscles) == 1


def test_the_first_of_two_properties_counts(write):
    twice = "<Flen>1.5</Flen><Flen>1.7</Flen>"
    model, (message,) = told(write(forces=muscle(inside=twice)))
    (found,) = model.muscles
    assert found.law.flen == 1.5 and "Flen: it is given before, and only the first" in message


def test_a_kind_is_told_once_for_a_file(write):
    names = ["a", "b", "c"]
    forces = "".join(
        muscle(inside="<Hardness>1</Hardness>").replace('"muscle"', f'"{name}"') for name in names
    )
    _, (message,) = told(write(forces=forces))
    assert "Thelen2003Muscle 'a' / Hardness" in message and "(and in 2 more places)" in message


def test_what_only_looks_is_not_told_of(write):
    """Comments, colours, sensors, probes, markers, and what is switched off."""
    off = "<enabled>false</enabled>"
    rest = (
        "<!-- a comment --><ComponentSet><objects><IMU name='i'/></objects></ComponentSet>"
        "<ProbeSet><objects><Umberger2010MuscleMetabolicsProbe/></objects></ProbeSet>"
        f"<ControllerSet><objects><PrescribedController>{off}</PrescribedController></objects>"
        "</ControllerSet><components><Marker/><Sphere/></components>"
    )
    look = "<color>0 1 1</color><display_preference>4</display_preference>"
    ground = (
        '<Ground name="ground"><WrapObjectSet><objects><WrapSphere name="w"><radius>0.02</radius>'
        f"{look}</WrapSphere></objects></WrapObjectSet></Ground>"
    )
    free = JOINT.format(
        kind="BallJoint", coordinates=coordinates("angle", "b", "c"),
        inside="<use_euler_angles>true</use_euler_angles>",
    )  # fmt: skip
    wraps = '<PathWrap name="p"><wrap_object>w</wrap_object></PathWrap>'
    forces = muscle(wraps=wraps, inside="<VisibleObject/><!-- 0.3 --><Flen><!-- --> 1.5</Flen>")
    model = em.opensim.load_model(write(rest=rest, ground=ground, joints=free, forces=forces))
    assert model.coordinates == ("angle", "b", "c")


def test_forces_of_one_name_or_none(write):
    forces = muscle() + muscle() + muscle().replace(' name="muscle"', "") + muscle()
    model, (message,) = told(write(forces=forces))
    names = ("muscle", "muscle_0", "thelen2003muscle", "muscle_1")
    assert model.muscles.names == names
    assert "Thelen2003Muscle 'muscle': this name is taken" in message


def test_texts_in_another_encoding_than_they_say(write):
    file = write(rest="<publications>pages 829\x96840</publications>")
    text = file.read_text(encoding="utf-8").replace('<?xml version="1.0"?>', "")
    file.write_bytes(b'<?xml version="1.0" encoding="UTF-8"?>\n' + text.encode("latin-1"))
    assert em.opensim.load_model(file).coordinates == ("angle",)


# -- Muscles --------------------------------------------------------------------------------------


def test_curves_of_other_shapes(write):
    """All parameters of Millard's curves; the tendon's stiffness is over its strain."""
    numbers = {
        "ForceVelocityCurve": {"concentric_curviness": 0.4, "eccentric_curviness": 0.8},
        "FiberForceLengthCurve": {
            "stiffness_at_low_force": 0.3, "stiffness_at_one_norm_force": 3.0, "curviness": 0.6,
        },
        "TendonForceLengthCurve": {
            "stiffness_at_one_norm_force": 30.0, "norm_force_at_toe_end": 0.5, "curviness": 0.4,
        },
    }  # fmt: skip
    inside = "".join(
        f"<{curve}>" + "".join(f"<{tag}>{value}</{tag}>" for tag, value in given.items())
        + f"</{curve}>" for curve, given in numbers.items()
    )  # fmt: skip
    file = write(forces=muscle("Millard2012EquilibriumMuscle", inside=inside))
    (found,) = em.opensim.load_model(file).muscles
    assert found.law == em.Millard2012(
        concentric_curviness=0.4, eccentric_curviness=0.8, fiber_stiffness_at_low_force=0.3,
        fiber_stiffness_at_one_norm_force=3.0, fiber_curviness=0.6,
        tendon_stiffness=30.0 * 0.049, norm_force_at_toe_end=0.5, tendon_curviness=0.4,
    )  # fmt: skip


@pytest.mark.parametrize("damping", [0.1, 0.0])
def test_no_minimum_activation(damping, write):
    """With a damper it is none; without OpenSim refuses the file, and it is 0.01 here."""
    inside = f"<minimum_activation>0</minimum_activation><fiber_damping>{damping}</fiber_damping>"
    file = write(forces=muscle("Millard2012EquilibriumMuscle", inside=inside))
    if damping:
        (found,) = em.opensim.load_model(file).muscles
        assert (found.minimum_activation, found.min_control) == (0.0, 0.01)  # OpenSim's least
        own = inside + "<min_control>0</min_control>"
        for version, least in ((40000, 0.0), (30000, 0.01)):  # which once meant the usual one
            forces = muscle("Millard2012EquilibriumMuscle", inside=own)
            (found,) = em.opensim.load_model(write(forces=forces, version=version)).muscles
            assert found.min_control == least
        return
    model, (message,) = told(file)
    (found,) = model.muscles
    assert found.minimum_activation == 0.01 and "minimum_activation: OpenSim refuses" in message


def test_muscles_without_activation_run(write):
    """And come back in a replay."""
    inside = (
        "<minimum_activation>0</minimum_activation><min_control>0</min_control>"
        "<tendon_slack_length>0.45</tendon_slack_length>"
    )
    forces = muscle("Millard2012EquilibriumMuscle", inside=inside) + MOTOR
    model = em.opensim.load_model(write(forces=forces))
    motion = em.Motion.from_waypoints([0.0, 0.3], [[0.1], [0.5]])
    result = em.computed_muscle_control(model, motion)
    assert result.activations.min() == 0.0 and result.max_unmet_torque == 0.0
    replay = em.forward_dynamics(model, result.excitations)
    np.testing.assert_allclose(replay.coordinates, result.coordinates, rtol=0, atol=1e-9)


def test_activation_without_dynamics(write):
    inside = "<ignore_activation_dynamics>true</ignore_activation_dynamics>"
    model, (message,) = told(write(forces=muscle("Millard2012EquilibriumMuscle", inside=inside)))
    (found,) = model.muscles
    assert "activations follow excitations within 0.1 ms" in message
    assert found.activation_dynamics is em.ActivationDynamics.LINEAR_FILTER
    assert found.activation_time_constant == found.deactivation_time_constant == 1e-4


# -- Bodies and joints ----------------------------------------------------------------------------


def custom(*axes):
    inside = f"<SpatialTransform>{''.join(axes)}</SpatialTransform>"
    return joint("CustomJoint", ["angle"], inside)


@pytest.mark.parametrize(
    "axes",
    [
        (AXIS.format("rotation3", TURNS),),  # the others do not move
        (AXIS.format("rotation3", TURN_OF + "<function/>"),
         AXIS.format("translation2", "<axis>0 1 0</axis><function />"),
         AXIS.format("rotation1", "<coordinates/>")),
    ],
)  # fmt: skip
def test_axes_that_leave_out_what_they_do(axes, write):
    """An empty function is the coordinate, if there is one; none at all does not move."""
    loaded, pin = Loaded(write(joints=custom(*axes))), Loaded(write())
    for found, expected in zip(loaded.pose([0.7], "body"), pin.pose([0.7], "body"), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)
    with pytest.raises(em.ModelFileError, match="coordinate 'angle' moves nothing"):
        em.opensim.load_model(write(joints=custom(AXIS.format("rotation3", TURN_OF))))


@pytest.mark.parametrize("kind", ["PinJoint", "CustomJoint"])
def test_a_joint_that_points_towards_ground(kind, write):
    """Its coordinate is the negative angle of the body, as in OpenSim, which turns it round."""
    inside = ""
    if kind == "CustomJoint":
        slide = AXIS.format(
            "translation1", TURNS.replace("0 0 1", "1 0 0").replace("1 0<", "2 0.1<")
        )
        inside = f"<SpatialTransform>{slide}{AXIS.format('rotation3', TURNS)}</SpatialTransform>"
    forth = joint(kind, ["angle"], inside)
    back = (
        forth.replace(">before<", ">x<").replace(">behind<", ">before<").replace(">x<", ">behind<")
    )
    there, here = Loaded(write(joints=forth)), Loaded(write(joints=back))
    # Seen from the body, ground moves as the body moves from ground in the joint that is as drawn.
    F, G = (frames(each, [0.3]) for each in (there, here))
    before, behind = frame_of(there)
    motion = np.linalg.inv(before) @ F @ behind
    opposite = np.linalg.inv(before) @ G @ behind
    np.testing.assert_allclose(opposite, np.linalg.inv(motion), rtol=0, atol=1e-14)


def frames(loaded, q):
    H = np.eye(4)
    H[:3, :3], H[:3, 3] = loaded.pose(q, "body")
    return H


def frame_of(loaded):
    """The joint's frames on ground and on the body, of the file that `joint` writes."""
    return (
        frame([0.4, -0.5, 0.6], [0.1, 0.2, 0.3]),
        frame([-0.3, 0.2, 0.7], [-0.2, 0.1, 0.05]),
    )


def test_a_spline_with_a_repeated_x(write):
    """OpenSim takes 1e-7 for its step: the values are those of two points that near."""
    curve = em.simm_spline([-1, 0, 0, 1, 2], [0, 0.5, 0.5, 1, 0])
    near = em.simm_spline([-1, 0, 1e-7, 1, 2], [0, 0.5, 0.5, 1, 0])
    at = np.linspace(-1.5, 2.5, 41)
    np.testing.assert_allclose(curve(at), near(at), rtol=0, atol=1e-6)


@pytest.mark.parametrize(("x", "y"), [([0, 0, 1], [0, 0.1, 1]), ([0, 1, 1], [0, 1, 0.9])])
def test_a_spline_that_jumps_at_its_end(x, y):
    with pytest.raises(em.ParameterError, match="a spline cannot jump at its end, at x = "):
        em.simm_spline(x, y)


def test_coordinates_coupled_by_straight_lines(write):
    line = "<PiecewiseLinearFunction><x>-1 0 1</x><y>0 1 3</y></PiecewiseLinearFunction>"
    rest = (
        "<ConstraintSet><objects><CoordinateCouplerConstraint name='c'>"
        f"<coupled_coordinates_function>{line}</coupled_coordinates_function>"
        "<independent_coordinate_names>angle</independent_coordinate_names>"
        "<dependent_coordinate_name>b</dependent_coordinate_name>"
        "</CoordinateCouplerConstraint></objects></ConstraintSet>"
    )
    model = em.opensim.load_model(write(joints=joint("UniversalJoint", ["angle", "b"]), rest=rest))
    for q, value in ((-0.5, 0.5), (0.5, 2.0), (2.0, 5.0), (-2.0, -1.0)):
        assert model.state_of_tree(np.array([q]))[0][1] == pytest.approx(value, abs=1e-12)


# -- Skeletons without muscles --------------------------------------------------------------------


@pytest.mark.parametrize("method", ["static", "csf", "css", "cmc"])
def test_a_skeleton_of_motors_only(method, write):
    model = em.opensim.load_model(write(forces=MOTOR))
    assert len(model.muscles) == 0
    motion = em.Motion.from_waypoints([0.0, 0.5], [[0.1], [0.2]])
    if method == "static":
        result = em.static_optimization(model, motion)
    elif method == "cmc":
        result = em.computed_muscle_control(model, motion)
    else:
        scheme = em.Scheme.FULL if method == "csf" else em.Scheme.SIMPLIFIED
        result = em.cosimulate(model, motion, settings=em.CosimulationSettings(scheme=scheme))
    assert result.max_unmet_torque == 0.0 and result.tracking_error_rms()[0] < 1e-3
    skeleton = model.skeleton
    q, _, a = motion(0.0)
    with skeleton.opened():
        M, h = skeleton.dynamics_at(q, np.zeros(1), 0.0)[:2]
    assert result.reserves[0, 0] == pytest.approx((M @ a + h)[0], abs=1e-9)


def test_a_skeleton_of_nothing_loads_and_cannot_follow(write):
    model = em.opensim.load_model(write(forces=""))
    motion = em.Motion.from_waypoints([0.0, 0.1], [[0.1], [0.2]])
    with pytest.raises(em.ModelError, match="the model has no muscle and no reserve"):
        em.cosimulate(model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL))


# -- The table of what loads ----------------------------------------------------------------------


def test_the_table_of_published_models(write, tmp_path):
    """Files of one content count once; reasons have neither places nor names."""
    spring = '<ElasticFoundationForce name="spring"/>'
    for name, forces in (("a", muscle()), ("b", muscle()), ("c", muscle() + spring)):
        (tmp_path / name).mkdir()
        write_model(tmp_path / name / "model.osim", forces=forces)
    write_model(tmp_path / "c" / "warned.osim", rest="<Wind>1</Wind>")
    found = [load("model", file) for file in distinct([tmp_path], "*.osim")]
    assert [each.refused for each in found] == [
        "", "ForceSet / ElasticFoundationForce: this cannot be represented", "",
    ]  # fmt: skip
    assert found[0].size == "1 coordinates, 1 muscles, 0 actuators" and not found[0].warned
    assert found[2].warned[0].startswith("Wind: OpenSim does not know this")
    assert len(list(counted(found, lambda each: [each.refused]))) == 2
