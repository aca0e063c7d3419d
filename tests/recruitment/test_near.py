"""A recruitment that starts from the bounds that forces were at before."""

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.recruitment import optimization
from exudyn_muscles.recruitment.demand import Demand
from exudyn_muscles.recruitment.optimization import Recruiter
from exudyn_muscles.recruitment.problem import ScaledProblem
from models import leg

from .problems import draw


def demand(problem, near=None):
    return Demand(*problem[:5], near=near)


@pytest.mark.parametrize("seed", range(40))
def test_the_answer_is_the_same_wherever_it_starts(seed):
    """From its own bounds, from those of nowhere, and from guesses that cannot be."""
    rng = np.random.default_rng(seed)
    problem, recruiter = draw(rng, decades=1.0), Recruiter()
    cold = recruiter.solve(demand(problem))
    m = cold.force.size
    guesses = [cold.at_bounds, np.ones(m, int), -np.ones(m, int), rng.integers(-1, 2, m)]
    for near in guesses:
        warm = recruiter.solve(demand(problem, near))
        assert warm.met == cold.met
        costs = [np.sum((found.force / problem.N) ** 2) for found in (warm, cold)]
        np.testing.assert_allclose(*costs, rtol=1e-7)
        assert warm.residual <= 1e-9


def test_bounds_are_told():
    r, N = np.array([[1.0], [1.0], [1.0]]), np.ones(3)
    found = Recruiter().solve(
        Demand(r, np.array([1.9]), np.array([0.0, 0.7, 0.0]), np.array([0.3, 0.9, 2.0]), N)
    )
    np.testing.assert_array_equal(found.at_bounds, [1, 0, 0])
    found = Recruiter().solve(
        Demand(r, np.array([0.8]), np.array([0.0, 0.7, 0.0]), np.array([0.3, 0.9, 2.0]), N)
    )
    np.testing.assert_array_equal(found.at_bounds, [0, -1, 0])


@pytest.mark.parametrize(
    "method", [em.static_optimization, em.computed_muscle_control, em.cosimulate]
)
def test_runs_start_from_the_step_before(monkeypatch, method):
    """No solver is asked, and the result is the same within the certificate's limit."""
    asked = [0]
    solve, from_bounds = optimization.daqp.solve, optimization.from_bounds

    def counted(*arguments, **options):
        asked[-1] += 1
        return solve(*arguments, **options)

    monkeypatch.setattr(optimization.daqp, "solve", counted)
    model, motion = leg.build(), leg.motion()
    warm = method(model, motion)
    asked.append(0)
    monkeypatch.setattr(
        optimization, "from_bounds", lambda *given: (*from_bounds(*given)[:2], False)
    )
    cold = method(model, motion)
    assert asked[0] < 0.1 * asked[1]
    np.testing.assert_allclose(warm.coordinates, cold.coordinates, rtol=0, atol=1e-8)


def test_guesses_lead_to_the_solution_where_there_is_one():
    """With reserves, which let every demand be met, and a tenth of all bounds wrong; but where
    equations are worse conditioned than the square root of rounding."""
    solved = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        r, Q_m, low, high, N = draw(rng, decades=1.0)[:5]
        n = Q_m.size
        within = Demand(
            np.vstack([r, np.eye(n)]), Q_m, np.append(low, np.full(n, -np.inf)),
            np.append(high, np.full(n, np.inf)), np.append(N, 10.0 ** rng.uniform(-1, 1, n)),
        )  # fmt: skip
        near = Recruiter().solve(within).at_bounds
        near = np.where(rng.random(near.size) < 0.1, rng.integers(-1, 2, near.size), near)
        problem = ScaledProblem(within._replace(near=near))
        x, y, found = optimization.from_bounds(
            problem.A, problem.b, problem.lb, problem.ub, problem.near
        )
        solved += found and problem.residual(x, y) <= 1e-10
    assert solved >= 190


def test_bounds_without_a_solution_lead_nowhere():
    """The demand is twice what is within reach."""
    r, ones = np.array([[1.0, 0.0], [1.0, 0.5]]), np.ones(2)
    problem = ScaledProblem(
        Demand(r, np.array([4.0, 1.0]), np.zeros(2), ones, ones, near=np.zeros(2))
    )
    assert not optimization.from_bounds(problem.A, problem.b, problem.lb, problem.ub, problem.near)[
        2
    ]


def test_at_the_edge_of_what_is_within_reach_daqp_is_exact():
    """A demand that a bound just lets through: DAQP's own tolerance would have passed it."""
    r = np.array([[1.0, 0.5], [0.3, -1.0], [-0.7, 0.2], [0.2, 1.0]])
    low, high = np.zeros(4), np.array([1.0, 0.8, 0.9, 1.1])
    edge = np.array([1.0, 0.0, 0.0, 1.1])  # a corner: the largest torque about both
    for short in (1e-7, 1e-6, 1e-5):
        found = Recruiter().solve(Demand(r, (1.0 - short) * (r.T @ edge), low, high, np.ones(4)))
        assert found.met
        assert found.residual <= 1e-12


def test_fewer_demands_within_reach_need_the_nearest_torque(monkeypatch):
    """Which takes fifty times as long: of 300 random ones, most of them with reserves."""
    nearest, needed = optimization.nearest, [0]

    def asked(problem, weights):
        x, residual, loose = nearest(problem, weights)
        needed[-1] += problem.recruited(x, residual).met
        return x, residual, loose

    monkeypatch.setattr(optimization, "nearest", asked)
    for exact in (optimization.EXACT, optimization.USUAL):
        monkeypatch.setattr(optimization, "EXACT", exact)
        for seed in range(300):
            Recruiter().solve(demand(draw(np.random.default_rng(seed), decades=1.0)))
        needed.append(0)
    assert needed[0] < needed[1]
