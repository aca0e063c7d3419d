"""models/leg.py as bodies with joints beside the tree: a ball, a knee that slides, paths over
coordinates and surfaces."""

import numpy as np
import pytest

import exudyn_muscles as em
from models import leg

from . import leg as of_bodies
from .convert import EULER, TAIT_BRYAN, VECTOR
from .test_runs import METHODS, order

# A part in which no points come and go, where forces jump.
TIMES = np.linspace(0.5, 0.7, 81)
PART = em.Motion.from_samples(TIMES, leg.motion()(TIMES)[0])


def both(method, **settings):
    return [METHODS[method](one.build(), PART, **settings) for one in (leg, of_bodies)]


@pytest.mark.parametrize("node_type", [EULER, TAIT_BRYAN, VECTOR])
def test_equations(node_type):
    q, v, _ = leg.motion()(0.3)
    found = []
    for model in (leg.build(), of_bodies.build(node_type)):
        with model.skeleton.opened():
            M, bias, place = model.skeleton.dynamics_at(q, v, 0.0)
        found.append((M, bias, *model.geometry(*place)[:3]))
    for of_tree, bodies in zip(*found, strict=True):
        scale = max(1.0, np.abs(of_tree).max())
        # H has differences along the motion in it, rounded to 1e-10.
        np.testing.assert_allclose(bodies, of_tree, rtol=0, atol=3e-10 * scale)


@pytest.mark.parametrize("method", ["csf", "css"])
def test_runs_differ_by_the_discretisation(method):
    """CSS recruits at predicted states, whose difference falls even faster."""
    steps, apart = [0.02, 0.01, 0.005], []
    for step in steps:
        tree, bodies = both(method, step=step)
        assert bodies.max_unmet_torque == 0.0
        apart.append(np.abs(tree.coordinates - bodies.coordinates).max())
    assert order(steps, apart) > 1.9
    assert apart[-1] < 1e-4


def test_computed_muscle_control_and_replay():
    tree, bodies = both("cmc")
    np.testing.assert_allclose(bodies.coordinates, tree.coordinates, rtol=0, atol=1e-5)
    again = em.forward_dynamics(of_bodies.build(), bodies.excitations)
    np.testing.assert_allclose(again.coordinates, bodies.coordinates, rtol=0, atol=1e-9)


def test_static_optimization():
    tree, bodies = both("static")
    for name in ("tendon_forces", "activations", "excitation_values", "torques_demanded"):
        found, expected = getattr(bodies, name), getattr(tree, name)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
