"""Muscles in Exudyn's own renderer and solution viewer."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..errors import DisplayError
from ..model import MusculoskeletalModel
from ..results.trajectory import Trajectory
from .camera import FRONT, WINDOW_OPEN, aimed
from .layer import drawn
from .scene import Scene, check_belongs, poses

FRAME_PERIOD = 0.04  # s


@contextmanager
def show_muscles(
    model: MusculoskeletalModel, trajectory: Trajectory | None = None, *, sticks: bool = True
) -> Iterator[None]:
    """Let Exudyn draw the muscles together with the model's `mbs`, within a `with` block.

    Everything that renders the container of the `mbs` then shows them at the pose and time of the
    visualization state: `SC.renderer` during a run, `mbs.SolutionViewer(...)`,
    `SC.renderer.RedrawAndGetImage(...)`. The state, the size and the results of the `mbs` are not
    touched. An empty system stays in the container and serves the next call.

    Parameters
    ----------
    model : MusculoskeletalModel
    trajectory : Trajectory, optional
        Gives the activations; without one the muscles have a neutral color.
    sticks : bool, optional
        As of `render`.

    Raises
    ------
    ParameterError
        The trajectory is empty or not one of this model.

    Examples
    --------
    In a script with a display::

        with em.view.show_muscles(model, csf):
            mbs.SolutionViewer(em.view.solution(csf, model))
    """
    if trajectory is not None:
        check_belongs(model, trajectory)
    with drawn(Scene(model, trajectory, sticks), model.mbs.GetSystemContainer()):
        yield


def solution(trajectory: Trajectory, model: MusculoskeletalModel) -> dict[str, Any]:
    """The motion as Exudyn's `LoadSolutionFile` returns it, for `mbs.SolutionViewer`.

    Coordinates of the `mbs` outside a tree stay at their initial values. Speeds and accelerations
    of a system that is no tree are not recorded; they are zero.

    Parameters
    ----------
    trajectory : Trajectory
    model : MusculoskeletalModel
        The model that the trajectory belongs to.

    Returns
    -------
    dict
        `data` (T, 1 + 3 n) with time, coordinates, speeds and accelerations of the whole system,
        and `columnsExported`, `nColumns`, `nRows`.

    Raises
    ------
    ParameterError
        The trajectory is empty or not one of this model.
    """
    check_belongs(model, trajectory)
    initial, _ = model.skeleton.initial_arrays()
    n, rows = len(initial), model.skeleton.rows
    data = np.zeros((len(trajectory.time), 1 + 3 * n))
    data[:, 0] = trajectory.time
    q, v, a = (data[:, 1 + k * n : 1 + (k + 1) * n] for k in range(3))
    q[:] = poses(model, trajectory, initial)
    if not trajectory.system_names:
        _, v[:, rows], a[:, rows] = model.state_of_tree(
            trajectory.coordinates, trajectory.speeds, trajectory.accelerations
        )
    return {
        "data": data,
        "columnsExported": [n, n, n, 0, 0, 0, 0],
        "nColumns": 3 * n,
        "nRows": len(data),
    }


def view(model: MusculoskeletalModel, trajectory: Trajectory, *, sticks: bool = True) -> None:
    """Play a trajectory in Exudyn's SolutionViewer, in real time, until its window is closed.

    Parameters
    ----------
    model : MusculoskeletalModel
    trajectory : Trajectory
    sticks : bool, optional
        As of `render`.

    Raises
    ------
    DisplayError
        There is no display (`render` needs none), or Exudyn's render window is already open.
    ParameterError
        The trajectory is empty or not one of this model.
    """
    played = solution(trajectory, model)
    _need_display()
    scene, container = Scene(model, trajectory, sticks), model.mbs.GetSystemContainer()
    if container.renderer.IsActive():
        raise DisplayError(WINDOW_OPEN)
    size = tuple(container.visualizationSettings.view0.window.renderWindowSize)
    span = trajectory.time[-1] - trajectory.time[0]
    rows = round(FRAME_PERIOD / span * played["nRows"]) if span > 0.0 else 1
    with drawn(scene, container), aimed(container, scene, trajectory, size, FRONT):
        model.mbs.SolutionViewer(
            played,
            rowIncrement=min(max(rows, 1), played["nRows"]),
            timeout=FRAME_PERIOD,
            runMode=0,
        )


def _need_display() -> None:
    """Raise DisplayError without a display, where Exudyn would end the process."""
    try:
        import tkinter
    except ImportError as error:
        raise DisplayError("the viewer needs tkinter, which this Python lacks") from error
    if sys.platform != "linux":
        return
    try:
        tkinter.Tk().destroy()
    except tkinter.TclError as error:
        raise DisplayError(
            f"no window can be opened ({error}); render() writes pictures without a display"
        ) from error
