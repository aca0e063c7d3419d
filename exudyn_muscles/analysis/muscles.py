"""Lengths, velocities, forces, powers and moment arms of all muscles along a trajectory, as
OpenSim's MuscleAnalysis has them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..muscle.dynamics import MuscleDynamics, muscle_dynamics
from ..results.trajectory import Trajectory
from ..skeleton.geometry import Geometry
from .states import check_fits, geometries
from .table import Table, tabulated

SAME_FORCE = 1e-6  # of F0: it is computed from the same numbers


def muscle_analysis(model: MusculoskeletalModel, result: Trajectory) -> Table:
    """What every muscle does over time.

    Parameters
    ----------
    model : MusculoskeletalModel
    result : Trajectory
        Of this model.

    Returns
    -------
    Table
        `quantity/muscle`, with OpenSim's quantities in this package's names: `length`,
        `lengthening_speed`, `fiber_length`, `normalized_fiber_length`, `fiber_velocity`,
        `normalized_fiber_velocity`, `pennation_angle`, `tendon_length`, `tendon_force`,
        `active_fiber_force`, `passive_fiber_force` (f_PE and a damper, if the law has one), both
        also `..._along_tendon`, the `passive_share` of their sizes, and the powers that they do:
        `fiber_active_power`, `fiber_passive_power`, `tendon_power`, `muscle_power`, of which the
        last is the sum of the others while the tendon is taut. `moment_arm/coordinate/muscle` is
        -dl/dq, `moment/coordinate/muscle` the torque or force that goes with it.

    Raises
    ------
    ParameterError
        The trajectory is of another model or of other muscles; names the first that differs.
    """
    check_fits(model, result)
    each = list(geometries(model, result))
    names, found = model.muscles.names, fibers_at(model, result, each)
    length, speed, r = (np.array([g[k] for g in each]) for k in range(3))  # r (T, m, n)
    F, alpha = found.tendon_force, found.pennation_angle
    active, passive, v = found.active_fiber_force, found.passive_fiber_force, found.fiber_velocity
    optimal = model.muscles.optimal_fiber_length
    fastest = np.array([muscle.max_contraction_velocity for muscle in model.muscles])
    sizes = np.abs(active) + np.abs(passive)
    share = np.divide(np.abs(passive), sizes, out=np.zeros_like(sizes), where=sizes > 0.0)
    columns = {
        "length": ("m", length),
        "lengthening_speed": ("m/s", speed),
        "fiber_length": ("m", found.fiber_length),
        "normalized_fiber_length": ("", found.fiber_length / optimal),
        "fiber_velocity": ("m/s", v),
        "normalized_fiber_velocity": ("", v / (fastest * optimal)),
        "pennation_angle": ("rad", alpha),
        "tendon_length": ("m", model.muscles.with_rigid(result.tendon_lengths)),
        "tendon_force": ("N", F),
        "active_fiber_force": ("N", active),
        "passive_fiber_force": ("N", passive),
        "active_fiber_force_along_tendon": ("N", active * np.cos(alpha)),
        "passive_fiber_force_along_tendon": ("N", passive * np.cos(alpha)),
        "passive_share": ("", share),
        **powers(found, speed),
    }
    parts = {name: (unit, names, values) for name, (unit, values) in columns.items()}
    for j, coordinate in enumerate(model.coordinates):
        turns = model.skeleton.units[j] == "rad"
        parts[f"moment_arm/{coordinate}"] = "m" if turns else "", names, r[:, :, j]
        parts[f"moment/{coordinate}"] = "N m" if turns else "N", names, r[:, :, j] * F
    return tabulated("muscle analysis", result.time, parts)


def powers(found: MuscleDynamics, speed: np.ndarray) -> dict[str, tuple[str, np.ndarray]]:
    """Powers (T, m) of muscles that lengthen with a `speed`, with their unit."""
    v, F = found.fiber_velocity, found.tendon_force
    return {
        "fiber_active_power": ("W", -found.active_fiber_force * v),
        "fiber_passive_power": ("W", -found.passive_fiber_force * v),
        "tendon_power": ("W", -F * found.tendon_length_rate),
        "muscle_power": ("W", -F * speed),
    }


def fibers_along(model: MusculoskeletalModel, result: Trajectory) -> MuscleDynamics:
    """What all muscles do, (T, m) each, along a trajectory.

    Raises
    ------
    ParameterError
        It is of another model or of other muscles; names the first that differs.
    """
    check_fits(model, result)
    return fibers_at(model, result, geometries(model, result))


def fibers_at(
    model: MusculoskeletalModel, result: Trajectory, each: Iterable[Geometry]
) -> MuscleDynamics:
    """As `fibers_along`, where muscles have these geometries."""
    muscles = model.muscles
    rows = [
        muscle_dynamics(muscles, a, l_t, geometry.length, geometry.lengthening_speed)
        for a, l_t, geometry in zip(result.activations, result.tendon_lengths, each, strict=True)
    ]
    found = MuscleDynamics(*(np.array(field) for field in zip(*rows, strict=True)))
    F, forces = found.tendon_force, result.tendon_forces
    other = np.abs(F - forces) > SAME_FORCE * muscles.max_isometric_force
    if other.any():
        k, i = np.argwhere(other)[0]
        raise ParameterError(
            f"the trajectory is of other muscles: at t = {result.time[k]:g} s the force of "
            f"{muscles.names[i]} is {forces[k, i]:.6g} N there and {F[k, i]:.6g} N here"
        )
    return found
