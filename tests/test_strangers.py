"""Files from strangers: whatever is in them, an error of this package names the file and the place,
after a time and in a memory in proportion to the file."""

import json
import os
import re
import shutil
import signal
import struct
import sys
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import cli
from exudyn_muscles.cli import sources
from exudyn_muscles.files import disk as files
from exudyn_muscles.files import python as python_module
from exudyn_muscles.files import storage as storage_module
from exudyn_muscles.opensim import document
from exudyn_muscles.opensim.bodies import Bodies
from exudyn_muscles.opensim.muscles import read_muscle
from exudyn_muscles.results.storing import LARGEST

from . import opensim_files
from .cli.test_commands import PENDULUM, error_line
from .reference.make import FOLDER

RESULT = FOLDER / "pendulum_csf.npz"
READERS = {
    "model.osim": (em.opensim.load_model, em.ModelFileError),
    "coordinates.osim": (em.opensim.read_coordinates, em.ModelFileError),
    "setup.xml": (em.opensim.load_setup, em.ModelFileError),
    "table.sto": (em.read_storage, em.StorageError),
    "motion.mot": (lambda file: em.Motion.from_file(file, ["q"], ["rad"]), em.StorageError),
    "controls.sto": (lambda file: em.Excitations.from_file(file, ["m"]), em.StorageError),
    "force.mot": (
        lambda file: em.ExternalForce.from_file("f", 0, file, force="f"), em.StorageError
    ),
    "result.npz": (em.Trajectory.load, em.ResultFileError),
    "model.py": (sources.load_model, em.ModelError),
    "law.py": (lambda file: sources.load_law(f"{file}:law"), em.ModelError),
}  # fmt: skip
LIMITS = {
    ".osim": document.LARGEST, ".xml": document.LARGEST, ".sto": storage_module.LARGEST,
    ".mot": storage_module.LARGEST, ".npz": LARGEST, ".py": python_module.LARGEST,
}  # fmt: skip


@pytest.fixture(autouse=True)
def impatient():
    """What hangs, or takes a time that grows with the square of the size, is ended."""

    def end(*_):
        raise TimeoutError("this takes far too long")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


# Of every kind


@pytest.mark.parametrize("name", READERS)
def test_only_regular_files_are_read(name, tmp_path):
    file = tmp_path / name
    read, error = READERS[name]
    with pytest.raises(FileNotFoundError, match=re.escape(str(file))):
        read(file)
    for make in (
        os.mkfifo,
        lambda file: file.symlink_to("/dev/zero"),
        lambda file: file.symlink_to("/dev/null"),
        Path.mkdir,
    ):
        make(file)
        with pytest.raises(error, match=f"^{re.escape(str(file))}: this is no regular file$"):
            read(file)
        shutil.rmtree(file) if file.is_dir() else file.unlink()
    (tmp_path / "pipe").unlink(missing_ok=True)
    os.mkfifo(tmp_path / "pipe")
    file.symlink_to(tmp_path / "pipe")
    with pytest.raises(error, match="no regular file"):
        read(file)


@pytest.mark.parametrize("name", READERS)
def test_files_larger_than_their_kind_are_refused_unread(name, tmp_path):
    file = tmp_path / name
    read, error = READERS[name]
    with open(file, "wb") as stream:
        stream.truncate(int(LIMITS[file.suffix]) + 1)  # takes no room on the disk
    with pytest.raises(error, match=rf"^{re.escape(str(file))}: .* bytes are too many, allowed"):
        read(file)


def test_the_command_line_names_them_too(tmp_path, capsys):
    for command in (["check", "{}", str(RESULT)], ["run", "{}", "--method", "csf"], ["cmc", "{}"]):
        file = tmp_path / "pipe.py"
        file.unlink(missing_ok=True)
        os.mkfifo(file)
        assert cli.main([part.format(file) for part in command]) == 2
        assert error_line(capsys) == f"{file}: this is no regular file"


def test_limits_are_far_above_what_is_in_use():
    folder = FOLDER.parents[1]
    for file in [*folder.rglob("*.npz"), *folder.glob("models/*.py")]:
        assert file.stat().st_size < 0.1 * LIMITS[file.suffix]


# Documents


@pytest.fixture
def refused(tmp_path):
    """The error about a document, without the file's name."""

    def load(content):
        file = tmp_path / "stranger.osim"
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        with pytest.raises(em.ModelFileError) as caught:
            em.opensim.load_model(file)
        text = str(caught.value)
        assert text.startswith(str(file)) and len(text) < 2100
        return text.removeprefix(str(file))

    return load


def model(**changes):
    """Text of a small model."""
    parts = {
        "version": 40000, "ground": "", "bodies": opensim_files.BODY.format(name="body", inside=""),
        "joints": opensim_files.PIN, "forces": opensim_files.muscle(), "rest": "",
    }  # fmt: skip
    return opensim_files.DOCUMENT.format(**parts | changes)


def inside_muscle(text, **options):
    return model(forces=opensim_files.muscle(inside=text, **options))


def test_more_elements_than_any_model_has(refused, monkeypatch):
    assert "bytes are too many" in refused(b"<a/>" * 28_000_000)
    monkeypatch.setattr(document, "MOST_ELEMENTS", 5000)
    text = refused("<OpenSimDocument>\n" + "<a/>" * 5001)
    assert text == ", line 1: OpenSimDocument: more than 5000 elements in one file"
    defaults = "<defaults><a>" + "<b/>" * 100 + "</a></defaults>" + "<a/>" * 100
    text = refused(model().replace('name="model">', f'name="model">{defaults}'))
    assert text == ", line 2: defaults: more than 5000 elements would be added"


def test_deep_long_and_broken_documents(refused, monkeypatch):
    assert "more than 200 elements within each other" in refused("<a>" * 300)
    monkeypatch.setattr(document, "LONGEST_TEXT", 2000)
    assert "more than 2000 characters in one property" in refused(f"<a>{'0 ' * 3000}</a>")
    assert "more than 2000 characters in one tag" in refused(f"<a b='{'0' * 9000}'/>")
    assert refused("<a><b></a>") == ": not well-formed XML: mismatched tag: line 1, column 8"


@pytest.mark.parametrize(
    "encoding", ["foo", "utf-7", "rot13", "idna", "undefined", "punycode", "utf-32", "mbcs", "zlib"]
)
def test_encodings_that_are_not_known(refused, encoding):
    text = refused(f'<?xml version="1.0" encoding="{encoding}"?>{model().split("?>")[1]}')
    assert text.startswith((": its encoding cannot be read: ", ": not well-formed XML: "))


@pytest.mark.filterwarnings("always::exudyn_muscles.ModelFileWarning")
def test_a_muscle_with_very_many_children(tmp_path):
    """Of a hundred kinds of them it is told that they are ignored."""
    file = tmp_path / "stranger.osim"
    file.write_text(inside_muscle("".join(f"\n<x{k}>1</x{k}>" for k in range(100_000))))
    with pytest.warns(em.ModelFileWarning) as caught:
        em.opensim.load_model(file)
    assert len(caught) == 100 and "'muscle' / x0: OpenSim does not know" in str(caught[0].message)
    file.write_text(inside_muscle("\n<max_isometric_force>1</max_isometric_force>" * 100_000))
    with pytest.warns(em.ModelFileWarning, match="max_isometric_force: it is given before"):
        em.opensim.load_model(file)


WELD = (
    '<WeldJoint name="j{0}"><socket_parent_frame>/bodyset/{1}</socket_parent_frame>'
    "<socket_child_frame>/bodyset/b{0}</socket_child_frame></WeldJoint>"
)
PIN = WELD.replace("Weld", "Pin").replace(
    "</Pin", '<coordinates><Coordinate name="q{0}"/></coordinates></Pin'
)
FRAME = '<PhysicalOffsetFrame name="f{}"><socket_parent>{}</socket_parent></PhysicalOffsetFrame>'
COUPLER = (
    "<CoordinateCouplerConstraint><coupled_coordinates_function><LinearFunction/>"
    "</coupled_coordinates_function><independent_coordinate_names>angle"
    "</independent_coordinate_names><dependent_coordinate_name>q{}</dependent_coordinate_name>"
    "</CoordinateCouplerConstraint>"
)
WRAP = "<PathWrap><wrap_object>w{}</wrap_object></PathWrap>"
SPHERE = '<WrapSphere name="w{}"><radius>0.01</radius></WrapSphere>'


def chain(joint, n):
    """Bodies one behind the other, whose joints the file has in the worst order."""
    bodies = "".join(opensim_files.BODY.format(name=f"b{k}", inside="") for k in range(n))
    joints = [joint.format(k, f"b{k - 1}" if k else "body") for k in reversed(range(n))]
    return {
        "bodies": opensim_files.BODY.format(name="body", inside="") + bodies,
        "joints": "".join([*joints, opensim_files.PIN]),
    }


def frames(n):
    """Frames one on the other, with a point on each."""
    inside = "".join(FRAME.format(k, f"../f{k + 1}" if k < n else "..") for k in range(n + 1))
    points = opensim_files.GROUND_POINT + "".join(
        opensim_files.BODY_POINT.replace("/body<", f"/body/f{k}<") for k in range(n)
    )
    bodies = opensim_files.BODY.format(name="body", inside=f"<components>{inside}</components>")
    return {"bodies": bodies, "forces": opensim_files.muscle(points=points)}


def wraps(n):
    surfaces = "".join(SPHERE.format(k) for k in range(n))
    inside = f"<WrapObjectSet><objects>{surfaces}</objects></WrapObjectSet>"
    wrapping = "".join(WRAP.format(k) for k in range(n))
    return {
        "bodies": opensim_files.BODY.format(name="body", inside=inside),
        "forces": opensim_files.muscle(wraps=wrapping),
    }


def couplers(n):
    coupled = "".join(COUPLER.format(k) for k in range(n))
    rest = f"<ConstraintSet><objects>{coupled}</objects></ConstraintSet>"
    return {**chain(PIN, n), "rest": rest}


def work(file):
    """Instructions that this package takes to read a model's bodies and muscles."""
    count = 0

    def trace(frame, event, _):
        nonlocal count
        if "opensim" not in frame.f_code.co_filename:
            return None
        frame.f_trace_lines, frame.f_trace_opcodes = False, True
        count += event == "opcode"
        return trace

    sys.settrace(trace)
    try:
        content = document.read_document(file)
        bodies = Bodies(content)
        for force in content.items("ForceSet"):
            read_muscle(force, bodies)
    finally:
        sys.settrace(None)
    return count


@pytest.mark.parametrize(
    "large",
    [
        lambda n: chain(WELD, n),
        lambda n: chain(PIN, n),
        couplers,
        frames,
        wraps,
        lambda n: {"forces": opensim_files.muscle() * n},
        lambda n: {"forces": opensim_files.muscle(points=opensim_files.BODY_POINT * n)},
    ],
    ids=["welds", "pins", "couplers", "frames", "wraps", "muscles", "points"],
)
def test_the_work_grows_with_the_size(large, tmp_path):
    files = [tmp_path / f"{n}.osim" for n in (0, 150, 300)]
    for file in files:
        file.write_text(model(**large(int(file.stem))))
    nothing, some, twice = map(work, files)
    assert twice - nothing < 2.05 * (some - nothing)


KNOTS = "<x>-2 -1 0 0.0002 0.0004 1 2</x><y>0.05 0.06 0.07 0.0701 0.0702 0.08 0.06</y>"
MOVING = (
    '<MovingPathPoint name="slider"><socket_parent_frame>/bodyset/body</socket_parent_frame>'
    "<socket_x_coordinate>/jointset/joint/angle</socket_x_coordinate>"
    "<x_location><SimmSpline>{}</SimmSpline></x_location>"
    "<socket_y_coordinate>/jointset/joint/angle</socket_y_coordinate><y_location><SimmSpline>"
    "<x>-2 -1.5 -1.1 0.0003 0.7 2</x><y>0 0.01 0.03 0.02 0.01 0</y></SimmSpline></y_location>"
    "<z_location><Constant><value>0</value></Constant></z_location></MovingPathPoint>"
)


def with_spline(knots):
    points = opensim_files.GROUND_POINT + "\n" + MOVING.format(knots) + opensim_files.BODY_POINT
    return model(forces=opensim_files.muscle(points=points))


@pytest.mark.parametrize(
    "value", ["100", "1e10", "-1e10", "1e20", "1e30", "1e300", "1e308", "nan", "9" * 4301]
)
@pytest.mark.parametrize("place", range(14))
@pytest.mark.filterwarnings("error")
def test_one_number_of_a_spline_replaced(value, place, tmp_path):
    """It loads, or the place is told."""
    numbers = list(re.finditer(r"[-\d.]+", KNOTS))
    at = numbers[place]
    file = tmp_path / "stranger.osim"
    file.write_text(with_spline(KNOTS[: at.start()] + value + KNOTS[at.end() :]))
    try:
        em.opensim.load_model(file)
    except em.ModelFileError as error:
        text = str(error)
        assert re.match(rf"{re.escape(str(file))}, line 1[0-9]: .*MovingPathPoint 'slider'", text)
        assert len(text) < 1000


def test_a_spline_of_very_many_points(refused):
    numbers = " ".join(map(str, range(100_000)))
    text = refused(with_spline(f"<x>{numbers}</x><y>{numbers}</y>"))
    assert text.endswith("SimmSpline: a spline has at most 1000 points, got 100000")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (model(version="4" * 5000), "is none that OpenSim 4 reads"),
        (model(version="٤٠٠٠٠"), "format version '٤٠٠٠٠' is none that OpenSim 4 reads"),
        (inside_muscle(f"<KshapeActive>{'9' * 5000}</KshapeActive>"), "KshapeActive: expected num"),
        (inside_muscle("<KshapeActive>1e308</KshapeActive>"), "numbers up to 1e+30, got '1e308'"),
        (model().replace(">/bodyset/body<", f">/bodyset/{'b' * 900_000}<"), "there is no frame"),
        (model().replace("2.5", "m" * 900_000), "mass: expected numbers, got 'mmmmmmm"),
        (model().replace('name="muscle"', f'name="{"m" * 900_000}"').replace("0.5 0.1 0", "0 0"),
         "PathPoint 'a' / location: expected 3 numbers, got 2"),
    ],
)  # fmt: skip
def test_long_numbers_and_texts_are_cut(refused, content, message):
    assert message in refused(content)


# Storage files


@pytest.fixture
def refused_table(tmp_path):
    def read(content, reader="table.sto"):
        file = tmp_path / "stranger.mot"
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        with pytest.raises(em.ExudynMusclesError) as caught:
            READERS[reader][0](file)
        text = str(caught.value)
        assert text.startswith(str(file)) and len(text) < 2100
        return text.removeprefix(str(file))

    return read


HEAD = "name\nversion=1\nendheader\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (f"a\nnRows={'9' * 5000}\nendheader\ntime x\n0 1\n", ", line 2: expected a whole number, "),
        (f"a\nversion={'9' * 5000}\nendheader\ntime x\n0 1\n", ": expected a whole number, got '9"),
        (HEAD + f"time x\n0 {'a' * 900_000}\n", ", line 5: 'aaaa"),
        (HEAD + f"{'t' * 900_000} x\n0 1\n", ", line 4: the first column must be 'time', it is"),
        (HEAD + "time" + " x" * 10_001 + "\n0 1\n", ", line 4: more than 10000 columns"),
        (HEAD + "time" + " x" * 9999 + "\n" + "0\n" * 500_000, "line 5: 1 values for 10000"),
        ("x\n" * 20_000 + HEAD + "time x\n0 1\n", ": no line 'endheader', so this is not a"),
        ("\n" * 4_000_001, ": more than 4000000 lines"),
        (b"\xff\xfe" * 10, ": no line 'endheader', so this is not a storage file"),
    ],
)  # fmt: skip
def test_tables(refused_table, content, message):
    assert message in refused_table(content)


def test_the_columns_of_a_wide_table_are_not_all_told(refused_table):
    labels = " ".join(f"a_long_label_{k}" for k in range(9000))
    content = HEAD + f"time {labels}\n" + "0" * 1 + " 0" * 9000 + "\n"
    assert "there is no column for coordinate 'q'" in refused_table(content, "motion.mot")


ROWS = "".join(f"{0.1 * k} 0.1 0.2 0.3\n" for k in range(8))


@pytest.mark.parametrize("number", ["1e308", "-1e308", "1e200", "1e13", "nan", "inf"])
@pytest.mark.filterwarnings("error")
def test_numbers_that_no_record_has(refused_table, number):
    rows = ROWS.replace("0.2", number, 1)
    finite = np.isfinite(float(number))
    size = f"go.* up to {abs(float(number)):.3g}".replace("+", r"\+")
    text = refused_table(HEAD + "time f1 f2 f3\n" + rows, "force.mot")
    assert re.match(f": external force 'f': force {size if finite else 'must be finite'}", text)
    text = refused_table(HEAD + "time p q r\n" + rows, "motion.mot")
    assert re.match(f": coordinates {size}" if finite else f": coordinate 'q' is {number}", text)


@pytest.mark.parametrize("step", [5e-324, 1e-320])
@pytest.mark.filterwarnings("error")
def test_times_that_are_too_close(tmp_path, step):
    """They are one."""
    rows = ROWS.replace("0.1 0.1 0.2", f"{step} 0.3 0.2", 1)
    (tmp_path / "motion.mot").write_text(HEAD + "time q r s\n" + rows)
    motion = em.Motion.from_file(tmp_path / "motion.mot", ["q"], ["rad"])
    assert np.isfinite(motion(np.linspace(motion.start, motion.end, 50))[2]).all()
    times = np.array([0.0, step, 0.1, 0.2, 0.3, 0.4, 0.5])
    with pytest.raises(em.MotionError, match="times are too close"):
        em.Motion.from_samples(times, np.sin(1e3 * times + np.arange(7)))


# Results


@pytest.fixture
def stored():
    """Header and arrays of a good result."""
    with np.load(RESULT) as file:
        arrays = {name: file[name] for name in file.files}
    return json.loads(str(arrays.pop("header"))), arrays


@pytest.fixture
def refused_result(tmp_path):
    def load(file=None):
        file = file or tmp_path / "stranger.npz"
        with pytest.raises(em.ResultFileError) as caught:
            em.Trajectory.load(file)
        text = str(caught.value)
        assert text.startswith(str(file)) and len(text) < 2100
        return text.removeprefix(str(file))

    return load


@pytest.mark.parametrize("kind", ["U", "M8[s]", "m8[s]", "S5", "c16", "i8", "?"])
@pytest.mark.parametrize("name", ["coordinates", "time", "start_unmet"])
def test_arrays_of_other_kinds(name, kind, stored, tmp_path, refused_result):
    header, arrays = stored
    arrays[name] = arrays[name].astype(kind)
    np.savez(tmp_path / "stranger.npz", header=json.dumps(header), **arrays)
    assert refused_result().startswith(f": {name} has to be numbers, it is ")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("method", 3), ("message", None), ("status", ["COMPLETE"]), ("coordinate_names", "theta"),
        ("coordinate_names", [1]), ("coordinate_units", ["deg"]), ("coordinate_units", []),
        ("coordinate_units", ["rad", "m"]), ("muscle_names", {"left": 1}), ("reserve_names", None),
        ("saturated", [1]), ("saturated", []), ("saturated", ["left"]), ("counts", {"steps": "9"}),
        ("counts", {"steps": -1}), ("counts", {"steps": 1.5}), ("counts", [1]), ("counts", None),
        ("cpu_time", "short"), ("cpu_time", -1.0), ("settings", []), ("settings", None),
        ("versions", {"numpy": 2}), ("versions", "2"), ("time", [0.0, 1.0]), ("none", 1),
        ("message", 1e400), ("method", ["x" * 100_000]),
    ],
)  # fmt: skip
def test_header_fields_of_other_kinds(name, value, stored, tmp_path, refused_result):
    header, arrays = stored
    header[name] = value
    np.savez(tmp_path / "stranger.npz", header=json.dumps(header), **arrays)
    assert re.search(rf"damaged header.*{name}|{name} are not 1", refused_result())


@pytest.mark.parametrize("name", ["time", "window_time"])
def test_times_of_a_result_increase(name, stored, tmp_path, refused_result):
    header, arrays = stored
    for change in (lambda t: t[::-1], lambda t: np.full_like(t, np.nan), np.zeros_like):
        np.savez(
            tmp_path / "stranger.npz",
            header=json.dumps(header), **arrays | {name: change(arrays[name])},
        )  # fmt: skip
        assert refused_result() == f": {name} does not increase, or is empty"


def test_a_small_file_that_unpacks_to_much(tmp_path, refused_result, monkeypatch):
    file = tmp_path / "stranger.npz"
    monkeypatch.setattr(files, "UNPACKED", 1e6)
    np.savez_compressed(file, header=np.zeros(1_000_000))
    assert "it unpacks to 8e+06 bytes, allowed are 1e+06" in refused_result()


def test_a_member_that_is_larger_than_it_says(tmp_path, refused_result):
    """Nothing beyond its word is unpacked."""
    file = tmp_path / "stranger.npz"
    np.savez_compressed(file, header=np.zeros(10_000_000))
    content = bytearray(file.read_bytes())
    directory = content.rindex(b"PK\x01\x02")
    struct.pack_into("<I", content, directory + 24, 1000)
    file.write_bytes(content)
    tracemalloc.start()
    try:
        assert "not a readable .npz file" in refused_result()
        assert tracemalloc.get_traced_memory()[1] < 10e6
    finally:
        tracemalloc.stop()


def npy(shape, dtype, data=b""):
    text = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}}}".encode()
    text += b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (npy((10**15,), "<f8"), "has not the size of its shape"),
        (npy((10**15, 0), "<f8", b"x"), "has not the size of its shape"),
        (npy((-1,), "<f8"), "has not the size"),
        (npy((1,), "|O", b"x" * 8), "allow_pickle"),
        (npy((10**15,), "<U0"), "not a readable trajectory"),
        (npy((1,), "9" * 5000), "not a readable"),
        (b"\x93NUMPY\x09\x09", "array format"),
        (b"", "not a readable"),
        (npy((), "<U9", ("a" * 9).encode("utf-32-le")), "not a readable trajectory"),
        (npy((), "<U5000", ("9" * 5000).encode("utf-32-le")), "not a readable"),
        (npy((), "<U60000", ("[" * 60000).encode("utf-32-le")), "not a readable"),
    ],
)  # fmt: skip
def test_arrays_that_are_none(content, message, tmp_path, refused_result):
    with zipfile.ZipFile(tmp_path / "stranger.npz", "w") as archive:
        archive.writestr("header.npy", content)
    assert message in refused_result()


def test_archives_that_numpy_does_not_write(tmp_path, refused_result):
    file = tmp_path / "stranger.npz"
    with zipfile.ZipFile(file, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("header.npy", npy((), "<U1", b"a\0\0\0"))
    assert "its compression is not that of NumPy" in refused_result()
    with zipfile.ZipFile(file, "w") as archive:
        for k in range(1001):
            archive.writestr(f"{k}.npy", b"")
    assert "more than 1000 arrays" in refused_result()


# What `check` says


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda header: header.update(coordinate_units=["m"]), "coordinate_units differ"),
        (lambda header: header.update(settings={}), "kinds of settings differ"),
        (lambda header: header["settings"].update(kp="534.0"), "kinds of settings differ"),
        (lambda header: header["settings"].update(kp=[534.0]), "kinds of settings differ"),
        (lambda header: header["settings"].update(kp=True), "kinds of settings differ"),
        (lambda header: header["settings"].update(normalizer={}), "kinds of settings differ"),
        (lambda header: header.update(settings={"speed": 3.0}), "kinds of settings differ"),
        (lambda header: header.update(counts={"steps": "9"}), "damaged header, counts = "),
    ],
)  # fmt: skip
def test_check_does_not_agree_with_other_kinds(change, message, stored, tmp_path, capsys):
    header, arrays = stored
    change(header)
    file = tmp_path / "other.npz"
    np.savez(file, header=json.dumps(header), **arrays)
    assert cli.main(["check", str(file), str(RESULT)]) in (1, 2)
    printed = capsys.readouterr()
    assert message in printed.out + printed.err


def test_check_tells_other_settings_of_the_same_kind(stored, tmp_path, capsys):
    header, arrays = stored
    header["settings"].update(kp=535, kv=46.0, later="than the reference")
    file = tmp_path / "other.npz"
    np.savez(file, header=json.dumps(header), **arrays)
    assert cli.main(["check", str(file), str(RESULT)]) == 0
    printed = capsys.readouterr().out
    assert "other settings than the reference's: kp 535 instead of 534.0, kv 46.0 inste" in printed


# Set-ups


@pytest.mark.parametrize("tag", ["kp", "kv"])
def test_gains_that_overflow(tag, tmp_path):
    task = (
        "<CMC_TaskSet><objects><CMC_Joint name='elbow'>\n<on>true</on><active>true</active>"
        f"<coordinate>elbow</coordinate><{tag}>1e29</{tag}></CMC_Joint></objects></CMC_TaskSet>"
    )
    from exudyn_muscles.opensim.tasks import read_tasks

    file = tmp_path / "tasks.xml"
    file.write_text(task)
    with pytest.raises(em.ModelFileError, match=rf"line 1: .*{tag} = 1e\+29 .* \[0, 1e\+12\]"):
        read_tasks(file)
    with pytest.raises(em.ParameterError, match=rf"{tag} = 1e\+308 .* is outside \[0, 1e\+12\]"):
        em.CMCSettings(**{tag: 1e308})
    assert cli.main(["run", str(PENDULUM), "--method", "csf", f"--{tag}", "1e308"]) == 2
