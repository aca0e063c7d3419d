"""The Newton matrix of a tree that is alone, made from M and slopes that are kept."""

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.methods import unified
from exudyn_muscles.simulation import newton, plugin
from models import leg, pendulum, planar_arm

from ..runs import TRAPEZOIDAL, csf, plugin_run, settings, start_at

RULES = [TRAPEZOIDAL, exu.DynamicSolverType.GeneralizedAlpha]


def built_by_exudyn(monkeypatch):
    monkeypatch.setattr(plugin, "is_alone", lambda skeleton: False)


def short(source):
    motion = source.motion()
    return motion.between(motion.start, motion.start + 0.1)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("source", [planar_arm, leg])
def test_it_is_exudyns_matrix(monkeypatch, source, rule):
    """With slopes of every step, though of its start: the same iterates within the tolerance."""
    monkeypatch.setattr(unified, "KEPT", 1)
    model, motion = source.build(), short(source)
    results = []
    for own in (True, False):
        if not own:
            built_by_exudyn(monkeypatch)
        start_at(model, motion)
        s = settings(0.001, end=motion.end)
        results.append(plugin_run(model, em.CMCPlugin(model, motion), s, rule))
    ours, exudyns = results
    assert ours.counts.newton_iterations == exudyns.counts.newton_iterations
    np.testing.assert_allclose(ours.coordinates, exudyns.coordinates, rtol=0, atol=1e-9)


@pytest.mark.parametrize("source", [planar_arm, leg])
@pytest.mark.parametrize("scheme", list(em.Scheme))
def test_cosimulation_needs_none_of_exudyns(monkeypatch, source, scheme):
    model, motion = source.build(), short(source)
    given = em.CosimulationSettings(scheme=scheme)
    ours = em.cosimulate(model, motion, settings=given)
    built_by_exudyn(monkeypatch)
    exudyns = em.cosimulate(model, motion, settings=given)
    ways = [run.counts.newton_iterations for run in (ours, exudyns)]
    if scheme is em.Scheme.CONSISTENT:  # none more where a step is moved
        assert ours.counts.steps == ways[0] <= ways[1]
    else:
        assert ways[0] == ways[1]
    np.testing.assert_allclose(ours.coordinates, exudyns.coordinates, rtol=0, atol=1e-10)


def test_kept_slopes_cost_few_iterations(monkeypatch):
    """Some of them because reactions follow by them as well, which spares two thirds of M and
    H - Q."""
    model, motion = leg.build(), short(leg)
    counts = []
    for kept in (1, unified.KEPT):
        monkeypatch.setattr(unified, "KEPT", kept)
        counts.append(em.computed_muscle_control(model, motion).counts)
    assert counts[1].newton_iterations < 1.25 * counts[0].newton_iterations


def test_slopes_are_found_anew_where_a_step_takes_long(monkeypatch):
    """Without any the iterations would go on and on."""
    found = []
    model, motion = leg.build(), short(leg)
    slopes = type(model.skeleton).slopes
    monkeypatch.setattr(
        type(model.skeleton), "slopes", lambda self: found.append(1) or slopes(self)
    )
    em.computed_muscle_control(model, motion)
    usual = len(found)
    monkeypatch.setattr(unified, "SLOW", 1)
    em.computed_muscle_control(model, motion)
    assert usual == 10
    assert len(found) - usual > 50


def test_only_of_a_tree_that_is_alone():
    assert newton.is_alone(pendulum.build().skeleton)
    model = pendulum.build()
    model.mbs.CreateMassPoint(referencePosition=[9.0, 0.0, 0.0], mass=1.0)
    model.mbs.Assemble()
    assert not newton.is_alone(model.skeleton)


@pytest.mark.parametrize(
    ("kind", "calls"),
    [(exu.LinearSolverType.EXUdense, True), (exu.LinearSolverType.EigenSparse, False)],
)
def test_sparse_matrices_stay_exudyns(monkeypatch, kind, calls):
    asked = []
    original = plugin.whole_matrix
    monkeypatch.setattr(plugin, "whole_matrix", lambda *x: asked.append(1) or original(*x))
    model, motion = planar_arm.build(), short(planar_arm)
    start_at(model, motion)
    s = settings(0.01, end=motion.end)
    s.linearSolver.solverType = kind
    result = plugin_run(model, csf(model, motion), s)
    assert bool(asked) == calls
    assert result.status is em.Status.COMPLETE


def own_solver():
    """A model at its start, its motion, settings of one interval, and a solver for it."""
    model, motion = planar_arm.build(), short(planar_arm)
    start_at(model, motion)
    s = settings(0.01, end=0.01)
    s.timeIntegration.generalizedAlpha.useNewmark = True
    s.timeIntegration.generalizedAlpha.useIndex2Constraints = True
    return model, motion, s, exu.MainSolverImplicitSecondOrder()


def test_a_solver_of_ones_own_gets_its_matrix_back():
    """After `attached()` it solves without the plugin, with the matrix that it builds itself."""
    model, motion, s, solver = own_solver()
    mbs, run = model.mbs, csf(model, motion)
    with run.attached():
        mbs.sys["dynamicSolver"], mbs.sys["simulationSettings"] = solver, s
        solver.InitializeSolver(mbs, s)
        assert solver.SolveSteps(mbs, s)
        given = np.array(solver.GetSystemJacobian())
    solver.ComputeNewtonJacobian(mbs, s)
    built = np.array(solver.GetSystemJacobian())
    M = model.skeleton.dynamics_at(*motion(0.0)[:2], 0.0).M
    # That of the law has (1 + kp h^2 / 4 + kv h / 2) M, Exudyn's hardly more than M.
    assert np.abs(given).max() > 1.2 * np.abs(M).max()
    np.testing.assert_allclose(built, M, rtol=0, atol=0.1 * np.abs(M).max())


def test_an_error_in_it_is_raised_as_itself(monkeypatch):
    def broken(self, tree):
        raise em.WindowError("in the matrix")

    monkeypatch.setattr(unified.UnifiedPlugin, "slopes", broken)
    with pytest.raises(em.WindowError, match="in the matrix"):
        em.computed_muscle_control(planar_arm.build(), short(planar_arm))


def test_every_solver_gets_its_matrix_back():
    """Also the first one of two in the same `attached()`."""
    model, motion, s, solver = own_solver()
    mbs, run = model.mbs, csf(model, motion)
    with run.attached():
        mbs.sys["dynamicSolver"], mbs.sys["simulationSettings"] = solver, s
        solver.InitializeSolver(mbs, s)
        assert solver.SolveSteps(mbs, s)
        solver.FinalizeSolver(mbs, s)
        state = mbs.systemData.GetSystemState()
        mbs.systemData.SetSystemState(state, configuration=exu.ConfigurationType.Initial)
        again = settings(0.01, end=0.02, start=0.01)
        mbs.SolveDynamic(again, solverType=TRAPEZOIDAL)
        mbs.sys.pop("dynamicSolver")
    solver.ComputeNewtonJacobian(mbs, s)
    built, M = (
        np.array(solver.GetSystemJacobian()),
        model.skeleton.dynamics_at(*motion(0.0)[:2], 0.0).M,
    )
    np.testing.assert_allclose(built, M, rtol=0, atol=0.1 * np.abs(M).max())
