"""Timings, printed and never asserted:

pytest tests/benchmarks
"""

import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum, planar_arm

KP = 534.0
METHODS = {
    "static": em.static_optimization,
    "cmc": lambda model, motion: em.computed_muscle_control(model, motion, settings=em.CMC(kp=KP)),
    "csf": lambda model, motion: em.cosimulate(model, motion, settings=em.Cosimulation(kp=KP)),
    "css": lambda model, motion: em.cosimulate(
        model, motion, settings=em.Cosimulation(kp=KP, scheme=em.Scheme.SIMPLIFIED)
    ),
}


@pytest.mark.parametrize("source", [pendulum, planar_arm], ids=["pendulum", "planar_arm"])
@pytest.mark.parametrize("method", list(METHODS))
def test_method(benchmark, source, method):
    """One second of motion."""
    model, motion = source.build(), source.motion()
    METHODS[method](model, motion)
    benchmark.pedantic(METHODS[method], args=(model, motion), rounds=5)


@pytest.mark.parametrize("m", [2, 10, 100, 1000])
def test_window(benchmark, m):
    """One call for m muscles over 10 ms, from an ordinary state."""
    unit = next(iter(pendulum.build().muscles))
    muscles = em.MuscleSet(
        em.Muscle(
            f"{i}",
            max_isometric_force=3000.0,
            optimal_fiber_length=unit.optimal_fiber_length,
            tendon_slack_length=unit.tendon_slack_length,
        )
        for i in range(m)
    )
    a, l = np.full(m, 0.2), np.full(m, 0.315)
    F = em.equilibrium(muscles, a, l)
    v = np.full(m, 0.2)
    benchmark(em.integrate_window, muscles, a, F, np.full(m, 0.5), (l, l + 0.002), (v, v), 0.01)
