"""Chains of links without Exudyn, and muscles on them."""

import numpy as np
from scipy.spatial.transform import Rotation

import exudyn_muscles as em
from exudyn_muscles.skeleton.geometry import compile_geometry, path_points
from exudyn_muscles.skeleton.tree import Tree

from .trees import paths_of

UNIT = {"max_isometric_force": 1.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.1}


def muscle(path, wraps=(), name="soleus"):
    return em.Muscle(name, **UNIT, path=path, wraps=wraps)


def chain(rng, n):
    """n links one behind the other, with mixed joints."""
    return Tree(
        joints=rng.integers(0, 6, n),
        parents=np.arange(n) - 1,
        rotations=Rotation.random(n, random_state=rng).as_matrix(),
        offsets=rng.uniform(-0.05, 0.05, (n, 3)),
        base=rng.uniform(-0.1, 0.1, 3),
        reference=rng.uniform(-1.0, 1.0, n),
    )


def slider(axis=0):
    """One link that slides along a global axis."""
    return Tree(
        joints=np.array([3 + axis]),
        parents=np.array([-1]),
        rotations=np.eye(3)[None],
        offsets=np.zeros((1, 3)),
        base=np.zeros(3),
        reference=np.zeros(1),
    )


class Muscles:
    """Muscles on a tree."""

    def __init__(self, tree, *muscles, names=None):
        self.tree = tree
        self.paths = paths_of(muscles, len(tree), names)
        self.geometry = compile_geometry(tree, self.paths, [each.name for each in muscles])

    def lengths(self, q):
        q = np.asarray(q, dtype=float)
        return self.geometry(q, np.zeros(q.size)).length

    def arms(self, q):
        q = np.asarray(q, dtype=float)
        return self.geometry(q, np.zeros(q.size)).moment_arms

    def points(self, q):
        return path_points(self.tree, self.paths, q)


def straight_over(surface, P, Q):
    """Length of a muscle from P to Q over a surface, all of them on ground."""
    path = [em.PathPoint(P), em.PathPoint(Q)]
    return Muscles(slider(), muscle(path, [surface])).lengths([0.0])[0]
