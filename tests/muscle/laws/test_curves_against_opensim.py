"""The curves of the built-in laws against tables of OpenSim 4.6."""

import numpy as np
import pytest

from exudyn_muscles.muscle.laws.de_groote_fregly_2016 import DeGrooteFregly2016
from exudyn_muscles.muscle.laws.millard_2012 import Millard2012
from exudyn_muscles.muscle.laws.thelen_2003 import Thelen2003

from ...own_models import FOLDER

# The strain at one F0 is the muscle's; that of the other unit is 0.033.
LAWS = {
    "dgf": (DeGrooteFregly2016(), 0.049, 1e-12),
    "thelen": (Thelen2003(), 0.04, 1e-12),
    "thelen_other": (
        Thelen2003(kshape_active=0.5, kshape_passive=4.0, af=0.3, flen=1.8), 0.033, 1e-12,
    ),
    "millard": (Millard2012(), 0.049, 1e-9),
}  # fmt: skip


@pytest.fixture(scope="module")
def tables():
    with np.load(FOLDER / "curves.npz") as stored:
        return dict(stored)


def rows(tables, name):
    """Columns of a table."""
    return tables[name].T


def check(curve, table, tolerance, origin=0.0, scale=1.0):
    """Values and, where OpenSim gives them, derivatives of a curve over (x - origin) / scale."""
    x, value, derivative = table
    assert len(x) > 90
    s = (x - origin) / scale
    np.testing.assert_array_less(np.abs(curve(s) - value), tolerance * np.maximum(1.0, abs(value)))
    given = np.isfinite(derivative)
    slopes = curve.derivative(s[given]) / scale
    largest = np.abs(derivative[given]).max(initial=0.0)
    np.testing.assert_allclose(slopes, derivative[given], rtol=0.0, atol=tolerance * largest)


@pytest.mark.parametrize("name", LAWS)
def test_force_length(name, tables):
    law, strain, tolerance = LAWS[name]
    curves = law.curves()
    check(curves.active_force_length, rows(tables, f"{name}_fal"), tolerance)
    check(curves.passive_force_length, rows(tables, f"{name}_fpe"), tolerance)
    check(curves.tendon_force_length, rows(tables, f"{name}_fse"), tolerance, 1.0, strain)


@pytest.mark.parametrize("name", ["dgf", "millard"])
def test_force_velocity(name, tables):
    law, _, tolerance = LAWS[name]
    check(law.curves().force_velocity, rows(tables, f"{name}_fv"), tolerance)


def test_inverse_force_velocity(tables):
    v, f, _ = rows(tables, "dgf_fv")
    inverse = LAWS["dgf"][0].curves().inverse_force_velocity
    np.testing.assert_allclose(inverse(f), v, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["thelen", "thelen_other"])
def test_force_velocity_with_activation(name, tables):
    law, _, tolerance = LAWS[name]
    a, force, v, f_v = rows(tables, f"{name}_fv_a_F_vN_fv")
    fastest = law.speed_without_activation + (1.0 - law.speed_without_activation) * a
    found = law.curves()
    velocity = fastest * found.inverse_force_velocity(force / a)
    np.testing.assert_array_less(np.abs(velocity - v), tolerance * np.maximum(1.0, np.abs(v)))
    factor = found.force_velocity(v / fastest)
    np.testing.assert_array_less(np.abs(factor - f_v), tolerance * np.maximum(1.0, np.abs(f_v)))
