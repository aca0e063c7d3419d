"""The plugin in a hand-written Exudyn script, with a spring and a sensor of the script's own.

The muscles hold an arm against gravity and a spring between the hand and a wall while it moves; the
script keeps its own settings, its own call of `mbs.SolveDynamic` and its own sensors. A user sensor
stores the muscle forces next to them.
"""

import exudyn as exu
import numpy as np
from exudyn.utilities import (
    HTtranslate,
    InertiaCylinder,
    MarkerBodyPosition,
    MarkerKinematicTreeRigid,
    ObjectConnectorSpringDamper,
    ObjectGround,
    SensorKinematicTree,
    SensorUserFunction,
    TreeLink,
)

import exudyn_muscles as em

SC = exu.SystemContainer()
mbs = SC.AddSystem()

# The skeleton: upper arm and forearm, angles about z, hanging down at zero.
upper = InertiaCylinder(density=1100, length=0.32, outerRadius=0.05, axis=1)
lower = InertiaCylinder(density=1100, length=0.26, outerRadius=0.04, axis=1)
tree = mbs.CreateKinematicTree(
    listOfTreeLinks=[
        TreeLink(
            jointType=exu.JointType.RevoluteZ,
            parent=-1,
            jointHT=np.eye(4),
            linkInertia=upper.Translated([0, -0.16, 0]),
        ),
        TreeLink(
            jointType=exu.JointType.RevoluteZ,
            parent=0,
            jointHT=HTtranslate([0, -0.32, 0]),
            linkInertia=lower.Translated([0, -0.13, 0]),
        ),
    ],
    gravity=[0, -9.81, 0],
    initialCoordinates=np.radians([10.0, 30.0]),
)

# The script's own items: a spring from the hand to a wall, and a sensor at the hand.
wall = mbs.AddObject(ObjectGround(referencePosition=[-0.5, -0.4, 0]))
hand = mbs.AddMarker(
    MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=1, localPosition=[0, -0.26, 0])
)
anchor = mbs.AddMarker(MarkerBodyPosition(bodyNumber=wall))
mbs.AddObject(
    ObjectConnectorSpringDamper(
        markerNumbers=[anchor, hand], referenceLength=0.5, stiffness=40.0, damping=2.0
    )
)
hand_position = mbs.AddSensor(
    SensorKinematicTree(
        objectNumber=tree,
        linkNumber=1,
        localPosition=[0, -0.26, 0],
        outputVariableType=exu.OutputVariableType.Position,
        storeInternal=True,
    )
)


def stored_forces(mbs, t, sensor_numbers, factors, configuration):
    """The committed tendon forces, which the sensor stores."""
    return list(plugin.tendon_forces)


muscle_forces = mbs.AddSensor(
    SensorUserFunction(
        sensorNumbers=[], factors=[], sensorUserFunction=stored_forces, storeInternal=True
    )
)
mbs.Assemble()


# The muscles.
def muscle(name, strength, fiber, tendon, *path):
    return em.Muscle(
        name,
        max_isometric_force=strength,
        optimal_fiber_length=fiber,
        tendon_slack_length=tendon,
        path=path,
    )


P = em.PathPoint
model = em.MusculoskeletalModel(
    mbs,
    tree,
    [
        muscle("deltoid", 1100, 0.13, 0.05, P([0.05, 0.03, 0]), P([0.02, -0.14, 0], 0)),
        muscle("latissimus", 1200, 0.14, 0.05, P([-0.06, -0.02, 0]), P([-0.02, -0.14, 0], 0)),
        muscle("brachialis", 1000, 0.09, 0.12, P([0.02, -0.12, 0], 0), P([0.02, -0.03, 0], 1)),
        muscle("triceps", 1500, 0.10, 0.16, P([-0.02, -0.06, 0], 0), P([-0.025, 0.02, 0], 1)),
    ],
    coordinates=["shoulder", "elbow"],
)
motion = em.Motion.from_waypoints(
    [0, 0.5, 1.0], np.radians([[10.0, 30.0], [35.0, 80.0], [20.0, 50.0]])
)

# The script's own settings and its own call of the solver.
settings = exu.SimulationSettings()
settings.timeIntegration.numberOfSteps = 100
settings.timeIntegration.endTime = 1.0
settings.timeIntegration.verboseMode = 0
settings.solution.file.write = False
settings.solution.sensors.writePeriod = 0.01

plugin = em.CosimulationPlugin(model, motion, em.CosimulationSettings(kp=400.0))
with plugin.attached():
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
result = plugin.result()

hand_path = mbs.GetSensorStoredData(hand_position)
forces = mbs.GetSensorStoredData(muscle_forces)
print("tracking error (RMS):", np.degrees(result.tracking_error_rms()).round(4), "deg")
print("highest point of the hand:", hand_path[:, 2].max().round(3), "m")
print("largest forces:", result.muscle_names, forces[:, 1:].max(axis=0).round(), "N")
