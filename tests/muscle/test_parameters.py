"""Muscle and MuscleSet: bad input is named with muscle, parameter, value and range."""

import dataclasses
import math

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.muscle.parameters import F_L, F_PE, F_SE, F_V, INVERSE_F_V, RANGES

from ..zoo import LAWS

GOOD = {
    "max_isometric_force": 1000.0,
    "optimal_fiber_length": 0.1,
    "tendon_slack_length": 0.2,
    "pennation_angle_at_optimal": 0.1,
}


@pytest.mark.parametrize("parameter", RANGES)
@pytest.mark.parametrize("value", [math.nan, -1.0, math.inf, -math.inf, None, "much", [1.0, 2.0]])
def test_bad_value_is_named(parameter, value):
    with pytest.raises(em.ParameterError) as error:
        em.Muscle("flexor", **{**GOOD, parameter: value})
    low, high, unit = RANGES[parameter]
    for part in ("'flexor'", parameter, repr(value), f"[{low:g}, {high:g}] {unit}".strip()):
        assert part in str(error.value)


POSITIVE = [name for name in RANGES if "pennation" not in name and "control" not in name]


@pytest.mark.parametrize("parameter", POSITIVE)
def test_zero_is_not_allowed(parameter):
    with pytest.raises(em.ParameterError, match=parameter):
        em.Muscle("flexor", **{**GOOD, parameter: 0.0})


def test_rigid_tendons_may_have_no_length():
    """The muscle is its fibre: as with a tendon, and a path that is longer by it."""
    path = np.linspace(0.07, 0.12, 6)
    forces = []
    for slack in (0.0, 0.2):
        muscles = em.MuscleSet(
            em.Muscle(
                f"unit{k}",
                **GOOD | {"tendon_slack_length": slack},
                ignore_tendon_compliance=True,
            )
            for k in range(path.size)
        )
        a, l_t, rest = np.full(6, 0.5), np.full(6, slack), np.zeros(6)
        now = em.muscle_dynamics(muscles, a, l_t, slack + path, rest)
        lengths, speeds = (slack + path, slack + path + 0.001), (rest, rest + 0.2)
        end = em.integrate_window(muscles, a, l_t, np.ones(6), lengths, speeds, 0.01)
        forces.append([now.tendon_force, end.force, end.activation])
        np.testing.assert_array_equal(end.tendon_length, slack)
    assert np.min(forces[0][0]) > 10.0
    np.testing.assert_allclose(*forces, rtol=1e-12)


@pytest.mark.parametrize("parameter", RANGES)
def test_ends_of_the_range_are_allowed(parameter):
    for value in RANGES[parameter][:2]:
        if (parameter, value) in (("maximum_pennation_angle", 0.0), ("max_control", 0.0)):
            continue  # below the pennation at the optimal length, or the minimum activation
        if (parameter, value) == ("minimum_activation", 0.0):
            continue  # of damped fibres only
        assert getattr(em.Muscle("flexor", **{**GOOD, parameter: value}), parameter) == value


def test_limits_of_excitations_that_leave_none():
    for limits in ({"max_control": 0.005}, {"min_control": 0.6, "max_control": 0.5}):
        with pytest.raises(em.ParameterError, match=r"'flexor': max_control = .* is below"):
            em.Muscle("flexor", **GOOD, **limits)


@pytest.mark.parametrize("angle", [-0.1, 1.5, math.pi / 2, math.nan])
def test_pennation_out_of_range(angle):
    with pytest.raises(em.ParameterError, match=r"'flexor': pennation_angle_at_optimal = .* rad"):
        em.Muscle("flexor", **{**GOOD, "pennation_angle_at_optimal": angle})


def test_pennation_above_the_muscles_own_maximum():
    with pytest.raises(em.ParameterError, match=r"pennation_angle_at_optimal = 0\.3 .*0\.2"):
        em.Muscle(
            "flexor",
            **{**GOOD, "pennation_angle_at_optimal": 0.3},
            maximum_pennation_angle=0.2,
        )


@pytest.mark.parametrize("name", ["", None, 3])
def test_bad_name(name):
    with pytest.raises(em.ParameterError, match="name"):
        em.Muscle(name, **GOOD)


def test_duplicate_names():
    twice = [em.Muscle("flexor", **GOOD), em.Muscle("other", **GOOD), em.Muscle("flexor", **GOOD)]
    with pytest.raises(em.ParameterError, match=r"more than once: \['flexor'\]"):
        em.MuscleSet(twice)


def test_no_muscle():
    assert len(em.MuscleSet([])) == 0 and em.MuscleSet([]).optimal_fiber_length.shape == (0,)


def test_fibers_with_a_damper_need_no_activation():
    damped = em.Muscle("flexor", **GOOD | {"minimum_activation": 0.0, "law": em.Millard2012()})
    assert damped.minimum_activation == 0.0
    for law in (em.Millard2012(fiber_damping=0.0), em.Thelen2003(), em.Thelen2003Deprecated()):
        with pytest.raises(em.ParameterError, match=r"minimum_activation = 0 is below 0\.001"):
            em.Muscle("flexor", **GOOD | {"minimum_activation": 0.0, "law": law})


def test_bad_input_is_a_value_error():
    assert issubclass(em.ParameterError, ValueError)
    assert issubclass(em.ParameterError, em.ExudynMusclesError)


def test_a_muscle_is_frozen():
    muscle = em.Muscle("flexor", **GOOD)
    with pytest.raises(dataclasses.FrozenInstanceError):
        muscle.max_isometric_force = 1.0


def test_the_set_is_read_only_and_in_order():
    names = ["c", "a", "b"]
    muscles = em.MuscleSet(
        em.Muscle(name, **{**GOOD, "max_isometric_force": 100.0 * (k + 1)})
        for k, name in enumerate(names)
    )
    assert muscles.names == ("c", "a", "b")
    assert [muscle.name for muscle in muscles] == names
    assert len(muscles) == 3
    np.testing.assert_array_equal(muscles.max_isometric_force, [100.0, 200.0, 300.0])
    np.testing.assert_array_equal(muscles.optimal_fiber_length, [0.1] * 3)
    np.testing.assert_array_equal(muscles.minimum_activation, [0.01] * 3)
    with pytest.raises(ValueError, match="read-only"):
        muscles.max_isometric_force[0] = 1.0


def test_shortest_taut_length():
    """0.2 optimal lengths without pennation; the steepest fibre with it."""
    straight = em.Muscle("straight", **{**GOOD, "pennation_angle_at_optimal": 0.0})
    pennate = em.Muscle("pennate", **{**GOOD, "pennation_angle_at_optimal": 0.5})
    shortest = em.MuscleSet([straight, pennate]).shortest_taut_length
    width = 0.1 * math.sin(0.5)
    assert shortest[0] == pytest.approx(0.2 + 0.02)
    assert shortest[1] == pytest.approx(0.2 + width / math.tan(math.acos(0.1)))


@pytest.mark.parametrize("law", LAWS)
def test_shortest_taut_length_of_the_laws(law):
    """Where the law stops the fibre, or the steepest pennation does."""
    stops = {"Millard2012": 0.4441, "Millard2012, undamped": 0.4441}
    stops |= dict.fromkeys(("Thelen2003", "Thelen2003Deprecated", "Schutte1993"), 0.0)
    stop = 0.1 * stops.get(law, 0.2)
    shortest = em.MuscleSet(
        em.Muscle(f"{lean}", **{**GOOD, "pennation_angle_at_optimal": lean}, law=LAWS[law])
        for lean in (0.0, 0.1, 0.5)
    ).shortest_taut_length
    for lean, taut in zip((0.0, 0.1, 0.5), shortest, strict=True):
        width = 0.1 * math.sin(lean)
        expected = max(math.sqrt(max(stop**2 - width**2, 0.0)), width / math.tan(math.acos(0.1)))
        assert taut == pytest.approx(0.2 + expected, rel=1e-14)


def test_defaults():
    """The paper's activation on OpenSim's De Groote unit, as before there were other laws."""
    muscle = em.Muscle("flexor", **GOOD)
    assert muscle.law == em.DeGrooteFregly2016()
    assert muscle.activation_dynamics is em.ActivationDynamics.LINEAR_FILTER
    assert not muscle.ignore_tendon_compliance
    assert muscle.tendon_strain_at_one_norm_force is None
    assert muscle.tendon_strain == 0.049
    assert muscle.minimum_activation == 0.01
    assert muscle.max_contraction_velocity == 10.0


@pytest.mark.parametrize(
    ("parameter", "value", "kind"),
    [
        ("law", "Thelen2003", "MuscleLaw"),
        ("law", em.Thelen2003, "MuscleLaw"),
        ("law", None, "MuscleLaw"),
        ("activation_dynamics", "SMOOTH", "ActivationDynamics"),
        ("activation_dynamics", 1, "ActivationDynamics"),
        ("ignore_tendon_compliance", 1, "bool"),
        ("ignore_tendon_compliance", None, "bool"),
    ],
)
def test_what_is_of_another_kind_is_named(parameter, value, kind):
    with pytest.raises(em.ParameterError) as error:
        em.Muscle("flexor", **GOOD, **{parameter: value})
    for part in ("'flexor'", parameter, repr(value), f"is not a {kind}"):
        assert part in str(error.value)


def test_strain_of_the_tendon():
    """The muscle's own, or its law's; the tendon bears one F0 there."""
    for law, default in ((em.Thelen2003(), 0.04), (em.Millard2012(), 0.049)):
        for strain in (None, 0.02, 0.1):
            muscle = em.Muscle("m", **GOOD, law=law, tendon_strain_at_one_norm_force=strain)
            assert muscle.tendon_strain == (strain or default)
            l_t = 0.2 * (1.0 + muscle.tendon_strain)
            found = em.muscle_dynamics(em.MuscleSet([muscle]), [0.5], [l_t], [0.3], [0.0])
            assert found.tendon_force[0] == pytest.approx(1000.0, rel=1e-9)


@pytest.mark.parametrize("strain", [0.0, -0.1, 1.1, math.nan, "stiff"])
def test_strain_out_of_range(strain):
    with pytest.raises(
        em.ParameterError, match=r"'flexor': tendon_strain_at_one_norm_force = .* \[0\.001, 1\]$"
    ):
        em.Muscle("flexor", **GOOD, tendon_strain_at_one_norm_force=strain)


def test_a_law_without_strain_takes_none():
    with pytest.raises(em.ParameterError, match=r"'flexor': tendon_strain.* = 0\.05: .*no scale"):
        em.Muscle(
            "flexor",
            **GOOD,
            law=em.DeGrooteFregly2016Published(),
            tendon_strain_at_one_norm_force=0.05,
        )


def test_a_law_for_rigid_tendons_only():
    law = em.CustomLaw(
        "rigid",
        active_force_length=lambda x: np.exp(-((x - 1.0) ** 2) / 0.45),
        force_velocity=lambda v: (1 + v) / (1 - 4 * v) if v < 0 else 1.4 - 0.4 / (1 + 12.5 * v),
        passive_force_length=lambda x: 4.0 * np.maximum(x - 1.0, 0.0) ** 2,
    )
    assert len(em.MuscleSet([em.Muscle("m", **GOOD, law=law, ignore_tendon_compliance=True)])) == 1
    with pytest.raises(
        em.ParameterError, match=r"'flexor': .*'rigid'.* no tendon curve; .*ignore_tendon_complianc"
    ):
        em.MuscleSet([em.Muscle("flexor", **GOOD, law=law)])


def test_units_share_the_curves_of_equal_laws():
    """A hundred muscles of one law carry its curves once."""
    curves = [F_L, F_V, INVERSE_F_V, F_PE, F_SE]
    same = em.MuscleSet(em.Muscle(f"m{k}", **GOOD, law=em.Thelen2003()) for k in range(100)).tables
    assert same.table.shape[0] == 100
    assert len(same.curves.grids) == 5
    assert (same.table[:, curves] == same.table[0, curves]).all()
    laws = list(LAWS.values())
    every = em.MuscleSet(em.Muscle(f"m{k}", **GOOD, law=law) for k, law in enumerate(laws)).tables
    assert len(np.unique(every.table[:, F_L])) == len(laws)
    for array in (every.table, *every.curves):
        assert not array.flags.writeable
