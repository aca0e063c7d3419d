"""A result as one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..analysis.emg import EMG
from ..analysis.table import Table
from ..errors import DisplayError, ParameterError
from ..files.disk import write_file
from ..model import MusculoskeletalModel
from ..results.trajectory import Trajectory
from ..shapes.bones import checked_meshes
from ..view.camera import FRONT
from ..view.scene import check_belongs
from .beside import Beside
from .charts import check_groups, contents
from .page import assembled
from .scene import build


def report(
    trajectories: Trajectory | Sequence[Trajectory],
    file: str | Path,
    *,
    model: MusculoskeletalModel,
    groups: Mapping[str, Sequence[str]] | None = None,
    joint_loads: Table | Sequence[Table] = (),
    feasible: Table | Sequence[Table] = (),
    emg: EMG | None = None,
    measured: Mapping[str, str] | None = None,
    meshes: Mapping[int, tuple[ArrayLike, ArrayLike] | str | Path] | None = None,
    directions: ArrayLike = FRONT,
) -> None:
    """Write results as one page (`.html`) that opens in any browser, without a network.

    The skeleton moves with its muscles, which have bellies that thicken with force and are colored
    by activation, along their paths as they were computed, and external forces are arrows. A slider
    moves it through time, and a cursor through the curves beside it: tracking errors, excitations,
    forces within their reach, unmet torque and what reserves carry. It is played by k3d and plotly,
    which `pip install "exudyn_muscles[report]"` brings and the page contains. Not to be called
    while the `mbs` is running.

    Parameters
    ----------
    trajectories : Trajectory or sequence of Trajectory
        Several stand side by side, in the scene and in the curves.
    file : str or Path
    model : MusculoskeletalModel
        The model that they belong to, for its geometry.
    groups : mapping, optional
        Name -> names of muscles that can be chosen together.
    joint_loads, feasible : Table or sequence of Table, optional
        Of `analysis.joint_loads` and `analysis.feasible_forces` of each trajectory: sizes of the
        forces in joints, and what would have done the same beside the forces of muscles.
    emg : EMG, optional
        Envelopes beside excitations, drawn as they are: normalized and delayed.
    measured : mapping, optional
        Muscle -> name of its EMG.
    meshes : mapping, optional
        Number of a tree's link or ObjectIndex of a body, -1 for ground -> vertices (v, 3) [m] in
        its frame and corners (t, 3) of triangles, or a file of them (`.vtp`, `.stl`, `.obj`): bones
        of your own, in place of those drawn. `opensim.load_meshes` has those of a model.
    directions : (3, 3) array_like, optional
        Global directions that point to the right, upwards and to the viewer, one a row; x, y, z if
        left out.

    Raises
    ------
    DisplayError
        k3d or plotly is not installed.
    ParameterError
        A trajectory is empty or not one of this model, a group names a muscle that there is not,
        a mesh is of no segment or none, directions are not what they should be, or a table is not
        one for each trajectory, with its muscles.
    ModelFileError
        A file of a mesh is damaged.
    OSError
        The file cannot be written; names it.
    """
    several = [trajectories] if isinstance(trajectories, Trajectory) else list(trajectories)
    if not several:
        raise ParameterError("there is no trajectory to show")
    for one in several:
        check_belongs(model, one)
    groups = groups or {}
    check_groups(several[0], groups)
    own = checked_meshes(meshes or {}, model.skeleton.segments().bodies)
    axes = np.asarray(directions, dtype=float)
    if axes.shape != (3, 3) or not np.allclose(axes @ axes.T, np.eye(3), atol=1e-6):
        raise ParameterError("directions: expected three perpendicular unit vectors, one a row")
    beside = Beside.of(several, joint_loads, feasible, emg, measured or {})
    try:
        scene = build(model, several, axes, own)
        page = assembled(scene, contents(several, groups, beside))
    except ModuleNotFoundError as error:
        if error.name not in ("k3d", "plotly"):
            raise
        raise DisplayError(
            f"a report needs {error.name}: pip install 'exudyn_muscles[report]'"
        ) from error
    write_file(file, page.encode())
