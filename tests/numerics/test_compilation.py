"""Kernels are compiled once and stored; what is stored but damaged, or cannot be stored, costs a
compilation and a warning, and nothing else. Compiling is said when it happens, and only then."""

import gc
import importlib.util
import logging
import math
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import exudyn_muscles
from exudyn_muscles.numerics import compilation, curves, kernel_cache, turns
from exudyn_muscles.numerics.kernel import kernel

from ..files.test_files import no_file_larger_than

SOURCE = """
def inner(x):
    return x + 1.0

def outer(x):
    return 2.0 * inner(x)
"""
FOLDER = Path(exudyn_muscles.__file__).parent


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Import kernels as a new process would: nothing was compiled, loaded or said yet."""
    file = tmp_path / "kernels.py"

    def load(source=SOURCE):
        monkeypatch.setattr(kernel_cache, "_said", set())
        monkeypatch.setattr(sys, "dont_write_bytecode", True)  # that of the source before, if quick
        file.write_text(source)
        spec = importlib.util.spec_from_file_location("exudyn_muscles.kernels", file)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        module.inner = kernel(module.inner)
        return kernel(module.outer)

    return load


@pytest.fixture
def stored(load, tmp_path):
    """The files of a kernel that was compiled: its index and its one version."""
    assert load()(1.0) == 4.0
    return {
        which: next(tmp_path.rglob(f"kernels.outer*.{which}.kernel")) for which in ("index", "1")
    }


def hits(dispatcher):
    return sum(dispatcher.entry.stats.cache_hits.values())


def warnings_of(caplog):
    """What was said but for the compilation itself."""
    said = [record.getMessage() for record in caplog.records if record.name == "exudyn_muscles"]
    caplog.clear()
    return [text for text in said if not text.startswith("compil") or "cannot" in text]


# Damage


def truncated(size):
    return lambda content: content[: size if size >= 0 else len(content) + size]


DAMAGES = {
    "empty": truncated(0),
    "one byte": truncated(1),
    "checksum only": truncated(32),
    "half": lambda content: content[: len(content) // 2],
    "last byte lost": truncated(-1),
    "garbage": lambda content: np.random.default_rng(0).bytes(len(content)),
    "text": lambda content: b"no kernel\n",
    "longer": lambda content: content + b"\0",
    "zeros": lambda content: bytes(len(content)),
}


@pytest.mark.parametrize("which", ["index", "1"])
@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_compiled_anew_and_replaced(load, stored, which, damage, caplog):
    good = stored[which].read_bytes()
    stored[which].write_bytes(DAMAGES[damage](good))
    caplog.clear()
    again = load()
    assert again(1.0) == 4.0
    assert hits(again) == 0
    (text,) = warnings_of(caplog)
    assert text.startswith(f"stored kernels in {stored[which].parent} cannot be used")
    repaired = load()
    assert (repaired(1.0), hits(repaired)) == (4.0, 1)
    assert not warnings_of(caplog)


@pytest.mark.parametrize("which", ["index", "1"])
def test_every_flipped_bit_is_noticed(load, stored, which):
    """Machine code that differs in one bit must never be run."""
    good = stored[which].read_bytes()
    for place in np.linspace(0, len(good) - 1, 24).astype(int):
        damaged = bytearray(good)
        damaged[place] ^= 1 << (place % 8)
        stored[which].write_bytes(damaged)
        again = load()
        assert (again(1.0), hits(again)) == (4.0, 0)


@pytest.mark.parametrize("which", ["index", "1"])
def test_what_can_be_neither_read_nor_replaced_is_done_without(load, stored, which, caplog):
    stored[which].unlink()
    stored[which].mkdir()
    caplog.clear()
    for _ in range(2):
        again = load()
        assert (again(1.0), hits(again)) == (4.0, 0)
        damaged, not_kept = warnings_of(caplog)
        assert "cannot be used" in damaged and str(stored[which].parent) in damaged
        assert "cannot be kept" in not_kept and str(stored[which].parent) in not_kept


@pytest.mark.parametrize("which", ["index", "1"])
def test_a_missing_file_is_no_damage(load, stored, which, caplog):
    stored[which].unlink()
    caplog.clear()
    assert (load()(1.0), hits(load())) == (4.0, 0)
    assert not warnings_of(caplog)


def test_a_changed_source_is_no_damage(load, stored, caplog, monkeypatch):
    caplog.clear()
    monkeypatch.setattr("exudyn_muscles.numerics.kernel._stamp", lambda: "another")
    changed = load(SOURCE.replace("1.0", "2.0"))
    assert (changed(1.0), hits(changed)) == (6.0, 0)
    assert not warnings_of(caplog)


def test_all_kernels_together_warn_once(load, stored, caplog):
    for file in stored["1"].parent.glob("*.kernel"):
        file.write_bytes(b"")
    caplog.clear()
    assert load()(1.0) == 4.0
    assert len(warnings_of(caplog)) == 1


# No place


def test_a_full_disk_is_done_without(load, tmp_path, caplog):
    with no_file_larger_than(100):
        assert load()(1.0) == 4.0
    (text,) = warnings_of(caplog)
    assert text.startswith(f"compiled kernels cannot be kept in {tmp_path / '__pycache__'}")
    assert "File too large" in text and "NUMBA_CACHE_DIR" in text
    assert not list((tmp_path / "__pycache__").glob("*.kernel"))
    assert load()(1.0) == 4.0
    assert hits(load()) == 0 and not warnings_of(caplog)


IMPORTED = """
import exudyn_muscles as em
from exudyn_muscles.numerics.curves import evaluate, pack
print(evaluate(pack([em.simm_spline([0, 1, 2, 3], [0, 1, 8, 27])]), 0, 1.5)[0])
print(sum(evaluate.entry.stats.cache_hits.values()))
"""


def environment(**changes):
    usual = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    return {**usual, "PYTHONDONTWRITEBYTECODE": "1", **changes}


def printed(done):
    """Value and cache hits, and the lines on stderr."""
    value, found = done.stdout.split()[-2:]
    return float(value), int(found), done.stderr.splitlines()


def test_the_package_can_be_used_where_nothing_can_be_written(tmp_path):
    """A file stands where each folder would be, which stops root, too."""
    ignore = shutil.ignore_patterns("__pycache__")
    package = Path(shutil.copytree(FOLDER, tmp_path / "exudyn_muscles", ignore=ignore))
    for folder in [package, *(each for each in package.rglob("*") if each.is_dir())]:
        (folder / "__pycache__").touch()
    (tmp_path / "home").touch()
    places = {"HOME": str(tmp_path / "home"), "XDG_CACHE_HOME": str(tmp_path / "home" / "cache")}
    done = subprocess.run(
        [sys.executable, "-W", "error::UserWarning", "-c", IMPORTED],
        env=environment(PYTHONPATH=str(tmp_path), MPLCONFIGDIR=str(tmp_path), **places),
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    value, found, lines = printed(done)
    assert (value, found) == (3.375, 0)
    folder = package / "numerics" / "__pycache__"
    assert lines[0].startswith(f"compiled kernels cannot be kept in {folder}, so")
    assert lines[1:] == ["compiling the muscle kernels"]


def test_processes_that_compile_at_once(tmp_path):
    command = [sys.executable, "-c", IMPORTED]
    options = {"env": environment(NUMBA_CACHE_DIR=str(tmp_path)), "text": True}
    at_once = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)
        for _ in range(3)
    ]
    loaded, compiling = [], 0
    for process in at_once:
        out, err = process.communicate()
        assert process.returncode == 0, err
        assert float(out.split()[-2]) == 3.375
        assert "cannot" not in err
        loaded.append(int(out.split()[-1]))
        compiling += "compiling the muscle kernels" in err
    assert (sorted(loaded), compiling) == ([0, 1, 1], 1)  # the others wait and load
    later = subprocess.run(command, capture_output=True, check=True, **options)
    assert printed(later) == (3.375, 1, [])


def test_a_version_that_another_process_replaced_is_not_taken_for_ones_own(tmp_path, monkeypatch):
    """Both found an empty index and chose the same number."""
    mine, other = (kernel_cache._Versions(tmp_path, "kernel", "stamp") for _ in range(2))
    mine.save("float", "code for floats")
    with monkeypatch.context() as before:
        before.setattr(other, "_index", dict)
        write = other._write

        def write_code(which, content):
            write(which, content)
            assert mine.load("float") is None

        before.setattr(other, "_write", write_code)
        other.save("int", "code for integers")
    assert (mine.load("float"), mine.load("int")) == (None, "code for integers")
    mine.save("float", "code for floats")
    assert (other.load("float"), other.load("int")) == ("code for floats", "code for integers")


# Parts of a kernel


ARRAYS = """
def inner(x, i):
    return x[i]

def outer(x, y):
    return inner(x, 0) + inner(y, y.size - 1)
"""


def inner_of(outer):
    return outer._function.__globals__["inner"]


def test_a_kernel_within_another_is_not_made_by_itself(load, tmp_path):
    outer = load()
    assert outer(1.0) == 4.0
    assert not inner_of(outer).entry.overloads
    assert {file.name.split("-")[0] for file in tmp_path.rglob("*.kernel")} == {"kernels.outer"}
    assert inner_of(outer)(1.0) == 2.0


def test_a_kernel_is_translated_once_for_arrays_that_can_be_written_and_others(load):
    """And for numbers that are written at the call and others."""
    outer, x = load(ARRAYS), np.array([1.0, 2.0])
    fixed = x.copy()
    fixed.setflags(write=False)
    assert outer(fixed, x) == 3.0
    made = inner_of(outer).part.overloads
    assert (len(made), len({each.library for each in made.values()})) == (2, 1)


def test_garbage_is_collected_again_after_compiling(load):
    assert load()(1.0) == 4.0
    assert gc.isenabled()
    gc.disable()
    try:
        assert load(ARRAYS)(np.ones(1), np.ones(1)) == 2.0
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_a_kernel_is_pickled_by_its_name():
    assert pickle.loads(pickle.dumps(curves.evaluate)) is curves.evaluate


# What is said


@pytest.fixture
def listening(monkeypatch):
    """A listener to which nothing was said yet; the process's own one counts on in silence."""
    monkeypatch.setattr(compilation, "PATIENCE", math.inf)
    listener = compilation._Compilation()
    compilation.event.register("numba:compile", listener)
    yield listener
    compilation.event.unregister("numba:compile", listener)


def test_compiling_is_said_once_when_it_happens(load, listening, caplog):
    kernel = load()
    assert not caplog.records
    kernel(1.0)
    said = [record for record in caplog.records if "compiling" in record.getMessage()]
    assert {(record.name, record.levelno) for record in said} == {
        ("exudyn_muscles", logging.WARNING)
    }
    assert said[-1].getMessage() == "compiling the muscle kernels, once for this machine"
    caplog.clear()
    kernel(1)  # another signature is compiled, too
    load()(1.0)  # is loaded
    assert not caplog.records


def test_progress_is_said_in_cpu_time(load, caplog, monkeypatch):
    """Four kernels; what lies between them does not count."""
    clock = iter([0, 3, 10, 14, 20, 23, 30, 34])
    monkeypatch.setattr(compilation, "process_time", lambda: next(clock))
    listener, about = (
        compilation._Compilation(),
        SimpleNamespace(data={"dispatcher": load().entry}),
    )
    for _ in range(4):
        listener.on_start(about)
        listener.on_end(about)
    assert [record.getMessage() for record in caplog.records] == [
        "compiling the muscle kernels, once for this machine",
        "compiled 2 kernels in 7 s of CPU time so far",
        "compiled 4 kernels in 14 s of CPU time so far",
    ]


def test_other_kernels_are_not_spoken_of(listening, caplog):
    import numba

    assert numba.njit(lambda x: x + 1)(1) == 2
    assert not caplog.records


def test_a_failed_compilation_ends_its_turn(load):
    outer = load("def inner(x):\n    return x\n\ndef outer(x):\n    return inner(x).nothing\n")
    with pytest.raises(Exception, match="Failed in nopython mode"):
        outer(1.0)
    assert not turns._lock(outer.entry._cache.turn).is_locked  # others may have their turn


def test_without_a_compiler_there_is_nothing_to_store(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", f"{IMPORTED.rpartition('print')[0]}print(evaluate.entry)"],
        env=environment(NUMBA_DISABLE_JIT="1"), capture_output=True, text=True, check=True,
    )  # fmt: skip
    value, entry = done.stdout.splitlines()[-2:]
    assert float(value) == 3.375 and entry.startswith("<function evaluate")


def test_turns_are_of_rooms_and_of_places(monkeypatch):
    """Kernels of one room wait for each other, wherever in it they are; others do not."""

    def turn(module, stamp="stamp", folder="/x"):
        file = f"{folder}/{module.replace('.', '/')}.py"
        return turns.turn_of(stamp, module, file)

    own = turn("exudyn_muscles.muscle.window")
    assert own == turn("exudyn_muscles.muscle.laws.thelen_2003")
    assert own != turn("exudyn_muscles.path.geodesic")
    assert own != turn("exudyn_muscles.muscle.window", "other")
    assert own != turn("exudyn_muscles.muscle.window", folder="/y")
    monkeypatch.setattr(turns.config, "CACHE_DIR", "/elsewhere")
    assert own != turn("exudyn_muscles.muscle.window")


def test_nothing_is_stored_among_installed_packages(tmp_path, monkeypatch):
    """It would stay there when they are removed, and hide those of a checkout."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("HOME", str(tmp_path))
    folder = tmp_path / "site-packages" / "kernels"
    folder.mkdir(parents=True)
    file = folder / "kernels.py"
    file.write_text(SOURCE)
    spec = importlib.util.spec_from_file_location("exudyn_muscles.kernels", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.inner = kernel(module.inner)
    assert kernel(module.outer)(1.0) == 4.0
    assert not list(folder.rglob("*.kernel"))
    assert list(tmp_path.rglob("*.kernel"))
