"""Torques of given forces at many places at once, beside those by moment arms at each."""

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em
from models import leg, planar_arm

from ..path.test_geometry import muscle, random_paths
from ..path.trees import add_tree, random_links
from .system.convert import as_bodies


def by_moment_arms(model, places, forces):
    m, torques = len(model.muscles), []
    for place in places:
        geometry = model.geometry(*place)
        torques.append(forces[:m] @ geometry.moment_arms)
        if model.reserves:
            torques[-1] += geometry.columns @ forces[m:]
    return np.array(torques)


def check(model, seed):
    """At a place, with one coordinate after the other displaced, and somewhere else."""
    rng = np.random.default_rng(seed)
    q, v = rng.uniform(-0.3, 0.3, (2, len(model.coordinates)))
    moved = [q, *(q + 0.01 * np.eye(q.size)), q + rng.uniform(-0.1, 0.1, q.size)]
    forces = rng.uniform(10.0, 100.0, len(model.muscles) + len(model.reserves))
    with model.skeleton.opened():
        places = [model.skeleton.dynamics_at(row, v, 0.0).place for row in moved]
        found, expected = model.torques(places, forces), by_moment_arms(model, places, forces)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11)
    assert np.ptp(expected, axis=0).max() > 1e-3


@pytest.mark.filterwarnings("ignore::exudyn_muscles.PathWarning")
@pytest.mark.parametrize("seed", range(6))
def test_random_trees_with_paths_and_actuators_of_all_kinds(seed):
    rng = np.random.default_rng(seed)
    cylinder = em.WrapCylinder(0.05, position=[0.05, 0.0, 0.02], rotation=[0.3, 0.2, 0.0], link=2)
    ball = em.WrapEllipsoid([0.03, 0.05, 0.04], link=1)
    moving = em.MovingPathPoint(
        em.Curve.line(0.1, 0.2), 0.05, em.Curve.line(0.0, -0.1), 2, coordinate="q4"
    )
    passing = em.ConditionalPathPoint([0.1, 0.2, 0.0], link=1, coordinate="q3", range=(-0.2, 0.3))
    origin, insertion = em.PathPoint([0.3, -0.2, 0.1]), em.PathPoint([0.2, 0.1, 0.0], link=4)
    muscles = [
        *random_paths(rng, 5),
        em.Muscle(
            "wrapped", max_isometric_force=1.0, optimal_fiber_length=0.1, tendon_slack_length=0.1,
            path=[origin, insertion], wraps=[cylinder, ball],
        ),
        muscle("moving", [origin, moving]),
        muscle("passing", [origin, passing, insertion]),
        muscle("function", em.FunctionPath([(0.4, {}), (0.1, {"q1": 1, "q3": 2})])),
    ]  # fmt: skip
    reserves = [
        em.PathActuator("cable", path=[origin, insertion], wraps=[ball], optimal_force=1.0),
        em.Reserve("q1", 1.0),
        em.PointActuator(
            "push", link=3, point=[0.1, 0.0, 0.0], direction=[0.0, 1.0, 0.2], optimal_force=1.0
        ),
        em.PathActuator("rod", path=[origin, insertion], optimal_force=1.0, pushes=True),
        em.TorqueActuator("turn", link=4, axis=[0.0, 0.0, 1.0], against=1, optimal_force=1.0),
    ]
    mbs = exu.SystemContainer().AddSystem()
    tree = add_tree(mbs, rng, random_links(rng, 5))
    mbs.Assemble()
    check(em.MusculoskeletalModel(mbs, tree, muscles, reserves=reserves), seed)


def test_dependent_coordinates():
    check(leg.build().replace(reserves=[em.Reserve("knee", 1.0)]), 0)


def test_a_system_of_bodies():
    check(as_bodies(planar_arm.build()), 0)
