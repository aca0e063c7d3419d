"""Studies in files (TOML), and of all set-ups in a folder."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ExudynMusclesError, StudyError
from ..files.disk import read_file
from .method import Method
from .samples import (
    Ranges,
    Samples,
    latin_hypercube,
    morris_design,
    sobol_design,
    sobol_sequence,
)
from .source import OsimFile, PythonFile, SetupFile, Source
from .study import USUAL, Study

LARGEST = 1e6  # bytes of a study file, which a person writes
LARGEST_TABLE = 1e9  # of its samples
DESIGNS: dict[str, Callable[[Ranges, int, int], Samples]] = {
    "latin_hypercube": latin_hypercube,
    "sobol_sequence": sobol_sequence,
    "morris": morris_design,
    "sobol": sobol_design,
}
SETUPS = ("CMCTool", "AnalyzeTool")
# Sections and their keys; those of outcomes are names of the user's own.
SECTIONS: dict[str, tuple[str, ...] | None] = {
    "source": ("model", "motion", "cutoff", "angles", "arguments", "folder", "pattern", "files"),
    "method": ("name", "settings"),
    "samples": ("design", "count", "file", "seed", "parameters"),
    "outcomes": None,
    "run": ("seed", "trajectories"),
}


def load_study(path: Path) -> Study:
    """The study of a TOML file, whose other files are looked for from its folder; or of all set-up
    files in a folder and below it, as they are.

    Raises
    ------
    StudyError
        It cannot be read, or says what there is not: names the file, its line and key.
    FileNotFoundError
    """
    if path.is_dir():
        return Study(setups_in(path))
    text = read_file(path, LARGEST, StudyError).decode(errors="replace")
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{path}: {error}") from None
    return _File(path, text, content).study()


def setups_in(
    folder: Path, pattern: str = "**/*.xml", in_degrees: bool | None = None
) -> tuple[SetupFile, ...]:
    """All set-up files of OpenSim's CMC and static optimization in a folder, by their names;
    `in_degrees` is what the angles of their motions are, whatever these say.

    Raises
    ------
    StudyError
        There is none.
    """
    files = [file for file in sorted(folder.glob(pattern)) if file.is_file() and _is_setup(file)]
    if not files:
        raise StudyError(f"{folder}: there is no set-up of CMC or static optimization ({pattern})")
    return tuple(SetupFile(file, in_degrees) for file in files)


def _is_setup(file: Path) -> bool:
    with open(file, "rb") as stream:
        head = stream.read(10_000).decode(errors="replace")
    return any(f"<{tag}" in head for tag in SETUPS)


class _File:
    """What a study file says, with its lines for messages."""

    def __init__(self, path: Path, text: str, content: Mapping[str, Any]) -> None:
        self._path, self._lines, self._content = path, text.splitlines(), content

    def study(self) -> Study:
        """The whole of it."""
        for section, given in self._content.items():
            if section not in SECTIONS or not isinstance(given, dict):
                raise self._error(section, f"expected [{'], ['.join(SECTIONS)}]")
            known = SECTIONS[section]
            for key in given:
                if known is not None and key not in known:
                    raise self._error(key, f"[{section}] has {', '.join(known)}", section)
        if "source" not in self._content:
            raise StudyError(f"{self._path}: a study has a [source]")
        source = self._source()
        with self._blamed("samples"):
            samples = self._samples()
        with self._blamed("method"):
            method = Method(
                self._get("method", "name", str), self._get("method", "settings", dict, {})
            )
        outcomes = self._content.get("outcomes") or dict(zip(USUAL, USUAL, strict=True))
        for name, what in outcomes.items():
            if not isinstance(what, str):
                raise self._error(name, f"a text was expected, got {what!r}", "outcomes")
        with self._blamed("outcomes" if "outcomes" in self._content else "source"):
            return Study(
                source,
                samples,
                method,
                outcomes,
                seed=self._get("run", "seed", int, 0),
                trajectories=self._get("run", "trajectories", bool, False),
            )

    def _source(self) -> Source | tuple[Source, ...]:
        given = [key for key in ("model", "folder", "files") if key in self._content["source"]]
        if len(given) != 1:
            raise self._error("source", "one of model, folder and files was expected")
        angles = self._get("source", "angles", str)
        if angles not in (None, "degrees", "radians"):
            raise self._error("angles", f"degrees or radians was expected, got '{angles}'")
        in_degrees = None if angles is None else angles == "degrees"
        if given == ["folder"]:
            pattern = self._get("source", "pattern", str, "**/*.xml")
            with self._blamed("source", "folder"):
                return setups_in(self._file("source", "folder"), pattern, in_degrees)
        if given == ["files"]:
            names = self._get("source", "files", list)
            return tuple(SetupFile(self._path.parent / str(name), in_degrees) for name in names)
        file = self._file("source", "model")
        if not file.is_file():
            raise self._error("model", f"there is no file '{file}'", "source")
        if file.suffix.lower() == ".xml":
            return SetupFile(file, in_degrees)
        if file.suffix.lower() != ".osim":
            return PythonFile(file, self._get("source", "arguments", dict, {}))
        if "motion" not in self._content["source"]:
            raise self._error("model", "a model file of OpenSim needs motion = FILE", "source")
        cutoff = self._get("source", "cutoff", (int, float))
        return OsimFile(file, self._file("source", "motion"), cutoff, in_degrees)

    def _samples(self) -> Samples:
        section = self._content.get("samples")
        if section is None:
            return Samples.single()
        if "file" in section:
            return _read_table(self._file("samples", "file"))
        design, ranges = self._get("samples", "design", str), section.get("parameters")
        if design not in DESIGNS:
            raise self._error("design", f"expected {', '.join(DESIGNS)}", "samples")
        if not isinstance(ranges, dict) or not ranges:
            raise self._error("samples", "[samples.parameters] has NAME = [LOWEST, HIGHEST]")
        for name, pair in ranges.items():
            numbers = isinstance(pair, list) and all(isinstance(x, (int, float)) for x in pair)
            if not numbers or len(pair) != 2:
                raise self._error(name, f"[LOWEST, HIGHEST] was expected, got {pair!r}", "samples")
            with self._blamed("samples", name):
                Samples((name,), np.empty((0, 1)))
        pairs = {name: (float(low), float(high)) for name, (low, high) in ranges.items()}
        count = self._get("samples", "count", int)
        if count is None or count < 1:
            raise self._error("count", f"a positive number was expected, got {count}", "samples")
        return DESIGNS[design](pairs, count, self._get("samples", "seed", int, 0))

    def _get(self, section: str, key: str, kind: Any, usual: Any = None) -> Any:
        value = self._content.get(section, {}).get(key, usual)
        wrong = not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool)
        if value is not usual and wrong:
            raise self._error(key, f"{value!r} is of another kind than it has to be", section)
        return value

    def _file(self, section: str, key: str) -> Path:
        return self._path.parent / self._get(section, key, str)

    @contextmanager
    def _blamed(self, section: str, key: str | None = None) -> Iterator[None]:
        """What is wrong within names the file and its line."""
        try:
            yield
        except ExudynMusclesError as error:
            if str(error).startswith(str(self._path)):
                raise
            named = re.findall(r"'([^']+)'", str(error))
            lines = (self._line(each, section) for each in [key, *named, section])
            line = next(filter(None, lines), None)
            raise StudyError(f"{self._where(line)}: {error}") from error

    def _error(self, key: str, text: str, section: str | None = None) -> StudyError:
        line = self._line(key, section) or self._line(section)
        return StudyError(f"{self._where(line)}: {key}: {text}")

    def _where(self, line: int | None) -> str:
        return f"{self._path}, line {line}" if line else str(self._path)

    def _line(self, key: str | None, section: str | None = None) -> int | None:
        """Of a key in a section, or of a section; of a value if there is no such key."""
        if key is None:
            return None
        quoted, begin = re.escape(key), (self._line(section) or 1) if key != section else 1
        for form in (rf'^\s*"?{quoted}"?\s*=', rf"^\s*\[{quoted}\b", quoted):
            for number, line in enumerate(self._lines[begin - 1 :], begin):
                if re.search(form, line):
                    return number
        return None


def _read_table(file: Path) -> Samples:
    """Samples of a `.csv` or `.parquet` file, whose columns are parameters."""
    import pandas

    read_file(file, LARGEST_TABLE, StudyError)
    try:
        read = pandas.read_parquet if file.suffix == ".parquet" else pandas.read_csv
        return Samples.from_dataframe(read(file))
    except StudyError as error:
        raise StudyError(f"{file}: {error}") from None
    except Exception as error:  # of whatever reads it
        raise StudyError(f"{file}: this is no table of samples ({error})") from error
