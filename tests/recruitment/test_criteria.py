"""Every criterion: certified, no dearer than what another solver finds, and in all methods."""

from dataclasses import dataclass
from functools import partial

import clarabel
import numpy as np
import pytest
from scipy import sparse

import exudyn_muscles as em
from exudyn_muscles.recruitment.certificate import ACCEPTED
from exudyn_muscles.recruitment.criteria.followed import FollowedProblem
from exudyn_muscles.recruitment.criteria.joint_load import JointLoadProblem
from exudyn_muscles.recruitment.criteria.minmax import MinMaxProblem
from exudyn_muscles.recruitment.criteria.powers import PoweredProblem
from exudyn_muscles.recruitment.criteria.quantity import Quantity, counted
from exudyn_muscles.recruitment.criteria.synergies import SynergyProblem
from exudyn_muscles.recruitment.demand import Demand
from exudyn_muscles.recruitment.optimization import Recruiter
from models import leg, planar_arm

MANY = 1000
FORCE, ACTIVATION = Quantity.FORCE, Quantity.ACTIVATION


def draw(rng):
    """A demand within reach, of 2 to 60 muscles, half of the time with ideal actuators."""
    while True:
        k, n = int(rng.integers(2, 60)), int(rng.integers(1, 12))
        if k > n:
            break
    r = rng.uniform(-0.06, 0.06, (k, n)) * (rng.random((k, n)) < 0.6)
    N = rng.uniform(200.0, 3000.0, k)
    low = rng.uniform(0.0, 0.05, k) * N * (rng.random(k) < 0.5)
    high = low + rng.uniform(0.1, 1.0, k) * (N - low)
    F = low + rng.uniform(0.0, rng.choice([0.1, 0.6, 1.0]), k) * (high - low)
    cheaper = rng.choice([1.0, 0.5], k, p=[0.8, 0.2])
    N = N * cheaper
    if rng.random() < 0.5:
        optimal, infinite = rng.choice([1.0, 10.0, 50.0], n), np.full(n, np.inf)
        r, N = np.vstack([r, np.eye(n)]), np.append(N, optimal)
        low, high = np.append(low, -infinite), np.append(high, infinite)
        F = np.append(F, 0.5 * rng.normal(size=n) * optimal)
    a = np.sort(rng.uniform(0.0, 1.0, (2, k)), axis=0)
    return Demand(r, r.T @ F, low, high, N, 0.0, a, a, cheaper)


@dataclass
class Kind:
    """A criterion for random demands: what makes its problem, and its cost as something that
    Clarabel can minimise: power, stiffness and place of the least of every x - zero, modes, and the
    force of a joint, c + B x."""

    name: str
    quantity: Quantity
    power: float = 2.0

    def of(self, demand, rng):
        self.weight, self.target = np.zeros((2, demand.N.size))
        self.W = np.zeros((demand.N.size, 0))
        self.c, self.B = np.zeros(3), np.zeros((3, demand.N.size))
        k = demand.cheaper.size
        if self.name == "joint load":
            reference = rng.choice([30.0, 300.0, 3000.0])
            self.c = rng.uniform(-500.0, 500.0, 3) / reference
            by_forces = rng.uniform(-1.0, 1.0, self.B.shape) / reference
            self.B = by_forces * demand.N
            return partial(JointLoadProblem, constant=self.c, by_forces=by_forces)
        if self.name == "followed":
            self.weight[:k] = rng.choice([0.0, 10.0, 1000.0], k)
            self.target[:k] = rng.random(k) * (self.weight[:k] > 0.0)
            given = {"weight": self.weight, "target": self.target}
            return partial(FollowedProblem, quantity=self.quantity, **given)
        if self.name == "synergies":
            W = np.zeros((demand.N.size, min(4, k)))
            W[:k] = rng.random((k, W.shape[1]))
            self.W, self.weight[:k] = W / np.linalg.norm(W, axis=0), 100.0
            return partial(SynergyProblem, W=self.W, weight=100.0)
        if self.name == "minmax":
            return partial(MinMaxProblem, quantity=self.quantity)
        return partial(PoweredProblem, power=self.power, quantity=self.quantity)

    def costs(self, q, size):
        """What is to be least of x - zero, in the order of its importance."""
        a = size * q
        if self.name == "minmax":
            return [np.abs(q).max(), (q * q).sum()]
        if self.name == "followed":
            return [(q * q).sum() + (self.weight * (a - self.target) ** 2).sum()]
        if self.name == "joint load":
            return [(q * q).sum() + ((self.c + self.B @ q) ** 2).sum()]
        if self.name == "synergies":
            from scipy.optimize import nnls

            some = self.weight > 0.0
            return [(q * q).sum() + 100.0 * nnls(self.W[some], a[some])[1] ** 2]
        return [(np.abs(q) ** self.power).sum()]


KINDS = {
    "activations": Kind("powers", ACTIVATION),
    "activations^3": Kind("powers", ACTIVATION, 3.0),
    "forces^10": Kind("powers", FORCE, 10.0),
    "largest force": Kind("minmax", FORCE),
    "largest activation": Kind("minmax", ACTIVATION),
    "followed": Kind("followed", ACTIVATION),
    "synergies": Kind("synergies", ACTIVATION),
    "joint load": Kind("joint load", FORCE),
}


def clarabel_says(kind, demand):
    """The least cost of the first level by an interior-point solver, None if it is not certain."""
    d, zero, size = counted(kind.quantity, demand)
    m, n = d.N.size, d.Q_m.size
    A = (d.r * d.N[:, None]).T
    scale = np.linalg.norm(A, axis=1)
    scale[scale == 0.0] = 1.0
    extra = {"minmax": 1, "synergies": kind.W.shape[1], "powers": m if kind.power > 2.0 else 0}
    e = extra.get(kind.name, 0)
    P, q = np.zeros((m + e, m + e)), np.zeros(m + e)
    rows, right, cones = [], [], []

    def add(block, rest, b, cone):
        rows.append(np.hstack([block, rest]))
        right.append(b)
        cones.append(cone)

    add(A / scale[:, None], np.zeros((n, e)), d.Q_m / scale, clarabel.ZeroConeT(n))
    one, none = np.eye(m), np.zeros((m, e))
    for sign, bound in ((1.0, d.F_max / d.N), (-1.0, -d.F_min / d.N)):
        ends = np.isfinite(bound)
        count = int(ends.sum())
        add(sign * one[ends], none[ends], bound[ends], clarabel.NonnegativeConeT(count))
    constant = 0.0
    if kind.name == "minmax":
        q[-1] = 1.0
        t = -np.ones((m, 1))
        add(one, t, zero, clarabel.NonnegativeConeT(m))
        add(-one, t, -zero, clarabel.NonnegativeConeT(m))
    elif kind.name == "powers" and kind.power > 2.0:
        q[m:] = 1.0
        for i in range(m):  # s^(1/p) 1^(1-1/p) >= |x - zero|
            block, rest = np.zeros((3, m)), np.zeros((3, e))
            rest[0, i], block[2, i] = -1.0, -1.0
            b = np.array([0.0, 1.0, -zero[i]])
            add(block, rest, b, clarabel.PowerConeT(1.0 / kind.power))
    else:
        pull = kind.weight * size * size
        P[:m, :m] = 2.0 * (np.diag(1.0 + pull) + kind.B.T @ kind.B)
        least = zero + np.divide(kind.target, size)
        q[:m] = 2.0 * (kind.B.T @ kind.c - zero - pull * least)
        constant = (zero * zero).sum() + (pull * least * least).sum() + (kind.c * kind.c).sum()
        if kind.name == "synergies":
            W = kind.W
            P[:m, m:] = -2.0 * (kind.weight * size)[:, None] * W
            P[m:, :m], P[m:, m:] = P[:m, m:].T, 200.0 * W.T @ W
            q[m:] = 2.0 * W.T @ (kind.weight * size * zero)
            add(np.zeros((e, m)), -np.eye(e), np.zeros(e), clarabel.NonnegativeConeT(e))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    found = clarabel.DefaultSolver(
        sparse.csc_matrix(np.triu(P)), q, sparse.csc_matrix(np.vstack(rows)),
        np.concatenate(right), cones, settings,
    ).solve()  # fmt: skip
    return found.obj_val + constant if str(found.status) == "Solved" else None


@pytest.mark.parametrize("name", KINDS)
def test_thousand_recruitments(name):
    """Each with a certificate below 1e-7; of every tenth another solver finds the same cost."""
    rng, kind = np.random.default_rng(15), KINDS[name]
    compared = 0
    for k in range(MANY):
        demand = draw(rng)
        found = Recruiter(problem_of=kind.of(demand, rng)).solve(demand)
        assert found.met and found.preferred, k
        assert found.residual <= ACCEPTED, k
        assert (demand.F_min <= found.force).all() and (found.force <= demand.F_max).all()
        np.testing.assert_allclose(found.torque, demand.Q_m, rtol=1e-9, atol=1e-7)
        if k % 10 == 0:
            d, zero, size = counted(kind.quantity, demand)
            least = clarabel_says(kind, demand)
            if least is not None:
                mine = kind.costs(found.force / d.N - zero, size)[0]
                assert mine == pytest.approx(least, rel=1e-5, abs=1e-7), k
                compared += 1
    assert compared > 0.08 * MANY


@pytest.mark.parametrize("name", KINDS)
def test_out_of_reach_the_preferred_of_the_nearest(name):
    """Two coordinates, one of which asks too much: the muscles of the other one follow their
    criterion, as if it were alone, and with the nearest torque on the first."""
    rng, kind = np.random.default_rng(3), KINDS[name]
    r = np.zeros((6, 2))
    r[:3, 0], r[3:, 1] = [0.05, 0.04, -0.03], [0.05, 0.04, -0.03]
    N = np.array([1000.0, 800.0, 600.0, 900.0, 700.0, 500.0])
    a = np.array([np.zeros(6), rng.uniform(0.4, 1.0, 6)])
    demand = Demand(r, np.array([200.0, 20.0]), 0.0 * N, N, N, 0.0, a, a, np.ones(6))
    found = Recruiter(problem_of=kind.of(demand, rng)).solve(demand)
    assert found.preferred and not found.met
    np.testing.assert_allclose(found.force[:3], [1000.0, 800.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(found.torque[1], 20.0)
    assert found.unmet[0] == pytest.approx(118.0)
    # No other forces with this torque are dearer in the order of the criterion's levels.
    d, zero, size = counted(kind.quantity, demand)
    best = kind.costs(found.force / d.N - zero, size)
    for _ in range(200):
        F = found.force.copy()
        F[3] = np.clip(F[3] + rng.normal(0.0, 30.0), 0.0, 900.0)
        F[5] = np.clip(F[5] + rng.normal(), 0.0, 500.0)
        F[4] = (20.0 - r[3, 1] * F[3] - r[5, 1] * F[5]) / r[4, 1]
        if 0.0 <= F[4] <= 700.0:
            assert kind.costs(F / d.N - zero, size) >= [best[0] - 1e-7, -1.0]


def test_an_activation_is_counted_as_it_is_with_a_rigid_tendon():
    """Static optimization of muscles with rigid tendons: no other activations that deliver the same
    torques, along the directions that keep them, have a smaller sum of squares."""
    model = planar_arm.build()
    muscles = em.operators.ignore_tendon_compliance(model.muscles)
    model, motion = model.replace(muscles=muscles), planar_arm.motion().between(0.0, 0.3)
    plain, found = (
        em.static_optimization(model, motion, settings=em.StaticSettings(criterion=criterion))
        for criterion in (em.SquaredForces(), em.PoweredActivations())
    )
    squares = [(each.activations[1:] ** 2).sum() for each in (plain, found)]
    assert squares[1] < 0.99 * squares[0]
    rows = np.arange(1, found.time.size)
    at = em.analysis.muscle_analysis(model, found)
    arms = at["moment_arm"].reshape(found.time.size, len(model.coordinates), -1)
    F, a = at["active_fiber_force_along_tendon"], found.activations
    for k in rows:
        free = (a[k] > 0.02) & (found.force_optimal[k - 1] > found.force_min[k - 1] * (1 + 1e-9))
        free &= found.force_optimal[k - 1] < found.force_max[k - 1] * (1 - 1e-9)
        per_activation = arms[k][:, free] * (F[k] / a[k])[free]
        _, s, V = np.linalg.svd(per_activation)
        for direction in V[np.count_nonzero(s > 1e-9 * s[0]) :]:
            assert abs(direction @ a[k][free]) < 1e-6


COURSE = (np.array([0.0, 1.0]), np.array([0.3, 0.5]))
NAMES = leg.build().muscles.names
MODES = {name: (1.0 + k % 3, float(k % 2), k % 5 / 5) for k, name in enumerate(NAMES)}
CRITERIA = {
    "powers": em.PoweredForces(7.0),
    "activations": em.PoweredActivations(),
    "minmax": em.MinMax(Quantity.ACTIVATION),
    "followed": em.Followed({NAMES[0]: COURSE}, weight=10.0),
    "synergies": em.Synergies(MODES, weight=10.0),
    "joint load": em.JointLoad("knee", 300.0),
}
METHODS = {
    "static": (em.static_optimization, em.StaticSettings()),
    "cmc": (em.computed_muscle_control, em.CMCSettings()),
    "full": (em.cosimulate, em.CosimulationSettings(scheme=em.Scheme.FULL)),
    "simplified": (em.cosimulate, em.CosimulationSettings(scheme=em.Scheme.SIMPLIFIED)),
    "consistent": (em.cosimulate, em.CosimulationSettings()),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CRITERIA)
def test_in_all_methods(name, method):
    from dataclasses import replace

    run, settings = METHODS[method]
    motion = leg.motion()
    motion = motion.between(motion.start, motion.start + 0.1)
    result = run(leg.build(), motion, settings=replace(settings, criterion=CRITERIA[name]))
    assert result.status is em.Status.COMPLETE and result.counts.not_preferred == 0
    assert not result.torques_unmet.any()
    np.testing.assert_allclose(result.coordinates, result.desired_coordinates, atol=4e-3)


@pytest.mark.parametrize("name", CRITERIA)
def test_the_order_of_full_co_simulation_stays(name):
    """Distances of runs with half the step from each other fall fourfold, as by squares."""
    motion = leg.motion()
    motion = motion.between(motion.start + 0.2, motion.start + 0.4)
    runs = [
        em.cosimulate(
            leg.build(), motion,
            settings=em.CosimulationSettings(
                scheme=em.Scheme.FULL, criterion=CRITERIA[name], step=step
            ),
        )
        for step in (0.01, 0.005, 0.0025)
    ]  # fmt: skip
    ends = [run.coordinates[-1] for run in runs]
    ratio = np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2])
    assert 2.5 < ratio < 8.0


def test_volume_weights_spare_large_muscles():
    model = planar_arm.build()
    weights = em.volume_weights(model.muscles)
    F0, l_m0 = model.muscles.max_isometric_force, model.muscles.optimal_fiber_length
    np.testing.assert_allclose(list(weights.values()), F0 * l_m0 / np.mean(F0 * l_m0))
    motion = planar_arm.motion().between(0.0, 0.2)
    settings = [
        em.StaticSettings(criterion=em.PoweredActivations(), weights=each) for each in ({}, weights)
    ]
    plain, spared = (em.static_optimization(model, motion, settings=each) for each in settings)
    volume = F0 * l_m0
    assert (spared.activations**2 @ volume).sum() < (plain.activations**2 @ volume).sum()


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: em.PoweredActivations(11), r"exponent = 11 is outside \[2, 10\]"),
        (lambda: em.MinMax("force"), "quantity = 'force' is not one of"),
        (lambda: em.Followed({"a": COURSE}, quantity=FORCE), "is not what EMG can tell"),
        (lambda: em.Followed({"a": ([0.0, 1.0], [0.0, 1.5])}), "'a' has values from 0 to 1.5"),
        (lambda: em.Followed({"a": ([1.0, 0.0], [0.0, 0.5])}), "'a' is a number, or increasing"),
        (lambda: em.JointLoad("knee", 0.0), r"force = 0.0 N is outside \[1e-09, 1e\+09\] N"),
        (lambda: em.Followed(3), "courses = 3 is no mapping"),
        (lambda: em.Synergies({"a": (1.0,), "b": (1.0, 2.0)}), "'b' has .* expected 1 numbers"),
        (lambda: em.Synergies({"a": (1.0, 2.0), "b": (2.0, 4.0)}), "combinations of others"),
        (lambda: em.Synergies({"a": (), "b": ()}), r"'a' has \(\), expected 1 numbers"),
        (lambda: em.Synergies({"a": "x"}), "'a' has 'x', expected 1 numbers"),
    ],
)
def test_wrong_criteria_are_named(make, says):
    with pytest.raises(em.ParameterError, match=says):
        make()


@pytest.mark.parametrize(
    ("criterion", "says"),
    [
        (em.Followed({"nobody": COURSE}), "courses of 'nobody': the muscles are"),
        (em.JointLoad("wrist", 100.0), "no joint 'wrist'; the joints are shoulder, elbow"),
        (em.JointLoad("elbow", 0.1), "force = 0.1 N is less than a thousandth of the strongest"),
        (em.Synergies({"nobody": (1.0,)}), "nobody.* are either no muscles or have no modes"),
    ],
)
def test_names_are_checked_before_a_run(criterion, says):
    with pytest.raises(em.ParameterError, match=says):
        em.static_optimization(
            planar_arm.build(), planar_arm.motion(),
            settings=em.StaticSettings(criterion=criterion),
        )  # fmt: skip


def test_what_is_not_found_is_said(monkeypatch):
    """A criterion whose problem nobody solves: forces are those of the squares, and a warning."""
    monkeypatch.setattr(MinMaxProblem, "solved", lambda self, ask: None)
    settings = em.StaticSettings(criterion=em.MinMax())
    motion = planar_arm.motion().between(0.0, 0.05)
    with pytest.warns(
        em.CriterionWarning, match="in 6 of 6 recruitments what the criterion prefers"
    ):
        found = em.static_optimization(planar_arm.build(), motion, settings=settings)
    plain = em.static_optimization(planar_arm.build(), motion)
    np.testing.assert_allclose(found.force_optimal, plain.force_optimal, rtol=1e-6, atol=1e-6)


def test_a_class_in_place_of_a_criterion_is_named():
    with pytest.raises(em.ParameterError, match=r"MinMax.* is no object with a function prepare"):
        em.StaticSettings(criterion=em.MinMax)
