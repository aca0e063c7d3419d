"""Files are written whole or not at all, and read only if they are files of a sensible size."""

import ast
import errno
import os
import resource
import stat
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import exudyn_muscles as em
from exudyn_muscles.files import disk as files
from exudyn_muscles.files.disk import write_arrays, write_figure, write_file

from ..reference.make import FOLDER

PACKAGE = Path(em.__file__).parent


def save_result(file):
    em.Trajectory.load(FOLDER / "pendulum_csf.npz").save(file)


def write_table(file):
    em.Storage("table", ["a"], np.arange(300.0), np.ones((300, 1))).write(file)


def draw(file):
    write_figure(Figure(), file, dpi=100)


WRITERS = {
    "result.npz": save_result,
    "arrays.npz": lambda file: write_arrays(file, x=np.random.default_rng(0).random(500)),
    "table.sto": write_table,
    "figure.png": draw,
    "numbers.json": lambda file: write_file(file, b"[" + b"1, " * 400 + b"1]"),
}


@contextmanager
def no_file_larger_than(size):
    """The kernel ends a write there, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


# Writing


@pytest.mark.parametrize("name", WRITERS)
def test_a_write_that_fails_leaves_the_earlier_file(name, tmp_path):
    file = tmp_path / name
    file.write_text("good")
    with no_file_larger_than(1000), pytest.raises(OSError, match=name) as caught:
        WRITERS[name](file)
    assert (caught.value.errno, caught.value.filename) == (errno.EFBIG, str(file))
    assert file.read_text() == "good"
    assert list(tmp_path.iterdir()) == [file]
    WRITERS[name](file)
    assert file.stat().st_size > 1000
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("name", WRITERS)
def test_a_write_that_fails_leaves_nothing(name, tmp_path):
    with no_file_larger_than(1000), pytest.raises(OSError, match=name):
        WRITERS[name](tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("stage", ["fsync", "replace"])
@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left"), KeyboardInterrupt()])
def test_an_error_at_every_stage(stage, error, tmp_path, monkeypatch):
    file = tmp_path / "file"
    file.write_text("good")

    def fail(*_):
        raise error

    monkeypatch.setattr(files.os, stage, fail)
    with pytest.raises(type(error), match=str(file) if isinstance(error, OSError) else None):
        write_file(file, b"new")
    assert file.read_text() == "good"
    assert list(tmp_path.iterdir()) == [file]


KILLED = """
import os, signal, sys
import exudyn_muscles.files.disk
def kill(*_):
    os.kill(os.getpid(), signal.SIGKILL)
setattr(exudyn_muscles.files.disk.os, sys.argv[1], kill)
from tests.files.test_files import WRITERS
WRITERS[sys.argv[2]](sys.argv[3])
"""


@pytest.mark.parametrize("stage", ["fsync", "replace"])
def test_a_killed_process_leaves_the_earlier_file(stage, tmp_path):
    file = tmp_path / "result.npz"
    save_result(file)
    before = file.read_bytes()
    command = [sys.executable, "-c", KILLED, stage, file.name, str(file)]
    done = subprocess.run(command, cwd=PACKAGE.parent, capture_output=True)
    assert done.returncode == -9
    assert file.read_bytes() == before
    em.Trajectory.load(file)
    save_result(file)


def test_permissions_are_those_of_any_new_file_or_of_the_earlier_one(tmp_path):
    usual = os.umask(0o027)
    try:
        write_file(tmp_path / "new", b"1")
        (tmp_path / "private").touch(mode=0o600)
        write_file(tmp_path / "private", b"1")
    finally:
        os.umask(usual)
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("new", "private")]
    assert modes == [0o640, 0o600]


def test_a_protected_file_is_refused(tmp_path, monkeypatch):
    """By hand, as root may write everything."""
    file = tmp_path / "file"
    file.write_text("good")
    access = files.os.open

    def refuse(path, flags, *rest):
        if flags & (os.O_WRONLY | os.O_RDWR) and Path(path) == file:
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return access(path, flags, *rest)

    monkeypatch.setattr(files.os, "open", refuse)
    with pytest.raises(PermissionError, match="file"):
        write_file(file, b"new")
    assert file.read_text() == "good"


def test_links_stay_and_what_they_point_to_is_replaced(tmp_path):
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "target", tmp_path / "link"
    link.symlink_to(Path("far", "target"))
    for content in (b"made", b"replaced"):
        write_file(link, content)
        assert link.is_symlink() and target.read_bytes() == content
    assert {file.name for file in tmp_path.rglob("*")} == {"far", "target", "link"}
    link.unlink()
    link.symlink_to(link)
    with pytest.raises(OSError, match="link"):
        write_file(link, b"")


def test_what_is_no_regular_file_is_written_to(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    found = []
    reader = threading.Thread(target=lambda: found.append(pipe.read_bytes()), daemon=True)
    reader.start()
    write_file(pipe, b"through")
    reader.join(timeout=10.0)
    assert found == [b"through"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_the_longest_name_and_a_missing_folder(tmp_path):
    file = tmp_path / ("x" * 255)
    write_file(file, b"1")
    assert file.read_bytes() == b"1"
    with pytest.raises(FileNotFoundError, match="none/file"):
        write_file(tmp_path / "none" / "file", b"1")


def calls(file):
    """Names of the functions that a source file calls, and what it opens to write."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else None
            name = node.func.id if isinstance(node.func, ast.Name) else name
            modes = [each.value for each in node.args if isinstance(each, ast.Constant)]
            writes = name == "open" and any(set(str(mode)) & set("wax+") for mode in modes)
            yield "open to write" if writes else name


def test_nothing_else_writes():
    writing = {
        "open to write", "write_text", "write_bytes", "savefig", "savez", "savez_compressed",
        "savetxt", "tofile", "dump", "to_csv",
    }  # fmt: skip
    makers = [FOLDER / "make.py", *(FOLDER.parent / "muscle").glob("make_*.py")]
    found = {
        (file.name, call)
        for file in [*PACKAGE.rglob("*.py"), *makers]
        for call in calls(file)
        if call in writing and file != PACKAGE / "files" / "disk.py"
    }
    assert found == {
        ("make_deprecated.py", "write_text"),  # a model for OpenSim, to be thrown away
        ("journal.py", "open to write"),  # line by line, each on the disk before the next one
        ("study.py", "to_csv"),  # a text, for disk.py
    }
