"""A torso on two legs with feet on the ground: contact is part of Q, the base driven or not."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import InertiaCuboid

import exudyn_muscles as em

from .test_runs import METHODS

THIGH = SHANK = 0.45  # m
HIP = THIGH + SHANK
RADIUS, SINKING = 0.02, 0.003  # m, of the feet
STIFFNESS, DAMPING = 8e4, 800.0  # N/m, N s/m
WEIGHT = 52.0 * 9.81  # N
# Strength [N], fibre, tendon [m], and points on torso, thigh or shank; z is the leg's.
MUSCLES = {
    "flexor": (2500, 0.14, 0.11, ("torso", 0.08, -0.20), ("thigh", 0.05, 0.02)),
    "extensor": (3000, 0.14, 0.11, ("torso", -0.08, -0.20), ("thigh", -0.06, 0.02)),
    "vasti": (6000, 0.10, 0.155, ("thigh", 0.06, 0.0), ("shank", 0.06, 0.17)),
    "hamstrings": (2500, 0.12, 0.16, ("thigh", -0.05, 0.0), ("shank", -0.05, 0.15)),
}
BASE = {"x": "tx", "y": "ty", "lean": "rz"}


def model(driven):
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()

    def segment(name, top, length, mass, z):
        return mbs.CreateRigidBody(
            name=name, inertia=InertiaCuboid(mass / (length * 0.01), [0.1, length, 0.1]),
            referencePosition=[0, top - length / 2, z], gravity=[0, -9.81, 0],
        )  # fmt: skip

    def hinge(name, first, second, height, z):
        return mbs.CreateRevoluteJoint(
            name=name, itemNumbers=[first, second], position=[0, height, z], axis=[0, 0, 1]
        )

    torso = segment("torso", 1.4, 0.5, 30.0, 0.0)
    base = mbs.CreateGenericJoint(
        name="base", itemNumbers=[ground, torso], position=[0, HIP, 0],
        constrainedAxes=[0, 0, 1, 1, 1, 0],
    )  # fmt: skip
    tracked = {name: em.JointCoordinate(base, axis) for name, axis in BASE.items() if driven}
    muscles = []
    for side, z in (("left", 0.1), ("right", -0.1)):
        thigh = segment(f"{side} thigh", HIP, THIGH, 7.0, z)
        shank = segment(f"{side} shank", SHANK, SHANK, 4.0, z)
        tracked[f"{side} hip"] = hinge(f"{side} hip", torso, thigh, HIP, z)
        tracked[f"{side} knee"] = hinge(f"{side} knee", thigh, shank, SHANK, z)
        height = -RADIUS + WEIGHT / (2.0 * STIFFNESS) - SINKING
        corners = [[-2, height, 2], [2, height, 2], [2, height, -2], [-2, height, -2]]
        mbs.CreateSphereQuadContact(
            itemNumbers=[shank, ground], localPosition0=[0, -SHANK / 2, 0], sphereRadius=RADIUS,
            quadPoints=corners, contactStiffness=STIFFNESS, contactDamping=DAMPING,
            dynamicFriction=0.8, frictionProportionalZone=1e-2,
        )  # fmt: skip
        bodies = {"torso": torso, "thigh": thigh, "shank": shank}
        for name, (strength, fiber, tendon, *points) in MUSCLES.items():
            muscles.append(
                em.Muscle(
                    f"{side} {name}", max_isometric_force=strength, optimal_fiber_length=fiber,
                    tendon_slack_length=tendon,
                    path=[
                        em.PathPoint([x, y, z if body == "torso" else 0.0], link=bodies[body])
                        for body, x, y in points
                    ],
                )
            )  # fmt: skip
    mbs.Assemble()
    reserves = [em.Reserve(name, 100.0 if name in BASE else 10.0) for name in tracked]
    return em.MusculoskeletalModel(mbs, tracked, muscles, reserves=reserves)


def squat(driven):
    """Down and partly up again, the feet where they are."""
    times = np.linspace(0.0, 1.0, 201)
    part = em.Motion.from_waypoints([0.0, 0.5, 1.0], [[0.0], [1.0], [0.2]])(times)[0][:, 0]
    hip, knee = np.radians(25.0) * part, np.radians(-50.0) * part
    x = -THIGH * np.sin(hip) - SHANK * np.sin(hip + knee)
    y = THIGH * (np.cos(hip) - 1.0) + SHANK * (np.cos(hip + knee) - 1.0) - SINKING
    base = [x, y, np.zeros(times.size)] if driven else []
    return em.Motion.from_samples(times, np.column_stack([*base, hip, knee, hip, knee]))


@pytest.mark.parametrize("driven", [True, False])
def test_contact(driven):
    result = em.cosimulate(
        model(driven), squat(driven), settings=em.CosimulationSettings(scheme=em.Scheme.FULL)
    )
    assert result.status is em.Status.COMPLETE
    assert result.time[-1] == pytest.approx(1.0)
    assert result.max_unmet_torque == 0.0
    assert np.degrees(result.tracking_error_rms()).max() < 0.02
    assert result.counts.newton_iterations < 6 * result.counts.steps
    height = result.system_coordinates[:, 1]  # of the torso
    wanted = squat(True)(result.time)[0][:, 1]
    if driven:
        # The feet carry the weight, residuals what balances and accelerates it.
        assert np.abs(result.reserves[1:, 1]).mean() < 0.15 * WEIGHT
        assert np.abs(height - wanted).max() < 1e-4
    else:
        # Nobody tracks the base: it goes where legs and ground take it.
        assert 1e-4 < np.abs(height - wanted).max() < 0.02


@pytest.mark.parametrize("method", ["css", "cmc", "static"])
def test_contact_where_a_method_evaluates_it_apart(method):
    """At predicted states, along a motion and at the start, feet carry what they carry there."""
    built = model(True)
    result = METHODS[method](built, squat(True))
    assert result.status is em.Status.COMPLETE
    assert result.max_unmet_torque == 0.0
    assert np.degrees(result.tracking_error_rms()).max() < 0.5
    vertical = np.abs(result.reserves[:, 1])
    assert vertical[0] < 1e-4 * WEIGHT
    assert vertical.mean() < 0.2 * WEIGHT
    # Contacts are open again, as they were given, for whatever comes next.
    data = built.mbs.systemData
    initial = exu.ConfigurationType.Initial
    assert not np.any(data.GetDataCoordinates(configuration=initial))
    np.testing.assert_array_equal(
        METHODS[method](built, squat(True)).excitation_values, result.excitation_values
    )


def test_computed_muscle_control_with_a_base_that_nobody_tracks():
    result = METHODS["cmc"](model(False), squat(False))
    assert result.status is em.Status.COMPLETE
    assert np.degrees(result.tracking_error_rms()).max() < 0.5
