"""Random kinematic trees in a real Exudyn system."""

import exudyn as exu
import numpy as np
from exudyn.utilities import HomogeneousTransformation, RigidBodyInertia, TreeLink
from scipy.spatial.transform import Rotation

from exudyn_muscles.path.paths import collect_paths

JOINTS = (
    exu.JointType.RevoluteX,
    exu.JointType.RevoluteY,
    exu.JointType.RevoluteZ,
    exu.JointType.PrismaticX,
    exu.JointType.PrismaticY,
    exu.JointType.PrismaticZ,
)


def paths_of(muscles, number_of_links, names=None):
    return collect_paths(
        [muscle.name for muscle in muscles],
        [muscle.path for muscle in muscles],
        [muscle.wraps for muscle in muscles],
        number_of_links,
        names,
    )


def random_inertia(rng):
    half = rng.uniform(-0.1, 0.1, (3, 3))
    return RigidBodyInertia(
        mass=rng.uniform(0.5, 3.0),
        inertiaTensor=half @ half.T + 0.02 * np.eye(3),
        com=rng.uniform(-0.2, 0.2, 3),
        inertiaTensorAtCOM=True,
    )


def random_links(rng, n, joints=None):
    """n links with mixed joints, branching; parents are links with a smaller number or ground."""
    return [
        TreeLink(
            jointType=JOINTS[rng.integers(6)] if joints is None else joints[i],
            parent=int(rng.integers(-1, i)) if i else -1,
            jointHT=HomogeneousTransformation(
                Rotation.random(random_state=rng).as_matrix(), rng.uniform(-0.5, 0.5, 3)
            ),
            linkInertia=random_inertia(rng),
        )
        for i in range(n)
    ]


def add_tree(mbs, rng, links, **more):
    """The links as an ObjectKinematicTree with base offset and reference coordinates."""
    n = len(links)
    return mbs.CreateKinematicTree(
        listOfTreeLinks=links,
        referenceCoordinates=rng.uniform(-1.0, 1.0, n),
        initialCoordinates=rng.uniform(-1.0, 1.0, n),
        initialCoordinates_t=rng.uniform(-2.0, 2.0, n),
        gravity=[0.3, -9.81, 0.5],
        baseOffset=rng.uniform(-1.0, 1.0, 3),
        **more,
    )
