"""Results in storage files, under the names that OpenSim's tools give them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..analysis.states import reserves_along
from ..errors import StorageError
from ..files.storage import Storage
from ..forces.actuators import Actuator, actuator_names
from ..model import MusculoskeletalModel
from ..motion.coordinate import Coordinate
from ..results.excitations import EDGE
from ..results.trajectory import Trajectory


def states(
    trajectory: Trajectory,
    model: MusculoskeletalModel | None = None,
    described: Sequence[Coordinate] = (),
) -> Storage:
    """Coordinates and speeds [rad or m, /s], activations and fibre lengths [m], as CMC's
    `_states.sto`.

    The labels are OpenSim 4's state paths. With a model and all coordinates of its file these are
    the states that its `StatesTrajectory` asks for: coupled and locked coordinates are there, fibre
    lengths over rigid tendons are not. Without them the coordinates' paths lack the joint.

    Parameters
    ----------
    trajectory : Trajectory
    model : MusculoskeletalModel, optional
        The one of the trajectory.
    described : sequence of Coordinate, optional
        All coordinates of the model's file, as `read_coordinates` returns them.

    Returns
    -------
    Storage

    Raises
    ------
    StorageError
        The trajectory is not one of this model, or these are not its coordinates.
    """
    coordinates = _coordinates(trajectory, model, described)
    labels = [f"{path}/{x}" for path in coordinates for x in ("value", "speed")]
    columns = [column for pair in coordinates.values() for column in pair]
    rigid = [] if model is None else [x.name for x in model.muscles if x.ignore_tendon_compliance]
    for i, name in enumerate(trajectory.muscle_names):
        labels.append(f"/forceset/{name}/activation")
        columns.append(trajectory.activations[:, i])
        if name not in rigid:
            labels.append(f"/forceset/{name}/fiber_length")
            columns.append(trajectory.fiber_lengths[:, i])
    table = np.column_stack(columns)
    return Storage(f"{trajectory.method}_states", tuple(labels), trajectory.time, table)


def _coordinates(
    trajectory: Trajectory, model: MusculoskeletalModel | None, described: Sequence[Coordinate]
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Values and speeds (T,) of every coordinate by its path, without the last word of it."""
    names, q, v = trajectory.coordinate_names, trajectory.coordinates, trajectory.speeds
    if model is not None:
        if (names, trajectory.muscle_names) != (model.coordinates, model.muscles.names):
            raise StorageError(
                f"the trajectory has the coordinates {list(names)} and the muscles "
                f"{list(trajectory.muscle_names)}, the model has others"
            )
        names = model.skeleton.tree_coordinates
        q, v = model.state_of_tree(q, v)
    moving = {name: (q[:, j], v[:, j]) for j, name in enumerate(names)}
    if not described:
        return moving
    rest, found = np.zeros(len(trajectory.time)), {}
    for each in described:
        if each.name not in moving and not each.locked:
            raise StorageError(f"coordinate '{each.name}' is none of the model's: {list(names)}")
        held = each.default_value + rest, rest
        found[f"{each.joint}/{each.name}"] = moving.get(each.name, held)
    return found


def kinematics(trajectory: Trajectory) -> Storage:
    """Coordinates in degrees or m, as `_Kinematics_q.sto`.

    Parameters
    ----------
    trajectory : Trajectory

    Returns
    -------
    Storage
    """
    rotates = np.array([unit == "rad" for unit in trajectory.coordinate_units], dtype=bool)
    values = np.where(rotates, np.degrees(trajectory.coordinates), trajectory.coordinates)
    return Storage("Coordinates", trajectory.coordinate_names, trajectory.time, values, True)


def controls(trajectory: Trajectory, reserves: Sequence[Actuator] = ()) -> Storage:
    """Excitations, and the reserves' torques over their optimal forces, as CMC's `_controls.sto`.

    A row holds the excitations of the window that ends there, as in OpenSim; another one, `EDGE`
    later, those of the window that begins. Read linearly, as OpenSim does, excitations are thus
    held, and reserves run linearly.

    Parameters
    ----------
    trajectory : Trajectory
    reserves : sequence of Reserve, PointActuator, TorqueActuator or PathActuator
        Those of the model.

    Returns
    -------
    Storage

    Raises
    ------
    StorageError
        These are not the trajectory's reserves, or it has no window.
    """
    names = actuator_names(reserves)
    if names != trajectory.reserve_names:
        raise StorageError(
            f"the trajectory has the reserves {list(trajectory.reserve_names)}, got {list(names)}"
        )
    t, u = trajectory.window_time, trajectory.excitation_values
    forces = [reserve.optimal_force for reserve in reserves]
    ideal = trajectory.reserves.reshape(len(t), -1) / forces
    begun = t[1:-1] + EDGE
    time = np.concatenate([t[:1], np.column_stack([t[1:-1], begun]).ravel(), t[-1:]])
    at = [np.interp(time, t, column) for column in ideal.T]
    values = np.column_stack([np.repeat(u, 2, axis=0), *at])
    return Storage("controls", _actuators(trajectory), time, values)


def forces(trajectory: Trajectory) -> Storage:
    """Tendon forces [N] and the reserves' torques [N m or N], as `_Actuation_force.sto`.

    Parameters
    ----------
    trajectory : Trajectory

    Returns
    -------
    Storage
    """
    values = np.column_stack([trajectory.tendon_forces, reserves_along(trajectory)])
    return Storage("ActuatorForces", _actuators(trajectory), trajectory.time, values)


def tracking_errors(trajectory: Trajectory) -> Storage:
    """q_d - q [rad or m], as CMC's `_pErr.sto`.

    Parameters
    ----------
    trajectory : Trajectory

    Returns
    -------
    Storage
    """
    names, errors = trajectory.coordinate_names, trajectory.tracking_errors()
    return Storage("PositionErrors", names, trajectory.time, errors)


def _actuators(trajectory: Trajectory) -> tuple[str, ...]:
    return (*trajectory.muscle_names, *trajectory.reserve_names)


def write_results(
    trajectory: Trajectory,
    stem: str | Path,
    reserves: Sequence[Actuator] = (),
    *,
    model: MusculoskeletalModel | None = None,
    described: Sequence[Coordinate] = (),
) -> list[Path]:
    """Write the files that OpenSim's CMC leaves behind; errors only where a motion was desired.

    Parameters
    ----------
    trajectory : Trajectory
    stem : str or Path
        What the files' names begin with: `<stem>_states.sto`, `_controls.sto`, `_Kinematics_q.sto`,
        `_Actuation_force.sto` and `_pErr.sto`.
    reserves : sequence of Reserve, PointActuator, TorqueActuator or PathActuator
        Those of the model; not needed beside it.
    model : MusculoskeletalModel, optional
    described : sequence of Coordinate, optional
        As of `states`, for files that OpenSim replays.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    StorageError
        As `states` and `controls`.
    """
    if model is not None:
        reserves = model.reserves
    tables = {
        "states": states(trajectory, model, described),
        "controls": controls(trajectory, reserves),
        "Kinematics_q": kinematics(trajectory),
        "Actuation_force": forces(trajectory),
    }
    if not np.isnan(trajectory.desired_coordinates).all():
        tables["pErr"] = tracking_errors(trajectory)
    files = [Path(f"{stem}_{ending}.sto") for ending in tables]
    for file, table in zip(files, tables.values(), strict=True):
        table.write(file)
    return files
