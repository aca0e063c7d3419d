"""The motion of everything that a page shows, sampled at its frames."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..model import MusculoskeletalModel
from ..path.lines import lines, surfaces
from ..results.trajectory import Trajectory
from ..skeleton.external_forces import external_forces_shown
from ..skeleton.segments import Segment
from ..skeleton.shown import pose_shown
from ..view.scene import poses

RATE = 30.0  # frames/s; between them the player interpolates
MOST_FRAMES = 300
MOST_MUSCLE_FRAMES = 9000  # 54 muscles for 5.5 s; a page of these has some 25 MB


class Frames(NamedTuple):
    """Everything that moves, at k times.

    Attributes
    ----------
    time : (k,) ndarray
        [s].
    rows : (k,) int ndarray
        Theirs in the trajectory.
    segments : tuple of Segment
        The s bodies, with their joints as at the first time.
    bodies : (k, s, 4, 4) ndarray
        Their poses.
    paths : list of k lists of (points, 3) ndarray
        Of all muscles [m].
    surfaces : list of (shape, (k, 4, 4) ndarray, half length)
        As `path.lines.surfaces` has them.
    forces : dict
        Name -> (k, 2, 3) ndarray, point [m] and force [N] of an external force.
    """

    time: np.ndarray
    rows: np.ndarray
    segments: tuple[Segment, ...]
    bodies: np.ndarray
    paths: list[list[np.ndarray]]
    surfaces: list[tuple[int, np.ndarray, float]]
    forces: dict[str, np.ndarray]

    def moved(self, offset: np.ndarray) -> Frames:
        """All of it, moved by an offset (3,) [m]."""
        shift = np.zeros((4, 4))
        shift[:3, 3] = offset
        return self._replace(
            bodies=self.bodies + shift,
            paths=[[line + offset for line in lines] for lines in self.paths],
            surfaces=[(shape, poses + shift, half) for shape, poses, half in self.surfaces],
            forces={name: x + np.array([offset, 0.0 * offset]) for name, x in self.forces.items()},
        )


def frame_times(trajectory: Trajectory) -> np.ndarray:
    """Points of time of the trajectory, evenly chosen: about `RATE` a second."""
    rows, span = len(trajectory.time), trajectory.time[-1] - trajectory.time[0]
    most = min(MOST_FRAMES, max(2, MOST_MUSCLE_FRAMES // max(1, len(trajectory.muscle_names))))
    wanted = int(np.clip(np.ceil(RATE * span) + 1, 2, min(most, max(rows, 2))))
    chosen = np.linspace(0, rows - 1, wanted).round().astype(int)
    return trajectory.time[np.unique(chosen)]


def sampled(model: MusculoskeletalModel, trajectory: Trajectory) -> Frames:
    """The motion of a model along a trajectory; the state of its `mbs` is as before."""
    skeleton = model.skeleton
    initial, _ = skeleton.initial_arrays()
    time = frame_times(trajectory)
    rows = np.searchsorted(trajectory.time, time)
    acting = external_forces_shown(model.mbs)
    bodies, paths, wraps = [], [], []
    forces: dict[str, list[np.ndarray]] = {name: [] for name in acting}
    segments = None
    with pose_shown(model.mbs) as pose:
        for t, q, x in zip(
            time,
            trajectory.coordinates[rows],
            poses(model, trajectory, initial)[rows],
            strict=True,
        ):
            pose(x)
            segments = segments or skeleton.segments()
            R, p, z = skeleton.frames_shown(q)
            bodies.append(segments.poses())
            paths.append(lines(model.paths, R, p, z))
            wraps.append(surfaces(model.paths, R, p))
            for name, function in acting.items():
                forces[name].append(function(t))
    assert segments is not None  # there is a time at least
    moving = [
        (shape, np.array([one[k][1] for one in wraps]), half)
        for k, (shape, _, half) in enumerate(wraps[0])
    ]
    found = {name: np.array(values) for name, values in forces.items()}
    return Frames(time, rows, segments.bodies, np.array(bodies), paths, moving, found)
