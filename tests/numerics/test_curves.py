"""Curves: how well they follow a function, kinks, ends, and what they refuse."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from exudyn_muscles.errors import ParameterError
from exudyn_muscles.numerics import curves
from exudyn_muscles.numerics.curves import (
    COEFFICIENTS,
    END,
    ORIGIN,
    Curve,
    evaluate,
    is_in,
    pack,
    piece_at,
)

# Function, derivative, range.
SMOOTH = {
    "exp": (np.exp, np.exp, (-1.0, 2.0)),
    "sin": (np.sin, np.cos, (-4.0, 4.0)),
    "tanh": (
        lambda x: np.tanh(20.0 * x),
        lambda x: 20.0 / np.cosh(20.0 * x) ** 2,
        (-1.0, 1.0),
    ),
    "quintic": (lambda x: x**5 - x, lambda x: 5.0 * x**4 - 1.0, (-1.0, 1.0)),
    "constant": (np.ones_like, np.zeros_like, (0.0, 1.0)),
}


@pytest.fixture(params=SMOOTH)
def smooth(request):
    function, derivative, ends = SMOOTH[request.param]
    return function, derivative, Curve(function, ends)


def test_follows_its_function(smooth):
    function, derivative, curve = smooth
    x = np.linspace(*curve.range, 10_001)[:-1]
    np.testing.assert_allclose(curve(x), function(x), rtol=1e-14, atol=1e-14)
    scale = np.abs(derivative(x)).max() + 1.0
    np.testing.assert_allclose(curve.derivative(x), derivative(x), rtol=0, atol=3e-12 * scale)


def test_pieces_meet(smooth):
    _, _, curve = smooth
    pieces = curve.pieces
    np.testing.assert_array_equal(pieces[:-1, END], pieces[1:, ORIGIN])
    width = pieces[1:-1, END] - pieces[1:-1, ORIGIN]
    ends = (pieces[1:-1, COEFFICIENTS] * width[:, None] ** np.arange(6)).sum(axis=1)
    np.testing.assert_allclose(ends, pieces[2:, 1], rtol=1e-14, atol=1e-14)


def test_a_quintic_needs_hardly_more_than_one_piece():
    assert len(Curve(SMOOTH["quintic"][0], (-1.0, 1.0)).pieces) <= 5


@pytest.mark.parametrize("slopes", [(None, None), (0.0, -2.0), (None, 0.0)])
def test_straight_lines_beyond_the_range(slopes):
    curve = Curve(np.exp, (0.0, 1.0), slopes)
    before, behind = (
        tangent if slope is None else slope
        for slope, tangent in zip(slopes, (1.0, np.e), strict=True)
    )
    for distance in (1e-9, 0.3, 1e6):
        expected = [1.0 - before * distance, np.e + behind * distance]
        np.testing.assert_allclose(curve([-distance, 1.0 + distance]), expected, rtol=1e-12)
        np.testing.assert_allclose(
            curve.derivative([-distance, 1.0 + distance]), [before, behind], rtol=1e-12
        )


def test_kinks_between_breaks_are_exact():
    curve = Curve(np.abs, (-1.0, 0.0, 2.0))
    assert len(curve.pieces) <= 8
    x = np.array([-1.5, -1.0, -0.3, 0.0, 1e-15, 1.9, 2.5])
    np.testing.assert_allclose(curve(x), np.abs(x), rtol=1e-13)
    np.testing.assert_allclose(curve.derivative(x), np.where(x < 0.0, -1.0, 1.0), rtol=1e-13)


def test_kinks_elsewhere_are_cut_down():
    kink = np.pi / 10.0
    curve = Curve(lambda x: np.abs(x - kink), (-1.0, 2.0))
    assert len(curve.pieces) < 100
    x = np.linspace(-1.0, 2.0, 10_001)
    np.testing.assert_allclose(curve(x), np.abs(x - kink), rtol=0, atol=1e-6)
    away = np.abs(x - kink) > 1e-6
    np.testing.assert_allclose(curve(x)[away], np.abs(x - kink)[away], rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda x: np.sin(1e6 * x), r"^mine is too rough for a smooth curve, .* near x = "),
        (lambda x: np.sqrt(x - 0.25), r"^mine is not finite at x = 0: nan"),
        (lambda x: np.where(x > 0.9, np.inf, x), r"^mine is not finite at x = [01]\.?\d*: inf"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_bad_functions(function, message):
    with pytest.raises(ParameterError, match=message):
        Curve(function, (0.0, 1.0), name="mine")


def test_shapes_and_pieces():
    curve = Curve(np.exp, (0.0, 1.0))
    assert curve(0.5).shape == ()
    assert curve(np.zeros((2, 3))).shape == curve.derivative(np.zeros((2, 3))).shape == (2, 3)
    assert curve([]).shape == (0,)
    assert curve.range == (0.0, 1.0)
    with pytest.raises(ValueError, match="read-only"):
        curve.pieces[0, 0] = 1.0


def test_many_values_take_no_call_each(monkeypatch):
    """Some 3 us each: curves made of others take hundreds of thousands."""
    curve = Curve(np.exp, (0.0, 1.0))
    monkeypatch.setattr(curves, "evaluate", None)
    x = np.linspace(-0.5, 1.5, 1001)
    inside = (x >= 0.0) & (x <= 1.0)
    np.testing.assert_allclose(curve(x)[inside], np.exp(x[inside]), rtol=1e-14)
    np.testing.assert_allclose(curve.derivative(x)[inside], np.exp(x[inside]), rtol=1e-11)


@pytest.mark.parametrize(
    ("function", "ends"), [(np.sin, (0.0, 1e-80)), (lambda x: 1e200 * x, (0.0, 1e-200))]
)
@pytest.mark.filterwarnings("error")
def test_curves_whose_polynomials_are_not_finite(function, ends):
    with pytest.raises(ParameterError, match=r"^mine is too steep or too large between 0 and 1e-"):
        Curve(function, ends, name="mine")


CURVES = [Curve(function, ends) for function, _, ends in SMOOTH.values()]
CURVES.append(Curve(np.abs, (-1.0, 0.0, 2.0), (0.0, 0.0)))
PACKED = pack(CURVES)


@given(number=st.integers(0, len(CURVES) - 1), x=st.floats(-1e6, 1e6) | st.floats(-5.0, 5.0))
def test_compiled_evaluation_is_the_piece_of_x(number, x):
    curve = CURVES[number]
    value, slope, curvature = evaluate(PACKED, number, x)
    assert (value, slope) == (curve(x), curve.derivative(x))
    assume(np.abs(x - curve.pieces[1:, ORIGIN]).min() > 1e-14)  # either piece, after rounding
    piece = next(piece for piece in curve.pieces if not x >= piece[END])
    polynomial = np.polynomial.Polynomial(piece[COEFFICIENTS])
    t = x - piece[ORIGIN]
    size = 1.0 + abs(piece[1]) + abs(t * piece[2])
    assert value == pytest.approx(polynomial(t), abs=1e-14 * size)
    assert slope == pytest.approx(polynomial.deriv()(t), abs=1e-12 * (1.0 + abs(piece[2])))
    bend = polynomial.deriv(2)(t)
    assert curvature == pytest.approx(bend, abs=1e-11 * (1.0 + abs(2.0 * piece[3])))


@given(
    number=st.integers(0, len(CURVES) - 1),
    x=st.floats(-1e6, 1e6) | st.floats(-5.0, 5.0),
    aside=st.integers(-2, 2),
)
def test_a_piece_is_found_or_known_at_once(number, x, aside):
    """Also within rounding of where one begins, which bins may tell apart otherwise."""
    first = np.flatnonzero(np.isnan(PACKED.pieces[:, END]))
    rows = range(first[number - 1] + 1 if number else 0, first[number] + 1)
    origin = PACKED.pieces[rows[abs(int(x)) % len(rows)], ORIGIN]
    for place in (x, np.nextafter(origin, origin + aside), np.inf * np.sign(x or 1.0)):
        found = piece_at(PACKED, number, place)
        assert [k for k in rows if is_in(PACKED.pieces, k, place)] == [found]


@pytest.mark.parametrize("x", [-np.inf, np.inf])
def test_infinity_lies_on_the_straight_lines(x):
    for number, curve in enumerate(CURVES):
        piece = curve.pieces[0 if x < 0.0 else -1]
        assert evaluate(PACKED, number, x)[1] in (piece[2], pytest.approx(np.nan, nan_ok=True))


@given(number=st.integers(0, len(CURVES) - 1))
def test_ends_and_breaks_belong_to_the_piece_behind_them(number):
    curve = CURVES[number]
    for piece in curve.pieces[1:]:
        assert evaluate(PACKED, number, piece[ORIGIN]) == (piece[1], piece[2], 2.0 * piece[3])


def test_nan_in_gives_nan_out():
    for curve in CURVES:
        assert np.isnan(curve(np.nan)) and np.isnan(curve.derivative(np.nan))
