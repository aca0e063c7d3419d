"""Models and laws from the files that a user names."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from ..errors import ModelError, ParameterError
from ..files.python import imported
from ..model import MusculoskeletalModel
from ..muscle.laws import LAWS
from ..muscle.laws.law import MuscleLaw
from ..opensim.load import read_model
from ..opensim.setup import load_setup
from ..studies.source import OsimFile, PythonFile, Subject


def load_model(
    file: Path,
    motion: Path | None = None,
    cutoff: float | None = None,
    in_degrees: bool | None = None,
) -> Subject:
    """Model and motion of a Python file that defines `build()` and `motion()`, or the model of an
    `.osim` file with the motion of another file; of its parameters and what is raised see
    `studies.PythonFile` and `studies.OsimFile`."""
    if file.suffix.lower() == ".osim":
        if motion is None:
            raise ModelError(f"{file}: a model file of OpenSim needs --motion FILE.mot")
        return OsimFile(file, motion, cutoff=cutoff, in_degrees=in_degrees).load()
    if not (motion is None and cutoff is None and in_degrees is None):
        raise ModelError(f"{file}: --motion, --cutoff and --angles belong to an .osim file")
    return PythonFile(file).load()


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
    with imported(file, "law") as module:
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
