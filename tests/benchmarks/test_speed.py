"""Timings, printed and never asserted:

pytest tests/benchmarks
"""

import pytest

import exudyn_muscles as em
from models import leg, pendulum, planar_arm

KP = 534.0
METHODS = {
    "static": em.static_optimization,
    "cmc": lambda model, motion: em.computed_muscle_control(
        model, motion, settings=em.CMCSettings(kp=KP)
    ),
    "csf": lambda model, motion: em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    ),
    "css": lambda model, motion: em.cosimulate(
        model, motion, settings=em.CosimulationSettings(kp=KP, scheme=em.Scheme.SIMPLIFIED)
    ),
}


@pytest.mark.parametrize(
    "source", [pendulum, planar_arm, leg], ids=["pendulum", "planar_arm", "leg"]
)
@pytest.mark.parametrize("method", list(METHODS))
def test_method(benchmark, source, method):
    """One second of motion."""
    model, motion = source.build(), source.motion()
    METHODS[method](model, motion)
    benchmark.pedantic(METHODS[method], args=(model, motion), rounds=5)
