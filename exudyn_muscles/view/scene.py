"""What is drawn of a model: muscles, wrapping surfaces, and sticks from joint to joint.

The sticks take the place of the tree's own graphics, unless `sticks=False`: Exudyn does not tell
graphics that the user made from the blocks that it makes itself.
"""

from __future__ import annotations

from itertools import pairwise

import exudyn as exu
import numpy as np
from exudyn import graphics

from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..path.paths import Paths
from ..path.surfaces import CYLINDER
from ..results.trajectory import Trajectory
from ..skeleton.geometry import path_points, surfaces_at
from .colors import BONE, JOINT, SURFACE, activation_color

UNLIMITED = 3.0  # half the length that is drawn of an unlimited cylinder, in radii
# Radii as parts of the model's size.
MUSCLE_RADIUS = 0.011
BONE_RADIUS = 0.014
JOINT_RADIUS = 0.022
MASS_RADIUS = 0.035
TILES = 16
VISUALIZATION = exu.ConfigurationType.Visualization


class Scene:
    """What is drawn of a model, at the visualization state of its `mbs`."""

    def __init__(
        self, model: MusculoskeletalModel, trajectory: Trajectory | None, sticks: bool
    ) -> None:
        self.model, self.sticks, self._trajectory = model, sticks, trajectory
        mbs, tree = model.mbs, model.skeleton.object
        item = mbs.GetObject(tree)
        parents = model.skeleton.tree.parents
        centers = np.array(item["linkCOMs"].GetPythonObject(), dtype=float).reshape(-1, 3)
        ends = [i for i in range(len(parents)) if i not in parents]
        origin = np.zeros(3)
        pairs = [
            [(origin, parent), (origin, link)] for link, parent in enumerate(parents) if parent >= 0
        ]
        pairs += [[(origin, link), (centers[link], link)] for link in ends]
        points = [point for pair in pairs for point in pair]
        self._stick_paths = Paths.straight(
            positions=np.array([position for position, _ in points]),
            links=np.array([link for _, link in points], dtype=np.int64),
            starts=2 * np.arange(len(pairs) + 1),
        )
        self._number_of_ends = len(ends)
        data = mbs.systemData
        initial = data.GetODE2Coordinates(configuration=exu.ConfigurationType.Initial)
        self.size = float(np.ptp(self.points(initial[model.skeleton.rows]), axis=0).max()) or 1.0

    def points(self, q: np.ndarray) -> np.ndarray:
        """All points that are drawn at coordinates `q` (n,), (k, 3) [m]."""
        tree = self.model.skeleton.tree
        points = path_points(tree, self.model.paths, q)
        return np.vstack(points + (self._stick_points(q) if self.sticks else []))

    def draw(self, mbs: exu.MainSystem, number: int) -> list[dict]:
        """Graphics of all muscles and sticks; Exudyn calls this at every redraw."""
        data = self.model.mbs.systemData
        q = np.array(data.GetODE2Coordinates(configuration=VISUALIZATION))
        q = q[self.model.skeleton.rows]
        items = self._links(q) if self.sticks else []
        colors = map(activation_color, self._activations(data.GetTime(VISUALIZATION)))
        paths = path_points(self.model.skeleton.tree, self.model.paths, q)
        for points, color in zip(paths, colors, strict=True):
            items += self._rod(points, MUSCLE_RADIUS * self.size, color)
        return items + [
            self._surface(*surface)
            for surface in surfaces_at(self.model.skeleton.tree, self.model.paths, q)
        ]

    def _activations(self, time: float) -> np.ndarray:
        one = self._trajectory
        if one is None:
            return np.full(len(self.model.muscles), np.nan)
        return np.array([np.interp(time, one.time, a) for a in one.activations.T])

    def _stick_points(self, q: np.ndarray) -> list[np.ndarray]:
        return path_points(self.model.skeleton.tree, self._stick_paths, q)

    def _links(self, q: np.ndarray) -> list[dict]:
        sticks = self._stick_points(q)
        items = []
        for k, stick in enumerate(sticks):
            items += self._rod(stick, BONE_RADIUS * self.size, (*BONE, 1.0))
            items.append(self._ball(stick[0], JOINT_RADIUS, JOINT))
            if k >= len(sticks) - self._number_of_ends:
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
        ("muscles", tuple(model.muscles.names), trajectory.muscle_names),
    ):
        if mine != other:
            raise ParameterError(
                f"the trajectory belongs to another model: its {what} are {', '.join(other)}, "
                f"the model's {', '.join(mine)}"
            )
