"""The command line as a process: signals, pipes that nobody reads, terminals without letters."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import cli
from exudyn_muscles.cli import interrupts

from ..reference.make import FOLDER
from .test_commands import PENDULUM, error_line, stopped

__all__ = ["stopped"]  # a fixture
TERMINATE = "__import__('os').kill(__import__('os').getpid(), 15)"
RESULT = FOLDER / "pendulum_csf.npz"


def process(*arguments, **options):
    # Without Exudyn's own note, which it prints when it is imported.
    environment = {key: value for key, value in os.environ.items() if "SUPPRESS_UI" not in key}
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.Popen(
        [sys.executable, "-m", "exudyn_muscles.cli", *map(str, arguments)],
        env=environment | options.pop("env", {}), **options,
    )  # fmt: skip


# SIGTERM


# After the lengths of the muscles over the motion were checked, static optimization asks for them
# once a step.
STATIC = """
import itertools
import pendulum
motion = pendulum.motion
def build():
    model, calls = pendulum.build(), itertools.count()
    geometry = model.geometry
    def counted(q, v):
        {deed} if next(calls) == 150 else None
        return geometry(q, v)
    model.geometry = counted
    return model
"""


@pytest.mark.parametrize("method", ["static", "cmc", "csf", "css"])
def test_sigterm_saves_what_was_reached(method, stopped, tmp_path, capsys):
    file, out = stopped(TERMINATE), tmp_path / "out"
    if method == "static":
        Path(file).write_text(STATIC.format(deed=TERMINATE))
    assert cli.main(["run", file, "--method", method, "--out", str(out)]) == 143
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    line = error_line(capsys)
    partial = out / f"stopped_{method}_partial.npz"
    assert line.startswith("terminated; ") and line.endswith(f"is in {partial}")
    trajectory = em.Trajectory.load(partial)
    assert trajectory.status is em.Status.INCOMPLETE
    assert 0.25 < trajectory.time[-1] < 0.6


def test_sigterm_of_a_process(stopped, tmp_path):
    done = process("run", stopped(TERMINATE), "--method", "csf", "--out", tmp_path)
    _, err = done.communicate()
    assert done.returncode == 143
    assert err.decode().startswith("exudyn-muscles: error: terminated; ")
    assert em.Trajectory.load(tmp_path / "stopped_csf_partial.npz").time[-1] > 0.29


def test_sigterm_before_a_run_ends_the_command(tmp_path, capsys):
    file = tmp_path / "slow.py"
    file.write_text(f"{TERMINATE}\nwhile True:\n    pass\n")
    assert cli.main(["run", str(file), "--method", "csf"]) == 143
    assert error_line(capsys) == "terminated"


def test_sigterm_is_the_applications_own_business(stopped, capsys):
    """A handler that is there stays, and a library's user has none of ours."""
    received = []
    signal.signal(signal.SIGTERM, lambda *_: received.append("own"))
    try:
        assert cli.main(["run", stopped(TERMINATE), "--method", "csf"]) == 0
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    assert received
    assert interrupts.Terminated not in map(type, received)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("deed", ["raise KeyboardInterrupt", "return True"])
def test_an_interrupt_waits_until_the_result_is_saved(
    number, deed, stopped, tmp_path, capsys, monkeypatch
):
    """The impatient press Ctrl-C again, and clusters send SIGTERM to a run that has just ended."""
    save = em.Trajectory.save

    def interrupted(self, file):
        signal.raise_signal(number)  # to this thread: another one may be late to hear of it
        save(self, file)

    monkeypatch.setattr(em.Trajectory, "save", interrupted)
    arguments = ["run", stopped(deed), "--method", "csf", "--out", str(tmp_path)]
    status = cli.main(arguments)
    partial = "_partial" if "raise" in deed else ""
    assert em.Trajectory.load(tmp_path / f"stopped_csf{partial}.npz").time[-1] > 0.29
    assert status == (143 if number == signal.SIGTERM and not partial else 130)
    assert "Traceback" not in capsys.readouterr().err


# Pipes and terminals


def test_a_pipe_that_nobody_reads_is_no_error(tmp_path):
    """What has to be computed and written is, and the exit status is the command's own."""
    read, write = os.pipe()
    os.close(read)
    numbers = tmp_path / "numbers.json"
    started = [
        process("compare", PENDULUM, "--repeat", 1, "--json", numbers, stdout=write),
        process("check", RESULT, FOLDER / "pendulum_css.npz", stdout=write, stderr=write),
        process("check", RESULT, tmp_path / "none.npz", stdout=write, stderr=write),
        process("run", "--help", stdout=write),
    ]
    os.close(write)
    ended = [(each.communicate()[1] or b"", each.returncode) for each in started]
    assert ended == [(b"", 0), (b"", 1), (b"", 2), (b"", 0)]
    assert set(json.loads(numbers.read_text())) > {"static", "cmc", "csf", "css"}


def test_a_model_that_prints_much_into_such_a_pipe(tmp_path):
    shutil.copy(PENDULUM, tmp_path)
    file = tmp_path / "talkative.py"
    file.write_text("from pendulum import *\nprint('x' * 1000_000)\n")
    read, write = os.pipe()
    os.close(read)
    run = process("run", file, "--method", "static", "--out", tmp_path, stdout=write)
    os.close(write)
    assert (run.communicate()[1], run.returncode) == (b"", 0)
    assert (tmp_path / "talkative_static.npz").exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is full")
def test_an_output_that_is_lost_on_a_full_disk_is_an_error():
    with open("/dev/full", "wb") as full:
        done = process("check", RESULT, RESULT, stdout=full)
    assert done.communicate()[1] == b"exudyn-muscles: error: [Errno 28] No space left on device\n"
    assert done.returncode == 2


@pytest.mark.parametrize(
    "environment",
    [
        {"PYTHONIOENCODING": "ascii"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        {"LANG": "C"},
    ],
)
def test_letters_that_a_terminal_lacks(environment, tmp_path):
    file = tmp_path / "Größe.npz"
    file.write_bytes(RESULT.read_bytes())
    agrees = process("check", file, RESULT, env=environment)
    out, err = agrees.communicate()
    assert (agrees.returncode, err) == (0, b"")
    assert b"npz agrees with" in out
    missing = process("check", tmp_path / "Größer.npz", RESULT, env=environment)
    out, err = missing.communicate()
    assert (missing.returncode, out) == (2, b"")
    assert err.startswith(b"exudyn-muscles: error: ") and err.count(b"\n") == 1


def test_messages_do_not_steer_a_terminal(tmp_path, capsys):
    """A file's label may hold what clears the screen."""
    file = tmp_path / "motion.sto"
    em.Storage("a", ["\x1b[2J"], np.arange(6.0), np.zeros((6, 1))).write(file)
    shutil.copy(PENDULUM, tmp_path)
    model = tmp_path / "model.py"
    model.write_text(
        "import exudyn_muscles as em\nfrom pendulum import build\n"
        f"def motion(): return em.Motion.from_file({str(file)!r}, ['theta'], ['rad'])\n"
    )
    assert cli.main(["run", str(model), "--method", "csf"]) == 2
    line = error_line(capsys)
    assert "\x1b" not in line and r"the columns are \x1b[2J" in line
