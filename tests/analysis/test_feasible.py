"""Ranges of forces against another solver, and with the force at an end prescribed."""

import numpy as np
import pytest
from scipy.optimize import linprog

import exudyn_muscles as em
from exudyn_muscles import analysis
from exudyn_muscles.analysis.feasible import force_ranges
from exudyn_muscles.recruitment.demand import Demand
from exudyn_muscles.recruitment.optimization import Recruiter
from exudyn_muscles.recruitment.settings import RecruitmentSettings
from models import leg

GIVEN = RecruitmentSettings()


def recruit(r, Q_m, low, high, N):
    return Recruiter(GIVEN.solver, GIVEN.coordinate_weights).solve(Demand(r, Q_m, low, high, N))


def random_recruitment(seed, m=20, n=6):
    rng = np.random.default_rng(seed)
    r = rng.normal(0.0, 0.03, (m, n))
    N = rng.uniform(200.0, 3000.0, m)
    low = rng.uniform(0.0, 0.1, m) * N
    high = low + rng.uniform(0.1, 0.8, m) * N
    Q_m = r.T @ rng.uniform(low, high)
    found = recruit(r, Q_m, low, high, N)
    assert found.met
    return r, Q_m, found.force, low, high, N


@pytest.mark.parametrize("seed", range(5))
def test_against_one_program_a_muscle_by_another_solver(seed):
    r, Q_m, F, low, high, N = random_recruitment(seed)
    least, largest = force_ranges(r, F, low, high, N)
    options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    for i in range(F.size):
        for sign, found in ((1.0, least[i]), (-1.0, largest[i])):
            cost = np.zeros(F.size)
            cost[i] = sign
            other = linprog(
                cost, A_eq=(r * N[:, None]).T, b_eq=r.T @ F,
                bounds=np.column_stack((low / N, high / N)), method="highs-ipm", options=options,
            )  # fmt: skip
            assert found == pytest.approx(N[i] * other.x[i], abs=1e-8 * N.max())


@pytest.mark.parametrize("seed", range(3))
def test_every_end_can_be_recruited_and_nothing_beyond(seed):
    r, Q_m, F, low, high, N = random_recruitment(seed)
    for end, outward in zip(force_ranges(r, F, low, high, N), (-1.0, 1.0), strict=True):
        assert (outward * (end - F) > -1e-6).all()
        for i in range(F.size):
            for beyond in (0.0, outward * 1e-3 * N[i]):
                lower, upper = low.copy(), high.copy()
                lower[i] = upper[i] = end[i] + beyond
                if beyond and not low[i] <= lower[i] <= high[i]:
                    continue
                unmet = np.abs(recruit(r, Q_m, lower, upper, N).unmet).max()
                assert (unmet > 1e-5) == bool(beyond)


def test_along_a_run():
    model, motion = leg.build(), leg.motion()
    result = em.static_optimization(model, motion)
    table = analysis.feasible_forces(model, result)
    least, F, largest = (table[f"force_{x}"] for x in ("least", "optimal", "largest"))
    assert len(table.time) == result.windows
    assert (least <= F + 1e-6).all() and (largest + 1e-6 >= F).all()
    assert (least >= result.force_min - 1e-6).all() and (largest <= result.force_max + 1e-6).all()
    # 19 muscles and six coordinates: there is room.
    assert np.median(largest - least) > 50.0


def test_activations_of_ranges_lead_to_their_forces():
    """A window with the muscle held at the range's end ends there, as `integrate_window` has it."""
    model, motion = leg.build(), leg.motion()
    result = em.static_optimization(model, motion.between(motion.start, motion.start + 0.1))
    found = analysis.feasible_forces(model, result)
    at = np.searchsorted(result.time, result.window_time - 1e-9)
    optimal = result.activations[at[1:]]
    np.testing.assert_allclose(found["activation_optimal"], optimal, atol=1e-6)
    least, largest = found["activation_least"], found["activation_largest"]
    assert (least <= optimal + 1e-6).all() and (optimal <= largest + 1e-6).all()
    assert ((least >= model.muscles.minimum_activation - 1e-12) & (largest <= 1.0)).all()
    # More force is more activation, and no range of one is a range of nothing of the other.
    room = found["force_largest"] - found["force_least"] > 1.0
    assert room.any() and (largest - least)[room].min() > 0.0
