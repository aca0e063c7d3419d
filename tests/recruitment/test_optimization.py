"""Recruitment (10) within reach: optimality, agreement of the solvers, ideal actuators."""

import numpy as np
import pytest
import qpsolvers
from scipy.optimize import brentq, minimize

import exudyn_muscles as em
from exudyn_muscles.recruitment import optimization
from exudyn_muscles.recruitment.certificate import ACCEPTED, kkt_residual
from exudyn_muscles.recruitment.problem import ScaledProblem

from .cases import Case, check_optimal, random_case, with_reserves


def zoo():
    yield "one muscle", Case([[0.05]], [20.0], 0.0, 1000.0)
    yield "antagonists", Case([[0.05], [-0.05]], [20.0], [5.0, 10.0], 1000.0)
    yield "rest", Case([[0.05], [-0.05]], [0.0], 0.0, 1000.0)
    yield "redundant", random_case(1, 9, 1)
    yield "two coordinates", random_case(2, 6, 2)
    yield "three coordinates", random_case(3, 18, 3)
    yield "as many muscles as coordinates", random_case(4, 3, 3)
    duplicated = random_case(5, 4, 2)
    yield (
        "duplicated muscles",
        Case(
            np.repeat(duplicated.r, 3, axis=0),
            3.0 * duplicated.Q_m,
            np.repeat(duplicated.F_min, 3),
            np.repeat(duplicated.F_max, 3),
        ),
    )
    yield "muscle without arm", Case([[0.05], [0.0], [-0.04]], [10.0], 1.0, 500.0)
    yield "coordinate without muscles", Case([[0.05, 0.0], [-0.04, 0.0]], [10.0, 0.0], 1.0, 500.0)
    yield "equal columns", Case([[0.05, 0.05], [0.02, 0.02]], [20.0, 20.0], 0.0, 1000.0)
    yield "unreachable muscle", Case([[0.05], [0.04]], [20.0], 0.0, [1000.0, 0.0])
    yield "very different arms", Case([[1e-5], [0.05], [2.0]], [30.0], 0.0, 1000.0)
    all_high = random_case(6, 5, 2)
    yield (
        "all at upper bounds",
        Case(all_high.r, all_high.r.T @ all_high.F_max, all_high.F_min, all_high.F_max),
    )
    yield (
        "all at lower bounds",
        Case(all_high.r, all_high.r.T @ all_high.F_min, all_high.F_min, all_high.F_max),
    )
    yield "no room", Case([[0.05], [-0.03]], [0.05 * 40 - 0.03 * 70], [40.0, 70.0], [40.0, 70.0])
    yield "reserves", with_reserves(random_case(7, 6, 3), hip=10.0, ankle=1.0)


ZOO = dict(zoo())


@pytest.mark.parametrize("solver", em.Solver)
@pytest.mark.parametrize("name", ZOO)
def test_zoo_is_solved_to_optimality(name, solver):
    case = ZOO[name]
    found = case.solve(solver)
    assert found.residual <= ACCEPTED
    check_optimal(case, found)


@pytest.mark.parametrize("name", ZOO)
def test_solvers_agree(name):
    case = ZOO[name]
    daqp, osqp = case.solve(em.Solver.DAQP), case.solve(em.Solver.OSQP)
    np.testing.assert_allclose(daqp.force / case.N, osqp.force / case.N, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("name", ZOO)
def test_the_users_solver_is_asked_first(name, monkeypatch):
    asked = []

    def spied(solver, original):
        def spy(problem):
            asked.append(solver)
            return original(problem)

        return spy

    for solver, original in list(optimization.SOLVERS.items()):
        monkeypatch.setitem(optimization.SOLVERS, solver, spied(solver, original))
    for solver in em.Solver:
        asked.clear()
        ZOO[name].solve(solver)
        assert asked == [solver]


@pytest.mark.parametrize("name", ZOO)
def test_daqp_is_asked_as_qpsolvers_asks_it(name):
    problem = ScaledProblem(ZOO[name].demand())
    x, y = optimization.SOLVERS[em.Solver.DAQP](problem)
    same = qpsolvers.Problem(
        problem.P, problem.q, A=problem.A, b=problem.b, lb=problem.lb, ub=problem.ub
    )
    solution = qpsolvers.solve_problem(same, solver="daqp")
    np.testing.assert_array_equal(x, solution.x)
    np.testing.assert_array_equal(y, solution.y)


def test_duplicated_muscles_share():
    forces = ZOO["duplicated muscles"].solve().force.reshape(4, 3)
    np.testing.assert_allclose(forces, forces[:, :1] * np.ones(3), rtol=1e-10)


@pytest.mark.parametrize("seed", range(10))
def test_closed_form_for_one_coordinate(seed):
    """F_i = clip(N_i^2 r_i lambda, F_min, F_max), lambda from the torque."""
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, 12))
    case = random_case(100 + seed, m, 1)
    case.r = rng.uniform(0.01, 0.06, (m, 1)) * rng.choice([-1.0, 1.0], (m, 1))
    case.Q_m = case.r.T @ (case.F_min + rng.uniform(0.0, 1.0, m) * (case.F_max - case.F_min))

    def force(multiplier):
        return np.clip(case.N**2 * case.r[:, 0] * multiplier, case.F_min, case.F_max)

    multiplier = brentq(
        lambda x: case.r[:, 0] @ force(x) - case.Q_m[0], -1.0, 1.0, xtol=1e-18, rtol=1e-15
    )
    expected = force(multiplier)
    np.testing.assert_allclose(case.solve().force / case.N, expected / case.N, rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_general_optimizer_finds_nothing_better(seed):
    case = random_case(200 + seed, 8, 3)
    found = case.solve().force / case.N
    slsqp = minimize(
        lambda x: x @ x,
        np.full(8, 0.3),
        jac=lambda x: 2.0 * x,
        bounds=list(zip(case.F_min / case.N, case.F_max / case.N, strict=True)),
        constraints={"type": "eq", "fun": lambda x: case.r.T @ (case.N * x) - case.Q_m},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert slsqp.success
    np.testing.assert_allclose(found, slsqp.x, atol=1e-5)
    assert found @ found <= slsqp.fun * (1.0 + 1e-7)


# -- the residual itself --------------------------------------------------------------------------


def solved(case):
    problem = ScaledProblem(case.demand())
    x, y = optimization.SOLVERS[em.Solver.DAQP](problem)
    return x, y, (problem.A, problem.b, problem.lb, problem.ub)


def test_residual_of_a_solution_is_zero():
    for name in ("redundant", "two coordinates", "three coordinates", "all at upper bounds"):
        x, y, rest = solved(ZOO[name])
        assert kkt_residual(x, x, y, *rest) < 1e-12


def test_residual_sees_a_wrong_torque():
    x, y, (A, b, low, high) = solved(ZOO["two coordinates"])
    wrong = b + np.array([0.0, 1e-3])
    assert kkt_residual(x, x, y, A, wrong, low, high) == pytest.approx(1e-3, rel=1e-6)


def test_residual_sees_a_feasible_point_that_is_not_optimal():
    x, y, (A, b, low, high) = solved(ZOO["three coordinates"])
    free = (x > low + 1e-6) & (x < high - 1e-6)
    assert free.sum() > 3
    kernel = np.linalg.svd(A[:, free])[2][-1]  # changes forces, not the torque
    other = x.copy()
    other[free] += 1e-4 * kernel
    assert (other >= low - 1e-12).all()
    assert (other <= high + 1e-12).all()
    assert kkt_residual(other, other, y, A, b, low, high) == pytest.approx(
        1e-4 * abs(kernel).max(), rel=1e-6
    )


def test_residual_sees_wrong_multipliers_and_bounds():
    x, y, (A, b, low, high) = solved(ZOO["redundant"])
    assert kkt_residual(x, x, 1.1 * y, A, b, low, high) > 1e-3
    assert kkt_residual(x, x, y, A, b, low, np.minimum(high, x.max() - 0.01)) > 5e-3


@pytest.mark.parametrize("position", range(6))
def test_residual_sees_nan(position):
    x, y, rest = solved(ZOO["two coordinates"])
    unknown = np.where(np.arange(6) == position, np.nan, x)
    assert np.isnan(kkt_residual(unknown, unknown, y, *rest))
    for j in range(2):
        wrong = np.where(np.arange(2) == j, np.nan, y)
        assert np.isnan(kkt_residual(x, x, wrong, *rest))


@pytest.mark.parametrize("wrong", ["nan", "far", "nothing", "rough"])
def test_an_unusable_answer_is_found_without_the_solver(wrong, monkeypatch):
    original = optimization.SOLVERS[em.Solver.DAQP]

    def broken(problem):
        x, y = original(problem)
        return {"nan": (x * np.nan, y), "far": (x + 0.1, y), "rough": (x + 1e-9, y)}.get(wrong)

    case = ZOO["two coordinates"]
    good = case.solve()
    monkeypatch.setitem(optimization.SOLVERS, em.Solver.DAQP, broken)
    found = case.solve()
    assert found.residual <= 1e-13
    np.testing.assert_allclose(found.force / case.N, good.force / case.N, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("name", ZOO)
def test_no_solver_at_all(name, monkeypatch):
    """What serves out of reach finds the same forces within it."""
    case = ZOO[name]
    good = case.solve()
    monkeypatch.setitem(optimization.SOLVERS, em.Solver.DAQP, lambda problem: None)
    found = case.solve()
    assert found.residual <= 1e-13
    assert (found.unmet == 0.0).all()
    np.testing.assert_allclose(found.force / case.N, good.force / case.N, rtol=0.0, atol=1e-11)


def test_osqp_gives_up(monkeypatch):
    """Whether it has no answer or raises an error of its own."""

    def broken(problem, solver, **options):
        raise qpsolvers.SolverError("no")

    case = ZOO["two coordinates"]
    good = case.solve()
    monkeypatch.setitem(optimization.OSQP, "max_iter", 1)
    np.testing.assert_allclose(case.solve(em.Solver.OSQP).force, good.force, rtol=1e-9)
    monkeypatch.setattr(qpsolvers, "solve_problem", broken)
    np.testing.assert_allclose(case.solve(em.Solver.OSQP).force, good.force, rtol=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_demand_that_is_not_finite(bad):
    case = random_case(1, 4, 2)
    case.Q_m = np.array([1.0, bad])
    with pytest.raises(em.RecruitmentError, match="not finite"):
        case.solve()


# -- ideal actuators ------------------------------------------------------------------------------


def test_reserves_help_where_the_muscles_do_not_suffice():
    found = with_reserves(Case([[0.05], [-0.05]], [80.0], 0.0, 1000.0), hip=1.0).solve()
    np.testing.assert_allclose(found.force, [1000.0, 0.0, 30.0], atol=1e-4)
    assert found.torque[0] == pytest.approx(80.0)
    assert found.unmet[0] == 0.0


def test_a_strong_reserve_is_cheap():
    """F / N^2 = lambda r and tau / opt^2 = lambda: the torque is shared as (r N)^2 to opt^2."""
    found = with_reserves(Case([[0.05]], [20.0], 0.0, 1000.0), hip=100.0).solve()
    shares = np.array([50.0**2, 100.0**2])
    np.testing.assert_allclose(found.force * [0.05, 1.0], 20.0 * shares / shares.sum())


def test_reserve_on_a_coordinate_without_muscles():
    case = Case([[0.05, 0.0], [-0.05, 0.0]], [10.0, 7.0], 0.0, 1000.0)
    found = with_reserves(case, knee=2.0).solve()
    assert found.force[2] == pytest.approx(7.0)
    np.testing.assert_allclose(found.torque, [10.0, 7.0])
