"""A model on a kinematic tree, built anew of rigid bodies with joints."""

from __future__ import annotations

import dataclasses

import exudyn as exu
import numpy as np
from exudyn.utilities import GenericJoint, MarkerBodyRigid, RigidBodyInertia

import exudyn_muscles as em
from exudyn_muscles.skeleton.tree import tree_frames

EULER = exu.NodeType.RotationEulerParameters
TAIT_BRYAN = exu.NodeType.RotationRxyz
VECTOR = exu.NodeType.RotationRotationVector


def as_bodies(model, node_type=EULER):
    """The same links, joints and muscles; every joint's coordinate is tracked.

    Of trees without reference coordinates, with gravity alone. Massless links get a little mass.
    """
    tree, names = model.skeleton.tree, model.skeleton.tree_coordinates
    item = model.mbs.GetObject(model.skeleton.object)
    masses = np.array(item["linkMasses"], dtype=float)
    centers = np.array(item["linkCOMs"].GetPythonObject(), dtype=float).reshape(-1, 3)
    inertias = np.array(item["linkInertiasCOM"].GetPythonObject(), dtype=float).reshape(-1, 3, 3)
    R, p, _ = tree_frames(tree, -tree.reference)  # theta = 0
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    bodies = []
    for k in range(len(tree)):
        bodies.append(
            mbs.CreateRigidBody(
                inertia=RigidBodyInertia(
                    mass=masses[k],
                    com=centers[k],
                    inertiaTensor=inertias[k] + masses[k] * _offset(centers[k]),
                    inertiaTensorAtCOM=False,
                ),
                referencePosition=p[k],
                referenceRotationMatrix=R[k],
                nodeType=node_type,
                gravity=item["gravity"],
            )
        )
    joints = {}
    for k, name in enumerate(names):
        parent = tree.parents[k]
        place = tree.offsets[k] + (tree.base if parent < 0 else 0.0)
        first = mbs.AddMarker(
            MarkerBodyRigid(
                bodyNumber=ground if parent < 0 else bodies[parent], localPosition=place
            )
        )
        second = mbs.AddMarker(MarkerBodyRigid(bodyNumber=bodies[k], localPosition=[0, 0, 0]))
        locked = [1] * 6
        axis = tree.joints[k] % 3 + (3 if tree.joints[k] < 3 else 0)
        locked[axis] = 0
        joints[name] = mbs.AddObject(
            GenericJoint(
                name=name,
                markerNumbers=[first, second],
                constrainedAxes=locked,
                rotationMarker0=tree.rotations[k],
                rotationMarker1=np.eye(3),
            )
        )
    mbs.Assemble()
    muscles = [moved(muscle, bodies) for muscle in model.muscles]
    reserves = [
        one if isinstance(one, em.Reserve) else dataclasses.replace(one, link=bodies[one.link])
        for one in model.reserves
    ]
    return em.MusculoskeletalModel(mbs, joints, muscles, reserves=reserves)


def _offset(c):
    return c @ c * np.eye(3) - np.outer(c, c)


def moved(muscle, bodies):
    def on(item):
        return item if item.link < 0 else dataclasses.replace(item, link=bodies[item.link])

    wraps = [
        dataclasses.replace(wrap, surface=on(wrap.surface))
        if isinstance(wrap, em.PathWrap)
        else on(wrap)
        for wrap in muscle.wraps
    ]
    return dataclasses.replace(muscle, path=[on(point) for point in muscle.path], wraps=wraps)
