"""Constraints that are met after every step, and what that does to runs."""

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em
from models import pedalling, planar_arm

from ...runs import settings
from .convert import as_bodies
from .models import MOTION, Arm, spring_hand
from .test_runs import METHODS, order

TURN = pedalling.motion()


@pytest.mark.parametrize("method", ["csf", "css", "cmc"])
def test_a_closed_loop_stays_closed(method):
    open_, closed = (
        METHODS[method](pedalling.build(), TURN, project_constraints=on) for on in (False, True)
    )
    assert open_.max_constraint_drift > (5e-6 if method == "cmc" else 5e-4)  # m
    assert closed.max_constraint_drift < 1e-9
    assert closed.status is em.Status.COMPLETE
    assert closed.max_unmet_torque == 0.0
    assert closed.tracking_error_rms()[0] < open_.tracking_error_rms()[0]


def test_order_of_cosimulation():
    steps = [0.02, 0.01, 0.005]
    errors = [
        METHODS["csf"](
            pedalling.build(), TURN, step=step, project_constraints=True
        ).tracking_error_rms()[0]
        for step in steps
    ]
    assert order(steps, errors) > 1.98


def test_a_replay_converges_to_the_same_end():
    """With something passive, whose direction the projection leaves to the masses."""
    times = np.linspace(0.0, 0.3, 121)
    part = em.Motion.from_samples(times, MOTION(times)[0])
    excitations = METHODS["csf"](Arm(spring_hand).model(), part).excitations

    def last(step, on):
        replay = em.ForwardSettings(step=step, project_constraints=on)
        replayed = em.forward_dynamics(Arm(spring_hand).model(), excitations, settings=replay)
        assert on == (replayed.max_constraint_drift < 1e-9)
        return replayed.system_coordinates[-1]

    fine, steps = last(2.5e-4, True), [5e-3, 2.5e-3, 1.25e-3]
    for on in (False, True):
        apart = [np.abs(last(step, on) - fine).max() for step in steps]
        assert order(steps, apart) == pytest.approx(2.0, abs=0.1)


def test_bodies_run_as_the_tree():
    """The trapezoidal rule on what is tracked is what a tree has."""
    tree, plain, closed = (
        METHODS["csf"](model, planar_arm.motion(), project_constraints=on)
        for model, on in (
            (planar_arm.build(), True),
            (as_bodies(planar_arm.build()), False),
            (as_bodies(planar_arm.build()), True),
        )
    )
    apart = [np.abs(one.coordinates - tree.coordinates).max() for one in (plain, closed)]
    assert apart[1] < 0.2 * apart[0]


def test_a_tree_has_nothing_to_project():
    one, other = (
        METHODS["csf"](planar_arm.build(), planar_arm.motion(), project_constraints=on)
        for on in (False, True)
    )
    np.testing.assert_array_equal(one.coordinates, other.coordinates)


@pytest.mark.parametrize(
    "solver", [exu.DynamicSolverType.TrapezoidalIndex2, exu.DynamicSolverType.GeneralizedAlpha]
)
def test_in_a_users_own_run_with_rejected_steps(solver):
    model = pedalling.build()
    model.skeleton.set_initial_state(*TURN(0.0)[:2])
    rejecting = settings(0.01)
    rejecting.timeIntegration.newton.useModifiedNewton = False
    rejecting.timeIntegration.newton.maxIterations = 4
    plugin = em.CosimulationPlugin(
        model, TURN, em.CosimulationSettings(scheme=em.Scheme.FULL, project_constraints=True)
    )
    with plugin.attached():
        model.mbs.SolveDynamic(rejecting, solverType=solver)
    result = plugin.result()
    assert result.counts.rejected_steps > 5
    assert result.max_constraint_drift < 1e-9
    assert np.degrees(result.tracking_error_rms())[0] < 0.005


@pytest.mark.parametrize("kind", [em.CosimulationSettings, em.CMCSettings, em.ForwardSettings])
def test_yes_or_no(kind):
    with pytest.raises(em.ParameterError, match="project_constraints is True or False, got 1"):
        kind(project_constraints=1)
