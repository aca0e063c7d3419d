"""A leg that pedals, of rigid bodies and joints: a closed loop with one degree of freedom.

Thigh, shank with the foot, and crank in the plane; dimensions, masses and muscles are this
project's own choice of a grown man's size. Tracked is the crank's angle. The crank turns against a
brake; what the muscles do not do within a turn a weak reserve at the crank does.
"""

from collections.abc import Callable

import exudyn as exu
import numpy as np
from exudyn.utilities import GenericJoint, InertiaCuboid, MarkerBodyRigid, RotationMatrixZ

import exudyn_muscles as em

HIP, AXLE = np.array([0.0, 0.76, 0.0]), np.array([0.16, 0.12, 0.0])  # m
THIGH, SHANK, CRANK = 0.44, 0.48, 0.17  # m
MASSES = {"thigh": 7.2, "shank": 3.6, "crank": 1.2}  # kg
START = np.radians(35.0)  # of the crank above the horizontal
BRAKE = 1.0  # N m s/rad
REVOLUTION = 1.0  # s, from rest to full speed

# The biceps is its short head. Strength [N], optimal fibre length, tendon slack length [m], and
# points on ground or bodies, from the middle of each along it.
MUSCLES = {
    "iliopsoas": (2500.0, 0.10, 0.10, (None, [-0.06, 0.82, 0.0]), ("thigh", [-0.10, 0.03, 0.0])),
    "gluteus": (3000.0, 0.12, 0.08, (None, [-0.12, 0.75, 0.0]), ("thigh", [-0.10, -0.07, 0.0])),
    "vasti": (6000.0, 0.10, 0.225, ("thigh", [-0.05, 0.05, 0.0]), ("shank", [-0.19, 0.05, 0.0])),
    "biceps": (1200.0, 0.13, 0.07, ("thigh", [0.02, -0.03, 0.0]), ("shank", [-0.17, -0.04, 0.0])),
    "hamstrings": (3000.0, 0.11, 0.37, (None, [-0.09, 0.74, 0.0]), ("shank", [-0.18, -0.04, 0.0])),
}  # fmt: skip


def build(node_type=exu.NodeType.RotationEulerParameters) -> em.MusculoskeletalModel:
    """The model: coordinate crank [rad] from START, positive counter-clockwise."""
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    bodies = {}
    for name, start, angle, length in _pose():
        direction = np.array([np.cos(angle), np.sin(angle), 0.0])
        bodies[name] = mbs.CreateRigidBody(
            name=name,
            inertia=InertiaCuboid(MASSES[name] / (length * 0.0081), [length, 0.09, 0.09]),
            referencePosition=start + 0.5 * length * direction,
            referenceRotationMatrix=RotationMatrixZ(angle),
            nodeType=node_type,
            gravity=[0.0, -9.81, 0.0],
        )
    thigh, shank, crank = bodies.values()
    knee = _pose()[1][1]

    def hinge(name: str, first: exu.ObjectIndex, second: exu.ObjectIndex, place: np.ndarray):
        return mbs.CreateRevoluteJoint(
            name=name, itemNumbers=[first, second], position=place, axis=[0, 0, 1]
        )

    hinge("hip", ground, thigh, HIP)
    hinge("knee", thigh, shank, knee)
    axle = hinge("axle", ground, crank, AXLE)
    # The pedal closes the loop: of a plane mechanism two constraints are left.
    ends = [(shank, SHANK), (crank, CRANK)]
    markers = [
        mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=[length / 2, 0, 0]))
        for body, length in ends
    ]
    mbs.AddObject(
        GenericJoint(name="pedal", markerNumbers=markers, constrainedAxes=[1, 1, 0, 0, 0, 0])
    )
    mbs.CreateTorsionalSpringDamper(
        name="brake", itemNumbers=[ground, crank], position=AXLE, axis=[0, 0, 1], damping=BRAKE
    )
    mbs.Assemble()

    def point(body: str | None, place: list[float]) -> em.PathPoint:
        return em.PathPoint(place) if body is None else em.PathPoint(place, link=bodies[body])

    reserves = [em.Reserve("crank", optimal_force=10.0)]
    return em.MusculoskeletalModel(mbs, {"crank": axle}, muscles(point), reserves=reserves)


def muscles(point: Callable[[str | None, list[float]], em.PathPoint]) -> list[em.Muscle]:
    """All muscles, by the function of a body's name and a place on it that makes path points."""
    return [
        em.Muscle(
            name,
            max_isometric_force=strength,
            optimal_fiber_length=fiber,
            tendon_slack_length=tendon,
            max_contraction_velocity=10.0,
            path=[point(*first), point(*last)],
        )
        for name, (strength, fiber, tendon, first, last) in MUSCLES.items()
    ]


def motion() -> em.Motion:
    """One turn in 1 s, from rest."""
    t = np.linspace(0.0, REVOLUTION, 401)
    w = 2.0 * np.pi / REVOLUTION
    turn = w * (t - np.sin(np.pi * t / REVOLUTION) * REVOLUTION / np.pi)
    return em.Motion.from_samples(t, turn[:, None])


def _pose() -> list[tuple[str, np.ndarray, float, float]]:
    """Bodies where they start: name, start, angle about z and length."""
    pedal = AXLE + CRANK * np.array([np.cos(START), np.sin(START), 0.0])
    reach = pedal - HIP
    distance = np.linalg.norm(reach)
    bend = np.arccos((THIGH**2 + distance**2 - SHANK**2) / (2.0 * THIGH * distance))
    thigh = np.arctan2(reach[1], reach[0]) + bend
    knee = HIP + THIGH * np.array([np.cos(thigh), np.sin(thigh), 0.0])
    shank = np.arctan2(*(pedal - knee)[[1, 0]])
    return [
        ("thigh", HIP, thigh, THIGH), ("shank", knee, shank, SHANK), ("crank", AXLE, START, CRANK)
    ]  # fmt: skip
