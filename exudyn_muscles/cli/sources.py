"""Models and laws from the files that a user names."""

from __future__ import annotations

import dataclasses
import importlib.util
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from ..errors import ModelError, ParameterError
from ..files.disk import read_file
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..motion.coordinate import Coordinate
from ..muscle.laws import LAWS
from ..muscle.laws.law import MuscleLaw
from ..opensim.load import read_model
from ..opensim.setup import load_setup

LARGEST = 10e6  # bytes of a user's Python file, in which a model is written by hand


class Source(NamedTuple):
    """A model, its motion, and all `coordinates` of the model's file of OpenSim, if it is one."""

    model: MusculoskeletalModel
    motion: Motion
    coordinates: tuple[Coordinate, ...] = ()


def load_model(
    file: Path,
    motion: Path | None = None,
    cutoff: float | None = None,
    in_degrees: bool | None = None,
) -> Source:
    """Model and motion of a Python file that defines `build()` and `motion()`, or the model of an
    `.osim` file with the motion of another file.

    Parameters
    ----------
    file : Path
        A Python file may import modules beside it.
    motion : Path, optional
        The motion's file (`.mot`, `.sto`), with an `.osim` file.
    cutoff : float, optional
        Cut-off frequency [Hz] of the motion's low-pass filter.
    in_degrees : bool, optional
        What the angles in the motion's file are, whatever it says.

    Raises
    ------
    FileNotFoundError
    ModelError
        The file cannot be imported, lacks a function, or one fails or returns something else; or a
        motion is missing or too much.
    ModelFileError, StorageError, MotionError
        An `.osim` file or its motion cannot be used.
    """
    if file.suffix.lower() == ".osim":
        if motion is None:
            raise ModelError(f"{file}: a model file of OpenSim needs --motion FILE.mot")
        model, described, _ = read_model(file)
        desired = Motion.from_file(
            motion,
            model.coordinates,
            model.skeleton.units,
            cutoff=cutoff,
            described=described,
            in_degrees=in_degrees,
        )
        return Source(model, desired, described)
    if not (motion is None and cutoff is None and in_degrees is None):
        raise ModelError(f"{file}: --motion, --cutoff and --angles belong to an .osim file")
    parts: list[Any] = []
    with _imported(file, "model") as module:
        for function, kind in (("build", MusculoskeletalModel), ("motion", Motion)):
            if not callable(getattr(module, function, None)):
                raise ModelError(f"{file}: a model file defines {function}() -> {kind.__name__}")
            with _blamed(file, f"{function}()"):
                parts.append(getattr(module, function)())
            if not isinstance(parts[-1], kind):
                raise ModelError(
                    f"{file}: {function}() has to return a {kind.__name__}, it returned "
                    f"{type(parts[-1]).__name__}"
                )
    return Source(parts[0], parts[1])


def load_skeleton(file: Path) -> MusculoskeletalModel:
    """The model alone: of a Python file, an `.osim` file, or a set-up file of OpenSim (`.xml`);
    what is raised is that of `load_model`."""
    if file.suffix.lower() == ".xml":
        return load_setup(file).model
    return read_model(file)[0] if file.suffix.lower() == ".osim" else load_model(file).model


def load_law(text: str) -> MuscleLaw:
    """A muscle law by its name, with its default numbers, or `FILE.py:NAME`.

    Parameters
    ----------
    text : str
        One of `LAWS`, or a Python file, which may import modules beside it, and a name in it.

    Raises
    ------
    FileNotFoundError
    ParameterError
        There is no law of that name.
    ModelError
        The file cannot be imported, or what it calls by that name is not a law.
    """
    path, colon, name = text.rpartition(":")
    if not colon:
        if text not in LAWS:
            raise ParameterError(f"--law {text}: expected {', '.join(LAWS)} or FILE.py:NAME")
        return LAWS[text]()
    file = Path(path)
    with _imported(file, "law") as module:
        law = getattr(module, name, None)
    if not isinstance(law, MuscleLaw):
        raise ModelError(f"{file}: {name} has to be a MuscleLaw, it is {law!r}")
    return law


def damped(law: MuscleLaw, fiber_damping: float) -> MuscleLaw:
    """The law with another damper."""
    try:
        return dataclasses.replace(law, fiber_damping=fiber_damping)  # type: ignore[type-var]
    except TypeError:
        raise ParameterError(
            f"--fiber-damping {fiber_damping:g}: {type(law).__name__} has no damper"
        ) from None


@contextmanager
def _imported(file: Path, noun: str) -> Iterator[ModuleType]:
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
        with _blamed(file, "importing it"):
            spec.loader.exec_module(module)
        yield module
    finally:
        sys.path.remove(str(file.resolve().parent))


@contextmanager
def _blamed(file: Path, where: str) -> Iterator[None]:
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
