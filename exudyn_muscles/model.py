"""The musculoskeletal model: an Exudyn skeleton and its muscles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NoReturn, SupportsIndex, get_args

import exudyn as exu
import numpy as np

from .errors import ModelError, ParameterError, PassiveForceWarning, PathWarning, warn
from .forces.actuator_table import actuator_table
from .forces.actuators import Actuator, actuator_names
from .muscle.dynamics import tendon_forces
from .muscle.equilibrium import equilibrium
from .muscle.parameters import Muscle, MuscleSet
from .path.paths import collect_paths
from .skeleton.closures import Loops
from .skeleton.coupling import DependentCoordinate
from .skeleton.geometry import Geometry
from .skeleton.skeleton import Skeleton
from .skeleton.system.coordinates import Tracked
from .skeleton.system.skeleton import GeneralSkeleton

# With a stiff tendon a fibre of 2.5 optimal lengths would bear 400 times its isometric force.
LONGEST_FIBER = 2.5


class MusculoskeletalModel:
    """Muscles on an assembled Exudyn system: on its kinematic tree, or on its bodies.

    The `mbs` stays the user's: nothing in it is changed outside a run, but that the first model of
    a system of bodies adds an object called `exudyn_muscles`, without mass or force.

    Parameters
    ----------
    mbs : exudyn.MainSystem
        Assembled, with the skeleton and whatever else belongs to it.
    tree : ObjectIndex or mapping
        The `ObjectKinematicTree` that is the skeleton, or of any other system what is tracked:
        name -> ObjectIndex of a joint with one free axis, JointCoordinate, RelativeRotation,
        RelativePosition, NodeCoordinate or ScalarFunction.
    muscles : iterable of Muscle
        With paths on ground and on the tree's links, or on bodies and markers.
    coordinates : sequence of str, optional
        Names of all the tree's coordinates; `q0`, `q1`, ... if left out.
    dependent_coordinates : sequence of DependentCoordinate, optional
        Coordinates of the tree that are functions of others. While a run is attached they are held
        there exactly; the `mbs` needs no constraint for it, and its own runs know of none.
    reserves : sequence of Reserve, PointActuator, TorqueActuator or PathActuator, optional
        Ideal actuators: reserves on coordinates, residual forces and torques on links.
    loops : Loops, optional
        Closed loops of the tree, whose dependent coordinates are held in the same way.
    followers
        Old name of `dependent_coordinates`; warns.

    Attributes
    ----------
    skeleton : Skeleton or GeneralSkeleton
    muscles : MuscleSet
    paths : Paths
    dependent_coordinates : tuple of DependentCoordinate
    loops : Loops or None
    reserves : tuple of Reserve, PointActuator, TorqueActuator or PathActuator
    columns : callable
        q (..., N) -> S (..., N, r): what a unit of each ideal actuator is on every coordinate of
        the tree; of any other system its pose -> S.
    geometry : callable
        (q, q'), each (n,) -> Geometry with l, l', r and S.
    torques : callable
        (places, forces (m + r,)) -> torques (k, n) of the forces at k places of the skeleton.
    loads : callable or None
        Of a system of bodies, its pose -> l, l' (m,), and what unit forces are on its coordinates
        (m + r, N).

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
        tree: int | Mapping[str, Tracked | exu.ObjectIndex],
        muscles: Iterable[Muscle],
        *,
        coordinates: Sequence[str] | None = None,
        dependent_coordinates: Sequence[DependentCoordinate] = (),
        reserves: Sequence[Actuator] = (),
        loops: Loops | None = None,
        followers: Sequence[DependentCoordinate] | None = None,
    ) -> None:
        self._tree = tree
        if not isinstance(mbs, exu.MainSystem):
            raise ModelError(f"mbs must be an exudyn.MainSystem, got {type(mbs).__name__}")
        muscles = _listed("muscles", muscles, Muscle)
        reserves = _listed("reserves", reserves, *get_args(Actuator))
        if followers is not None:
            warn("followers= is now dependent_coordinates=", DeprecationWarning)
            dependent_coordinates = followers
        dependent = _listed("dependent_coordinates", dependent_coordinates, DependentCoordinate)
        if loops is not None and not isinstance(loops, Loops):
            raise ParameterError(f"loops must be Loops, got {loops!r}")
        self.skeleton: Skeleton | GeneralSkeleton
        if isinstance(tree, Mapping):
            if coordinates is not None:
                raise ParameterError(
                    "the tracked coordinates have names of their own: coordinates= are those of a "
                    "kinematic tree"
                )
            if dependent:
                raise ParameterError(
                    f"dependent_coordinates= of '{dependent[0].coordinate}' are those of a "
                    "kinematic tree. Between bodies one coordinate follows another by a constraint "
                    "of the mbs, added before mbs.Assemble(): a CoordinateConstraint between "
                    "coordinates of nodes, or a CoordinateVectorConstraint with its equation and "
                    "Jacobian as user functions, as docs/skeletons.md shows; track what is followed"
                )
            if loops is not None:
                raise ParameterError(
                    "loops= are those of a kinematic tree; of any other system they are joints "
                    "or constraints of the mbs"
                )
            self.skeleton = GeneralSkeleton(mbs, tree)
        else:
            self.skeleton = Skeleton(mbs, tree, coordinates, dependent, loops)
        skeleton = self.skeleton
        self.muscles = MuscleSet(muscles)
        self.paths = collect_paths(
            self.muscles.names,
            [muscle.path for muscle in self.muscles],
            [muscle.wraps for muscle in self.muscles],
            skeleton.frame_number,
            skeleton.tree_coordinates,
        )
        self.dependent_coordinates = tuple(dependent)
        self.loops = loops
        self.reserves = tuple(reserves)
        for name in set(actuator_names(reserves)) & set(self.muscles.names):
            raise ParameterError(f"reserves: '{name}' is the name of a muscle")
        actuators = actuator_table(self.reserves, skeleton.tree_coordinates, skeleton.frame_number)
        mounted = skeleton.mount(self.paths, self.muscles.names, actuators)
        self.geometry, self.columns, self.torques, self.loads = mounted
        for i, name in enumerate(self.muscles.names):
            if not self.paths.crosses_a_joint(i):
                warn(
                    f"muscle '{name}' crosses no coordinate: all its path points are on one link",
                    PathWarning,
                )

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        """Raise ModelError: Exudyn's systems exist in their process alone."""
        raise ModelError(
            "a MusculoskeletalModel holds an Exudyn system, which cannot be pickled or copied: "
            "hand over what builds it, such as exudyn_muscles.studies.Builder(function), or "
            "studies.SystemDescription.of(model, motion)"
        )

    def replace(
        self,
        muscles: Iterable[Muscle] | None = None,
        reserves: Sequence[Actuator] | None = None,
    ) -> MusculoskeletalModel:
        """A `MusculoskeletalModel` on the same skeleton with other muscles or ideal actuators; what
        is left out stays.

        Parameters
        ----------
        muscles, reserves
            As of a new model.

        Raises
        ------
        ParameterError
            As of a new model.
        """
        tree, skeleton = isinstance(self.skeleton, Skeleton), self.skeleton
        return MusculoskeletalModel(
            self.mbs,
            self._tree,
            self.muscles if muscles is None else muscles,
            coordinates=skeleton.tree_coordinates if tree else None,
            dependent_coordinates=self.dependent_coordinates,
            loops=self.loops,
            reserves=self.reserves if reserves is None else reserves,
        )

    @property
    def mbs(self) -> exu.MainSystem:
        """The user's Exudyn system."""
        return self.skeleton.mbs

    @property
    def followers(self) -> tuple[DependentCoordinate, ...]:
        """Former name of `dependent_coordinates`."""
        warn("model.followers is now model.dependent_coordinates", DeprecationWarning)
        return self.dependent_coordinates

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the n independent coordinates, the only ones that the methods know."""
        return self.skeleton.coordinates

    def state_of_tree(self, *state: np.ndarray) -> tuple[np.ndarray, ...]:
        """Values of all N coordinates of the tree, as
        `skeleton.tree_coordinates` names them.

        Parameters
        ----------
        *state : (n,) or (k, n) array_like
            Coordinates, and if wanted also their speeds, and accelerations.

        Returns
        -------
        tuple of (N,) or (k, N) ndarray
            As many.
        """
        return self.skeleton.state_of_tree(*state)

    def tendon_forces(self, geometry: Geometry, a: np.ndarray, l_t: np.ndarray) -> np.ndarray:
        """Tendon forces (m,) [N] of muscles in the state a, l_t (m,); slack tendons do not push."""
        F = np.empty(a.size)
        tendon_forces(self.muscles.tables, a, l_t, geometry.length, geometry.lengthening_speed, F)
        return F

    def torque(
        self, geometry: Geometry, a: np.ndarray, l_t: np.ndarray, reserve: np.ndarray
    ) -> np.ndarray:
        """Torques (n,) of muscles in the state a, l_t (m,) and of reserves (r,)."""
        return geometry.torque(self.tendon_forces(geometry, a, l_t), reserve)

    def load(
        self, geometry: Geometry, a: np.ndarray, l_t: np.ndarray, reserve: np.ndarray
    ) -> np.ndarray:
        """What `torque` is for Exudyn."""
        forces = np.append(self.tendon_forces(geometry, a, l_t), reserve)
        return geometry.load(forces, self.torque(geometry, a, l_t, reserve))

    def check_lengths(self, q: np.ndarray) -> None:
        """Check that the muscles fit their paths at the coordinates `q` (k, n) of a motion.

        Raises
        ------
        ParameterError
            A tendon is slack throughout, or a fibre stretched far beyond use; names the muscle, the
            parameter and its limit.

        Warns
        -----
        PassiveForceWarning
            A muscle at its minimum activation pulls with more than F0 where it is longest.
        """
        lengths = self.lengths_along(q).max(axis=0)
        for muscle, longest, taut in zip(
            self.muscles, lengths, self.muscles.shortest_taut_length, strict=True
        ):
            if longest >= taut:
                continue
            reached = f"the musculotendon path reaches at most {longest:.4g} m in this motion"
            fiber = taut - muscle.tendon_slack_length
            if longest > fiber:
                raise ParameterError(
                    f"muscle '{muscle.name}': tendon_slack_length = "
                    f"{muscle.tendon_slack_length:g} m is too long, {reached}; allowed is up to "
                    f"{longest - fiber:.4g} m"
                )
            raise ParameterError(
                f"muscle '{muscle.name}': optimal_fiber_length = {muscle.optimal_fiber_length:g} m "
                f"is too long, {reached}, less than the shortest fiber of {fiber:.4g} m"
            )
        self.check_stretch(lengths)
        self._warn_of_passive_forces(lengths)

    def _warn_of_passive_forces(self, lengths: np.ndarray) -> None:
        """Warn of muscles that bear more than F0 at these lengths (m,), as good as inactive."""
        muscles = self.muscles
        F = equilibrium(muscles, muscles.minimum_activation, lengths).force
        strong = np.flatnonzero(muscles.max_isometric_force < F)
        if strong.size:
            named = [
                f"{muscles.names[i]} {F[i]:.4g} N, {F[i] / muscles.max_isometric_force[i]:.3g} "
                f"times its max_isometric_force, on a path of {lengths[i]:.4g} m"
                for i in strong
            ]
            warn(
                f"muscles that pull with more than they are strong, in this motion and without "
                f"excitation: {'; '.join(named)}. Their optimal_fiber_length or "
                "tendon_slack_length may be too short, or exudyn_muscles.operators help",
                PassiveForceWarning,
            )

    def check_stretch(self, lengths: np.ndarray) -> None:
        """Check that no fibre is stretched far beyond use by musculotendon lengths (m,) [m].

        Raises
        ------
        ParameterError
            Names the muscle, its parameters and the limit.
        """
        for muscle, longest in zip(self.muscles, lengths, strict=True):
            stretch = (longest - muscle.tendon_slack_length) / muscle.optimal_fiber_length
            if stretch > LONGEST_FIBER:
                raise ParameterError(
                    f"muscle '{muscle.name}': optimal_fiber_length = "
                    f"{muscle.optimal_fiber_length:g} m (or tendon_slack_length = "
                    f"{muscle.tendon_slack_length:g} m) is too short: the path of {longest:.4g} m "
                    f"stretches the fiber to {stretch:.3g} optimal lengths, allowed is up to "
                    f"{LONGEST_FIBER:g}"
                )

    def lengths_along(self, q: np.ndarray) -> np.ndarray:
        """Lengths (k, m) [m] of the paths at the coordinates `q` (k, n) of a motion."""
        length = self.geometry if self.loads is None else self.loads
        return np.array([length(*at)[0] for at in self.skeleton.along(q)])


def _listed(name: str, items: Iterable, *kinds: type) -> list:
    """The items as a list, all of these kinds."""
    try:
        listed = list(items)
    except TypeError:
        listed = [items]
        kind_found = False
    else:
        kind_found = all(isinstance(item, kinds) for item in listed)
    if not kind_found:
        what = " or ".join(kind.__name__ for kind in kinds)
        raise ParameterError(f"{name} must be a list of {what} objects, got {items!r}")
    return listed
