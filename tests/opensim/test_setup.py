"""Set-up files of OpenSim's CMC tool, small ones: what they ask for, and what is refused."""

import re

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.cli import main

from ..opensim_files import JOINT, LOCKED, coordinates, joint, muscle, write_model

LAW = "<tendon_slack_length>0.45</tendon_slack_length>"
FLEXOR = muscle(inside=LAW).replace('"muscle"', '"flexor"')
OFF = "<appliesForce>false</appliesForce>"
# What OpenSim 4.6 prints, in its order, with comments as it has them.
SETUP = {
    "model_file": "model.osim", "replace_force_set": "false", "force_set_files": "reserves.xml",
    "results_directory": "results", "output_precision": "8", "initial_time": "0.1",
    "final_time": "0.4", "solve_for_equilibrium_for_auxiliary_states": "true",
    "maximum_number_of_integrator_steps": "20000", "maximum_integrator_step_size": "1",
    "minimum_integrator_step_size": "1e-08", "integrator_error_tolerance": "1e-05",
    "AnalysisSet": "<objects /><groups />", "ControllerSet": "<objects /><groups />",
    "external_loads_file": "", "actuators_to_exclude": "", "desired_points_file": "",
    "desired_kinematics_file": "motion.mot", "task_set_file": "tasks.xml",
    "constraints_file": "", "rra_controls_file": "", "lowpass_cutoff_frequency": "-1",
    "cmc_time_window": "0.01", "use_fast_optimization_target": "true",
    "optimizer_algorithm": "ipopt", "numerical_derivative_step_size": "0.0001",
    "optimization_convergence_tolerance": "0.0001", "optimizer_max_iterations": "1000",
    "optimizer_print_level": "0", "use_verbose_printing": "false",
}  # fmt: skip
DOCUMENT = '<?xml version="1.0"?>\n<OpenSimDocument Version="{}">\n{}\n</OpenSimDocument>'
TIMES = np.linspace(0.0, 0.5, 61)
SHOULDER, ELBOW = 0.3 * np.sin(4.0 * TIMES), 0.2 + 0.3 * TIMES**2


def properties(given):
    """One on a line, each after a comment; those that are None are left out."""
    return "\n".join(
        f"<!-- {tag} --> <{tag}> {value} </{tag}>"
        for tag, value in given.items()
        if value is not None
    )


def members(kind, *objects, before=""):
    """A set of objects."""
    inside = "\n".join(objects)
    return f'<{kind} name="set">\n{before}<objects>\n{inside}\n</objects><groups/></{kind}>'


def task(coordinate, **given):
    usual = {"on": "true", "active": "true false false", "coordinate": coordinate}
    return f'<CMC_Joint name="{coordinate}">\n{properties(usual | given)}\n</CMC_Joint>'


def reserve(coordinate, optimal_force=20):
    given = properties({"coordinate": coordinate, "optimal_force": optimal_force})
    return f'<CoordinateActuator name="{coordinate}_reserve">\n{given}\n</CoordinateActuator>'


def tasks(*given):
    return members("CMC_TaskSet", *given, before="<datafile />\n")


def control(name, **given):
    return f'<ControlLinear name="{name}">\n{properties(given)}\n</ControlLinear>'


def controls(*given, defaults=""):
    return members("ControlSet", *given, before=f"<defaults>\n{defaults}\n</defaults>\n")


def nodes(*pairs):
    return "".join(
        f"<ControlLinearNode><t>{t}</t><value>{value}</value></ControlLinearNode>"
        for t, value in pairs
    )


def motion(*columns, times=TIMES, degrees=True):
    """A motion file; columns are pairs of a label and radians."""
    table = np.column_stack([times, *(values for _, values in columns)])
    if degrees:
        table[:, 1:] = np.degrees(table[:, 1:])
    labels = "\t".join(["time", *(label for label, _ in columns)])
    rows = "\n".join("\t".join(map(repr, row)) for row in table.tolist())
    header = f"motion\nnRows={len(table)}\nnColumns={table.shape[1]}\ninDegrees="
    return f"{header}{'yes' if degrees else 'no'}\nendheader\n{labels}\n{rows}\n"


MOTION = motion(("elbow", ELBOW), ("toe", 0.0 * TIMES), ("shoulder", SHOULDER))
FILES = {
    "tasks.xml": DOCUMENT.format(
        20302,
        tasks(
            task("elbow", kp=400, kv="40 1 1", weight="3 1 1"),
            task("shoulder", kp="100 <!-- 1/s^2 --> 1 1", kv=20),
        ),
    ),
    "reserves.xml": members("ForceSet", reserve("elbow"), reserve("shoulder", 5)),
    "motion.mot": MOTION,
}


@pytest.fixture
def write(tmp_path):
    """Writes a model of two coordinates and one muscle with all that its set-up names, and returns
    the set-up's file. Changes are the set-up's properties, or whole files."""

    def write_files(files=None, model=None, version=40000, **changes):
        parts = {"joints": joint("UniversalJoint", ["shoulder", "elbow"]), "forces": FLEXOR}
        write_model(tmp_path / "model.osim", **parts | (model or {}))
        for name, text in (FILES | (files or {})).items():
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_text(text)
        setup = f'<CMCTool name="small">\n{properties(SETUP | changes)}\n</CMCTool>'
        file = tmp_path / "setup.xml"
        file.write_text(DOCUMENT.format(version, setup) if version else setup)
        return file

    return write_files


def load(*given, **changes):
    return em.opensim.load_setup(*given, **changes)


# -- What is asked for ----------------------------------------------------------------------------


def test_a_setup_as_opensim_prints_it(write, tmp_path):
    setup = load(write())
    assert setup.name == "small"
    assert setup.model.coordinates == ("shoulder", "elbow")
    assert setup.model.muscles.names == ("flexor",)
    assert setup.model.reserves == (
        em.Reserve("elbow", 20.0, name="elbow_reserve"),
        em.Reserve("shoulder", 5.0, name="shoulder_reserve"),
    )
    settings = setup.settings
    assert (settings.kp, settings.kv) == ((100.0, 400.0), (20.0, 40.0))
    assert settings.coordinate_weights == (1.0, 3.0)
    assert (settings.window, settings.step) == (0.01, 0.001)
    assert settings.normalizer == em.RigidTendonForce()
    assert settings.prediction is em.Prediction.BY_STIFFNESS
    assert settings.control_limits == {"flexor": em.ControlLimits(0.02, 1.0)}
    assert (setup.motion.start, setup.motion.end) == (0.1, 0.4)
    assert setup.results_directory == tmp_path / "results"
    within = (TIMES > 0.1) & (TIMES < 0.4)
    expected = np.column_stack([SHOULDER, ELBOW])[within]
    np.testing.assert_allclose(setup.motion(TIMES[within])[0], expected, rtol=0, atol=1e-15)


def test_the_same_settings_for_co_simulation(write):
    setup = load(write())
    csf = setup.cosimulation(em.Scheme.FULL)
    assert csf.scheme is em.Scheme.FULL and csf.step == 0.01
    assert (csf.kp, csf.kv) == (setup.settings.kp, setup.settings.kv)
    assert csf.control_limits == setup.settings.control_limits
    assert csf.integrator is setup.settings.integrator
    assert setup.cosimulation(em.Scheme.SIMPLIFIED).scheme is em.Scheme.SIMPLIFIED


def test_what_a_setup_leaves_out(write, tmp_path):
    """All that may be left out; the set-up is called as its file, and runs over the motion."""
    needed = ("model_file", "desired_kinematics_file", "task_set_file")
    file = write(**dict.fromkeys(set(SETUP) - set(needed)))
    file.write_text(file.read_text().replace(' name="small"', ""))
    setup = load(file)
    assert setup.name == "setup" and setup.results_directory == tmp_path
    assert setup.model.reserves == ()
    assert (setup.motion.start, setup.motion.end) == (0.0, 0.5)
    assert setup.settings.window == 0.01
    assert setup.settings.normalizer == em.RigidTendonForce()


def test_properties_that_are_empty_are_as_if_left_out(write, tmp_path):
    changes = dict.fromkeys(
        ["force_set_files", "results_directory", "initial_time", "final_time", "cmc_time_window",
         "use_fast_optimization_target", "lowpass_cutoff_frequency", "replace_force_set"], ""
    )  # fmt: skip
    setup = load(write(**changes))
    assert setup.results_directory == tmp_path and setup.model.reserves == ()
    assert (setup.motion.start, setup.motion.end, setup.settings.window) == (0.0, 0.5, 0.01)


def test_no_file_may_be_called_unassigned(write):
    names = ("external_loads_file", "constraints_file", "rra_controls_file", "force_set_files")
    setup = load(write(**dict.fromkeys(names, "Unassigned")))
    assert setup.model.reserves == ()


def test_the_span_from_arguments(write):
    setup = load(write(final_time=None), initial_time=0.2)
    assert (setup.motion.start, setup.motion.end) == (0.2, 0.5)
    setup = load(write(), initial_time=0.0, final_time=0.5)
    assert (setup.motion.start, setup.motion.end) == (0.0, 0.5)


@pytest.mark.parametrize(
    ("changes", "span"),
    [
        ({"final_time": "0.6"}, (0.1, 0.5)),
        ({"final_time": "inf"}, (0.1, 0.5)),
        ({"initial_time": "-1"}, (0.0, 0.4)),
    ],
)
def test_a_span_beyond_the_motion_is_cut_with_a_warning(changes, span, write):
    (tag,) = changes
    with pytest.warns(
        em.SpanWarning, match=rf"line \d+: CMCTool 'small' / {tag}: .*; the run takes"
    ):
        setup = load(write(**changes))
    assert (setup.motion.start, setup.motion.end) == span


def test_a_span_of_ones_own_beyond_the_motion_is_an_error(write):
    message = r"final_time = 0.5 s: the motion spans \[0, 0.5\] s, asked for t = 0.5000001 s"
    with pytest.raises(em.MotionError, match=message):
        load(write(), final_time=0.5000001)
    with pytest.raises(
        em.MotionError, match=r"initial_time = 0.3 s, final_time = 0.2 s: .* is empty"
    ):
        load(write(), initial_time=0.3, final_time=0.2)
    with pytest.raises(em.ParameterError, match=r"initial_time = '0\.1' s is outside"):
        load(write(), initial_time="0.1")


def test_a_muscles_own_limits_stay(write):
    """OpenSim only raises a minimum to 0.02; here a maximum below 1 stays, too."""
    limits = "<min_control>0.2</min_control><max_control>0.8</max_control>"
    model = {"forces": FLEXOR.replace("</Thelen2003Muscle>", f"{limits}</Thelen2003Muscle>")}
    setup = load(write(model=model))
    assert setup.settings.control_limits["flexor"] == em.ControlLimits(0.2, 0.8)


def test_defaults_of_a_file_hold_for_what_its_objects_leave_out(write):
    usual = "<CoordinateActuator><optimal_force>7</optimal_force></CoordinateActuator>"
    given = '<CoordinateActuator name="r"><coordinate>elbow</coordinate></CoordinateActuator>'
    text = members(
        "ActuatorSet", given, reserve("shoulder", 5), before=f"<defaults>{usual}</defaults>"
    )
    setup = load(write(files={"reserves.xml": text}))
    assert [each.optimal_force for each in setup.model.reserves] == [7.0, 5.0]


def test_the_slow_target_and_the_window(write):
    setup = load(write(use_fast_optimization_target="false", cmc_time_window="0.02"))
    assert setup.settings.normalizer == em.MaximumIsometricForce()
    assert (setup.settings.window, setup.settings.step) == (0.02, 0.002)


@pytest.mark.parametrize("cutoff", ["-1", "0", "6"])
def test_low_pass(cutoff, write):
    found = load(write(lowpass_cutoff_frequency=cutoff)).motion
    expected = em.Motion.from_samples(
        TIMES, np.column_stack([SHOULDER, ELBOW]), low_pass=em.LowPass.WINDOWED_SINC,
        cutoff=6.0 if cutoff == "6" else None,
    )  # fmt: skip
    for mine, theirs in zip(found(0.3), expected(0.3), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-11)


def test_a_motion_in_radians_by_state_paths(write):
    text = motion(
        ("/jointset/joint/shoulder/value", SHOULDER), ("/jointset/joint/elbow/value", ELBOW),
        degrees=False,
    )  # fmt: skip
    found = load(write({"motion.mot": text})).motion
    np.testing.assert_array_equal(found(TIMES[24])[0], [SHOULDER[24], ELBOW[24]])


@pytest.mark.parametrize("version", [20302, 30000, 40600, None])
def test_all_versions_and_old_files_without_a_document(version, write):
    plain = {
        "tasks.xml": tasks(task("shoulder"), task("elbow")),
        "reserves.xml": members("ActuatorSet", reserve("elbow"), before="<defaults/>\n"),
        "controls.xml": controls(control("flexor.excitation", default_max=0.5)),
    }
    if version is not None:
        plain = {name: DOCUMENT.format(version, text) for name, text in plain.items()}
    setup = load(write(plain, version=version, constraints_file="controls.xml"))
    assert setup.model.reserves == (em.Reserve("elbow", 20.0, name="elbow_reserve"),)
    assert setup.settings.control_limits == {"flexor": em.ControlLimits(0.02, 0.5)}


def test_file_names_of_windows_and_several_force_sets(write, tmp_path):
    files = {
        "more/elbow.xml": members("ForceSet", reserve("elbow")),
        "more/shoulder.xml": members("ForceSet", reserve("shoulder")),
        "more/my motion.mot": MOTION,
    }
    names = {
        "force_set_files": "more\\elbow.xml\n  more/shoulder.xml",
        "desired_kinematics_file": "\n more\\my motion.mot ",
        "results_directory": "..\\results\\cmc",
    }
    setup = load(write(files, **names))
    assert len(setup.model.reserves) == 2
    assert setup.results_directory == tmp_path / ".." / "results" / "cmc"
    absolute = load(write(files, **names | {"results_directory": str(tmp_path / "here")}))
    assert absolute.results_directory == tmp_path / "here"


# -- Tasks ----------------------------------------------------------------------------------------


def test_what_a_task_leaves_out_has_opensims_values(write):
    text = tasks(task("elbow", kp="", kv=None, ka="1 0 0", on="", weight=""), task("shoulder"))
    settings = load(write({"tasks.xml": text})).settings
    assert (settings.kp, settings.kv) == ((1.0, 1.0), (0.5, 0.5))
    assert settings.coordinate_weights == (1.0, 1.0)


def test_tasks_that_are_off_or_not_active_do_not_matter(write):
    """Whatever they are about."""
    text = tasks(
        task("knee", on="false", kp="strong"),
        '<CMC_Point name="toe"><on>false</on></CMC_Point>',
        task("elbow", active="false true true", kp=7),
        task("elbow", active="", kp=8),
        task("elbow", active=None, kp=9),
        task("elbow", kp=10),
        task("shoulder", active="1"),
    )
    assert load(write({"tasks.xml": text})).settings.kp == (1.0, 10.0)


def test_tasks_without_objects_around_them(write):
    text = f"<CMC_TaskSet>{task('shoulder')}{task('elbow')}<datafile/></CMC_TaskSet>"
    assert load(write({"tasks.xml": text})).settings.kp == (1.0, 1.0)


def test_what_is_locked_or_switched_off_needs_nothing(write):
    """Its task, reserve and controls stay in their files; the motion need not have it."""
    inside = coordinates("shoulder") + coordinates("elbow", inside=LOCKED)
    forces = FLEXOR + muscle(inside=OFF).replace('"muscle"', '"extensor"')
    given = (control(f"{name}.excitation") for name in ("extensor", "flexor", "elbow_reserve"))
    files = {"motion.mot": motion(("shoulder", SHOULDER)), "controls.xml": controls(*given)}
    joints = JOINT.format(kind="UniversalJoint", coordinates=inside, inside="")
    setup = load(
        write(files, {"joints": joints, "forces": forces}, constraints_file="controls.xml")
    )
    assert setup.model.coordinates == ("shoulder",)
    assert setup.settings.kp == (100.0,)
    assert [each.name for each in setup.model.reserves] == ["shoulder_reserve"]
    assert list(setup.settings.control_limits) == ["flexor"]


def test_desired_kinematics_that_contradict_the_model(write):
    """Degrees without a word, of which only the range can tell, and a locked coordinate moves."""
    limits = "<range>-1.5 1.5</range>"
    inside = coordinates("shoulder", inside=limits) + coordinates("elbow", inside=LOCKED + limits)
    joints = JOINT.format(kind="UniversalJoint", coordinates=inside, inside="")
    columns = ("shoulder", np.degrees(SHOULDER) / 3.0), ("elbow", ELBOW)
    file = write({"motion.mot": motion(*columns, degrees=False)}, {"joints": joints})
    with pytest.warns(em.MotionWarning) as caught:
        load(file)
    first, second = (str(each.message) for each in caught)
    assert "motion.mot: coordinate 'shoulder' runs from 0 to 5.73 rad" in first
    assert "beyond its range of [-1.5, 1.5] rad: are these degrees?" in first
    assert "coordinate 'elbow' runs from 0.2 to 0.275 rad, but the model holds it at 0.3" in second
    assert "its range is [-1.5, 1.5] rad" in second


def test_controllers_that_are_switched_off(write):
    controller = "<objects><ControlSetController><enabled>{}</enabled></ControlSetController>"
    load(write(ControllerSet=controller.format("false") + "</objects>"))
    with pytest.raises(em.ModelFileError, match="ControllerSet: this cannot be represented"):
        load(write(ControllerSet=controller.format("true") + "</objects>"))


# -- Control constraints --------------------------------------------------------------------------


def limits(write, text):
    file = write({"controls.xml": text}, constraints_file="controls.xml")
    return load(file).settings.control_limits


def test_limits_by_default(write):
    """Of the class, and for muscles without a control."""
    found = limits(write, controls(control("elbow_reserve")))
    usual = em.ControlLimits(0.02, 1.0)
    assert found == {"flexor": usual, "elbow_reserve": usual}
    assert limits(write, "<ControlSet/>") == {"flexor": usual}


def test_limits_of_the_files_defaults(write):
    defaults = control(
        "default", default_min=-3, default_max=5, use_steps="true", max_nodes=nodes((0, 4))
    )
    text = controls(
        control("elbow_reserve.excitation"),
        control("flexor", default_min=0, default_max=0.5, max_nodes="", use_steps="false"),
        control("shoulder_reserve", default_max="", min_nodes=nodes((0, -1))),
        defaults=defaults,
    )
    assert limits(write, text) == {
        "elbow_reserve": em.ControlLimits(-3.0, ([0.0], [4.0]), steps=True),
        "flexor": em.ControlLimits(0.0, 0.5),
        "shoulder_reserve": em.ControlLimits(([0.0], [-1.0]), ([0.0], [4.0]), steps=True),
    }


@pytest.mark.parametrize("steps", [False, True])
def test_limits_over_time(steps, write):
    """Nodes in any order; what OpenSim keeps beside them does not matter."""
    text = control(
        "flexor.excitation", is_model_control="true", extrapolate="true", filter_on="false",
        use_steps=str(steps).lower(), x_nodes=nodes((0, 0.7)), kp=100, kv=20, default_max=0.9,
        min_nodes=nodes((0.3, 0.2), (0.1, 0.1), (0.2, 0.4)),
    )  # fmt: skip
    found = limits(write, controls(text))["flexor"]
    assert found == em.ControlLimits(([0.1, 0.2, 0.3], [0.1, 0.4, 0.2]), 0.9, steps=steps)
    assert found.at(0.15) == pytest.approx((0.4 if steps else 0.25, 0.9))


# -- What is refused ------------------------------------------------------------------------------

COUPLED = """<ConstraintSet><objects><CoordinateCouplerConstraint name="c">
<coupled_coordinates_function><LinearFunction><coefficients>1 0</coefficients></LinearFunction>
</coupled_coordinates_function><independent_coordinate_names>shoulder</independent_coordinate_names>
<dependent_coordinate_name>elbow</dependent_coordinate_name></CoordinateCouplerConstraint></objects>
</ConstraintSet>"""
BOTH = task("shoulder"), task("elbow")
SPRING = '<ElasticFoundationForce name="spring"/>'


def refused_setup(tag, value, message):
    return {tag: value}, "setup.xml", f"<{tag}>", f"{tag}: {message}"


def refused_tasks(where, message, *given, **changes):
    return {"files": {"tasks.xml": tasks(*given)}, **changes}, "tasks.xml", where, message


def refused_controls(where, message, *given, defaults=""):
    files = {"controls.xml": controls(*given, defaults=defaults)}
    return {"files": files, "constraints_file": "controls.xml"}, "controls.xml", where, message


def refused_forces(where, message, *given, model=None, **more):
    files = {"reserves.xml": members("ForceSet", *given, **more)}
    return {"files": files, "model": model}, "reserves.xml", where, message


MISSING = [
    "model_file", "force_set_files", "external_loads_file", "desired_kinematics_file",
    "task_set_file", "constraints_file",
]  # fmt: skip
REFUSED = [
    *(refused_setup(tag, "nothing.xml", "there is no file ") for tag in MISSING),
    *(refused_setup(tag, "a" * 9000, "there is no file ") for tag in MISSING),  # cannot be one
    refused_setup("force_set_files", "reserves.xml nothing.xml", "there is no file "),
    *(
        refused_setup(tag, "", "it is empty")
        for tag in ("desired_kinematics_file", "task_set_file")
    ),
    *(
        refused_setup(tag, "given.xml", "this cannot be represented")
        for tag in ("rra_controls_file", "desired_points_file")
    ),
    refused_setup("replace_force_set", "perhaps", "expected true or false, got 'perhaps'"),
    refused_setup("use_fast_optimization_target", "true false", "expected true or false"),
    refused_setup("initial_time", "soon", "expected numbers, got 'soon'"),
    refused_setup("lowpass_cutoff_frequency", "6 Hz", "expected numbers, got '6 Hz'"),
    refused_setup("cmc_time_window", "1 2", "expected 1 numbers, got 2"),
    refused_setup("cmc_time_window", "0", "window = 0.0 s is outside"),
    ({"model_file": None}, "setup.xml", "<CMCTool", "it names no model_file: model= does"),
    ({"model_file": ""}, "setup.xml", "<CMCTool", "it names no model_file: model= does"),
    ({"initial_time": "0.45"}, "setup.xml", "<desired_kinematics_file>", "0.45 to 0.4 s is empty"),
    refused_tasks('"knee"', "'knee' cannot be tracked: the model's independent coordinates are "
                  "shoulder, elbow", *BOTH, task("knee")),
    refused_tasks('"elbow"', "'elbow' cannot be tracked: the model's independent coordinates are "
                  "shoulder", *BOTH, model={"rest": COUPLED}, force_set_files=""),
    refused_tasks('"again"', "'elbow' has another task, in line", *BOTH,
                  task("elbow").replace('name="elbow"', 'name="again"')),
    refused_tasks("CMC_Point", "CMC_Point 'toe': this cannot be represented", *BOTH,
                  '<CMC_Point name="toe"/>'),
    refused_tasks("<ka>", "ka: 0: only 1 can be represented", task("elbow", ka="0 1 1")),
    refused_tasks("<kp>", "kp: expected numbers, got 'strong'", task("elbow", kp="strong")),
    refused_tasks("CMC_Joint", "kp = -1.0 1/s^2 is outside", task("elbow", kp=-1)),
    refused_tasks("CMC_Joint", "coordinate_weights = 0.0 is outside", task("elbow", weight=0)),
    refused_tasks("<on>", "on: expected true or false, got 'yes'", task("elbow", on="yes")),
    refused_tasks("<active>", "active: expected true or false", task("elbow", active="y n n")),
    refused_tasks("<coordinate>", "coordinate: it is empty", task("")),
    ({"files": {"tasks.xml": tasks()}}, "setup.xml", "<task_set_file>",
     "no task that is on and active tracks shoulder, elbow"),
    ({"files": {"tasks.xml": tasks(task("elbow", on="false"), task("shoulder", active=None))}},
     "setup.xml", "<task_set_file>", "no task that is on and active tracks shoulder, elbow"),
    refused_tasks("MuscleState", "'flexor.fiber_length': this cannot", *BOTH,
                  '<MuscleStateTrackingTask name="flexor.fiber_length"><active>true</active>'
                  "</MuscleStateTrackingTask>"),
    ({"files": {"tasks.xml": controls()}}, "tasks.xml", "<ControlSet",
     "this is not a CMC_TaskSet file"),
    refused_forces("ElasticF", "ForceSet / ElasticFoundationForce 'spring': this cannot", SPRING),
    refused_forces("<coordinate>", "there is no coordinate 'knee', those are", reserve("knee")),
    refused_forces("<optimal_force>", "expected numbers, got '1,5'", reserve("elbow", "1,5")),
    ({"files": {"reserves.xml": tasks()}}, "reserves.xml", "<CMC_TaskSet",
     "this is not a ForceSet file"),
    refused_controls('"flexor"', "muscle 'flexor': control limits [0.02, 1.5] at t = 0 s are "
                     "outside [0, 1]", control("flexor", default_max=1.5)),
    refused_controls('"flexor"', "control limits [-0.1, 1] at t = 0.2 s are outside [0, 1]",
                     control("flexor", min_nodes=nodes((0, 0), (0.2, -0.1)))),
    refused_controls('"flexor"', "a maximum control of 0.005 at t = 0 s is below",
                     control("flexor", default_min=0, default_max=0.005)),
    refused_controls('"elbow_reserve"', "minimum 2 is above maximum 1 at t = 0 s",
                     control("elbow_reserve", default_min=2)),
    refused_controls('"flexor"', "minimum is a number, or increasing times",
                     control("flexor", min_nodes=nodes((0.1, 0.2), (0.1, 0.3)))),
    refused_controls("<min_nodes>", "value: expected numbers, got 'low'",
                     control("flexor", min_nodes=nodes((0, "low")))),
    refused_controls("<min_nodes>", "there is no t in it",
                     control("flexor", min_nodes="<ControlLinearNode/>")),
    refused_controls("ControlConstant", "this cannot be represented",
                     '<ControlConstant name="flexor"/>'),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "name", "where", "message"), REFUSED)
def test_what_is_refused_is_named_with_file_and_line(changes, name, where, message, write):
    file = write(**changes).with_name(name)
    lines = file.read_text().splitlines()
    number = next(k for k, line in enumerate(lines, 1) if where in line)
    with pytest.raises(em.ModelFileError) as caught:
        load(file.with_name("setup.xml"))
    assert str(caught.value).startswith(f"{file}, line {number}: ")
    assert message in str(caught.value)


def test_a_name_that_is_no_beginning_of_a_file_name(write):
    file = write()
    file.write_text(file.read_text().replace('"small"', '"subject/small"'))
    with pytest.raises(em.ModelFileError, match=r"setup\.xml, line 3: .* has a slash in it"):
        load(file)


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        (motion(("shoulder", SHOULDER)), em.StorageError, "no column for coordinate 'elbow'"),
        (MOTION.replace("0.0\t", "none\t", 1), em.StorageError, "'none' in column"),
        (MOTION.replace("endheader", ""), em.StorageError, "endheader"),
        (motion(("shoulder", SHOULDER), ("elbow", ELBOW * np.nan)), em.MotionError,
         "coordinate 'elbow' is nan at t = 0 s"),
    ],
)  # fmt: skip
def test_motions_that_are_refused(text, error, message, write):
    with pytest.raises(error, match=rf"motion\.mot.*{re.escape(message)}"):
        load(write({"motion.mot": text}))


def test_a_filter_that_the_motion_is_too_short_for(write):
    with pytest.raises(em.MotionError, match=r"motion\.mot: filtering at 1 Hz needs a record"):
        load(write(lowpass_cutoff_frequency="1"))


# -- What is left out or done otherwise, with a warning -------------------------------------------


def told(file, **changes):
    """The set-up, and the text of its one warning."""
    with pytest.warns(em.ExudynMusclesWarning) as caught:
        setup = load(file, **changes)
    (warning,) = caught
    return setup, str(warning.message)


def test_unknown_properties_of_all_files(write):
    for changes, text in (
        ({"time_range": "0 1"}, "CMCTool 'small' / time_range: OpenSim does"),
        ({"files": {"tasks.xml": tasks(task("elbow", gain=3), task("shoulder"))}}, "gain: OpenSim"),
        ({"files": {"controls.xml": controls(control("flexor", curve=1))},
          "constraints_file": "controls.xml"}, "curve: OpenSim does not know"),
        ({"files": {"controls.xml": controls(control("toe.excitation"))},
          "constraints_file": "controls.xml"}, "'toe.excitation': there is no such actuator"),
    ):  # fmt: skip
        _, message = told(write(**changes))
        assert re.search(r"\.xml, line \d+: ", message) and text in message


def test_the_first_of_two_controls_counts(write):
    text = controls(control("flexor.excitation", default_max=0.5), control("flexor"))
    file = write({"controls.xml": text}, constraints_file="controls.xml")
    setup, message = told(file)
    assert setup.settings.control_limits["flexor"] == em.ControlLimits(0.02, 0.5)
    assert "'flexor': this actuator has a control before" in message


def test_a_model_that_the_setup_does_not_name(write, tmp_path):
    file = write(model_file="")
    assert load(file, model=tmp_path / "model.osim").model.coordinates == ("shoulder", "elbow")


def test_a_force_set_in_place_of_the_models(write):
    setup = load(write(replace_force_set="true"))
    assert len(setup.model.muscles) == 0 and len(setup.model.reserves) == 2


def test_actuators_without_control(write):
    """A muscle rests, an ideal actuator does nothing."""
    setup = load(write(actuators_to_exclude="flexor /forceset/elbow_reserve"))
    assert setup.settings.control_limits["flexor"] == em.ControlLimits(0.01, 0.01)
    assert [each.name for each in setup.model.reserves] == ["shoulder_reserve"]


def test_a_coordinate_without_a_task_follows_the_kinematics(write):
    """By an ideal actuator, which leaves nothing to do to the muscles there."""
    files = {"tasks.xml": tasks(task("elbow", kp=400, kv=40))}
    setup, message = told(write(files))
    assert "no task that is on and active tracks shoulder, which OpenSim leaves" in message
    *_, held = setup.model.reserves
    assert (held.name, held.coordinate, held.optimal_force) == ("shoulder_held", "shoulder", 1e5)
    assert setup.settings.kp == (400.0, 400.0) and setup.settings.kv == (40.0, 40.0)
    result = em.static_optimization(setup.model, setup.motion)
    assert result.coordinates[5, 0] == pytest.approx(setup.motion(result.time[5])[0][0], abs=1e-12)


def test_a_prescribed_coordinate_follows_its_function(write):
    """It needs no task, no column of the kinematics, and leaves the muscles alone."""
    line = "<LinearFunction><coefficients>0.5 -0.1</coefficients></LinearFunction>"
    inside = f"<prescribed_function>{line}</prescribed_function><prescribed>true</prescribed>"
    both = coordinates("shoulder", inside=inside) + coordinates("elbow")
    joints = JOINT.format(kind="UniversalJoint", coordinates=both, inside="")
    files = {"tasks.xml": tasks(task("elbow", kp=100, kv=20)),
             "motion.mot": motion(("elbow", ELBOW))}  # fmt: skip
    setup, message = told(write(files, {"joints": joints}))
    assert "'shoulder' / prescribed: OpenSim moves this coordinate by its function" in message
    assert setup.model.reserves[-1].name == "shoulder_held"
    q, v, a = setup.motion(0.2)
    np.testing.assert_allclose([q[0], v[0], a[0]], [0.0, 0.5, 0.0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(setup.motion(TIMES[24])[0][1], ELBOW[24], rtol=0, atol=1e-12)
    result = em.cosimulate(setup.model, setup.motion, settings=setup.cosimulation(em.Scheme.FULL))
    assert result.max_unmet_torque == 0.0 and result.tracking_error_rms()[0] < 1e-4
    # Without a function it is not prescribed.
    joints = joints.replace(line, "")
    load(write({"tasks.xml": FILES["tasks.xml"], "motion.mot": MOTION}, {"joints": joints}))


def test_a_last_part_shorter_than_a_window(write):
    setup, message = told(write(final_time="0.404"))
    assert "the last 4 ms of the span are less than a window and are left out" in message
    assert setup.motion.end == 0.404


def test_what_can_only_be_degrees_is_asked_back(write):
    inside = coordinates("shoulder", inside="<range>-1 1</range>") + coordinates("elbow")
    joints = JOINT.format(kind="UniversalJoint", coordinates=inside, inside="")
    columns = ("shoulder", np.degrees(SHOULDER)), ("elbow", np.degrees(ELBOW))
    file = write({"motion.mot": motion(*columns, degrees=False)}, {"joints": joints})
    with pytest.raises(em.MotionError, match=r"'shoulder' runs from 0 to 17.* are these degrees\?"):
        load(file)
    expected = np.column_stack([SHOULDER, ELBOW])[24]
    found = load(file, in_degrees=True).motion(TIMES[24])[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    found = load(file, in_degrees=False).motion(TIMES[24])[0]
    np.testing.assert_allclose(found, np.degrees(expected), rtol=0, atol=1e-10)


EMG = '<MuscleStateTrackingTask name="{}.activation"><active>true false false</active></{}>'
ACTIVATIONS = 0.2 + 0.1 * np.sin(3.0 * TIMES)


def test_activations_that_are_tracked_are_given(write, tmp_path):
    """The muscle gets the excitations that lead there; the others do the rest."""
    tag = "MuscleStateTrackingTask"
    text = members(
        "CMC_TaskSet", task("shoulder", kp=100, kv=20), task("elbow", kp=100, kv=20),
        EMG.format("flexor", tag), before="<datafile>emg.sto</datafile>\n",
    )  # fmt: skip
    file = write({"tasks.xml": text})
    em.Storage("emg", ("flexor.activation",), TIMES, ACTIVATIONS[:, None]).write(
        tmp_path / "emg.sto"
    )
    setup, message = told(file)
    assert "'flexor.activation': the muscle is given the excitations" in message
    result = em.computed_muscle_control(setup.model, setup.motion, settings=setup.settings)
    later = result.time > 0.2  # it begins at a steady activation
    expected = np.interp(result.time, TIMES, ACTIVATIONS)
    np.testing.assert_allclose(result.activations[later, 0], expected[later], rtol=0, atol=2e-3)
    assert result.max_unmet_torque == 0.0
    em.Storage("emg", ("toe.activation",), TIMES, ACTIVATIONS[:, None]).write(tmp_path / "emg.sto")
    with (
        pytest.warns(em.ModelFileWarning, match="given the excitations"),
        pytest.raises(em.ModelFileError, match=r"its file has no column 'flexor\.activation'"),
    ):
        load(file)
    (tmp_path / "emg.sto").unlink()
    with pytest.raises(em.ModelFileError, match=r"datafile: there is no file .*emg\.sto"):
        load(file)


def test_an_activation_of_no_muscle(write, tmp_path):
    text = members(
        "CMC_TaskSet", *BOTH, EMG.format("toe", "MuscleStateTrackingTask"),
        before="<datafile>motion.mot</datafile>\n",
    )  # fmt: skip
    _, message = told(write({"tasks.xml": text}))
    assert "there is no muscle 'toe', and the task is left out" in message


# -- The command line -----------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["cmc", "csf", "css"])
def test_results_go_where_the_setup_says(method, write, tmp_path, capsys):
    file = write(results_directory="results/of/today")
    assert main(["cmc", str(file), "--method", method, "--final-time", "0.15"]) == 0
    folder = tmp_path / "results" / "of" / "today"
    result = em.Trajectory.load(folder / f"small_{method}.npz")
    assert (result.time[0], result.time[-1]) == (0.1, pytest.approx(0.15))
    assert result.max_unmet_torque == 0.0
    assert result.tracking_error_rms().max() < 6e-5
    printed = capsys.readouterr().out
    assert f"small, {method.upper()}: complete, t = 0.1 to 0.15 s" in printed
    controls = em.read_storage(folder / f"small_{method}_controls.sto")
    assert controls.labels == ("flexor", "elbow_reserve", "shoulder_reserve")


def test_results_go_where_the_command_says(write, tmp_path):
    options = ["--initial-time", "0.2", "--final-time", "0.22", "--out", str(tmp_path / "a" / "b")]
    assert main(["cmc", str(write()), *options]) == 0
    assert em.Trajectory.load(tmp_path / "a" / "b" / "small_cmc.npz").time[0] == 0.2
    assert not (tmp_path / "results").exists()


def test_a_model_and_a_unit_from_the_command_line(write, tmp_path):
    columns = ("shoulder", np.degrees(SHOULDER) / 20.0), ("elbow", np.degrees(ELBOW) / 20.0)
    file = write({"motion.mot": motion(*columns, degrees=False)}, model_file="")
    options = ["--model", str(tmp_path / "model.osim"), "--angles", "degrees"]
    span = ["--final-time", "0.12", "--out", str(tmp_path / "out")]
    assert main(["cmc", str(file), *options, *span]) == 0
    found = em.Trajectory.load(tmp_path / "out" / "small_cmc.npz").coordinates[0]
    expected = np.array([SHOULDER[12], ELBOW[12]]) / 20.0
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "options", "message"),
    [
        ({}, ["--initial-time", "0.6"], r"initial_time = 0\.6 s, final_time = 0\.4 s: .* is empty"),
        ({}, ["--initial-time", "0.6", "--final-time", "0.7"],
         r"initial_time = .*the motion spans \[0, 0\.5\] s, asked for t = 0\.7 s"),
        ({}, ["--initial-time", "nan"], r"initial_time = nan s is outside"),
        ({"task_set_file": "nothing.xml"}, [], r"setup\.xml, line 22: .*there is no file"),
        ({"files": {"tasks.xml": "<CMC_TaskSet>"}}, [], r"tasks\.xml: not well-formed XML"),
        ({"files": {"motion.mot": "motion"}}, [], r"motion\.mot"),
    ],
)  # fmt: skip
def test_a_bad_setup_is_one_line_and_nothing_runs(
    changes, options, message, write, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr("exudyn_muscles.methods.cmc.simulate", None)
    assert main(["cmc", str(write(**changes)), *options, "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert re.match(rf"exudyn-muscles: error: .*{message}", line)
    assert not (tmp_path / "out").exists()


def test_a_setup_that_is_not_there(tmp_path, capsys):
    assert main(["cmc", str(tmp_path / "none.xml")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"exudyn-muscles: error: {tmp_path / 'none.xml'}: No such file or directory"


def test_a_results_directory_that_cannot_be_made(write, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("exudyn_muscles.methods.cmc.simulate", None)
    assert main(["cmc", str(write(results_directory="model.osim"))]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"exudyn-muscles: error: {tmp_path / 'model.osim'}: File exists"


def test_a_span_without_a_window(write, capsys, monkeypatch):
    monkeypatch.setattr("exudyn_muscles.methods.cmc.simulate", None)
    assert main(["cmc", str(write()), "--final-time", "0.105"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("step = 0.01 s is longer than the span of 0.005 s")
