"""Segments without a direction of their own: points on a surface, surfaces that touch, points that
coincide, points on an edge, an axis, or at a center."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exudyn_muscles as em
from exudyn_muscles.skeleton.tree import Tree

from ..differences import certified
from .chains import Muscles, chain, muscle, slider, straight_over
from .test_wrapping import KINDS, SURFACES, random_direction

RADIUS = 0.04
PULLEYS = {
    "cylinder": em.WrapCylinder(RADIUS, side="x"),
    "sphere": em.WrapSphere(RADIUS, side="x"),
    "ellipsoid": em.WrapEllipsoid([RADIUS, RADIUS, 0.06], side="x"),
}
EVERY_PULLEY = pytest.mark.parametrize("pulley", PULLEYS.values(), ids=PULLEYS)


def hinge(offset=(0.0, 0.0, 0.0), n=1):
    """Links that all turn about the global z axis, one on the other, at the same place."""
    return Tree(
        joints=np.full(n, 2),
        parents=np.arange(n) - 1,
        rotations=np.tile(np.eye(3), (n, 1, 1)),
        offsets=np.zeros((n, 3)),
        base=np.array(offset),
        reference=np.zeros(n),
    )


def on_the_rim(pulley, outside=0.0, offset=(0.0, 0.0, 0.0)):
    """A muscle that ends on the rim of a pulley about the joint's axis, all of it shifted."""
    pulley = dataclasses.replace(pulley, position=offset)
    ends = [
        em.PathPoint(np.add([0.02, 0.3, 0.0], offset)),
        em.PathPoint([0.0, -RADIUS - outside, 0.0], link=0),
    ]
    return Muscles(hinge(offset), muscle(ends, [pulley]), muscle(ends, name="straight"))


def wraps(muscles, q):
    wrapped, straight = muscles.lengths(q)
    return wrapped > straight + 1e-9


@EVERY_PULLEY
@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.7, -1.3, 0.2)])
def test_the_arm_on_the_rim_is_the_radius(pulley, offset):
    on = on_the_rim(pulley, offset=offset)
    sense, count = set(), 0
    for angle in np.linspace(-3.1, 3.1, 401):
        if not (wraps(on, [angle - 2e-3]) and wraps(on, [angle + 2e-3])):
            continue
        slope, apart = certified(lambda s: on.lengths([s])[0], angle, 1.0)
        if apart > 1e-6:  # around the other side
            continue
        arm = on.arms([angle])[0, 0]
        assert arm == pytest.approx(-slope, abs=1e-7)
        assert abs(arm) == pytest.approx(RADIUS, abs=1e-9)
        sense.add(np.sign(arm))
        count += 1
    assert count > 150
    if isinstance(pulley, em.WrapCylinder):
        assert sense == {1.0}


def random_pulley(rng, kind, carrier):
    """Muscles as a function of how far outside of a surface one end is, or both are.

    The last link of a chain turns about the surface, which is on the link before it, or slides
    along it: the end stays on the surface. Returns the number of links, too.
    """
    n = int(rng.integers(2, 5))
    tree, link = chain(rng, n), n - 2
    radii = rng.uniform(0.015, 0.03, 3)
    radii[1] = radii[0]
    if kind != "ellipsoid":
        radii[2] = {"cylinder": np.inf, "sphere": radii[0]}[kind]
    angles, center = rng.uniform(-3.0, 3.0, 3), rng.uniform(-0.01, 0.01, 3)
    rotation = Rotation.from_euler("XYZ", angles)
    tree.joints[-1] = rng.choice([2, 5]) if kind == "cylinder" else 2
    tree.rotations[-1], tree.offsets[-1] = rotation.as_matrix(), center
    surface = type(SURFACES[kind])(
        radii if kind == "ellipsoid" else radii[0],
        position=center,
        rotation=angles,
        link=link,
        side=rng.choice([None, "x", "-y"]),
    )
    directions = random_direction(rng), random_direction(rng)
    moving = [em.linear_function(*pair) for pair in rng.normal(0.0, [0.01, 0.04], (3, 2))]
    far = em.MovingPathPoint(*moving, link - 1, coordinate=0)

    def point(direction, outside, on_surfaces_link):
        x = direction / np.linalg.norm(direction / radii)
        normal = x / radii**2
        x = x + outside * normal / np.linalg.norm(normal)
        if on_surfaces_link:
            return em.PathPoint(rotation.apply(x) + center, link)
        return em.PathPoint(x, n - 1)

    def muscles(outside):
        ends = [point(directions[0], outside, carrier != "turning link")]
        ends.append(point(directions[1], outside, False) if carrier == "both links" else far)
        return Muscles(tree, muscle(ends, [surface]))

    return n, muscles


# How far outside of the surface in parts of the radius: by rounding, either way, and less than what
# counts as inside.
ROUNDED = (0.0, 1e-16, -1e-16, 3e-16, -3e-16, 1e-13, -1e-13, -5e-10)


@KINDS
@pytest.mark.parametrize("carrier", ["turning link", "surface's link", "both links"])
def test_points_on_a_surface(kind, carrier):
    """Against differences, and against points a little outside."""
    rng = np.random.default_rng(5)
    count = 0
    for _ in range(100):
        n, muscles = random_pulley(rng, kind, carrier)
        on, outside = muscles(0.02 * rng.choice(ROUNDED)), muscles(1e-10)
        q, v = rng.uniform(-0.5, 0.5, (2, n))
        v /= np.linalg.norm(v)
        found, limit = on.geometry(q, v), outside.geometry(q, v)
        slope, apart = certified(lambda s, on=on, q=q, v=v: on.lengths(q + s * v)[0], 0.0, 0.1)
        if apart > 1e-8:  # a kink or a jump: around another side
            continue
        assert found.lengthening_speed[0] == pytest.approx(slope, abs=1e-7)
        if abs(found.length[0] - limit.length[0]) < 1e-8:
            np.testing.assert_allclose(found.moment_arms, limit.moment_arms, rtol=0.0, atol=1e-7)
            count += 1
    assert count > 80


def test_a_via_point_on_the_rim():
    """On both of its sides the muscle wraps on, over two surfaces of the same shape and place."""
    ends = [em.PathPoint([0.3, -0.1, 0.0]), em.PathPoint([-0.3, -0.1, 0.0])]
    via = em.ConditionalPathPoint([0.0, RADIUS, 0.0], 0, coordinate=0, range=(-1.0, 1.0))
    pulley = em.WrapCylinder(RADIUS, side="y")
    halves = [em.PathWrap(pulley, 0, 1), em.PathWrap(pulley, 1, 2)]
    muscles = Muscles(hinge(), muscle([ends[0], via, ends[1]], halves))
    whole = Muscles(hinge(), muscle(ends, [pulley]))
    for q in np.linspace(-0.4, 0.4, 37):  # where the via point lies on the way
        assert muscles.lengths([q])[0] == pytest.approx(whole.lengths([q])[0], abs=1e-12)
        # Turning it along the way changes nothing.
        assert muscles.arms([q])[0, 0] == pytest.approx(0.0, abs=1e-12)
    for q in (-0.9, -0.7, 0.7, 0.9):
        slope, apart = certified(lambda s: muscles.lengths([s])[0], q, 1.0)
        assert apart < 1e-8
        assert muscles.arms([q])[0, 0] == pytest.approx(-slope, abs=1e-7)


@pytest.mark.parametrize("gap", [0.0, 1e-17, 1e-12, 1e-9, 1e-6])
def test_surfaces_that_touch(gap):
    """A crossed belt over two cylinders of which the lower one slides: where they touch, the
    straight part between them has no length and the direction of the common tangent."""
    r, s, P, Q = 0.02, 0.03, np.array([-0.1, 0.1]), np.array([0.1, -0.2])
    d = r + s + gap
    tilt = np.arccos((r + s) / d)  # of the straight part in the middle
    below = Q - [0.0, -d]
    p, q = np.hypot(*P), np.hypot(*below)
    first = np.arctan2(P[1], P[0]) - np.arccos(r / p) + 0.5 * np.pi - tilt
    last = np.arctan2(below[1], below[0]) - np.arccos(s / q) + 1.5 * np.pi - tilt
    straight = np.sqrt([p * p - r * r, q * q - s * s, d * d - (r + s) ** 2]).sum()
    for axis, arm in enumerate((np.cos(tilt), np.sin(tilt))):
        pulleys = [
            em.WrapCylinder(r, side="x"),
            em.WrapCylinder(s, side="-x", position=[0.0, -d, 0.0], link=0),
        ]
        ends = [em.PathPoint([*P, 0.0]), em.PathPoint([*Q, 0.0], link=0)]
        muscles = Muscles(slider(axis), muscle(ends, pulleys))
        expected = straight + r * first + s * last
        assert muscles.lengths([0.0])[0] == pytest.approx(expected, abs=1e-9)
        assert muscles.arms([0.0])[0, 0] == pytest.approx(arm, abs=1e-7)


def test_points_that_coincide_at_all_angles():
    """Points of two links in their common axis: rounding sets them apart, and nothing comes of
    it."""
    rng = np.random.default_rng(0)
    offset = np.array([0.31, -0.73, 1.1])
    axis = em.PathPoint([0.0, 0.0, 0.1]), em.PathPoint([0.0, 0.0, 0.1], link=1)
    first, last = em.PathPoint([0.4, 0.2, 0.1]), em.PathPoint([0.1, -0.2, 0.3], link=1)
    on_first = em.PathPoint([0.0, 0.0, 0.1], link=0)
    muscles = Muscles(
        hinge(offset, 2),
        muscle([first, on_first, axis[1], last], name="two"),
        muscle([first, axis[1], last], name="one"),
    )
    for q in rng.uniform(-3.0, 3.0, (200, 2)):
        l, _, r, _ = muscles.geometry(q, q)
        assert l[0] == pytest.approx(l[1], abs=1e-15)
        np.testing.assert_allclose(r[0], r[1], rtol=0.0, atol=1e-16)


def test_points_that_meet():
    """Where two points pass through each other the length has a kink: no direction is the mean of
    both, whatever rounding makes of their distance."""
    for rest in (0.0, 1e-15, -1e-15):
        path = [em.PathPoint([0.0, 1.0, 0.0]), em.PathPoint([0.0, 0.0, 0.0]),
                em.PathPoint([rest, 0.0, 0.0], link=0)]  # fmt: skip
        moves = em.MovingPathPoint(em.linear_function(1.0, rest), 0.0, 0.0, coordinate=0)
        muscles = Muscles(slider(), muscle(path), muscle([*path[:2], moves], name="moving"))
        np.testing.assert_array_equal(muscles.arms([0.0]), 0.0)
        np.testing.assert_allclose(muscles.arms([1e-3]), -1.0, rtol=1e-12)
        np.testing.assert_allclose(muscles.arms([-1e-3]), 1.0, rtol=1e-12)


def test_on_the_edge_of_a_cylinder():
    """In the plane of an end of the cylinder the muscle wraps, however that plane is rounded."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        surface = em.WrapCylinder(
            0.02, 0.06, position=rng.uniform(-1.0, 1.0, 3), rotation=rng.uniform(-3.0, 3.0, 3)
        )
        rotation = Rotation.from_euler("XYZ", surface.rotation)
        ends = [rotation.apply([x, 0.005, 0.03]) + surface.position for x in (-0.05, 0.05)]
        assert straight_over(surface, *ends) > 0.1 + 1e-3
        beyond = [rotation.apply([x, 0.005, 0.03 + 1e-9]) + surface.position for x in (-0.05, 0.05)]
        assert straight_over(surface, *beyond) == pytest.approx(0.1, rel=1e-12)


@KINDS
def test_between_the_sides(kind):
    """Where a line passes the center neither on the right side nor on the wrong one, it takes the
    shorter way, however that is rounded."""
    rng = np.random.default_rng(0)
    lines = {
        "along the side": ([-0.06, 0.01, 0.0], [0.06, 0.01, 0.0]),
        "towards the axis": ([0.0, 0.06, 0.0], [0.0, 0.03, 0.0]),
    }
    for (P, Q), wraps in zip(lines.values(), (True, False), strict=True):
        lengths = []
        for _ in range(100):
            surface = dataclasses.replace(
                SURFACES[kind],
                position=rng.uniform(-1.0, 1.0, 3),
                rotation=rng.uniform(-3.0, 3.0, 3),
                side=rng.choice(["x", "-x"]),
            )
            rotation = Rotation.from_euler("XYZ", surface.rotation)
            ends = [rotation.apply(x) + surface.position for x in (P, Q)]
            lengths.append(straight_over(surface, *ends))
        np.testing.assert_allclose(lengths, lengths[0], rtol=1e-9)
        straight = np.linalg.norm(np.subtract(P, Q))
        assert (lengths[0] > straight + 1e-4) == wraps
        unsided = straight_over(SURFACES[kind], P, Q)
        assert lengths[0] == pytest.approx(unsided, rel=1e-9)


@KINDS
def test_on_the_axis_and_at_the_center(kind):
    """These are inside: nothing wraps."""
    tree = slider()
    for inside in ([0.0, 0.0, 0.0], [0.0, 0.0, 0.012], [1e-17, -1e-17, 0.0]):
        ends = em.PathPoint(inside), em.PathPoint([0.06, 0.01, 0.002], link=0)
        for path in (ends, ends[::-1]):
            muscles = Muscles(tree, muscle(path, [SURFACES[kind]]), muscle(path, name="straight"))
            l, _, r, _ = muscles.geometry(np.zeros(1), np.zeros(1))
            assert l[0] == l[1] and (r[0] == r[1]).all()


def test_surfaces_that_overlap():
    """They displace each other from the muscle, or from their places along it: it comes to rest all
    the same."""
    rng = np.random.default_rng(0)
    count = 0
    for _ in range(150):
        n = int(rng.integers(2, 5))

        def surface(rng=rng, n=n):
            kind = [em.WrapCylinder, em.WrapSphere][rng.integers(2)]
            return kind(
                rng.uniform(0.015, 0.03),
                position=rng.normal(0.0, 0.01, 3),
                link=int(rng.integers(-1, n)),
                side=rng.choice(["x", "-x", "y", "-y"]),
            )

        path = [em.PathPoint(rng.normal(0.0, 0.05, 3), int(rng.integers(-1, n))) for _ in range(3)]
        muscles = Muscles(chain(rng, n), muscle(path, [surface() for _ in range(3)]))
        q, v = rng.uniform(-1.0, 1.0, n), random_direction(rng)[:n]
        v = np.resize(v, n)
        slope, apart = certified(lambda s, m=muscles, q=q, v=v: m.lengths(q + s * v)[0], 0.0, 0.1)
        if apart < 1e-9:
            speed = muscles.geometry(q, v).lengthening_speed[0]
            assert speed == pytest.approx(slope, abs=1e-7)
            count += 1
    assert count > 130
