"""Small systems of bodies and joints with muscles, some with something passive."""

from __future__ import annotations

import exudyn as exu
import numpy as np
from exudyn.utilities import (
    Cable2D,
    Force,
    GenericJoint,
    InertiaCuboid,
    MarkerBodyRigid,
    MarkerNodePosition,
    NodePoint2DSlope1,
)

import exudyn_muscles as em

SIZE = {"max_isometric_force": 1500.0, "optimal_fiber_length": 0.12, "tendon_slack_length": 0.1}
GRAVITY = [0.0, -9.81, 0.0]
MOTION = em.Motion.from_waypoints([0.0, 0.5, 1.0], [[0.0], [0.6], [0.2]])
LENGTH = 0.4


class Arm:
    """A forearm on a hinge at the origin, along x, its two muscles from ground."""

    def __init__(self, add=lambda arm: None, node_type=exu.NodeType.RotationEulerParameters):
        self.mbs = mbs = exu.SystemContainer().AddSystem()
        self.ground = mbs.CreateGround()
        self.forearm = self.link("forearm", 0.0, LENGTH, 3.0, node_type)
        self.elbow = self.hinge("elbow", self.ground, self.forearm, 0.0)
        add(self)
        mbs.Assemble()

    def link(self, name, start, length, mass, node_type=exu.NodeType.RotationEulerParameters):
        return self.mbs.CreateRigidBody(
            name=name,
            inertia=InertiaCuboid(mass / (length * 0.0064), [length, 0.08, 0.08]),
            referencePosition=[start + length / 2, 0.0, 0.0],
            gravity=GRAVITY,
            nodeType=node_type,
        )

    def hinge(self, name, first, second, place):
        return self.mbs.CreateRevoluteJoint(
            name=name, itemNumbers=[first, second], position=[place, 0, 0], axis=[0, 0, 1]
        )

    def muscles(self):
        return [
            em.Muscle(
                name,
                path=[
                    em.PathPoint([-0.2, side * 0.05, 0.0], link=self.ground),
                    em.PathPoint([-0.12, side * 0.03, 0.0], link=self.forearm),
                ],
                **SIZE,
            )
            for name, side in (("flexor", 1.0), ("extensor", -1.0))
        ]

    def model(self, tracked=None, reserve=5.0):
        tracked = {"elbow": self.elbow} if tracked is None else tracked
        reserves = [em.Reserve(name, reserve) for name in tracked] if reserve else []
        return em.MusculoskeletalModel(self.mbs, tracked, self.muscles(), reserves=reserves)


def wobbling_mass(arm, damping=10.0):
    """A mass on springs, as of soft tissue."""
    mass = arm.mbs.CreateMassPoint(
        name="wobble", referencePosition=[0.3, 0, 0], mass=1.0, gravity=GRAVITY
    )
    arm.mbs.CreateCartesianSpringDamper(
        itemNumbers=[arm.forearm, mass], localPosition0=[0.1, 0, 0], localPosition1=[0, 0, 0],
        stiffness=[2000.0] * 3, damping=[damping] * 3,
    )  # fmt: skip


def spring_hand(arm):
    """A hand on a hinge with a spring, as of a prosthesis."""
    hand = arm.link("hand", LENGTH, 0.2, 1.0)
    arm.wrist = arm.hinge("wrist", arm.forearm, hand, LENGTH)
    arm.mbs.CreateTorsionalSpringDamper(
        itemNumbers=[arm.forearm, hand], position=[LENGTH, 0, 0], axis=[0, 0, 1],
        stiffness=20.0, damping=0.2,
    )  # fmt: skip


def cable(arm):
    """An ANCF cable fixed to the forearm's end."""
    mbs = arm.mbs
    nodes = [
        mbs.AddNode(NodePoint2DSlope1(referenceCoordinates=[x, 0, 1, 0]))
        for x in (LENGTH, 2.0 * LENGTH)
    ]
    beam = mbs.AddObject(
        Cable2D(
            nodeNumbers=nodes, length=LENGTH, massPerLength=0.5, bendingStiffness=2.0,
            axialStiffness=5e3,
        )
    )  # fmt: skip
    for node in nodes:
        marker = mbs.AddMarker(MarkerNodePosition(nodeNumber=node))
        mbs.AddLoad(Force(markerNumber=marker, loadVector=[0.0, -9.81 * 0.5 * LENGTH / 2, 0.0]))
    ends = [
        mbs.AddMarker(MarkerBodyRigid(bodyNumber=arm.forearm, localPosition=[LENGTH / 2, 0, 0])),
        mbs.AddMarker(MarkerBodyRigid(bodyNumber=beam, localPosition=[0, 0, 0])),
    ]
    mbs.AddObject(GenericJoint(markerNumbers=ends, constrainedAxes=[1, 1, 0, 0, 0, 1]))


PASSIVE = {"nothing": lambda arm: None, "wobbling mass": wobbling_mass, "spring hand": spring_hand,
           "cable": cable}  # fmt: skip


def exudyns_accelerations(model, load):
    """x'' at the current state as Exudyn computes it itself under a load on x."""
    mbs, data = model.mbs, model.mbs.systemData
    state = model.skeleton.now.state
    x, v = state.q.copy(), state.v.copy()
    initial = exu.ConfigurationType.Initial
    data.SetODE2Coordinates(x, configuration=initial)
    data.SetODE2Coordinates_t(v, configuration=initial)
    found = []

    def look(mbs, t):
        if not found:
            found.append(np.array(data.GetODE2Coordinates_tt()))
        return True

    model.skeleton.apply(load)
    mbs.SetPostStepUserFunction(look)
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = 1e-9
    settings.timeIntegration.numberOfSteps = 1
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = True
    settings.solution.file.write = False
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    mbs.SetPostStepUserFunction(0)
    return found[0]


def sized(paths, sizes):
    """Strong muscles on these paths, with sizes as of `sizes_along`."""
    return [
        em.Muscle(
            f"m{i}", path=path, max_isometric_force=2000.0, optimal_fiber_length=fiber,
            tendon_slack_length=tendon,
        )
        for i, (path, (fiber, tendon)) in enumerate(zip(paths, sizes, strict=True))
    ]  # fmt: skip


def sizes_along(model, motion):
    """Optimal fibre and tendon slack lengths (m, 2) that suit the paths in a motion."""
    poses = motion(np.linspace(motion.start, motion.end, 11))[0]
    rest = np.zeros(len(model.coordinates))
    lengths = np.array([model.geometry(q, rest).length for q in poses])
    return np.column_stack([0.5 * lengths.max(axis=0), 0.4 * lengths.min(axis=0)])
