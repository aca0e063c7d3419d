"""Consistent co-simulation of systems of bodies: all of it goes where the muscles' forces lead."""

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.methods.course.nodes import NODES
from models import pedalling, planar_arm

from ..runs import plugin_run, settings, start_at
from ..skeleton.system.convert import EULER, TAIT_BRYAN, VECTOR, as_bodies
from ..skeleton.system.models import LENGTH, MOTION, PASSIVE, Arm, spring_hand
from .test_consistent import drift, plugin, refusing, run


def test_a_closed_loop():
    """CSF drifts by 1.8e-2 rad, CMC by 1.0e-4; CSF's loop opens by 1 mm."""
    model, motion = pedalling.build(), pedalling.motion()
    result = run(model, motion, 100.0)
    assert result.status is em.Status.COMPLETE and result.max_unmet_torque == 0.0
    assert result.tracking_error_rms()[0] < 2.1e-4  # CSF's
    assert drift(model, result) < 1e-4
    assert result.constraint_drift.max() < 5e-6
    assert result.counts.newton_iterations < 6 * result.counts.steps


def test_joints_that_are_kept_closed():
    """What is tracked stays where the forces lead: only the rest is moved."""
    model, motion = pedalling.build(), pedalling.motion()
    result = run(model, motion, 100.0, project_constraints=True)
    assert result.constraint_drift.max() < 1e-9
    assert drift(model, result) < 2e-4
    assert result.tracking_error_rms()[0] < 2.1e-4


@pytest.mark.parametrize("node_type", [EULER, TAIT_BRYAN])
def test_a_tree_built_of_bodies(node_type):
    """The same excitations as of the tree, to what is left of the discretisation."""
    motion = planar_arm.motion()
    tree, bodies = planar_arm.build(), as_bodies(planar_arm.build(), node_type)
    of_tree, of_bodies = run(tree, motion), run(bodies, motion)
    # In the first steps, whose corrections nothing has made expect, the tree keeps excitations of
    # iterates that are off by up to 5e-5, and its coordinates are 9e-6 apart.
    np.testing.assert_allclose(of_bodies.coordinates, of_tree.coordinates, rtol=0, atol=1e-5)
    gap = np.abs(of_bodies.excitation_values - of_tree.excitation_values)
    assert np.median(gap) < 1e-5 and gap.max() < 0.02
    assert drift(bodies, of_bodies) < 2.5e-5  # CSF's: 1.6e-3
    assert drift(tree, of_bodies) < 1e-4  # what one form finds moves the other


@pytest.mark.parametrize("passive", ["wobbling mass", "spring hand"])
def test_passive_directions_go_along(passive):
    """An arm that falls over: CSF's excitations are 1.8 and 3.7 rad off after a second."""
    model = Arm(PASSIVE[passive]).model()
    result = run(model, MOTION, 100.0)
    assert result.tracking_error_rms()[0] < 6e-5
    assert drift(model, result) < 0.2


def test_rejected_steps_leave_no_trace():
    motion = planar_arm.motion()

    def tried(again):
        model = as_bodies(planar_arm.build())
        start_at(model, motion)
        if again:
            model.mbs.SetPostNewtonUserFunction(refusing((6,)))
        options = settings(0.01, end=0.2 if again else 0.05)
        options.timeIntegration.adaptiveStepRecoverySteps = 1
        return plugin_run(model, plugin(model, motion), options)

    smooth, disturbed = tried(False), tried(True)
    assert disturbed.counts.rejected_steps == 1
    before = disturbed.time < smooth.time[-1] - 0.02
    for name in ("coordinates", "activations", "system_coordinates"):
        mine = getattr(disturbed, name)[before]
        np.testing.assert_array_equal(mine, getattr(smooth, name)[: len(mine)])
    assert disturbed.tracking_error_rms().max() < 2e-4


def test_rotation_vectors_are_refused():
    model = as_bodies(planar_arm.build(), VECTOR)
    with pytest.raises(em.ModelError, match=r"NodeRigidBodyRotVecLG.*Euler parameters"):
        run(model, planar_arm.motion())


def test_where_a_step_leads():
    """Exactly, for accelerations that are a polynomial of the nodes' degree."""
    h, x = 0.3, np.polynomial.Polynomial([0.2, -1.0, 3.0, 0.7, 2.0])
    v = x.deriv()
    a = v.deriv()(h * NODES.s)[:, None]
    start, end = (np.array([[x(t)], [v(t)]]) for t in (0.0, h))
    off = np.array([[0.1], [-0.2]])
    away = NODES.away(h, tuple(start), tuple(end + off), a)
    np.testing.assert_allclose(away[:, 0], [-0.1, 0.2 * h], rtol=0, atol=1e-14)


def test_generalized_alpha_is_refused_where_it_opens_joints():
    alpha = exu.DynamicSolverType.GeneralizedAlpha
    motion = planar_arm.motion()
    for project in (False, True):
        model = as_bodies(planar_arm.build())
        start_at(model, motion)
        driven = plugin(model, motion, project_constraints=project)
        if not project:
            with pytest.raises(em.ModelError, match="use TrapezoidalIndex2, or project_con"):
                plugin_run(model, driven, settings(0.01, end=0.1), alpha)
        else:
            result = plugin_run(model, driven, settings(0.01, end=0.5), alpha)
            assert result.tracking_error_rms().max() < 2e-4


def test_what_swings_too_fast_is_warned_of():
    """A hand on a spring and the forearm on its hinge, along x: M of both by hand."""
    (forearm, hand), (length, size) = (3.0, 1.0), (LENGTH, 0.2)
    of_hand = hand * ((size**2 + 0.08**2) / 12 + (size / 2) ** 2)
    coupled = of_hand + hand * length * size / 2
    both = of_hand + hand * (length**2 + length * size)
    both += forearm * ((length**2 + 0.08**2) / 12 + (length / 2) ** 2)
    fastest = np.sqrt(20.0 * both / (both * of_hand - coupled**2))
    model = Arm(spring_hand).model()
    with model.skeleton.opened():
        model.skeleton.go_to(np.zeros(1), np.zeros(1), 0.0)
        assert model.skeleton.now.fastest() == pytest.approx(fastest, rel=1e-9)
    with pytest.warns(em.StabilityWarning, match=r"swing with 53\.9 rad/s at the start.* 50 rad/s"):
        run(model, MOTION.between(0.0, 0.09), 100.0, step=0.03)
