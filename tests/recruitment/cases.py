"""Recruitments for the tests, and what an optimal one fulfils."""

import numpy as np
from scipy.optimize import lsq_linear

import exudyn_muscles as em
from exudyn_muscles.recruitment.demand import Demand
from exudyn_muscles.recruitment.optimization import Recruiter


class Case:
    """A `Demand`."""

    def __init__(self, r, Q_m, F_min, F_max, N=None):
        self.r = np.array(r, dtype=float)
        m = len(self.r)
        self.Q_m = np.array(Q_m, dtype=float)
        self.F_min = np.zeros(m) + F_min
        self.F_max = np.zeros(m) + F_max
        self.N = np.maximum(self.F_max, 1.0) if N is None else np.zeros(m) + N

    def demand(self):
        return Demand(self.r, self.Q_m, self.F_min, self.F_max, self.N)

    def solve(self, solver=em.Solver.DAQP, weights=1.0):
        return Recruiter(solver, weights).solve(self.demand())


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
