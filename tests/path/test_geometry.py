"""Paths on random trees: Exudyn's own markers, differences, power."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import MarkerKinematicTreeRigid

import exudyn_muscles as em
from exudyn_muscles.skeleton.geometry import compile_geometry, path_points
from exudyn_muscles.skeleton.skeleton import Skeleton

from ..differences import gradient
from .trees import JOINTS, add_tree, paths_of, random_links

SEEDS = range(12)


def muscle(name, path):
    return em.Muscle(
        name,
        max_isometric_force=100.0,
        optimal_fiber_length=0.1,
        tendon_slack_length=0.1,
        path=path,
    )


def random_paths(rng, n, m=8):
    """Paths of 2 to 5 points on ground and on any link; the last one runs from ground to ground."""
    muscles = [
        muscle(
            f"m{i}",
            [
                em.PathPoint(rng.uniform(-0.4, 0.4, 3), link=int(rng.integers(-1, n)))
                for _ in range(rng.integers(2, 6))
            ],
        )
        for i in range(m - 1)
    ]
    ground = muscle("ground", [em.PathPoint(rng.uniform(-1.0, 1.0, 3)) for _ in range(3)])
    return em.MuscleSet([*muscles, ground])


class Oracle:
    """The same points as rigid markers of Exudyn."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.rng = rng
        n = 6 + seed % 4
        # Every type of joint at least once.
        joints = [JOINTS[k] for k in (*rng.permutation(6), *rng.integers(0, 6, n - 6))]
        self.mbs = exu.SystemContainer().AddSystem()
        number = add_tree(self.mbs, rng, random_links(rng, n, joints))
        self.muscles = random_paths(rng, n)
        self.markers = [
            [self.add_marker(number, point) for point in muscle.path] for muscle in self.muscles
        ]
        self.mbs.Assemble()
        self.tree = Skeleton(self.mbs, number).tree
        self.paths = paths_of(self.muscles, n)
        self.geometry = compile_geometry(self.tree, self.paths, self.muscles.names)

    def add_marker(self, number, point):
        if point.link < 0:
            return np.array(point.position)
        return self.mbs.AddMarker(
            MarkerKinematicTreeRigid(
                objectNumber=number, linkNumber=point.link, localPosition=point.position
            )
        )

    def points(self, q):
        self.mbs.systemData.SetODE2Coordinates(q)
        return [
            np.array([x if isinstance(x, np.ndarray) else self.position(x) for x in markers])
            for markers in self.markers
        ]

    def position(self, marker):
        return np.array(self.mbs.GetMarkerOutput(marker, exu.OutputVariableType.Position))

    def states(self, count=5):
        for _ in range(count):
            yield self.rng.uniform(-2.0, 2.0, (2, len(self.tree)))


@pytest.fixture(scope="module", params=SEEDS)
def oracle(request):
    return Oracle(request.param)


def test_points_are_exudyns_markers(oracle):
    for q, _ in oracle.states():
        for ours, theirs in zip(
            path_points(oracle.tree, oracle.paths, q), oracle.points(q), strict=True
        ):
            np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-12)


def test_lengths_are_exudyns(oracle):
    for q, v in oracle.states():
        lengths = [
            np.linalg.norm(np.diff(points, axis=0), axis=1).sum() for points in oracle.points(q)
        ]
        np.testing.assert_allclose(oracle.geometry(q, v).length, lengths, rtol=0.0, atol=1e-12)


def test_moment_arms_against_differences(oracle):
    for q, v in oracle.states():
        r = oracle.geometry(q, v).moment_arms
        expected = -gradient(lambda x, v=v: oracle.geometry(x, v).length, q, 1e-3)
        np.testing.assert_allclose(r, expected, rtol=0.0, atol=1e-8)


def test_lengthening_speed(oracle):
    """l' = -r q', and the rate of the length along the motion."""
    for q, v in oracle.states():
        geometry = oracle.geometry(q, v)
        np.testing.assert_allclose(
            geometry.lengthening_speed, -geometry.moment_arms @ v, rtol=0.0, atol=1e-13
        )
        rate = gradient(lambda t, q=q, v=v: oracle.geometry(q + t[0] * v, v).length, [0.0], 1e-4)
        np.testing.assert_allclose(geometry.lengthening_speed, rate[:, 0], rtol=0.0, atol=1e-8)


def test_ground_to_ground(oracle):
    (q, v), (other, _) = oracle.states(2)
    here, there = oracle.geometry(q, v), oracle.geometry(other, v)
    assert here.length[-1] == there.length[-1] > 0.0
    assert here.lengthening_speed[-1] == 0.0
    assert (here.moment_arms[-1] == 0.0).all()


def test_coordinates_outside_a_muscles_span_have_no_arm(oracle):
    """A muscle acts only on joints between its points, not on those that carry all of them."""
    (q, v), _ = oracle.states(2)
    r = oracle.geometry(q, v).moment_arms
    for i, muscle in enumerate(oracle.muscles):
        chains = []
        for point in muscle.path:
            chain, link = set(), point.link
            while link >= 0:
                chain.add(link)
                link = oracle.tree.parents[link]
            chains.append(chain)
        spanned = set.union(*chains) - set.intersection(*chains)
        idle = [j for j in range(len(oracle.tree)) if j not in spanned]
        np.testing.assert_allclose(r[i, idle], 0.0, atol=1e-15)


def test_coincident_points():
    """A segment of no length has no direction; the rest of the path counts."""
    mbs = exu.SystemContainer().AddSystem()
    rng = np.random.default_rng(1)
    number = add_tree(mbs, rng, random_links(rng, 2))
    mbs.Assemble()
    tree = Skeleton(mbs, number).tree
    via = em.PathPoint([0.1, 0.2, 0.3], link=1)
    ends = em.PathPoint([0.5, 0.0, 0.0]), em.PathPoint([0.0, 0.1, 0.0], link=0)
    muscles = em.MuscleSet(
        [muscle("once", [ends[0], via, ends[1]]), muscle("twice", [ends[0], via, via, ends[1]])]
    )
    geometry = compile_geometry(tree, paths_of(muscles, 2), muscles.names)(np.ones(2), np.ones(2))
    assert geometry.length[0] == pytest.approx(geometry.length[1], rel=1e-15)
    np.testing.assert_allclose(geometry.moment_arms[0], geometry.moment_arms[1], rtol=1e-14)
