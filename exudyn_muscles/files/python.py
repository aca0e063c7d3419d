"""Python files that users name, and what fails in them."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from ..errors import ModelError
from .disk import read_file

LARGEST = 10e6  # bytes of a user's Python file, in which a model is written by hand


@contextmanager
def imported(file: Path, noun: str) -> Iterator[ModuleType]:
    """The module of a user's file, which can import those beside it."""
    read_file(file, LARGEST, ModelError)
    name = f"_exudyn_muscles_{noun}_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ModelError(f"{file}: a {noun} file is a Python file, ending in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickle look it up there
    sys.path.insert(0, str(file.resolve().parent))
    try:
        with blamed(file, "importing it"):
            spec.loader.exec_module(module)
        yield module
    finally:
        sys.path.remove(str(file.resolve().parent))


@contextmanager
def blamed(file: Path, where: str) -> Iterator[None]:
    """Whatever fails within becomes a ModelError that names the file and its line."""
    try:
        yield
    except (Exception, SystemExit) as error:
        lines = [
            frame.lineno
            for frame in traceback.extract_tb(error.__traceback__)
            if Path(frame.filename) == file.absolute()
        ]
        line = f", line {lines[-1]}" if lines else ""
        raise ModelError(
            f"{file}{line}: {where} failed: {type(error).__name__}: {error}"
        ) from error
