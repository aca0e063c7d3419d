"""The musculoskeletal model: an Exudyn skeleton and its muscles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import exudyn as exu
import numpy as np

from .compilation import announce_compilation
from .errors import ParameterError, PathWarning, warn
from .muscle.parameters import Muscle, MuscleSet
from .path.geometry import Geometry, compile_geometry, path_geometry
from .path.points import collect_paths
from .recruitment.optimization import Reserve, reserve_columns
from .skeleton import Skeleton


class MusculoskeletalModel:
    """Muscles on the kinematic tree of an assembled Exudyn system.

    The `mbs` stays the user's: nothing in it is changed outside a run.

    Parameters
    ----------
    mbs : exudyn.MainSystem
        Assembled, with one `ObjectKinematicTree` as the skeleton and whatever else belongs to it.
    tree : ObjectIndex
        The kinematic tree.
    muscles : iterable of Muscle
        With paths on ground and on the tree's links.
    coordinates : sequence of str, optional
        Names of the tree's coordinates; `q0`, `q1`, ... if left out.
    reserves : sequence of Reserve, optional
        Ideal actuators on coordinates.

    Attributes
    ----------
    skeleton : Skeleton
    muscles : MuscleSet
    paths : Paths
    reserves : tuple of Reserve
    reserve_columns : (n, r) ndarray
        1 where reserve k acts on coordinate j.
    geometry : callable
        (q, q'), each (n,) -> Geometry with l, l' and r.

    Raises
    ------
    ModelError
        The system is not one that the plugin can drive.
    ParameterError
        A muscle, path or reserve does not fit the tree; names it.

    Warns
    -----
    PathWarning
        A muscle's path crosses no joint, so that it cannot act.
    """

    def __init__(
        self,
        mbs: exu.MainSystem,
        tree: int,
        muscles: Iterable[Muscle],
        *,
        coordinates: Sequence[str] | None = None,
        reserves: Sequence[Reserve] = (),
    ) -> None:
        announce_compilation(path_geometry)
        self.skeleton = Skeleton(mbs, tree, coordinates)
        self.muscles = MuscleSet(muscles)
        self.paths = collect_paths(self.muscles, len(self.skeleton))
        self.reserves = tuple(reserves)
        self.reserve_columns = reserve_columns(self.coordinates, self.reserves)
        self.geometry = compile_geometry(self.skeleton.tree, self.paths)
        for i, name in enumerate(self.muscles.names):
            if np.ptp(self.paths.links[self.paths.starts[i] : self.paths.starts[i + 1]]) == 0:
                warn(
                    f"muscle '{name}' crosses no coordinate: all its path points are on one link",
                    PathWarning,
                )

    @property
    def mbs(self) -> exu.MainSystem:
        """The user's Exudyn system."""
        return self.skeleton.mbs

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the n coordinates."""
        return self.skeleton.coordinates

    def torque(self, geometry: Geometry, F: np.ndarray, reserve: np.ndarray) -> np.ndarray:
        """Torques (n,) of tendon forces `F` (m,) and reserves (r,); slack tendons do not push."""
        torque = geometry.moment_arms.T @ np.maximum(F, 0.0)
        if reserve.size:
            torque += self.reserve_columns @ reserve
        return torque

    def check_tendons(self, q: np.ndarray) -> None:
        """Raise ParameterError for a muscle whose tendon is slack at all coordinates `q` (k, n)."""
        rest = np.zeros(len(self.skeleton))
        longest = np.max([self.geometry(row, rest).length for row in q], axis=0)
        for i, name in enumerate(self.muscles.names):
            shortest = self.muscles.shortest_taut_length[i]
            if longest[i] < shortest:
                slack = [m.tendon_slack_length for m in self.muscles][i]
                raise ParameterError(
                    f"muscle '{name}': tendon_slack_length = {slack:g} m is too long, the "
                    f"musculotendon path reaches at most {longest[i]:.4g} m in this motion; "
                    f"allowed is up to {longest[i] - shortest + slack:.4g} m"
                )
