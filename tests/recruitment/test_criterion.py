"""A criterion of one's own: its problem is solved and certified as the paper's is."""

from copy import copy
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.recruitment.demand import Demand
from exudyn_muscles.recruitment.optimization import Recruiter
from exudyn_muscles.recruitment.problem import ScaledProblem
from models import planar_arm


def recruit(criterion, solver=em.Solver.DAQP):
    """The function of a demand's arrays that recruits by a criterion."""
    recruiter = Recruiter(solver, problem_of=criterion.prepare(None))
    return lambda *arrays: recruiter.solve(Demand(*arrays))


@dataclass(frozen=True)
class SpareTheFirst:
    """As the paper's, with one muscle a hundred times as dear."""

    def prepare(self, model):
        def problem(demand):
            dearer = np.ones(demand.N.size)
            dearer[0] = 0.1
            return ScaledProblem(demand._replace(N=demand.N * dearer))

        return problem


def test_recruitment():
    r, high = np.array([[0.05], [0.05]]), np.array([1000.0, 1000.0])
    solve = recruit(SpareTheFirst())
    found = solve(r, np.array([10.0]), np.zeros(2), high, high)
    np.testing.assert_allclose(found.force, [200.0 / 101.0, 20000.0 / 101.0], rtol=1e-12)
    out = solve(r, np.array([110.0]), np.zeros(2), high, high)
    np.testing.assert_allclose(out.unmet, [10.0])


def test_in_a_run():
    model, motion = planar_arm.build(), planar_arm.motion().between(0.0, 0.2)
    plain, spared = (
        em.static_optimization(model, motion, settings=em.StaticSettings(criterion=criterion))
        for criterion in (em.SquaredForces(), SpareTheFirst())
    )
    assert spared.force_optimal[:, 0].sum() < plain.force_optimal[:, 0].sum()
    np.testing.assert_allclose(spared.torques_delivered, plain.torques_delivered, atol=1e-9)


class Near(ScaledProblem):
    """min |x - 1/2|^2/2: forces near half of their normalising ones."""

    of_squares = False

    def gradient(self, x):
        return x - 0.5

    def solved(self, ask):
        program = copy(self)
        program.q = np.full(self.lb.size, -0.5)
        return ask(program)


@pytest.mark.parametrize("solver", em.Solver)
def test_another_cost_is_certified_by_its_own_gradient(solver):
    """Both carry the half of their normalising forces and the same share of what is left."""
    r, high = np.array([[0.05], [0.05]]), np.array([1000.0, 1000.0])
    solve = recruit(SimpleNamespace(prepare=lambda model: Near), solver)
    found = solve(r, np.array([60.0]), np.zeros(2), high, high)
    np.testing.assert_allclose(found.force, 600.0, rtol=1e-7)
    assert found.residual < 1e-7
    opposed = np.array([[0.05], [-0.05]])
    found = solve(opposed, np.array([10.0]), np.zeros(2), high, high)
    np.testing.assert_allclose(found.force, [600.0, 400.0], rtol=1e-7)


@pytest.mark.parametrize("power", [2.0, 2.5, 3.0, 5.0])
@pytest.mark.parametrize("solver", em.Solver)
def test_powers(power, solver):
    """Of two muscles with one arm: x_i of N_i, of which N_i x_i^(p-1) are as 1 to 1."""
    solve = recruit(em.PoweredForces(power), solver)
    r, N = np.array([[0.05], [0.05]]), np.array([1000.0, 300.0])
    found = solve(r, np.array([30.0]), np.zeros(2), N, N)
    share = (N[1] / N[0]) ** (1.0 / (power - 1.0))
    x = 600.0 / (N[0] + N[1] * share)
    np.testing.assert_allclose(found.force, N * [x, x * share], rtol=1e-6)
    assert found.met and found.residual < 1e-7


def test_powers_of_many_muscles():
    """Certified, within bounds, and no dearer than any other forces with the same torque."""
    rng = np.random.default_rng(7)
    for _ in range(30):
        m, n = rng.integers(2, 30), rng.integers(1, 5)
        r, high = 0.05 * rng.normal(size=(m, n)), rng.uniform(100.0, 2000.0, m)
        low, N = 0.02 * high, high * rng.uniform(0.5, 1.5, m)
        given = low + (high - low) * rng.uniform(0.0, 0.8, m)
        for power in (2.5, 3.0, 5.0):
            solve = recruit(em.PoweredForces(power))
            found = solve(r, r.T @ given, low, high, N)
            assert found.met and found.residual < 1e-10
            assert ((found.force / N) ** power).sum() <= ((given / N) ** power).sum()


def test_powers_out_of_reach_and_out_of_range():
    solve = recruit(em.PoweredForces(3.0))
    r, high = np.array([[0.05], [0.05]]), np.array([1000.0, 1000.0])
    np.testing.assert_allclose(solve(r, np.array([110.0]), np.zeros(2), high, high).unmet, 10.0)
    with pytest.raises(em.ParameterError, match=r"exponent = 11 is outside \[2, 10\]"):
        em.PoweredForces(11)


def test_something_else_is_an_error():
    with pytest.raises(
        em.ParameterError, match="criterion = 3 is no object with a function prepare"
    ):
        em.StaticSettings(criterion=3)
