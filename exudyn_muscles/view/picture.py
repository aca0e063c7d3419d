"""Pictures of a model in files; they need no display."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import exudyn as exu
import numpy as np
from numpy.typing import ArrayLike

from ..errors import DisplayError, ParameterError
from ..files.disk import write_figure
from ..model import MusculoskeletalModel
from ..results.trajectory import Trajectory
from .camera import FRONT, WINDOW_OPEN, aimed
from .colors import ACTIVE, RELAXED
from .layer import drawn
from .scene import Scene, check_belongs

LIGHT = [-1.0, 2.0, 3.0, 0.0]  # from where, seen from the camera, whatever it looks along
TRANSPARENT = 8  # surfaces that one looks through: two legs and a trunk, in front and behind


def render(
    model: MusculoskeletalModel,
    trajectory: Trajectory,
    time: float,
    file: str | Path,
    *,
    size: tuple[int, int] = (800, 600),
    directions: ArrayLike = FRONT,
    sticks: bool = True,
) -> None:
    """Write a picture of the model at one time of a trajectory; needs no display.

    All pictures of one trajectory have the same camera, fitted to its whole motion. Not to be
    called while the `mbs` is running.

    Parameters
    ----------
    model : MusculoskeletalModel
    trajectory : Trajectory
    time : float
        Between the first and the last time of the trajectory [s]. Bodies of a system that is no
        tree are where they were at the nearest point of time.
    file : str or Path
        The extension decides the format, `.png` for example.
    size : (int, int), optional
        Width and height [pixels].
    directions : (3, 3) array_like, optional
        Global directions that point to the right, upwards and to the viewer, one a row; x, y, z if
        left out.
    sticks : bool, optional
        Draw bones, made of joints and masses, in place of the graphics that the tree was created
        with; in other systems of bodies without graphics of their own, whose joints are hidden.

    Raises
    ------
    DisplayError
        Exudyn's render window is open, whose view would be lost.
    ParameterError
        The time lies outside the trajectory, size or directions are not what they should be, or
        the trajectory is empty or not one of this model.
    """
    check_belongs(model, trajectory)
    start, end = trajectory.time[0], trajectory.time[-1]
    if not start - 1e-9 <= time <= end + 1e-9:
        raise ParameterError(
            f"time = {time:g} s is outside the trajectory, {start:g} s to {end:g} s"
        )
    width, height = size
    if not (width == int(width) >= 1 and height == int(height) >= 1):
        raise ParameterError(f"size = {size!r} is not a width and a height in pixels")
    axes = np.asarray(directions, dtype=float)
    if axes.shape != (3, 3) or not np.allclose(axes @ axes.T, np.eye(3), atol=1e-6):
        raise ParameterError("directions: expected three perpendicular unit vectors, one a row")
    scene = Scene(model, trajectory, sticks)
    container = model.mbs.GetSystemContainer()
    if container.renderer.IsActive():
        raise DisplayError(WINDOW_OPEN)
    with (
        drawn(scene, container),
        aimed(container, scene, trajectory, (int(width), int(height)), axes),
        _posed(model, trajectory, time),
    ):
        _show_bodies_alone(container.visualizationSettings)
        image = container.renderer.RedrawAndGetImage(useRaytracer=True)
    _write(image, time, file)


@contextmanager
def _posed(model: MusculoskeletalModel, trajectory: Trajectory, time: float) -> Iterator[None]:
    """Put the current state, which Exudyn draws without a window, to a time of a trajectory."""
    data, skeleton = model.mbs.systemData, model.skeleton
    before, time_before = np.array(data.GetODE2Coordinates()), data.GetTime()
    if trajectory.system_names:  # between two poses the constraints would not be met
        posed = trajectory.system_coordinates[np.abs(trajectory.time - time).argmin()]
    else:
        posed = before.copy()
        now = np.array([np.interp(time, trajectory.time, q) for q in trajectory.coordinates.T])
        (posed[skeleton.rows],) = model.state_of_tree(now)
    try:
        data.SetODE2Coordinates(posed)
        data.SetTime(time)
        yield
    finally:
        data.SetODE2Coordinates(before)
        data.SetTime(time_before)


def _show_bodies_alone(settings: exu.VisualizationSettings) -> None:
    """Smooth edges, light from the camera's side, and neither texts nor symbols."""
    settings.raytracer.multiSampling = 3
    settings.raytracer.advanced.backgroundColorReflections = [1.0] * 4  # seen through limbs
    settings.raytracer.maxTransparencyDepth = TRANSPARENT
    settings.openGL.light0.useCameraFrame = True
    settings.openGL.light0.position = LIGHT
    settings.openGL.light0.diffuse = 0.65
    parts = settings.view0.scene
    settings.view0.window.showComputationInfo = False
    parts.drawCoordinateSystem = False
    parts.drawWorldBasis = False
    settings.bodies.kinematicTree.showCOMframes = False
    settings.bodies.kinematicTree.showJointFrames = False
    for items in (settings.nodes, settings.markers, settings.loads, settings.sensors):
        items.show = False


def _write(image: np.ndarray, time: float, file: str | Path) -> None:
    """Write an image (height, width, 3) with the time and a legend of the colors."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    height, width = image.shape[:2]
    dpi = 100
    # Without the half pixel, rounding may cut one off.
    figure = Figure(figsize=((width + 0.5) / dpi, (height + 0.5) / dpi), dpi=dpi)
    figure.figimage(image, zorder=-1)
    font = max(7.0, 0.025 * min(width, height) * 72 / dpi)
    figure.text(0.03, 0.96, f"t = {time:.3f} s", va="top", fontsize=1.2 * font)
    axes = figure.add_axes((0.90, 0.28, 0.022, 0.44))
    colors = LinearSegmentedColormap.from_list("activation", [RELAXED, ACTIVE])
    bar = figure.colorbar(ScalarMappable(cmap=colors), cax=axes)
    bar.ax.tick_params(labelsize=font)
    bar.set_ticks([0.0, 0.5, 1.0])
    bar.ax.set_title("activation", fontsize=font, pad=0.8 * font)
    write_figure(figure, file, dpi)
