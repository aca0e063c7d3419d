"""Random chains as Exudyn's own `Robot` builds them, of minimal and of redundant coordinates."""

from __future__ import annotations

import exudyn as exu
import numpy as np
from exudyn.robotics import Robot, RobotLink
from exudyn.utilities import (
    HomogeneousTransformation,
    MarkerBodyRigid,
    RotXYZ2RotationMatrix,
)

import exudyn_muscles as em

from .models import sized, sizes_along

JOINTS = ("Rx", "Ry", "Rz", "Px", "Py", "Pz")


class RandomChain:
    """Branched links on joints of all kinds, two muscles a link from the one before, a motion.

    Muscles have the sizes that their paths have along it.
    """

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        n = self.size = int(rng.integers(3, 7))
        self.names = [f"q{k}" for k in range(n)]
        self.robot = Robot(gravity=rng.uniform(-6, 6, 3), referenceConfiguration=[])
        for k in range(n):
            self.robot.AddLink(_link(rng, k))
        self.points = [
            (rng.uniform(-0.2, 0.2, 3), self.robot.GetParentIndex(k), rng.uniform(-0.2, 0.2, 3), k)
            for k in [*range(n), *range(n)]
        ]
        self.q, self.v = rng.uniform(-0.3, 0.3, n), rng.uniform(-1, 1, n)
        ends = [self.q, self.q + rng.uniform(-0.1, 0.1, n)]
        self.motion = em.Motion.from_waypoints([0.0, 0.2], ends)
        self._sizes = np.full((2 * n, 2), 0.1)
        self._sizes = sizes_along(self.tree(), self.motion)

    def tree(self):
        mbs = exu.SystemContainer().AddSystem()
        built = self.robot.CreateKinematicTree(mbs)
        mbs.Assemble()
        muscles, reserves = self._muscles(list(range(self.size)))
        return em.MusculoskeletalModel(
            mbs, built["objectKinematicTree"], muscles, coordinates=self.names, reserves=reserves
        )

    def bodies(self, node_type=exu.NodeType.RotationEulerParameters):
        mbs = exu.SystemContainer().AddSystem()
        base = mbs.AddMarker(MarkerBodyRigid(bodyNumber=mbs.CreateGround()))
        built = self.robot.CreateRedundantCoordinateMBS(
            mbs, base, createJointTorqueLoads=False, rigidBodyNodeType=node_type
        )
        mbs.Assemble()
        muscles, reserves = self._muscles(built["bodyList"])
        tracked = dict(zip(self.names, built["jointList"], strict=True))
        return em.MusculoskeletalModel(mbs, tracked, muscles, reserves=reserves)

    def _muscles(self, links):
        def point(place, k):
            return em.PathPoint(place) if k < 0 else em.PathPoint(place, link=links[k])

        paths = [[point(p, j), point(q, k)] for p, j, q, k in self.points]
        return sized(paths, self._sizes), [em.Reserve(name, 100.0) for name in self.names]


def _link(rng, k):
    axes = RotXYZ2RotationMatrix(rng.uniform(-2, 2, 3))
    # Exudyn's chain of bodies leaves out where the first joint is, so that it is at the origin.
    place = rng.uniform(-0.3, 0.3, 3) if k else np.zeros(3)
    return RobotLink(
        mass=rng.uniform(0.5, 5.0),
        COM=rng.uniform(-0.1, 0.1, 3),
        inertia=0.01 * axes @ np.diag(rng.uniform(1.0, 1.9, 3)) @ axes.T,
        jointType=JOINTS[rng.integers(6)],
        parent=int(rng.integers(max(0, k - 2), k)) if k else -1,
        preHT=HomogeneousTransformation(RotXYZ2RotationMatrix(rng.uniform(-2, 2, 3)), place),
    )
