"""Muscles and limbs as vertices and triangles."""

import numpy as np
import pytest

from exudyn_muscles.path.paths import Paths
from exudyn_muscles.shapes import bellies, bones
from exudyn_muscles.shapes.tubes import merged, normals, triangles, tube
from exudyn_muscles.skeleton.segments import Segment

NO_PATHS = Paths.straight(np.empty((0, 3)), np.empty(0, dtype=np.int64), np.zeros(1, dtype=int))


def volume(mesh):
    """That of a closed surface whose triangles are seen from outside [m^3]."""
    a, b, c = (mesh[0][mesh[1][:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def test_a_tube_is_closed_and_seen_from_outside():
    points = np.linspace([0.1, 0.0, 0.0], [0.1, 0.0, 0.5], 7)
    mesh = tube(points, np.full(7, 0.02), 40), triangles(7, 40)
    assert volume(mesh) == pytest.approx(np.pi * 0.02**2 * 0.5, rel=0.01)
    edges = np.sort(np.vstack([mesh[1][:, [0, 1]], mesh[1][:, [1, 2]], mesh[1][:, [2, 0]]]))
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_a_muscle_follows_its_path_as_computed():
    """Rings lie on it, at its bends too, and it is as long."""
    line = np.array([[0.0, 0.0, 0.0], [0.0, 0.1, 0.02], [0.03, 0.2, 0.0], [0.03, 0.5, 0.0]])
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    rings, _ = bellies._rings(line, 0.2, (4, 13, 4))
    assert np.linalg.norm(np.diff(rings, axis=0), axis=1).sum() == pytest.approx(length, rel=1e-12)
    for point in line:
        assert np.linalg.norm(rings - point, axis=1).min() < 1e-12


def test_a_belly_thickens_with_force():
    line = [np.array([[0.0, 0.0, 0.0], [0.0, 0.4, 0.0]])] * 2
    body = bellies.body(line, np.full(2, 0.2), np.array([0.0, 1000.0]), 1000.0)
    relaxed, active = (np.hypot(*mesh[:, [0, 2]].T).max() for mesh in body.vertices)
    assert active == pytest.approx(np.sqrt(1000.0 / (np.pi * bellies.SPECIFIC_TENSION)), rel=0.01)
    assert relaxed == pytest.approx(active * np.sqrt(bellies.RESTING), rel=0.01)


def test_flesh_has_mass_and_inertia_of_its_segment():
    mass, axes = 2.0, np.array([0.05, 0.08, 0.2])
    tensor = np.diag([mass / 5.0 * (axes[[1, 2, 0]] ** 2 + axes[[2, 0, 1]] ** 2)][0])
    center = np.array([0.0, 0.0, -0.2])
    segment = Segment(2, mass, center, tensor, np.zeros((1, 3)), 0)
    vertices, _ = bones.flesh(segment)
    np.testing.assert_allclose(np.ptp(vertices, axis=0), 2.0 * axes, rtol=0.03)
    np.testing.assert_allclose(vertices.mean(axis=0), center, atol=1e-3)
    vertices, _ = bones.flesh(segment._replace(tensor=1e-9 * np.eye(3)))  # a point, as water
    radius = np.linalg.norm(vertices - center, axis=1).max()
    assert 4.0 / 3.0 * np.pi * radius**3 == pytest.approx(mass / 1000.0, rel=0.01)
    assert bones.flesh(segment._replace(tensor=np.eye(3))) is None  # lighter than anything


def test_merged_meshes_are_the_same_bodies():
    one = tube(np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, 0.5], 4), np.full(4, 0.02)), triangles(4)
    both = merged([one, (one[0] + 1.0, one[1])])
    assert volume(both) == pytest.approx(2.0 * volume(one))


def test_a_straight_muscle_takes_few_rings_and_a_bent_one_more():
    straight = np.array([[0.0, 0.0, 0.0], [0.0, 0.4, 0.0]])
    bent = np.array([[0.0, 0.0, 0.0], [0.0, 0.1, 0.02], [0.03, 0.2, 0.0], [0.03, 0.4, 0.0]])
    few, more = (
        bellies.body([line], np.full(1, 0.2), np.zeros(1), 1000.0).on_belly
        for line in (straight, bent)
    )
    assert len(few) < len(more) and few.sum() < more.sum()


def test_the_last_bone_ends_where_the_mass_does():
    """As far beyond the center as the joint is before it, of a rod; at the center, of a point."""
    center, moment = np.array([0.0, -0.2, 0.0]), 2.0 * 0.4**2 / 12.0
    rod = Segment(0, 2.0, center, np.diag([moment, 0.0, moment]), np.zeros((1, 3)), 0)
    for segment, end in ((rod, -0.4), (rod._replace(tensor=np.zeros((3, 3))), -0.2)):
        vertices, _ = bones.skeletal(segment, NO_PATHS, 0.01)
        knob = bones.END * abs(end)
        assert vertices[:, 1].min() == pytest.approx(end - knob, abs=0.05 * knob)
        assert vertices[:, 1].max() == pytest.approx(knob, abs=0.05 * knob)


def test_normals_of_a_tube_point_away_from_its_axis():
    points = np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, 0.5], 5)
    vertices, corners = tube(points, np.full(5, 0.02), 12), triangles(5, 12)
    found = normals(vertices, corners)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    middle = slice(24, 36)  # the third ring
    np.testing.assert_allclose(found[middle, :2], vertices[middle, :2] / 0.02, atol=0.01)
