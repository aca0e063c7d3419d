"""Muscles through the hole of a torus: closed forms, differences, limiting cases, pictures."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exudyn_muscles as em
from exudyn_muscles.path.lines import surfaces
from exudyn_muscles.path.surfaces import CYLINDER
from exudyn_muscles.path.torus import FREE, wrap_over_torus
from exudyn_muscles.skeleton.tree import tree_frames

from ..differences import gradient
from .chains import Muscles, chain, muscle, slider, straight_over

TUBE, CIRCLE = 0.02, 0.06
RING = em.WrapTorus(TUBE, CIRCLE)


def wrap(P, Q, axis=0, side=0.0):
    """Status, length and contact."""
    contact, work = np.zeros((4, 3)), np.zeros((20, 8))
    status, arc = wrap_over_torus(TUBE, CIRCLE, axis, side, P, Q, contact, work)
    if status == FREE:
        return status, np.linalg.norm(P - Q), contact
    ends = np.linalg.norm(P - contact[0]) + np.linalg.norm(Q - contact[1])
    return status, ends + arc, contact


def pairs(count=300):
    """Points above and below the ring."""
    rng = np.random.default_rng(3)
    for _ in range(count):
        P, Q = rng.uniform([-0.02, -0.05, 0.03], [0.12, 0.05, 0.15], (2, 3))
        yield P, Q * [1.0, 1.0, -1.0]


def test_in_a_plane_through_its_axis_it_is_a_circle():
    """Around the tube's inner side: two tangents and an arc."""
    P, Q = np.array([0.09, 0.0, 0.1]), np.array([0.05, 0.0, -0.08])
    length = straight_over(RING, P.tolist(), Q.tolist())
    center = np.array([CIRCLE, 0.0, 0.0])
    p, q = P - center, Q - center
    a, b = (np.sqrt(x @ x - TUBE**2) for x in (p, q))
    # Counterclockwise from the one below to the one above, by the side of the axis.
    angle = (np.arctan2(q[2], q[0]) - np.arctan2(p[2], p[0])) % (2.0 * np.pi)
    turn = angle - np.arctan2(a, TUBE) - np.arctan2(b, TUBE)
    assert turn > 0.1
    assert length == pytest.approx(a + b + TUBE * turn, abs=1e-14)


def test_length_is_stationary_and_the_moment_about_the_axis_the_same_on_both_sides():
    wrapped = 0
    for P, Q in pairs():
        status, _, contact = wrap(P, Q)
        if status == FREE:
            continue
        wrapped += 1
        slopes = gradient(lambda X, Q=Q: wrap(X, Q)[1], P, 1e-4)
        np.testing.assert_allclose(slopes, -contact[2], rtol=0, atol=1e-8)
        slopes = gradient(lambda X, P=P: wrap(P, X)[1], Q, 1e-4)
        np.testing.assert_allclose(slopes, contact[3], rtol=0, atol=1e-8)
        moments = [np.cross(X, e)[2] for X, e in ((P, contact[2]), (Q, contact[3]))]
        np.testing.assert_allclose(*moments, rtol=0, atol=1e-14)
        distances = np.hypot(np.hypot(*contact[:2, :2].T) - CIRCLE, contact[:2, 2])
        assert (distances < TUBE + 1e-2).all()  # a cylinder leaves the tube
    assert wrapped > 100


def test_the_line_through_the_hole_stays_straight():
    P, Q = np.array([0.01, 0.0, 0.1]), np.array([-0.01, 0.02, -0.1])
    assert wrap(P, Q)[0] == FREE


def test_a_side_that_the_line_does_not_pass_lets_go():
    P, Q = np.array([0.07, 0.01, 0.1]), np.array([0.05, 0.0, -0.1])
    _, free, _ = wrap(P, Q)
    for side, expected in ((1.0, free), (-1.0, np.linalg.norm(P - Q))):
        assert wrap(P, Q, 0, side)[1] == expected
    assert free > np.linalg.norm(P - Q) + 1e-4


def test_continuous_where_it_lifts_off():
    """The line that just touches the tube."""
    P, Q = np.array([CIRCLE - TUBE, 0.0, 0.1]), np.array([CIRCLE - TUBE, 0.0, -0.1])
    for off in (1e-6, -1e-6):
        shift = np.array([off, 0.0, 0.0])
        status, length, _ = wrap(P + shift, Q + shift)
        assert (status == FREE) == (off < 0.0)
        assert length == pytest.approx(0.2, abs=1e-10)


def test_moment_arms_are_minus_dl_dq():
    tree = chain(np.random.default_rng(4), 3)
    R, p, _ = tree_frames(tree, np.zeros(3))
    ring = em.WrapTorus(TUBE, CIRCLE, position=[0.01, 0.0, 0.0], rotation=[0.2, -0.1, 0.3], link=1)
    turn = R[1] @ Rotation.from_euler("XYZ", ring.rotation).as_matrix()
    place = p[1] + R[1] @ ring.position
    above, below = (place + turn @ x for x in ([0.07, 0.02, 0.1], [0.06, 0.01, -0.09]))
    path = [em.PathPoint(above), em.PathPoint(R[2].T @ (below - p[2]), link=2)]
    muscles = Muscles(tree, muscle(path, [ring]))
    q = np.array([0.03, -0.02, 0.01])
    (points,) = muscles.points(q)
    assert len(points) > 6
    r = muscles.arms(q)
    assert np.abs(r).max() > 0.01
    np.testing.assert_allclose(r, -gradient(muscles.lengths, q, 1e-4), rtol=0, atol=1e-8)


def test_drawn_points_lie_on_the_tube_and_the_ring_is_of_cylinders():
    path = [em.PathPoint([0.08, 0.0, 0.1]), em.PathPoint([0.07, 0.01, -0.09])]
    muscles = Muscles(slider(), muscle(path, [RING]))
    (points,) = muscles.points([0.0])
    over = points[1:-1]
    distances = np.hypot(np.hypot(*over[:, :2].T) - CIRCLE, over[:, 2])
    np.testing.assert_allclose(distances, TUBE, rtol=0, atol=1e-3)
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert chords == pytest.approx(muscles.lengths([0.0])[0], rel=1e-3)
    R, p, _ = tree_frames(muscles.tree, np.zeros(1))
    ring = surfaces(muscles.paths, R, p)
    assert {shape for shape, _, _ in ring} == {CYLINDER}
    centers = np.array([pose[:3, 3] for _, pose, _ in ring])
    np.testing.assert_allclose(np.hypot(*centers[:, :2].T), CIRCLE, rtol=1e-12)
    assert sum(2.0 * half for _, _, half in ring) == pytest.approx(2.0 * np.pi * CIRCLE, rel=0.01)


@pytest.mark.parametrize(
    ("radii", "message"),
    [
        ((0.02, 0.02), "outer_radius = 0.02 m is not above inner_radius = 0.02 m"),
        ((0.0, 0.02), "inner_radius = 0.0 m is outside"),
        ((0.01, "wide"), "outer_radius = 'wide'"),
    ],
)
def test_bad_radii(radii, message):
    with pytest.raises(em.ParameterError, match=message):
        em.WrapTorus(*radii)
