"""What one muscle's window of 10 ms costs, printed as tables and never asserted:

pytest tests/benchmarks/test_windows.py

Medians over the random states of tests/muscle/make_window_box.py, on one core. "solve_ivp" is
scipy's Radau on the same compiled right-hand side, asked for the same tolerance.
"""

from time import perf_counter

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import exudyn_muscles as em
from exudyn_muscles.muscle.activation import activation_rate
from exudyn_muscles.muscle.contraction import stopped_rate, tendon_force
from exudyn_muscles.muscle.course import MAX_STEPS, cubic, length_at
from exudyn_muscles.muscle.parameters import ACTIVATION, PER_STRETCH, SWITCH, TAU_A, TAU_D
from exudyn_muscles.muscle.window import integrate_all
from exudyn_muscles.numerics.kernel import kernel

from ..muscle.make_window_box import LAWS, load

WINDOW = 0.010
COPIES = 30  # of a state in one call, so that the call itself does not count
HEADER = "   median      mean  90th per.   % above worst/tol"
EACH = 20  # every twentieth state for solve_ivp, which is slow


def cost(units, states, tolerance, integrator):
    """Microseconds (k,) of every state's window, and the forces at its end."""
    mesh, end = np.empty((1, COPIES, MAX_STEPS)), np.empty((4, 1, COPIES))
    times, forces = [], []
    for i, state in enumerate(states.T):
        copies = units._replace(
            table=np.repeat(units.table[i : i + 1], COPIES, axis=0),
            found=np.repeat(units.found[i : i + 1], COPIES, axis=0),
        )
        a, l_t, u, *ends = (np.full(COPIES, x) for x in state)
        best = np.inf
        for _ in range(3):
            steps = np.zeros((1, COPIES), dtype=np.int64)
            begun = perf_counter()
            integrate_all(
                integrator.value, copies, a, l_t, u[None], *ends, WINDOW, tolerance, mesh, steps,
                end,
            )  # fmt: skip
            best = min(best, perf_counter() - begun)
        times.append(best / COPIES * 1e6)
        forces.append(end[2, 0, 0])
    return np.array(times), np.array(forces)


@kernel
def slope(units, i, t, x, u, l_0, v_0, l_1, v_1, rates):
    """Write a' and l_t' at the time `t`."""
    l, v, _ = length_at(cubic(l_0, v_0, l_1, v_1, WINDOW), t)
    law, b = units.table[i, ACTIVATION], units.table[i, SWITCH]
    rates[0] = activation_rate(law, x[0], u, units.table[i, TAU_A], units.table[i, TAU_D], b)[0]
    rates[1] = stopped_rate(units, i, x[0], x[1], l, v)[1]


@kernel
def force(units, i, a, l_t, l, v):
    """F [N]."""
    return tendon_force(units, i, a, l_t, l, v)[0]


def cost_of_solve_ivp(units, states, tolerance):
    """The same by scipy's Radau."""
    times, forces = [], []
    rates = np.empty(2)
    for i, (a, l_t, u, *ends) in enumerate(states.T):

        def right_hand_side(t, x, i=i, u=u, ends=ends):
            slope(units, i, t, x, u, *ends, rates)
            return rates.copy()

        scale = np.array([1.0, 1.0 / units.table[i, PER_STRETCH]])
        begun = perf_counter()
        run = solve_ivp(
            right_hand_side, (0.0, WINDOW), [a, l_t], "Radau", rtol=0.1 * tolerance,
            atol=0.1 * tolerance * scale,
        )  # fmt: skip
        times.append((perf_counter() - begun) * 1e6)
        forces.append(force(units, i, *run.y[:, -1], ends[2], ends[3]))
    return np.array(times), np.array(forces)


def line(name, times, forces, ends, F0, tolerance):
    error = abs(forces - ends[2]) / F0 / tolerance
    return (
        f"  {name:34s}{np.median(times):9.1f}{np.mean(times):10.1f}{np.quantile(times, 0.9):10.1f}"
        f"{100.0 * np.mean(error > 1.0):10.2f}{error.max():10.2f}"
    )


@pytest.mark.parametrize("kind", ["ordinary", "box"])
def test_cost_of_a_window(kind, capsys):
    muscles, states, ends = load(kind)
    units, F0 = muscles.tables, muscles.max_isometric_force
    ratio = np.array([x.tendon_slack_length / x.optimal_fiber_length for x in muscles])
    parts = {"": ratio > 0.0}
    for low, high in ((0.1, 0.5), (0.5, 2.0), (2.0, 10.0)):
        parts[f", l_ts/l_m0 {low:g} to {high:g}"] = (ratio >= low) & (ratio < high)
    for name, law in LAWS.items():
        parts[f", {name}"] = np.array([muscle.law == law for muscle in muscles])
    with capsys.disabled():
        print(f"\n\n{len(muscles)} {kind} windows of 10 ms; us per muscle and window, one core")
        for tolerance in (1e-4, 1e-6):
            print(f"{f'tolerance {tolerance:g} F0':36s}{HEADER}")
            for integrator in em.Integrator:
                times, forces = cost(units, states, tolerance, integrator)
                for name, own in parts.items():
                    part = times[own], forces[own], ends[:, own], F0[own], tolerance
                    print(line(integrator.name.lower() + name, *part))
            sparse = units._replace(table=units.table[::EACH], found=units.found[::EACH].copy())
            times, forces = cost_of_solve_ivp(sparse, states[:, ::EACH], tolerance)
            part = ends[:, ::EACH], F0[::EACH], tolerance
            print(line("solve_ivp, Radau", times, forces, *part))


@pytest.mark.parametrize("integrator", em.Integrator)
@pytest.mark.parametrize("m", [2, 10, 100, 1000])
def test_many_muscles_in_one_call(benchmark, m, integrator):
    """The public function, arrays checked; its cost is proportional to the number of muscles."""
    unit = {
        "max_isometric_force": 3000.0,
        "optimal_fiber_length": 0.15,
        "tendon_slack_length": 0.16,
        "pennation_angle_at_optimal": 0.1,
    }
    muscles = em.MuscleSet(em.Muscle(f"{i}", **unit) for i in range(m))
    a, l = np.full(m, 0.2), np.full(m, 0.315)
    l_t = em.equilibrium(muscles, a, l).tendon_length
    u, v = np.full(m, 0.5), np.full(m, 0.2)
    benchmark(
        em.integrate_window, muscles, a, l_t, u, (l, l + 0.002), (v, v), WINDOW,
        integrator=integrator,
    )  # fmt: skip
    benchmark.extra_info["us per muscle"] = benchmark.stats["min"] * 1e6 / m
