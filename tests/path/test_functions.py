"""Points and lengths that are functions of coordinates."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import exudyn_muscles as em

from ..differences import gradient
from .chains import UNIT, Muscles, chain, muscle, slider

NAMES = ("hip", "knee", "ankle")


def test_conditional_point():
    via = em.ConditionalPathPoint([0.0, 0.1, 0.0], coordinate="knee", range=(-0.2, 0.3))
    path = [em.PathPoint([-1.0, 0.0, 0.0]), via, em.PathPoint([1.0, 0.0, 0.0])]
    muscles = Muscles(chain(np.random.default_rng(0), 3), muscle(path), names=NAMES)
    with_point = 2.0 * np.hypot(1.0, 0.1)
    for knee, length in ((-0.21, 2.0), (-0.2, with_point), (0.3, with_point), (0.31, 2.0)):
        assert muscles.lengths([9.0, knee, 9.0])[0] == pytest.approx(length, rel=1e-15)
        assert len(muscles.points([9.0, knee, 9.0])[0]) == (2 if length == 2.0 else 3)


@pytest.mark.parametrize("link", [-1, 0, 2])
def test_moving_point(link):
    """On ground, before and behind the coordinate that it follows."""
    rng = np.random.default_rng(1)
    knots = np.linspace(-1.0, 1.0, 6)
    x = em.simm_spline(knots, rng.uniform(-0.1, 0.1, 6))
    y = em.Curve(lambda q: 0.02 + 0.01 * q - 0.03 * q**2, [-2.0, 2.0])
    moving = em.MovingPathPoint(x, y, 0.05, link, coordinate=1)
    ends = [em.PathPoint(rng.uniform(-0.3, 0.3, 3)), em.PathPoint([0.2, 0.0, 0.1], link=1)]
    muscles = Muscles(chain(rng, 3), muscle([ends[0], moving, ends[1]]), names=NAMES)
    for _ in range(20):
        q = rng.uniform(-1.2, 1.2, 3)
        fixed = em.PathPoint([float(x(q[1])), float(y(q[1])), 0.05], link)
        same = Muscles(muscles.tree, muscle([ends[0], fixed, ends[1]]))
        assert muscles.lengths(q)[0] == pytest.approx(same.lengths(q)[0], rel=1e-14)
        np.testing.assert_allclose(muscles.points(q)[0], same.points(q)[0], rtol=0, atol=1e-15)
        if np.abs(q[1] - knots).min() > 3e-4:
            slopes = gradient(muscles.lengths, q, 1e-4)
            np.testing.assert_allclose(muscles.arms(q), -slopes, rtol=0.0, atol=1e-9)


def test_simm_spline():
    x = np.array([0.0, 0.3, 1.0, 1.5, 2.2])
    values = np.random.default_rng(0).uniform(-1.0, 1.0, 5)
    spline = em.simm_spline(x, values)
    np.testing.assert_allclose(spline(x), values, rtol=0, atol=6e-14)
    cubic = CubicSpline(x[:4], values[:4], bc_type="not-a-knot")  # the cubic through four points
    inside = np.linspace(0.0, 0.3, 5)
    third = [np.polyfit(inside - 0.1, f(inside), 3)[0] for f in (spline, cubic)]
    assert third[0] == pytest.approx(third[1], rel=1e-9)
    beyond = spline(3.0) - spline(2.2)
    assert beyond == pytest.approx(0.8 * spline.derivative(2.2), rel=1e-13)
    assert em.simm_spline([0.0, 2.0], [1.0, 2.0])(3.0) == pytest.approx(2.5, rel=1e-15)


@pytest.mark.parametrize(
    ("x", "y"),
    [
        ([0, 1, 2, 3], [0, 1e308, -1e308, 1]),
        ([0, 5e-324, 1, 2], [0, 1, 2, 3]),
        ([0, 1e-160, 2e-160], [0, 1, 5]),
        ([-1e308, 0, 1e308], [0, 1, 0]),
        ([0, 1e-100], [0, 1e-100]),
        ([0, 1e-3, 2e-3, 3e-3, 4e-3], [0, 1e300, 0, 0, 0]),
    ],
)
@pytest.mark.filterwarnings("error")
def test_points_whose_polynomials_are_not_finite(x, y):
    with pytest.raises(em.ParameterError, match="spline"):
        em.simm_spline(x, y)


@pytest.mark.parametrize(
    ("x", "y"), [([0], [1]), ([0, 0], [1, 2]), ([0, 1], [1]), ([1, 0], [0, 1])]
)
def test_bad_spline(x, y):
    with pytest.raises(em.ParameterError, match="a spline needs two points or more"):
        em.simm_spline(x, y)


def test_function_path():
    curve = em.simm_spline([-1.0, -0.2, 0.5, 1.0], [0.1, 0.12, 0.09, 0.11])
    path = em.FunctionPath(
        [
            (0.3, {}),
            (0.05, {"ankle": 0}),
            (-0.02, {"hip": 1}),
            (0.01, {"hip": 1, "knee": 2}),
            (2.0, {2: curve, "hip": 3}),
        ]
    )
    line = muscle([em.PathPoint([0, 0, 0]), em.PathPoint([1, 0, 0])], name="line")
    muscles = Muscles(chain(np.random.default_rng(0), 3), muscle(path), line, names=NAMES)
    rng = np.random.default_rng(0)
    for q in [*rng.uniform(-1.0, 1.0, (20, 3)), np.zeros(3)]:
        hip, knee, ankle = q
        expected = 0.35 - 0.02 * hip + 0.01 * hip * knee**2 + 2.0 * float(curve(ankle)) * hip**3
        l, l_t, r, _ = muscles.geometry(q, np.array([1.0, 2.0, 3.0]))
        assert l[0] == pytest.approx(expected, rel=1e-14)
        slopes = gradient(muscles.lengths, q, 1e-4)
        np.testing.assert_allclose(r, -slopes, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(l_t, slopes @ [1.0, 2.0, 3.0], rtol=0.0, atol=1e-8)
        assert [len(points) for points in muscles.points(q)] == [0, 2]


POINT = em.PathPoint([0, 0, 0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: em.ConditionalPathPoint([0, 0, 0], coordinate=0, range=(1, 0)),
            r"range is a lowest and a highest value, got \(1, 0\)",
        ),
        (lambda: em.ConditionalPathPoint([0, 0], coordinate=0, range=(0, 1)), "three finite"),
        (
            lambda: em.MovingPathPoint(0.0, "a", 0.0, coordinate=0),
            "y is a Curve or a finite number in m, got 'a'",
        ),
        (
            lambda: em.MovingPathPoint(0.0, 0.0, 0.0, -3, coordinate=0),
            "link is the number of a link",
        ),
        (lambda: em.FunctionPath([]), "at least one term"),
        (lambda: em.FunctionPath([0.3]), "a finite number and a mapping of coordinates, got 0.3"),
        (lambda: em.FunctionPath([(1.0, {0: -1})]), "an exponent from 0 or a Curve, got -1"),
    ],
)
def test_bad_values(make, message):
    with pytest.raises(em.ParameterError, match=message):
        make()


@pytest.mark.parametrize(
    ("path", "wraps", "message"),
    [
        (
            [POINT, em.ConditionalPathPoint([0, 0, 0], coordinate="elbow", range=(0, 1)), POINT],
            [],
            "muscle 'soleus': path point 1 follows the coordinate 'elbow', but the model has q0",
        ),
        (
            [POINT, em.MovingPathPoint(0, 0, 0, coordinate=1)],
            [],
            "muscle 'soleus': path point 1 follows the coordinate 1",
        ),
        (
            [POINT, em.ConditionalPathPoint([0, 0, 0], coordinate=0, range=(0, 1))],
            [],
            "muscle 'soleus': the path's first and last point cannot be conditional",
        ),
        (
            em.FunctionPath([(1.0, {3: 1})]),
            [],
            "the path of muscle 'soleus' follows the coordinate 3",
        ),
        (
            em.FunctionPath([(1.0, {0: 1})]),
            [em.WrapSphere(1.0)],
            "muscle 'soleus': a FunctionPath cannot wrap",
        ),
    ],
)
def test_bad_paths_name_the_muscle(path, wraps, message):
    with pytest.raises(em.ParameterError, match=message):
        Muscles(slider(), em.Muscle("soleus", **UNIT, path=path, wraps=wraps))
