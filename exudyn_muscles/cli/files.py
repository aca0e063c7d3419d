"""Results on disk, and their figures."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

from .. import plot
from ..results.trajectory import Trajectory
from .figures import Figure, draw_figures
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
    draw_figures(
        [
            Figure(function, (trajectory,), path.with_name(f"{path.name}_{function.__name__}.png"))
            for function in draw
        ]
    )
