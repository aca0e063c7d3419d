"""The skeleton with its muscles, colored by activation, in Exudyn's renderer or as a PNG.

The muscles are drawn by a second, empty system in the container of the user's `mbs`: Exudyn renders
all systems of a container together, and the user's own one is neither extended nor assembled anew.
Sticks from joint to joint take the place of the tree's own graphics, unless `sticks=False`: Exudyn
does not tell graphics that the user made from the blocks that it makes itself.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import exudyn as exu
import numpy as np
from exudyn import graphics
from exudyn.utilities import ObjectGround, VObjectGround
from numpy.typing import ArrayLike

from ..errors import DisplayError, ParameterError
from ..files.disk import write_figure
from ..model import MusculoskeletalModel
from ..path.paths import Paths
from ..path.surfaces import CYLINDER
from ..results.trajectory import Trajectory
from ..skeleton.geometry import path_points, surfaces_at
from ..skeleton.skeleton import Skeleton

RELAXED = (0.13, 0.30, 0.90)  # RGB at a = 0
ACTIVE = (0.90, 0.10, 0.10)  # RGB at a = 1
UNKNOWN = (0.62, 0.42, 0.42)  # RGB of a muscle whose activation is not known
BONE = (0.80, 0.77, 0.70)
JOINT = (0.45, 0.45, 0.45)
SURFACE = (0.55, 0.70, 0.75)
UNLIMITED = 3.0  # half the length that is drawn of an unlimited cylinder, in radii
# Radii as parts of the model's size.
MUSCLE_RADIUS = 0.011
BONE_RADIUS = 0.014
JOINT_RADIUS = 0.022
MASS_RADIUS = 0.035
TILES = 16
LEGEND_WIDTH = 0.16  # part of the image that the model leaves free
MARGIN = 0.06  # part of the image around the model
POSES = 60  # of a trajectory that the camera is fitted to
FRAME_PERIOD = 0.04  # s
FRONT = np.eye(3)
WINDOW_OPEN = "Exudyn's render window is open: close it with SC.renderer.Stop() first"
LAYER = "exudyn_muscles.view"
VISUALIZATION = exu.ConfigurationType.Visualization


def activation_color(activation: float) -> tuple[float, float, float, float]:
    """RGBA from blue, a = 0, to red, a = 1; a brownish gray if it is NaN.

    Examples
    --------
    >>> activation_color(1.0)
    (0.9, 0.1, 0.1, 1.0)
    """
    if np.isnan(activation):
        return (*UNKNOWN, 1.0)
    share = min(max(float(activation), 0.0), 1.0)
    r, g, b = (
        (1.0 - share) * low + share * high for low, high in zip(RELAXED, ACTIVE, strict=True)
    )
    return (r, g, b, 1.0)


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
        Draw the links as sticks in place of the graphics that the tree was created with.

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
        _check(model, trajectory)
    with _drawn(_Scene(model, trajectory, sticks), model.mbs.GetSystemContainer()):
        yield


def solution(trajectory: Trajectory, model: MusculoskeletalModel) -> dict[str, Any]:
    """The motion as Exudyn's `LoadSolutionFile` returns it, for `mbs.SolutionViewer`.

    Coordinates of the `mbs` outside the tree stay at their initial values.

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
    _check(model, trajectory)
    initial = model.mbs.systemData.GetODE2Coordinates(configuration=exu.ConfigurationType.Initial)
    n, rows = len(initial), model.skeleton.rows
    data = np.zeros((len(trajectory.time), 1 + 3 * n))
    data[:, 0] = trajectory.time
    q, v, a = (data[:, 1 + k * n : 1 + (k + 1) * n] for k in range(3))
    q[:] = initial
    q[:, rows], v[:, rows], a[:, rows] = model.state_of_tree(
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
        Draw the links as sticks in place of the graphics that the tree was created with.

    Raises
    ------
    DisplayError
        There is no display (`render` needs none), or Exudyn's render window is already open.
    ParameterError
        The trajectory is empty or not one of this model.
    """
    played = solution(trajectory, model)
    _need_display()
    scene, container = _Scene(model, trajectory, sticks), model.mbs.GetSystemContainer()
    if container.renderer.IsActive():
        raise DisplayError(WINDOW_OPEN)
    size = tuple(container.visualizationSettings.view0.window.renderWindowSize)
    span = trajectory.time[-1] - trajectory.time[0]
    rows = round(FRAME_PERIOD / span * played["nRows"]) if span > 0.0 else 1
    with _drawn(scene, container), _aimed(container, scene, trajectory, size, FRONT):
        model.mbs.SolutionViewer(
            played,
            rowIncrement=min(max(rows, 1), played["nRows"]),
            timeout=FRAME_PERIOD,
            runMode=0,
        )


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
        Between the first and the last time of the trajectory [s].
    file : str or Path
        The extension decides the format, `.png` for example.
    size : (int, int), optional
        Width and height [pixels].
    directions : (3, 3) array_like, optional
        Global directions that point to the right, upwards and to the viewer, one a row; x, y, z if
        left out.
    sticks : bool, optional
        Draw the links as sticks in place of the graphics that the tree was created with.

    Raises
    ------
    DisplayError
        Exudyn's render window is open, whose view would be lost.
    ParameterError
        The time lies outside the trajectory, size or directions are not what they should be, or
        the trajectory is empty or not one of this model.
    """
    _check(model, trajectory)
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
    scene = _Scene(model, trajectory, sticks)
    container = model.mbs.GetSystemContainer()
    if container.renderer.IsActive():
        raise DisplayError(WINDOW_OPEN)
    with (
        _drawn(scene, container),
        _aimed(container, scene, trajectory, (int(width), int(height)), axes),
        _posed(model, trajectory, time),
    ):
        _show_bodies_alone(container.visualizationSettings)
        image = container.renderer.RedrawAndGetImage(useRaytracer=True)
    _write(image, time, file)


class _Scene:
    """What is drawn of a model, at the visualization state of its `mbs`."""

    def __init__(
        self, model: MusculoskeletalModel, trajectory: Trajectory | None, sticks: bool
    ) -> None:
        self.model, self.sticks, self._trajectory = model, sticks, trajectory
        mbs, tree = model.mbs, model.skeleton.object
        item = mbs.GetObject(tree)
        parents = model.skeleton.tree.parents
        centers = np.array(item["linkCOMs"].GetPythonObject(), dtype=float).reshape(-1, 3)
        ends = [i for i in range(len(parents)) if i not in parents]
        origin = np.zeros(3)
        pairs = [
            [(origin, parent), (origin, link)] for link, parent in enumerate(parents) if parent >= 0
        ]
        pairs += [[(origin, link), (centers[link], link)] for link in ends]
        points = [point for pair in pairs for point in pair]
        self._stick_paths = Paths.straight(
            positions=np.array([position for position, _ in points]),
            links=np.array([link for _, link in points], dtype=np.int64),
            starts=2 * np.arange(len(pairs) + 1),
        )
        self._number_of_ends = len(ends)
        data = mbs.systemData
        initial = data.GetODE2Coordinates(configuration=exu.ConfigurationType.Initial)
        self.size = float(np.ptp(self.points(initial[model.skeleton.rows]), axis=0).max()) or 1.0

    def points(self, q: np.ndarray) -> np.ndarray:
        """All points that are drawn at coordinates `q` (n,), (k, 3) [m]."""
        tree = self.model.skeleton.tree
        points = path_points(tree, self.model.paths, q)
        return np.vstack(points + (self._stick_points(q) if self.sticks else []))

    def draw(self, mbs: exu.MainSystem, number: int) -> list[dict]:
        """Graphics of all muscles and sticks; Exudyn calls this at every redraw."""
        data = self.model.mbs.systemData
        q = np.array(data.GetODE2Coordinates(configuration=VISUALIZATION))
        q = q[self.model.skeleton.rows]
        items = self._links(q) if self.sticks else []
        colors = map(activation_color, self._activations(data.GetTime(VISUALIZATION)))
        paths = path_points(self.model.skeleton.tree, self.model.paths, q)
        for points, color in zip(paths, colors, strict=True):
            items += self._rod(points, MUSCLE_RADIUS * self.size, color)
        return items + [
            self._surface(*surface)
            for surface in surfaces_at(self.model.skeleton.tree, self.model.paths, q)
        ]

    def _activations(self, time: float) -> np.ndarray:
        one = self._trajectory
        if one is None:
            return np.full(len(self.model.muscles), np.nan)
        return np.array([np.interp(time, one.time, a) for a in one.activations.T])

    def _stick_points(self, q: np.ndarray) -> list[np.ndarray]:
        return path_points(self.model.skeleton.tree, self._stick_paths, q)

    def _links(self, q: np.ndarray) -> list[dict]:
        sticks = self._stick_points(q)
        items = []
        for k, stick in enumerate(sticks):
            items += self._rod(stick, BONE_RADIUS * self.size, (*BONE, 1.0))
            items.append(self._ball(stick[0], JOINT_RADIUS, JOINT))
            if k >= len(sticks) - self._number_of_ends:
                items.append(self._ball(stick[1], MASS_RADIUS, BONE))
        return items

    @staticmethod
    def _surface(shape: int, pose: np.ndarray, half_length: float) -> dict:
        axes, color = pose[:3, :3], [*SURFACE, 1.0]
        if shape != CYLINDER:
            unit = graphics.Sphere(color=color, radius=1.0, nTiles=2 * TILES)
        else:
            radius = np.linalg.norm(axes[:, 2])
            height = 2.0 * min(half_length / float(radius), UNLIMITED)
            unit = graphics.Cylinder(
                pAxis=[0.0, 0.0, -0.5 * height], vAxis=[0.0, 0.0, height], radius=1.0,
                color=color, nTiles=2 * TILES,
            )  # fmt: skip
        return graphics.Move(unit, pose[:3, 3], axes)

    def _ball(self, point: np.ndarray, radius: float, color: tuple[float, ...]) -> dict:
        return graphics.Sphere(
            point=point, radius=radius * self.size, color=[*color, 1.0], nTiles=TILES
        )

    @staticmethod
    def _rod(points: np.ndarray, radius: float, color: tuple[float, ...]) -> list[dict]:
        """Cylinders through points (k, 3) with round ends."""
        items = [
            graphics.Sphere(point=point, radius=radius, color=list(color), nTiles=TILES)
            for point in points
        ]
        for start, end in pairwise(points):
            if np.linalg.norm(end - start) > 1e-9:
                items.append(
                    graphics.Cylinder(
                        pAxis=start,
                        vAxis=end - start,
                        radius=radius,
                        color=list(color),
                        nTiles=TILES,
                    )
                )
        return items


@contextmanager
def _drawn(scene: _Scene, container: exu.SystemContainer) -> Iterator[None]:
    """Let a container draw a scene; sticks replace the tree meanwhile."""
    mbs = scene.model.mbs
    layer = _layer(container)
    hidden = _own_graphics(scene.model.skeleton) if scene.sticks else []
    shown = [mbs.GetObjectParameter(number, "Vshow") for number in hidden]
    try:
        for number in hidden:
            # Unlike VshowLinks and VshowJoints, this acts after assembly.
            mbs.SetObjectParameter(number, "Vshow", False)
        layer.AddObject(
            ObjectGround(visualization=VObjectGround(graphicsDataUserFunction=scene.draw))
        )
        layer.Assemble()
        yield
    finally:
        layer.Reset()
        layer.variables[LAYER] = True
        for number, before in zip(hidden, shown, strict=True):
            mbs.SetObjectParameter(number, "Vshow", before)


def _own_graphics(skeleton: Skeleton) -> list[int]:
    """The tree, and the ground that `CreateKinematicTree` makes just before it.

    That one has a block to every first joint that is not at the base, no name, and the base for its
    position.
    """
    mbs, tree = skeleton.mbs, skeleton.tree
    number = int(skeleton.object)
    blocks = int((tree.offsets[tree.parents < 0] != 0.0).any(axis=1).sum())
    if number == 0 or blocks == 0:
        return [number]
    before = mbs.GetObject(number - 1)
    is_own = (
        before["objectType"] == "Ground"
        and before["name"] == f"object{number - 1}"
        and np.array_equal(before["referencePosition"], tree.base)
        and len(before["VgraphicsData"]) == blocks
    )
    return [number, number - 1] if is_own else [number]


def _layer(container: exu.SystemContainer) -> exu.MainSystem:
    """An empty system to draw with: one left by an earlier call, as Exudyn cannot remove one."""
    for number in range(container.NumberOfSystems()):
        system = container.GetSystem(number)
        if LAYER in system.variables and system.systemData.NumberOfObjects() == 0:
            return system
    return container.AddSystem()


@contextmanager
def _posed(model: MusculoskeletalModel, trajectory: Trajectory, time: float) -> Iterator[None]:
    """Put the current state, which Exudyn draws without a window, to a time of a trajectory."""
    data, rows = model.mbs.systemData, model.skeleton.rows
    before, time_before = np.array(data.GetODE2Coordinates()), data.GetTime()
    posed = before.copy()
    now = np.array([np.interp(time, trajectory.time, q) for q in trajectory.coordinates.T])
    (posed[rows],) = model.state_of_tree(now)
    try:
        data.SetODE2Coordinates(posed)
        data.SetTime(time)
        yield
    finally:
        data.SetODE2Coordinates(before)
        data.SetTime(time_before)


@contextmanager
def _aimed(
    container: exu.SystemContainer,
    scene: _Scene,
    trajectory: Trajectory,
    size: tuple[int, int],
    directions: np.ndarray,
) -> Iterator[None]:
    """Fit the camera to a whole motion; the user's settings and view are back afterwards."""
    settings, renderer = container.visualizationSettings, container.renderer
    settings_before, view_before = settings.GetDictionary(), renderer.GetState()
    try:
        _fit_camera(settings, scene, trajectory, size, directions)
        renderer.ResetState()
        yield
    finally:
        settings.SetDictionary(settings_before)
        renderer.SetState(view_before)


def _fit_camera(
    settings: exu.VisualizationSettings,
    scene: _Scene,
    trajectory: Trajectory,
    size: tuple[int, int],
    directions: np.ndarray,
) -> None:
    """Aim at the middle of all points of a trajectory's poses, as near as they all fit in."""
    rows = np.unique(np.linspace(0, len(trajectory.time) - 1, POSES).astype(int))
    (q,) = scene.model.state_of_tree(trajectory.coordinates[rows])
    points = np.vstack([scene.points(row) for row in q])
    seen = points @ directions.T
    thickness = MASS_RADIUS * scene.size
    low, high = seen.min(axis=0) - thickness, seen.max(axis=0) + thickness
    width, height = size
    shape = width / height * (1.0 - LEGEND_WIDTH)
    # Exudyn's zoom is half of the visible height.
    zoom = 0.5 * max(high[1] - low[1], (high[0] - low[0]) / shape) / (1.0 - 2.0 * MARGIN)
    center = 0.5 * (low + high)
    center[0] += zoom * width / height * LEGEND_WIDTH
    settings.general.autoFitScene = False
    camera = settings.openGL.advanced
    camera.initialZoom = zoom
    camera.initialCenterPoint = center.tolist()
    camera.initialModelRotation = directions.T.tolist()
    camera.initialMaxSceneSize = 4.0 * max(zoom, float(np.abs(points).max()))
    settings.view0.window.renderWindowSize = list(size)


def _show_bodies_alone(settings: exu.VisualizationSettings) -> None:
    """Smooth edges, and neither texts nor symbols."""
    settings.raytracer.multiSampling = 3
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


def _check(model: MusculoskeletalModel, trajectory: Trajectory) -> None:
    """ParameterError unless the trajectory has time points and the model's names."""
    if len(trajectory.time) == 0:
        raise ParameterError("the trajectory has no time points")
    for what, mine, other in (
        ("coordinates", model.coordinates, trajectory.coordinate_names),
        ("muscles", tuple(model.muscles.names), trajectory.muscle_names),
    ):
        if mine != other:
            raise ParameterError(
                f"the trajectory belongs to another model: its {what} are {', '.join(other)}, "
                f"the model's {', '.join(mine)}"
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
