"""Progress, warnings and errors on the terminal."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tqdm import tqdm

BAR = "{desc} {percentage:3.0f}%|{bar}| {n:.4g}/{total:.4g} {unit} [{elapsed}<{remaining}]"


def in_one_line(error: BaseException, arguments: argparse.Namespace) -> str:
    """An exception with its notes; what was computed before it is saved if a folder was named."""
    from ..errors import ExudynMusclesError

    text = str(error)
    if isinstance(error, KeyboardInterrupt):
        text = "interrupted"
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
    return "; ".join(" ".join(part.split()) for part in parts)


@contextmanager
def one_line_warnings(about: str = "") -> Iterator[None]:
    """Every different warning once, without the source line that raised it."""
    from tqdm import tqdm

    shown = set()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        text = " ".join(str(message).split())
        if text not in shown:
            shown.add(text)
            prefix = f"warning: {about}: " if about else "warning: "
            tqdm.write(prefix + text, file=sys.stderr)

    from ..errors import ExudynMusclesWarning

    with warnings.catch_warnings():
        warnings.simplefilter("always", ExudynMusclesWarning)
        warnings.showwarning = show
        yield


def progress_bar(arguments: argparse.Namespace, text: str, total: float, unit: str) -> tqdm:
    """A progress bar on stderr for what takes longer than a second."""
    from tqdm import tqdm

    hidden = arguments.quiet or not sys.stderr.isatty()
    return tqdm(
        desc=text, total=total, unit=unit, delay=1, leave=False, disable=hidden, bar_format=BAR
    )
