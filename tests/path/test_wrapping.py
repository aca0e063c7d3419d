"""Muscles over surfaces: closed forms, an independent integrator, differences, limiting cases."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

import exudyn_muscles as em
from exudyn_muscles.path.geodesic import wrap_over_ellipsoid
from exudyn_muscles.path.surfaces import CYLINDER

from ..differences import certified
from .chains import UNIT, Muscles, chain, muscle, slider, straight_over

SURFACES = {
    "cylinder": em.WrapCylinder(0.02),
    "sphere": em.WrapSphere(0.02),
    "ellipsoid": em.WrapEllipsoid([0.03, 0.02, 0.015]),
}
KINDS = pytest.mark.parametrize("kind", list(SURFACES))
seeds = st.integers(0, 2**32 - 1)


def random_surface(rng, kind, link):
    place = {
        "position": rng.uniform(-0.01, 0.01, 3),
        "rotation": rng.uniform(-3.0, 3.0, 3),
        "link": link,
        "name": kind,
    }
    radii = rng.uniform(0.015, 0.03, 3)
    if kind == "cylinder":
        return em.WrapCylinder(radii[0], **place)
    if kind == "sphere":
        return em.WrapSphere(radii[0], **place)
    return em.WrapEllipsoid(radii, **place)


def random_direction(rng):
    direction = rng.standard_normal(3)
    return direction / np.linalg.norm(direction)


def test_cylinder_across():
    """Number from OpenSim's own test of its cylinder (testWrapCylinder.cpp)."""
    P, Q = [2.0, 0.9, 0.0], [-2.0, 1.0, 0.0]
    tangents = sum(np.sqrt(np.dot(X, X) - 1.0) for X in (P, Q))
    length = straight_over(em.WrapCylinder(1.0), P, Q)
    assert length - tangents == pytest.approx(0.0505974872969326, abs=1e-13)


@given(
    st.floats(1.0, 3.0),
    st.floats(1.0, 3.0),
    st.floats(0.0, 3.1),
    st.floats(-2.0, 2.0),
    st.booleans(),
)
def test_cylinder(p, q, angle, rise, reverse):
    """The cylinder unrolls into a plane."""
    P, Q = [p, 0.0, 0.3], [q * np.cos(angle), q * np.sin(angle), 0.3 + rise]
    turn = angle - np.arccos(1.0 / p) - np.arccos(1.0 / q)
    flat = np.sqrt(p * p - 1.0) + max(turn, 0.0) + np.sqrt(q * q - 1.0)
    if turn < 0.0:
        flat = np.hypot(P[0] - Q[0], P[1] - Q[1])
    length = straight_over(em.WrapCylinder(1.0), *((Q, P) if reverse else (P, Q)))
    assert length == pytest.approx(np.hypot(flat, rise), rel=1e-13)


@given(seeds, st.floats(1.0, 3.0), st.floats(1.0, 3.0), st.floats(0.0, 3.1))
def test_sphere(seed, p, q, angle):
    rng = np.random.default_rng(seed)
    a, b = np.linalg.qr(rng.standard_normal((3, 2)))[0].T
    P, Q = p * a, q * (np.cos(angle) * a + np.sin(angle) * b)
    turn = angle - np.arccos(1.0 / p) - np.arccos(1.0 / q)
    expected = np.sqrt(p * p - 1.0) + turn + np.sqrt(q * q - 1.0)
    if turn < 0.0:
        expected = np.linalg.norm(P - Q)
    place = {"position": rng.uniform(-1.0, 1.0, 3), "rotation": rng.uniform(-3.0, 3.0, 3)}
    # At arccos(1 / 1.0000...) half of the digits are lost in the formula above.
    for surface in (em.WrapSphere(1.0, **place), em.WrapEllipsoid([1.0] * 3, **place)):
        length = straight_over(surface, P + surface.position, Q + surface.position)
        assert length == pytest.approx(expected, abs=3e-8)


def test_ellipsoid_in_a_plane_of_symmetry():
    """Across a plane of symmetry the geodesic is an arc of an ellipse."""
    a, b, c = 0.03, 0.02, 0.015
    P, Q = np.array([-0.05, 0.018, 0.0]), np.array([0.05, 0.018, 0.0])
    # The tangent from Q touches at (a cos t, b sin t) with x cos t / a + y sin t / b = 1.
    x, y = Q[0] / a, Q[1] / b
    t = np.arctan2(y, x) + np.arccos(1.0 / np.hypot(x, y))
    touch = np.array([a * np.cos(t), b * np.sin(t), 0.0])
    arc, _ = quad(
        lambda s: np.hypot(a * np.sin(s), b * np.cos(s)), t, np.pi - t, epsabs=1e-15, epsrel=1e-14
    )
    expected = 2.0 * np.linalg.norm(Q - touch) + arc
    assert straight_over(em.WrapEllipsoid([a, b, c]), P, Q) == pytest.approx(expected, abs=1e-13)


@given(seeds)
@settings(deadline=None)
def test_ellipsoid_against_another_integrator(seed):
    """The contact touches the lines to P and Q and satisfies the equation of geodesics."""
    rng = np.random.default_rng(seed)
    radii = 0.02 * rng.uniform(0.6, 1.8, 3)
    P, Q = (radii * random_direction(rng) * rng.uniform(1.01, 3.0) for _ in range(2))
    contact = np.empty((4, 3))
    cut, arc = wrap_over_ellipsoid(radii, 0, 0.0, np.zeros(3), P, Q, contact, np.empty((20, 8)))
    if not cut or np.isnan(arc):
        return
    start, end, first, last = contact
    D = 1.0 / radii**2

    def rate(_, y):
        x, v = y[:3], y[3:]
        return [*v, *(-(v @ (D * v)) / ((D * x) @ (D * x)) * D * x)]

    solution = solve_ivp(rate, [0, arc], [*start, *first], "DOP853", rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(solution.y[:3, -1], end, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(solution.y[3:, -1], last, rtol=0.0, atol=1e-8)
    assert start @ (D * start) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(np.cross(start - P, first), 0.0, atol=1e-15)
    np.testing.assert_allclose(np.cross(Q - end, last), 0.0, atol=1e-11)


@given(seeds, st.sampled_from([[kind] for kind in SURFACES] + [["ellipsoid", "cylinder"]]))
@settings(deadline=None, max_examples=150)
def test_moment_arms_are_minus_dl_dq(seed, kinds):
    """Along a random direction, where differences over many steps agree."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    muscles = Muscles(
        chain(rng, n),
        muscle(
            [
                em.PathPoint(0.05 * random_direction(rng)),
                em.PathPoint(0.05 * random_direction(rng), link=n - 1),
            ],
            [random_surface(rng, kind, int(rng.integers(-1, n))) for kind in kinds],
        ),
    )
    q, v = rng.uniform(-0.5, 0.5, (2, n))
    v /= np.linalg.norm(v)
    slope, apart = certified(lambda s: muscles.lengths(q + s * v)[0], 0.0, 0.1)
    geometry = muscles.geometry(q, v)
    if apart < 1e-9:
        assert geometry.lengthening_speed[0] == pytest.approx(slope, abs=1e-8)
    assert geometry.lengthening_speed[0] == pytest.approx(-geometry.moment_arms[0] @ v, abs=1e-15)


@KINDS
def test_continuous_where_it_lifts_off(kind):
    """A line that moves away sideways: l and r have no jump, and end at those of the line."""
    path = [em.PathPoint([-0.06, 0.0, 0.004]), em.PathPoint([0.06, 0.0, -0.003], link=0)]
    wrapped = Muscles(slider(1), muscle(path, [SURFACES[kind]]))
    alone = Muscles(slider(1), muscle(path))
    q = np.linspace(0.002, 0.08, 4001)[:, None]  # over the center it turns fast
    l, r = (np.array([f(x)[0].ravel() for x in q])[:, 0] for f in (wrapped.lengths, wrapped.arms))
    assert np.abs(np.diff(l)).max() < 2.0 * 2e-5
    assert np.abs(np.diff(r)).max() < 1e-3
    straight = np.array([alone.lengths(x)[0] for x in q])
    assert (l >= straight - 1e-15).all()
    free = np.flatnonzero(l == straight)
    assert 100 < free[0] < 3900
    assert (l[free[0] :] == straight[free[0] :]).all()
    np.testing.assert_allclose(l[free[0] - 1], straight[free[0] - 1], rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("side", ["x", "-x", "y", "-y"])
@KINDS
def test_side(kind, side):
    """The muscle passes on its side, on whichever side of the center its line does."""
    axis, sign = "xyz".index(side[-1]), -1.0 if side[0] == "-" else 1.0
    size = {"radii": [0.02] * 3} if kind == "ellipsoid" else {"radius": 0.02}
    surface = type(SURFACES[kind])(**size, side=side)
    for offset in (-0.005, 0.005):
        ends = np.zeros((2, 3))
        ends[:, axis], ends[:, 1 - axis] = offset, [-0.05, 0.05]
        muscles = Muscles(slider(), muscle([em.PathPoint(x) for x in ends], [surface]))
        farthest = (sign * muscles.points([0.0])[0][:, axis]).max()
        assert farthest == pytest.approx(0.02, rel=1e-9)
        tangent = np.sqrt(0.05**2 + offset**2 - 0.02**2)
        angle = np.pi - 2.0 * np.arccos(0.02 / np.hypot(0.05, offset))
        turn = angle - 2.0 * sign * np.arctan(offset / 0.05)
        assert muscles.lengths([0.0])[0] == pytest.approx(2.0 * tangent + 0.02 * turn, abs=1e-10)


@pytest.mark.parametrize("kind", ["cylinder", "sphere"])
def test_the_side_is_the_one_on_which_the_line_passes_the_center(kind):
    """Whichever sides its ends are on; in a plane through the center, where all is circles."""
    rng = np.random.default_rng(4)
    unlike = 0
    for _ in range(40):
        foot, angle = rng.uniform(0.004, 0.016), rng.uniform(0.0, 2.0 * np.pi)
        normal = np.array([np.cos(angle), np.sin(angle), 0.0])
        along = np.array([-normal[1], normal[0], 0.0])
        P, Q = (
            foot * normal + s * along for s in (-rng.uniform(0.03, 0.1), rng.uniform(0.03, 0.1))
        )
        p, q = np.linalg.norm(P), np.linalg.norm(Q)
        between = np.arccos(P @ Q / (p * q))
        for side, sign in (("x", 1.0), ("-x", -1.0)):
            angle = between if sign * normal[0] > 0.0 else 2.0 * np.pi - between
            arc = 0.02 * (angle - np.arccos(0.02 / p) - np.arccos(0.02 / q))
            expected = np.sqrt(p**2 - 0.02**2) + arc + np.sqrt(q**2 - 0.02**2)
            found = straight_over(dataclasses.replace(SURFACES[kind], side=side), P, Q)
            assert found == pytest.approx(expected, rel=1e-12)
        unlike += P[0] * Q[0] < 0.0
    assert unlike > 10


def test_cylinder_goes_on_around_where_the_line_misses_it():
    """A line beside the cylinder on the wrong side is taken around it; a sphere lets it go."""
    ends = [0.03, -0.05, 0.0], [0.03, 0.05, 0.0]
    straight = 0.1
    assert straight_over(em.WrapCylinder(0.02, side="-x"), *ends) > straight + 0.04
    assert straight_over(em.WrapCylinder(0.02, side="x"), *ends) == straight
    assert straight_over(em.WrapSphere(0.02, side="-x"), *ends) == straight


@KINDS
def test_through_the_center(kind):
    """No side is distinguished: one is taken, the same one every time."""
    ends = [-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]
    length = straight_over(SURFACES[kind], *ends)
    assert 0.1 < length < 0.13
    assert straight_over(SURFACES[kind], *ends) == length
    for side in ("x", "-y", "y"):  # x lies along the line
        sided = dataclasses.replace(SURFACES[kind], side=side)
        muscles = Muscles(slider(), muscle([em.PathPoint(x) for x in ends], [sided]))
        assert 0.1 < muscles.lengths([0.0])[0] < 0.13
        if side != "x" and kind != "ellipsoid":
            y = muscles.points([0.0])[0][:, 1]
            assert (y.max() if side == "y" else -y.min()) == pytest.approx(0.02, rel=1e-9)


@KINDS
def test_a_point_inside_lets_go(kind):
    P, Q = [0.0, 0.01, 0.0], [0.0, -0.06, 0.001]
    assert straight_over(SURFACES[kind], P, Q) == np.linalg.norm(np.subtract(P, Q))


@KINDS
def test_points_on_the_surface(kind):
    radius = 0.02
    size = {"radii": [radius] * 3} if kind == "ellipsoid" else {"radius": radius}
    surface = type(SURFACES[kind])(**size)
    for angle in np.linspace(0.0, 1.5, 20):  # rounded in and out
        P = radius * np.array([np.cos(angle), np.sin(angle), 0.0])
        Q = radius * np.array([-np.sin(angle), np.cos(angle), 0.0])
        assert straight_over(surface, P, Q) == pytest.approx(0.5 * np.pi * radius, abs=1e-9)


def test_end_of_the_cylinder():
    ends = [-0.05, 0.001, 0.03], [0.05, 0.001, 0.03]
    wrapped = straight_over(em.WrapCylinder(0.02), *ends)
    assert straight_over(em.WrapCylinder(0.02, 0.061), *ends) == wrapped > 0.1
    assert straight_over(em.WrapCylinder(0.02, 0.059), *ends) == 0.1
    assert straight_over(em.WrapCylinder(0.02, active=False), *ends) == 0.1


def extra(points, *wraps):
    """How much longer a path gets by wraps."""
    path = [em.PathPoint(x) for x in points]
    both = Muscles(slider(), muscle(path, wraps), muscle(path, name="straight")).lengths([0.0])
    return both[0] - both[1]


def test_range_of_points():
    """Only the segments between the two points wrap."""
    points = [[-0.06, 0.001, 0.0], [0.06, 0.001, 0.0], [-0.06, 0.001, 0.01], [-0.07, 0.1, 0.0]]
    surface = SURFACES["cylinder"]

    first, second = (
        extra(points, em.PathWrap(surface, 0, 1)),
        extra(points, em.PathWrap(surface, 1, 2)),
    )
    assert 0.0 < first != second > 0.0
    assert extra(points, surface) == first  # the first one that is cut
    assert extra(points, em.PathWrap(surface, 0, 1), em.PathWrap(surface, 1, 2)) == pytest.approx(
        first + second, rel=1e-14
    )
    assert extra(points, em.PathWrap(surface, -2, -1)) == 0.0


@pytest.mark.parametrize("closer", [0, 1], ids=["first", "second"])
def test_the_first_segment_that_cuts(closer):
    """It wraps, whether it gets longer by that than a later one or not."""
    offset = [0.001, 0.015] if closer == 0 else [0.015, 0.001]  # of the lines from the axis
    points = [[-0.06, offset[0], 0.0], [0.06, offset[0], 0.0], [0.06, -offset[1], 0.0],
              [-0.06, -offset[1], 0.0]]  # fmt: skip
    surface = SURFACES["cylinder"]

    first, last = (
        extra(points, em.PathWrap(surface, 0, 1)),
        extra(points, em.PathWrap(surface, 2, 3)),
    )
    assert (first > last) == (closer == 0)
    assert min(first, last) > 1e-4
    assert extra(points, surface) == pytest.approx(first, rel=1e-12)
    assert extra(points, em.PathWrap(surface, 1, 3)) == pytest.approx(last, rel=1e-12)


def test_segments_that_do_not_cut():
    """A muscle beside a cylinder on the wrong side is taken around it where that takes the least;
    a segment that cuts comes before that."""
    surface = em.WrapCylinder(0.02, side="x")
    points = [[-0.06, -1.0, 0.0], [-0.021, 1.0, 0.0], [-0.021, -1.0, 0.0], [-0.05, 1.0, 0.0]]

    each = [extra(points, em.PathWrap(surface, k, k + 1)) for k in range(3)]
    assert 1e-3 < each[1] < min(each[0], each[2])
    assert extra(points, surface) == each[1]
    points += [[-0.01, 0.03, 0.0], [-0.01, -0.03, 0.0]]  # cuts, and close to the axis on both sides
    last = extra(points, em.PathWrap(surface, 4, 5))
    assert last > each[1]
    assert extra(points, surface) == last


def test_two_surfaces_in_one_segment():
    """Around two parallel cylinders like a crossed or an open belt: known in the plane."""
    left = em.WrapCylinder(0.02, position=[-0.05, 0.0, 0.0])
    right = em.WrapCylinder(0.02, position=[0.05, 0.0, 0.0])
    ends = [-0.15, -0.02, 0.0], [0.15, -0.02, 0.0]
    path = [em.PathPoint(x) for x in ends]
    up = [em.WrapCylinder(0.02, position=s.position, side="y") for s in (left, right)]
    length = Muscles(slider(), muscle(path, up)).lengths([0.0])[0]
    distance = np.hypot(0.1, 0.02)
    turn = np.pi / 2 - np.arccos(0.02 / distance) + np.arctan2(0.02, 0.1)
    expected = 2.0 * (np.sqrt(distance**2 - 0.02**2) + 0.02 * turn) + 0.1
    assert length == pytest.approx(expected, abs=1e-13)


def test_several_muscles_are_as_each_alone():
    """Each over surfaces and to sides of its own."""
    belt = [em.PathPoint([-0.15, -0.01, 0.0]), em.PathPoint([0.15, -0.01, 0.0], link=0)]
    wheels = [[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]]

    def over(*sides):
        return [
            em.WrapCylinder(0.02, position=x, side=side)
            for x, side in zip(wheels, sides, strict=True)
        ]

    each = [
        muscle(belt, [em.WrapSphere(0.03, side="y")]),
        muscle(belt, over("y", "-y")),
        muscle(belt, over("-y", "y")),
        muscle(belt, [em.WrapSphere(0.025, side="-y"), *over("y", "y")]),
        muscle(belt),
        muscle(belt, over("-y", "-y")),
    ]
    q = np.array([0.01])
    muscles = Muscles(slider(), *each)
    together = muscles.geometry(q, q)
    for i, one in enumerate(each):
        alone = Muscles(slider(), one)
        for several, single in zip(together[:3], alone.geometry(q, q)[:3], strict=True):
            np.testing.assert_array_equal(several[i], single[0])
        np.testing.assert_array_equal(muscles.points(q)[i], alone.points(q)[0])
    assert np.diff(np.sort(together.length)).min() > 1e-4


@KINDS
def test_the_same_number_whatever_came_before(kind):
    rng = np.random.default_rng(3)
    path = [em.PathPoint([-0.05, 0.001, 0.0]), em.PathPoint([0.05, 0.003, 0.01], link=1)]
    muscles = Muscles(chain(rng, 2), muscle(path, [SURFACES[kind]]))
    states = rng.uniform(-1.0, 1.0, (30, 2))
    forward = [muscles.geometry(q, q) for q in states]
    backward = [muscles.geometry(q, q) for q in states[::-1]][::-1]
    for one, other in zip(forward, backward, strict=True):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)


@KINDS
def test_drawn_points_lie_on_the_surface(kind):
    surface = SURFACES[kind]
    path = [em.PathPoint([-0.05, 0.001, 0.004]), em.PathPoint([0.05, 0.003, -0.001])]
    muscles = Muscles(slider(), muscle(path, [surface]))
    (points,) = muscles.points([0.0])
    assert len(points) > 6
    row = surface.row()
    radii = row[7:10].copy()
    if row[0] == CYLINDER:
        radii[2] = np.inf
    np.testing.assert_allclose(((points[1:-1] / radii) ** 2).sum(axis=1), 1.0, atol=1e-9)
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert chords == pytest.approx(muscles.lengths([0.0])[0], rel=1e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: em.WrapSphere(-1.0, name="head"),
            r"WrapSphere 'head': radius = -1.0 m is outside",
        ),
        (lambda: em.WrapSphere("big"), "WrapSphere: radius = 'big' m is outside"),
        (lambda: em.WrapCylinder(1.0, -1.0), r"length = -1.0 m is outside \[0, 1000\] m"),
        (lambda: em.WrapCylinder(1.0, side="up"), "side = 'up' is not one of x, -x, y, -y, z, -z"),
        (lambda: em.WrapSphere(1.0, side="up"), "side = 'up' is not one of x, -x, y, -y, z, -z"),
        (
            lambda: em.WrapSphere(1.0, link=-2),
            r"link is .* integer from 0 \(-1 is ground\), got -2",
        ),
        (lambda: em.WrapSphere(1.0, position=[0, 0]), r"position is three finite numbers, got \["),
        (lambda: em.WrapSphere(1.0, rotation=None), "rotation is three finite numbers, got None"),
        (lambda: em.WrapEllipsoid([1.0, 2.0]), r"radii is three finite numbers, got \[1.0, 2.0\]"),
        (lambda: em.WrapEllipsoid([1.0, 0.0, 1.0]), r"radii = 0.0 m is outside"),
        (lambda: em.WrapEllipsoid([1.0, 0.05, 1.0]), "differ by more than a factor of 10"),
        (lambda: em.PathWrap(1.0), "a PathWrap's surface is not one: 1.0"),
    ],
)
def test_bad_surface(make, message):
    with pytest.raises(em.ParameterError, match=message):
        make()


@pytest.mark.parametrize(
    ("wrap", "message"),
    [
        (
            em.PathWrap(em.WrapSphere(1.0, name="head"), 0, 3),
            "'head': last = 3 is not the index of",
        ),
        (em.PathWrap(em.WrapSphere(1.0), 1, 1), "first = 1 does not lie before last = 1"),
        (em.PathWrap(em.WrapSphere(1.0), 0.5), "first = 0.5 is not the index"),
        (em.WrapSphere(1.0, link=1), "WrapSphere is on link 1, but the tree has links 0 to 0"),
        ("head", "not a surface or PathWrap: 'head'"),
    ],
)
def test_bad_wrap_names_the_muscle(wrap, message):
    path = [em.PathPoint([0, 0, 0]), em.PathPoint([1, 0, 0])]
    with pytest.raises(em.ParameterError, match=f"muscle 'soleus': .*{message}"):
        Muscles(slider(), em.Muscle("soleus", **UNIT, path=path, wraps=[wrap]))


def test_ellipsoid_takes_the_shorter_axis():
    """Close to the center the way over the long axis is a saddle, not the shortest."""
    ellipsoid = em.WrapEllipsoid([0.03, 0.03, 0.015])
    ends = [-0.06, 0.001, 1e-5], [0.06, 0.001, 1e-5]
    over_z = straight_over(
        em.WrapEllipsoid([0.03, 0.03, 0.015]), *([x, 0.0, 1e-9] for x in (-0.06, 0.06))
    )
    over_y = straight_over(em.WrapSphere(0.03), *ends)
    assert straight_over(ellipsoid, *ends) == pytest.approx(over_z, abs=1e-4)
    assert over_z < over_y - 0.01
