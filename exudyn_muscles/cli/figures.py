"""Figures, drawn side by side where there are several processors."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

from ..files.disk import write_figure


class Figure(NamedTuple):
    """What `draw` makes of what is `shown`, for a file."""

    draw: Callable
    shown: Sequence[Any]
    file: Path


def draw_figures(figures: Sequence[Figure]) -> None:
    """Draw them all and say so.

    Raises
    ------
    OSError
        A file cannot be written; names it.
    """
    import matplotlib

    matplotlib.use("Agg")  # no window, whatever the user's settings say
    import matplotlib.pyplot  # once, before processes begin

    shares = [figures[k :: _processors()] for k in range(min(_processors(), len(figures)))]
    context = get_context("fork") if len(shares) > 1 else None
    others = [
        context.Process(target=_draw_beside, args=(share,), daemon=True)
        for share in shares[1:]
        if context is not None
    ]
    try:
        for other in others:
            other.start()
        _draw(shares[0])
        for other, share in zip(others, shares[1:], strict=True):
            other.join()
            if other.exitcode != 0:
                _draw(share)  # whatever went wrong there is told here
    finally:
        for other in others:
            if other.is_alive():
                other.terminate()
    for figure in figures:
        print(f"wrote {figure.file}")


def _draw(figures: Sequence[Figure]) -> None:
    import matplotlib.pyplot as plt

    for draw, shown, file in figures:
        drawn = draw(*shown)
        figure = drawn if hasattr(drawn, "savefig") else drawn[0].get_figure(root=True)
        write_figure(figure, file, dpi=200)
        plt.close(figure)


def _draw_beside(figures: Sequence[Figure]) -> None:
    """In a process of its own, which leaves it to the one that began it to speak of errors and to
    be interrupted."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        _draw(figures)
    except Exception:
        sys.exit(1)


def _processors() -> int:
    """Processes that are worth while: only Linux has those that begin where this one is."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1
