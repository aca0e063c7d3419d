"""What analyses add to the curves of a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..analysis.emg import EMG, measured_beside
from ..analysis.joint_loads import force_sizes
from ..analysis.table import Table
from ..errors import ParameterError
from ..results.trajectory import Trajectory


class Curves(NamedTuple):
    """Of one trajectory; what was not given is empty.

    Attributes
    ----------
    load_time : (k,) ndarray
    loads : (k, joints) ndarray
        Sizes of forces [N].
    least, largest : (K, m) ndarray
        Forces that would have done [N], at the windows' ends.
    measured : dict of str to (K,) ndarray
        Envelopes by muscle, there too.
    """

    load_time: np.ndarray
    loads: np.ndarray
    least: np.ndarray
    largest: np.ndarray
    measured: dict[str, np.ndarray]


class Beside(NamedTuple):
    """Of all trajectories, with the names of the joints."""

    joints: tuple[str, ...]
    curves: tuple[Curves, ...]

    @classmethod
    def of(
        cls,
        trajectories: Sequence[Trajectory],
        joint_loads: Table | Sequence[Table],
        feasible: Table | Sequence[Table],
        emg: EMG | None,
        measured: Mapping[str, str],
    ) -> Beside:
        """What `report` was given.

        Raises
        ------
        ParameterError
            A table is not one for each trajectory, of its muscles and windows, or of another
            analysis; or there is no such muscle or EMG.
        """
        loads = [force_sizes(one) for one in _each("joint_loads", joint_loads, trajectories)]
        joints = loads[0][0] if loads else ()
        if any(names != joints for names, _ in loads):
            raise ParameterError("joint_loads: the tables are of different joints")
        times = [one.time for one in _each("joint_loads", joint_loads, trajectories)]
        ranges = _each("feasible", feasible, trajectories)
        curves = []
        for k, one in enumerate(trajectories):
            shape, ends = one.excitation_values.shape, one.window_time[1:]
            least = largest = np.empty((shape[0], 0))
            if ranges:
                least, largest = (ranges[k][f"force_{end}"] for end in ("least", "largest"))
                if not least.shape == largest.shape == shape:
                    raise ParameterError("feasible: a table is not of its trajectory's windows")
            curves.append(
                Curves(
                    times[k] if loads else np.empty(0),
                    loads[k][1] if loads else np.empty((0, 0)),
                    least,
                    largest,
                    {} if emg is None else measured_beside(emg, measured, one.muscle_names, ends),
                )
            )
        return cls(joints, tuple(curves))


def _each(
    what: str, given: Table | Sequence[Table], trajectories: Sequence[Trajectory]
) -> list[Table]:
    """A table for each trajectory, or none at all."""
    tables = [given] if isinstance(given, Table) else list(given)
    if tables and len(tables) != len(trajectories):
        raise ParameterError(
            f"{what}: {len(tables)} tables for {len(trajectories)} trajectories; one for each"
        )
    return tables
