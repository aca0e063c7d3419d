"""Contraction dynamics (4): the formulas, derivatives, equilibrium, the slack tendon."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import exudyn_muscles as em
from exudyn_muscles.muscle.contraction import as_rows, fiber_lengths, force_rate, steady_activations

from ..differences import difference
from . import hill

OPENSIM = Path(__file__).parents[2] / ".." / "shared" / "opensim" / "reference"


@st.composite
def units(draw):
    optimal = draw(st.floats(0.04, 0.2))
    return em.Muscle(
        "unit",
        max_isometric_force=draw(st.floats(30.0, 10000.0)),
        optimal_fiber_length=optimal,
        tendon_slack_length=optimal * draw(st.floats(0.1, 10.0)),
        pennation_angle_at_optimal=draw(st.floats(0.0, 0.5)),
    )


@st.composite
def states(draw):
    """A unit and a state (a, F, l, l') of the allowed box."""
    muscle = draw(units())
    a = draw(st.floats(0.01, 1.0))
    F = draw(st.floats(-0.1, 2.0)) * muscle.max_isometric_force
    fiber = draw(st.floats(0.3, 1.8)) * muscle.optimal_fiber_length
    v = draw(st.floats(-15.0, 15.0)) * muscle.optimal_fiber_length
    return muscle, a, F, hill.length(muscle, F, fiber), v


def rate(muscle, a, F, l, v):
    return em.contraction_rate(em.MuscleSet([muscle]), [a], [F], [l], [v])[0]


def terms(muscle, F, l, value, partials, a, v):
    """What rounding of the arguments alone changes in the rate, over the machine precision."""
    x = abs(np.array([a, F, l, v]))
    x[1] = max(x[1], muscle.max_isometric_force)
    return abs(value) + abs(partials) @ x


@given(state=states())
@settings(max_examples=300)
def test_rate_is_the_formula(state):
    muscle, a, F, l, v = state
    value, *partials = rate(*state)
    rounding = 1e-14 * terms(muscle, F, l, value, np.array(partials), a, v)
    assert value == pytest.approx(hill.rate(*state), rel=1e-12, abs=rounding)


@given(state=states())
@settings(max_examples=300)
def test_partial_derivatives(state):
    muscle, a, F, l, v = state
    F0, optimal = muscle.max_isometric_force, muscle.optimal_fiber_length
    p = l - hill.tendon(muscle, F / F0)[0]
    x, cos, active_force = hill.load(muscle, F, l)
    # Steps over which neither the fibre's force nor its length change much: the curves bend over a
    # tenth of the optimal length, and the multiplier over a f_l.
    capacity = a * hill.active(x)
    stiffest = capacity / (hill.tendon(muscle, F / F0)[1] / optimal + 0.1)
    steps = np.array(
        [
            1e-3 * min(a, capacity / (abs(active_force) / a + 1e-9), 0.1),
            1e-3 * F0 * min(capacity, stiffest, 0.1 / (hill.tendon(muscle, F / F0)[1] / optimal)),
            1e-3 * optimal * min(capacity, 0.1) * cos,
            1e-3 * optimal,
        ]
    )
    # Differences must not reach over a kink: the shortest fibre or an end of the curve's tangent.
    reach = 2.0 * steps[1] / F0 * hill.tendon(muscle, F / F0)[1] + 2.0 * steps[2]
    assume(abs(p - hill.shortest(muscle)) > 1.1 * reach)
    assume(abs(p - hill.shortest(muscle) - hill.stop(muscle)) > 1.1 * reach)
    assume(
        abs(active_force / capacity - 1.0) > 0.01 or p > hill.shortest(muscle) + hill.stop(muscle)
    )
    for end in (-2.0, 2.0):
        assume(abs(active_force / capacity - hill.multiplier(end)) > 0.05)

    value, *partials = rate(*state)
    arguments = np.array([a, F, l, v])
    table = em.MuscleSet([muscle]).table
    rounding = 3e-16 * terms(muscle, F, l, value, np.array(partials), a, v)
    for k, partial in enumerate(partials):

        def along(s, k=k):
            shifted = arguments.copy()
            shifted[k] = s
            # Differences reach beyond the activations that the public function takes.
            return force_rate(table, 0, *shifted)[0]

        expected = difference(along, arguments[k], steps[k])
        assert partial == pytest.approx(expected, rel=1e-6, abs=4.0 * rounding / steps[k]), k


@given(state=states())
@settings(max_examples=300)
def test_nothing_overflows(state):
    assert np.isfinite(rate(*state)).all()


def test_nothing_overflows_in_the_corners():
    for lean in (0.0, 0.5):
        for ratio in (0.1, 10.0):
            muscle = em.Muscle(
                "unit",
                max_isometric_force=1000.0,
                optimal_fiber_length=0.1,
                tendon_slack_length=0.1 * ratio,
                pennation_angle_at_optimal=lean,
            )
            for a in (0.01, 1.0):
                for f in (-0.2, -0.1, 0.0, 2.0):
                    for fiber in (0.3, 1.8):
                        l = hill.length(muscle, 1000.0 * f, 0.1 * fiber)
                        for v in (-1.5, 0.0, 1.5):
                            assert np.isfinite(rate(muscle, a, 1000.0 * f, l, v)).all()


@given(muscle=units(), a=st.floats(0.01, 1.0), stretch=st.floats(0.3, 1.6))
@settings(max_examples=200)
def test_equilibrium_is_a_zero_of_the_rate(muscle, a, stretch):
    muscles = em.MuscleSet([muscle])
    F0 = muscle.max_isometric_force
    l = hill.length(muscle, 0.0, stretch * muscle.optimal_fiber_length)
    F = em.equilibrium(muscles, [a], [l])[0]
    value, _, dF, dl, _ = rate(muscle, a, F, l, 0.0)
    # Rounding of F and l, some 1e-16 of them, is what the bisection leaves.
    assert abs(value) <= 1e-12 * (abs(dF) * F0 + abs(dl) * l)


@given(muscle=units(), a=st.floats(0.01, 1.0), short=st.floats(0.0, 0.08))
def test_a_path_too_short_to_be_taut_leaves_the_tendon_slack(muscle, a, short):
    """The equilibrium is the steady state of the window integration there, too, and below zero."""
    muscles = em.MuscleSet([muscle])
    l = hill.shortest(muscle) + (1.0 - short) * muscle.tendon_slack_length
    F = em.equilibrium(muscles, [a], [l])
    assert F[0] <= 1e-9
    end = em.integrate_window(muscles, [a], F, [a], ([l], [l]), ([0.0], [0.0]), 0.1)
    assert end.force[0] == pytest.approx(F[0], abs=1e-4 * muscle.max_isometric_force)


@given(muscle=units(), a=st.floats(0.02, 0.98), stretch=st.floats(0.5, 1.3))
def test_steady_activation_inverts_equilibrium(muscle, a, stretch):
    muscles = em.MuscleSet([muscle])
    l = np.array([hill.length(muscle, 0.0, stretch * muscle.optimal_fiber_length)])
    F = em.equilibrium(muscles, [a], l)
    assume(fiber_lengths(muscles.table, F, l)[0] > 0.5 * muscle.optimal_fiber_length)
    assert steady_activations(muscles.table, F, l)[0] == pytest.approx(a, rel=1e-9)


@given(muscle=units(), a=st.floats(0.01, 1.0), stretch=st.floats(0.8, 1.2))
@settings(max_examples=60)
def test_slack_tendon_recovers(muscle, a, stretch):
    muscles = em.MuscleSet([muscle])
    F0, optimal = muscle.max_isometric_force, muscle.optimal_fiber_length
    F = -0.19 * F0  # below the end of the logarithm
    l = hill.length(muscle, 0.0, stretch * optimal)
    slack = hill.tendon(muscle, 0.0)[0] - hill.tendon(muscle, -0.19)[0]
    assert slack > 0.0
    # The fibre takes the slack up; unloaded and weakly active, it does so at a tenth of its highest
    # speed at least.
    v_max = muscle.max_contraction_velocity * optimal
    windows = 2 + math.ceil(slack / (0.1 * v_max) / hill.WINDOW)
    force, level = np.array([F]), np.array([a])
    for _ in range(windows):
        end = em.integrate_window(muscles, level, force, [a], ([l], [l]), ([0.0], [0.0]), 0.01)
        assert end.force[0] > force[0] - 1e-4 * F0  # rises towards the balance
        force = end.force
        if force[0] > 0.5 * em.equilibrium(muscles, [a], [l])[0]:
            break
    assert force[0] > 0.0


@given(muscle=units(), a=st.floats(0.01, 1.0), speed=st.floats(3.0, 15.0))
@settings(max_examples=60)
def test_slack_tendon_taut_after_a_stretch(muscle, a, speed):
    muscles = em.MuscleSet([muscle])
    F0, optimal = muscle.max_isometric_force, muscle.optimal_fiber_length
    force = np.array([-0.19 * F0])
    # The fibre rests at its optimal length, the tendon hangs loose; then the unit is pulled.
    start = hill.length(muscle, force[0], optimal)
    slack = hill.tendon(muscle, 0.0)[0] - hill.tendon(muscle, -0.19)[0]
    v = speed * optimal
    windows = 1 + math.ceil((slack + 0.2 * optimal) / v / hill.WINDOW)
    for k in range(windows):
        ends = (start + k * v * hill.WINDOW, start + (k + 1) * v * hill.WINDOW)
        end = em.integrate_window(
            muscles, [a], force, [a], ([ends[0]], [ends[1]]), ([v], [v]), hill.WINDOW
        )
        force = end.force
    assert force[0] > 0.0


def test_rigid_tendon_of_opensim():
    """OpenSim's fibre with a rigid tendon: our fibre force at its lengths and activations."""
    file = OPENSIM / "single_iso_dgf_rigid.csv"
    if not file.exists():
        pytest.skip("OpenSim's reference tables are not beside this repository")
    muscle = em.Muscle(
        "single",
        max_isometric_force=1000.0,
        optimal_fiber_length=0.1,
        tendon_slack_length=0.2,
        pennation_angle_at_optimal=0.2,
    )
    muscles = em.MuscleSet([muscle])
    with file.open() as lines:
        rows = [{k: float(x) for k, x in row.items()} for row in csv.DictReader(lines)]
    assert len(rows) > 100
    for row in rows:
        # The same fibre on our elastic tendon: length and tension are OpenSim's, so that the
        # fibre rests, and the rate is zero. The file has 12 digits.
        F = row["tendon_force"]
        l = row["L"] - 0.2 + hill.tendon(muscle, F / 1000.0)[0]
        assert fiber_lengths(muscles.table, np.array([F]), np.array([l]))[0] == pytest.approx(
            row["fiber_length"], rel=1e-10
        )
        value, _, dF, _, _ = rate(muscle, row["activation"], F, l, 0.0)
        assert abs(value / dF) < 1e-8


@pytest.mark.parametrize("bad", [[1.0, 2.0], [math.nan], [math.inf], 1.0, ["x"]])
def test_bad_arrays(bad):
    muscles = em.MuscleSet(
        [em.Muscle("m", max_isometric_force=1, optimal_fiber_length=0.1, tendon_slack_length=0.1)]
    )
    for position in range(4):
        arguments = [[0.5], [0.5], [0.2], [0.0]]
        arguments[position] = bad
        with pytest.raises(em.ParameterError):
            em.contraction_rate(muscles, *arguments)
    with pytest.raises(em.ParameterError, match="activation"):
        em.equilibrium(muscles, bad, [0.2])
    with pytest.raises(em.ParameterError, match="length"):
        em.equilibrium(muscles, [0.5], bad)


def test_as_rows_copies():
    muscles = em.MuscleSet(
        [em.Muscle("m", max_isometric_force=1, optimal_fiber_length=0.1, tendon_slack_length=0.1)]
    )
    values = np.array([1.0])
    (row,) = as_rows(muscles, activation=values)
    row[0] = 2.0
    assert values[0] == 1.0
