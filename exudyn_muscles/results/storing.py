"""A trajectory as a file: what a stored result has to be, whoever stored it, and whenever."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ResultFileError, cut
from ..files.disk import read_arrays, write_arrays
from .counts import Counts, Status
from .quantities import NAMES_OF, QUANTITIES

FORMAT = "exudyn_muscles.Trajectory"
# Three minutes of 20 coordinates and 100 muscles in steps of 1 ms; those of the tests have 1 MB.
LARGEST = 1e9  # bytes
UNITS = {"rad", "m"}


def write_fields(file: str | Path, fields: Mapping[str, Any]) -> None:
    """`write_file` for a trajectory's arrays as such, and all its other fields as a header."""
    arrays = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
    rest = {name: value for name, value in fields.items() if name not in arrays}
    rest |= {"status": fields["status"].name, "counts": asdict(fields["counts"])}
    header = {"format": FORMAT, "version": FORMAT_VERSION, **rest}
    write_arrays(file, header=json.dumps(header), **arrays)


def read_fields(file: str | Path) -> dict[str, Any]:
    """All fields of a trajectory, which fit each other.

    What files of older versions lack is NaN, or what was meant then: angles, no saturated muscles,
    a tree without constraints.

    Raises
    ------
    ResultFileError
        The file is damaged, is not a trajectory, or is of another version; names it and the field.
    FileNotFoundError
    """
    content: dict[str, Any] = read_arrays(file, LARGEST, ResultFileError)
    try:
        header = json.loads(content.pop("header").item())
        found = header.pop("format", None), header.pop("version", None)
    except Exception as error:
        raise ResultFileError(f"{file}: not a readable trajectory ({error!r})") from error
    if found[0] != FORMAT or found[1] not in range(1, FORMAT_VERSION + 1):
        raise ResultFileError(
            f"{file}: expected {FORMAT} version 1 to {FORMAT_VERSION}, found {found[0]} version "
            f"{found[1]}"
        )
    for name, array in content.items():
        if array.dtype.kind != "f":
            raise ResultFileError(f"{file}: {name} has to be numbers, it is {array.dtype}")
    for name, value in header.items():
        if name in content or name not in KINDS or not KINDS[name](value):
            raise ResultFileError(f"{file}: damaged header, {name} = {cut(repr(value))}")
    fields = {**{name: array.astype(float) for name, array in content.items()}, **header}
    _complete(fields, found[1], file)
    try:
        fields["status"] = Status[fields["status"]]
        fields["counts"] = Counts(**fields["counts"])
    except (TypeError, KeyError) as error:
        raise ResultFileError(f"{file}: damaged header ({error!r})") from error
    for name in (*NAMES_OF.values(), "coordinate_units"):
        fields[name] = tuple(fields[name])
    fields["saturated"] = tuple(map(tuple, fields["saturated"]))
    _check_sizes(fields, file)
    return fields


def _complete(fields: dict[str, Any], version: int, file: str | Path) -> None:
    """Add what the file's version does not have; raise ResultFileError for what it lacks."""
    since = {one.field: one.since for one in QUANTITIES} | dict.fromkeys(KINDS, 1)
    since |= {name: first for name, (first, _) in ADDED.items()}
    missing = {name for name, first in since.items() if first <= version} - set(fields)
    if missing:
        raise ResultFileError(f"{file}: truncated, without {sorted(missing)}")
    foreign = set(fields) - set(since)
    if foreign:
        raise ResultFileError(f"{file}: a trajectory has no {cut(str(sorted(foreign)))}")
    for name, (_, usual) in ADDED.items():
        fields.setdefault(name, usual * len(fields["coordinate_names"]))
    for one in QUANTITIES:
        if one.field not in fields:
            fields[one.field] = np.full(one.shape(fields), one.before)


def _check_sizes(fields: Mapping[str, Any], file: str | Path) -> None:
    """Raise ResultFileError unless all fields fit each other."""
    for one in QUANTITIES:
        found, expected = fields[one.field].shape, one.shape(fields)
        if found != expected:
            raise ResultFileError(f"{file}: {one.field} of shape {found}, expected {expected}")
    n = len(fields["coordinate_names"])
    for name in ("coordinate_units", "saturated"):
        if len(fields[name]) != n:
            raise ResultFileError(f"{file}: {name} are not {n}, one for each coordinate")
    for name in ("time", "window_time"):
        clock = fields[name]
        if clock.size == 0 or not np.isfinite(clock).all() or (np.diff(clock) <= 0.0).any():
            raise ResultFileError(f"{file}: {name} does not increase, or is empty")


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_text, value))


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_time(value: Any) -> bool:
    return isinstance(value, (int, float)) and 0.0 <= value < math.inf


# What belongs into the header's fields.
KINDS: dict[str, Callable[[Any], bool]] = {
    "method": _is_text,
    "message": _is_text,
    "status": _is_text,
    "coordinate_names": _are_texts,
    "coordinate_units": lambda value: _are_texts(value) and set(value) <= UNITS,
    "system_names": _are_texts,
    "muscle_names": _are_texts,
    "reserve_names": _are_texts,
    "saturated": lambda value: isinstance(value, list) and all(map(_are_texts, value)),
    "counts": lambda value: isinstance(value, dict) and all(map(_is_count, value.values())),
    "cpu_time": _is_time,
    "settings": lambda value: isinstance(value, dict),
    "versions": lambda value: isinstance(value, dict) and all(map(_is_text, value.values())),
}
# Those of them that not every version has: the first that always does, and what stands for each
# coordinate's.
ADDED: dict[str, tuple[int, list]] = {
    "coordinate_units": (2, ["rad"]), "saturated": (3, [[]]), "system_names": (4, []),
}  # fmt: skip
FORMAT_VERSION = max(*(one.since for one in QUANTITIES), *(first for first, _ in ADDED.values()))
