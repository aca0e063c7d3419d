"""Every kind of joint and constraint between bodies, under muscles, in all methods."""

import numpy as np
import pytest

import exudyn_muscles as em

from . import joints
from .convert import EULER, TAIT_BRYAN, VECTOR
from .models import exudyns_accelerations
from .test_runs import METHODS, order

KINDS = pytest.mark.parametrize("kind", joints.KINDS, ids=lambda kind: kind.__name__)


@KINDS
@pytest.mark.parametrize("node_type", [EULER, TAIT_BRYAN])
def test_equations(kind, node_type):
    """Against Exudyn's accelerations; those of moving rotation vectors, which it takes for
    coordinates there, are compared with trees in test_robots.py."""
    model, motion = joints.build(kind, node_type)
    skeleton = model.skeleton
    with skeleton.opened():
        skeleton.go_to(*motion(0.1)[:2], 0.0)
        M, bias, place = skeleton.dynamics()
        pose, B = place[2:4]
        pulls = model.geometry(*place).loads
        forces = np.random.default_rng(0).uniform(100.0, 800.0, len(pulls))
        for load in (np.zeros(pose.x.size), forces @ pulls):
            found = pose.T @ exudyns_accelerations(model, load) + skeleton.now.rate(pose)
            expected = np.linalg.solve(M, load @ B - bias)
            np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-7)


@KINDS
@pytest.mark.parametrize("node_type", [EULER, TAIT_BRYAN, VECTOR])
def test_full_cosimulation(kind, node_type):
    steps = [0.02, 0.01]
    runs = [METHODS["csf"](*joints.build(kind, node_type), step=step) for step in steps]
    errors = [run.tracking_error_rms().max() for run in runs]
    assert order(steps, errors) == pytest.approx(2.0, abs=0.05)
    assert errors[1] < 1e-3
    for run in runs:
        assert run.status is em.Status.COMPLETE
        assert run.max_unmet_torque == 0.0
        assert run.counts.newton_iterations < 6 * run.counts.steps


@KINDS
def test_the_other_methods(kind):
    model, motion = joints.build(kind)
    full = METHODS["csf"](model, motion)
    static = METHODS["static"](model, motion)
    scale = np.abs(static.torques_demanded).max()
    apart = np.abs(static.torques_demanded - full.torques_demanded)[1:].max()
    assert apart < 0.01 * scale
    assert METHODS["css"](model, motion).tracking_error_rms().max() < 0.01
    tracked = METHODS["cmc"](model, motion)
    assert tracked.tracking_error_rms().max() < 0.003
    again = em.forward_dynamics(joints.build(kind)[0], tracked.excitations)
    np.testing.assert_allclose(again.coordinates, tracked.coordinates, rtol=0, atol=1e-9)


def test_a_disc_rolls_to_a_pose_from_a_moving_one():
    """Its constraints, of velocities alone, ask nothing of positions."""
    model, _ = joints.build(joints.rolling)
    skeleton = model.skeleton
    with skeleton.opened():
        for angle in np.linspace(0.0, 0.7, 15):
            skeleton.go_to(np.array([angle]), np.array([2.0]), 0.0)
            np.testing.assert_allclose(skeleton.q, angle, rtol=0, atol=1e-12)
            np.testing.assert_allclose(skeleton.v, 2.0, rtol=0, atol=1e-12)
            assert np.abs(skeleton.now.equations(velocity=True)).max() < 1e-12
            way, rise = skeleton.x[1:3]
            # As far as it turns, to the straight lines of Newton's iterations.
            assert abs(way) == pytest.approx(joints.RADIUS * angle, rel=1e-3)
            assert rise == pytest.approx(0.0, abs=1e-12)
        assert skeleton.drift < 1e-12
