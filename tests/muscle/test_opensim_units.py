"""Musculotendon units against OpenSim 4.6: right-hand sides, equilibria, isometric contractions."""

import itertools

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.muscle.contraction import tendon_force
from exudyn_muscles.skeleton.geometry import Geometry

from ..differences import gradient
from ..make_opensim import KINDS, LENGTH, RAMPS, RIGID_KINDS, SINGLE, SINGLE_ROW
from ..opensim import needs_opensim_files, numbers_of, with_opensims
from ..opensim_models import FILES, muscle, muscles
from ..own_models import FOLDER, OWN

# Held excitations follow the ramps to second order; elsewhere they are exact.
RISE, FALL = RAMPS[0][1:3], RAMPS[0][3:5]
WINDOWS = 200  # within one row of a ramp


@pytest.fixture(scope="module", params=with_opensims(OWN, FILES))
def model(request):
    """Muscles, OpenSim's numbers (k states, m muscles), and how well the two agree."""
    name = request.param
    table = dict(np.load(numbers_of(name, "static.npz")))
    # Newton's method of OpenSim's damped fibre ends at 1e-10 F0.
    damped = name in OWN or name.endswith("millard")
    return muscles(name), table, 1e-8 if damped else 1e-10


def right_hand_sides(units, table):
    """`MuscleDynamics` of (k, m) arrays at the states of the table."""
    states = zip(*(table[key] for key in ("act", "exc", "lf", "L", "V")), strict=True)
    rows = [
        em.muscle_dynamics(units, a, em.tendon_length(units, fiber, l), l, v, excitation=u)
        for a, u, fiber, l, v in states
    ]
    return em.MuscleDynamics(*(np.array(column) for column in zip(*rows, strict=True)))


def check(found, expected, scale, tolerance, name=""):
    assert (np.abs(found - expected) / scale).max() <= tolerance, name


def fastest(units):
    """V = v_max l_m0, (m,) [m/s]."""
    return np.array([unit.max_contraction_velocity * unit.optimal_fiber_length for unit in units])


def test_normalizer_of_opensims_fast_target(model):
    """OpenSim's Millard class takes the angle of a fibre of l_m / l_m0 metres there."""
    units, table, tolerance = model
    F0, floor = units.max_isometric_force, 1e-3 * units.max_isometric_force  # OpenSim has none
    optimal = units.optimal_fiber_length
    w = optimal * np.sin([unit.pennation_angle_at_optimal for unit in units])
    slack = np.array([unit.tendon_slack_length for unit in units])
    is_millard = [isinstance(unit.law, em.Millard2012) for unit in units]
    for l, v, expected in zip(table["L"], table["V"], table["Finext_a1"], strict=True):
        fiber = np.hypot(np.maximum(l - slack, 0.01 * optimal), w)
        cos, its_cos = (np.sqrt(1.0 - (w / x) ** 2) for x in (fiber, fiber / optimal))
        expected = np.where(is_millard, expected * cos / its_cos, expected)
        found = em.RigidTendonForce()(units, F0, Geometry(l, v, np.empty((0, 0))))
        check(found, np.maximum(expected, floor), F0, tolerance)
    assert (table["Finext_a1"] > floor).mean() > 0.4


def test_right_hand_sides(model):
    """Differences are over what one optimal unit of each quantity is: F0, V, 1/tau_a, 1 rad.

    Velocities and their multipliers run up to 50 V and 20 where the curves go on along straight
    lines: there they are relative to themselves.
    """
    units, table, tolerance = model
    found = right_hand_sides(units, table)
    F0, V = units.max_isometric_force, fastest(units)
    tau_a = np.array([unit.activation_time_constant for unit in units])
    fiber_force = found.active_fiber_force + found.passive_fiber_force
    for name, value, scale in (
        ("penn", found.pennation_angle, 1.0),
        ("lf", found.fiber_length, units.optimal_fiber_length),
        ("fal", found.active_force_length, 1.0),
        ("fpe", found.passive_force_length, 1.0),
        ("fv", found.force_velocity, np.maximum(np.abs(table["fv"]), 1.0)),
        ("vf", found.fiber_velocity, np.maximum(np.abs(table["vf"]), V)),
        ("lfdot", found.fiber_velocity, np.maximum(np.abs(table["vf"]), V)),
        ("vfN", found.fiber_velocity / V, np.maximum(np.abs(table["vfN"]), 1.0)),
        ("Fpass", found.passive_fiber_force, F0),
        ("Ft", found.tendon_force, F0),
        ("adot", found.activation_rate, 1.0 / tau_a),
    ):
        check(value, table[name], scale, tolerance, name)
    # A fibre at its shortest length bears no force in OpenSim; here its active force is F0 a f_l,
    # as in every fibre at rest. In both it has f_v = 1 and its tendon is slack.
    stopped = table["lfdot"] == 0.0
    active = np.where(stopped, 0.0, found.active_fiber_force)
    along_tendon = np.where(stopped, 0.0, fiber_force * np.cos(found.pennation_angle))
    check(active, table["Fact"], F0, tolerance, "Fact")
    check(along_tendon, table["Ffib_AT"], F0, tolerance, "Ffib_AT")


def test_tendon_lengths_and_their_rates(model):
    units, table, tolerance = model
    rows = zip(table["lf"], table["L"], strict=True)
    lengths = np.array([em.tendon_length(units, fiber, l) for fiber, l in rows])
    check(lengths, table["lT"], table["lT"], tolerance)
    # OpenSim's own, from its l = l_t + l_m cos(alpha).
    along_tendon = table["lfdot"] / np.cos(table["penn"])
    rates = right_hand_sides(units, table).tendon_length_rate
    scale = np.maximum(np.abs(along_tendon), fastest(units))
    check(rates, table["V"] - along_tendon, scale, tolerance)


@needs_opensim_files
def test_slack_tendons_and_fibers_at_their_shortest_are_among_the_states():
    slack, shortest = 0, 0
    for name in FILES:
        table = np.load(numbers_of(name, "static.npz"))
        slack += np.count_nonzero(table["Ft"] == 0.0)
        shortest += np.count_nonzero(table["lfdot"] == 0.0)
    assert (slack, shortest) == (12, 10)


def test_equilibria(model):
    """OpenSim's own end at a residual of 1e-8 F0."""
    units, table, _ = model
    assert table["eq_ok"].all()
    rows = [em.equilibrium(units, a, l) for a, l in zip(table["act"], table["L"], strict=True)]
    found = em.Equilibrium(*(np.array(column) for column in zip(*rows, strict=True)))
    check(found.fiber_length, table["lf_eq"], units.optimal_fiber_length, 1e-8)
    check(found.force, table["Ft_eq"], units.max_isometric_force, 1e-8)


def isometric(kind):
    """OpenSim's unit, and activation, tendon force and fibre length (rows,) at constant length."""
    of, properties = KINDS[kind]
    sizes = {
        "max_isometric_force": SINGLE["force"],
        "optimal_fiber_length": SINGLE["fiber"],
        "tendon_slack_length": SINGLE["tendon"],
        "pennation_angle_at_optimal": SINGLE["pennation"],
    }
    with np.load(FOLDER / "single.npz") as stored:
        return em.MuscleSet([muscle(of, kind, properties | sizes)]), *stored[kind].T


def windows(rows):
    """Ends of windows [s] that begin and end at every row, and are short where u changes."""
    ends = [rows[:1]]
    for begin, end in itertools.pairwise(rows):
        ramp = any(low - 1e-9 < begin and end < high + 1e-9 for low, high in (RISE, FALL))
        ends.append(np.linspace(begin, end, (WINDOWS if ramp else 1) + 1)[1:])
    return np.concatenate(ends)


@pytest.mark.parametrize("integrator", em.Integrator)
@pytest.mark.parametrize("kind", KINDS)
def test_isometric_contraction(kind, integrator):
    """Tendon force and activation at all rows, through both ramps of the excitation."""
    units, activations, forces, fibers = isometric(kind)
    a, l, v = activations[:1], np.array([LENGTH]), np.zeros(1)
    l_t = em.tendon_length(units, fibers[:1], l)
    F = em.muscle_dynamics(units, a, l_t, l, v).tendon_force
    rows = np.arange(len(activations)) * SINGLE_ROW
    time = windows(rows)
    found = [(a[0], F[0])]
    for begin, end in itertools.pairwise(time):
        u = np.interp([0.5 * (begin + end)], *RAMPS)
        a, l_t, F, *_ = em.integrate_window(
            units, a, l_t, u, (l, l), (v, v), end - begin, tolerance=1e-6, integrator=integrator
        )
        found.append((a[0], F[0]))
    activation, force = np.array(found)[np.searchsorted(time, rows - 1e-9)].T
    assert np.abs(activation - activations).max() < 1e-5
    assert np.abs(force - forces).max() < 1e-5 * units.max_isometric_force[0]


def test_fibers_of_rigid_tendons():
    for kind in ("dgf_rigid", "millard_rigid"):
        units, activations, forces, fibers = isometric(kind)
        for a, force, fiber in zip(activations, forces, fibers, strict=True):
            found = em.muscle_dynamics(units, [a], [SINGLE["tendon"]], [LENGTH], [0.0])
            assert found.fiber_length[0] == pytest.approx(fiber, rel=1e-13)
            assert found.tendon_force[0] == pytest.approx(force, rel=1e-9)


RIGID_LAWS = {
    "meyer": em.MeyerFregly2016(),
    "meyer_wide": em.MeyerFregly2016(
        active_force_width_scale=1.4, fiber_damping=0.01, ignore_passive_fiber_force=True
    ),
    "splines": em.SplineLaw(),
}


@pytest.mark.parametrize("kind", RIGID_KINDS)
def test_classes_with_rigid_tendons(kind):
    """Fibres that push, as those of OpenSim may where they shorten fastest, pull with nothing."""
    with np.load(FOLDER / "rigid.npz") as stored:
        table = stored[kind]
    unit = em.Muscle(
        "unit", max_isometric_force=SINGLE["force"], optimal_fiber_length=SINGLE["fiber"],
        tendon_slack_length=SINGLE["tendon"], pennation_angle_at_optimal=SINGLE["pennation"],
        law=RIGID_LAWS[kind], ignore_tendon_compliance=True,
    )  # fmt: skip
    units, pushing = em.MuscleSet([unit]), 0
    for l, v, a, F, fiber, active, passive in table:
        found = em.muscle_dynamics(units, [a], [SINGLE["tendon"]], [l], [v])
        pushing += F < 0.0
        expected = (max(F, 0.0), fiber, active, passive)
        for value, other, scale in zip(
            (found.tendon_force, found.fiber_length, found.active_fiber_force,
             found.passive_fiber_force),
            expected, (SINGLE["force"], SINGLE["fiber"], SINGLE["force"], SINGLE["force"]),
            strict=True,
        ):  # fmt: skip
            assert abs(value[0] - other) <= 1e-10 * scale
    assert pushing <= len(table) // 4
    assert table[:, 3].max() > 0.5 * SINGLE["force"]


@pytest.mark.parametrize("kind", RIGID_KINDS)
def test_forces_of_rigid_tendons_have_their_derivatives(kind):
    """Newton's method and the stiffness have them: of the length and of the speed."""
    unit = em.Muscle(
        "unit", max_isometric_force=1000.0, optimal_fiber_length=0.1, tendon_slack_length=0.2,
        pennation_angle_at_optimal=0.4, law=RIGID_LAWS[kind], ignore_tendon_compliance=True,
    )  # fmt: skip
    tables = em.MuscleSet([unit]).tables

    def force(x):
        return tendon_force(tables, 0, 0.6, 0.2, x[0], x[1])[0]

    for l, v in ((0.283, 0.21), (0.309, -0.33), (0.331, 0.08)):
        *_, of_length, of_speed = tendon_force(tables, 0, 0.6, 0.2, l, v)
        slopes = gradient(lambda x: np.array([force(x)]), np.array([l, v]), 1e-5)[0]
        np.testing.assert_allclose([of_length, of_speed], slopes, rtol=1e-6)
