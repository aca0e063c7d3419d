"""Engines, and what survives: the same table whoever makes the runs, and whatever happens to
them."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import studies
from exudyn_muscles.studies import journal, running

from ..files.test_files import no_file_larger_than
from .subjects import faulty, slowest_force, study

TABLE, JOURNAL = running.TABLE, journal.NAME


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """The study's folder and table, made in this process."""
    folder = tmp_path_factory.mktemp("serial")
    return folder, studies.run(study(), folder)


@pytest.fixture(scope="module")
def cluster():
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        yield cluster


def test_the_table(serial):
    folder, table = serial
    assert list(table.columns) == [
        "run", "source", *study().samples.names, "status", "peak", "error", "share", "message",
        "warnings",
    ]  # fmt: skip
    assert (table["status"] == "complete").all() and table["run"].tolist() == list(range(6))
    assert len(set(table["peak"])) == len(set(table["error"])) == 6
    assert table["source"].unique() == ["models.pendulum:build"]


def test_processes_and_a_cluster_make_the_same_table_to_the_bit(serial, cluster, tmp_path):
    from distributed import Client

    folder, table = serial
    with Client(cluster) as client:
        for name, engine in {
            "two": 2,
            "client": client,
            "address": cluster.scheduler_address,
        }.items():
            again = studies.run(study(), tmp_path / name, engine)
            assert again.equals(table)
            assert (tmp_path / name / TABLE).read_bytes() == (folder / TABLE).read_bytes()


def test_a_run_alone_is_the_same(serial):
    """Neither runs before it nor the study's size matter, but for the noise, which is drawn for
    the run's number."""
    _, table = serial
    one = study().run(4)
    row, _ = studies.compute.compute(one)
    assert row.outcomes == tuple(table.loc[4, ["peak", "error", "share"]])


def test_trajectories_are_kept_as_they_are(tmp_path):
    table = studies.run(study(2, trajectories=True), tmp_path, 2)
    for number, peak in enumerate(table["peak"]):
        result = em.Trajectory.load(tmp_path / "trajectories" / f"{number:06d}.npz")
        assert result.tendon_forces.max() == peak


KILLED = """
import sys
from exudyn_muscles import studies
from tests.studies.subjects import faulty
if __name__ == "__main__":
    studies.run(faulty(count=400, marks=sys.argv[2]), sys.argv[1], int(sys.argv[3]))
"""


@pytest.mark.parametrize("engine", [1, 2])
def test_a_killed_study_goes_on(tmp_path, engine):
    folder, marks = tmp_path / "study", tmp_path / "marks"
    marks.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(folder), str(marks), str(engine)],
        start_new_session=True,
    )
    until = time.monotonic() + 120.0
    while len(list(marks.iterdir())) < 8 and time.monotonic() < until and process.poll() is None:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = (folder / JOURNAL).read_bytes()
    finished = kept.count(b"\n") - 1
    assert 5 <= finished < 100
    with open(folder / JOURNAL, "ab") as stream:
        stream.write(b'{"number": 399, "status": "comp')  # as a kill may leave it
    before = len(list(marks.iterdir()))
    table = studies.run(faulty(count=400, marks=marks), folder)
    assert len(list(marks.iterdir())) - before == 400 - finished
    assert (table["status"] == "complete").all() and table["peak"].nunique() == 1
    assert (folder / JOURNAL).read_bytes().startswith(kept[: kept.rindex(b"\n") + 1])


@pytest.mark.parametrize("engine", ["two", "cluster"])
def test_samples_that_raise_and_processes_that_die_are_rows(engine, cluster, tmp_path):
    engine = 2 if engine == "two" else cluster.scheduler_address
    table = studies.run(faulty(weak=[1], gone=[3, 4]), tmp_path, engine)
    assert table["status"].tolist() == [
        "complete",
        "failed",
        "complete",
        "died",
        "died",
        "complete",
    ]
    assert table["message"][1] == "ValueError: too weak: 1"
    assert "of this run died" in table["message"][3]
    assert table["peak"].isna().tolist() == [False, True, False, True, True, False]


def test_what_died_is_made_again_and_what_failed_is_not(tmp_path, monkeypatch):
    again = faulty(weak=[1], gone=[3])
    studies.run(again, tmp_path, 2)
    asked = []

    def done(runs, engine):
        asked.extend(run.number for run in runs)
        yield from ()

    monkeypatch.setattr(running, "done", done)
    studies.run(again, tmp_path)
    assert asked == [3]


def test_a_full_disk(tmp_path):
    """Files may not grow beyond some size, as on a disk that is full: what is there stays."""
    folder = tmp_path / "full"
    with no_file_larger_than(700), pytest.raises(OSError, match="too large") as failure:
        studies.run(study(), folder)
    lines = (folder / JOURNAL).read_bytes().split(b"\n")
    assert lines[-1] == b"" and 1 < len(lines) - 1 < 7
    done = len(lines) - 2
    (note,) = failure.value.__notes__
    assert note.startswith(f"{6 - done} of 6 runs are missing")
    assert failure.value.filename == str(folder / JOURNAL)
    assert not (folder / TABLE).exists()
    table = studies.run(study(), folder)
    assert (table["status"] == "complete").all()


def test_the_table_says_what_is_missing(serial, tmp_path, monkeypatch):
    _, table = serial
    real = running.done

    def interrupted(runs, engine):
        for number, row in enumerate(real(runs, engine)):
            if number == 2:
                raise KeyboardInterrupt
            yield row

    with monkeypatch.context() as changed:
        changed.setattr(running, "done", interrupted)
        with pytest.raises(KeyboardInterrupt) as failure:
            studies.run(study(), tmp_path)
    assert failure.value.__notes__[0].startswith("4 of 6 runs are missing, the others are kept in")
    import pandas

    written = pandas.read_parquet(tmp_path / TABLE)
    assert written["status"].tolist() == ["complete"] * 2 + ["missing"] * 4
    assert studies.run(study(), tmp_path).equals(table)


def test_a_lost_scheduler(tmp_path, monkeypatch):
    from distributed import Client, LocalCluster

    real, seen = journal.Journal.add, []
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster, timeout=5) as client,
    ):

        def add(self, row):
            real(self, row)
            seen.append(row)
            if len(seen) == 3:
                cluster.close(timeout=5)

        monkeypatch.setattr(journal.Journal, "add", add)
        with pytest.raises(em.StudyError, match="scheduler is lost") as failure:
            studies.run(faulty(count=2000), tmp_path, client)
    kept = (tmp_path / JOURNAL).read_text().splitlines()[1:]
    assert 3 <= len(kept) < 2000
    assert f"{2000 - len(kept)} of 2000 runs are missing" in failure.value.__notes__[0]


def test_no_scheduler_there(tmp_path):
    import dask

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
        pytest.raises(em.StudyError, match="no dask scheduler answers"),
    ):
        studies.run(study(), tmp_path, "tcp://127.0.0.1:1")


@pytest.mark.parametrize("engine", [0, -1, True, None, 1.5])
def test_what_is_no_engine(engine, tmp_path):
    with pytest.raises(em.StudyError, match="expected a number of processes, the address"):
        studies.run(study(), tmp_path, engine)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"count": 7}, "samples"),
        ({"seed": 4}, "seed"),
        ({"method": "css"}, "method"),
        ({"method": studies.Method("csf", {"step": 0.005})}, "method"),
        ({"trajectories": True}, "trajectories"),
    ],
)
def test_another_study_is_refused_by_name(serial, changes, named):
    folder, _ = serial
    with pytest.raises(em.StudyError, match=f"here is another study, with another {named}; choose"):
        studies.run(study(**changes), folder)


def test_two_processes_at_one_folder(tmp_path):
    with (
        journal.open_journal(tmp_path, study().identity()),
        pytest.raises(em.StudyError, match="another process is at this study"),
    ):
        studies.run(study(), tmp_path)


@pytest.mark.parametrize(
    ("line", "content", "text"),
    [
        (0, b"{}", "line 1: this is no journal of a study"),
        (0, b"\x00", "line 1: this is no journal"),
        (2, b"nothing", "line 3: damaged"),
        (2, b'{"number": 1}', "line 3: damaged"),
    ],
)
def test_damaged_journals(tmp_path, line, content, text):
    studies.run(study(2), tmp_path)
    lines = (tmp_path / JOURNAL).read_bytes().split(b"\n")
    lines[line] = content
    (tmp_path / JOURNAL).write_bytes(b"\n".join(lines))
    with pytest.raises(em.StudyError, match=text):
        studies.run(study(2), tmp_path)


def test_a_message_with_newlines_and_nan_is_a_row_as_any_other(tmp_path):
    with journal.open_journal(tmp_path, {"seed": 1}) as opened:
        row = studies.study.Row(5, "failed", (np.nan, 1.0 / 3.0), "a\nb", "c")
        opened.add(row)
    with journal.open_journal(tmp_path, {"seed": 1}) as opened:
        (again,) = opened.rows.values()
    assert (again.message, again.outcomes[1]) == (row.message, row.outcomes[1])
    assert np.isnan(again.outcomes[0])
    assert len([json.loads(x) for x in (tmp_path / JOURNAL).read_text().splitlines()]) == 2


def test_workers_have_one_thread(tmp_path):
    """Of whatever library there is, in processes and in threads of a cluster's workers."""
    study_of_threads = study(2, outcomes={"threads": threads, "own": slowest_force})
    table = studies.run(study_of_threads, tmp_path, 2)
    assert table["threads"].tolist() == [1.0, 1.0] and (table["own"] > 0.0).all()


def threads(model, result):
    from threadpoolctl import threadpool_info

    return max((pool["num_threads"] for pool in threadpool_info()), default=1)
