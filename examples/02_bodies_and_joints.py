"""A skeleton of rigid bodies and joints, as most Exudyn models are, with a part that nobody tracks.

An arm lifts its forearm, and a passive hand on a spring swings with it. What is tracked are the two
joints with a name; muscles are attached to bodies.
"""

import exudyn as exu
import numpy as np
from exudyn.utilities import InertiaCuboid, SensorBody

import exudyn_muscles as em

mbs = exu.SystemContainer().AddSystem()
ground = mbs.CreateGround()


def segment(name, top, length, mass):
    """A body that hangs down from a height."""
    return mbs.CreateRigidBody(
        name=name,
        inertia=InertiaCuboid(mass / (length * 0.0049), [0.07, length, 0.07]),
        referencePosition=[0, top - length / 2, 0],
        gravity=[0, -9.81, 0],
    )


def hinge(first, second, height):
    return mbs.CreateRevoluteJoint(
        itemNumbers=[first, second], position=[0, height, 0], axis=[0, 0, 1]
    )


upper_arm = segment("upper arm", 0.0, 0.3, 2.0)
forearm = segment("forearm", -0.3, 0.26, 1.2)
hand = segment("hand", -0.56, 0.18, 0.5)
shoulder, elbow = hinge(ground, upper_arm, 0.0), hinge(upper_arm, forearm, -0.3)
wrist = hinge(forearm, hand, -0.56)
mbs.CreateTorsionalSpringDamper(
    itemNumbers=[forearm, hand], position=[0, -0.56, 0], axis=[0, 0, 1], stiffness=4, damping=0.05
)
turned = mbs.AddSensor(
    SensorBody(
        bodyNumber=hand, outputVariableType=exu.OutputVariableType.Rotation, storeInternal=True
    )
)
mbs.Assemble()


def muscle(name, strength, fiber, tendon, first, last):
    """From one body to another; points are in the bodies' frames."""
    return em.Muscle(
        name,
        max_isometric_force=strength,
        optimal_fiber_length=fiber,
        tendon_slack_length=tendon,
        path=[em.PathPoint(place, link=body) for body, place in (first, last)],
    )


muscles = [
    muscle("deltoid", 1200, 0.11, 0.06, (ground, [0.06, 0.05, 0]), (upper_arm, [0.02, 0.03, 0])),
    muscle("dorsi", 1200, 0.14, 0.06, (ground, [-0.09, 0.03, 0]), (upper_arm, [-0.02, 0.0, 0])),
    muscle("flexor", 900, 0.14, 0.14, (upper_arm, [0.03, 0.13, 0]), (forearm, [0.02, 0.08, 0])),
    muscle("extensor", 900, 0.10, 0.16, (upper_arm, [-0.03, 0.1, 0]), (forearm, [-0.03, 0.145, 0])),
]
model = em.MusculoskeletalModel(mbs, {"shoulder": shoulder, "elbow": elbow}, muscles)
motion = em.Motion.from_waypoints([0, 0.5, 1.0], np.radians([[0, 20], [25, 80], [10, 40]]))

result = em.cosimulate(model, motion)
print("tracking error (RMS):", np.degrees(result.tracking_error_rms()).round(4), "deg")
print("largest excitations:", result.muscle_names, result.excitation_values.max(axis=0).round(3))

# The hand is where the dynamics took it.
swing = mbs.GetSensorStoredData(turned)[:, 3] - result.coordinates.sum(axis=1)
print(f"the hand swings by {np.degrees(np.ptp(swing)):.1f} deg against the forearm")
