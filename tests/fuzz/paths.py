"""Random paths on random chains: r = -dl/dq by differences, l' = -r q', l continuous and no shorter
than the polygon, straight ones against another way to compute them, pictures of the same length.

Points lie anywhere: also on surfaces, inside, on axes and at centers, on joints, and on each other.
"""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

import exudyn_muscles as em
from exudyn_muscles.skeleton.tree import PRISMATIC

from ..differences import certified
from ..path.chains import Muscles, chain, muscle

NAMES = ("a", "b", "c", "d", "e")
FASTEST = 10.0  # dl/dq of paths as short as these [m]


def number(rng, size):
    return rng.choice([0.0, rng.normal(0.0, size)])


def surface(rng, n):
    radii = rng.uniform(0.015, 0.03, 3)
    place = {
        "position": rng.choice([0.0, 1.0]) * rng.normal(0.0, 0.02, 3),
        "rotation": rng.choice([0.0, 1.0]) * rng.uniform(-3.0, 3.0, 3),
        "link": int(rng.integers(-1, n)),
        "side": rng.choice([None, "x", "-x", "y", "-y"]),
    }
    match rng.integers(3):
        case 0:
            return em.WrapCylinder(radii[0], rng.choice([np.inf, 0.03]), **place)
        case 1:
            return em.WrapSphere(radii[0], **place)
    return em.WrapEllipsoid(rng.choice([radii, np.full(3, radii[0])]), **place)


def on_surface(rng, given):
    """A place on a surface or at a distinguished one of it, in its link's frame."""
    x = rng.normal(0.0, 1.0, 3) * rng.choice([0.0, 1.0, 1.0], 3)
    scaled = x / given.radii if isinstance(given, em.WrapEllipsoid) else x / given.radius
    if isinstance(given, em.WrapCylinder):
        scaled[2] = 0.0
        x[2] *= 0.02
    size = np.linalg.norm(scaled)
    if size > 0.0:
        height = rng.choice([1.0, 1.0 + 1e-15, 1.0 - 1e-15, 1.0 + 1e-6, 1.0 - 1e-6, 0.0, 1.3])
        round_part = np.array([1.0, 1.0, 1.0 - isinstance(given, em.WrapCylinder)])
        x = np.where(round_part == 1.0, x * height / size, x)
    return Rotation.from_euler("XYZ", given.rotation).apply(x) + given.position


def points(rng, n, surfaces):
    """Two to five points; the first and the last are always there."""
    found = []
    for k in range(int(rng.integers(2, 6))):
        link = int(rng.integers(-1, n))
        position = rng.choice([0.0, 1.0, 1.0], 3) * rng.normal(0.0, 0.05, 3)
        if surfaces and rng.random() < 0.4:
            given = surfaces[rng.integers(len(surfaces))]
            link, position = given.link, on_surface(rng, given)
        if found and rng.random() < 0.05:
            link, position = found[-1].link, getattr(found[-1], "position", position)
        kind = rng.random()
        if kind < 0.15:
            knots = rng.uniform(-0.05, 0.05, 5)
            curve = em.simm_spline(np.linspace(-2.0, 2.0, 5), knots)
            point = em.MovingPathPoint(
                curve, *position[1:], link, coordinate=int(rng.integers(0, n))
            )
        elif kind < 0.25 and k > 0:
            low, high = sorted(rng.uniform(-1.0, 1.0, 2))
            point = em.ConditionalPathPoint(
                position, link, coordinate=NAMES[rng.integers(0, n)], range=(low, high)
            )
        else:
            point = em.PathPoint(position, link)
        found.append(point)
    if isinstance(found[-1], em.ConditionalPathPoint):
        found[-1] = em.PathPoint(found[-1].position, found[-1].link)
    return found


def function(rng, n):
    def factors():
        return {
            int(j): int(rng.integers(0, 4))
            if rng.random() < 0.7
            else em.simm_spline(np.linspace(-2.0, 2.0, 4), rng.uniform(-1.0, 1.0, 4))
            for j in range(n)
            if rng.random() < 0.5
        }

    return em.FunctionPath([(rng.normal(0.0, 0.1), factors()) for _ in range(rng.integers(1, 4))])


def links_at(tree, q):
    """Orientations and positions of the links, by rotation vectors and in plain Python."""
    frames = {-1: (Rotation.identity(), np.zeros(3))}
    for i in range(len(tree)):
        R, p = frames[tree.parents[i]]
        offset = tree.offsets[i] + (tree.base if tree.parents[i] < 0 else 0.0)
        p, R = p + R.apply(offset), R * Rotation.from_matrix(tree.rotations[i])
        along = np.eye(3)[tree.joints[i] % PRISMATIC] * (q[i] + tree.reference[i])
        if tree.joints[i] < PRISMATIC:
            R = R * Rotation.from_rotvec(along)
        else:
            p = p + R.apply(along)
        frames[i] = R, p
    return frames


def polygon(tree, path, q):
    """Length of the straight lines through the points of a path without surfaces."""
    frames, places = links_at(tree, q), []
    for point in path:
        j = None
        if isinstance(point, (em.ConditionalPathPoint, em.MovingPathPoint)):
            j = point.coordinate if isinstance(point.coordinate, int) else NAMES.index(
                point.coordinate
            )  # fmt: skip
        if isinstance(point, em.ConditionalPathPoint):
            low, high = point.range
            if not low - 1e-5 <= q[j] <= high + 1e-5:
                continue
        if isinstance(point, em.MovingPathPoint):
            values = (point.x, point.y, point.z)
            position = [float(x(q[j])) if isinstance(x, em.Curve) else x for x in values]
        else:
            position = point.position
        R, p = frames[point.link]
        places.append(R.apply(position) + p)
    return np.linalg.norm(np.diff(places, axis=0), axis=1).sum()


def check(rng):
    n = int(rng.integers(1, len(NAMES) + 1))
    tree = chain(rng, n)
    if rng.random() < 0.3:  # joints on each other, points at rest
        tree = dataclasses.replace(tree, offsets=np.zeros((n, 3)), reference=np.zeros(n))
    surfaces = [surface(rng, n) for _ in range(rng.integers(0, 4))]
    path = function(rng, n) if rng.random() < 0.1 else points(rng, n, surfaces)
    if isinstance(path, em.FunctionPath):
        surfaces = []
    muscles = Muscles(tree, muscle(path, surfaces), names=NAMES[:n])
    q, v = rng.choice([0.0, 1.0], n) * rng.uniform(-1.0, 1.0, n), rng.normal(0.0, 1.0, n)
    v /= np.linalg.norm(v)
    try:
        one, two = muscles.geometry(q, v), muscles.geometry(q, v)
        beside = [muscles.geometry(q + s * v, v) for s in (-1e-7, 1e-7)]
        slope, apart = certified(lambda s: muscles.lengths(q + s * v)[0], 0.0, 0.1)
    except em.WrappingError:
        return "without a way over an ellipsoid"
    assert all(a.tobytes() == b.tobytes() for a, b in zip(one, two, strict=True)), "other bits"
    l, speed, r = one.length[0], one.lengthening_speed[0], one.moment_arms[0]
    assert np.isfinite([l, speed, *r]).all(), f"not finite: {one}"
    assert abs(speed + r @ v) < 1e-14 * (1.0 + np.abs(r).sum()), "l' is not -r q'"
    if not isinstance(path, em.FunctionPath):
        straight = polygon(tree, path, q)
        assert l > straight - 1e-12, f"{straight - l} m shorter than the straight lines"
        if not surfaces:
            assert abs(l - straight) < 1e-12, f"{l - straight} m longer than the straight lines"
        (drawn,) = muscles.points(q)
        chords = np.linalg.norm(np.diff(drawn, axis=0), axis=1).sum()
        assert 0.97 * l - 1e-12 < chords < l + 1e-9, f"drawn with {chords} m instead of {l}"
    bend = beside[0].length[0] + beside[1].length[0] - 2.0 * l
    # Surfaces within each other may not come to rest; then l jumps, perhaps to both sides.
    leaps = [abs(muscles.lengths(q + s * v)[0] - l) > FASTEST * s for s in (1e-4, 1e-5, 1e-6, 1e-7)]
    if apart > 1e-9 or abs(bend) > 1e-9 or any(leaps):
        return "at a kink or a jump"
    if abs(speed - slope) > 1e-7:
        off = max(abs(each.lengthening_speed[0] - slope) for each in beside)
        assert off < 1e-4, f"l' is {speed}, by differences {slope}"
        return "at a singular place, such as a line through a center"
    return "fine"
