"""What is drawn of a model: muscles, wrapping surfaces, and limbs.

Limbs take the place of graphics in which the muscles would not be seen, unless `sticks=False`.
"""

from __future__ import annotations

from typing import NamedTuple

import exudyn as exu
import numpy as np
from exudyn import graphics

from ..errors import ParameterError
from ..files.meshes import Mesh
from ..model import MusculoskeletalModel
from ..path.lines import lines, surfaces
from ..results.trajectory import Trajectory
from ..shapes import bellies, bones
from ..shapes.tubes import normals
from ..skeleton.shown import VISUALIZATION, pose_shown
from .colors import (
    BONE,
    FLESH,
    FLESH_OPACITY,
    SURFACE,
    SURFACE_OPACITY,
    TENDON,
    activation_color,
)


class Limb(NamedTuple):
    """A part of a segment, or of ground (None): its mesh in the segment's frame, and its color."""

    segment: int | None
    mesh: Mesh
    color: tuple[float, ...]


class Strain(NamedTuple):
    """What muscles are drawn by at one time: lengths of fibres along tendons [m], tendon forces [N]
    and activations, (m,) each."""

    fibers: np.ndarray
    forces: np.ndarray
    activations: np.ndarray


class Scene:
    """What is drawn of a model, at the visualization state of its `mbs`."""

    def __init__(
        self, model: MusculoskeletalModel, trajectory: Trajectory | None, sticks: bool
    ) -> None:
        self.model, self._trajectory = model, trajectory
        self._own, self._draws_limbs = model.skeleton.own_graphics(), sticks
        first = _first_pose(model, trajectory)
        with pose_shown(model.mbs) as pose:
            pose(first)
            self._segments = model.skeleton.segments()
        self._limbs: list[Limb] = []
        self.size = float(np.ptp(self.points(first[None]), axis=0).max()) or 1.0
        if sticks:
            self._limbs = self._made_limbs()

    @property
    def replaced(self) -> tuple[int, ...]:
        """The objects of the `mbs` in whose place something else is drawn."""
        return self._own.replaced if self._draws_limbs else ()

    def points(self, poses: np.ndarray) -> np.ndarray:
        """Points (j, 3) around all that is drawn in poses (k, N) of the whole system [m]."""
        found = []
        with pose_shown(self.model.mbs) as pose:
            for x in poses:
                pose(x)
                R, p, q = self.model.skeleton.frames_shown(None)
                found += lines(self.model.paths, R, p, q)
                found.append(self._own.outline(not self._draws_limbs))
                if not self._draws_limbs:
                    continue
                placed = self._segments.poses()
                for segment, moved in zip(self._segments.bodies, placed, strict=True):
                    if segment.number in self._own.limbs:
                        found.append(_placed(np.vstack([segment.joints, segment.center]), moved))
                for limb in self._limbs:
                    found.append(_placed(limb.mesh[0], _pose(limb.segment, placed)))
        return np.vstack(found)

    def draw(self, mbs: exu.MainSystem, number: int) -> list[dict]:
        """Graphics of all muscles and limbs; Exudyn calls this at every redraw."""
        model, time = self.model, self.model.mbs.systemData.GetTime(VISUALIZATION)
        q, strain = self._at(time)
        R, p, q = model.skeleton.frames_shown(q)
        placed = self._segments.poses()
        items = []
        for i, (muscle, line) in enumerate(
            zip(model.muscles, lines(model.paths, R, p, q), strict=True)
        ):
            if len(line) < 2:
                continue  # its path is a function
            body = bellies.body(
                [line], strain.fibers[i : i + 1], strain.forces[i : i + 1],
                muscle.max_isometric_force,
            )  # fmt: skip
            belly = activation_color(strain.activations[i])
            colors = np.where(body.on_belly[:, None], belly, (*TENDON, 1.0))
            items.append(_drawn((body.vertices[0], body.triangles), colors))
        for limb in self._limbs:
            vertices, corners = limb.mesh
            moved = _placed(vertices, _pose(limb.segment, placed))
            items.append(_drawn((moved, corners), np.tile(limb.color, (len(vertices), 1))))
        for shape, pose, half in surfaces(model.paths, R, p):
            vertices, corners = bones.surface(shape, pose, half)
            color = np.tile((*SURFACE, SURFACE_OPACITY), (len(vertices), 1))
            items.append(_drawn((_placed(vertices, pose), corners), color))
        # What one can look through comes last, as OpenGL needs it.
        return sorted(items, key=lambda item: item["colors"][0, 3] < 1.0)

    def _at(self, time: float) -> tuple[np.ndarray | None, Strain]:
        """Coordinates, if they are known, and strain at a time."""
        if self._trajectory is None:
            muscles = self.model.muscles
            fibers = np.array([muscle.optimal_fiber_length for muscle in muscles])
            return None, Strain(fibers, np.zeros(len(fibers)), np.full(len(fibers), np.nan))
        one = self._trajectory
        along = one.musculotendon_lengths - one.tendon_lengths
        fibers = np.where(np.isfinite(along), along, one.fiber_lengths)
        q, *strain = (
            np.array([np.interp(time, one.time, x) for x in values.T])
            for values in (one.coordinates, fibers, one.tendon_forces, one.activations)
        )
        return q, Strain(*strain)

    def _made_limbs(self) -> list[Limb]:
        """Bones and flesh of the segments that are drawn so, and what is seen of ground."""
        opaque, translucent = (*BONE, 1.0), (*FLESH, FLESH_OPACITY)
        paths, smallest = self.model.paths, bones.SMALLEST_BONE * self.size
        ground = bones.hull(None, paths)
        parts: list[tuple[int | None, Mesh | None, tuple[float, ...]]] = [(None, ground, opaque)]
        for k, segment in enumerate(self._segments.bodies):
            if segment.number in self._own.limbs:
                parts.append((k, bones.skeletal(segment, paths, smallest), opaque))
                parts.append((k, bones.flesh(segment), translucent))
        return [Limb(k, mesh, color) for k, mesh, color in parts if mesh is not None]


def _pose(segment: int | None, poses: np.ndarray) -> np.ndarray:
    return np.eye(4) if segment is None else poses[segment]


def _placed(vertices: np.ndarray, pose: np.ndarray) -> np.ndarray:
    return vertices @ pose[:3, :3].T + pose[:3, 3]


def _drawn(mesh: Mesh, colors: np.ndarray) -> dict:
    """Exudyn's graphics of a mesh whose vertices have colors (v, 4)."""
    return graphics.FromPointsAndTrigs(*mesh, color=colors, normals=normals(*mesh))


def _first_pose(model: MusculoskeletalModel, trajectory: Trajectory | None) -> np.ndarray:
    """Coordinates (N,) of the whole `mbs` at the begin, or at its initial state."""
    initial, _ = model.skeleton.initial_arrays()
    if trajectory is not None:
        return poses(model, trajectory, initial)[0]
    if not model.skeleton.system_names:  # of a tree those that follow are not in it yet
        q, _ = model.skeleton.initial_state()
        (initial[model.skeleton.rows],) = model.state_of_tree(q)
    return initial


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
