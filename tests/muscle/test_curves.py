"""Characteristic curves: known values, derivatives, inverses, tangents, OpenSim's tables."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exudyn_muscles.muscle import curves

from ..differences import difference

K_T = curves.tendon_stiffness(0.049)
OPENSIM = Path(__file__).parents[2] / ".." / "shared" / "opensim" / "reference" / "curves.json"


@pytest.mark.parametrize(
    ("x", "active", "passive"),
    [
        (0.50, 0.054112, 0.000565),
        (0.75, 0.778113, 0.003371),
        (1.00, 1.000000, 0.018229),
        (1.25, 0.689553, 0.096892),
        (1.50, 0.226149, 0.513374),
    ],
)
def test_force_length_values(x, active, passive):
    assert curves.active_force_length(x)[0] == pytest.approx(active, abs=5.1e-7)
    assert curves.passive_force_length(x)[0] == pytest.approx(passive, abs=5.1e-7)


@pytest.mark.parametrize(
    ("v", "f"),
    [
        (-1.0, 0.0),
        (-0.75, 0.096484),
        (-0.5, 0.234036),
        (-0.25, 0.470826),
        (0.0, 1.0),
        (0.25, 1.400766),
        (0.5, 1.588423),
        (1.0, 1.794343),
    ],
)
def test_force_velocity_values(v, f):
    assert curves.force_velocity(v)[0] == pytest.approx(f, abs=5.1e-7)
    assert curves.inverse_force_velocity(curves.force_velocity(v)[0])[0] == pytest.approx(v)


def test_points_that_opensim_made_exact():
    assert curves.active_force_length(1.0)[0] == pytest.approx(1.0, abs=1e-15)
    assert curves.force_velocity(-1.0)[0] == pytest.approx(0.0, abs=1e-13)
    assert curves.force_velocity(0.0)[0] == pytest.approx(1.0, abs=1e-13)
    assert curves.passive_force_length(1.6)[0] == pytest.approx(1.0, abs=1e-15)
    assert curves.passive_force_length(0.2)[0] == 0.0
    assert curves.tendon_force(1.0, K_T)[0] == pytest.approx(0.0, abs=1e-16)
    assert curves.tendon_force(1.049, K_T)[0] == pytest.approx(1.0, rel=1e-14)
    assert pytest.approx(36.567, abs=5e-4) == K_T


def away_from(*kinks):
    """Values whose difference quotients do not reach over the ends of a tangent."""
    return lambda x: all(abs(x - kink) > 2.1e-3 for kink in kinks)


LOW, HIGH = (curves.force_velocity(v)[0] for v in (-curves.V_TANGENT, curves.V_TANGENT))
SLACK = curves.SLACK_TANGENT - curves.C3
SLACK_LENGTH = curves.tendon_length(SLACK, K_T)[0]
CURVES = [
    (curves.active_force_length, st.floats(0.2, 2.0)),
    (curves.passive_force_length, st.floats(0.2, 2.0)),
    (curves.force_velocity, st.floats(-5.0, 5.0).filter(away_from(-2.0, 2.0))),
    (curves.inverse_force_velocity, st.floats(-20.0, 20.0).filter(away_from(LOW, HIGH))),
    (
        lambda f: curves.tendon_length(f, K_T),
        st.floats(-1.0, 3.0).filter(away_from(SLACK)),
    ),
    (
        lambda x: curves.tendon_force(x, K_T),
        st.floats(0.8, 1.08).filter(away_from(SLACK_LENGTH)),
    ),
]


@pytest.mark.parametrize("number", range(len(CURVES)))
@given(data=st.data())
def test_derivative(number, data):
    curve, domain = CURVES[number]
    x = data.draw(domain)
    step = 2e-4
    value, slope = curve(x)
    expected = difference(lambda s: curve(s)[0], x, step)
    # Rounding of the difference, and its fourth-order error on lengths of at least 1/40.
    assert slope == pytest.approx(expected, rel=1e-7, abs=1e-14 * (1.0 + abs(value)) / step)


@given(v=st.floats(-1e4, 1e4))
def test_force_velocity_and_its_inverse(v):
    f, slope = curves.force_velocity(v)
    back, inverse_slope = curves.inverse_force_velocity(f)
    assert back == pytest.approx(v, rel=1e-11, abs=1e-13)
    assert slope * inverse_slope == pytest.approx(1.0, rel=1e-11)


@given(f=st.floats(-10.0, 10.0), strain=st.floats(0.01, 0.2))
def test_tendon_and_its_inverse(f, strain):
    k_T = curves.tendon_stiffness(strain)
    x, slope = curves.tendon_length(f, k_T)
    back, inverse_slope = curves.tendon_force(x, k_T)
    assert back == pytest.approx(f, rel=1e-11, abs=1e-13)
    assert slope * inverse_slope == pytest.approx(1.0, rel=1e-11)


@pytest.mark.parametrize(
    ("curve", "kink"),
    [
        (curves.force_velocity, -2.0),
        (curves.force_velocity, 2.0),
        (curves.inverse_force_velocity, LOW),
        (curves.inverse_force_velocity, HIGH),
        (lambda f: curves.tendon_length(f, K_T), SLACK),
        (lambda x: curves.tendon_force(x, K_T), SLACK_LENGTH),
    ],
)
def test_tangents_continue_value_and_slope(curve, kink):
    below, above = (curve(kink + side * 1e-9) for side in (-1.0, 1.0))
    assert below[0] == pytest.approx(above[0], abs=3e-9 * above[1])
    assert below[1] == pytest.approx(above[1], rel=1e-5)


@pytest.mark.parametrize(
    ("curve", "low", "high"),
    [
        (curves.force_velocity, -30.0, 30.0),
        (curves.inverse_force_velocity, -30.0, 30.0),
        (lambda f: curves.tendon_length(f, K_T), -1.0, 5.0),
        (lambda x: curves.tendon_force(x, K_T), 0.5, 1.1),
        (curves.passive_force_length, 0.0, 2.0),
    ],
)
def test_monotone(curve, low, high):
    values = np.array([curve(x) for x in np.linspace(low, high, 20001)])
    assert (np.diff(values[:, 0]) > 0.0).all()
    assert (values[:, 1] > 0.0).all()


@given(f=st.floats(-1e6, 1e6))
def test_no_overflow_beyond_the_range(f):
    v, slope = curves.inverse_force_velocity(f)
    assert math.isfinite(v)
    assert 0.0 < slope < 1e3
    x, slope = curves.tendon_length(f, K_T)
    assert math.isfinite(x)
    assert 0.0 < slope < 10.0


@pytest.fixture(scope="module")
def opensim():
    if not OPENSIM.exists():
        pytest.skip("OpenSim's reference tables are not beside this repository")
    return json.loads(OPENSIM.read_text())


@pytest.mark.parametrize(
    ("table", "curve", "lowest"),
    [
        ("dgf_fal", curves.active_force_length, -math.inf),
        ("dgf_fpe", curves.passive_force_length, -math.inf),
        ("dgf_fv", curves.force_velocity, -math.inf),
        ("dgf_fse", lambda x: curves.tendon_force(x, K_T), SLACK_LENGTH),
    ],
)
def test_opensim_tables(opensim, table, curve, lowest):
    rows = [row for row in opensim[table] if row[0] >= lowest]
    assert len(rows) > 100
    for x, value, derivative in rows:
        f, slope = curve(x)
        assert f == pytest.approx(value, abs=1e-12, rel=1e-12)
        if derivative is not None and math.isfinite(derivative):
            assert slope == pytest.approx(derivative, abs=1e-12, rel=1e-12)


def test_opensim_force_velocity_is_inverted(opensim):
    for v, f, _ in opensim["dgf_fv"]:
        assert curves.inverse_force_velocity(f)[0] == pytest.approx(v, abs=1e-12, rel=1e-12)
