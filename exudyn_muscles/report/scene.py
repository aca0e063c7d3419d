"""The moving scene of a page, for the player of k3d."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..files.meshes import Mesh
from ..model import MusculoskeletalModel
from ..path.frames import GROUND
from ..results.trajectory import Trajectory
from ..shapes import bellies, bones
from ..shapes.bones import SMALLEST_BONE
from ..shapes.tubes import triangles, tube
from ..view.colors import (
    ACTIVE,
    BONE,
    FLESH,
    FLESH_OPACITY,
    RELAXED,
    SURFACE,
    SURFACE_OPACITY,
    TENDON,
)
from .frames import Frames, sampled

FORCE = (0.10, 0.55, 0.25)
ARROW = 0.45  # length of the largest external force, as part of the scene's size
ARROW_RADIUS, ARROW_HEAD = 0.008, 0.12  # radius and head, as parts of the size and the length
GRAIN = 2.0**13  # 1/m: places are rounded to 0.12 mm, which halves the page
COMPRESSION = 6  # of zlib
FIELD = 35.0  # deg of the camera
GAP = 0.15  # between results side by side, as part of their width
ASIDE = (0.25, 0.12)  # how far the camera is to the right and above, over the distance
FROM_THE_FRONT = (0.0, 0.05)  # of results that stand side by side, so that they are equally large


class Parts(NamedTuple):
    """Numbers under which k3d knows the parts of one result: the mesh of all muscles (0: none has
    a path to draw), parts that may be hidden, and every segment's bones (0: none); `starts` are the
    first vertices of every muscle in its mesh."""

    muscles: int
    starts: list[int]
    flesh: list[int]
    surfaces: list[int]
    bones: list[int]


class Scene(NamedTuple):
    """What k3d plays, from `start` to `end` [s]; its own time begins with zero."""

    snapshot: bytes
    start: float
    end: float
    parts: list[Parts]


def build(
    model: MusculoskeletalModel,
    trajectories: Sequence[Trajectory],
    directions: np.ndarray,
    meshes: Mapping[int, Mesh],
) -> Scene:
    """The scene of a model along trajectories, side by side, seen along `directions` (3, 3), as of
    `render`; `meshes` take the place of the bones of some segments."""
    import k3d

    shown = _apart([sampled(model, one) for one in trajectories], directions[0])
    points = np.vstack([_extent(frames) for frames, _ in shown])
    size = float(np.linalg.norm(np.ptp(_extent(shown[0][0]), axis=0))) or 1.0
    start = min(float(frames.time[0]) for frames, _ in shown)
    end = max(float(frames.time[-1]) for frames, _ in shown)
    # k3d plays from zero, also when it begins anew.
    shown = [(frames._replace(time=frames.time - start), offset) for frames, offset in shown]
    with warnings.catch_warnings():  # k3d's own, of float64
        warnings.simplefilter("ignore")
        plot = k3d.plot(
            camera_auto_fit=False, grid_visible=False, menu_visibility=False, axes_helper=0.0,
            background_color=0xFFFFFF, camera_fov=FIELD, mode="callback", fps=30.0,
            colorbar_object_id=0, lighting=1.6, logarithmic_depth_buffer=False, antialias=1,
            time=0.0,
            camera=_camera(points, directions, ASIDE if len(shown) == 1 else FROM_THE_FRONT),
        )  # fmt: skip
        largest = _largest_force([frames for frames, _ in shown])
        parts = []
        for trajectory, (frames, offset) in zip(trajectories, shown, strict=True):
            skeleton, flesh = _segments(plot, frames, model, offset, size, meshes)
            muscles, starts = _muscles(plot, frames, model, trajectory)
            surfaces = []
            for shape, poses, half in frames.surfaces:
                part = bones.surface(shape, poses[0], half)
                moves = {"model_matrix": _over(frames.time, poses)}
                surfaces.append(_add(plot, part, SURFACE, opacity=SURFACE_OPACITY, **moves))
            for vertices in _arrows(frames, ARROW * size / largest, size):
                _add(plot, (_over(frames.time, vertices), triangles(len(ARROW_SHAPE))), FORCE)
            parts.append(Parts(muscles, starts, flesh, surfaces, skeleton))
        snapshot = plot.get_binary_snapshot(COMPRESSION)
    return Scene(snapshot, start, end, parts)


def _segments(
    plot: Any,
    frames: Frames,
    model: MusculoskeletalModel,
    offset: np.ndarray,
    size: float,
    meshes: Mapping[int, Mesh],
) -> tuple[list[int], list[int]]:
    """Add bones and flesh of all segments, and what is seen of ground."""
    skeleton, flesh = [], []
    for k, segment in enumerate(frames.segments):
        moves = {"model_matrix": _over(frames.time, frames.bodies[:, k])}
        own = meshes.get(segment.number)
        # Nobody knows which way the triangles of a user's mesh face.
        side = "front" if own is None else "double"
        part = own or bones.skeletal(segment, model.paths, SMALLEST_BONE * size)
        skeleton.append(0 if part is None else _add(plot, part, BONE, side=side, **moves))
        around = bones.flesh(segment)
        if around is not None:
            flesh.append(_add(plot, around, FLESH, opacity=FLESH_OPACITY, **moves))
    fixed = meshes.get(GROUND) or bones.hull(None, model.paths)
    if fixed is not None:
        vertices, corners = fixed
        given = GROUND in meshes
        side = "double" if given else "front"
        _add(plot, (vertices + offset, corners), BONE, flat_shading=not given, side=side)
    return skeleton, flesh


def _apart(several: list[Frames], right: np.ndarray) -> list[tuple[Frames, np.ndarray]]:
    """Each beside the one before, and by how much it was moved (3,) [m]."""
    found: list[tuple[Frames, np.ndarray]] = []
    edge = 0.0
    for frames in several:
        along = _extent(frames) @ right
        offset = (edge - along.min()) * right if found else np.zeros(3)
        edge = along.max() + offset @ right + GAP * np.ptp(along)
        found.append((frames.moved(offset), offset))
    return found


def _muscles(
    plot: Any, frames: Frames, model: MusculoskeletalModel, trajectory: Trajectory
) -> tuple[int, list[int]]:
    """Add the bodies of all muscles, colored by their activations; their mesh and where the
    vertices of each one begin.

    They are one mesh, as what takes the player time is how many it has.
    """
    rows, starts = frames.rows, [0]
    vertices, corners, values = [], [], []
    along = trajectory.musculotendon_lengths[rows] - trajectory.tendon_lengths[rows]
    fibers = np.where(np.isfinite(along), along, trajectory.fiber_lengths[rows])
    for i, muscle in enumerate(model.muscles):
        lines = [each[i] for each in frames.paths]
        starts.append(starts[-1])
        if min(map(len, lines)) < 2:
            continue  # its path is a function
        forces = trajectory.tendon_forces[rows, i]
        body = bellies.body(lines, fibers[:, i], forces, muscle.max_isometric_force)
        vertices.append(body.vertices)
        corners.append(body.triangles + starts[-2])
        active = np.clip(np.nan_to_num(trajectory.activations[rows, i]), 0.0, 1.0)
        values.append(np.where(body.on_belly, active[:, None], ON_TENDON))
        starts[-1] += body.on_belly.size
    if not vertices:
        return 0, starts
    moving = _over(frames.time, np.concatenate(vertices, axis=1))
    number = _add(
        plot,
        (moving, np.vstack(corners).astype(np.uint32)),
        None,
        attribute=_over(frames.time, np.concatenate(values, axis=1)),
        color_map=np.array(COLOR_MAP, dtype=np.float32).ravel(),
        color_range=[ON_TENDON, 1.0],
        click_callback=_clicked,
    )
    return number, starts


ON_TENDON = -1.0  # in place of an activation
# Place, red, green, blue: tendons, and then activations from 0 to 1.
COLOR_MAP = ((0.0, *TENDON), (0.49, *TENDON), (0.5, *RELAXED), (1.0, *ACTIVE))


def _clicked(*_: Any) -> None:
    """That there is one makes k3d tell the page of clicks."""


def _add(plot: Any, mesh: tuple, color: tuple[float, ...] | None, **options: Any) -> int:
    """Add a mesh, whose vertices may move; its number."""
    import k3d

    vertices, corners = mesh
    if color is not None:
        red, green, blue = (round(255 * part) for part in color)
        options["color"] = (red << 16) + (green << 8) + blue
    if not isinstance(vertices, Mapping):
        vertices = vertices.astype(np.float32)
    moves = options.pop("model_matrix", None)
    made = k3d.mesh(vertices, corners, **{"flat_shading": False, "side": "front", **options})
    if moves is not None:  # k3d's constructor takes one that stays
        made.set_trait("model_matrix", moves)
    plot += made
    return int(made.id)


def _over(time: np.ndarray, values: np.ndarray) -> dict[str, np.ndarray]:
    """Values (k, ...) at times as k3d takes them."""
    rounded = np.round(values * GRAIN) / GRAIN if values.shape[-1] == 3 else values
    return {
        f"{t:.6f}": np.ascontiguousarray(value, dtype=np.float32)
        for t, value in zip(time, rounded, strict=True)
    }


# Part of the length before the head, or of the head, and radius over that of the shaft.
ARROW_SHAPE = ((0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 0.0, 2.6), (1.0, 1.0, 0.01))


def _largest_force(several: list[Frames]) -> float:
    """Of all external forces [N]; 1 if there are none."""
    sizes = [
        np.linalg.norm(values[:, 1], axis=1).max()
        for frames in several
        for values in frames.forces.values()
    ]
    return max(sizes, default=0.0) or 1.0


def _arrows(frames: Frames, scale: float, size: float) -> Iterator[np.ndarray]:
    """Vertices (k, v, 3) of an arrow for every external force, which begins where it acts; `scale`
    is its length for a unit of force [m/N]."""
    shape = np.array(ARROW_SHAPE)
    for values in frames.forces.values():
        start, whole = values[:, 0], scale * values[:, 1]
        length = np.linalg.norm(whole, axis=1)
        head = ARROW_HEAD * ARROW * size
        share = np.minimum(1.0, head / np.maximum(length, 1e-9))
        along = shape[:, 0] * (1.0 - share[:, None]) + shape[:, 1] * share[:, None]
        points = start[:, None] + along[:, :, None] * whole[:, None]
        radii = ARROW_RADIUS * size * shape[:, 2] * np.minimum(1.0, length / head)[:, None]
        yield tube(points, radii)


def _extent(frames: Frames) -> np.ndarray:
    """Points (j, 3) that the camera has to see."""
    found = [frames.bodies[..., :3, 3].reshape(-1, 3)]
    found += [line for lines in frames.paths for line in lines]
    for k, segment in enumerate(frames.segments):
        own = np.vstack([segment.joints, 2.0 * segment.center - segment.joints[:1]])
        poses = frames.bodies[:, k]
        placed = own @ poses[:, :3, :3].transpose(0, 2, 1) + poses[:, None, :3, 3]
        found.append(placed.reshape(-1, 3))
    return np.vstack(found)


def _camera(points: np.ndarray, directions: np.ndarray, aside: tuple[float, float]) -> list[float]:
    """Place, target and upward direction; somewhat from the right and from above."""
    right, up, towards = directions
    seen = points @ directions.T
    center = 0.5 * (seen.min(axis=0) + seen.max(axis=0)) @ directions
    half = 0.5 * np.ptp(seen, axis=0).max()
    distance = 1.25 * half / np.tan(np.radians(0.5 * FIELD))
    look = towards + aside[0] * right + aside[1] * up
    place = center + distance * look / np.linalg.norm(look)
    return [float(x) for x in (*place, *center, *up)]
