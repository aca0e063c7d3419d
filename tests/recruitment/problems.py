"""Random recruitments of every kind, and what can be proven of their answers.

`draw` makes a demand; `complaints` lists what is wrong with an answer, by
means that share no code with it: a linear program says whether the demand is within reach, and a
plane between the demand and everything within reach proves that no torque is nearer.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from exudyn_muscles.recruitment.certificate import ACCEPTED
from exudyn_muscles.recruitment.demand import Demand
from exudyn_muscles.recruitment.optimization import Recruiter
from exudyn_muscles.recruitment.problem import ScaledProblem

WIDE = np.longdouble
NOISE = 1e-17  # of arms
EPSILON = 2.0**-52


class Problem(NamedTuple):
    """What a `Demand` is made of, and the coordinates' weights (n,)."""

    r: np.ndarray
    Q_m: np.ndarray
    F_min: np.ndarray
    F_max: np.ndarray
    N: np.ndarray
    weights: np.ndarray


def draw(rng, decades=None):
    """A random problem, whose forces and normalising forces spread over so many `decades`."""
    r, F_min, F_max, N = muscles(rng, decades)
    n = r.shape[1]
    if rng.random() < 0.5:
        columns, limit, optimal = reserves(rng, n)
        r = np.vstack([r, columns])
        F_min, F_max = np.append(F_min, -limit * optimal), np.append(F_max, limit * optimal)
        N = np.append(N, optimal)
    weights = 10.0 ** rng.uniform(-2.0, 2.0, n) if rng.random() < 0.2 else np.ones(n)
    return Problem(r, demand(rng, r, F_min, F_max, N), F_min, F_max, N, weights)


def muscles(rng, decades):
    """Arms, bounds and normalising forces of 2 to 100 muscles on 1 to 30 coordinates."""
    m = int(rng.integers(2, 100 if rng.random() < 0.3 else 24))
    n = int(rng.integers(1, 31 if rng.random() < 0.15 else 9))
    r = rng.uniform(-1.0, 1.0, (m, n)) * rng.choice([1.0, 0.05], n)  # N beside N m
    kind = rng.choice(["dense", "sparse", "single"], p=[0.3, 0.5, 0.2])
    if kind == "sparse":
        r *= rng.random((m, n)) < rng.uniform(0.1, 0.7)
    elif kind == "single":
        r = np.where(np.arange(n) == rng.integers(0, n, m)[:, None], r, 0.0)
    if rng.random() < 0.3:
        r *= 10.0 ** rng.uniform(-3.0, 0.0, (m, 1))
    if rng.random() < 0.3:  # arms that are rounding
        r = np.where(rng.random((m, n)) < 0.3, rng.normal(size=(m, n)) * NOISE, r)
    if rng.random() < 0.15 and n > 1:  # a row that is a combination of others
        j = rng.integers(n)
        others = np.delete(np.arange(n), j)
        r[:, j] = r[:, others] @ rng.choice([0.0, 0.0, 1.0, -1.0, 0.5], n - 1)
    if rng.random() < 0.1:
        r[:, rng.integers(n)] = 0.0
    if rng.random() < 0.1:
        r[:, rng.integers(n)] = rng.normal(size=m) * NOISE
    if rng.random() < 0.1:
        r[rng.integers(m)] = 0.0
    if rng.random() < 0.2 and m > 3:  # muscles with the same arms
        r[m // 2 : m // 2 + m // 4] = r[: m // 4]
    spread = rng.choice([0.5, 1.5, 6.0, 12.0], p=[0.3, 0.4, 0.15, 0.15])
    spread = 0.5 * (spread if decades is None else decades)
    F_max = 1000.0 * 10.0 ** rng.uniform(-spread, spread, m)
    F_min = F_max * np.where(rng.random(m) < 0.5, 0.0, rng.uniform(0.0, 1.0, m) ** 3)
    N = np.maximum(F_max, 1e-3 * F_max.max())
    if rng.random() < 0.5:
        N = 1000.0 * 10.0 ** rng.uniform(-spread, spread, m)
    some = rng.random(m) < 0.2
    if rng.random() < 0.2:
        F_min[some] = F_max[some]
    if rng.random() < 0.1:  # bounds that cross
        F_min[some] = F_max[some] * rng.uniform(1.0, 1.1)
    if rng.random() < 0.1:
        F_min[some] = F_max[some] = 0.0
    return r, F_min, F_max, N


def reserves(rng, n):
    """Columns, limits of controls and optimal forces of ideal actuators on some coordinates."""
    on = np.flatnonzero(rng.random(n) < rng.choice([0.3, 0.6, 0.9]))
    if rng.random() < 0.3:
        on = np.delete(np.arange(n), rng.integers(n))  # on all but one
    k = on.size
    columns = np.zeros((k, n))
    columns[np.arange(k), on] = 1.0
    if rng.random() < 0.2:  # not only on their own
        columns += (columns == 0.0) * rng.uniform(-1, 1, (k, n)) * (rng.random((k, n)) < 0.3)
    low, high = (-3.0, 6.0) if rng.random() < 0.3 else (-1.0, 2.0)
    limit = np.where(rng.random(k) < 0.6, np.inf, 10.0 ** rng.uniform(-2.0, 2.0, k))
    return columns, limit, 10.0 ** rng.uniform(low, high, k)


def demand(rng, r, F_min, F_max, N):
    """Torques inside, at the border and outside of what is within reach, tiny and huge ones."""
    n, m = r.shape[1], len(r)
    high = np.maximum(F_min, F_max)
    low, high = np.where(np.isfinite(F_min), F_min, -N), np.where(np.isfinite(high), high, N)
    inside = r.T @ (low + rng.uniform(0.0, 1.0, m) * (high - low))
    kind = rng.choice(["inside", "vertex", "border", "beyond", "outside", "any", "none", "tiny"])
    if kind == "inside":
        return inside
    if kind == "vertex":
        return r.T @ np.where(rng.random(m) < 0.5, low, high)
    if kind in ("border", "beyond"):
        farthest = r.T @ np.where(r @ rng.normal(size=n) > 0.0, high, low)
        beyond = 10.0 ** rng.uniform(-14.0, -2.0) * rng.choice([-1.0, 1.0])
        return farthest * (1.0 + beyond if kind == "beyond" else 1.0)
    if kind == "outside":
        return inside * rng.uniform(1.0, 4.0) + rng.normal(size=n) * np.abs(r.T @ high).max()
    if kind == "any":
        return rng.normal(size=n) * 10.0 ** rng.uniform(-9.0, 6.0, n)
    return np.zeros(n) if kind == "none" else rng.normal(size=n) * 1e-9


def complaints(problem, counts=None):
    """What is wrong with the answer to a problem, as a list of words; `counts` is a Counter of what
    was looked at."""
    r, Q_m, F_min, F_max, N, weights = problem
    try:
        found = Recruiter(weights=weights).solve(Demand(*problem[:5]))
    except Exception as error:
        return [f"error {error!r}"]
    wrong = []
    high = np.maximum(F_min, F_max)
    if not ((found.force >= F_min).all() and (found.force <= high).all()):
        wrong.append("forces beyond their bounds")
    if not found.residual <= ACCEPTED:
        wrong.append(f"residual {found.residual:.2g}")
    if not ((found.unmet == 0.0) | (found.unmet == Q_m - r.T @ found.force)).all():
        wrong.append("unmet is not what is missing")
    unmet = bool(found.unmet.any())
    within = within_reach(problem, found.force)
    if within is True and unmet:
        wrong.append(f"unmet {found.unmet} within reach")
    nearest = unmet and within is not True
    if nearest:
        gap, least, rounding = distances(problem, found.force)
        if gap - least > 1e-8 * gap + rounding:
            wrong.append(f"gap {gap:.3g} may be {least:.3g}")
    if counts is not None:
        counts["problems"] += 1
        counts["met" if not unmet else "nearest"] += 1
        counts[{True: "within reach", False: "out of reach", None: "undecided"}[within]] += 1
        if within is False and not unmet:
            # Forces within their bounds prove the contrary.
            counts["linear programs that erred"] += 1
    return wrong


def tolerances(problem, F):
    """What counts as no gap (n,)."""
    return ScaledProblem(Demand(*problem[:5]))._tolerance(F)


def within_reach(problem, F):
    """Whether the demand is within reach, to what counts as no gap; None if that cannot be told.

    By the smallest largest gap of any row, over the row's own terms. True only if the forces found
    are a proof.
    """
    r, Q_m, low, high, N, _ = problem
    high, n = np.maximum(low, high), Q_m.size
    none = tolerances(problem, F)
    arms = np.where(np.abs(r.T) <= 1e-12 * np.abs(r).max(), 0.0, r.T)
    most = np.maximum(np.abs(low), np.abs(high))
    longest = np.abs(arms).max(axis=0)
    most[np.isinf(most)] = (np.abs(Q_m).max() / np.where(longest > 0.0, longest, 1.0))[
        np.isinf(most)
    ]
    most[most == 0.0] = 1.0
    A = arms * most
    rows = np.abs(Q_m) + np.abs(A).sum(axis=1)
    rows[rows == 0.0] = 1.0
    A = A / rows[:, None]
    columns = np.abs(A).max(axis=0)
    columns[columns == 0.0] = 1.0
    A, low_u, high_u = A / columns, low / most * columns, high / most * columns
    gap = np.full((n, 1), -1.0)
    answer = linprog(
        np.append(np.zeros(len(r)), 1.0),
        A_ub=np.block([[A, gap], [-A, gap]]),
        b_ub=np.concatenate([Q_m / rows, -Q_m / rows]),
        bounds=[*zip(low_u, high_u, strict=True), (0.0, None)],
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if answer.status != 0:
        return None
    force = np.clip(answer.x[:-1] / columns * most, low, high)
    if (np.abs(Q_m - r.T @ force) <= 0.1 * none).all():
        return True
    return False if answer.fun > max(1e-8, 10.0 * np.sqrt(n) * (none / rows).max()) else None


def distances(problem, F):
    """The scaled gap, a bound that no gap can be below, and the rounding in that.

    With the normal v of the plane through the nearest point, v (b - A x) is at least its smallest
    value over all x within bounds.
    """
    scaled = ScaledProblem(Demand(*problem[:5]))
    W = np.sqrt(problem.weights / problem.weights.min()).astype(WIDE)
    A, b = W[:, None] * scaled.without_noise(), W * scaled.b
    low, high = scaled.lb, scaled.ub
    x = np.clip(F / problem.N, low, high)
    v = b - A @ x
    gap = np.sqrt(v @ v)
    most = np.maximum(np.abs(low), np.abs(high))
    size = np.abs(b) + np.abs(A) @ np.where(np.isinf(most), np.abs(x), most)
    size = np.sqrt(size @ size)
    if gap <= 1e-12 * size:
        return 0.0, 0.0, 0.0
    free = np.isinf(low) & np.isinf(high) & (np.abs(A).max(axis=0) > 0.0)
    if free.any():  # to which v has to be normal
        columns = A[:, free] / np.abs(A[:, free]).max(axis=0)
        u, s, _ = np.linalg.svd(columns.astype(float), full_matrices=False)
        u = u[:, s > 1e-12 * s.max()].astype(WIDE)
        for _ in range(2):
            v = v - u @ (u.T @ v)
    if not v @ v > 0.0:
        return float(gap), float(gap), 0.0
    v /= np.sqrt(v @ v)
    slope = v @ A
    slope[free | (np.abs(slope) < 1e-15 * (np.abs(v) @ np.abs(A)))] = 0.0
    up, down = slope > 0.0, slope < 0.0
    farthest = (slope[up] * high[up]).sum() + (slope[down] * low[down]).sum()
    # v has the rounding of the gap, which everything that is summed is then multiplied with.
    rounding = 1e-13 * size + 4.0 * EPSILON * size * size / gap
    return float(gap), float(v @ b - farthest), float(rounding)
