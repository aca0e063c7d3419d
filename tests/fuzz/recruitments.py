"""Random recruitment problems: bounds, the torque, the linear program that says what is within
reach, and the conditions of an optimum with multipliers of their own."""

import numpy as np
from scipy.optimize import linprog

import exudyn_muscles as em
from exudyn_muscles.recruitment.demand import Demand
from exudyn_muscles.recruitment.optimization import Recruiter

NEAR = 1e-6  # of the scaled problem
OPTIMAL = 1e-5  # what OSQP's noise may leave of its conditions
SMALLEST = 1e-8  # of the columns that HiGHS knows, ten times its small_matrix_value


def problem(rng):
    """r (m, n), lowest and highest forces and normalisers (m,), torques (n,)."""
    m, n = int(rng.integers(1, 15)), int(rng.integers(1, 6))
    r = rng.normal(0.0, 0.05, (m, n)) * (rng.random((m, n)) < rng.choice([0.3, 0.7, 1.0]))
    N = 10.0 ** rng.uniform(*rng.choice([[2.0, 3.5], [0.0, 4.0], [-4.0, 5.0]]), m)
    low = N * rng.uniform(0.0, 0.3, m) * rng.choice([0.0, 1.0], m)
    high = low + N * rng.uniform(0.0, 1.0, m)
    for k in range(m):
        if rng.random() < 0.2:  # a reserve
            r[k] = np.eye(n)[rng.integers(n)]
            limit = rng.choice([np.inf, 2.0])
            low[k], high[k] = -limit * N[k], limit * N[k]
    inside = np.clip(N * rng.uniform(-1.0, 1.0, m), low, high)
    Q = r.T @ inside + rng.choice([0.0, 0.01, 10.0]) * rng.normal(0.0, 5.0, n)
    return r, low, high, N, Q


def gap(A, b, low, high):
    """The least largest row of |A x - b|, by a linear program."""
    rows = np.block([[A, -np.ones((len(A), 1))], [-A, -np.ones((len(A), 1))]])
    bounds = [*zip(low, high, strict=True), (0.0, None)]
    found = linprog(
        np.append(np.zeros(A.shape[1]), 1.0), A_ub=rows, b_ub=np.append(b, -b), bounds=bounds
    )
    return found.fun if found.success else np.nan


def lack_of_optimality(A, x, low, high):
    """How far 2 x = A^T y + (multipliers of the bounds) is from having a solution, beside the
    sizes of x and y; NaN where HiGHS would take a column for zero."""
    if np.abs(A).max(axis=0).min() < SMALLEST:
        return np.nan
    at_low, at_high = x <= low + NEAR * (1.0 + abs(x)), x >= high - NEAR * (1.0 + abs(x))
    rows, right = [], []
    ones = np.ones(1)
    for k in range(x.size):
        if not at_low[k]:  # the gradient may not be positive
            rows.append(np.append(-A[:, k], -ones))
            right.append(-2.0 * x[k])
        if not at_high[k]:
            rows.append(np.append(A[:, k], -ones))
            right.append(2.0 * x[k])
    if not rows:
        return 0.0
    bounds = [(None, None)] * len(A) + [(0.0, None)]
    cost = np.append(np.zeros(len(A)), 1.0)
    found = linprog(cost, A_ub=np.array(rows), b_ub=right, bounds=bounds)
    if not found.success:
        return np.nan
    return found.fun / (1.0 + np.abs(x).max() + np.abs(found.x).max())


def check(rng):
    r, low, high, N, Q = problem(rng)
    recruiter = Recruiter(rng.choice(list(em.Solver)))
    found, again = (recruiter.solve(Demand(r, Q, low, high, N)) for _ in range(2))
    assert found.force.tobytes() == again.force.tobytes(), "other bits the second time"
    F, torque, unmet = found.force, found.torque, found.unmet
    assert np.isfinite(F).all() and np.isfinite(unmet).all(), f"not finite: {found}"
    assert ((low <= F) & (high >= F)).all(), "a force beyond its bounds"
    assert np.allclose(torque, r.T @ F, rtol=1e-12, atol=1e-12), "the torque is not r^T F"
    rows = r.T * N
    scale = np.linalg.norm(rows, axis=1)
    if not scale.all():
        return "with a coordinate that nothing acts on"
    A, b = rows / scale[:, None], Q / scale
    least = gap(A, b, low / N, high / N)
    left = np.abs(b - A @ (F / N)).max()
    if least > NEAR:
        assert unmet.any(), f"met, but the linear program misses it by {least}"
        return "out of reach"
    if not least <= 1e-9:
        return "undecided"
    assert not unmet.any() and left < NEAR, f"unmet by {left}, but within reach"
    lack = lack_of_optimality(A, F / N, low / N, high / N)
    assert not lack > OPTIMAL, f"not the optimum: {lack}"
    return "met"
