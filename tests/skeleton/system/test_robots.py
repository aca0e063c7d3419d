"""Random chains in Exudyn's own two forms, a kinematic tree and bodies with joints."""

import numpy as np
import pytest

import exudyn_muscles as em

from .convert import EULER, TAIT_BRYAN, VECTOR
from .robots import RandomChain
from .test_runs import METHODS, order

SEEDS = pytest.mark.parametrize("seed", range(6))


@SEEDS
def test_equations(seed):
    chain = RandomChain(seed)
    node_type = (EULER, TAIT_BRYAN, VECTOR)[seed % 3]
    found = []
    for model in (chain.tree(), chain.bodies(node_type)):
        with model.skeleton.opened():
            M, bias, place = model.skeleton.dynamics_at(chain.q, chain.v, 0.0)
        found.append((M, bias, *model.geometry(*place)[:3]))
    for of_tree, of_bodies in zip(*found, strict=True):
        scale = max(1.0, np.abs(of_tree).max())
        np.testing.assert_allclose(of_bodies, of_tree, rtol=0, atol=1e-9 * scale)


@SEEDS
def test_static_optimization(seed):
    chain = RandomChain(seed)
    tree, bodies = (METHODS["static"](one, chain.motion) for one in (chain.tree(), chain.bodies()))
    assert tree.max_unmet_torque == 0.0
    for name in ("torques_demanded", "tendon_forces"):
        found, expected = getattr(bodies, name), getattr(tree, name)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


@SEEDS
def test_full_cosimulation(seed):
    """Both forms come together, and to the motion, with the square of the step."""
    chain, steps = RandomChain(seed), [0.02, 0.01, 0.005]
    apart, errors = [], []
    for step in steps:
        tree, bodies = (
            METHODS["csf"](one, chain.motion, step=step) for one in (chain.tree(), chain.bodies())
        )
        assert bodies.status is em.Status.COMPLETE
        assert bodies.max_unmet_torque == 0.0
        apart.append(np.abs(tree.coordinates - bodies.coordinates).max())
        errors.append(bodies.tracking_error_rms().max())
    assert order(steps, apart) == pytest.approx(2.0, abs=0.1)
    assert order(steps, errors) == pytest.approx(2.0, abs=0.1)
