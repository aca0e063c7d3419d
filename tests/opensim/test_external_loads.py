"""OpenSim's external loads: bodies, frames and columns by name, and a leg with its ground force."""

import re

import exudyn as exu
import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

import exudyn_muscles as em
from exudyn_muscles.opensim.document import read_document

from ..differences import gradient
from ..opensim import ABSENT, REFERENCE, needs_opensim_files
from ..opensim_models import rebuilt

# A pendulum about z, and a body welded to it.
OFFSET, ANGLES = np.array([0.3, -0.1, 0.2]), np.array([0.4, -0.5, 0.6])
BODY = """
<Body name="{}"><mass>2</mass><mass_center>0.1 0 0</mass_center><inertia>1 1 1 0 0 0</inertia>
</Body>"""
MODEL = f"""<OpenSimDocument Version="40000"><Model name="model">
<BodySet><objects>{BODY.format("thigh")}{BODY.format("foot")}</objects></BodySet>
<JointSet><objects><PinJoint name="hip"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>/bodyset/thigh</socket_child_frame>
<coordinates><Coordinate name="angle"/></coordinates></PinJoint>
<WeldJoint name="ankle"><socket_parent_frame>before</socket_parent_frame>
<socket_child_frame>/bodyset/foot</socket_child_frame><frames>
<PhysicalOffsetFrame name="before"><socket_parent>/bodyset/thigh</socket_parent>
<translation>{" ".join(map(str, OFFSET))}</translation>
<orientation>{" ".join(map(str, ANGLES))}</orientation></PhysicalOffsetFrame></frames></WeldJoint>
</objects></JointSet><ForceSet><objects><Thelen2003Muscle name="muscle"><GeometryPath>
<PathPointSet><objects><PathPoint name="a"><socket_parent_frame>/ground</socket_parent_frame>
<location>0.5 0.1 0</location></PathPoint><PathPoint name="b">
<socket_parent_frame>/bodyset/thigh</socket_parent_frame><location>0 0.1 0.2</location></PathPoint>
</objects></PathPointSet></GeometryPath></Thelen2003Muscle></objects></ForceSet></Model></OpenSimDocument>"""

FORCE = {
    "isDisabled": "false", "applied_to_body": "foot", "force_expressed_in_body": "ground",
    "point_expressed_in_body": "ground", "force_identifier": "f_", "point_identifier": "p_",
    "torque_identifier": "m_", "data_source_name": "Unassigned",
}  # fmt: skip
TIMES = np.linspace(0.0, 1.0, 6)
LABELS = [f"{what}_{x}" for what in ("f", "1_f", "p", "m") for x in "xyz"]
VALUES = np.random.default_rng(3).normal(size=(6, 12))
F, P, M = VALUES[:, :3], VALUES[:, 6:9], VALUES[:, 9:]
DOCUMENT = '<OpenSimDocument Version="{}">\n{}</OpenSimDocument>'


def force(name="push", **changes):
    parts = {key: value for key, value in (FORCE | changes).items() if value is not None}
    inside = "\n".join(f"<{key}> {value} </{key}>" for key, value in parts.items())
    return f'<ExternalForce name="{name}">\n{inside}\n</ExternalForce>'


@pytest.fixture
def write(tmp_path):
    """Writes the model, the data and a file of external loads; returns the model and that file."""
    (tmp_path / "model.osim").write_text(MODEL)
    (tmp_path / "data").mkdir()
    em.Storage("plate", LABELS, TIMES, VALUES).write(tmp_path / "data" / "plate.mot")

    def write_file(*forces, version=30000, datafile="data/plate.mot", rest="", **changes):
        named = "" if datafile is None else f"<datafile> {datafile} </datafile>"
        inside = "\n".join(forces or [force(**changes)])
        loads = f"<ExternalLoads>\n<objects>\n{inside}\n</objects>\n{named}{rest}"
        loads += "</ExternalLoads>"
        file = tmp_path / "loads.xml"
        file.write_text(DOCUMENT.format(version, loads) if version else loads)
        return tmp_path / "model.osim", file

    return write_file


def Q(files, q, t):
    """The load's moment about the pin, from the inverse dynamics with and without it."""
    plain, loaded = (
        em.opensim.load_model(files[0], external_loads=file).skeleton for file in (None, files[1])
    )
    with plain.opened(), loaded.opened():
        (_, without), (_, within) = (
            skeleton.dynamics_at(np.array([q]), np.zeros(1), t)[:2] for skeleton in (plain, loaded)
        )
    return (without - within)[0]


def pose(body, q):
    R = Rotation.from_rotvec([0.0, 0.0, q]).as_matrix()
    if body == "foot":
        return R @ Rotation.from_euler("XYZ", ANGLES).as_matrix(), R @ OFFSET
    return (R, np.zeros(3)) if body == "thigh" else (np.eye(3), np.zeros(3))


@pytest.mark.parametrize("force_in", ["ground", "thigh", "foot"])
@pytest.mark.parametrize("point_in", ["ground", "thigh", "/bodyset/foot"])
def test_frames_are_found_by_the_bodies_names(write, force_in, point_in):
    """A body behind a weld is on another one's link, and its frame is turned there."""
    files = write(force_expressed_in_body=force_in, point_expressed_in_body=point_in)
    for k, q in ((1, 0.3), (4, -1.2)):
        R, (R_p, o_p) = pose(force_in, q)[0], pose(point_in.split("/")[-1], q)
        expected = np.cross(o_p + R_p @ P[k], R @ F[k]) + R @ M[k]
        assert Q(files, q, TIMES[k]) == pytest.approx(expected[2], abs=1e-12)


def test_what_is_left_out(write):
    k, q = 2, 0.7
    origin = pose("foot", q)[1]
    for changes, expected in (
        ({"point_identifier": "Unassigned"}, np.cross(origin, F[k]) + M[k]),
        ({"point_identifier": None, "torque_identifier": ""}, np.cross(origin, F[k])),
        ({"force_identifier": "", "point_identifier": ""}, M[k]),
        ({"force_expressed_in_body": None}, np.cross(P[k], F[k]) + M[k]),
        ({"point_expressed_in_body": ""}, np.cross(P[k], F[k]) + M[k]),
        ({"isDisabled": "true"}, np.zeros(3)),
        ({"isDisabled": None, "appliesForce": "false"}, np.zeros(3)),
    ):
        assert Q(write(**changes), q, TIMES[k]) == pytest.approx(expected[2], abs=1e-12)
    assert Q(write(isDisabled="true", datafile="nothing.mot"), q, TIMES[k]) == 0.0


def test_several_forces_and_every_version(write):
    k, q = 3, -0.4
    both = force(), force("other", force_identifier="1_f_", torque_identifier="")
    expected = np.cross(P[k], F[k]) + M[k] + np.cross(P[k], VALUES[k, 3:6])
    for version in (20302, 30000, 40000, None):  # None: an old file, with nothing around it
        found = Q(write(*both, version=version), q, TIMES[k])
        assert found == pytest.approx(expected[2], abs=1e-12)


def test_old_kinematics_are_not_used(write):
    """As in OpenSim 4, where a point of ground is applied at the pose of the body."""
    tags = "external_loads_model_kinematics_file", "lowpass_cutoff_frequency_for_load_kinematics"
    rest = "".join(f"<{tag}>{x}</{tag}>" for tag, x in zip(tags, ("..\\ik.mot", "6"), strict=True))
    for q in (0.2, 1.0):
        found = Q(write(rest=rest, datafile="data\\plate.mot"), q, TIMES[1])
        assert found == pytest.approx((np.cross(P[1], F[1]) + M[1])[2], abs=1e-12)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"applied_to_body": "hand"}, "line 6: ExternalLoads / ExternalForce 'push' / "
         "applied_to_body: there is no frame 'hand'"),
        ({"applied_to_body": ""}, "applied_to_body: it is empty"),
        ({"applied_to_body": None}, "there is no applied_to_body in it"),
        ({"force_expressed_in_body": "a"}, "line 7: ExternalLoads / ExternalForce 'push' / "
         "force_expressed_in_body: there is no frame 'a'"),
        ({"point_expressed_in_body": "a"}, "point_expressed_in_body: there is no frame 'a'"),
        ({"force_identifier": "g_"}, "force_identifier: {data}: 0 columns begin with 'g_', but a "
         "vector needs three; the columns are f_x, f_y, f_z, 1_f_x"),
        ({"point_identifier": "p_x"}, "point_identifier: {data}: 1 columns begin with 'p_x'"),
        ({"torque_identifier": "M"}, "torque_identifier: {data}: 0 columns begin with 'M'"),
        ({"force_identifier": ""}, "ExternalForce 'push': {data}: external force 'push': needs a "
         "force at its point"),
        ({"force_identifier": "", "point_identifier": "", "torque_identifier": ""},
         "needs a force or a torque"),
        ({"isDisabled": "perhaps"}, "isDisabled: expected true or false, got 'perhaps'"),
        ({"datafile": "no.mot"}, "datafile: there is no file"),
        ({"datafile": "a" * 9000}, "datafile: there is no file"),
        ({"datafile": None}, "ExternalLoads: there is no datafile in it"),
        ({"datafile": ""}, "datafile: it is empty"),
        ({"version": 10000}, "format version '10000' is none that OpenSim 4 reads"),
    ],
)  # fmt: skip
def test_damaged_files_say_where(write, given, message):
    files = write(**given)
    message = message.format(data=files[1].parent / "data" / "plate.mot")
    with pytest.raises(em.ModelFileError, match=re.escape(message)) as caught:
        em.opensim.load_model(files[0], external_loads=files[1])
    assert str(caught.value).startswith(f"{files[1]}, line ")


def test_forces_that_are_none(write):
    for forces, message in (
        (['<PrescribedForce name="old"/>'], "PrescribedForce 'old': this cannot be represented"),
    ):
        model, file = write(*forces)
        with pytest.raises(em.ModelFileError, match=re.escape(message)):
            em.opensim.load_model(model, external_loads=file)


def test_forces_that_are_left_out_or_renamed(write):
    model, file = write(force(), force())
    with pytest.warns(em.ModelFileWarning, match="ExternalForce 'push': this name is taken"):
        loaded = em.opensim.load_model(model, external_loads=file)
    assert loaded.mbs.systemData.NumberOfLoads() == 4
    model, file = write(applied_to_body="ground")
    with pytest.warns(em.ModelFileWarning, match="applied_to_body: ground does not move"):
        loaded = em.opensim.load_model(model, external_loads=file)
    assert loaded.mbs.systemData.NumberOfLoads() == 0
    model, file = write(strange="1")
    with pytest.warns(em.ModelFileWarning, match="strange: OpenSim does not know"):
        em.opensim.load_model(model, external_loads=file)


def test_damaged_data(write):
    model, file = write()
    data = file.parent / "data" / "plate.mot"
    unknown = np.zeros_like(VALUES)
    unknown[2, 7] = np.nan
    em.Storage("plate", LABELS, TIMES, VALUES + unknown).write(data)
    message = r"ExternalForce 'push': .*plate\.mot: .*'push': point must be finite, row 2"
    with pytest.raises(em.ModelFileError, match=message):
        em.opensim.load_model(model, external_loads=file)
    data.write_text("nothing")
    with pytest.raises(em.StorageError, match=r"plate\.mot: no line 'endheader'"):
        em.opensim.load_model(model, external_loads=file)
    with pytest.raises(FileNotFoundError):
        em.opensim.load_model(model, external_loads=file.parent / "none.xml")
    with pytest.raises(em.ModelFileError, match="there is no ExternalLoads in it"):
        em.opensim.load_model(model, external_loads=model)


def test_documents_of_several_kinds(tmp_path):
    file = tmp_path / "actuators.xml"
    for text in (DOCUMENT.format(30000, "<ForceSet/>"), "<ForceSet/>"):
        file.write_text(text)
        assert read_document(file, "ActuatorSet", "ForceSet").tag == "ForceSet"
    with pytest.raises(em.ModelFileError, match="this is not a CMCTool or Other file of OpenSim"):
        read_document(file, "CMCTool", "Other")
    file.write_text(DOCUMENT.format(30000, "<ForceSet/>"))
    with pytest.raises(em.ModelFileError, match="there is no CMCTool or Other in it"):
        read_document(file, "CMCTool", "Other")
    file.write_text("<Model/>")  # which version of the joints would that be?
    with pytest.raises(em.ModelFileError, match="this is not a model file"):
        read_document(file)


# -- A measured step ------------------------------------------------------------------------------

STANCE = REFERENCE.parent / "cmc" / "leg6dof9musc_stance"


@pytest.fixture(scope="module")
def legs():
    """Without and with the ground's force."""
    if not STANCE.is_dir():
        pytest.skip(ABSENT)
    return [
        em.opensim.load_model(STANCE / "leg6dof9musc_added_mass.osim", external_loads=loads)
        for loads in (None, STANCE / "leg69_right_grf.xml")
    ]


def plate(t):
    """The record at time t, from the file's columns."""
    storage = em.read_storage(STANCE / "leg69_stance_grf.mot")
    columns = [
        storage.labels.index(f"ground_{what}{x}")
        for what in ("force_v", "force_p", "torque_")
        for x in "xyz"
    ]
    curve = make_interp_spline(storage.time, storage.values[:, columns], bc_type="natural")
    return curve(t).reshape(3, 3)


@needs_opensim_files
def test_the_grounds_force_on_a_leg(legs):
    """J^T f from Exudyn's own pose of the foot, by differences over the six coordinates."""
    plain, loaded = legs
    mbs, skeleton = loaded.mbs, loaded.skeleton
    foot = mbs.GetLoad(0)["markerNumber"]

    def frame(z):
        q = mbs.systemData.GetODE2Coordinates()
        (q[skeleton.rows],) = loaded.state_of_tree(z)
        mbs.systemData.SetODE2Coordinates(q)
        R = mbs.GetMarkerOutput(foot, exu.OutputVariableType.RotationMatrix).reshape(3, 3)
        return R, mbs.GetMarkerOutput(foot, exu.OutputVariableType.Position)

    motion = em.Motion.from_file(
        STANCE / "leg6dof9musc_adjusted_Kinematics_q.sto", plain.coordinates, plain.skeleton.units
    )
    with plain.skeleton.opened(), loaded.skeleton.opened():
        for t in np.linspace(0.81, 1.24, 5):
            z, v, _ = motion(t)
            (M, without), (M_loaded, within) = (
                each.skeleton.dynamics_at(z, v, t)[:2] for each in legs
            )
            np.testing.assert_array_equal(M, M_loaded)
            f, p, tau = plate(t)
            assert f[1] > 500.0  # N, a step
            R, o = frame(z)
            on_foot = R.T @ (p - o)
            J = gradient(lambda x, r=on_foot: frame(x)[1] + frame(x)[0] @ r, z, 1e-3)
            spin = np.einsum("abk,cb->ack", gradient(lambda x: frame(x)[0], z, 1e-3), R)
            W = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
            np.testing.assert_allclose(without - within, J.T @ f + W.T @ tau, rtol=0, atol=1e-7)


@needs_opensim_files
def test_a_measured_step_hardly_needs_residuals(legs):
    """Without the ground's force they carry a body's weight."""
    strengths = {"pelvis_tx": 300.0, "pelvis_ty": 1000.0, "pelvis_tilt": 100.0}
    peaks = []
    for each in legs:
        reserves = [em.Reserve(name, strength) for name, strength in strengths.items()]
        reserves += [em.Reserve(name, 1.0) for name in each.coordinates[3:]]
        model = rebuilt(each, each.muscles, reserves)
        motion = em.Motion.from_file(
            STANCE / "leg6dof9musc_adjusted_Kinematics_q.sto",
            model.coordinates,
            model.skeleton.units,
        )
        result = em.cosimulate(
            model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL)
        )
        assert result.tracking_error_rms().max() < 1.5e-4
        peaks.append(np.abs(result.reserves).max(axis=0))
    assert peaks[0][1] > 700.0 and peaks[1][1] < 25.0 and peaks[1][[0, 2]].max() < 12.0


def test_points_that_are_unknown_where_there_is_no_force(write, tmp_path):
    """They stay as they were before, and before the first force they are zero; torques, too."""
    values = VALUES.copy()
    values[[0, 3, 4], :3] = 0.0
    values[[0, 3], 6:] = np.nan
    known = values.copy()
    known[0, 6:], known[3, 6:] = 0.0, values[2, 6:]
    found = []
    for table in (known, values):
        files = write()
        em.Storage("plate", LABELS, TIMES, table).write(tmp_path / "data" / "plate.mot")
        if table is values:
            with pytest.warns(em.ModelFileWarning, match="where there is no force stay as before"):
                found.append(Q(files, 0.4, 0.55))
        else:
            found.append(Q(files, 0.4, 0.55))
    np.testing.assert_array_equal(*found)
    values[1, 6:] = np.nan
    em.Storage("plate", LABELS, TIMES, values).write(tmp_path / "data" / "plate.mot")
    unknown = pytest.raises(em.ModelFileError, match="point must be finite, row 1 is")
    with pytest.warns(em.ModelFileWarning), unknown:
        em.opensim.load_model(files[0], external_loads=files[1])
