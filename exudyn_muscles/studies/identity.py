"""What tells one study from another: a digest of content, the same in every process."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from hashlib import sha256
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

XML = (".xml", ".osim")


def digest(value: Any) -> str:
    """Of numbers, texts, arrays, mappings, sequences, functions; objects by their attributes."""
    return sha256("\n".join(_parts(value, ())).encode()).hexdigest()


def file_digest(file: Path) -> str:
    """Of a file, and of all files that it names if it is XML, as set-ups do."""
    return sha256(b"".join(_contents(file, set()))).hexdigest()


def _contents(file: Path, seen: set[Path]) -> Iterator[bytes]:
    if file.resolve() in seen:
        return
    seen.add(file.resolve())
    content = file.read_bytes()
    yield content
    if file.suffix.lower() not in XML:
        return
    try:
        named = [(each.text or "").strip() for each in ElementTree.fromstring(content).iter()]
    except ElementTree.ParseError:
        return  # which is told where it is loaded
    for name in named:
        inner = file.parent / name.replace("\\", "/")
        if 0 < len(name) < 256 and "\n" not in name and inner.is_file():
            yield from _contents(inner, seen)


def _parts(value: Any, within: tuple[int, ...]) -> Iterator[str]:
    if id(value) in within:
        yield "again"
        return
    within = (*within, id(value))
    yield type(value).__qualname__
    if isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape}"
        if value.dtype == object:
            yield from _parts(value.tolist(), within)
        else:
            yield sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
    elif isinstance(value, Mapping):
        for key in sorted(value, key=repr):
            yield repr(key)
            yield from _parts(value[key], within)
    elif isinstance(value, (list, tuple)):
        yield str(len(value))
        for item in value:
            yield from _parts(item, within)
    elif isinstance(value, Enum):
        yield value.name
    elif is_dataclass(value) and not isinstance(value, type):
        for item in fields(value):
            yield item.name
            yield from _parts(getattr(value, item.name), within)
    elif callable(value) and hasattr(value, "__qualname__"):
        yield from _of_function(value)
    elif type(value).__module__.startswith("exudyn.") or not hasattr(value, "__dict__"):
        yield repr(value)
    else:
        yield from _parts(vars(value), within)


def _of_function(function: Callable) -> Iterator[str]:
    """By its source, or its name where there is none."""
    yield function.__qualname__
    try:
        yield inspect.getsource(function)
    except (OSError, TypeError):
        yield function.__module__
