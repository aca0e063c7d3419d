"""Demands out of reach, and those that a solver of limited precision gets wrong."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import exudyn_muscles as em
from exudyn_muscles.recruitment import optimization
from exudyn_muscles.recruitment.demand import Demand
from exudyn_muscles.recruitment.problem import ScaledProblem

from .cases import Case, check_optimal, random_case, with_reserves
from .problems import complaints, draw


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
    np.testing.assert_array_equal(found.force[~idle], expected[~idle])
    np.testing.assert_allclose(found.torque, case.r.T @ found.force)
    np.testing.assert_array_equal(found.unmet, case.Q_m - found.torque)
    assert abs(found.unmet[0]) > 1.0


def independent(case, weights):
    """The smallest scaled gap, by SciPy, of a problem whose unlimited actuators are reserves."""
    scaled = ScaledProblem(case.demand())
    A, b = weights[:, None] * scaled.A, weights * scaled.b
    free = np.isinf(scaled.lb)
    # Coordinates with an unlimited reserve are met whatever the others do.
    rows = ~(np.abs(A[:, free]) > 0.0).any(axis=1)
    A, b, low, high = A[rows][:, ~free], b[rows], scaled.lb[~free], scaled.ub[~free]
    best = lsq_linear(A, b, (low, high), method="bvls", tol=1e-15, max_iter=10000)
    return np.linalg.norm(A @ best.x - b)


@pytest.mark.parametrize("reserved", [False, True])
@pytest.mark.parametrize("seed", range(40))
def test_out_of_reach_an_independent_solver_finds_no_smaller_gap(seed, reserved):
    """With weak unlimited reserves on all coordinates but one, too."""
    rng = np.random.default_rng(seed)
    n = 2 + seed % 2
    case = random_case(300 + seed, int(rng.integers(4, 30)), n)
    able = np.abs(case.r).T @ case.F_max
    case.Q_m = rng.uniform(-2.0, 2.0, n) * able
    case.Q_m[seed % n] = rng.choice([-1.0, 1.0]) * rng.uniform(1.1, 3.0) * able[seed % n]
    if reserved:
        names = [name for k, name in enumerate(("hip", "knee", "ankle")[:n]) if k != seed % n]
        case = with_reserves(case, **dict(zip(names, 10.0 ** rng.uniform(-3, 2, n), strict=False)))
    weights = 10.0 ** rng.uniform(-2.0, 2.0, n)
    found = case.solve(weights=weights)
    weights = np.sqrt(weights / weights.min())
    gap = np.linalg.norm(weights * found.unmet / ScaledProblem(case.demand()).scale)
    best = independent(case, weights)
    assert best > 1e-3
    assert gap == pytest.approx(best, rel=1e-8)
    assert found.residual <= 1e-13
    np.testing.assert_array_equal(found.unmet, np.where(found.unmet, case.Q_m - found.torque, 0.0))
    # And no cheaper forces have this torque.
    reached = Case(case.r, found.torque, case.F_min, case.F_max, case.N).solve()
    costs = [np.sum((each.force / case.N) ** 2) for each in (found, reached)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)


@pytest.mark.parametrize("seed", range(300))
def test_random_problems(seed):
    """Never an error, always a residual, met if and only if within reach, and the nearest else."""
    assert complaints(draw(np.random.default_rng(seed))) == []


@pytest.mark.parametrize("seed", range(100))
def test_forces_and_normalising_forces_spread_over_twelve_decades(seed):
    assert complaints(draw(np.random.default_rng(1000 + seed), decades=12.0)) == []


@pytest.mark.parametrize("strength", [1e-3, 1.0, 1e6])
def test_what_counts_as_unmet_goes_with_what_a_row_can_do(strength):
    """A ten-millionth of it: beyond both muscles' 50 times the strength, by parts of that."""
    for beyond, met in ((3e-8, True), (3e-7, False)):
        demand = 50.0 * strength * (1.0 + beyond)
        case = Case([[0.05], [-0.05]], [demand], 0.0, [1000.0 * strength] * 2)
        assert (case.solve().unmet[0] == 0.0) == met


def test_out_of_reach_is_the_cheapest_of_the_nearest():
    """Coordinate 1 is out of reach, coordinate 2 is not: there the muscles share by (10)."""
    r = [[0.05, 0.0], [0.0, 0.04], [0.0, 0.04], [0.0, -0.04]]
    case = Case(r, [1000.0, 20.0], 0.0, 1000.0)
    found = case.solve()
    np.testing.assert_allclose(found.force, [1000.0, 250.0, 250.0, 0.0], atol=1e-10)
    np.testing.assert_allclose(found.unmet, [950.0, 0.0], rtol=1e-14)
    assert found.unmet[1] == 0.0


@pytest.mark.parametrize("seed", range(20))
def test_the_nearest_torque_is_shared_optimally(seed):
    case = random_case(500 + seed, 12, 3)
    case.Q_m[seed % 3] = 1.1 * np.abs(case.r[:, seed % 3]) @ case.F_max
    found = case.solve()
    assert found.unmet.any()
    reached = Case(case.r, found.torque, case.F_min, case.F_max, case.N)
    check_optimal(reached, found._replace(unmet=np.zeros(3)))


@pytest.mark.parametrize("reserved", [False, True])
@pytest.mark.parametrize("size", [1e6, 1e12, 1e60, 1e150, 1e300])
def test_demands_of_any_size(size, reserved):
    """As of a simulation that is lost: answered, or an error where squares overflow."""
    case = random_case(3, 9, 3)
    case.Q_m = case.Q_m * size
    if reserved:
        case = with_reserves(case, hip=1.0, knee=1e-3)
    try:
        found = case.solve()
    except em.RecruitmentError:
        assert size > 1e100
        return
    assert found.residual <= 1e-13
    np.testing.assert_array_equal(found.unmet == 0.0, [reserved, reserved, False])
    assert np.isfinite(found.force).all()


def test_coordinate_without_muscles_keeps_its_demand():
    case = Case([[0.05, 0.0], [-0.05, 0.0]], [10.0, 7.0], 0.0, 1000.0)
    found = case.solve()
    np.testing.assert_allclose(found.torque, [10.0, 0.0], atol=1e-12)
    np.testing.assert_array_equal(found.unmet, [0.0, 7.0])


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


def test_rows_are_scaled_to_length_one():
    arms, asked = np.array([[3.0, 0.0], [4.0, 0.0]]), np.array([10.0, 2.0])
    problem = ScaledProblem(Demand(arms, asked, np.zeros(2), *np.ones((2, 2))))
    np.testing.assert_allclose(problem.scale, [5.0, 1.0])  # nothing acts on the second
    np.testing.assert_allclose(problem.A, [[0.6, 0.8], [0.0, 0.0]])
    np.testing.assert_allclose(problem.b, [2.0, 0.0])
    assert problem.unreachable


# -- what counts as a gap is a row's own ----------------------------------------------------------


@pytest.mark.parametrize("demand", [0.0, 1e-17, 1e-15, -1e-12])
def test_arms_that_are_rounding_are_none(demand):
    """A muscle that crosses a coordinate by 1e-18 m does not, and the others get their torque."""
    case = Case([[0.05, 3e-18], [-0.05, 5e-18]], [20.0, demand], 0.0, 1000.0)
    found = case.solve()
    np.testing.assert_allclose(found.force, [400.0, 0.0], atol=1e-9)
    assert (found.unmet == 0.0).all()


DEMANDS = [*10.0 ** np.arange(-9, 7), -0.066]
# Arms and largest forces of what acts on a wrist beside a shoulder.
WRISTS = {
    "nothing": (0.0, 1000.0),
    "rounding": (3e-17, 1000.0),
    "rounding of the strongest": (1e-17, 1e6),
    "slack": (0.02, 0.0),
    "weak": (1e-4, 1e-3),
    "short": (1e-9, 1.0),
}


@pytest.mark.parametrize("demand", DEMANDS)
@pytest.mark.parametrize("wrist", WRISTS)
@pytest.mark.parametrize("optimal", [1.0, 1e6])
@pytest.mark.parametrize("arm", [0.05, 1.0], ids=["N m", "N"])
def test_a_strong_reserve_hides_no_unmet_torque(arm, optimal, wrist, demand):
    """On the shoulder; what the wrist lacks is what its own actuators cannot do."""
    own, strength = WRISTS[wrist]
    muscles = Case(
        [[arm, 0.0], [-arm, 0.0], [0.0, own], [0.0, -own]], [20.0, demand], 0.0,
        [1000.0, 1000.0, strength, strength], N=[1000.0, 1000.0, 1000.0, 1000.0],
    )  # fmt: skip
    found = with_reserves(muscles, hip=optimal).solve()
    able = own * strength if own > 1e-12 else 0.0
    lacks = np.sign(demand) * max(abs(demand) - able, 0.0)
    assert found.unmet[0] == 0.0
    if lacks:
        assert found.unmet[1] == pytest.approx(lacks, rel=1e-4 if abs(lacks) > 1e-7 * able else 0)
    else:
        assert found.unmet[1] == 0.0


def test_a_demand_that_is_rounding_of_another_is_none():
    """Beside 1e6 N m, 1e-10 N m where nothing acts; 1e-9 is a demand."""
    for demand, unmet in ((1e-10, 0.0), (1e-9, 1e-9)):
        found = Case([[1.0, 0.0]], [1e6, demand], 0.0, 1e7).solve()
        np.testing.assert_array_equal(found.unmet, [0.0, unmet])


@pytest.mark.parametrize("arm", [1e-17, -3e-18])
def test_unlimited_actuators_do_not_act_through_rounding(arm):
    """A force without limits and an arm of 1e-17 m is no torque beside a weak muscle."""
    r = [[1.0, arm], [1.0, 0.0], [0.0, 0.05]]
    low, high = [-np.inf, -np.inf, 0.0], [np.inf, np.inf, 100.0]
    found = Case(r, [0.0, 8.0], low, high, [1e3, 1e3, 100.0]).solve()
    np.testing.assert_allclose(found.force, [0.0, 0.0, 100.0], atol=1e-9)
    np.testing.assert_allclose(found.unmet, [0.0, 3.0])


@pytest.mark.parametrize("share", [0.1, 0.7, 1.0])
@pytest.mark.parametrize("weak", [1e-2, 1e-5, 1e-8])
def test_muscles_far_below_their_normalising_forces(weak, share):
    """What a solver calls close, in parts of N, may be more than all of a row's muscles can do."""
    r = [[0.05, 0.0], [-0.05, 0.0], [0.0, 0.04], [0.0, -0.03], [0.0, 0.02]]
    high = np.array([1000.0, 1000.0, weak, weak, 0.0])
    low = np.array([0.0, 0.0, 0.3 * weak, 0.1 * weak, 0.0])
    demand = 0.04 * weak * (0.3 + 0.7 * share) - 0.03 * 0.1 * weak
    found = Case(r, [20.0, demand], low, high, 1e6).solve()
    assert (found.unmet == 0.0).all()
    assert found.torque[1] == pytest.approx(demand, rel=1e-9)


def test_an_answer_that_leaves_something_unmet_is_none(monkeypatch):
    """The solver's conditions are fulfilled to 1e-8 of N, which is a tenth of what is wanted."""
    case = Case([[0.05, 0.0], [0.0, 0.04], [0.0, 0.02]], [20.0, 4e-6], 0.0, [1e3, 1e-3, 0.0], 1e4)
    good = case.solve()
    assert (good.unmet == 0.0).all()
    original = optimization.SOLVERS[em.Solver.DAQP]

    def rough(problem):
        x, y = original(problem)
        return x - 1e-9, y

    monkeypatch.setitem(optimization.SOLVERS, em.Solver.DAQP, rough)
    found = case.solve()
    assert (found.unmet == 0.0).all()
    np.testing.assert_allclose(found.force, good.force, rtol=1e-9)


# -- reserves and weights -------------------------------------------------------------------------


@pytest.mark.parametrize("optimal", [1e-3, 1e-2, 0.1, 1.0, 10.0])
@pytest.mark.parametrize("hip", [20.0, 60.0])
def test_a_dear_reserve_does_what_the_muscles_cannot(hip, optimal):
    """Whether or not the other coordinate is within reach, of which muscles give 50 and 40."""
    r = [[0.05, 0.0], [-0.05, 0.0], [0.0, 0.04], [0.0, -0.04]]
    found = with_reserves(Case(r, [hip, 60.0], 0.0, 1000.0), knee=optimal).solve()
    forces = [min(400.0 * hip / 20.0, 1000.0), 0.0, 1000.0, 0.0, 20.0]
    np.testing.assert_allclose(found.force, forces, atol=1e-7)
    np.testing.assert_allclose(found.unmet, [max(hip - 50.0, 0.0), 0.0], atol=1e-9)
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
    np.testing.assert_allclose(found.torque, [19.0, 19.0], rtol=1e-14)
    np.testing.assert_allclose(found.unmet, [-9.0, 1.0], rtol=1e-12)


def test_weights_change_nothing_within_reach():
    case = random_case(3, 18, 3)
    weighted = case.solve(weights=[1.0, 100.0, 10.0])
    np.testing.assert_array_equal(weighted.force, case.solve().force)
