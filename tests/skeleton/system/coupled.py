"""Coordinates of a joint between bodies that follow another one, as a constraint of the `mbs`."""

from __future__ import annotations

import exudyn as exu
import numpy as np
from exudyn.utilities import CoordinateVectorConstraint, MarkerNodeCoordinates

POSITION, ROTATION = exu.OutputVariableType.Position, exu.OutputVariableType.RotationMatrix


def couple(mbs, name, joint, functions):
    """Have translations of a joint, by their axes 0, 1, 2, follow its angle about z.

    `functions` maps axis -> Curve of the angle.
    """
    markers = mbs.GetObject(joint)["markerNumbers"]
    bodies = [mbs.GetMarker(marker)["bodyNumber"] for marker in markers]
    ends = [
        mbs.AddMarker(MarkerNodeCoordinates(nodeNumber=mbs.GetObject(body)["nodeNumber"]))
        for body in bodies
    ]

    def place():
        """The way between the markers and the angle, with their Jacobians."""
        (p_0, R_0), (p_1, R_1) = (
            (mbs.GetMarkerOutput(k, POSITION), mbs.GetMarkerOutput(k, ROTATION).reshape(3, 3))
            for k in markers
        )
        moving, turning = (
            [np.asarray(mbs.ComputeItem(k, kind)) for k in markers]
            for kind in (
                exu.ComputeItemType.PositionJacobian, exu.ComputeItemType.RotationJacobian,
            )
        )  # fmt: skip
        way, A = p_1 - p_0, R_0.T @ R_1
        arms = np.cross(way, R_0.T)  # d (R_0^T way) = R_0^T (d way + way x omega_0)
        J_way = np.hstack([-R_0.T @ moving[0] - arms @ turning[0], R_0.T @ moving[1]])
        J_angle = R_0[:, 2] @ np.hstack([-turning[0], turning[1]])
        return R_0.T @ way, J_way, np.arctan2(A[1, 0], A[0, 0]), J_angle

    def jacobian(mbs, t, item, q, q_t, velocity_level):
        _, J_way, angle, J_angle = place()
        return np.array([J_way[k] - f.derivative(angle) * J_angle for k, f in functions.items()])

    def lacking(mbs, t, item, q, q_t, velocity_level):
        if velocity_level:
            return jacobian(mbs, t, item, q, q_t, True) @ q_t
        way, _, angle, _ = place()
        return np.array([way[k] - f(angle) for k, f in functions.items()])

    mbs.AddObject(
        CoordinateVectorConstraint(
            name=name, markerNumbers=ends, scalingMarker0=np.zeros((len(functions), 1)),
            constraintUserFunction=lacking, jacobianUserFunction=jacobian,
        )
    )  # fmt: skip
