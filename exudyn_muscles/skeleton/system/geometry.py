"""l, l' and the forces on all coordinates of muscles on the frames of a system."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...errors import WrappingError
from ...forces.actuator_table import COLUMNS, ActuatorTable, actuator_pulls
from ...forces.jacobian import generalized_by_frames
from ...numerics.curves import PackedCurves
from ...numerics.kernel import kernel
from ...path.geometry import path_geometry, space_for
from ...path.paths import Paths
from ..geometry import Geometry
from .frames import Frames, FrameTables


class Pose(NamedTuple):
    """A system's coordinates x, speeds x' (N,), frames, tracked z (n,) and T (n, N) with
    z' = T x'."""

    x: np.ndarray
    x_t: np.ndarray
    tables: FrameTables
    frames: Frames
    z: np.ndarray
    T: np.ndarray


class GeometryOnAll(Geometry):
    """A `Geometry` with the `loads` (m + k, N) that a unit of force in each muscle and actuator is
    on all coordinates x of the system."""

    loads: np.ndarray

    def __new__(
        cls, length: np.ndarray, speed: np.ndarray, loads: np.ndarray, B: np.ndarray
    ) -> GeometryOnAll:
        """By the directions B = dx/dz (N, n) in which z moves the system, passive ones with it."""
        m = length.size
        reduced = loads @ B
        self = super().__new__(cls, length, speed, reduced[:m], reduced[m:].T)
        self.loads = loads
        return self

    def load(self, forces: np.ndarray, torque: np.ndarray) -> np.ndarray:
        return forces @ self.loads


@kernel
def frames_geometry(
    positions, links, points, bent, rules, grids, bins, pieces, wraps, wrap_starts, factors,
    factor_starts, integers, numbers, starts, indices, R, p, J, z, T, x_t, l, l_t, loads,
):  # fmt: skip
    """As `tree_geometry`, with frames in place of links: write l, l' (m,) and loads (m, N)."""
    curves = PackedCurves(grids, bins, pieces)
    paths = Paths(
        positions, links, points, bent, rules, curves, wraps, wrap_starts, factors, factor_starts
    )
    pulls, failed = path_geometry(paths, None, R, p, z, integers, numbers, l)
    if failed >= 0:
        return failed
    generalized_by_frames(starts, indices, p, J, T, pulls, loads)
    for i in range(l.size):
        l_t[i] = 0.0
        for j in range(x_t.size):
            l_t[i] -= loads[i, j] * x_t[j]
    return -1


@kernel(allocates=True)
def actuator_loads(starts, indices, R, p, J, T, table, loads):
    """Write the loads (r, N) of a unit in every actuator."""
    generalized_by_frames(starts, indices, p, J, T, actuator_pulls(R, p, table), loads)


def compile_loads(
    paths: Paths, muscles: Sequence[str], actuators: ActuatorTable | None = None
) -> Callable[[Pose], tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """The function pose -> l, l' (m,) and loads (m + r, N) of muscles, by their names, and of
    actuators; it raises WrappingError."""
    integers, numbers = space_for(paths)
    tables = (*paths[:5], *paths.curves, *paths[6:], integers, numbers)
    m = paths.starts.size - 1
    rows = np.empty((0, COLUMNS)) if actuators is None else actuators.rows
    tension = None
    if actuators is not None and actuators.names:
        tension, along = compile_loads(actuators.paths, actuators.names), m + actuators.along
        signs = actuators.signs[:, None]

    def of_pose(pose: Pose) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        _, x_t, (_, starts, indices, _), frames, z, T = pose
        l, l_t, loads = np.empty(m), np.empty(m), np.empty((m + len(rows), x_t.size))
        failed = frames_geometry(*tables, starts, indices, *frames, z, T, x_t, l, l_t, loads[:m])
        if failed >= 0:
            raise WrappingError(
                f"muscle '{muscles[failed]}': found no way over an ellipsoid at z = "
                f"{np.array2string(z, precision=4)}; its line passes too near the center"
            )
        if len(rows):
            actuator_loads(starts, indices, *frames, T, rows, loads[m:])
        if tension is not None:
            loads[along] = signs * tension(pose)[2]
        return l, l_t, loads

    return of_pose


def torques_by(loads: Callable[..., tuple]) -> Callable[[Sequence[tuple], np.ndarray], np.ndarray]:
    """The function of k places and forces (m + r,) that returns their torques (k, n)."""

    def torques(places: Sequence[tuple], forces: np.ndarray) -> np.ndarray:
        return np.array([forces @ loads(pose)[2] @ B for _, _, pose, B, _ in places])

    return torques
