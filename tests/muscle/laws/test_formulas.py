"""The built-in laws against their printed formulas and values, and what every law has to be."""

import math
import pickle
from fractions import Fraction

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.errors import ParameterError
from exudyn_muscles.muscle.laws.de_groote_fregly_2016 import (
    DeGrooteFregly2016,
    DeGrooteFregly2016Published,
)
from exudyn_muscles.muscle.laws.millard_2012 import Millard2012, bernstein
from exudyn_muscles.muscle.laws.thelen_2003 import Thelen2003
from exudyn_muscles.numerics.curves import COEFFICIENTS, END, ORIGIN

from ...differences import difference

LAWS = {
    "De Groote": DeGrooteFregly2016(),
    "De Groote, wide": DeGrooteFregly2016(
        active_force_width_scale=1.5, passive_fiber_strain_at_one_norm_force=0.5
    ),
    "De Groote, published": DeGrooteFregly2016Published(),
    "Thelen": Thelen2003(),
    "Thelen, arm26": Thelen2003(kshape_active=0.5, kshape_passive=4.0, af=0.3, flen=1.8),
    "Millard": Millard2012(),
    "Millard, undamped": Millard2012(fiber_damping=0.0),
}
CURVES = (
    "active_force_length", "force_velocity", "inverse_force_velocity", "passive_force_length",
    "tendon_force_length",
)  # fmt: skip
ALL = [(law, curve) for law in LAWS for curve in CURVES]


# Known values.


@pytest.mark.parametrize(
    ("x", "thelen_active", "thelen_passive", "active", "passive"),
    [
        (0.50, 0.573753, 0.0, 0.054112, 0.000565),
        (0.75, 0.870325, 0.0, 0.778113, 0.003371),
        (1.00, 1.0, 0.0, 1.000000, 0.018229),
        (1.25, 0.870325, 0.047697, 0.689553, 0.096892),
        (1.50, 0.573753, 0.430763, 0.226149, 0.513374),
    ],
)
def test_force_length_values(x, thelen_active, thelen_passive, active, passive):
    thelen, de_groote = LAWS["Thelen"].curves(), LAWS["De Groote"].curves()
    assert thelen.active_force_length(x) == pytest.approx(thelen_active, abs=5.1e-7)
    assert thelen.passive_force_length(x) == pytest.approx(thelen_passive, abs=5.1e-7)
    assert de_groote.active_force_length(x) == pytest.approx(active, abs=5.1e-7)
    assert de_groote.passive_force_length(x) == pytest.approx(passive, abs=5.1e-7)


@pytest.mark.parametrize(
    ("v", "f"),
    [
        (-1.0, 0.0), (-0.75, 0.096484), (-0.5, 0.234036), (-0.25, 0.470826), (0.0, 1.0),
        (0.25, 1.400766), (0.5, 1.588423), (1.0, 1.794343),
    ],
)  # fmt: skip
def test_force_velocity_values_of_de_groote(v, f):
    assert LAWS["De Groote"].curves().force_velocity(v) == pytest.approx(f, abs=5.1e-7)


@pytest.mark.parametrize(
    ("f", "v"),
    [
        (0.0, -1.0), (0.25, -0.375), (0.5, -0.166667), (0.75, -0.0625), (1.1, 0.013333),
        (1.2, 0.04), (1.3, 0.12), (1.35, 0.253878),
    ],
)  # fmt: skip
def test_velocity_values_of_thelen(f, v):
    assert LAWS["Thelen"].curves().inverse_force_velocity(f) == pytest.approx(v, abs=5.1e-7)


@pytest.mark.parametrize(
    ("strain", "f"), [(-0.01, 0.0), (0.005, 0.014728), (0.01, 0.042001), (0.02, 0.186028),
                      (0.03, 0.572032), (0.04, 1.0)],
)  # fmt: skip
def test_tendon_values_of_thelen(strain, f):
    assert LAWS["Thelen"].curves().tendon_force_length(strain / 0.04) == pytest.approx(
        f, abs=5.1e-7
    )


def test_points_that_opensim_made_exact():
    f_l, f_v, _, f_PE, f_SE = DeGrooteFregly2016().curves()
    assert f_l(1.0) == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(f_v([-1.0, 0.0]), [0.0, 1.0], atol=1e-13)
    np.testing.assert_allclose(f_PE([0.2, 1.6]), [0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(f_SE([0.0, 1.0]), [0.0, 1.0], atol=1e-15)


@pytest.mark.parametrize("name", LAWS)
def test_normalised(name):
    """To one percent: the published tendon of De Groote is under tension only from 0.1 % on."""
    law = LAWS[name]
    f_l, f_v, _, _, f_SE = law.curves()
    assert f_l(1.0) == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose(f_v([-1.0, 0.0]), [0.0, 1.0], atol=0.02)
    strain = 1.0 if law.tendon_strain_at_one_norm_force else 0.04736
    np.testing.assert_allclose(f_SE([0.0, strain]), [0.0, 1.0], atol=0.012)


# Formulas.


@pytest.mark.parametrize("scale", [1.0, 1.4])
def test_active_force_length_of_de_groote(scale):
    curve = DeGrooteFregly2016(active_force_width_scale=scale).curves().active_force_length
    for x in np.linspace(0.0, 3.0, 61)[:-1]:
        s = (x - 1.0) / scale + 1.0
        first = (s - 1.055033428970575) / (0.162384573599574 + 0.063303448465465 * s)
        second = (s - 0.716775413397760) / (-0.029947116970696 + 0.200356847296188 * s)
        third = (s - 1.0) / 0.353553390593274
        expected = (
            0.8150671134243542 * math.exp(-0.5 * first**2)
            + 0.433004984392647 * math.exp(-0.5 * second**2)
            + 0.1 * math.exp(-0.5 * third**2)
        )
        assert curve(x) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize(
    ("name", "d"),
    [
        ("De Groote", (-0.3211346127989808, -8.149, -0.374, 0.8825327733249912)),
        ("De Groote, published",
         (-0.318323436899127, -8.14915604347525, -0.374121508647863, 0.885644059915004)),
    ],
)  # fmt: skip
def test_force_velocity_of_de_groote(name, d):
    """And its inverse, a hyperbolic sine, from one end to the other; tangents beyond."""
    _, f_v, inverse, _, _ = LAWS[name].curves()
    v = 10.0 * np.linspace(-1.0, 1.0, 2001) ** 5
    t = d[1] * v + d[2]
    # The source's logarithm of t + sqrt(t^2 + 1), which is odd, without its loss of digits.
    f = d[0] * np.sign(t) * np.log(abs(t) + np.sqrt(t * t + 1.0)) + d[3]
    slope = d[0] * d[1] / np.sqrt(t * t + 1.0)
    np.testing.assert_allclose(f_v(v), f, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(f_v.derivative(v), slope, rtol=1e-10)
    f = np.linspace(f[0], f[-1], 2001)
    w = (f - d[3]) / d[0]
    np.testing.assert_allclose(inverse(f), (np.sinh(w) - d[2]) / d[1], rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(inverse.derivative(f), np.cosh(w) / d[0] / d[1], rtol=1e-10)
    for side, end in ((-1.0, f[0]), (1.0, f[-1])):
        expected = side * 10.0 + side * 3.0 * inverse.derivative(end)
        assert inverse(end + side * 3.0) == pytest.approx(float(expected), rel=1e-9)


def test_passive_curves_of_the_published_de_groote():
    _, _, _, f_PE, f_SE = LAWS["De Groote, published"].curves()
    x = np.linspace(0.2, 1.8, 51)
    expected = (np.exp(4.0 * (x - 1.0) / 0.6) - math.exp(-3.2 / 0.6)) / (math.exp(4.0) - 1.0)
    np.testing.assert_allclose(f_PE(x), expected, atol=1e-14)
    strain = np.linspace(-0.02, 0.08, 51)
    expected = 0.2 * np.exp(35.0 * (1.0 + strain - 0.995)) - 0.25
    np.testing.assert_allclose(f_SE(strain), expected, atol=1e-13)


def test_stiffer_tendon_of_the_published_de_groote():
    strain = np.linspace(-0.02, 0.05, 51)
    found = DeGrooteFregly2016Published(tendon_stiffness=60.0).curves().tendon_force_length(strain)
    np.testing.assert_allclose(found, 0.2 * np.exp(60.0 * (strain + 0.005)) - 0.25, atol=1e-13)


@pytest.mark.parametrize(("name", "low"), [("Millard", 0.0), ("Millard, undamped", 0.1)])
def test_floors_of_millard(name, low):
    """The undamped fibre with elastic tendon has an f_l that never vanishes, and only that one."""
    law = LAWS[name]
    np.testing.assert_allclose(law.curves(True).active_force_length([0.3, 2.0]), low, atol=1e-15)
    np.testing.assert_allclose(law.curves(False).active_force_length([0.3, 2.0]), 0.0, atol=1e-15)
    np.testing.assert_array_equal(law.curves(False).force_velocity.derivative([-1.5, 1.5]), 0.0)


def test_ends_of_millard():
    f_l, f_v, _, f_PE, f_SE = Millard2012().curves()
    np.testing.assert_allclose(f_l([0.4441, 1.0, 1.8123]), [0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(f_v([-2.0, -0.9, 0.0, 0.9, 2.0]), [0, 0.0125, 1, 1.3925, 1.4])
    np.testing.assert_allclose(f_PE([0.9, 1.0, 1.7]), [0.0, 0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(f_SE([-1.0, 0.0, 1.0]), [0.0, 0.0, 1.0], atol=1e-14)


# What every law has to be.


@pytest.mark.parametrize(("law", "curve"), ALL)
@pytest.mark.parametrize("elastic", [True, False])
def test_continuous(law, curve, elastic):
    """Values everywhere; slopes but for the few kinks of Thelen's curves."""
    found = getattr(LAWS[law].curves(elastic), curve)
    pieces = found.pieces[:-1]
    width = np.nan_to_num(pieces[:, END] - pieces[:, ORIGIN], posinf=0.0)
    c = pieces[:, COEFFICIENTS]
    value = (c * width[:, None] ** np.arange(6)).sum(axis=1)
    slope = (c[:, 1:] * np.arange(1, 6) * width[:, None] ** np.arange(5)).sum(axis=1)
    size = 1.0 + np.abs(value)
    assert (np.abs(value - found.pieces[1:, 1]) / size).max() < 1e-13
    steep = np.abs(found.derivative(np.linspace(*found.range, 1001))).max()
    kinks = np.count_nonzero(np.abs(slope - found.pieces[1:, 2]) > 1e-9 * steep)
    allowed = {"De Groote": 2 * (curve == "active_force_length"), "Thelen": 2, "Millard": 0}
    assert kinks <= allowed[law.split(",")[0]]


@pytest.mark.parametrize(("law", "curve"), ALL)
def test_derivative(law, curve):
    found = getattr(LAWS[law].curves(), curve)
    low, high = found.range
    step = 1e-5 * (high - low)
    for x in np.linspace(low, high, 200)[1:-1]:
        if np.abs(found.pieces[[0, -1], END] - x).min() > 3.0 * step:
            expected = difference(found, x, step)
            slope = found.derivative(x)
            assert slope == pytest.approx(expected, rel=1e-5, abs=1e-6 * (1.0 + abs(slope)))


@pytest.mark.parametrize("name", [name for name in LAWS if name != "Millard"])
def test_force_velocity_and_its_inverse(name):
    """Undamped laws: over the whole of the lines beyond the range as well."""
    _, f_v, inverse, _, _ = LAWS[name].curves()
    v = np.linspace(-5.0, 5.0, 2001)
    f = f_v(v)
    np.testing.assert_allclose(inverse(f), v, rtol=1e-11, atol=1e-13)
    product = f_v.derivative(v) * inverse.derivative(f)
    kinks = np.isin(v, [-1.0, 0.0, *f_v.range])
    np.testing.assert_allclose(product[~kinks], 1.0, rtol=1e-9)


@pytest.mark.parametrize(
    ("curve", "low", "high", "least"),
    [
        ("force_velocity", -3.0, 3.0, 0.0),
        ("inverse_force_velocity", -10.0, 10.0, 1e-4),
        ("passive_force_length", 0.0, 2.5, 0.0),
        ("tendon_force_length", -10.0, 5.0, 0.0),
    ],
)
@pytest.mark.parametrize("name", LAWS)
def test_monotone(name, curve, low, high, least):
    x = np.linspace(low, high, 5001)
    rise = np.diff(getattr(LAWS[name].curves(), curve)(x))
    assert (rise >= least * (x[1] - x[0]) - 1e-13).all()


@pytest.mark.parametrize("name", LAWS)
def test_laws_are_values(name):
    law = LAWS[name]
    again = pickle.loads(pickle.dumps(law))
    assert again == law and hash(again) == hash(law)
    assert again.curves() is law.curves()
    assert law != DeGrooteFregly2016(fiber_damping=0.02)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: DeGrooteFregly2016(active_force_width_scale=0.9),
         r"DeGrooteFregly2016: active_force_width_scale = 0.9 is outside \[1, 10\]"),
        (lambda: DeGrooteFregly2016(fiber_damping=-1.0), "fiber_damping = -1.0 is outside"),
        (lambda: DeGrooteFregly2016Published(tendon_stiffness=0.0), "tendon_stiffness = 0.0"),
        (lambda: Thelen2003(af=0.0), r"Thelen2003: af = 0.0 is outside \[0.01, 10\]"),
        (lambda: Thelen2003(flen=1.0), "flen = 1.0 is outside"),
        (lambda: Thelen2003(fv_linear_extrap_threshold=0.5), "fv_linear_extrap_threshold = 0.5"),
        (lambda: Millard2012(fiber_damping=math.nan), "Millard2012: fiber_damping = nan"),
        (lambda: Millard2012(transition_norm_fiber_length=0.3), "transition_norm_fiber_length"),
    ],
)  # fmt: skip
def test_numbers_outside_their_ranges(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (
            lambda: Millard2012(max_eccentric_velocity_force_multiplier=1.05),
            r"Millard2012: force-velocity curve: no smooth corner from x = 0 to 0\.9",
        ),
        (
            lambda: Millard2012(eccentric_slope_near_vmax=1.0),
            "Millard2012: force-velocity curve: no smooth corner",
        ),
        (
            lambda: Millard2012(fiber_strain_at_one_norm_force=10.0),
            "Millard2012: passive force-length curve: no smooth corner",
        ),
        (
            lambda: Thelen2003(fv_linear_extrap_threshold=1.0 / 1.4),
            "Thelen2003: fv_linear_extrap_threshold = 0.714",
        ),
        (lambda: Thelen2003(flen=0), "Thelen2003: flen = 0 is outside"),
        (lambda: Thelen2003(flen="x"), "Thelen2003: flen = 'x' is outside"),
        (lambda: Millard2012(min_norm_active_fiber_length="a"), "min_norm_active_fiber_length"),
    ],
)
def test_numbers_that_make_no_curve(law, message):
    with pytest.raises(em.ParameterError, match=message):
        law()


@pytest.mark.parametrize(
    "law",
    [
        DeGrooteFregly2016(passive_fiber_strain_at_one_norm_force=0.01),
        Thelen2003(fmax_muscle_strain=0.013),
        Thelen2003(fmax_muscle_strain=0.05, kshape_passive=20.0),
    ],
)
def test_steep_passive_curves_go_on_along_their_tangents(law):
    curve = law.curves().passive_force_length
    assert 0.99e6 < curve(curve.range[1]) < 1.01e6
    assert np.isfinite(curve(3.0))


def test_numbers_are_kept_as_floats():
    law = DeGrooteFregly2016(passive_fiber_strain_at_one_norm_force=Fraction(3, 5))
    assert law == DeGrooteFregly2016()
    hash(law)


def test_force_velocity_and_its_inverse_of_schutte():
    curves = em.Schutte1993().make_curves(elastic=True)
    v = np.linspace(-1.0, 1.0, 401)
    np.testing.assert_allclose(
        curves.inverse_force_velocity(curves.force_velocity(v)), v, rtol=0, atol=1e-12
    )


def test_the_slope_of_a_bezier_segment():
    points, u = np.array([0.3, -1.0, 2.0, 0.5, 0.1, 4.0]), np.linspace(0.0, 1.0, 11)
    value, slope = bernstein(points, u + 1e-30j)
    np.testing.assert_allclose(slope.real, value.imag / 1e-30, rtol=1e-14)
