"""Where a model and its motion come from: small values that can be sent to other processes, where
they build the model anew."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from ..errors import ModelError, StudyError
from ..files.python import blamed, imported
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..motion.coordinate import Coordinate
from ..opensim.cmc_setup import CMCSetup
from ..opensim.load import read_model
from ..opensim.setup import load_setup
from ..opensim.static_setup import StaticSetup
from .identity import digest, file_digest


class Subject(NamedTuple):
    """What a source gives.

    Attributes
    ----------
    model : MusculoskeletalModel
    motion : Motion
    coordinates : tuple of opensim.Coordinate
        All of a model's file of OpenSim.
    setup : CMCSetup or StaticSetup, optional
        The set-up file that they are from.
    """

    model: MusculoskeletalModel
    motion: Motion
    coordinates: tuple[Coordinate, ...] = ()
    setup: CMCSetup | StaticSetup | None = None


class Source(Protocol):
    """What builds a model; it can be pickled."""

    @property
    def name(self) -> str:
        """For tables and messages."""

    @property
    def identity(self) -> str:
        """A digest of all that it builds from."""

    def load(self) -> Subject:
        """The model, built anew at every call.

        Returns
        -------
        Subject
        """

    def given(self, arguments: Mapping[str, Any]) -> Source:
        """The same with other arguments of its functions.

        Parameters
        ----------
        arguments : mapping

        Returns
        -------
        Source

        Raises
        ------
        StudyError
            It takes none.
        """


@dataclass(frozen=True)
class Builder:
    """Functions that build a model and its motion.

    Parameters
    ----------
    function : callable or str
        Of the `arguments`, -> MusculoskeletalModel, or -> (MusculoskeletalModel, Motion). A text
        `package.module:function` is imported where it is needed.
    motion : Motion, callable, str, optional
        The motion, or what builds it, without arguments; if left out `function` gives both.
    arguments : mapping
        Of `function`.

    Raises
    ------
    StudyError
        Neither a function nor the name of one.
    """

    function: Callable[..., Any] | str
    motion: Motion | Callable[[], Motion] | str | None = None
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for each in (self.function, self.motion):
            if isinstance(each, str) and each.count(":") != 1:
                raise StudyError(f"'{each}' is no 'module:function'")
        if not callable(self.function) and not isinstance(self.function, str):
            raise StudyError(f"a function that builds a model was expected, got {self.function!r}")

    @property
    def name(self) -> str:
        """Of the function."""
        function = self.function
        return function if isinstance(function, str) else getattr(function, "__qualname__", "model")

    @property
    def identity(self) -> str:
        """By the source of its functions."""
        functions = [found(each) for each in (self.function, self.motion)]
        return digest([*functions, self.arguments])

    def load(self) -> Subject:
        """Call the functions.

        Returns
        -------
        Subject

        Raises
        ------
        ModelError
            They give something else.
        """
        built, motion = found(self.function)(**self.arguments), found(self.motion)
        model, motion = built if motion is None and isinstance(built, tuple) else (built, motion)
        motion = motion() if callable(motion) and not isinstance(motion, Motion) else motion
        for each, kind in ((model, MusculoskeletalModel), (motion, Motion)):
            if not isinstance(each, kind):
                raise ModelError(
                    f"{self.name} has to give a {kind.__name__}, it gave {type(each).__name__}"
                )
        return Subject(model, motion)

    def given(self, arguments: Mapping[str, Any]) -> Builder:
        """A `Builder` with other arguments.

        Parameters
        ----------
        arguments : mapping
        """
        return replace(self, arguments={**self.arguments, **arguments})


@dataclass(frozen=True)
class PythonFile:
    """A Python file with `build()` -> MusculoskeletalModel and `motion()` -> Motion; it may import
    modules beside it.

    Parameters
    ----------
    file : str or Path
    arguments : mapping
        Of `build`.
    """

    file: Path
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "file", Path(self.file))

    @property
    def name(self) -> str:
        """Of the file."""
        return self.file.stem

    @property
    def identity(self) -> str:
        """By the file, not by what it imports."""
        return digest([file_digest(self.file), self.arguments])

    def load(self) -> Subject:
        """Import the file and call its functions.

        Returns
        -------
        Subject

        Raises
        ------
        FileNotFoundError
        ModelError
            The file cannot be imported, lacks a function, or one fails or returns something else.
        """
        parts: list[Any] = []
        with imported(self.file, "model") as module:
            for function, kind in (("build", MusculoskeletalModel), ("motion", Motion)):
                if not callable(getattr(module, function, None)):
                    raise ModelError(
                        f"{self.file}: a model file defines {function}() -> {kind.__name__}"
                    )
                arguments = self.arguments if function == "build" else {}
                with blamed(self.file, f"{function}()"):
                    parts.append(getattr(module, function)(**arguments))
                if not isinstance(parts[-1], kind):
                    raise ModelError(
                        f"{self.file}: {function}() has to return a {kind.__name__}, it returned "
                        f"{type(parts[-1]).__name__}"
                    )
        return Subject(parts[0], parts[1])

    def given(self, arguments: Mapping[str, Any]) -> PythonFile:
        """A `PythonFile` with other arguments of `build`.

        Parameters
        ----------
        arguments : mapping
        """
        return replace(self, arguments={**self.arguments, **arguments})


class _WithoutArguments:
    """A file that is as it is."""

    name: str

    def given(self, arguments: Mapping[str, Any]) -> Any:
        """Itself; StudyError if there are arguments."""
        if arguments:
            raise StudyError(f"{self.name} is a file of OpenSim and has no {', '.join(arguments)}")
        return self


@dataclass(frozen=True)
class OsimFile(_WithoutArguments):
    """A model file of OpenSim and a motion file with all its coordinates.

    Parameters
    ----------
    file : str or Path
        The model (`.osim`).
    motion : str or Path
        The motion (`.mot`, `.sto`).
    cutoff : float, optional
        Of the low-pass filter [Hz]; not filtered if left out.
    in_degrees : bool, optional
        What the motion's angles are, whatever its file says.
    """

    file: Path
    motion: Path
    cutoff: float | None = None
    in_degrees: bool | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "file", Path(self.file))
        object.__setattr__(self, "motion", Path(self.motion))

    @property
    def name(self) -> str:  # type: ignore[override]
        """Of the model's file."""
        return self.file.stem

    @property
    def identity(self) -> str:
        """By both files."""
        return digest([*map(file_digest, (self.file, self.motion)), self.cutoff, self.in_degrees])

    def load(self) -> Subject:
        """The `Subject` in both files.

        Raises
        ------
        ModelFileError, StorageError, MotionError
            That cannot be done.
        """
        model, described, _ = read_model(self.file)
        motion = Motion.from_file(
            self.motion,
            model.coordinates,
            model.skeleton.units,
            cutoff=self.cutoff,
            described=described,
            in_degrees=self.in_degrees,
        )
        return Subject(model, motion, described)


@dataclass(frozen=True)
class SetupFile(_WithoutArguments):
    """A set-up file of OpenSim's CMC or static optimization, with all that it names.

    Parameters
    ----------
    file : str or Path
    in_degrees : bool, optional
        What the motion's angles are, whatever its file says.
    """

    file: Path
    in_degrees: bool | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "file", Path(self.file))

    @property
    def name(self) -> str:  # type: ignore[override]
        """Of the file and its folder."""
        return f"{self.file.parent.name}/{self.file.stem}"

    @property
    def identity(self) -> str:
        """By all files that it names."""
        return digest([file_digest(self.file), self.in_degrees])

    def load(self) -> Subject:
        """The `Subject` of the file.

        Raises
        ------
        ModelFileError, StorageError, MotionError
            As `load_setup`.
        """
        setup = load_setup(self.file, in_degrees=self.in_degrees)
        return Subject(setup.model, setup.motion, setup.coordinates, setup)


def found(function: Any) -> Any:
    """What `module:function` names; all else as it is.

    Raises
    ------
    StudyError
        It cannot be imported.
    """
    if not isinstance(function, str):
        return function
    module, _, name = function.partition(":")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise StudyError(f"'{function}' cannot be imported: {error}") from error
