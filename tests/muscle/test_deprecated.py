"""OpenSim's deprecated classes: numbers of OpenSim 4.6 (`make_deprecated.py`), and the points that
Schutte's law takes."""

import pickle

import numpy as np
import pytest

import exudyn_muscles as em

from .make_deprecated import COLUMNS, FILE, MUSCLES, STATES, model


@pytest.mark.parametrize("name", MUSCLES)
def test_right_hand_sides_are_opensims(name, tmp_path):
    file = tmp_path / "model.osim"
    file.write_text(model(name))
    (unit,) = em.opensim.load_model(file).muscles
    with np.load(FILE) as tables:
        table = dict(zip(COLUMNS, tables[name].T, strict=True))
    F0, optimal = unit.max_isometric_force, unit.optimal_fiber_length
    V = unit.max_contraction_velocity * optimal
    units, limits = em.MuscleSet([unit]), []
    for k in range(STATES):
        row = {column: values[k] for column, values in table.items()}
        l = [row["length"]]
        l_t = em.tendon_length(units, [row["fiber_length"]], l)
        found = em.muscle_dynamics(
            units, [row["activation"]], l_t, l, [row["speed"]], [row["excitation"]]
        )
        assert found.tendon_force[0] == pytest.approx(row["force"], abs=2e-13 * F0)
        # OpenSim's own rounding in its straight lines is 3e-11.
        velocity = pytest.approx(row["fiber_velocity"], rel=1e-10, abs=1e-11 * V)
        assert found.fiber_velocity[0] == velocity
        rate = pytest.approx(row["activation_rate"], rel=1e-14)
        assert found.activation_rate[0] == rate
        load = row["force"] / F0 / np.cos(found.pennation_angle[0]) - found.passive_force_length[0]
        capacity = row["activation"] * found.active_force_length[0]
        limits.append(np.searchsorted([0.0, capacity, 0.95 * 1.4 * capacity], load))
    # The table has pushed fibres, shortening and lengthening ones, and such beyond all curves.
    assert np.bincount(limits, minlength=4).min() >= 3
    rises = table["excitation"] > table["activation"]
    assert 50 < rises.sum() < STATES - 50


def test_active_force_length_is_zero_where_the_spline_is_below():
    x, y = [0.3, 0.5, 0.7, 1.0, 1.3, 1.6, 1.9], [0.0, 0.0, 0.8, 1.0, 0.8, 0.0, 0.0]
    spline = em.simm_spline(x, y)
    found = em.Schutte1993(active_force_length=(x, y)).curves().active_force_length
    places = np.linspace(0.0, 3.0, 1001)
    values = spline(places)
    assert values.min() < -0.01
    np.testing.assert_allclose(found(places), np.maximum(values, 0.0), rtol=0, atol=6e-14)


def test_passive_points_and_their_default():
    x = np.linspace(0.0, 3.0, 31)
    found = em.Schutte1993().curves().passive_force_length(x)
    np.testing.assert_allclose(found, np.exp(8.0 * (x - 1.5)), rtol=1e-12)
    points = [0.0, 1.0, 1.4, 1.7], [0.0, 0.0, 0.3, 1.5]
    found = em.Schutte1993(passive_force_length=points).curves().passive_force_length(x)
    np.testing.assert_allclose(found, em.simm_spline(*points)(x), rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    "law", [em.Thelen2003Deprecated(af=0.25), em.Schutte1993(active_force_length=([0, 1], [1, 2]))]
)
def test_laws_are_values(law):
    again = pickle.loads(pickle.dumps(law))
    assert again == law and hash(again) == hash(law)
    assert again.curves() is law.curves()
    assert law != type(law)(fiber_damping=0.3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: em.Schutte1993(fiber_damping=0.0), "Schutte1993: fiber_damping = 0.0 is outside"),
        (lambda: em.Schutte1993(active_force_length=1.0), "active_force_length is a pair"),
        (lambda: em.Schutte1993(passive_force_length=([0, 0], [0, 1])),
         "Schutte1993: passive_force_length: a spline needs"),
        (lambda: em.Schutte1993(tendon_force_length=([0, 1], [0.1, 9])),
         "tendon_force_length is 0.1 at no strain and 9 at 1; expected 0 and 1 at least"),
        (lambda: em.Schutte1993(tendon_force_length=([0, 9], [0, 1])), "0 at no strain and 0.111"),
        (lambda: em.Thelen2003Deprecated(flen=1.05), r"flen = 1.05 is outside \[1.06, 10\]"),
        (lambda: em.Thelen2003Deprecated(speed_without_activation=0.0), "speed_without_activation"),
    ],
)  # fmt: skip
def test_what_makes_no_law(make, message):
    with pytest.raises(em.ParameterError, match=message):
        make()
