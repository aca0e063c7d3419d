"""A planar arm in the sagittal plane: shoulder and elbow, six muscles, two of them biarticular.

x forward, y up, origin at the shoulder; both angles are zero with the arm hanging straight and
count positive in flexion.

Sources
-------
Segments: fractions of body mass and height of Dempster's data in D. A. Winter, "Biomechanics and
Motor Control of Human Movement" (4th ed., 2009, table 4.1), for 75 kg and 1.80 m; forearm and hand
are one segment.

Muscle strength and lengths: E. J. Nijhof, E. Kouwenhoven, "Simulation of multijoint arm movements",
in J. M. Winters, P. E. Crago (eds.), "Biomechanics and Neural Control of Posture and Movement",
Springer 2000, 363-372, as tabulated in MotorNet's lumped-muscle arm. 10 optimal fibre lengths/s:
OpenSim.

Paths: this project's own. The points next to a joint were fitted to the moment arms of Nijhof and
Kouwenhoven (30 mm at the shoulder; 14 to 42 mm at the elbow, growing with flexion) over shoulder 0
to 90 deg and elbow 10 to 120 deg; the others set the length such that the published tendon slack
lengths fit. Straight lines lose about half of those arms at the ends of the range of motion.

Motion: this project's own reaching movement of 1 s.
"""

import exudyn as exu
import numpy as np
from exudyn.utilities import HTtranslate, RigidBodyInertia, TreeLink

import exudyn_muscles as em

BODY_MASS, HEIGHT = 75.0, 1.80  # kg, m

UPPER_ARM = 0
FOREARM = 1

# Winter (2009), table 4.1: mass over body mass, length over height, centre of mass and radius of
# gyration about it over length.
UPPER_ARM_MASS = 0.028 * BODY_MASS  # 2.10 kg
UPPER_ARM_LENGTH = 0.186 * HEIGHT  # 0.335 m
UPPER_ARM_COM = 0.436 * UPPER_ARM_LENGTH
UPPER_ARM_INERTIA = UPPER_ARM_MASS * (0.322 * UPPER_ARM_LENGTH) ** 2
FOREARM_MASS = 0.022 * BODY_MASS  # 1.65 kg, forearm and hand
FOREARM_LENGTH = 0.146 * HEIGHT  # 0.263 m, elbow to wrist
FOREARM_COM = 0.682 * FOREARM_LENGTH
FOREARM_INERTIA = FOREARM_MASS * (0.468 * FOREARM_LENGTH) ** 2

# Name: F0 [N], optimal fibre length [m], tendon slack length [m], path (link or None, x, y) [m].
MUSCLES = {
    "shoulder_flexor": (
        838.0, 0.134, 0.039,
        [(None, -0.018, 0.032), (None, 0.026, 0.022), (0, 0.016, -0.081), (0, 0.010, -0.130)],
    ),
    "shoulder_extensor": (
        1207.0, 0.140, 0.066,
        [(None, -0.092, -0.012), (None, -0.026, -0.022), (0, -0.020, -0.135)],
    ),
    "elbow_flexor": (
        1422.0, 0.092, 0.172,
        [(0, 0.008, -0.098), (0, 0.012, -0.294), (1, 0.005, -0.029), (1, 0.010, -0.050)],
    ),
    "elbow_extensor": (
        1549.0, 0.093, 0.187,
        [(0, -0.012, -0.062), (0, -0.018, -0.303), (1, -0.017, 0.018)],
    ),
    "biarticular_flexor": (
        414.0, 0.137, 0.204,
        [(None, 0.027, 0.021), (0, 0.013, -0.082), (0, 0.015, -0.289), (1, 0.006, -0.038)],
    ),
    "biarticular_extensor": (
        603.0, 0.127, 0.217,
        [(None, -0.026, -0.022), (0, -0.022, -0.105), (0, -0.029, -0.309), (1, -0.025, 0.012)],
    ),
}  # fmt: skip


def build() -> em.MusculoskeletalModel:
    """The model: coordinates shoulder and elbow, gravity on."""
    SC = exu.SystemContainer()
    mbs = SC.AddSystem()
    links = [
        _segment(-1, 0.0, UPPER_ARM_MASS, UPPER_ARM_COM, UPPER_ARM_INERTIA),
        _segment(UPPER_ARM, UPPER_ARM_LENGTH, FOREARM_MASS, FOREARM_COM, FOREARM_INERTIA),
    ]
    tree = mbs.CreateKinematicTree(listOfTreeLinks=links, gravity=[0.0, -9.81, 0.0])
    mbs.Assemble()
    muscles = [
        em.Muscle(
            name,
            max_isometric_force=strength,
            optimal_fiber_length=fiber,
            tendon_slack_length=tendon,
            max_contraction_velocity=10.0,
            path=[
                em.PathPoint([x, y, 0.0]) if link is None else em.PathPoint([x, y, 0.0], link=link)
                for link, x, y in path
            ],
        )
        for name, (strength, fiber, tendon, path) in MUSCLES.items()
    ]
    return em.MusculoskeletalModel(mbs, tree, muscles, coordinates=["shoulder", "elbow"])


def motion() -> em.Motion:
    """Reaching forward and up: shoulder 10 to 60 deg, elbow 25 over 70 to 50 deg, in 1 s."""
    return em.Motion.from_waypoints(
        [0.0, 0.5, 1.0], np.radians([[10.0, 25.0], [35.0, 70.0], [60.0, 50.0]])
    )


def _segment(parent: int, down: float, mass: float, com: float, inertia: float) -> TreeLink:
    """A segment that hangs from its parent's joint at `down` below the parent's origin."""
    return TreeLink(
        jointType=exu.JointType.RevoluteZ,
        parent=parent,
        jointHT=HTtranslate([0.0, -down, 0.0]),
        linkInertia=RigidBodyInertia(
            mass=mass, inertiaTensor=np.diag([inertia, 0.0, inertia]), com=[0.0, 0.0, 0.0]
        ).Translated([0.0, -com, 0.0]),
    )
