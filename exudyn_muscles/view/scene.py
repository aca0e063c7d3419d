"""What is drawn of a model: muscles, wrapping surfaces, and sticks from joint to joint.

The sticks take the place of graphics in which the muscles would not be seen, unless `sticks=False`.
"""

from __future__ import annotations

from itertools import pairwise

import exudyn as exu
import numpy as np
from exudyn import graphics

from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..path.lines import lines, surfaces
from ..path.surfaces import CYLINDER
from ..results.trajectory import Trajectory
from ..skeleton.shown import VISUALIZATION
from .colors import BONE, JOINT, SURFACE, activation_color

UNLIMITED = 3.0  # half the length that is drawn of an unlimited cylinder, in radii
# Radii as parts of the model's size.
MUSCLE_RADIUS = 0.011
BONE_RADIUS = 0.014
JOINT_RADIUS = 0.022
MASS_RADIUS = 0.035
TILES = 16


class Scene:
    """What is drawn of a model, at the visualization state of its `mbs`."""

    def __init__(
        self, model: MusculoskeletalModel, trajectory: Trajectory | None, sticks: bool
    ) -> None:
        self.model, self._trajectory = model, trajectory
        self._sticks, self._draws_sticks = model.skeleton.sticks(), sticks
        initial, _ = model.skeleton.initial_arrays()
        self.size = float(np.ptp(self.points(initial[None]), axis=0).max()) or 1.0

    @property
    def replaced(self) -> tuple[int, ...]:
        """The objects of the `mbs` in whose place something else is drawn."""
        return self._sticks.replaced if self._draws_sticks else ()

    def points(self, poses: np.ndarray) -> np.ndarray:
        """All points (j, 3) that are drawn in poses (k, N) of the whole system [m]."""
        data, found = self.model.mbs.systemData, []
        before = np.array(data.GetODE2Coordinates(configuration=VISUALIZATION))
        try:
            for x in poses:
                data.SetODE2Coordinates(x, configuration=VISUALIZATION)
                R, p, q = self.model.skeleton.frames_shown(None)
                found += lines(self.model.paths, R, p, q)
                found.append(self._sticks.points().reshape(-1, 3))
                found.append(self._sticks.outline(not self._draws_sticks))
        finally:
            data.SetODE2Coordinates(before, configuration=VISUALIZATION)
        return np.vstack(found)

    def draw(self, mbs: exu.MainSystem, number: int) -> list[dict]:
        """Graphics of all muscles and sticks; Exudyn calls this at every redraw."""
        model, time = self.model, self.model.mbs.systemData.GetTime(VISUALIZATION)
        q = a = None
        if self._trajectory is not None:
            q, a = (
                np.array([np.interp(time, self._trajectory.time, x) for x in values.T])
                for values in (self._trajectory.coordinates, self._trajectory.activations)
            )
        R, p, q = model.skeleton.frames_shown(q)
        items = self._links() if self._draws_sticks else []
        colors = map(activation_color, np.full(len(model.muscles), np.nan) if a is None else a)
        for points, color in zip(lines(model.paths, R, p, q), colors, strict=True):
            items += self._rod(points, MUSCLE_RADIUS * self.size, color)
        return items + [self._surface(*surface) for surface in surfaces(model.paths, R, p)]

    def _links(self) -> list[dict]:
        items = []
        for stick, end in zip(self._sticks.points(), self._sticks.ends, strict=True):
            items += self._rod(stick, BONE_RADIUS * self.size, (*BONE, 1.0))
            items.append(self._ball(stick[0], JOINT_RADIUS, JOINT))
            if end:
                items.append(self._ball(stick[1], MASS_RADIUS, BONE))
        return items

    @staticmethod
    def _surface(shape: int, pose: np.ndarray, half_length: float) -> dict:
        axes, color = pose[:3, :3], [*SURFACE, 1.0]
        if shape != CYLINDER:
            unit = graphics.Sphere(color=color, radius=1.0, nTiles=2 * TILES)
        else:
            radius = np.linalg.norm(axes[:, 2])
            height = 2.0 * min(half_length / float(radius), UNLIMITED)
            unit = graphics.Cylinder(
                pAxis=[0.0, 0.0, -0.5 * height], vAxis=[0.0, 0.0, height], radius=1.0,
                color=color, nTiles=2 * TILES,
            )  # fmt: skip
        return graphics.Move(unit, pose[:3, 3], axes)

    def _ball(self, point: np.ndarray, radius: float, color: tuple[float, ...]) -> dict:
        return graphics.Sphere(
            point=point, radius=radius * self.size, color=[*color, 1.0], nTiles=TILES
        )

    @staticmethod
    def _rod(points: np.ndarray, radius: float, color: tuple[float, ...]) -> list[dict]:
        """Cylinders through points (k, 3) with round ends."""
        items = [
            graphics.Sphere(point=point, radius=radius, color=list(color), nTiles=TILES)
            for point in points
        ]
        for start, end in pairwise(points):
            if np.linalg.norm(end - start) > 1e-9:
                items.append(
                    graphics.Cylinder(
                        pAxis=start,
                        vAxis=end - start,
                        radius=radius,
                        color=list(color),
                        nTiles=TILES,
                    )
                )
        return items


def check_belongs(model: MusculoskeletalModel, trajectory: Trajectory) -> None:
    """ParameterError unless the trajectory has time points and the model's names."""
    if len(trajectory.time) == 0:
        raise ParameterError("the trajectory has no time points")
    for what, mine, other in (
        ("coordinates", model.coordinates, trajectory.coordinate_names),
        ("bodies' coordinates", model.skeleton.system_names, trajectory.system_names),
        ("muscles", tuple(model.muscles.names), trajectory.muscle_names),
    ):
        if mine != other:
            raise ParameterError(
                f"the trajectory belongs to another model: its {what} are {', '.join(other)}, "
                f"the model's {', '.join(mine)}"
            )


def poses(model: MusculoskeletalModel, trajectory: Trajectory, others: np.ndarray) -> np.ndarray:
    """Coordinates (T, N) of the whole `mbs`; outside a tree those of `others` (N,)."""
    if trajectory.system_names:
        return trajectory.system_coordinates
    found = np.tile(others, (len(trajectory.time), 1))
    (found[:, model.skeleton.rows],) = model.state_of_tree(trajectory.coordinates)
    return found
