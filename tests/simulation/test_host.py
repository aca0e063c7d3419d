"""Contracts of the host: what the plugin relies on in Exudyn, without the plugin.

A new release of Exudyn that changes a hook, a state or a setting is seen here first.
"""

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import NodeGenericODE1, ObjectGenericODE1, RigidBodyInertia, TreeLink

from ..runs import TRAPEZOIDAL, settings

GENERALIZED_ALPHA = exu.DynamicSolverType.GeneralizedAlpha
START = exu.ConfigurationType.StartOfStep


def pendulum(**options):
    mbs = exu.SystemContainer().AddSystem()
    inertia = RigidBodyInertia(
        mass=2.0, inertiaTensor=np.diag([0.6, 0.01, 0.6]), com=[0.0, -0.5, 0.0]
    )
    link = TreeLink(
        jointType=exu.JointType.RevoluteZ, parent=-1, jointHT=np.eye(4), linkInertia=inertia
    )
    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=[link], gravity=[0, -9.81, 0], initialCoordinates=[0.5], **options
    )
    mbs.Assemble()
    return mbs, tree


@pytest.mark.parametrize("solver", [TRAPEZOIDAL, GENERALIZED_ALPHA])
def test_order_of_the_hooks_and_state_at_acceptance(solver):
    mbs, _ = pendulum()
    log = []

    def state():
        data = mbs.systemData
        return (data.GetODE2Coordinates()[0], data.GetODE2Coordinates_t()[0])

    mbs.SetPreStepUserFunction(lambda mbs, t: log.append(("pre", t, state())) is None)
    mbs.SetPostStepUserFunction(lambda mbs, t: log.append(("post", t, state())) is None)
    mbs.SetPreNewtonResidualUserFunction(
        lambda mbs, t, iteration, discontinuous: log.append((iteration, t, state()))
    )
    mbs.SolveDynamic(settings(0.01, 0.02), solverType=solver)
    names = [entry[0] for entry in log]
    assert names[:3] == ["post", "pre", 0]
    for k, name in enumerate(names):
        if name == "post" and k > 0:
            assert isinstance(names[k - 1], int) and names[k - 1] >= 1
            assert log[k][1:] == log[k - 1][1:], "the last iterate is the accepted state"
    assert names.count("post") == 3 and names.count("pre") == 2


def test_initial_accelerations_use_the_torque_set_before():
    mbs, tree = pendulum()
    mbs.SetObjectParameter(tree, "jointForceVector", [7.0])
    seen = []
    mbs.SetPostStepUserFunction(
        lambda mbs, t: seen.append(mbs.systemData.GetODE2Coordinates_tt()[0]) is None
    )
    mbs.SolveDynamic(settings(0.01, 0.01), solverType=TRAPEZOIDAL)
    inertia = mbs.ComputeItem(tree, exu.ComputeItemType.MassMatrix)[0, 0]
    assert seen[0] * inertia == pytest.approx(7.0 - 2.0 * 9.81 * 0.5 * np.sin(0.5), rel=1e-12)


@pytest.mark.parametrize("solver", [TRAPEZOIDAL, GENERALIZED_ALPHA])
def test_factors_of_the_newton_matrix(solver):
    mbs, tree = pendulum()
    seen = []

    def jacobian(mbs, t, dq, dv, dy):
        s = mbs.sys["dynamicSolver"]
        mass = (1.0 - s.alphaM) / (1.0 - s.alphaF)
        M = mbs.ComputeItem(tree, exu.ComputeItemType.MassMatrix)[0, 0]
        gravity = -2.0 * 9.81 * 0.5 * np.cos(mbs.systemData.GetODE2Coordinates()[0])
        seen.append((dq, dv, s.GetSystemJacobian()[0, 0] - (mass * M + dq * gravity)))
        container = exu.MatrixContainer()
        container.SetWithSparseMatrix(np.array([[0.0, 0.0, 0.0]]), 1, 1)
        return container

    mbs.SetSystemJacobianUserFunction(jacobian)
    mbs.SolveDynamic(settings(0.01, 0.05), solverType=solver)
    s = mbs.sys["dynamicSolver"]
    for dq, dv, rest in seen:
        assert dq == pytest.approx(-s.newmarkBeta * 1e-4, rel=1e-9)
        assert dv == pytest.approx(-s.newmarkGamma * 1e-2, rel=1e-9)
        assert abs(rest) < 1e-8  # Exudyn differentiates numerically
    if solver is TRAPEZOIDAL:
        assert (s.newmarkBeta, s.newmarkGamma) == (0.25, 0.5)


def test_a_pre_step_that_returns_none_stops_with_success():
    mbs, _ = pendulum()
    mbs.SetPreStepUserFunction(lambda mbs, t: None)
    assert mbs.SolveDynamic(settings(), solverType=TRAPEZOIDAL) is True
    assert mbs.systemData.GetTime() < 0.05
    assert mbs.sys["dynamicSolver"].output.simulationStoppedByUserFunction


def test_exceptions_are_wrapped_with_their_cause():
    mbs, _ = pendulum()
    error = ZeroDivisionError("mine")

    def fail(mbs, t, iteration, discontinuous):
        raise error

    mbs.SetPreNewtonResidualUserFunction(fail)
    with pytest.raises(exu.ExudynError) as caught:
        mbs.SolveDynamic(settings(), solverType=TRAPEZOIDAL)
    assert caught.value.__cause__ is error


def test_a_rejected_step_is_opened_again_from_the_same_state():
    mbs, _ = pendulum()
    opened = []
    count = iter(range(10**6))
    mbs.SetPreStepUserFunction(
        lambda mbs, t: opened.append((mbs.systemData.GetTime(START), t)) is None
    )
    mbs.SetPostNewtonUserFunction(lambda mbs, t: [10.0, 0.005] if next(count) == 2 else [0.0, -1.0])
    mbs.SolveDynamic(settings(0.01, 0.05), solverType=TRAPEZOIDAL)
    starts = [start for start, _ in opened]
    (twice,) = [k for k in range(1, len(starts)) if starts[k] == starts[k - 1]]
    assert opened[twice][1] - starts[twice] == pytest.approx(0.005)


def test_views_are_the_state():
    mbs, _ = pendulum()
    view = mbs.systemData.GetSystemStateDict(reference=True)["ODE2Coords"]
    view[:] = 0.75
    assert mbs.systemData.GetODE2Coordinates()[0] == 0.75


def test_explicit_solvers_never_ask_for_the_residual():
    mbs, _ = pendulum()
    calls = []
    mbs.SetPreNewtonResidualUserFunction(lambda *arguments: calls.append(1))
    mbs.SolveDynamic(settings(0.001, 0.01), solverType=exu.DynamicSolverType.RK44)
    assert not calls


@pytest.mark.xfail(strict=True, reason="Exudyn starts the rates of ODE1 coordinates at zero")
def test_ode1_coordinates_are_second_order():
    def error(steps):
        mbs = exu.SystemContainer().AddSystem()
        node = mbs.AddNode(
            NodeGenericODE1(
                referenceCoordinates=[0.0], initialCoordinates=[1.0], numberOfODE1Coordinates=1
            )
        )
        mbs.AddObject(
            ObjectGenericODE1(nodeNumbers=[node], rhsUserFunction=lambda mbs, t, i, y: [-y[0]])
        )
        mbs.Assemble()
        mbs.SolveDynamic(settings(1.0 / steps, 1.0), solverType=TRAPEZOIDAL)
        return abs(mbs.systemData.GetODE1Coordinates()[0] - np.exp(-1.0))

    assert error(20) / error(40) > 3.5


def test_a_state_written_before_the_residual_is_the_one_that_counts():
    """Dependent coordinates are put in order there, accelerations included, and stay so."""
    mbs, tree = pendulum()
    mbs.SetObjectParameter(tree, "jointForceVector", [0.0])
    state = mbs.systemData.GetSystemStateDict(reference=True)
    q, v, a = (state[name] for name in ("ODE2Coords", "ODE2Coords_t", "ODE2Coords_tt"))

    def write(mbs, t, iteration, _):
        q[0], v[0], a[0] = 0.3, 0.0, 2.0
        M, H = 0.6, 9.81 * np.sin(0.3)
        mbs.SetObjectParameter(tree, "jointForceVector", [M * a[0] + H])

    mbs.SetPreNewtonResidualUserFunction(write)
    mbs.SolveDynamic(settings(0.01, 0.01), solverType=TRAPEZOIDAL)
    assert mbs.systemData.GetODE2Coordinates()[0] == 0.3
    assert mbs.systemData.GetODE2Coordinates_tt()[0] == 2.0
    assert mbs.sys["dynamicSolver"].it.newtonStepsCount == 1  # the residual was zero


@pytest.mark.parametrize("solver", [TRAPEZOIDAL, GENERALIZED_ALPHA])
def test_loads_are_asked_once_a_residual_at_the_iterate(solver):
    """Its time and its pose; before that at the start, for the initial accelerations."""
    mbs, tree = pendulum()
    marker = mbs.AddMarker(
        exu.itemInterface.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=0)
    )
    log = []

    def force(mbs, t, _):
        q = mbs.systemData.GetODE2Coordinates()[0]
        R = mbs.GetMarkerOutput(marker, exu.OutputVariableType.RotationMatrix)
        assert t == mbs.systemData.GetTime()
        assert R[[0, 3]] == pytest.approx([np.cos(q), np.sin(q)], abs=1e-15)
        log.append((t, q))
        return [0.0, 3.0, 0.0]

    load = mbs.AddLoad(
        exu.itemInterface.LoadForceVector(
            markerNumber=marker, loadVector=[0.0, 0.0, 0.0], loadVectorUserFunction=force
        )
    )
    mbs.Assemble()
    assert mbs.GetLoad(load)["loadVectorUserFunction"]["function"] is force
    iterates = []
    mbs.SetPreNewtonResidualUserFunction(
        lambda mbs, t, *_: iterates.append((t, mbs.systemData.GetODE2Coordinates()[0]))
    )
    run = settings(0.01, 0.54)
    run.timeIntegration.startTime, run.timeIntegration.numberOfSteps = 0.5, 4
    mbs.SolveDynamic(run, solverType=solver)
    assert log == [(0.5, 0.5), *iterates] and len(iterates) >= 8


def test_a_last_link_without_mass_has_no_finite_mass_matrix():
    mbs = exu.SystemContainer().AddSystem()
    massless = RigidBodyInertia(mass=0.0, inertiaTensor=np.zeros((3, 3)))
    body = RigidBodyInertia(mass=1.0, inertiaTensor=np.eye(3), com=[0.0, -0.5, 0.0])
    joint = {"jointType": exu.JointType.RevoluteZ, "jointHT": np.eye(4)}
    links = [
        TreeLink(parent=-1, linkInertia=body, **joint),
        TreeLink(parent=0, linkInertia=massless, **joint),
    ]
    tree = mbs.CreateKinematicTree(listOfTreeLinks=links)
    mbs.Assemble()
    assert np.isnan(mbs.ComputeItem(tree, exu.ComputeItemType.MassMatrix)).any()
