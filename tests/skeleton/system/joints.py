"""Small systems, one for each kind of joint and constraint, every one driven by muscles.

A system's function takes an `mbs` and its ground, and a type of nodes; it returns what is tracked,
the paths of muscles and where the motion ends, from zero.
"""

from __future__ import annotations

import exudyn as exu
import numpy as np
from exudyn.utilities import (
    CoordinateConstraint,
    InertiaCuboid,
    MarkerBodyPosition,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    NodeRigidBody2D,
    ObjectJointPrismatic2D,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
)

import exudyn_muscles as em

from .convert import EULER, TAIT_BRYAN
from .models import sized, sizes_along

GRAVITY = [0.0, -9.81, 0.0]
RADIUS = 0.2  # m, of the disc
BAR, ROD = 0.2, 0.5  # m, of the cranks


def bar(mbs, length, place, node_type=EULER):
    """Along x from a place."""
    return mbs.CreateRigidBody(
        inertia=InertiaCuboid(1000.0, [length, 0.06, 0.04]), nodeType=node_type,
        referencePosition=np.add(place, [length / 2, 0, 0]), gravity=GRAVITY,
    )  # fmt: skip


def paths(ground, body, ends):
    """From points in ground to others on a body."""
    return [[em.PathPoint(a, link=ground), em.PathPoint(b, link=body)] for a, b in ends]


def antagonists(ground, body, length):
    """Above and below a bar that turns about its left end, which is at the origin."""
    return paths(ground, body, [([-0.15, y, 0.0], [0.1 * length, y / 4, 0.0]) for y in (0.1, -0.1)])


def around(ground, body, at):
    """Six muscles that can push and turn a bar in all directions."""
    rng = np.random.default_rng(1)
    ends = []
    for axis in range(3):
        for side in (0.5, -0.5):
            place = np.zeros(3)
            place[axis] = side
            ends.append((place + at, rng.uniform(-0.08, 0.08, 3)))
    return paths(ground, body, ends)


def spherical(mbs, ground, node_type):
    body = bar(mbs, 0.4, [0, 0, 0], node_type)
    ball = mbs.CreateSphericalJoint(itemNumbers=[ground, body], position=[0, 0, 0])
    tracked = {axis: em.JointCoordinate(ball, axis) for axis in ("rx", "ry", "rz")}
    return tracked, around(ground, body, [0.2, 0, 0]), [0.2, -0.3, 0.4]


def prismatic(mbs, ground, node_type):
    body = bar(mbs, 0.4, [0, 0, 0], node_type)
    slider = mbs.CreatePrismaticJoint(
        itemNumbers=[ground, body], position=[0, 0, 0], axis=[1, 2, 0], useGlobalFrame=True
    )
    ends = [([-0.4, -0.3, 0], [-0.1, 0, 0]), ([0.7, 0.6, 0], [0.1, 0, 0])]
    return {"way": slider}, paths(ground, body, ends), [0.1]


def generic(mbs, ground, node_type):
    """Two translations and two rotations free."""
    body = bar(mbs, 0.4, [-0.2, 0, 0], node_type)
    joint = mbs.CreateGenericJoint(
        itemNumbers=[ground, body], position=[0, 0, 0], constrainedAxes=[0, 0, 1, 0, 1, 0]
    )
    tracked = {axis: em.JointCoordinate(joint, axis) for axis in ("tx", "ty", "rx", "rz")}
    return tracked, around(ground, body, [0, 0, 0]), [0.05, -0.04, 0.2, -0.3]


def distance(mbs, ground, node_type):
    """A crank that moves a slider by a rod without mass."""
    crank = bar(mbs, BAR, [0, 0, 0], node_type)
    slider = bar(mbs, 0.1, [BAR + ROD, 0, 0], node_type)
    hinge = mbs.CreateRevoluteJoint(itemNumbers=[ground, crank], position=[0, 0, 0], axis=[0, 0, 1])
    mbs.CreatePrismaticJoint(
        itemNumbers=[ground, slider], position=[BAR + ROD, 0, 0], axis=[1, 0, 0]
    )
    mbs.CreateDistanceConstraint(
        itemNumbers=[crank, slider], localPosition0=[BAR / 2, 0, 0], localPosition1=[-0.05, 0, 0],
        distance=ROD,
    )  # fmt: skip
    return {"crank": hinge}, antagonists(ground, crank, BAR), [0.5]


def rolling(mbs, ground, node_type):
    """A disc upright on the plane z = 0, which rolls along y."""
    disc = mbs.CreateRigidBody(
        inertia=InertiaCuboid(500.0, [0.04, 2 * RADIUS, 2 * RADIUS]), nodeType=node_type,
        referencePosition=[0, 0, RADIUS], gravity=[0, 0, -9.81],
    )  # fmt: skip
    mbs.CreateRollingDisc(bodyNumbers=[ground, disc], axisPosition=[0, 0, 0], discRadius=RADIUS)
    upright = mbs.CreateGenericJoint(
        itemNumbers=[ground, disc], position=[0, 0, RADIUS], constrainedAxes=[0, 0, 0, 0, 1, 1],
        useGlobalFrame=True,
    )  # fmt: skip
    ends = [([0, side * 0.8, 1.5 * RADIUS], [0, 0, RADIUS / 2]) for side in (1.0, -1.0)]
    return {"turn": em.JointCoordinate(upright, "rx")}, paths(ground, disc, ends), [0.8]


def coordinates(mbs, ground, node_type):
    """Two bars of which the second one turns by half as much, backwards, as coordinates say."""
    first, second = (bar(mbs, 0.3, [x, 0, 0], TAIT_BRYAN) for x in (0.0, 0.5))
    hinge, _ = (
        mbs.CreateRevoluteJoint(itemNumbers=[ground, body], position=[x, 0, 0], axis=[0, 0, 1])
        for body, x in ((first, 0.0), (second, 0.5))
    )
    about_z = [
        mbs.AddMarker(
            MarkerNodeCoordinate(nodeNumber=mbs.GetObject(body)["nodeNumber"], coordinate=5)
        )
        for body in (first, second)
    ]
    mbs.AddObject(CoordinateConstraint(markerNumbers=about_z, factor1=-2.0))
    return {"first": hinge}, antagonists(ground, first, 0.3), [0.6]


def plane(mbs, ground, node_type):
    """A crank, a rod and a slider of bodies in the plane, with its joints."""
    bodies = []
    for length, x in ((BAR, 0.0), (ROD, BAR), (0.1, BAR + ROD - 0.05)):
        node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[x + length / 2, 0.0, 0.0]))
        bodies.append(
            mbs.AddObject(ObjectRigidBody2D(nodeNumber=node, mass=2.0 * length, inertia=0.01))
        )

    def hinge(first, second, here, there):
        ends = [
            mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0]))
            for body, x in ((first, here), (second, there))
        ]
        return mbs.AddObject(ObjectJointRevolute2D(markerNumbers=ends))

    crank, rod, slider = bodies
    hinge(ground, crank, 0.0, -BAR / 2)
    hinge(crank, rod, BAR / 2, -ROD / 2)
    hinge(rod, slider, ROD / 2, 0.0)
    ends = [mbs.AddMarker(MarkerBodyRigid(bodyNumber=body)) for body in (ground, slider, crank)]
    mbs.AddObject(
        ObjectJointPrismatic2D(
            markerNumbers=ends[:2], axisMarker0=[1, 0, 0], normalMarker1=[0, 1, 0]
        )
    )
    tracked = {"crank": em.RelativeRotation(ends[0], ends[2])}
    return tracked, antagonists(ground, crank, BAR), [0.5]


KINDS = (spherical, prismatic, generic, distance, rolling, coordinates, plane)


def build(kind, node_type=EULER):
    """A system's model, and its motion in 0.3 s."""

    def made(sizes):
        mbs = exu.SystemContainer().AddSystem()
        tracked, lines, end = kind(mbs, mbs.CreateGround(), node_type)
        mbs.Assemble()
        reserves = [em.Reserve(name, 20.0) for name in tracked]
        sizes = np.full((len(lines), 2), 0.1) if sizes is None else sizes
        model = em.MusculoskeletalModel(mbs, tracked, sized(lines, sizes), reserves=reserves)
        return model, em.Motion.from_waypoints([0.0, 0.3], [np.zeros(len(end)), end])

    return made(sizes_along(*made(None)))
