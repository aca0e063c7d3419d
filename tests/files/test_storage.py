"""Storage files: read as OpenSim reads them, written and read again to the last bit, refused by
line; results under OpenSim's names."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import exudyn_muscles as em
from models import pendulum

from ..opensim import REFERENCE, needs_opensim_files
from ..runs import KP

CMC = REFERENCE.parent / "cmc"
TABLE = "time\telbow\ttx\n0\t90\t1\n0.5\t180\t2\n"
OLD = "nRows=2\nnColumns=3\nendheader\n"


@pytest.fixture
def read(tmp_path):
    """Reads a text as a storage file."""

    def write(text, name="file.sto"):
        file = tmp_path / name
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return em.read_storage(file)

    return write


def same_bits(a, b):
    return np.array_equal(a.view(np.uint64), b.view(np.uint64))


# -- round trip -----------------------------------------------------------------------------------

WORDS = st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=8)
NUMBERS = st.floats(width=64).map(lambda x: math.nan if math.isnan(x) else x)


@st.composite
def storages(draw):
    labels = draw(st.lists(WORDS, min_size=1, max_size=4))
    times = draw(st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=5, unique=True))
    rows = [draw(st.lists(NUMBERS, min_size=len(labels), max_size=len(labels))) for _ in times]
    name = " ".join(draw(st.lists(st.text("abz_- 1.", min_size=1), max_size=3))).split()
    return em.Storage(" ".join(name), labels, sorted(times), rows, draw(st.booleans()))


@given(storages())
def test_what_is_written_is_read_to_the_last_bit(tmp_path_factory, storage):
    file = tmp_path_factory.getbasetemp() / "round_trip.sto"
    storage.write(file)
    again = em.read_storage(file)
    assert (again.name, again.labels) == (storage.name, storage.labels)
    assert again.in_degrees is storage.in_degrees
    assert same_bits(again.time, storage.time)
    assert same_bits(again.values, storage.values)


def test_the_file_is_as_opensim_writes_it(tmp_path):
    em.Storage("Coordinates", ["a", "b"], [0, 0.1], [[1, math.nan], [2, 1e-7]], True).write(
        tmp_path / "q.sto"
    )
    assert (tmp_path / "q.sto").read_bytes() == (
        b"Coordinates\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\nendheader\n"
        b"time\ta\tb\n0.0\t1.0\tnan\n0.1\t2.0\t1e-07\n"
    )


# -- headers --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "name", "in_degrees"),
    [
        ("motion\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\nendheader\n", "motion", True),
        ("my motion\nversion=1\ninDegrees=no\nendheader\n", "my motion", False),
        ("motion\nversion=1\nendheader\n", "motion", False),
        ("motion\nversion=1\n\nUnits are S.I. units\nAngles are in degrees.\nendheader\n",
         "motion", True),
        ("DataType=double\nversion=3\nOpenSimVersion=4.5\nendheader\n", "", False),
        ("inDegrees=yes\nDataType=double\nversion=3\nOpenSimVersion=4.5\nendheader\n", "", True),
        ("# by hand\nendheader\n", "", False),
        ("endheader\n", "", False),
        ("old\n" + OLD, "old", False),
        ("old\nnr=2\nnc=3\nendheader\n\n\n", "old", False),
        ("first\nnRows=2\n# SIMM Motion File Header:\nname second\ndatarows 2\nrange 0 0.5\n"
         "endheader\n", "second", False),
        ("tabs\t\t\nversion=1\t\t\nnRows = 2\t\nInDegrees = Y \t\nendheader\t\n", "tabs", True),
    ],
)  # fmt: skip
def test_headers(read, header, name, in_degrees):
    storage = read(header + TABLE)
    assert storage.name == name
    assert storage.in_degrees is in_degrees
    assert storage.labels == ("elbow", "tx")
    np.testing.assert_array_equal(storage.time, [0.0, 0.5])
    np.testing.assert_array_equal(storage.values, [[90.0, 1.0], [180.0, 2.0]])


def test_a_motion_file_without_a_version_is_in_degrees(read):
    """As OpenSim has it; an explicit word counts more."""
    assert read("old\n" + OLD + TABLE, "old.mot").in_degrees
    assert not read("old\nversion=1\n" + OLD + TABLE, "new.mot").in_degrees
    assert not read("old\ninDegrees=no\n" + OLD + TABLE, "said.mot").in_degrees
    assert not read("old\nAngles are in radians.\n" + OLD + TABLE, "said.mot").in_degrees


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace(b"\n", b"\r\n"),
        lambda text: text.replace(b"\n", b" \t\n"),
        lambda text: text.replace(b"\t", b"   "),
        lambda text: text.replace(b"\n0", b"\n  0"),
        lambda text: text.replace(b"\n", b"\n\n"),
        lambda text: b"\xef\xbb\xbf" + text,
        lambda text: text.replace(b"endheader", b"in \xb0\nendheader"),
        lambda text: text.rstrip(b"\n"),
        lambda text: text.replace(b"time", b"Time"),
        lambda text: text.replace(b"180", b"1.8E+02"),
    ],
)
def test_what_editors_and_programs_do_to_files(read, change):
    storage = read(change(("old\n" + OLD + TABLE).encode()))
    assert (storage.name, storage.labels) == ("old", ("elbow", "tx"))
    np.testing.assert_array_equal(storage.values, [[90.0, 1.0], [180.0, 2.0]])


def test_nan_is_a_value(read):
    assert np.isnan(read("endheader\ntime a\n0 nan\n1 NaN\n").values).all()


def test_of_rows_with_one_time_the_last_counts(read):
    """OpenSim's own results end with the last row twice."""
    storage = read("nRows=4\nendheader\ntime a\n0 1\n0 2\n1 3\n1 4\n")
    np.testing.assert_array_equal(storage.time, [0.0, 1.0])
    np.testing.assert_array_equal(storage.values, [[2.0], [4.0]])


# -- damaged files --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"file\.sto: no line 'endheader', so this is not a storage file"),
        (TABLE, "no line 'endheader'"),
        ("endheader\n", "no rows after 'endheader' in line 1"),
        ("x\nendheader\n\ntime a\n", "no rows after 'endheader' in line 2"),
        ("endheader\nt a\n0 1\n", r"file\.sto, line 2: the first column must be 'time', it is 't'"),
        ("nRows=many\nendheader\ntime a\n0 1\n", "line 1: expected a whole number, got 'many'"),
        ("nRows\nendheader\ntime a\n0 1\n", "line 1: expected a whole number, got ''"),
        ("endheader\ntime a b\n0 1 2\n1 2\n", "line 4: 2 values for 3 columns"),
        ("endheader\ntime a b\n0 1 2\n\n1 2 3 4\n", "line 5: 4 values for 3 columns"),
        ("endheader\ntime a b\n0 1 2\n1 2 1,5\n", "line 4: '1,5' in column 'b' is no number"),
        ("endheader\ntime a b\nx 1 2\n", "line 3: 'x' in column 'time' is no number"),
        ("endheader\ntime a\n0 1\n0.2 1\n0.1 2\n", r"line 5: time must increase, 0\.1 s follows"),
        ("endheader\ntime a\n0 1\nnan 1\n", "line 4: time must increase, nan s follows 0"),
        ("endheader\ntime a\ninf 1\n", "line 3: time must increase, inf s"),
        ("a\ninDegrees=maybe\nendheader\ntime a\n0 1\n", "line 2: inDegrees=maybe, expected yes"),
        ("DataType=Vec3\nendheader\ntime a\n0 1,2,3\n", "line 1: DataType=Vec3, only double"),
    ],
)  # fmt: skip
def test_damaged_files(read, text, message):
    with pytest.raises(em.StorageError, match=message):
        read(text)


@pytest.mark.parametrize("said", [1, 3])
def test_other_rows_than_announced(said, read):
    """All that are there count, as in OpenSim."""
    text = f"nRows={said}\nendheader\ntime a\n0 1\n1 2\n"
    with pytest.warns(em.StorageWarning, match=rf"line 1: nRows={said}, but there are 2 rows"):
        assert read(text).values[:, 0].tolist() == [1.0, 2.0]


def test_what_is_written_below_the_announced_rows(read):
    """A note of who has published the file."""
    text = "nRows=2\nendheader\ntime a b\n0 1 2\n1 2 3\n\t\n\tlargest\t3\n"
    with pytest.warns(em.StorageWarning, match="are 3 rows, of which the first 2 are read"):
        assert read(text).values.tolist() == [[1.0, 2.0], [2.0, 3.0]]
    with pytest.raises(em.StorageError, match="line 6: 2 values for 3 columns"):
        read(text.replace("nRows=2", "nRows=3").replace("\t\n", ""))


@pytest.mark.filterwarnings("ignore::exudyn_muscles.StorageWarning")
def test_a_header_that_announces_nothing_above_labels_of_their_own(read):
    """As OpenSim 4.6's CMC has left its states."""
    with pytest.raises(em.StorageError, match="line 3: what follows are no rows of 1 numbers"):
        read("nRows=0\nendheader\ntime\n/forceset/a/activation\n0 1\n")


def test_what_a_spreadsheet_could_not_compute_is_unknown(read):
    with pytest.warns(em.StorageWarning, match="3 cells hold no numbers but a spreadsheet's"):
        found = read("endheader\ntime a b\n0 #NAME? 2\n1 #N/A #DIV/0!\n").values
    np.testing.assert_array_equal(found, [[np.nan, 2.0], [np.nan, np.nan]])
    with pytest.raises(em.StorageError, match="'#x' in column 'a' is no number"):
        read("endheader\ntime a\n0 #x\n")


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(FileNotFoundError):
        em.read_storage(tmp_path / "none.sto")


# -- the table ------------------------------------------------------------------------------------


def table(*labels, in_degrees=False):
    values = np.arange(2.0 * len(labels)).reshape(2, -1)
    return em.Storage("table", labels, [0.0, 1.0], values, in_degrees)


def test_a_storage_is_frozen():
    values = np.zeros((1, 1))
    storage = em.Storage("a", ["x"], [0.0], values)
    values[0] = 1.0
    assert storage.values == 0.0 and storage.labels == ("x",)
    with pytest.raises(ValueError, match="read-only"):
        storage.values[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        storage.name = "b"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("a", ["x"], [0.0], [[0.0, 1.0]]), r"time \(1,\), values \(1, 2\) and 1 labels do not"),
        (("a", ["x"], [0.0, 1.0], [[0.0]]), "do not fit"),
        (("a", ["x"], [0.0], [["one"]]), "storage 'a': time and values must be numbers"),
        (("a", ["x"], [], np.empty((0, 1))), "do not fit: .* k >= 1"),
        (("a", ["x"], [1.0, 1.0], [[0.0], [0.0]]), "time must be finite and increase"),
        (("a", ["x"], [math.nan], [[0.0]]), "time must be finite and increase"),
        (("a", ["x y"], [0.0], [[0.0]]), "storage 'a': label 'x y' is empty or has blanks"),
        (("a", [""], [0.0], [[0.0]]), "label '' is empty or has blanks"),
        (("a\nb", ["x"], [0.0], [[0.0]]), "name would not be read"),
        (("nRows=3", ["x"], [0.0], [[0.0]]), "name would not be read"),
        (("endheader", ["x"], [0.0], [[0.0]]), "name would not be read"),
    ],
)  # fmt: skip
def test_storages_that_cannot_be(arguments, message):
    with pytest.raises(em.StorageError, match=message):
        em.Storage(*arguments)


@pytest.mark.parametrize(
    "label",
    ["elbow", "elbow/value", "r_elbow/elbow/value", "/jointset/r_elbow/elbow/value"],
)
def test_coordinates_by_any_of_their_names(label):
    storage = table(
        "other", label, "elbow_u", "/jointset/x/elbow/speed", "my_elbow", "/x/belbow/value"
    )
    np.testing.assert_array_equal(storage.coordinates(["elbow"], ["m"]), [[1.0], [7.0]])


def test_only_angles_are_converted():
    storage = table("elbow", "tx", in_degrees=True)
    np.testing.assert_array_equal(
        storage.coordinates(["tx", "elbow"], ["m", "rad"]), [[1.0, 0.0], [3.0, np.radians(2.0)]]
    )
    radians = table("elbow", "tx")
    np.testing.assert_array_equal(radians.coordinates(["elbow"], ["rad"]), [[0.0], [2.0]])
    np.testing.assert_array_equal(storage.values, radians.values)


@pytest.mark.parametrize("label", ["TRI", "TRI.excitation", "/forceset/TRI", "forceset/TRI"])
def test_controls_by_any_of_their_names(label):
    storage = table("/forceset/TRI/activation", "TRI.activation", label, "ATRI", "/x/ATRI")
    np.testing.assert_array_equal(storage.controls(["TRI"]), [[2.0], [7.0]])


def test_columns_that_are_missing_or_repeated():
    storage = table("elbow", "/jointset/x/elbow/value", "a", "a", "b")
    with pytest.raises(
        em.StorageError, match=r"no column for coordinate 'hip'; the columns are el"
    ):
        storage.coordinates(["b", "hip"], ["m", "m"])
    with pytest.raises(
        em.StorageError, match=r"more than one column for coordinate 'elbow': elbow,"
    ):
        storage.coordinates(["elbow"], ["rad"])
    with pytest.raises(em.StorageError, match="more than one column for actuator 'a': a, a"):
        storage.controls(["a"])
    assert storage.controls(["b"]).shape == (2, 1)  # the others do not matter
    assert storage.controls([]).shape == (2, 0)


@pytest.mark.parametrize("units", [[], ["rad", "m"], ["deg"]])
def test_units_that_do_not_fit(units):
    with pytest.raises(em.StorageError, match="units must be rad or m for each of 1 coordinates"):
        table("elbow").coordinates(["elbow"], units)


# -- OpenSim's files ------------------------------------------------------------------------------


@needs_opensim_files
@pytest.mark.parametrize(
    ("file", "name", "shape", "in_degrees"),
    [
        ("arm26/arm26_InverseKinematics.mot", "inverse kinematics", (121, 11), True),
        ("arm26/std_arm26_states.sto", "arm26_states", (518, 16), False),
        ("leg6dof9musc_stance/leg69_stance_grf.mot", "leg69_stance_grf.mot", (601, 18), True),
        ("leg6dof9musc_stance/leg6dof9musc_adjusted_Kinematics_q.sto",
         "Coordinates", (450, 7), True),
        ("leg6dof9musc_stance/leg6dof9musc_std_RRA_adjusted_states.sto",
         "leg6dof9musc_RRA_adjusted_states", (431, 32), False),
    ],
)  # fmt: skip
def test_files_of_opensim(file, name, shape, in_degrees, tmp_path):
    storage = em.read_storage(CMC / file)
    assert (storage.name, storage.values.shape, storage.in_degrees) == (name, shape, in_degrees)
    storage.write(tmp_path / "again.sto")
    again = em.read_storage(tmp_path / "again.sto")
    assert again.labels == storage.labels and again.in_degrees is in_degrees
    assert same_bits(again.values, storage.values)


@needs_opensim_files
def test_states_and_kinematics_of_one_motion():
    """Radians under state paths, degrees under plain names: CMC starts on one, and follows it."""
    folder = CMC / "leg6dof9musc_stance"
    names = ["pelvis_tilt", "pelvis_tx", "hip_flexion_r", "ankle_angle_r"]
    units = ["rad", "m", "rad", "rad"]
    desired = em.Motion.from_file(folder / "leg6dof9musc_adjusted_Kinematics_q.sto", names, units)
    states = em.read_storage(folder / "leg6dof9musc_std_RRA_adjusted_states.sto")
    gap = np.abs(desired(states.time)[0] - states.coordinates(names, units))
    assert gap[0].max() < 1e-8 and gap.max() < 5e-3


# -- results --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def csf():
    return em.cosimulate(
        pendulum.build(),
        pendulum.motion(),
        settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP),
    )


@pytest.fixture(scope="module")
def helped():
    """The pendulum with reserves that have to help, and its motion by CMC."""
    full = pendulum.build()
    weak = [dataclasses.replace(m, max_isometric_force=300.0) for m in full.muscles]
    model = em.MusculoskeletalModel(
        full.mbs, 0, weak, coordinates=["theta"],
        reserves=[em.Reserve("theta", 20.0), em.Reserve("theta", 5.0)],
    )  # fmt: skip
    motion = pendulum.motion()
    return model, em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP))


def test_states(csf):
    states = em.opensim.result_files.states(csf)
    assert states.labels[:2] == ("theta/value", "theta/speed")
    assert states.labels[2:4] == (
        f"/forceset/{csf.muscle_names[0]}/activation",
        f"/forceset/{csf.muscle_names[0]}/fiber_length",
    )
    a, l_m = csf.activations, csf.fiber_lengths
    expected = [csf.coordinates, csf.speeds, a[:, 0], l_m[:, 0], a[:, 1], l_m[:, 1]]
    np.testing.assert_array_equal(states.values, np.column_stack(expected))
    np.testing.assert_array_equal(states.coordinates(["theta"], ["rad"]), csf.coordinates)


def test_kinematics_are_in_degrees_and_a_motion_again(csf, tmp_path):
    kinematics = em.opensim.result_files.kinematics(csf)
    assert kinematics.labels == ("theta",) and kinematics.in_degrees
    np.testing.assert_array_equal(kinematics.values, np.degrees(csf.coordinates))
    kinematics.write(tmp_path / "q.sto")
    motion = em.Motion.from_file(tmp_path / "q.sto", ["theta"], ["rad"])
    np.testing.assert_allclose(motion(csf.time)[0], csf.coordinates, rtol=1e-14)


def test_translations_stay_in_meters(csf):
    slid = dataclasses.replace(csf, coordinate_units=("m",))
    np.testing.assert_array_equal(em.opensim.result_files.kinematics(slid).values, csf.coordinates)


def test_controls_end_a_window_and_begin_the_next(csf):
    controls = em.opensim.result_files.controls(csf)
    assert controls.name == "controls" and controls.labels == csf.muscle_names
    np.testing.assert_array_equal(controls.time[1::2], csf.window_time[1:])
    np.testing.assert_allclose(controls.time[::2], csf.window_time[:-1], rtol=0, atol=1.1e-8)
    np.testing.assert_array_equal(controls.values[1::2], csf.excitation_values)
    np.testing.assert_array_equal(controls.values[::2], csf.excitation_values)


def test_forces_and_errors(helped):
    _, cmc = helped
    forces, errors = (
        em.opensim.result_files.forces(cmc),
        em.opensim.result_files.tracking_errors(cmc),
    )
    assert forces.labels == (*cmc.muscle_names, "theta_reserve", "theta_reserve_2")
    assert np.abs(cmc.reserves).max() > 1.0
    np.testing.assert_array_equal(forces.values[:, :2], cmc.tendon_forces)
    np.testing.assert_allclose(forces.values[::10, 2:], cmc.reserves, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(errors.values, cmc.desired_coordinates - cmc.coordinates)


def test_controls_from_a_file_replay_the_motion(helped, tmp_path):
    model, cmc = helped
    em.opensim.result_files.controls(cmc, model.reserves).write(tmp_path / "controls.sto")
    read = em.Excitations.from_file(tmp_path / "controls.sto", model.muscles.names, model.reserves)
    np.testing.assert_array_equal(read.time, cmc.window_time)
    np.testing.assert_array_equal(read.values, cmc.excitation_values)
    np.testing.assert_allclose(read.reserves, cmc.reserves, rtol=1e-15)
    again = em.forward_dynamics(model, dataclasses.replace(read, initial=cmc.excitations.initial))
    np.testing.assert_allclose(again.coordinates, cmc.coordinates, rtol=0, atol=1e-9)


def test_controls_at_every_step_of_an_integrator(csf, tmp_path):
    """As OpenSim writes them: many rows within one window change nothing."""
    times = np.union1d(csf.window_time, np.random.default_rng(5).uniform(0.0, 1.0, 500))
    window = np.maximum(np.searchsorted(csf.window_time, times) - 1, 0)
    rows = em.Storage("controls", csf.muscle_names, times, csf.excitation_values[window])
    rows.write(tmp_path / "controls.sto")
    many = em.Excitations.from_file(tmp_path / "controls.sto", csf.muscle_names)
    runs = [
        em.forward_dynamics(
            pendulum.build(), dataclasses.replace(u, initial=csf.excitations.initial)
        )
        for u in (many, csf.excitations)
    ]
    np.testing.assert_array_equal(runs[0].coordinates, runs[1].coordinates)


def test_controls_that_cannot_be_used(csf, tmp_path):
    file = tmp_path / "controls.sto"
    table("a", "b").write(file)
    with pytest.raises(
        em.StorageError, match=r"controls\.sto: there is no column for actuator 'c'"
    ):
        em.Excitations.from_file(file, ["a", "c"])
    with pytest.raises(em.StorageError, match="no column for actuator 'a_reserve'"):
        em.Excitations.from_file(file, ["a"], [em.Reserve("a", 1.0)])
    em.Storage("a", ["a"], [0.0], [[0.5]]).write(file)
    with pytest.raises(em.StorageError, match=r"controls\.sto: controls need at least two rows"):
        em.Excitations.from_file(file, ["a"])
    em.Storage("a", ["a"], [0.0, 1.0], [[0.5], [math.nan]]).write(file)
    with pytest.raises(em.ParameterError, match=r"controls\.sto: excitations: .* must be finite"):
        em.Excitations.from_file(file, ["a"])
    with pytest.raises(em.StorageError, match=r"the reserves \[\], got \['theta_reserve'\]"):
        em.opensim.result_files.controls(csf, [em.Reserve("theta", 1.0)])


def test_all_files_of_a_result(csf, tmp_path):
    files = em.opensim.write_results(csf, tmp_path / "swing")
    endings = ["states", "controls", "Kinematics_q", "Actuation_force", "pErr"]
    assert files == [tmp_path / f"swing_{ending}.sto" for ending in endings]
    assert [len(em.read_storage(file).time) for file in files] == [101, 200, 101, 101, 101]


def test_nothing_desired_gives_no_errors(tmp_path):
    forward = em.forward_dynamics(pendulum.build(), em.Excitations([0.0, 0.02], [[0.3, 0.2]]))
    files = em.opensim.write_results(forward, tmp_path / "free")
    assert [file.name for file in files][-1] == "free_Actuation_force.sto" and len(files) == 4


def test_vectors_by_what_their_labels_begin_with():
    stored = em.Storage(
        "a", ["f1", "px", "f2", "py", "f3", "pz", "zz", "zx", "zy", "2_f1"], [0.0], [range(10)]
    )
    np.testing.assert_array_equal(stored.vector("f"), [[0.0, 2.0, 4.0]])
    np.testing.assert_array_equal(stored.vector("p"), [[1.0, 3.0, 5.0]])
    for identifier, message in (
        ("f1", "1 columns begin with 'f1', but a vector needs three; the columns are f1, px"),
        ("", "0 columns begin with ''"),
        ("z", r"the columns of 'z' are not in order: \['zz', 'zx', 'zy'\]"),
    ):
        with pytest.raises(em.StorageError, match=message):
            stored.vector(identifier)
