"""Progress, warnings and errors on the terminal."""

from __future__ import annotations

import argparse
import io
import logging
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from tqdm import tqdm

from ..errors import ExudynMusclesError, ExudynMusclesWarning
from .interrupts import Terminated

BAR = "{desc} {percentage:3.0f}%|{bar}| {n:.4g}/{total:.4g} {unit} [{elapsed}<{remaining}]"


def in_one_line(error: BaseException, arguments: argparse.Namespace) -> str:
    """An exception with its notes; what was computed before it is saved if a folder was named."""
    text = str(error)
    if isinstance(error, KeyboardInterrupt):
        text = "terminated" if isinstance(error, Terminated) else "interrupted"
    elif isinstance(error, OSError) and error.filename is not None:
        text = f"{error.filename}: {error.strerror}"
    elif not isinstance(error, (ExudynMusclesError, OSError)):
        text = f"{type(error).__name__}: {error}"
    parts = [text, *getattr(error, "__notes__", ())]
    trajectory, out = getattr(error, "trajectory", None), getattr(arguments, "out", None)
    if trajectory is not None and out is not None:
        file = out / f"{arguments.model.stem}_{trajectory.method}_partial.npz"
        try:
            trajectory.save(file)
            parts.append(f"the result up to then is in {file}")
        except OSError as failure:
            parts.append(f"the result up to then could not be saved: {failure}")
    return "; ".join(map(_one_line, parts))


def _one_line(text: str) -> str:
    """Without line ends, and without what would steer a terminal."""
    words = " ".join(text.split())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in words)


@contextmanager
def one_line_warnings(about: str = "") -> Iterator[None]:
    """Every different warning once, without the source line that raised it."""
    shown = set()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        text = _one_line(str(message))
        if text not in shown:
            shown.add(text)
            prefix = f"warning: {about}: " if about else "warning: "
            tqdm.write(prefix + text, file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", ExudynMusclesWarning)
        warnings.showwarning = show
        yield


class _Lines(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        tqdm.write(record.getMessage(), file=sys.stderr)


@contextmanager
def log_lines() -> Iterator[None]:
    """What the package logs is a line on stderr, above a progress bar."""
    logger, handler = logging.getLogger("exudyn_muscles"), _Lines()
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


class _Output(io.FileIO):
    """A stream of the process; what is written to a pipe that nobody reads any longer is lost."""

    def write(self, content: Any) -> int:
        try:
            return super().write(content)
        except OSError as error:
            _silence(self.fileno())  # or Python tries again at its end
            if not isinstance(error, BrokenPipeError):
                raise
            return memoryview(content).nbytes


@contextmanager
def forgiving_streams() -> Iterator[None]:
    """Neither `| head` is an error, nor are letters that a terminal does not have."""
    before = sys.stdout, sys.stderr
    sys.stdout = _forgiving(sys.stdout, sys.__stdout__)
    sys.stderr = _forgiving(sys.stderr, sys.__stderr__)
    try:
        yield
    finally:
        _flush(sys.stdout)
        _flush(sys.stderr)
        sys.stdout, sys.stderr = before


def _forgiving(stream: TextIO, own: TextIO | None) -> TextIO:
    """A stream of the process; what someone else has put in its place stays."""
    if stream is None or stream is not own:
        return stream
    _flush(stream)
    return io.TextIOWrapper(
        io.BufferedWriter(_Output(stream.fileno(), "wb", closefd=False)),
        encoding=stream.encoding,
        errors="backslashreplace",
        line_buffering=stream.isatty() or own is sys.__stderr__,
    )


def _flush(stream: TextIO | None) -> None:
    if stream is None:
        return
    try:
        stream.flush()
    except OSError:
        _silence(stream.fileno())


def _silence(descriptor: int) -> None:
    """What is written there goes nowhere from now on."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)


def progress_bar(arguments: argparse.Namespace, text: str, total: float, unit: str) -> tqdm:
    """A progress bar on stderr for what takes longer than a second."""
    hidden = arguments.quiet or not sys.stderr.isatty()
    return tqdm(
        desc=text, total=total, unit=unit, delay=1, leave=False, disable=hidden, bar_format=BAR
    )
