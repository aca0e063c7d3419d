"""Windows of random units: both integrators against each other at a tight tolerance and now and
then against SciPy on formulas of their own; bounds; the same bits twice; the end as the next start.
"""

import numpy as np

import exudyn_muscles as em

from ..muscle import hill
from ..zoo import LAWS

CUSTOM = em.CustomLaw(
    "custom",
    active_force_length=(
        [0.3, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0],
        [0.02, 0.3, 0.9, 1.0, 0.8, 0.3, 0.02],
    ),
    force_velocity=lambda v: np.where(
        v < 0.0, (1.0 + v) / (1.0 - 4.0 * np.minimum(v, 0.0)), 1.4 - 0.4 / (1.0 + 12.5 * abs(v))
    ),
    passive_force_length=lambda x: 4.0 * np.maximum(x - 1.0, 0.0) ** 2,
    tendon_force_length=lambda x: (25.0 * np.maximum(x - 1.0, 0.0)) ** 2,
    fiber_damping=0.05,
)
ALL = [*LAWS.values(), CUSTOM]
TIGHT = 1e-6
# What is allowed of the tolerance; 99 % of the windows of tests/muscle/test_window.py stay below 1.
WORST = 30.0
ORACLE = 0.02  # part of the cases that are compared with SciPy


def unit(rng, law):
    optimal = rng.uniform(0.03, 0.3)
    quick = rng.random() < 0.3
    return em.Muscle(
        "unit",
        max_isometric_force=10.0 ** rng.uniform(1.0, 4.0),
        optimal_fiber_length=optimal,
        tendon_slack_length=optimal * 10.0 ** rng.uniform(-1.0, 1.0),
        pennation_angle_at_optimal=rng.choice([0.0, rng.uniform(0.0, 0.7)]),
        max_contraction_velocity=rng.choice([10.0, rng.uniform(3.0, 20.0)]),
        activation_time_constant=10.0 ** rng.uniform(-4.0, -2.0) if quick else 0.015,
        deactivation_time_constant=10.0 ** rng.uniform(-4.0, -1.0) if quick else 0.05,
        activation_dynamics=rng.choice(list(em.ActivationDynamics)),
        activation_dynamics_smoothing=rng.choice([0.1, 10.0, 100.0]),
        minimum_activation=rng.choice([0.01, 0.001, 0.1]),
        law=law,
        ignore_tendon_compliance=bool(rng.random() < 0.1),
    )


def start(rng, muscle):
    """a, l_t and l: taut, slack or at the stop, in balance or not."""
    least = muscle.minimum_activation
    a = rng.choice([least, 1.0, rng.uniform(least, 1.0), least ** rng.random()])
    strain = muscle.tendon_strain if muscle.law.tendon_strain_at_one_norm_force else 0.05
    l_t = muscle.tendon_slack_length * (1.0 + strain * rng.choice([rng.uniform(-1.0, 1.3), 0.0]))
    shortest = max(muscle.shortest_fiber, 0.3 * muscle.optimal_fiber_length)
    fiber = rng.choice([shortest, rng.uniform(shortest, 1.8 * muscle.optimal_fiber_length)])
    return a, l_t, l_t + np.sqrt(fiber**2 - muscle.width**2)


def integrate(muscle, state, tolerance, integrator):
    a, l_t, u, l_0, v_0, l_1, v_1 = ([x] for x in state)
    return em.integrate_window(
        em.MuscleSet([muscle]), a, l_t, u, (l_0, l_1), (v_0, v_1), hill.WINDOW,
        tolerance=tolerance, integrator=integrator,
    )  # fmt: skip


def checked(muscle, state, tolerance, integrator):
    """The end of a window, which is one."""
    end = integrate(muscle, state, tolerance, integrator)
    again = integrate(muscle, state, tolerance, integrator)
    assert [x.tobytes() for x in end] == [x.tobytes() for x in again], "other bits the second time"
    assert np.isfinite(end).all(), f"not finite: {end}"
    a, u, a_1 = state[0], state[2], end.activation[0]
    assert min(a, u) <= a_1 <= max(a, u), f"activation {a_1} is not between {a} and {u}"
    shortest = np.sqrt(muscle.shortest_fiber**2 - muscle.width**2)
    if muscle.ignore_tendon_compliance:
        assert end.tendon_length[0] == muscle.tendon_slack_length, "the rigid tendon moved"
    else:
        short = end.tendon_length[0] + shortest - state[5]
        assert short < 1e-12, f"the fibre is {short} m shorter than its shortest length"
    return end


def check(rng):
    law = ALL[rng.integers(len(ALL))]
    muscle = unit(rng, law)
    a, l_t, l = start(rng, muscle)
    tolerance, F0 = 10.0 ** rng.uniform(-5.0, -2.0), muscle.max_isometric_force
    integrator = rng.choice(list(em.Integrator))
    v = None
    for _ in range(2):
        u, l_0, v_0, l_1, v_1 = hill.course(rng, muscle, l, v)
        state = a, l_t, max(u, muscle.minimum_activation), l_0, v_0, l_1, v_1
        end = checked(muscle, state, tolerance, integrator)
        tight = [checked(muscle, state, TIGHT, each) for each in em.Integrator]
        forces = [each.force[0] / F0 for each in (end, *tight)]
        allowed = WORST * TIGHT * (1.0 + abs(forces[1]))
        apart = abs(forces[1] - forces[2])
        assert apart < allowed, f"the integrators differ by {apart} F0 at {TIGHT}"
        error = abs(forces[0] - forces[1])
        allowed = WORST * tolerance * (1.0 + abs(forces[1]))
        assert error < allowed, f"{integrator}: {error} F0 off at {tolerance}"
        if rng.random() < ORACLE and type(law) in hill.LAWS:
            a_1, _, F = hill.window(muscle, *state)
            assert abs(tight[1].activation[0] - a_1) < 10.0 * TIGHT, "activation of the formulas"
            apart = abs(forces[2] - max(F, 0.0) / F0)  # a slack tendon does not push
            assert apart < WORST * TIGHT * (1.0 + abs(F / F0)), f"{apart} F0 from the formulas"
        a, l_t, l, v = end.activation[0], end.tendon_length[0], l_1, v_1
    return "fine"
