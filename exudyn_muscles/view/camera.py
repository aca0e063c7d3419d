"""The camera: fitted to a whole motion, so that all pictures of it are alike."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import exudyn as exu
import numpy as np

from ..results.trajectory import Trajectory
from .scene import Scene, poses

LEGEND_WIDTH = 0.16  # part of the image that the model leaves free
MARGIN = 0.06  # part of the image around the model
THICKNESS = 0.025  # of muscles around their paths, part of the size
POSES = 60  # of a trajectory that the camera is fitted to
FRONT = np.eye(3)
WINDOW_OPEN = "Exudyn's render window is open: close it with SC.renderer.Stop() first"


@contextmanager
def aimed(
    container: exu.SystemContainer,
    scene: Scene,
    trajectory: Trajectory,
    size: tuple[int, int],
    directions: np.ndarray,
) -> Iterator[None]:
    """Aim at the middle of all points of a trajectory's poses, as near as they all fit in; settings
    and view are the user's again afterwards."""
    rows = np.unique(np.linspace(0, len(trajectory.time) - 1, POSES).astype(int))
    initial, _ = scene.model.skeleton.initial_arrays()
    points = scene.points(poses(scene.model, trajectory, initial)[rows])
    seen = points @ directions.T
    thickness = THICKNESS * scene.size
    low, high = seen.min(axis=0) - thickness, seen.max(axis=0) + thickness
    width, height = size
    shape = width / height * (1.0 - LEGEND_WIDTH)
    # Exudyn's zoom is half of the visible height.
    zoom = 0.5 * max(high[1] - low[1], (high[0] - low[0]) / shape) / (1.0 - 2.0 * MARGIN)
    center = 0.5 * (low + high)
    center[0] += zoom * width / height * LEGEND_WIDTH
    settings, renderer = container.visualizationSettings, container.renderer
    settings_before, view_before = settings.GetDictionary(), renderer.GetState()
    try:
        settings.general.autoFitScene = False
        camera = settings.openGL.advanced
        camera.initialZoom = zoom
        camera.initialCenterPoint = center.tolist()
        camera.initialModelRotation = directions.T.tolist()
        camera.initialMaxSceneSize = 4.0 * max(zoom, float(np.abs(points).max()))
        settings.view0.window.renderWindowSize = list(size)
        renderer.ResetState()
        yield
    finally:
        settings.SetDictionary(settings_before)
        renderer.SetState(view_before)
