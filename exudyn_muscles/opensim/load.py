"""From a model file to an Exudyn system with muscles."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import exudyn as exu
import numpy as np
from exudyn.utilities import RigidBodyInertia, TreeLink

from ..errors import ParameterError
from ..forces.actuators import Reserve
from ..forces.external import ExternalForce
from ..model import MusculoskeletalModel
from ..skeleton.base import ExudynSkeleton
from ..skeleton.closed import Closed
from ..skeleton.closures import Loops
from ..skeleton.coupling import DependentCoordinate
from ..skeleton.dependent import Dependent
from ..skeleton.external_forces import add_external_force
from ..skeleton.passive import PassiveForce, add_passive_forces
from ..skeleton.reading import JOINTS
from ..skeleton.skeleton import Skeleton
from .actuators import ACTUATORS, read_actuator
from .bodies import Bodies, Link
from .closures import read_closures
from .components import named_apart, refuse_active, warn_of_controllers
from .document import read_document
from .element import Element
from .external_loads import read_external_loads
from .joints import Coordinate
from .muscles import CLASSES, read_muscle
from .muscles import REFUSED as REFUSED_MUSCLES
from .passive_forces import PASSIVE, read_passive_force

TYPES = {number: joint for joint, number in JOINTS.items()}
# What a model may hold, what of it does not matter, and what has to be empty or switched off.
READ = (
    "Ground", "gravity", "BodySet", "JointSet", "ConstraintSet", "ForceSet", "ControllerSet",
    "ComponentSet", "components", "FrameSet",
)  # fmt: skip
HARMLESS = (
    "credits", "publications", "length_units", "force_units", "assembly_accuracy", "MarkerSet",
    "ContactGeometrySet", "ProbeSet", "ModelVisualPreferences", "notes", "ground",
    "coordinatesInMultibodyTreeOrder",
)  # fmt: skip


# Optimal force [N or N m] of what moves a coordinate without a task, or a prescribed one: a body's
# weight costs 5e-5 of what a muscle at its full force does.
FREELY = 1e5

# What of a model may be among its further components, too.
FORCES = {*CLASSES, *PASSIVE, *ACTUATORS}


class Content(NamedTuple):
    """A model, with all `coordinates` of its file and the names of `idle` forces: those that are
    switched off or act on what cannot move."""

    model: MusculoskeletalModel
    coordinates: tuple[Coordinate, ...]
    idle: frozenset[str]


def load_model(
    file: str | Path,
    *,
    force_sets: Sequence[str | Path] = (),
    external_loads: str | Path | None = None,
) -> MusculoskeletalModel:
    """The musculoskeletal model of an `.osim` file, on a new Exudyn system.

    Bodies behind a weld join its parent's link, a joint with several coordinates becomes as many
    links. Axes that are functions of a coordinate, and coordinates coupled to others, become
    dependent ones. Coordinates have the file's names and OpenSim's values; a locked one is no
    coordinate but keeps its default value. The file's default pose is the system's initial state,
    in which dependent coordinates are where they belong. Coordinate, point and torque actuators
    become ideal ones; those on what cannot move, a locked coordinate or ground, do nothing in
    OpenSim and are left out. There may be no muscle. What OpenSim does not know is ignored.

    Parameters
    ----------
    file : str or Path
    force_sets : sequence of str or Path
        Files with more forces, as a `ForceSet` or `ActuatorSet`: reserves and residuals.
    external_loads : str or Path, optional
        File with `ExternalLoads`, whose forces become loads of the Exudyn system and with them part
        of Q. A point given in ground is applied where the body is, as in OpenSim 4: an
        `external_loads_model_kinematics_file` is ignored.

    Returns
    -------
    MusculoskeletalModel

    Raises
    ------
    ModelFileError
        A file is damaged, or holds what cannot be represented: names it and its place. Only what is
        to be looked at, markers, probes, contact geometry and what is switched off are left out.
    StorageError
        The external loads' data file is damaged.
    FileNotFoundError
    ParameterError
        `force_sets` is one file in place of a sequence.

    Warns
    -----
    ModelFileWarning
        Something is left out, or taken for something else than it says, of which the file's author
        may have expected more.
    """
    return read_model(file, force_sets, external_loads).model


def read_model(
    file: str | Path,
    force_sets: Sequence[str | Path] = (),
    external_loads: str | Path | None = None,
    *,
    tracked: Collection[str] | None = None,
    only_sets: bool = False,
    excluded: Collection[str] = (),
    inverse: bool = False,
) -> Content:
    """What `load_model` loads, with what it leaves out; it raises the same errors.

    Parameters
    ----------
    tracked : collection of str, optional
        The coordinates that have tasks: others get an ideal actuator that costs next to nothing.
    only_sets : bool
        The model's own forces are left out.
    excluded : collection of str
        Names of ideal actuators that are left out.
    inverse : bool
        Muscles are left out, and every coordinate gets an ideal actuator of 1 N m or 1 N.
    """
    model = read_document(file)
    model.allow(*READ, *HARMLESS)
    beside = [*model.items("components"), *model.items("ComponentSet")]
    geometries = (each for each in beside if each.tag.startswith("Contact"))
    surfaces: dict[str, Element] = {}
    for each in (*model.items("ContactGeometrySet"), *geometries):
        if surfaces.setdefault(each.name, each) is not each:
            each.warn("this name is taken, and the first one counts, as in OpenSim")
    refuse_active(each for each in beside if each.tag not in FORCES and each.name not in surfaces)
    bodies = Bodies(model)
    if not bodies.links:
        raise model.error("it has no coordinates")
    warn_of_controllers(model)
    muscles, reserves, passive, idle = [], [], [], set()
    if isinstance(force_sets, (str, Path)):
        raise ParameterError(f"force_sets is a sequence of files, got {str(force_sets)!r} alone")
    more = [read_document(each, "ForceSet").members() for each in force_sets]
    forces_beside = [each for each in beside if each.tag in FORCES]
    own = [] if only_sets else [*model.items("ForceSet"), *forces_beside]
    for force in named_apart([*own, *chain.from_iterable(more)]):
        if not force.is_on or (inverse and force.tag in {*CLASSES, *REFUSED_MUSCLES}):
            idle.add(force.name)
        elif force.tag in CLASSES:
            muscles.append(read_muscle(force, bodies))
        elif force.tag in REFUSED_MUSCLES:
            raise force.error(REFUSED_MUSCLES[force.tag])
        elif force.tag in PASSIVE:
            passive += read_passive_force(force, bodies, surfaces)
        elif force.tag in ACTUATORS:
            actuator = read_actuator(force, bodies)
            if actuator is None or force.name in excluded:
                idle.add(force.name)
            else:
                reserves.append(actuator)
        else:
            force.refuse()
    gravity = model.vector("gravity", default=(0.0, -9.80665, 0.0))
    forces = [] if external_loads is None else read_external_loads(external_loads, bodies)
    names = [link.name for link in bodies.links]
    dependent = [link.follows for link in bodies.links if link.follows is not None]
    closures = read_closures(model, bodies)
    loops = Loops(closures, _held_first(bodies.links, tracked or ())) if closures else None
    with model.blamed():
        mbs, tree = _build(bodies.links, dependent, gravity, forces, passive)
        free = Skeleton(mbs, tree, names, dependent, loops).coordinates
        if inverse:
            reserves += [Reserve(name, 1.0, name=f"{name}_actuator") for name in free]
        reserves += [
            Reserve(link.name, FREELY, name=f"{link.name}_held")
            for link in bodies.links
            if link.name in free and _is_held(link, tracked)
        ]
        built = MusculoskeletalModel(
            mbs,
            tree,
            muscles,
            coordinates=names,
            dependent_coordinates=dependent,
            reserves=reserves,
            loops=loops,
        )
        if loops is not None:
            _close(built.skeleton)
    return Content(built, tuple(bodies.coordinates), frozenset(idle))


def read_coordinates(file: str | Path) -> tuple[Coordinate, ...]:
    """What an `.osim` file says about its coordinates, with ranges and locked ones.

    Parameters
    ----------
    file : str or Path

    Returns
    -------
    tuple of Coordinate

    Raises
    ------
    ModelFileError
        As `load_model`.
    """
    return tuple(Bodies(read_document(file)).coordinates)


def _is_held(link: Link, tracked: Collection[str] | None) -> bool:
    """Whether an ideal actuator moves an independent coordinate, whatever it takes."""
    untracked = tracked is not None and link.name not in tracked
    return untracked or link.coordinate.prescribed is not None


def _close(skeleton: ExudynSkeleton) -> None:
    """Begin in the pose that is next to the file's and in which all loops are closed."""
    assert isinstance(skeleton, Skeleton) and isinstance(skeleton.basis, Closed)
    skeleton.set_initial_state(skeleton.basis.pose, skeleton.initial_state()[1])


def _held_first(links: list[Link], tracked: Collection[str]) -> list[str]:
    """Independent coordinates in the order in which constraints may hold them: the last of those
    first that OpenSim lets follow them, and those last that have tasks or are prescribed."""

    def rank(link: Link) -> int:
        if link.name in tracked or link.coordinate.prescribed is not None:
            return 2
        return 0 if link.coordinate.follows_constraints else 1

    own = [link for link in links[::-1] if link.follows is None]
    return [link.name for link in sorted(own, key=rank)]


def _start(
    links: list[Link], dependent: list[DependentCoordinate]
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and speeds of all links in the file's default pose."""
    values = np.array([link.coordinate.default_value for link in links])
    speeds = np.array([link.coordinate.default_speed for link in links])
    if dependent:
        basis = Dependent(dependent, [link.name for link in links])
        values, speeds = basis.state_of_tree(basis.part(values), basis.part(speeds))
    return values, speeds


def _build(
    links: list[Link],
    dependent: list[DependentCoordinate],
    gravity: np.ndarray,
    forces: list[ExternalForce],
    passive: list[PassiveForce],
) -> tuple[exu.MainSystem, int]:
    """The assembled system and its tree."""
    q, v = _start(links, dependent)
    SC = exu.SystemContainer()
    mbs = SC.AddSystem()
    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=[
            TreeLink(
                jointType=TYPES[link.joint],
                parent=link.parent,
                jointHT=link.frame,
                linkInertia=_inertia(link),
            )
            for link in links
        ],
        initialCoordinates=q,
        initialCoordinates_t=v,
        gravity=gravity,
    )
    for force in forces:
        add_external_force(mbs, tree, force)
    add_passive_forces(mbs, tree, passive, [link.name for link in links])
    mbs.Assemble()
    return mbs, tree


def _inertia(link: Link) -> RigidBodyInertia:
    mass, moment, tensor = link.inertia.mass, link.inertia.moment, link.inertia.tensor
    center = moment / mass if mass > 0.0 else np.zeros(3)
    return RigidBodyInertia(mass=mass, inertiaTensor=tensor, com=center)
