"""OpenSim's storage files (`.sto`, `.mot`): tables over time, read and written.

Whether angles in a file are degrees is said once, in its header; what else is in it stays in SI
units. Only who knows which coordinates are angles can convert them: `Storage.coordinates`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import StorageError, StorageWarning, cut, warn
from .disk import read_file, write_file
from .table import read_table

END = "endheader"
# Generous: half an hour of 50 columns at 100 Hz, the states of a model with 2000 muscles, an hour
# at 1000 Hz, and headers of some ten lines.
LARGEST = 100e6  # bytes
MOST_COLUMNS = 10_000
MOST_LINES = 4_000_000
LONGEST_HEADER = 10_000  # lines
# The header's keys that mean something here, with their older names.
KEYS = {
    "name": "name",
    "version": "version",
    "indegrees": "inDegrees",
    "datatype": "DataType",
    "nrows": "nRows",
    "nr": "nRows",
    "datarows": "nRows",
}
TRUTH = {"yes": True, "y": True, "no": False, "n": False}
ANGLES = re.compile(r"angles are in (degrees|radians)", re.IGNORECASE)
OF_SPREADSHEETS = re.compile(r"(?<=\s)#[A-Z0-9/]+[!?]?(?=\s)")  # for what they cannot compute

# Labels of OpenSim 3 and, after any joint or set that they belong to, of OpenSim 4.
VALUE = ("{}", "/{}/value")
CONTROL = ("{}", "{}.excitation", "/{}")


@dataclass(frozen=True, eq=False)
class Storage:
    """A table of c columns over k times, as in a storage file.

    Attributes
    ----------
    name : str
        The file's first line.
    labels : tuple of str
        Of the columns, without that of the time.
    time : (k,) ndarray
        Increasing [s].
    values : (k, c) ndarray
        NaN where nothing is known.
    in_degrees : bool
        Angles are in degrees, else in radians.

    Raises
    ------
    StorageError
        Shapes that do not fit, times that do not increase, or a name or label that no file can
        hold; names it.
    """

    name: str
    labels: tuple[str, ...]
    time: np.ndarray
    values: np.ndarray
    in_degrees: bool = False

    def __post_init__(self) -> None:
        what, labels = f"storage '{self.name}'", tuple(self.labels)
        try:
            t, x = np.array(self.time, dtype=float), np.array(self.values, dtype=float)
        except (TypeError, ValueError) as error:
            raise StorageError(f"{what}: time and values must be numbers: {error}") from error
        if t.ndim != 1 or x.shape != (t.size, len(labels)) or t.size == 0:
            raise StorageError(
                f"{what}: time {t.shape}, values {x.shape} and {len(labels)} labels do not fit: "
                "expected (k,), (k, c) and c, with k >= 1"
            )
        if self.name != " ".join(self.name.split()) or (self.name and not _is_name(self.name)):
            raise StorageError(f"{what}: this name would not be read as one")
        for label in labels:
            if label.split() != [label]:
                raise StorageError(f"{what}: label {label!r} is empty or has blanks in it")
        if not (np.isfinite(t).all() and (np.diff(t) > 0.0).all()):
            raise StorageError(f"{what}: time must be finite and increase")
        for field, value in (("labels", labels), ("time", t), ("values", x)):
            object.__setattr__(self, field, value)
        t.setflags(write=False)
        x.setflags(write=False)

    def coordinates(self, names: Sequence[str], units: Sequence[str]) -> np.ndarray:
        """Coordinates, whatever unit the file has.

        Parameters
        ----------
        names : (n,) sequence of str
            Columns are found by these (`elbow`) or by OpenSim 4's state paths
            (`/jointset/<joint>/elbow/value`); others do not matter.
        units : (n,) sequence of str
            rad or m: only angles are converted.

        Returns
        -------
        (k, n) ndarray
            [rad or m]

        Raises
        ------
        StorageError
            A coordinate has no column, or two of them; tells which columns there are.
        """
        if len(units) != len(names) or not set(units) <= {"rad", "m"}:
            raise StorageError(
                f"units must be rad or m for each of {len(names)} coordinates, got {units!r}"
            )
        columns = self._columns("coordinate", names, VALUE)
        if self.in_degrees:
            rotates = np.array([unit == "rad" for unit in units], dtype=bool)
            columns[:, rotates] = np.radians(columns[:, rotates])
        return columns

    def controls(self, names: Sequence[str]) -> np.ndarray:
        """Controls of muscles or other actuators.

        Parameters
        ----------
        names : (m,) sequence of str
            Columns are called `<name>`, `<name>.excitation` or `/forceset/<name>`.

        Returns
        -------
        (k, m) ndarray

        Raises
        ------
        StorageError
            An actuator has no column, or two of them; tells which columns there are.
        """
        return self._columns("actuator", names, CONTROL)

    def vector(self, identifier: str) -> np.ndarray:
        """The vector of three columns whose labels begin alike, as in OpenSim.

        Parameters
        ----------
        identifier : str
            What they begin with.

        Returns
        -------
        (k, 3) ndarray

        Raises
        ------
        StorageError
            Other than three columns begin with it, or what follows is not in order, such as x, y, z
            or 1, 2, 3; tells which columns there are.
        """
        found = [
            k for k, label in enumerate(self.labels) if identifier and label.startswith(identifier)
        ]
        named = [self.labels[k] for k in found]
        if len(found) != 3:
            raise StorageError(
                f"{len(found)} columns begin with '{identifier}', but a vector needs three; the "
                f"columns are {', '.join(self.labels)}"
            )
        if named != sorted(set(named)):
            raise StorageError(f"the columns of '{identifier}' are not in order: {named}")
        return self.values[:, found]

    def _columns(self, noun: str, names: Sequence[str], spellings: Sequence[str]) -> np.ndarray:
        """The columns of these names as a new array."""
        columns = []
        for name in names:
            wanted = [spelling.format(name) for spelling in spellings]
            found = [
                k
                for k, label in enumerate(self.labels)
                if label in wanted or f"/{label}".endswith(wanted[-1])
            ]
            if not found:
                raise StorageError(
                    f"there is no column for {noun} '{name}'; the columns are "
                    f"{', '.join(self.labels)}"
                )
            if len(found) > 1:
                same = ", ".join(self.labels[k] for k in found)
                raise StorageError(f"more than one column for {noun} '{name}': {same}")
            columns += found
        return self.values[:, columns]

    def write(self, file: str | Path) -> None:
        """Write a file that every OpenSim since 2 reads; `read_storage` gives back every bit.

        Parameters
        ----------
        file : str or Path

        Raises
        ------
        OSError
            It cannot be written; names it. An earlier file of this name is as it was.
        """
        lines = [
            self.name,
            "version=1",
            f"nRows={len(self.time)}",
            f"nColumns={1 + len(self.labels)}",
            f"inDegrees={'yes' if self.in_degrees else 'no'}",
            END,
            "\t".join(["time", *self.labels]),
        ]
        table = np.column_stack([self.time, self.values]).tolist()
        lines += ["\t".join(map(repr, row)) for row in table]
        write_file(file, "\n".join([*lines, ""]).encode())


def read_storage(file: str | Path) -> Storage:
    """Read a storage file of OpenSim 2 to 4, or a motion file of SIMM with a column of times.

    Angles are in degrees if `inDegrees` or a sentence of the header says so, or in a `.mot` file
    without a version, as those of SIMM. Of rows with one time the last counts. Both are as in
    OpenSim.

    Parameters
    ----------
    file : str or Path

    Returns
    -------
    Storage

    Raises
    ------
    StorageError
        The file is not one, or is damaged; names the line and what is wrong with it.
    FileNotFoundError

    Warns
    -----
    StorageWarning
        It has more or fewer rows than it says, or cells with errors of a spreadsheet, unknown here.
    """
    content = read_file(file, LARGEST, StorageError)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    text, unknown = OF_SPREADSHEETS.subn("nan", text.replace("\r\n", "\n").replace("\r", "\n"))
    if unknown:
        warn(f"{file}: {unknown} cells hold no numbers but a spreadsheet's errors", StorageWarning)
    if text.count("\n") > MOST_LINES:
        raise StorageError(f"{file}: more than {MOST_LINES} lines")
    lines = text.split("\n")
    name, header, first = _header(file, lines)
    filled = [k for k in range(first, len(lines)) if lines[k].strip()]
    if len(filled) < 2:
        raise StorageError(f"{file}: there are no rows after '{END}' in line {first}")
    head, *rows = filled
    here = f"{file}, line {head + 1}"
    time, *labels = lines[head].split()
    if time.lower() != "time":
        raise StorageError(f"{here}: the first column must be 'time', it is '{cut(time)}'")
    if len(labels) > MOST_COLUMNS:
        raise StorageError(f"{here}: more than {MOST_COLUMNS} columns")
    stated = header.get("nRows")
    announced = None if stated is None else (stated.number(file), stated.line)
    table = read_table(str(file), lines, rows, [time, *labels], announced)
    if not len(table):
        raise StorageError(f"{here}: what follows are no rows of {1 + len(labels)} numbers")
    table = table[np.append(np.diff(table[:, 0]) > 0.0, True)]
    degrees = _in_degrees(file, lines[:first], header)
    return Storage(name, tuple(labels), table[:, 0], table[:, 1:], degrees)


# The header.


class Entry(NamedTuple):
    """A key's value and its line in the file."""

    value: str
    line: int

    def number(self, file: str | Path) -> int:
        """The value as a whole number."""
        if not re.fullmatch(r"\d{1,9}", self.value):
            raise StorageError(
                f"{file}, line {self.line}: expected a whole number, got '{cut(self.value)}'"
            )
        return int(self.value)


def _header(file: str | Path, lines: list[str]) -> tuple[str, dict[str, Entry], int]:
    """Name, what the known keys say, and the index of the first line after the header."""
    name: str | None = None
    entries: dict[str, Entry] = {}
    for k, line in enumerate(lines[:LONGEST_HEADER]):
        text = " ".join(line.split())
        key = _key(text)
        if key == END:
            break
        if key in KEYS:
            value = re.split("[ =]+", text, maxsplit=1)[1:]
            entries.setdefault(KEYS[key], Entry(value[0] if value else "", k + 1))
        if text and name is None:
            name = text if _is_name(text) else ""
    else:
        raise StorageError(f"{file}: no line '{END}', so this is not a storage file")
    kind = entries.get("DataType")
    if kind is not None and kind.value.lower() != "double":
        raise StorageError(
            f"{file}, line {kind.line}: DataType={cut(kind.value)}, only double can be read"
        )
    return entries["name"].value if "name" in entries else name or "", entries, k + 1


def _key(text: str) -> str:
    return re.split("[ =]", text, maxsplit=1)[0].lower()


def _is_name(text: str) -> bool:
    """A header's first line is the name unless it says something else."""
    return not ("=" in text or text.startswith("#") or _key(text) in {*KEYS, END})


def _in_degrees(file: str | Path, header: list[str], entries: dict[str, Entry]) -> bool:
    if "inDegrees" in entries:
        value, number = entries["inDegrees"]
        if value.lower() not in TRUTH:
            raise StorageError(f"{file}, line {number}: inDegrees={cut(value)}, expected yes or no")
        return TRUTH[value.lower()]
    for line in header:
        sentence = ANGLES.search(line)
        if sentence:
            return sentence[1].lower() == "degrees"
    old = "version" not in entries or entries["version"].number(file) == 0
    return old and Path(file).suffix.lower() == ".mot"
