"""The rows of a study as they become known: a line of JSON each, on the disk before the next one.

A process that is killed leaves at most the beginning of a line, which is taken away when the study
goes on.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from io import FileIO
from pathlib import Path
from typing import Any

from ..errors import StudyError
from .study import Row

FORMAT = "exudyn_muscles.Study"
NAME = "runs.jsonl"


class Journal:
    """An open journal.

    Attributes
    ----------
    rows : dict of int to Row
        By their number, those of before.
    """

    def __init__(self, stream: FileIO, rows: dict[int, Row]) -> None:
        self.rows = rows
        self._stream = stream

    def add(self, row: Row) -> None:
        """Write a row.

        Raises
        ------
        OSError
            The disk is full, and so on. The rows before are there.
        """
        _write(self._stream, asdict(row))
        self.rows[row.number] = row


@contextmanager
def open_journal(folder: Path, identity: Mapping[str, Any]) -> Iterator[Journal]:
    """The journal of a study in a folder, which is made if needed; nobody else has it meanwhile.

    Raises
    ------
    StudyError
        It is that of another study, of which it names what differs, is damaged, or another process
        is at it.
    OSError
        It cannot be written.
    """
    from filelock import FileLock, Timeout

    folder.mkdir(parents=True, exist_ok=True)
    file, lock = folder / NAME, FileLock(folder / f"{NAME}.lock")
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise StudyError(f"{folder}: another process is at this study") from None
    try:
        with open(file, "a+b", buffering=0) as stream:
            stream.seek(0)
            lines = stream.read().split(b"\n")
            stream.truncate(sum(len(line) + 1 for line in lines[:-1]))  # without what was cut off
            if len(lines) == 1:
                _write(stream, {"format": FORMAT, **identity})
                yield Journal(stream, {})
            else:
                _check(file, lines[0], identity)
                rows = [_row(file, k + 2, line) for k, line in enumerate(lines[1:-1])]
                yield Journal(stream, {row.number: row for row in rows})
    finally:
        lock.release()


def _write(stream: FileIO, content: Mapping[str, Any]) -> None:
    end = stream.seek(0, os.SEEK_END)
    line = json.dumps(content).encode() + b"\n"
    try:
        while line:  # on a full disk a part of it may go
            line = line[stream.write(line) :]
        os.fsync(stream.fileno())
    except BaseException as error:
        with suppress(OSError):
            stream.truncate(end)
        if isinstance(error, OSError):  # which names no file where a disk is full
            raise OSError(error.errno, error.strerror, str(stream.name)) from error
        raise


def _check(file: Path, line: bytes, identity: Mapping[str, Any]) -> None:
    try:
        header = dict(json.loads(line))
    except (ValueError, TypeError):
        header = {}
    if header.pop("format", None) != FORMAT:
        raise StudyError(f"{file}, line 1: this is no journal of a study")
    other = [part for part, value in identity.items() if header.get(part) != value]
    if other:
        raise StudyError(
            f"{file.parent}: here is another study, with another {', '.join(other)}; choose "
            "another folder"
        )


def _row(file: Path, number: int, line: bytes) -> Row:
    try:
        content = json.loads(line)
        return Row(**{**content, "outcomes": tuple(map(float, content["outcomes"]))})
    except (ValueError, TypeError, KeyError) as error:
        raise StudyError(f"{file}, line {number}: damaged ({error})") from None
