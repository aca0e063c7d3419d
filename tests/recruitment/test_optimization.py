"""Recruitment (10): optimality, agreement of the solvers, demands out of reach."""

import numpy as np
import pytest
import qpsolvers
from scipy.optimize import brentq, lsq_linear, minimize

import exudyn_muscles as em
from exudyn_muscles.recruitment import optimization
from exudyn_muscles.recruitment.optimization import (
    ACCEPTED,
    Recruiter,
    ScaledProblem,
    kkt_residual,
    nearest,
)


class Case:
    """Arguments of `Recruiter.solve`."""

    def __init__(self, r, Q_m, F_min, F_max, N=None):
        self.r = np.array(r, dtype=float)
        m = len(self.r)
        self.Q_m = np.array(Q_m, dtype=float)
        self.F_min = np.zeros(m) + F_min
        self.F_max = np.zeros(m) + F_max
        self.N = np.maximum(self.F_max, 1.0) if N is None else np.zeros(m) + N

    def arguments(self):
        return self.r, self.Q_m, self.F_min, self.F_max, self.N

    def solve(self, solver=em.Solver.DAQP, weights=1.0):
        return Recruiter(solver, weights).solve(*self.arguments())


def random_case(seed, m, n, reach=0.6):
    """A demand that some forces well between their bounds deliver."""
    rng = np.random.default_rng(seed)
    r = rng.uniform(-0.06, 0.06, (m, n)) * (rng.random((m, n)) < 0.7)
    F_max = rng.uniform(200.0, 3000.0, m)
    F_min = rng.uniform(0.0, 0.1, m) * F_max
    F = F_min + rng.uniform(0.0, reach, m) * (F_max - F_min)
    return Case(r, r.T @ F, F_min, F_max)


def with_reserves(case, **optimal):
    """A case with ideal actuators on some coordinates, as the methods add them."""
    columns = np.eye(case.r.shape[1])[[("hip", "knee", "ankle").index(name) for name in optimal]]
    strength = list(optimal.values())
    return Case(
        np.vstack([case.r, columns]),
        case.Q_m,
        np.append(case.F_min, np.full(len(strength), -np.inf)),
        np.append(case.F_max, np.full(len(strength), np.inf)),
        np.append(case.N, strength),
    )


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


def check_optimal(case, found):
    """The KKT conditions of (10) in forces, with multipliers fitted here.

    2 F / N^2 = r lambda where a force is free, and the sign that its bound allows elsewhere.
    """
    assert (found.force >= case.F_min).all()
    assert (found.force <= case.F_max).all()
    np.testing.assert_allclose(found.torque, case.Q_m, atol=1e-8 * max(1.0, abs(case.Q_m).max()))
    assert (found.unmet == 0.0).all()
    A, x = case.r * case.N[:, None], found.force / case.N
    low, high = case.F_min / case.N, case.F_max / case.N
    # There must be a lambda with x - A lambda >= 0 at the lower bounds, <= 0 at the upper ones and
    # = 0 between: a linear feasibility problem, solved as bounded least squares with slacks.
    at_low, at_high = x <= low + 1e-9, x >= high - 1e-9
    slack_low = np.where(at_high, -np.inf, 0.0)
    slack_high = np.where(at_low, np.inf, 0.0)
    free = np.full(A.shape[1], np.inf)
    moving = slack_high > slack_low
    system = np.hstack([A, np.eye(x.size)[:, moving]])
    scale = np.linalg.norm(system, axis=0)
    scale[scale == 0.0] = 1.0
    fit = lsq_linear(
        system / scale,
        x,
        (np.append(-free, slack_low[moving]), np.append(free, slack_high[moving])),
        method="bvls",
        tol=1e-15,
    )
    assert np.linalg.norm(system / scale @ fit.x - x) < 1e-8


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
    original = qpsolvers.solve_problem

    def spy(problem, solver, **options):
        asked.append(solver)
        return original(problem, solver=solver, **options)

    monkeypatch.setattr(optimization.qpsolvers, "solve_problem", spy)
    for solver in em.Solver:
        asked.clear()
        ZOO[name].solve(solver)
        assert asked[0] == solver.value


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
    problem = ScaledProblem(*case.arguments())
    solution = qpsolvers.solve_problem(problem, solver="daqp")
    rest = problem.A, problem.b, problem.lb, problem.ub
    return solution.x, solution.y, rest


def test_residual_of_a_solution_is_zero():
    for name in ("redundant", "two coordinates", "three coordinates", "all at upper bounds"):
        x, y, rest = solved(ZOO[name])
        assert kkt_residual(x, y, *rest) < 1e-12


def test_residual_sees_a_wrong_torque():
    x, y, (A, b, low, high) = solved(ZOO["two coordinates"])
    wrong = b + np.array([0.0, 1e-3])
    assert kkt_residual(x, y, A, wrong, low, high) == pytest.approx(1e-3, rel=1e-6)


def test_residual_sees_a_feasible_point_that_is_not_optimal():
    x, y, (A, b, low, high) = solved(ZOO["three coordinates"])
    free = (x > low + 1e-6) & (x < high - 1e-6)
    assert free.sum() > 3
    kernel = np.linalg.svd(A[:, free])[2][-1]  # changes forces, not the torque
    other = x.copy()
    other[free] += 1e-4 * kernel
    assert (other >= low - 1e-12).all()
    assert (other <= high + 1e-12).all()
    assert kkt_residual(other, y, A, b, low, high) == pytest.approx(
        1e-4 * abs(kernel).max(), rel=1e-6
    )


def test_residual_sees_wrong_multipliers_and_bounds():
    x, y, (A, b, low, high) = solved(ZOO["redundant"])
    assert kkt_residual(x, 1.1 * y, A, b, low, high) > 1e-3
    assert kkt_residual(x, y, A, b, low, np.minimum(high, x.max() - 0.01)) > 5e-3


@pytest.mark.parametrize("position", range(6))
def test_residual_sees_nan(position):
    x, y, rest = solved(ZOO["two coordinates"])
    assert np.isnan(kkt_residual(np.where(np.arange(6) == position, np.nan, x), y, *rest))
    for j in range(2):
        wrong = np.where(np.arange(2) == j, np.nan, y)
        assert np.isnan(kkt_residual(x, wrong, *rest))


@pytest.mark.parametrize("wrong", ["nan", "far", "nothing", "error"])
def test_an_unusable_answer_is_asked_of_the_other_solver(wrong, monkeypatch):
    original = qpsolvers.solve_problem

    def broken(problem, solver, **options):
        solution = original(problem, solver=solver, **options)
        if solver == "daqp":
            if wrong == "error":
                raise qpsolvers.SolverError("no")
            solution.found = True
            solution.x = {"nan": solution.x * np.nan, "far": solution.x + 0.1}.get(wrong)
        return solution

    case = ZOO["two coordinates"]
    good = case.solve()
    monkeypatch.setattr(optimization.qpsolvers, "solve_problem", broken)
    found = case.solve()
    assert found.residual <= ACCEPTED
    np.testing.assert_allclose(found.force, good.force, atol=1e-8 * case.N.max())


def test_no_solver_at_all(monkeypatch):
    """Both give up: the bounded least squares still answer, with the same forces."""

    def broken(problem, solver, **options):
        raise qpsolvers.SolverError("no")

    case = ZOO["two coordinates"]
    good = case.solve()
    monkeypatch.setattr(optimization.qpsolvers, "solve_problem", broken)
    found = case.solve()
    assert (found.unmet == 0.0).all()
    np.testing.assert_allclose(found.force / case.N, good.force / case.N, atol=1e-6)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_demand_that_is_not_finite(bad):
    case = random_case(1, 4, 2)
    case.Q_m = np.array([1.0, bad])
    with pytest.raises(em.RecruitmentError, match="not finite"):
        case.solve()


# -- out of reach ---------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", em.Solver)
@pytest.mark.parametrize("demand", [500.0, -500.0])
def test_one_coordinate_out_of_reach(solver, demand):
    """All muscles that help at their maximum, all others at their minimum."""
    case = random_case(9, 6, 1)
    case.Q_m = np.array([demand])
    found = case.solve(solver)
    helps = case.r[:, 0] * np.sign(demand)
    expected = np.where(helps > 0.0, case.F_max, case.F_min)
    idle = helps == 0.0
    np.testing.assert_allclose(found.force[~idle], expected[~idle], rtol=1e-6)
    np.testing.assert_allclose(found.torque, case.r.T @ found.force)
    np.testing.assert_array_equal(found.unmet, case.Q_m - found.torque)
    assert abs(found.unmet[0]) > 1.0


@pytest.mark.parametrize("seed", range(12))
def test_out_of_reach_is_nearest(seed):
    """Against bounded least squares on the rows as the problem scales them."""
    n = 1 + seed % 3
    case = random_case(300 + seed, 7, n)
    rng = np.random.default_rng(seed)
    case.Q_m = case.Q_m + rng.normal(size=n) * 400.0
    A = case.r * case.N[:, None]
    scale = np.linalg.norm(A, axis=0)
    best = lsq_linear(
        (A / scale).T,
        case.Q_m / scale,
        (case.F_min / case.N, case.F_max / case.N),
        method="bvls",
        tol=1e-15,
    )
    gap = np.linalg.norm(A.T @ best.x / scale - case.Q_m / scale)
    assert gap > 1e-3  # it is out of reach
    found = case.solve()
    assert np.linalg.norm(found.unmet / scale) == pytest.approx(gap, abs=1e-7)
    np.testing.assert_allclose(found.torque / scale, A.T @ best.x / scale, atol=1e-6)
    np.testing.assert_allclose(found.unmet, case.Q_m - found.torque, atol=1e-6 * scale.max())


def test_out_of_reach_is_the_cheapest_of_the_nearest():
    """Coordinate 1 is out of reach, coordinate 2 is not: there the muscles share by (10)."""
    r = [[0.05, 0.0], [0.0, 0.04], [0.0, 0.04], [0.0, -0.04]]
    case = Case(r, [1000.0, 20.0], 0.0, 1000.0)
    found = case.solve()
    np.testing.assert_allclose(found.force, [1000.0, 250.0, 250.0, 0.0], atol=1e-3)
    assert found.unmet[0] == pytest.approx(950.0, abs=1e-4)
    assert found.unmet[1] == 0.0


def test_coordinate_without_muscles_keeps_its_demand():
    case = Case([[0.05, 0.0], [-0.05, 0.0]], [10.0, 7.0], 0.0, 1000.0)
    found = case.solve()
    np.testing.assert_allclose(found.torque, [10.0, 0.0], atol=1e-5)
    assert found.unmet[0] == 0.0
    assert found.unmet[1] == pytest.approx(7.0)


def test_reachable_maximum_below_the_minimum_holds_the_minimum():
    """A fibre that is pushed can end lower with more excitation: no room, not an error."""
    case = Case([[0.05], [0.03]], [20.0], [10.0, 5.0], [8.0, 2000.0], N=1000.0)
    found = case.solve()
    assert found.force[0] == 10.0
    assert found.torque[0] == pytest.approx(20.0)


def test_everything_fixed():
    case = Case([[0.05], [-0.03]], [100.0], [40.0, 70.0], [40.0, 70.0])
    found = case.solve()
    np.testing.assert_array_equal(found.force, [40.0, 70.0])
    assert found.unmet[0] == pytest.approx(100.0 - 0.05 * 40.0 + 0.03 * 70.0)


def test_nearest_meets_a_demand_within_reach():
    for name in ("redundant", "two coordinates", "three coordinates", "all at upper bounds"):
        case = ZOO[name]
        problem = ScaledProblem(*case.arguments())
        x, residual = nearest(problem)
        assert residual <= ACCEPTED
        np.testing.assert_allclose(problem.A @ x, problem.b, atol=1e-7)


def test_rows_are_scaled_to_length_one():
    problem = ScaledProblem(
        np.array([[3.0, 0.0], [4.0, 0.0]]), np.array([10.0, 2.0]), np.zeros(2), *np.ones((2, 2))
    )
    np.testing.assert_allclose(problem.scale, [5.0, 5.0])  # nothing acts on the second
    np.testing.assert_allclose(problem.A, [[0.6, 0.8], [0.0, 0.0]])
    np.testing.assert_allclose(problem.b, [2.0, 0.4])
    assert problem.unreachable


@pytest.mark.parametrize("demand", [0.0, 1e-17, 1e-15, -1e-12])
def test_arms_that_are_rounding_are_none(demand):
    """A muscle that crosses a coordinate by 1e-18 m does not, and the others get their torque."""
    case = Case([[0.05, 3e-18], [-0.05, 5e-18]], [20.0, demand], 0.0, 1000.0)
    found = case.solve()
    np.testing.assert_allclose(found.force, [400.0, 0.0], atol=1e-9)
    assert (found.unmet == 0.0).all()


DEAR = [1e-3, 1e-2, 0.1, 1.0, 10.0]


@pytest.mark.parametrize("optimal", DEAR)
@pytest.mark.parametrize("hip", [20.0, 60.0])
def test_a_dear_reserve_does_what_the_muscles_cannot(hip, optimal):
    """Whether or not the other coordinate is within reach, of which muscles give 50 and 40."""
    r = [[0.05, 0.0], [-0.05, 0.0], [0.0, 0.04], [0.0, -0.04]]
    found = with_reserves(Case(r, [hip, 60.0], 0.0, 1000.0), knee=optimal).solve()
    forces = [min(400.0 * hip / 20.0, 1000.0), 0.0, 1000.0, 0.0, 20.0]
    np.testing.assert_allclose(found.force, forces, atol=2e-5)
    np.testing.assert_allclose(found.unmet, [max(hip - 50.0, 0.0), 0.0], atol=1e-5)
    assert found.unmet[1] == 0.0


@pytest.mark.parametrize("optimal", [1.0, 1e3, 1e6])
@pytest.mark.parametrize("demand", [30.0, 51.05, 60.0])
def test_a_cheap_reserve_with_narrow_limits_takes_nothing_from_the_muscles(demand, optimal):
    case = Case([[0.05], [1.0]], [demand], [0.0, -1.0], [1000.0, 1.0], [1000.0, optimal])
    found = case.solve()
    assert found.torque[0] == pytest.approx(min(demand, 51.0))
    assert found.unmet[0] == pytest.approx(max(demand - 51.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("weights", [(1.0, 9.0), (2.0, 18.0)])
def test_a_coordinate_with_more_weight_comes_nearer_out_of_reach(weights):
    """One muscle on two coordinates with equal arms: the squared gaps are weighted 1 to 9."""
    case = Case([[0.05, 0.05]], [10.0, 20.0], 0.0, 1000.0)
    found = case.solve(weights=weights)
    np.testing.assert_allclose(found.torque, [19.0, 19.0], rtol=1e-6)
    np.testing.assert_allclose(found.unmet, [-9.0, 1.0], rtol=1e-5)


def test_weights_change_nothing_within_reach():
    case = ZOO["three coordinates"]
    weighted = case.solve(weights=[1.0, 100.0, 10.0])
    np.testing.assert_array_equal(weighted.force, case.solve().force)


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
