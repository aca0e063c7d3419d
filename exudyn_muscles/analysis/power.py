"""Power of fibres, tendons, muscles and joints, and the work that they have done."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..results.trajectory import Trajectory
from .muscles import fibers_at, powers
from .states import check_fits, geometries
from .table import Table, tabulated


def power(model: MusculoskeletalModel, result: Trajectory) -> Table:
    """Who does how much power [W].

    A muscle's power -F l' is that of its fibre and its tendon together while the tendon is taut:
    where it is slack the fibre moves alone, against its damper. All muscles' power on the
    coordinates and that of the ideal actuators is the power of the joint torques.

    Parameters
    ----------
    model : MusculoskeletalModel
    result : Trajectory
        Of this model.

    Returns
    -------
    Table
        `fiber_power/muscle`, `tendon_power/muscle`, `muscle_power/muscle`, and by coordinates
        `joint_power/coordinate` of all that is delivered there, `reserve_power/coordinate` of what
        ideal actuators add.

    Raises
    ------
    ParameterError
        The trajectory is of another model.
    """
    check_fits(model, result)
    each, names, v = list(geometries(model, result)), model.muscles.names, result.speeds
    found = fibers_at(model, result, each)
    muscles = powers(found, np.array([geometry.lengthening_speed for geometry in each]))
    fiber = muscles["fiber_active_power"][1] + muscles["fiber_passive_power"][1]
    parts = {
        "fiber_power": ("W", names, fiber),
        "tendon_power": ("W", names, muscles["tendon_power"][1]),
        "muscle_power": ("W", names, muscles["muscle_power"][1]),
        "joint_power": ("W", model.coordinates, result.torques_delivered * v),
        "reserve_power": ("W", model.coordinates, result.torques_ideal * v),
    }
    return tabulated("power", result.time, parts)


def work(powers: Table) -> Table:
    """The work [J] that was done since the first time, of a table of powers.

    By Simpson's rule; energy that a tendon has stored comes back as its positive work.

    Parameters
    ----------
    powers : Table
        Of `power`.

    Returns
    -------
    Table
        Its columns, called `..._work` in place of `..._power`.

    Raises
    ------
    ParameterError
        A column is no power; names it.
    """
    for column, unit in zip(powers.columns, powers.units, strict=True):
        if unit != "W":
            raise ParameterError(f"work: '{column}' of the {powers.name} is no power")
    from scipy.integrate import cumulative_simpson  # slow to import, and rarely asked for

    done = cumulative_simpson(powers.values, x=powers.time, axis=0, initial=0.0)
    columns = tuple(name.replace("_power/", "_work/") for name in powers.columns)
    return replace(powers, name="work", columns=columns, units=("J",) * len(columns), values=done)
