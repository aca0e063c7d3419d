"""All runs of a study on an engine, into one table that survives whatever happens."""

from __future__ import annotations

import io
import sys
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from tqdm import tqdm

from ..files.disk import write_file
from .engines import Engine, done
from .journal import open_journal
from .study import Row, Study

if TYPE_CHECKING:
    import pandas

TABLE, TRAJECTORIES = "table.parquet", "trajectories"
AGAIN = ("died",)  # what a run has to have for being made again when the study goes on
MISSING = "missing"
LINES = 60.0  # s between two lines of progress where there is no terminal


def run(
    study: Study, folder: str | Path, engine: Engine = 1, *, quiet: bool = False
) -> pandas.DataFrame:
    """Make all runs of a study, and keep what they give in a folder.

    The same call goes on where it was stopped, however that was. Runs of the same study are the
    same to the bit whatever the engine.

    Parameters
    ----------
    study : Study
    folder : str or Path
        Made if needed. `runs.jsonl` has a line for each run that is done, `table.parquet` all of
        them in their order when the call ends, `trajectories/NUMBER.npz` the trajectories.
    engine : int, str or distributed.Client
        Number of processes, of which one is this one; or a dask scheduler's address, or a client of
        it, whose workers find the study's files under the same names.
    quiet : bool
        No progress on the standard error output.

    Returns
    -------
    pandas.DataFrame
        As the table: `run`, `source`, the parameters, `status`, the outcomes, `message`,
        `warnings`. The status is `complete`, `incomplete` or `lost` as of a Trajectory, `failed`
        of an exception, `died` where a process did, `missing` where there was no run.

    Raises
    ------
    StudyError
        The folder has another study, another process is at it, or the scheduler is lost.
    OSError
        A file cannot be written, as where the disk is full. Like every exception it says how many
        runs are missing, and those that are done are kept.
    ImportError
        joblib, dask, pandas or another of the extra `study` is not installed.
    """
    folder = Path(folder)
    with open_journal(folder, study.identity()) as journal:
        rows = journal.rows
        pending = [
            study.run(number)
            for number in range(study.size)
            if number not in rows or rows[number].status in AGAIN
        ]
        try:
            found = done(pending, engine)  # which ends its processes when it is closed
            with closing(found), _progress(study, len(pending), quiet) as bar:
                for row, trajectory in found:
                    if trajectory is not None:
                        (folder / TRAJECTORIES).mkdir(exist_ok=True)
                        trajectory.save(folder / TRAJECTORIES / f"{row.number:06d}.npz")
                    journal.add(row)
                    bar.update()
        except BaseException as error:
            missing = study.size - len(rows)
            error.add_note(
                f"{missing} of {study.size} runs are missing, the others are kept in {folder}: the "
                "same call goes on there"
            )
            with suppress(OSError):
                _write(tabulated(study, rows), folder)
            raise
        table = tabulated(study, rows)
        _write(table, folder)
        return table


def tabulated(study: Study, rows: dict[int, Row]) -> pandas.DataFrame:
    """The table of a study, whatever is missing."""
    import pandas

    numbers = range(study.size)
    names, values = study.samples.names, np.tile(study.samples.values, (len(study.sources), 1))
    columns: dict[str, Any] = {
        "run": np.arange(study.size),
        "source": [study.sources[number // len(study.samples)].name for number in numbers],
        **{name: values[:, k] for k, name in enumerate(names)},
    }
    nothing = (np.nan,) * len(study.columns)
    found = [rows.get(number, Row(number, MISSING, nothing)) for number in numbers]
    columns["status"] = [row.status for row in found]
    for k, outcome in enumerate(study.columns):
        columns[outcome.name] = np.array([row.outcomes[k] for row in found])
    columns["message"] = [row.message for row in found]
    columns["warnings"] = [row.warnings for row in found]
    return pandas.DataFrame(columns)


def _write(table: pandas.DataFrame, folder: Path) -> None:
    content = io.BytesIO()
    table.to_parquet(content)
    write_file(folder / TABLE, content.getvalue())


def _progress(study: Study, pending: int, quiet: bool) -> tqdm:
    """A bar with an estimate of the end; where there is no terminal a line from time to time."""
    every = 0.1 if sys.stderr.isatty() else LINES
    return tqdm(
        desc="study",
        total=study.size,
        initial=study.size - pending,
        unit="run",
        mininterval=every,
        delay=1,
        disable=quiet,
    )
