"""The announcement appears exactly when numba has something to compile."""

import importlib.util
import logging
import os
import subprocess
import sys

import pytest

from exudyn_muscles import compilation
from exudyn_muscles.compilation import announce_compilation, is_compiled

KERNEL = """
from numba import njit

@njit(cache=True)
def kernel(x):
    return x + 1.0
"""


@pytest.fixture
def fresh_announcement():
    """Announcements are made once a process."""
    compilation._tell.cache_clear()
    yield
    compilation._tell.cache_clear()


@pytest.fixture
def load(tmp_path):
    """Import the kernel as a new process would: with a dispatcher that has done nothing yet."""
    file = tmp_path / "kernels.py"

    def load(source=KERNEL):
        file.write_text(source)
        spec = importlib.util.spec_from_file_location("kernels", file)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.kernel

    return load


def test_kernel_is_compiled_once_called_and_in_later_processes(load):
    kernel = load()
    assert not is_compiled(kernel)
    kernel(1.0)
    assert is_compiled(kernel)
    assert is_compiled(load())


def test_changed_source_is_not_compiled(load):
    load()(1.0)
    assert not is_compiled(load(KERNEL.replace("1.0", "2.0")))


def test_missing_data_file_is_not_compiled(load, tmp_path):
    load()(1.0)
    for file in tmp_path.rglob("*.nbc"):
        file.unlink()
    assert not is_compiled(load())


@pytest.mark.parametrize("kernel", [lambda x: x, None])
def test_what_is_no_dispatcher_does_not_matter(kernel):
    assert is_compiled(kernel)


def test_announced_once_and_only_before_the_compilation(load, caplog, fresh_announcement):
    kernel = load()
    announce_compilation(kernel)
    announce_compilation(kernel)
    (record,) = caplog.records
    assert (record.name, record.levelno) == ("exudyn_muscles", logging.WARNING)
    assert "compiling the muscle kernels" in record.getMessage()


def test_not_announced_if_compiled(load, caplog, fresh_announcement):
    load()(1.0)
    announce_compilation(load())
    assert not caplog.records


def test_seen_on_stderr_on_a_new_machine(tmp_path):
    code = (
        "from exudyn_muscles.compilation import announce_compilation\n"
        "announce_compilation(); announce_compilation()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    (line,) = done.stderr.splitlines()
    assert line.startswith("compiling the muscle kernels")
