"""Results to draw, and figures closed afterwards."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import pytest

import exudyn_muscles as em
from models import pendulum


@pytest.fixture(scope="module")
def results():
    """Short runs of the methods on the pendulum, and a replay."""
    model, motion = pendulum.build(), pendulum.motion()
    gain = {"kp": 534.0}
    cmc = em.computed_muscle_control(model, motion, settings=em.CMCSettings(**gain))
    return {
        "static": em.static_optimization(model, motion),
        "cmc": cmc,
        "csf": em.cosimulate(
            model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, **gain)
        ),
        "css": em.cosimulate(
            model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.SIMPLIFIED, **gain)
        ),
        "forward": em.forward_dynamics(model, cmc.excitations),
    }


@pytest.fixture(autouse=True)
def closed_figures():
    yield
    plt.close("all")
