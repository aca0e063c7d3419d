"""A law of the user's own: functions, measured points, and what it refuses."""

import math
import pickle

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.errors import ParameterError

LENGTHS = [0.4, 0.6, 0.8, 1.0, 1.2, 1.5, 1.8]
TENSIONS = [0.02, 0.35, 0.9, 1.0, 0.8, 0.4, 0.05]
SIZE = {"max_isometric_force": 1000, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.2}


def force_velocity(v):
    return (1 + v) / (1 - 4 * v) if v < 0 else 1.4 - 0.4 / (1 + 12.5 * v)


def passive(x):
    return 4 * max(x - 1, 0) ** 2


def tendon(x):
    return (25 * max(x - 1, 0)) ** 2


def parabola(x):
    return np.maximum(1 - 4 * (x - 1) ** 2, 0)


def custom(**changed):
    given = {
        "active_force_length": (LENGTHS, TENSIONS),
        "force_velocity": force_velocity,
        "passive_force_length": passive,
        "tendon_force_length": tendon,
        **changed,
    }
    return em.CustomLaw("mine", **given)


def de_groote():
    """OpenSim's formulas, written as a user would."""
    b = [
        (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
        (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
        (0.1, 1.0, 0.353553390593274, 0.0),
    ]
    offset, k_T = math.exp(-3.2 / 0.6), math.log(6.0) / 0.049
    return em.CustomLaw(
        "De Groote",
        active_force_length=lambda x: sum(
            b_1 * np.exp(-0.5 * ((x - b_2) / (b_3 + b_4 * x)) ** 2) for b_1, b_2, b_3, b_4 in b
        ),
        force_velocity=lambda v: (
            -0.3211346127989808 * np.arcsinh(-8.149 * v - 0.374) + 0.8825327733249912
        ),
        passive_force_length=lambda x: (
            (np.exp(4 * (x - 1) / 0.6) - offset) / (math.exp(4) - offset)
        ),
        tendon_force_length=lambda x: 0.2 * np.exp(k_T * (x - 1)) - 0.2,
    )


@pytest.mark.parametrize(
    ("curve", "low", "high", "scale"),
    [
        ("active_force_length", 0.2, 2.0, 1.0),
        ("force_velocity", -1.0, 1.0, 1.0),
        ("inverse_force_velocity", 0.0, 1.794, 1.0),
        ("passive_force_length", 0.2, 2.0, 1.0),
        ("tendon_force_length", 0.0, 0.08, 0.049),
    ],
)
def test_de_groote_from_its_formulas(curve, low, high, scale):
    mine, built_in = (
        getattr(law.curves(), curve) for law in (de_groote(), em.DeGrooteFregly2016())
    )
    x = np.linspace(low, high, 2001)[:-1]
    np.testing.assert_allclose(mine(x), built_in(x / scale), rtol=1e-12, atol=1e-12)
    slopes = built_in.derivative(x / scale) / scale
    np.testing.assert_allclose(mine.derivative(x), slopes, atol=1e-11 * np.abs(slopes).max())


def test_de_groote_from_its_formulas_in_a_muscle():
    mine = em.MuscleSet([em.Muscle("unit", **SIZE, law=de_groote())])
    built_in = em.MuscleSet([em.Muscle("unit", **SIZE)])
    for length in (0.25, 0.3, 0.33):
        found, expected = (em.equilibrium(one, [0.7], [length]) for one in (mine, built_in))
        np.testing.assert_allclose(found, expected, rtol=1e-10)


# Measured points.


def test_measured_points_are_met():
    curve = custom().curves().active_force_length
    np.testing.assert_allclose(curve(LENGTHS), TENSIONS, atol=1e-14)
    assert curve.range == (0.4, 1.8)
    np.testing.assert_allclose(curve([0.1, 2.5]), TENSIONS[::6], atol=1e-14)  # constant beyond


def test_measured_points_are_joined_without_overshoot():
    curve = custom().curves().active_force_length
    for k in range(len(LENGTHS) - 1):
        y = curve(np.linspace(LENGTHS[k], LENGTHS[k + 1], 101)[:-1])
        rise = math.copysign(1.0, TENSIONS[k + 1] - TENSIONS[k])
        assert (rise * np.diff(y) > 0.0).all()


def test_measured_points_for_every_curve():
    v = np.linspace(-1.2, 0.8, 21)
    f = [force_velocity(one) for one in v]
    l_t = [0.99, 1.0, 1.01, 1.02, 1.03, 1.04, 1.05]
    law = custom(
        force_velocity=(v, f),
        passive_force_length=(LENGTHS, [passive(x) for x in LENGTHS]),
        tendon_force_length=(l_t, [tendon(x) for x in l_t]),
    )
    found = law.curves()
    np.testing.assert_allclose(found.force_velocity(v), f, atol=1e-14)
    np.testing.assert_allclose(found.inverse_force_velocity(f), v, atol=1e-13)
    strain = np.array(l_t) - 1.0
    np.testing.assert_allclose(
        found.tendon_force_length(strain), [tendon(x) for x in l_t], atol=1e-13
    )
    slope = found.passive_force_length.derivative(1.8)
    assert slope > 0.0
    np.testing.assert_allclose(
        found.passive_force_length([0.1, 2.8]), [0.0, passive(1.8) + slope], atol=1e-14
    )


# Functions.


def test_functions_of_arrays_and_of_numbers_are_the_same():
    vectors = custom(
        force_velocity=lambda v: np.where(
            v < 0, (1 + v) / (1 - 4 * np.minimum(v, 0)), 1.4 - 0.4 / (1 + 12.5 * np.maximum(v, 0))
        ),
        passive_force_length=lambda x: 4 * np.maximum(x - 1, 0) ** 2,
    ).curves()
    numbers = custom().curves()
    for one, other in zip(vectors, numbers, strict=True):
        assert one.range == other.range
        x = np.linspace(*one.range, 501)
        np.testing.assert_allclose(one(x), other(x), rtol=1e-14, atol=1e-14)


def test_constants_and_polynomials_are_functions():
    law = custom(
        passive_force_length=lambda x: 0.0, active_force_length=np.poly1d([-0.3, 0.6, 0.7])
    )
    found = law.curves()
    assert found.passive_force_length(1.3) == 0.0
    assert found.active_force_length(1.5) == pytest.approx(-0.3 * 2.25 + 0.6 * 1.5 + 0.7, abs=1e-14)
    assert hash(law) == hash(law)


def test_ranges_of_functions():
    f_l, f_v, inverse, f_PE, f_SE = custom(active_force_length=lambda x: np.exp(-2 * (x - 1) ** 2),
                                           shortest_fiber=0.4).curves()  # fmt: skip
    assert f_l.range == f_PE.range == (0.4, 2.0)
    assert f_v.range == (-1.0, 1.0)
    np.testing.assert_allclose(inverse.range, f_v([-1.0, 1.0]))
    assert f_SE.range[0] == 0.0
    assert 5.0 < f_SE(f_SE.range[1]) < 10.0
    # Beyond: f_l constant, f_v and its inverse along tangents, passive curves from zero.
    np.testing.assert_array_equal(f_l.derivative([0.3, 2.1]), 0.0)
    np.testing.assert_allclose(f_v.derivative([-1.5, 1.5]), f_v.derivative([-1.0, 1.0 - 1e-9]))
    np.testing.assert_array_equal([f_PE(0.3), f_SE(-0.1), f_SE.derivative(-0.1)], 0.0)
    assert f_SE.derivative(2.0) == pytest.approx(f_SE.derivative(f_SE.range[1] - 1e-9))


def test_inverse():
    _, f_v, inverse, _, _ = custom().curves()
    v = np.linspace(-2.0, 2.0, 1001)
    np.testing.assert_allclose(inverse(f_v(v)), v, atol=1e-12)
    smooth = np.abs(v) > 1e-3
    product = inverse.derivative(f_v(v)) * f_v.derivative(v)
    np.testing.assert_allclose(product[smooth], 1.0, rtol=1e-9)


def test_a_damped_law_may_have_flat_and_empty_places():
    flat = custom(
        active_force_length=parabola,
        force_velocity=lambda v: np.where(v < 0, (1 + v) ** 2, 1.0),
        fiber_damping=0.05,
    )
    assert flat.curves().active_force_length(1.6) == 0.0
    inverse = flat.curves().inverse_force_velocity
    assert np.isfinite(inverse(np.linspace(-3.0, 3.0, 101))).all()
    assert (np.diff(inverse(np.linspace(-3.0, 3.0, 101))) > 0.0).all()


def test_a_law_for_rigid_tendons():
    law = custom(tendon_force_length=None, active_force_length=parabola)
    assert law.curves(False).tendon_force_length is None
    em.MuscleSet([em.Muscle("stiff", **SIZE, law=law, ignore_tendon_compliance=True)])
    with pytest.raises(ParameterError, match=r"'soft': CustomLaw\(name='mine'.* no tendon curve"):
        em.MuscleSet([em.Muscle("soft", **SIZE, law=law)])


def test_its_tendon_has_no_scale():
    with pytest.raises(ParameterError, match=r"the tendon of CustomLaw\(name='mine'.* no scale"):
        em.Muscle("unit", **SIZE, law=custom(), tendon_strain_at_one_norm_force=0.04)


def test_laws_are_values():
    law = custom(fiber_damping=0.1)
    again = pickle.loads(pickle.dumps(law))
    assert again == law and hash(again) == hash(law)
    assert again.curves() is law.curves()
    assert custom() != law
    assert repr(law) == "CustomLaw(name='mine', fiber_damping=0.1, shortest_fiber=0.2)"
    with pytest.raises(AttributeError):
        law.name = "yours"


# What is refused.


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"active_force_length": lambda x: np.log(x - 0.5)}, "is not finite at x = 0.2: nan"),
        ({"active_force_length": lambda x: 1.0 / (x - math.pi / 3)},
         "at x = 1.04.; it jumps to this value"),
        ({"active_force_length": lambda x: math.sqrt(x - 0.5)},
         "fails at x = 0.2: ValueError: "),
        ({"active_force_length": lambda x: x[1]}, "fails at x = 0.2: TypeError: "),
        ({"active_force_length": lambda x: np.where(x < 0.9, 0.5, 1.0)},
         "is 1 at x = 0.9; it jumps to this value"),
        ({"active_force_length": lambda x: np.sin(1e6 * x)}, "is too rough for a smooth curve"),
        ({"active_force_length": lambda x: 1 - 4 * (x - 1) ** 2, "fiber_damping": 0.1},
         "is -1.56 at x = 0.2; it must not be negative"),
        ({"active_force_length": parabola},
         "is 0 at x = 0.2; an elastic tendon without fiber_damping needs 0.0001 at least"),
        ({"active_force_length": lambda x: np.exp(-5 * (x - 1.3) ** 2)},
         "is 1 at x = 1.3; this is its maximum, which has to be 1 at x = 1, both within 0.2"),
        ({"active_force_length": lambda x: 900 * np.exp(-5 * (x - 1) ** 2)},
         "is 900 at x = 1; this is its maximum"),
        ({"force_velocity": lambda v: 1 - v}, "is 1.999 at x = -0.999; it must not decrease"),
        ({"force_velocity": lambda v: 1.1 + v}, "is 1.1 at x = 0; it has to be 1 within 0.001"),
        ({"force_velocity": lambda v: 1 + 0.5 * v}, "is 0.5 at x = -1; it has to be 0 within 0.1"),
        ({"force_velocity": lambda v: (1 + v) ** 2},
         "is 0 at x = -1; an elastic tendon without fiber_damping needs a slope of 0.001"),
        ({"force_velocity": lambda v: min(1 + v, 1)},
         "is 1 at x = 0.001; an elastic tendon without fiber_damping needs a slope of 0.001"),
        ({"passive_force_length": lambda x: x - 1}, "is -0.8 at x = 0.2; it must not be negative"),
        ({"passive_force_length": lambda x: 2 - x}, "it must not decrease"),
        ({"tendon_force_length": lambda x: x}, "is 1 at x = 1; it has to be 0 within 0.001"),
        ({"tendon_force_length": lambda x: np.log(x)},
         "is 0.6931 at x = 2; it has to reach 1 within its range"),
        ({"tendon_force_length": lambda x: 2 * np.sin(20 * (x - 1))}, "it must not decrease"),
        ({"tendon_force_length": ([1.0, 1.01, 1.02, 1.03], [0.0, 0.1, 0.3, 0.6])},
         "is 0.6 at x = 1.03; it has to reach 1 within its range"),
    ],
)  # fmt: skip
def test_shapes(changed, message):
    curve = next(iter(changed))
    with pytest.raises(ParameterError, match=rf"^law 'mine': {curve} .*{message}"):
        custom(**changed)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (3.0, "is a function or a pair .x, y. of measured points, got float"),
        (None, "is a function or a pair .x, y. of measured points, got NoneType"),
        (("a", "b"), "is a function or a pair .x, y. of measured points, got tuple"),
        (([1, 2, 3], [1, 2, 3]), r"x \(3,\) and y \(3,\) .* do not fit: .* at least 4"),
        (([1, 2, 3, 4], [1, 2, 3]), r"x \(4,\) and y \(3,\) .* do not fit"),
        ((np.ones((2, 4)), np.ones((2, 4))), r"x \(2, 4\) and y \(2, 4\) .* do not fit"),
        (([1, 2, 3, math.nan], [1, 2, 3, 4]), r"point 3 is not finite: \(nan, 4\)"),
        (([1, 2, 3, 4], [1, math.inf, 3, 4]), r"point 1 is not finite: \(2, inf\)"),
        (([1, 2, 2, 4], [1, 2, 3, 4]), "has to increase, but 2 follows 2"),
        (([1, 4, 3, 2], [1, 2, 3, 4]), "has to increase, but 3 follows 4"),
    ],
)
def test_bad_points(points, message):
    with pytest.raises(ParameterError, match=rf"^law 'mine': force_velocity.*{message}"):
        custom(force_velocity=points)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"fiber_damping": -0.1}, r"^law 'mine': fiber_damping = -0.1 is outside \[0, 10\]$"),
        ({"shortest_fiber": 0.9}, r"^law 'mine': shortest_fiber = 0.9 .* outside \[0, 0.8\]"),
        ({"shortest_fiber": math.nan}, "^law 'mine': shortest_fiber = nan"),
    ],
)
def test_bad_numbers(numbers, message):
    with pytest.raises(ParameterError, match=message):
        custom(**numbers)


@pytest.mark.parametrize("name", ["", 3, None])
def test_bad_names(name):
    with pytest.raises(ParameterError, match="a law's name is a non-empty string"):
        em.CustomLaw(name, active_force_length=parabola, force_velocity=force_velocity,
                     passive_force_length=passive)  # fmt: skip


@pytest.mark.parametrize("end", [1.03, 1.033, 1.04, 1.049, 1.05])
def test_a_measured_tendon_may_end_at_one(end):
    tendon = ([1.0, 0.75 + 0.25 * end, 0.5 + 0.5 * end, end], [0.0, 0.1, 0.4, 1.0])
    law = em.CustomLaw(
        "ends at one",
        active_force_length=lambda x: np.exp(-((x - 1.0) ** 2) / 0.45),
        force_velocity=lambda v: 1.0 + np.tanh(3.0 * v),
        passive_force_length=lambda x: 0.0 * x,
        tendon_force_length=tendon,
        fiber_damping=0.1,
    )
    assert law.curves().tendon_force_length(end - 1.0) == pytest.approx(1.0, abs=1e-12)
