"""What a stored result has to be, whoever stored it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ResultFileError, cut
from ..files.disk import read_arrays, write_arrays

FORMAT = "exudyn_muscles.Trajectory"
FORMAT_VERSION = 3
# Three minutes of 20 coordinates and 100 muscles in steps of 1 ms; those of the tests have 1 MB.
LARGEST = 1e9  # bytes
UNITS = {"rad", "m"}


def write_fields(file: str | Path, fields: Mapping[str, Any]) -> None:
    """Write arrays as such, and all other fields as a header.

    Raises
    ------
    OSError
        As `write_file`.
    """
    arrays = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
    rest = {name: value for name, value in fields.items() if name not in arrays}
    header = {"format": FORMAT, "version": FORMAT_VERSION, **rest}
    write_arrays(file, header=json.dumps(header), **arrays)


def read_fields(file: str | Path) -> dict[str, Any]:
    """The fields of a trajectory: arrays of floats, and the others as JSON has them.

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
    if found != (FORMAT, FORMAT_VERSION):
        raise ResultFileError(
            f"{file}: expected {FORMAT} version {FORMAT_VERSION}, found {found[0]} version "
            f"{found[1]}"
        )
    for name, array in content.items():
        if array.dtype.kind != "f":
            raise ResultFileError(f"{file}: {name} has to be numbers, it is {array.dtype}")
    for name, value in header.items():
        if name in content or not KINDS.get(name, _nothing)(value):
            raise ResultFileError(f"{file}: damaged header, {name} = {cut(repr(value))}")
    return {**{name: array.astype(float) for name, array in content.items()}, **header}


def _nothing(value: Any) -> bool:
    return False


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
    "muscle_names": _are_texts,
    "reserve_names": _are_texts,
    "saturated": lambda value: isinstance(value, list) and all(map(_are_texts, value)),
    "counts": lambda value: isinstance(value, dict) and all(map(_is_count, value.values())),
    "cpu_time": _is_time,
    "settings": lambda value: isinstance(value, dict),
    "versions": lambda value: isinstance(value, dict) and all(map(_is_text, value.values())),
}


def other_kinds(settings: Mapping[str, Any], reference: Mapping[str, Any]) -> bool:
    """Whether settings are those of something else: no name is common, or a common one has a number
    here and a truth value, text, list or mapping there. None stands for what is usual.

    Single names may have changed between versions.
    """
    common = set(settings) & set(reference)
    pairs = [(settings[name], reference[name]) for name in common]
    kinds = [tuple(float if type(x) is int else type(x) for x in pair) for pair in pairs]
    differ = any(a is not b and type(None) not in (a, b) for a, b in kinds)
    return differ or not (common or settings == reference)
