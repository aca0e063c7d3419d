"""Forces and torques that the parts of a model exert on each other in its joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import UnknownForcesWarning, warn
from ..joints import Recorded, check_frame, model_joints
from ..model import MusculoskeletalModel
from ..results.trajectory import Trajectory
from ..skeleton.joints import JointFrame
from .states import check_fits, check_lengths, reserves_along
from .table import Table, tabulated

# Torque that nothing known gives, over the largest one, and [N m]: CSS and consistent co-simulation
# deliver what differs from the recorded forces by a thousandth.
UNKNOWN = 0.01
QUANTITIES = {"force": "N", "torque": "N m", "center": "m"}


def joint_loads(
    model: MusculoskeletalModel,
    result: Trajectory,
    joints: Sequence[str] | Mapping[str, str] | None = None,
    *,
    expressed_in: JointFrame = JointFrame.GROUND,
    on_parent: bool = False,
) -> Table:
    """What joints bear, of the whole of what acts.

    Inertia and gravity, muscles at their points and on the surfaces that they wrap over, ligaments
    and other passive forces, contact, external forces and the user's own, reserves and residuals.
    A force along a coordinate, such as a reserve's or a limit's, acts between the two bodies of its
    joint and is part of the load, as in OpenSim. Accelerations are those that follow from the
    forces. Paths that are functions of coordinates have no points, and act on coordinates alone.

    Parameters
    ----------
    model : MusculoskeletalModel
    result : Trajectory
        Of this model.
    joints : sequence of str or mapping, optional
        Names as of `joint_names`, or any coordinate of a tree; a mapping, name -> joint, gives
        them names of your own. All of `joint_names` if left out.
    expressed_in : JointFrame
        Axes of force and torque: those of ground, or of the frame of the joint's parent or child.
    on_parent : bool
        Loads on the parent, about the joint's center there, in place of those on the child.

    Returns
    -------
    Table
        `force/joint/x` [N], `torque/joint/x` [N m] about the joint's center, and that itself,
        `center/joint/x` [m] in ground; y and z likewise.

    Raises
    ------
    ParameterError
        There is no such joint or frame, or the trajectory is of another model.
    ModelError
        The skeleton is a tree with other bodies beside it, whose state a trajectory lacks.

    Warns
    -----
    UnknownForcesWarning
        The motion needs torques that nothing known gives, such as those of PreStep functions.
    """
    check_frame(expressed_in)
    check_fits(model, result)
    found, times = model_joints(model, joints), result.time.size
    states = Recorded(
        result.time, result.coordinates, result.speeds, result.system_coordinates,
        result.system_speeds, result.tendon_forces, reserves_along(result),
    )  # fmt: skip
    written = np.empty((times, len(found.names), len(QUANTITIES), 3))
    lacking = np.zeros_like(result.accelerations)
    for k, there in enumerate(found.along(states)):
        check_lengths(model, result, k, there.length)
        written[k] = there.loads.written(expressed_in, on_parent).reshape(written[k].shape)
        lacking[k] = there.M @ (result.accelerations[k] - there.acceleration)
    _warn_of_unknown_forces(result, lacking)
    labels = tuple(f"{name}/{axis}" for name in found.names for axis in "xyz")
    parts = {
        quantity: (unit, labels, written[:, :, k].reshape(times, -1))
        for k, (quantity, unit) in enumerate(QUANTITIES.items())
    }
    return tabulated("joint loads", result.time, parts)


def _warn_of_unknown_forces(result: Trajectory, lacking: np.ndarray) -> None:
    """Warn where the recorded motion needs torques (T, n) that nothing known gives."""
    bound = UNKNOWN * np.abs(result.torques_delivered).max(initial=0.0) + result.max_unmet_torque
    size = np.abs(lacking)
    if size.max(initial=0.0) > bound + UNKNOWN:
        k, j = np.unravel_index(size.argmax(), size.shape)
        warn(
            f"joint loads: at t = {result.time[k]:g} s the motion is one for which "
            f"{lacking[k, j]:.3g} more on '{result.coordinate_names[j]}' are needed: forces that "
            "user functions set in a run, such as those of PreStep, are not known after it. "
            "em.joint_load_sensor shows loads of bodies with them",
            UnknownForcesWarning,
        )


def force_sizes(loads: Table) -> tuple[tuple[str, ...], np.ndarray]:
    """Names of the joints of a table of loads, and the sizes (k, joints) of their forces [N].

    Raises
    ------
    ParameterError
        The table is of another analysis.
    """
    forces = loads["force"]
    own = [column.removeprefix("force/") for column in loads.columns if column[:6] == "force/"]
    names = tuple(dict.fromkeys(name.rpartition("/")[0] for name in own))
    return names, np.linalg.norm(forces.reshape(len(forces), -1, 3), axis=2)
