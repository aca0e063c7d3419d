"""models/leg.py built of bodies: thigh, talus, shank and foot on a ball, a sliding knee and two
hinges."""

from __future__ import annotations

import exudyn as exu
import numpy as np
from exudyn.utilities import GenericJoint, HomogeneousTransformation, MarkerBodyRigid

import exudyn_muscles as em
from exudyn_muscles.skeleton.tree import tree_frames
from models import leg

from .convert import EULER, moved
from .coupled import couple

TALUS = 6
# R_z R_x R_y of the hip are a joint's R_x R_y R_z about these axes.
HIP_AXES = np.eye(3)[:, [2, 0, 1]]
UPRIGHT = np.eye(3)


def build(node_type=EULER):
    """The same segments, muscles and coordinates; all coordinates are tracked but the knee's
    translations."""
    plain = leg.build()
    tree = plain.skeleton.tree
    R, p, _ = tree_frames(tree, *plain.state_of_tree(np.zeros(6)))
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    bodies = {
        link: mbs.CreateRigidBody(
            inertia=leg._inertia(link), referencePosition=p[link],
            referenceRotationMatrix=R[link], nodeType=node_type, gravity=[0, -9.81, 0],
        )
        for link in (leg.THIGH, leg.SHANK, TALUS, leg.FOOT)
    }  # fmt: skip

    def joint(name, first, second, place, locked, frame, own=UPRIGHT):
        markers = [
            mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localHT=HomogeneousTransformation(*at)))
            for body, at in ((first, (frame, place)), (second, (own, [0, 0, 0])))
        ]
        return mbs.AddObject(GenericJoint(name=name, markerNumbers=markers, constrainedAxes=locked))

    thigh, shank, talus, foot = bodies.values()
    hip = joint("hip", ground, thigh, leg.HIP, [1, 1, 1, 0, 0, 0], HIP_AXES, HIP_AXES)
    knee = joint("knee", thigh, shank, [0, 0, 0], [0, 0, 1, 1, 1, 0], UPRIGHT)
    hinge = [1, 1, 1, 1, 1, 0]
    ankle = joint("ankle", shank, talus, tree.offsets[TALUS], hinge, tree.rotations[TALUS])
    subtalar = joint(
        "subtalar", talus, foot, tree.offsets[leg.FOOT], hinge, tree.rotations[leg.FOOT]
    )
    functions = (em.simm_spline(*points) for points in (leg.KNEE_X, leg.KNEE_Y))
    couple(mbs, knee, dict(enumerate(functions)))
    mbs.Assemble()
    axes = {"hip_flexion": "rx", "hip_adduction": "ry", "hip_rotation": "rz"}
    tracked = {name: em.JointCoordinate(hip, axis) for name, axis in axes.items()}
    tracked |= {"knee": em.JointCoordinate(knee, "rz"), "ankle": ankle, "subtalar": subtalar}
    return em.MusculoskeletalModel(mbs, tracked, [moved(one, bodies) for one in plain.muscles])
