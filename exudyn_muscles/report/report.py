"""A result as one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..errors import DisplayError, ParameterError
from ..files.disk import write_file
from ..model import MusculoskeletalModel
from ..results.trajectory import Trajectory
from ..view.camera import FRONT
from ..view.scene import check_belongs
from .curves import check_groups, contents
from .page import assembled
from .scene import build


def report(
    trajectory: Trajectory,
    file: str | Path,
    *,
    model: MusculoskeletalModel,
    groups: Mapping[str, Sequence[str]] | None = None,
    directions: ArrayLike = FRONT,
) -> None:
    """Write a result as one page (`.html`) that opens in any browser, without a network.

    The skeleton moves with its muscles, which have bellies that thicken with force and are colored
    by activation, along their paths as they were computed, and external forces are arrows. A slider
    moves it through time, and a cursor through the curves beside it: tracking errors, excitations,
    forces within their reach, unmet torque and what reserves carry. It is played by k3d and plotly,
    which `pip install "exudyn_muscles[report]"` brings and the page contains. Not to be called
    while the `mbs` is running.

    Parameters
    ----------
    trajectory : Trajectory
    file : str or Path
    model : MusculoskeletalModel
        The model that the trajectory belongs to, for its geometry.
    groups : mapping, optional
        Name -> names of muscles that can be chosen together.
    directions : (3, 3) array_like, optional
        Global directions that point to the right, upwards and to the viewer, one a row; x, y, z if
        left out.

    Raises
    ------
    DisplayError
        k3d or plotly is not installed.
    ParameterError
        The trajectory is empty or not one of this model, a group names a muscle that there is not,
        or directions are not what they should be.
    OSError
        The file cannot be written; names it.
    """
    check_belongs(model, trajectory)
    groups = groups or {}
    check_groups(trajectory, groups)
    axes = np.asarray(directions, dtype=float)
    if axes.shape != (3, 3) or not np.allclose(axes @ axes.T, np.eye(3), atol=1e-6):
        raise ParameterError("directions: expected three perpendicular unit vectors, one a row")
    try:
        scene = build(model, trajectory, axes)
        page = assembled(scene, contents(trajectory, groups))
    except ModuleNotFoundError as error:
        if error.name not in ("k3d", "plotly"):
            raise
        raise DisplayError(
            f"a report needs {error.name}: pip install 'exudyn_muscles[report]'"
        ) from error
    write_file(file, page.encode())
