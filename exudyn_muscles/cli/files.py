"""Results and figures on disk."""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from .. import plot
from ..files.disk import write_figure
from ..results.trajectory import Trajectory
from .interrupts import uninterrupted


def made_folder(path: Path) -> Path:
    """Make a folder before the work begins, not after."""
    path.mkdir(parents=True, exist_ok=True)
    return path


def result_file(path: Path) -> Path:
    """Where a result is whose files' names begin with `path`."""
    return path.with_name(f"{path.name}.npz")


def save(trajectory: Trajectory, file: Path) -> None:
    """Save a result; an interrupt waits until that is done."""
    with uninterrupted() as waiting:
        trajectory.save(file)
    if waiting:
        signal.raise_signal(waiting[0])


def draw_all(trajectory: Trajectory, path: Path) -> None:
    """The figures of a result whose files' names begin with `path`."""
    draw: list[Callable] = [plot.forces, plot.activations, plot.excitations]
    if trajectory.method != "static":
        draw.append(plot.tracking_errors)
    for function in draw:
        file = path.with_name(f"{path.name}_{function.__name__}.png")
        save_figure(function, (trajectory,), file)


def save_figure(draw: Callable, shown: Sequence[Any], file: Path) -> None:
    """Draw what is shown to a file."""
    import matplotlib

    matplotlib.use("Agg")  # no window, whatever the user's settings say
    import matplotlib.pyplot as plt

    drawn = draw(*shown)
    figure = drawn if hasattr(drawn, "savefig") else drawn[0].get_figure(root=True)
    write_figure(figure, file, dpi=200)
    plt.close(figure)
    print(f"wrote {file}")
