"""Results in storage files, under the names that OpenSim's tools give them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..errors import StorageError
from ..files.storage import Storage
from ..forces.actuators import Actuator, actuator_names
from ..results.trajectory import Trajectory


def states(trajectory: Trajectory) -> Storage:
    """Coordinates and speeds [rad or m, /s], activations and fibre lengths [m], as CMC's
    `_states.sto`.

    The labels are OpenSim 4's state paths; those of coordinates lack the joint, without which
    OpenSim finds them too.
    """
    labels = [f"{name}/{x}" for name in trajectory.coordinate_names for x in ("value", "speed")]
    labels += [
        f"/forceset/{name}/{x}"
        for name in trajectory.muscle_names
        for x in ("activation", "fiber_length")
    ]
    pairs = (
        (trajectory.coordinates, trajectory.speeds),
        (trajectory.activations, trajectory.fiber_lengths),
    )
    values = [np.stack(pair, axis=2).reshape(len(trajectory.time), -1) for pair in pairs]
    return Storage(f"{trajectory.method}_states", tuple(labels), trajectory.time, np.hstack(values))


def kinematics(trajectory: Trajectory) -> Storage:
    """Coordinates in degrees or m, as `_Kinematics_q.sto`."""
    rotates = np.array([unit == "rad" for unit in trajectory.coordinate_units], dtype=bool)
    values = np.where(rotates, np.degrees(trajectory.coordinates), trajectory.coordinates)
    return Storage("Coordinates", trajectory.coordinate_names, trajectory.time, values, True)


def controls(trajectory: Trajectory, reserves: Sequence[Actuator] = ()) -> Storage:
    """Excitations, and the reserves' torques over their optimal forces, as CMC's `_controls.sto`.

    A row holds the excitations of the window that ends there, as in OpenSim; the first repeats the
    second.

    Parameters
    ----------
    trajectory : Trajectory
    reserves : sequence of Reserve, PointActuator or TorqueActuator
        Those of the model.

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
    u = trajectory.excitation_values
    torques = trajectory.reserves / [reserve.optimal_force for reserve in reserves]
    values = np.hstack([np.vstack([u[:1], u]), torques.reshape(len(trajectory.window_time), -1)])
    return Storage("controls", _actuators(trajectory), trajectory.window_time, values)


def forces(trajectory: Trajectory) -> Storage:
    """Tendon forces [N] and the reserves' torques [N m or N], as `_Actuation_force.sto`."""
    torques = [
        np.interp(trajectory.time, trajectory.window_time, column)
        for column in trajectory.reserves.T
    ]
    values = np.column_stack([trajectory.tendon_forces, *torques])
    return Storage("ActuatorForces", _actuators(trajectory), trajectory.time, values)


def tracking_errors(trajectory: Trajectory) -> Storage:
    """q_d - q [rad or m], as CMC's `_pErr.sto`."""
    names, errors = trajectory.coordinate_names, trajectory.tracking_errors()
    return Storage("PositionErrors", names, trajectory.time, errors)


def _actuators(trajectory: Trajectory) -> tuple[str, ...]:
    return (*trajectory.muscle_names, *trajectory.reserve_names)


def write_results(
    trajectory: Trajectory, stem: str | Path, reserves: Sequence[Actuator] = ()
) -> list[Path]:
    """Write the files that OpenSim's CMC leaves behind; errors only where a motion was desired.

    Parameters
    ----------
    trajectory : Trajectory
    stem : str or Path
        What the files' names begin with: `<stem>_states.sto`, `_controls.sto`, `_Kinematics_q.sto`,
        `_Actuation_force.sto` and `_pErr.sto`.
    reserves : sequence of Reserve, PointActuator or TorqueActuator
        Those of the model.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    StorageError
        As `controls`.
    """
    tables = {
        "states": states(trajectory),
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
