"""The muscles' geometry along a trajectory."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..results.trajectory import Trajectory
from ..skeleton.geometry import Geometry

SAME_LENGTH = 1e-9  # m: it is computed from the same numbers


def check_fits(model: MusculoskeletalModel, result: Trajectory) -> None:
    """Raise ParameterError unless the trajectory is one of such a model; names what differs."""
    for what, mine, its in (
        ("coordinates", model.coordinates, result.coordinate_names),
        ("muscles", model.muscles.names, result.muscle_names),
        ("coordinates of the system", model.skeleton.system_names, result.system_names),
    ):
        if tuple(mine) != tuple(its):
            raise ParameterError(
                f"the trajectory has the {what} {', '.join(its) or 'none'}, the model "
                f"{', '.join(mine) or 'none'}"
            )


def geometries(
    model: MusculoskeletalModel, result: Trajectory, rows: slice | np.ndarray = slice(None)
) -> Iterator[Geometry]:
    """l, l' and r of the muscles at every time of the trajectory, or at those of some `rows`.

    Raises
    ------
    ParameterError
        Lengths are not those of the trajectory; names the muscle.
    """
    t, numbers = result.time[rows], np.arange(result.time.size)[rows]
    q, v = result.coordinates[rows], result.speeds[rows]
    x, x_t = result.system_coordinates[rows], result.system_speeds[rows]
    for k, place in enumerate(model.skeleton.places_of(q, v, x, x_t, t)):
        geometry = model.geometry(*place)
        check_lengths(model, result, int(numbers[k]), geometry.length)
        yield geometry


def check_lengths(
    model: MusculoskeletalModel, result: Trajectory, k: int, length: np.ndarray
) -> None:
    """Raise ParameterError unless muscles are as long (m,) as at the time number `k`."""
    off = np.abs(length - result.musculotendon_lengths[k])
    if off.size and off.max() > SAME_LENGTH:
        raise ParameterError(
            f"the trajectory is of another model: at t = {result.time[k]:g} s the path of "
            f"{model.muscles.names[off.argmax()]} differs by {off.max():.3g} m"
        )


def reserves_along(result: Trajectory) -> np.ndarray:
    """Forces (T, r) of the ideal actuators, which are linear within windows."""
    columns = [np.interp(result.time, result.window_time, row) for row in result.reserves.T]
    return np.reshape(columns, (-1, result.time.size)).T
