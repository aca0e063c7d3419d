"""Coordinates that follow others, on their own: chains of curved functions against differences."""

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.skeleton.dependent import Dependent

from ..differences import certified, difference, gradient
from ..path.chains import Muscles, chain, muscle

NAMES = ("a", "b", "c", "d", "e", "f")
SINE = em.Curve(np.sin, [-3.0, 3.0])
SQUARE = em.Curve(np.square, [-3.0, 3.0])
SPLINE = em.simm_spline([-2.0, -0.5, 0.3, 1.0, 2.5], [0.1, 0.4, -0.3, 0.2, 0.9])


def coupled(*functions):
    """(follower, followed, function)."""
    return Dependent([em.DependentCoordinate(d, of=e, function=f) for d, e, f in functions], NAMES)


# The followed ones of dependent ones stand before and behind them; "a" and "e" are independent.
CHAINS = coupled(("c", "b", SQUARE), ("b", "a", SINE), ("d", "c", SPLINE), ("f", "e", SPLINE))


def test_one_that_depends_on_a_curved_one():
    """b = sin a, c = b^2, a = 0.3 + 0.7 t, whose derivatives are known."""
    two = Dependent(
        [
            em.DependentCoordinate("b", of="a", function=SINE),
            em.DependentCoordinate("c", of="b", function=SQUARE),
        ],
        "abc",
    )
    (q, v, a), slopes = two.follow_from(np.array([0.3]), np.array([0.7]), np.array([0.0]))
    np.testing.assert_allclose(q, [0.3, np.sin(0.3), np.sin(0.3) ** 2], rtol=1e-12)
    np.testing.assert_allclose(v, [0.7, 0.7 * np.cos(0.3), 0.7 * np.sin(0.6)], rtol=1e-12)
    expected = np.array([0.0, -np.sin(0.3), 2.0 * np.cos(0.6)])
    np.testing.assert_allclose(a, 0.49 * expected, rtol=1e-10)
    np.testing.assert_allclose(slopes.bent, 0.49 * expected, rtol=1e-10)
    np.testing.assert_allclose(slopes.R, [[1.0], [np.cos(0.3)], [np.sin(0.6)]], rtol=1e-12)


def test_rates_of_chains():
    """q' and q'' along a motion with an acceleration of its own, against differences."""
    rng = np.random.default_rng(0)
    checked = 0
    for _ in range(30):
        z, v, a = rng.uniform([[-1.0]] * 3, [[1.0]] * 3, (3, 2))

        def along(t, z=z, v=v, a=a):
            now = z + t * v + 0.5 * t * t * a, v + t * a, a
            return np.array(CHAINS.follow_from(*now)[0])

        q, q_t, q_tt = along(0.0)
        if max(certified(lambda t, j=j: along(t)[1, j], 0.0, 0.1)[1] for j in (3, 5)) > 1e-8:
            continue  # a spline's second derivative has a kink there
        rates = difference(along, 0.0, 1e-4)
        np.testing.assert_allclose(q_t, rates[0], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(q_tt, rates[1], rtol=0.0, atol=1e-7)
        assert q[0] == z[0] and q[4] == z[1]
        checked += 1
    assert checked > 20


def test_slopes_of_chains():
    rng = np.random.default_rng(1)
    for z in rng.uniform(-1.0, 1.0, (20, 2)):
        rest = np.zeros(2)
        R = CHAINS.follow_from(z, rest, rest)[1].R.copy()
        slopes = gradient(lambda z: CHAINS.follow_from(z, np.zeros(2), np.zeros(2))[0][0], z, 1e-4)
        np.testing.assert_allclose(R, slopes, rtol=0.0, atol=1e-9)


def test_numbers():
    np.testing.assert_array_equal(CHAINS.free, [0, 4])
    np.testing.assert_array_equal(CHAINS.roots_of(np.array([2, 3])), [0])
    np.testing.assert_array_equal(CHAINS.roots_of(np.array([3, 5])), [0, 4])
    assert sorted(CHAINS.tied) == [1, 2, 3, 5]
    order = list(CHAINS.tied)
    assert order.index(1) < order.index(2) < order.index(3)


def test_paths_over_dependent_coordinates():
    """r_z = r R and l' of muscles, by differences in the independent coordinates."""
    rng = np.random.default_rng(2)
    path = [em.PathPoint(rng.uniform(-0.3, 0.3, 3), link) for link in (-1, 1, 3, 5)]
    muscles = Muscles(chain(rng, 6), muscle(path), names=NAMES)
    geometry = CHAINS.geometry(muscles.geometry)
    for z in rng.uniform(-1.0, 1.0, (10, 2)):
        l, l_t, r, _ = geometry(z, np.array([0.3, -0.8]))
        slopes = gradient(lambda z: geometry(z, np.zeros(2)).length, z, 1e-5)
        np.testing.assert_allclose(r, -slopes, rtol=0.0, atol=1e-7)
        assert l_t[0] == pytest.approx(slopes[0] @ [0.3, -0.8], abs=1e-7)
        assert l[0] > 0.0


def test_a_locked_coordinate():
    locked = coupled(("b", "a", em.linear_function(0.0, 0.4)))
    z = np.full(5, 0.3)
    (q, v, a), _ = locked.follow_from(z, z, z)
    assert (q[1], v[1], a[1]) == (0.4, 0.0, 0.0)


# "b" of "a" and "e" by products, "c" of "b" by a curve, "d" of "c" and "f", which is independent.
PRODUCT = em.SumOfProducts(
    [(0.2, {}), (0.7, {0: SINE, 1: 2}), (-0.4, {1: 1}), (0.3, {0: 3, 1: SPLINE})]
)
SEVERAL = Dependent(
    [
        em.DependentCoordinate(
            "d", of=["c", "f"], function=em.SumOfProducts([(1.0, {0: 1, 1: SINE})])
        ),
        em.DependentCoordinate("c", of="b", function=SQUARE),
        em.DependentCoordinate("b", of=["a", "e"], function=PRODUCT),
    ],
    NAMES,
)


def test_rates_of_functions_of_several():
    """As `test_rates_of_chains`, with products of curves, powers and one another."""
    rng, checked = np.random.default_rng(3), 0
    for _ in range(30):
        z, v, a = rng.uniform([[-0.9]] * 3, [[0.9]] * 3, (3, 3))

        def along(t, z=z, v=v, a=a):
            now = z + t * v + 0.5 * t * t * a, v + t * a, a
            return np.array(SEVERAL.follow_from(*now)[0])

        q, q_t, q_tt = along(0.0)
        if certified(lambda t: along(t)[1, 1], 0.0, 0.1)[1] > 1e-8:
            continue  # the spline's second derivative has a kink there
        rates = difference(along, 0.0, 1e-4)
        np.testing.assert_allclose(q_t, rates[0], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(q_tt, rates[1], rtol=0.0, atol=1e-7)
        assert q[1] == pytest.approx(PRODUCT([z[0], z[1]]), abs=1e-14)
        slopes = SEVERAL.follow_from(z, v, np.zeros(3))[1]
        np.testing.assert_allclose(slopes.R @ v, q_t, rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(slopes.R @ a + slopes.bent, q_tt, rtol=0.0, atol=1e-12)
        checked += 1
    assert checked > 15
    np.testing.assert_array_equal(SEVERAL.roots_of(np.array([2])), [0, 4])


def test_functions_of_several_with_some_of_them_fixed():
    fixed = PRODUCT.fixed({0: 0.4}, 2)
    assert fixed.count == 1
    assert fixed([0.3]) == pytest.approx(PRODUCT([0.4, 0.3]), abs=1e-15)
    assert fixed.fixed({0: 0.3}, 1)([]) == pytest.approx(PRODUCT([0.4, 0.3]), abs=1e-15)
    assert fixed.times(-2.0)([0.3]) == pytest.approx(-2.0 * PRODUCT([0.4, 0.3]), abs=1e-15)


@pytest.mark.parametrize(
    ("of", "function", "message"),
    [
        (["a", "e"], SINE, r"or of several coordinates a SumOfProducts, got .* of \('a', 'e'\)"),
        ("a", PRODUCT, r"its function has 2 variables, more than \('a',\)"),
        ("a", 3.0, "its function is a Curve"),
    ],
)
def test_functions_that_do_not_fit(of, function, message):
    with pytest.raises(em.ParameterError, match=message):
        em.DependentCoordinate("b", of=of, function=function)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ([], "a function needs at least one term"),
        ([(1.0, {"a": 1})], "a function's variables are numbers from 0, got 'a'"),
        ([(1.0, {0: -1})], "a function's factor is an exponent from 0 or a Curve, got -1"),
        ([(np.nan, {})], "a function's term is a finite number"),
    ],
)
def test_sums_of_products_that_are_none(terms, message):
    with pytest.raises(em.ParameterError, match=message):
        em.SumOfProducts(terms)


def test_several_in_a_circle():
    functions = [
        em.DependentCoordinate("b", of=["a", "c"], function=PRODUCT),
        em.DependentCoordinate("c", of=["a", "b"], function=PRODUCT),
    ]
    with pytest.raises(em.ParameterError, match="in a circle: b, c, b"):
        Dependent(functions, NAMES)
