"""Models of this project in files of OpenSim, with joints, paths and muscles of many kinds. The
numbers of OpenSim for them are in `tests/reference/opensim`, made by `make_opensim.py`.
"""

import math
from pathlib import Path

import numpy as np

SETUP, STATIC = "blocks_cmc.xml", "blocks_static.xml"
FOLDER = Path(__file__).parent / "reference" / "opensim"
BODY = """<Body name="{name}"><mass>{mass}</mass><mass_center>{center}</mass_center>
<inertia>{inertia}</inertia>{inside}</Body>"""
JOINT = """<{kind} name="{name}"><socket_parent_frame>{name}_before</socket_parent_frame>
<socket_child_frame>{name}_behind</socket_child_frame><coordinates>{coordinates}</coordinates>
<frames><PhysicalOffsetFrame name="{name}_before"><socket_parent>{parent}</socket_parent>
<translation>{at}</translation><orientation>{turned}</orientation></PhysicalOffsetFrame>
<PhysicalOffsetFrame name="{name}_behind"><socket_parent>/bodyset/{child}</socket_parent>
<translation>{at_child}</translation><orientation>{turned_child}</orientation>
</PhysicalOffsetFrame></frames>{inside}</{kind}>"""
MODEL = """<?xml version="1.0"?>
<OpenSimDocument Version="40000"><Model name="{name}"><gravity>0 -9.80665 0</gravity>
<BodySet><objects>{bodies}</objects></BodySet><JointSet><objects>{joints}</objects></JointSet>
<ConstraintSet><objects>{constraints}</objects></ConstraintSet>
<ForceSet><objects>{forces}</objects></ForceSet></Model></OpenSimDocument>"""
MUSCLE = """<{kind} name="{name}"><GeometryPath name="path"><PathPointSet><objects>
{points}</objects></PathPointSet><PathWrapSet><objects>{wraps}</objects></PathWrapSet></GeometryPath>
<max_isometric_force>{force}</max_isometric_force>
<optimal_fiber_length>{fiber}</optimal_fiber_length>
<tendon_slack_length>{tendon}</tendon_slack_length>
<pennation_angle_at_optimal>{pennation}</pennation_angle_at_optimal>{inside}</{kind}>"""
POINT = """<PathPoint name="{name}"><socket_parent_frame>{frame}</socket_parent_frame>
<location>{at}</location></PathPoint>"""
CONDITIONAL = """<ConditionalPathPoint name="{name}"><socket_parent_frame>{frame}
</socket_parent_frame><location>{at}</location><socket_coordinate>{coordinate}</socket_coordinate>
<range>{range}</range></ConditionalPathPoint>"""
MOVING = """<MovingPathPoint name="{name}"><socket_parent_frame>{frame}</socket_parent_frame>
<socket_x_coordinate>{coordinate}</socket_x_coordinate><socket_y_coordinate>{coordinate}
</socket_y_coordinate><socket_z_coordinate>{coordinate}</socket_z_coordinate><x_location>{x}
</x_location><y_location>{y}</y_location><z_location><Constant><value>{z}</value></Constant>
</z_location></MovingPathPoint>"""
SPLINE = "<SimmSpline><x>{}</x><y>{}</y></SimmSpline>"
CONSTANT = "<Constant><value>{}</value></Constant>"
LINE = "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"
AXIS = """<TransformAxis name="{name}"><coordinates>{coordinate}</coordinates><axis>{axis}</axis>
<function>{function}</function></TransformAxis>"""
WRAP = "<PathWrap><wrap_object>{}</wrap_object></PathWrap>"
THELEN, MILLARD = "Thelen2003Muscle", "Millard2012EquilibriumMuscle"


def body(name, mass, center, inertia, inside=""):
    return BODY.format(name=name, mass=mass, center=center, inertia=inertia, inside=inside)


def coordinate(name, low, high, inside=""):
    return f'<Coordinate name="{name}"><range>{low} {high}</range>{inside}</Coordinate>'


def joint(kind, name, parent, child, coordinates, at="0 0 0", **frames):
    usual = {"turned": "0 0 0", "at_child": "0 0 0", "turned_child": "0 0 0", "inside": ""}
    parent = "/ground" if parent == "ground" else f"/bodyset/{parent}"
    return JOINT.format(
        kind=kind, name=name, parent=parent, child=child, coordinates=coordinates, at=at,
        **usual | frames,
    )  # fmt: skip


def axes(**functions):
    """A SpatialTransform, of which functions of a coordinate are given: name=(coordinate, text)."""
    units = {"1": "1 0 0", "2": "0 1 0", "3": "0 0 1"}
    inside = ""
    for name in [f"{kind}{k}" for kind in ("rotation", "translation") for k in (1, 2, 3)]:
        of, function = functions.get(name, ("", CONSTANT.format(0)))
        inside += AXIS.format(name=name, coordinate=of, axis=units[name[-1]], function=function)
    return f"<SpatialTransform>{inside}</SpatialTransform>"


def muscle(kind, name, points, force, fiber, tendon, pennation=0.0, wraps=(), inside=""):
    listed = [
        point if isinstance(point, str)
        else POINT.format(name=f"p{k}", frame=_frame(point[0]), at=point[1])
        for k, point in enumerate(points)
    ]  # fmt: skip
    return MUSCLE.format(
        kind=kind, name=name, points="".join(listed), wraps="".join(map(WRAP.format, wraps)),
        force=force, fiber=fiber, tendon=tendon, pennation=pennation, inside=inside,
    )  # fmt: skip


def _frame(name):
    return "/ground" if name == "ground" else f"/bodyset/{name}"


def blocks():
    """A block on an inclined rail between muscles of both classes, one of them pennate."""
    anchor = ("ground", "-0.35 0.02 0"), ("ground", "0.36 0 0.05")
    on_block = ("block", "-0.05 0.01 0"), ("block", "0.05 0 -0.02")
    own = "<FmaxTendonStrain>0.05</FmaxTendonStrain><KshapeActive>0.5</KshapeActive>"
    wider = (
        "<fiber_damping>0.05</fiber_damping><FiberForceLengthCurve><strain_at_one_norm_force>0.65"
        "</strain_at_one_norm_force></FiberForceLengthCurve>"
    )
    return MODEL.format(
        name="blocks",
        bodies=body("block", 3.0, "0.01 0.02 0", "0.01 0.02 0.03 0 0 0"),
        joints=joint(
            "SliderJoint", "rail", "ground", "block", coordinate("slide", -0.08, 0.08),
            turned="0.1 0.2 0.3",
        ),
        constraints="",
        forces=muscle(THELEN, "left", [anchor[0], on_block[0]], 600, 0.1, 0.18, 0.2)
        + muscle(MILLARD, "right", [on_block[1], anchor[1]], 500, 0.11, 0.19)
        + muscle(THELEN, "own", [anchor[0], on_block[1]], 300, 0.05, 0.37, 0.1, inside=own)
        + muscle(MILLARD, "wider", [on_block[0], anchor[1]], 200, 0.16, 0.21, 0.3, inside=wider),
    )  # fmt: skip


def arm():
    """A shoulder with three axes and an oblique elbow, muscles over a cylinder, a sphere and an
    ellipsoid."""
    surfaces = """<WrapObjectSet><objects><WrapCylinder name="elbow"><radius>0.025</radius>
    <length>0.2</length><translation>-0.01 -0.29 0</translation></WrapCylinder>
    <WrapSphere name="ball"><radius>0.025</radius><translation>0 -0.01 0</translation></WrapSphere>
    <WrapEllipsoid name="head"><dimensions>0.02 0.03 0.025</dimensions>
    <translation>0.005 -0.02 0.01</translation><xyz_body_rotation>0.2 0.1 -0.3</xyz_body_rotation>
    </WrapEllipsoid></objects></WrapObjectSet>"""
    upper, fore = "upper", "fore"
    shoulder = "".join(
        coordinate(name, low, high)
        for name, low, high in (("yaw", -0.4, 0.4), ("roll", -0.3, 0.3), ("pitch", -0.5, 1.2))
    )
    return MODEL.format(
        name="arm",
        bodies=body(upper, 2.1, "0.01 -0.14 0.005", "0.015 0.002 0.016 0.0004 0 0.0002", surfaces)
        + body(fore, 1.6, "0 -0.16 0.01", "0.02 0.0015 0.02 0 0.0003 0"),
        joints=joint("GimbalJoint", "shoulder", "ground", upper, shoulder, at="0 1.4 0.2")
        + joint(
            "PinJoint", "elbow", upper, fore, coordinate("elbow", 0.1, 2.0), at="0.005 -0.3 0",
            turned="0.05 0.1 0", at_child="0.01 0.005 0", turned_child="0.02 -0.05 0.1",
        ),
        constraints="",
        forces=muscle(
            THELEN, "straight", [("ground", "0.06 1.35 0.2"), (fore, "0.05 -0.05 0")],
            500, 0.15, 0.15,
        )
        + muscle(
            THELEN, "over_cylinder", [(upper, "-0.03 -0.1 0.01"), (fore, "-0.02 0.015 0")],
            600, 0.1, 0.11, 0.15, ["elbow"],
        )
        + muscle(
            MILLARD, "over_sphere", [("ground", "-0.05 1.45 0.2"), (upper, "0.03 -0.12 0.01")],
            400, 0.09, 0.1, 0.1, ["ball"],
        )
        + muscle(
            THELEN, "over_ellipsoid", [("ground", "-0.04 1.43 0.22"), (upper, "0.02 -0.15 0.02")],
            350, 0.1, 0.11, 0.0, ["head"],
        )
        + muscle(
            MILLARD, "both", [("ground", "-0.06 1.4 0.21"), (upper, "-0.02 -0.2 0.01"),
                              (fore, "-0.015 0.02 0.005")],
            450, 0.14, 0.15, 0.2,
        ),
    )  # fmt: skip


KNEE = "-1.8 -1.2 -0.7 -0.3 0 0.15"
THIGH_X, THIGH_Y = (
    "-0.003 0.002 0.004 0.001 -0.004 -0.005",
    "-0.41 -0.402 -0.398 -0.396 -0.397 -0.4",
)
PATELLA_X, PATELLA_Y = "0.02 0.035 0.045 0.05 0.052 0.05", "-0.45 -0.43 -0.4 -0.38 -0.37 -0.368"


def leg():
    """A knee that slides while it turns, a patella coupled to it, points that come, go and move."""
    knee = "/jointset/knee/knee_angle"
    slides = {
        "rotation3": ("knee_angle", LINE),
        "translation1": ("knee_angle", SPLINE.format(KNEE, THIGH_X)),
        "translation2": (
            "knee_angle",
            "<MultiplierFunction><function>" + SPLINE.format(KNEE, THIGH_Y)
            + "</function><scale>0.98</scale></MultiplierFunction>",
        ),
    }  # fmt: skip
    rides = {
        "rotation3": ("patella_angle", SPLINE.format(KNEE, "-1 -0.6 -0.35 -0.1 0.05 0.1")),
        "translation1": ("patella_angle", SPLINE.format(KNEE, PATELLA_X)),
        "translation2": ("patella_angle", SPLINE.format(KNEE, PATELLA_Y)),
    }
    coupler = (
        '<CoordinateCouplerConstraint name="coupler"><coupled_coordinates_function>'
        f"{LINE}</coupled_coordinates_function><independent_coordinate_names>knee_angle"
        "</independent_coordinate_names><dependent_coordinate_name>patella_angle"
        "</dependent_coordinate_name></CoordinateCouplerConstraint>"
    )
    pelvis = (
        coordinate("tilt", -0.3, 0.3) + coordinate("forward", -0.5, 0.5)
        + coordinate("up", 0.8, 1.1, "<default_value>0.95</default_value>")
    )  # fmt: skip
    moving = MOVING.format(
        name="m", frame=_frame("shank"), coordinate=knee, z=0.01,
        x=SPLINE.format(KNEE, "0.05 0.045 0.04 0.042 0.045 0.046"),
        y=SPLINE.format(KNEE, "0.03 0.02 0 -0.02 -0.03 -0.031"),
    )  # fmt: skip
    comes = CONDITIONAL.format(
        name="c", frame=_frame("shank"), at="-0.03 0.01 0", coordinate=knee, range="-2 -0.6"
    )
    return MODEL.format(
        name="leg",
        bodies=body("pelvis", 10.0, "-0.07 0 0", "0.1 0.09 0.06 0 0 0")
        + body("thigh", 8.0, "0 -0.17 0", "0.13 0.035 0.14 0.001 0 0.002")
        + body("shank", 3.5, "0 -0.19 0", "0.05 0.005 0.05 0 0.001 0")
        + body("kneecap", 0.09, "0 0 0", "1e-5 1e-5 1e-5 0 0 0")
        + body("foot", 1.2, "0.1 0 0", "0.001 0.004 0.004 0 0 0"),
        joints=joint("PlanarJoint", "root", "ground", "pelvis", pelvis)
        + joint(
            "PinJoint", "hip", "pelvis", "thigh", coordinate("hip_angle", -0.4, 1.2),
            at="-0.07 -0.066 0.08",
        )
        + joint(
            "CustomJoint", "knee", "thigh", "shank", coordinate("knee_angle", -1.7, 0.1),
            inside=axes(**slides),
        )
        + joint(
            "CustomJoint", "patella", "thigh", "kneecap", coordinate("patella_angle", -2, 1),
            inside=axes(**rides),
        )
        + joint(
            "PinJoint", "ankle", "shank", "foot", coordinate("ankle_angle", -0.5, 0.5),
            at="0 -0.43 0", turned="0.17 0.1 0", at_child="0.02 0.03 0", turned_child="0.17 0.1 0",
        ),
        constraints=coupler,
        forces=muscle(
            THELEN, "hip_and_knee",
            [("pelvis", "-0.1 -0.1 0.06"), ("shank", "-0.03 -0.04 0"), comes,
             ("shank", "-0.02 -0.06 0.01")],
            1500, 0.11, 0.3, 0.1,
        )
        + muscle(
            THELEN, "over_patella",
            [("pelvis", "0 -0.03 0.1"), ("kneecap", "0.01 0.02 0"), moving], 1200, 0.1, 0.33, 0.1,
        )
        + muscle(
            MILLARD, "calf",
            [("thigh", "-0.02 -0.38 0.01"), ("shank", "-0.03 -0.1 0"), ("foot", "-0.03 0.02 0")],
            2000, 0.07, 0.36, 0.3,
        )
        + muscle(
            MILLARD, "shin", [("shank", "0.02 -0.15 0.01"), ("foot", "0.09 0.03 0")],
            800, 0.1, 0.18, 0.1,
        )
        + muscle(
            THELEN, "in_front", [("pelvis", "0 -0.08 0.02"), ("thigh", "0.02 -0.1 0.01")],
            1400, 0.06, 0.06,
        ),
    )  # fmt: skip


OWN = {"blocks": blocks, "arm": arm, "leg": leg}


def cmc_files():
    """Name -> text of the files of a CMC set-up: the blocks' slide swings, with a weak reserve."""
    rows = "".join(f"{t:.3f}\t{0.03 * math.sin(7.0 * t):.17g}\n" for t in np.arange(0, 0.8, 0.005))
    document = '<?xml version="1.0"?><OpenSimDocument Version="40000">{}</OpenSimDocument>'
    return {
        "blocks.osim": blocks(),
        "motion.sto": f"motion\nversion=1\nnRows={160}\nnColumns=2\ninDegrees=no\nendheader\n"
        f"time\tslide\n{rows}",
        "tasks.xml": document.format(
            '<CMC_TaskSet name="tasks"><objects><CMC_Joint name="slide"><on>true</on><weight>1 1 1'
            "</weight><active>true false false</active><kp>100 1 1</kp><kv>20 1 1</kv><ka>1 1 1"
            "</ka><coordinate>slide</coordinate></CMC_Joint></objects></CMC_TaskSet>"
        ),
        "reserves.xml": document.format(
            '<ForceSet name="reserves"><objects><CoordinateActuator name="reserve"><coordinate>'
            "slide</coordinate><optimal_force>1</optimal_force></CoordinateActuator></objects>"
            "</ForceSet>"
        ),
        SETUP: document.format(
            '<CMCTool name="blocks"><model_file>blocks.osim</model_file><replace_force_set>false'
            "</replace_force_set><force_set_files>reserves.xml</force_set_files>"
            "<results_directory>results</results_directory><output_precision>17"
            "</output_precision><initial_time>0</initial_time><final_time>0.6</final_time>"
            "<solve_for_equilibrium_for_auxiliary_states>true"
            "</solve_for_equilibrium_for_auxiliary_states><maximum_number_of_integrator_steps>20000"
            "</maximum_number_of_integrator_steps><integrator_error_tolerance>1e-6"
            "</integrator_error_tolerance><desired_kinematics_file>motion.sto"
            "</desired_kinematics_file><task_set_file>tasks.xml</task_set_file>"
            "<lowpass_cutoff_frequency>-1</lowpass_cutoff_frequency><cmc_time_window>0.01"
            "</cmc_time_window><use_fast_optimization_target>true</use_fast_optimization_target>"
            "<optimization_convergence_tolerance>1e-6</optimization_convergence_tolerance>"
            "</CMCTool>"
        ),
    }


def static_files(**asked):
    """The same of a static optimization, with properties of its analysis."""
    files = cmc_files()
    analysis = "".join(f"<{tag}>{value}</{tag}>" for tag, value in asked.items())
    files[STATIC] = (
        '<OpenSimDocument Version="40000"><AnalyzeTool name="blocks"><model_file>blocks.osim'
        "</model_file><replace_force_set>false</replace_force_set><force_set_files>reserves.xml"
        "</force_set_files><results_directory>results</results_directory><output_precision>17"
        "</output_precision><initial_time>0.1</initial_time><final_time>0.6</final_time>"
        '<AnalysisSet name="Analyses"><objects><StaticOptimization name="StaticOptimization">'
        f"<on>true</on><step_interval>2</step_interval>{analysis}"
        "<optimizer_convergence_criterion>1e-10</optimizer_convergence_criterion>"
        "<optimizer_max_iterations>1000</optimizer_max_iterations></StaticOptimization></objects>"
        "</AnalysisSet><coordinates_file>motion.sto</coordinates_file></AnalyzeTool>"
        "</OpenSimDocument>"
    )
    return files
