"""The shortest useful program: a forearm, two muscles, a motion, and the excitations behind it."""

import exudyn as exu
import numpy as np
from exudyn.utilities import InertiaCylinder, TreeLink

import exudyn_muscles as em

mbs = exu.SystemContainer().AddSystem()
forearm = InertiaCylinder(density=1100, length=0.26, outerRadius=0.04, axis=1)
link = TreeLink(
    jointType=exu.JointType.RevoluteZ,  # the elbow, at the origin; 0 hangs down
    jointHT=np.eye(4),
    linkInertia=forearm.Translated([0, -0.13, 0]),
)
tree = mbs.CreateKinematicTree(listOfTreeLinks=[link], gravity=[0, -9.81, 0])
mbs.Assemble()

size = {"max_isometric_force": 1000, "optimal_fiber_length": 0.12, "tendon_slack_length": 0.19}
front = [em.PathPoint([0.02, 0.3, 0]), em.PathPoint([0.01, -0.04, 0], link=0)]
back = [em.PathPoint([-0.03, 0.3, 0]), em.PathPoint([-0.03, 0.01, 0], link=0)]
muscles = [em.Muscle("flexor", **size, path=front), em.Muscle("extensor", **size, path=back)]
model = em.MusculoskeletalModel(mbs, tree, muscles, coordinates=["elbow"])
motion = em.Motion.from_waypoints([0, 0.4, 0.8], np.radians([20, 90, 40]))

result = em.cosimulate(model, motion)
print("largest excitations:", result.muscle_names, result.excitation_values.max(axis=0).round(3))
print("tracking error (RMS):", np.degrees(result.tracking_error_rms()).round(4), "deg")
