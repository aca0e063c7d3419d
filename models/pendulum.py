"""The paper's inverted pendulum with two muscles.

The paper's figure 5 with its dimensions is not available: geometry and muscles are this project's
own choice, such that the excitations of the motion stay below 0.45. The motion is the paper's
Table 1.
"""

import exudyn as exu
import numpy as np
from exudyn.utilities import RigidBodyInertia, TreeLink

import exudyn_muscles as em

MASS = 1.0  # kg, point mass at the tip of a massless bar
LENGTH = 0.5  # m
INSERTION = 0.3  # m from the pivot
ORIGIN = 0.05  # m, both sides of the pivot


def build() -> em.MusculoskeletalModel:
    """The model: angle theta about z, 0 hanging down, positive counter-clockwise."""
    SC = exu.SystemContainer()
    mbs = SC.AddSystem()
    bar = TreeLink(
        jointType=exu.JointType.RevoluteZ,
        parent=-1,
        jointHT=np.eye(4),
        linkInertia=RigidBodyInertia(
            mass=MASS,
            inertiaTensor=np.diag([MASS * LENGTH**2, 0.0, MASS * LENGTH**2]),
            com=[0.0, -LENGTH, 0.0],
        ),
    )
    tree = mbs.CreateKinematicTree(listOfTreeLinks=[bar], gravity=[0.0, -9.81, 0.0])
    mbs.Assemble()

    def muscle(name: str, side: float) -> em.Muscle:
        return em.Muscle(
            name,
            max_isometric_force=3000.0,
            optimal_fiber_length=0.15,
            tendon_slack_length=0.16,
            pennation_angle_at_optimal=0.1,
            max_contraction_velocity=10.0,
            path=[
                em.PathPoint([side * ORIGIN, 0.0, 0.0]),
                em.PathPoint([0.0, -INSERTION, 0.0], link=0),
            ],
        )

    muscles = [muscle("left", -1.0), muscle("right", 1.0)]
    return em.MusculoskeletalModel(mbs, tree, muscles, coordinates=["theta"])


def motion() -> em.Motion:
    """Table 1 of the paper: 180, 120, 240, 180 deg at 0, 1/3, 2/3, 1 s, at rest at both ends."""
    return em.Motion.from_waypoints(
        [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0], np.radians([180.0, 120.0, 240.0, 180.0])
    )
