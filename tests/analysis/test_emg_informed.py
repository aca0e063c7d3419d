"""EMG that recruitment follows: courses, limits, scales that nobody knows, and modes."""

from dataclasses import replace

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import analysis
from exudyn_muscles.analysis import EMG
from models import planar_arm

WEIGHT = 10.0


@pytest.fixture(scope="module")
def model():
    return planar_arm.build()


@pytest.fixture(scope="module")
def motion():
    return planar_arm.motion().between(0.0, 0.5)


@pytest.fixture(scope="module")
def stiff(model, motion):
    """Activations of an arm that holds its muscles tighter than it needs to."""
    limits = {name: em.ControlLimits(0.15, 1.0) for name in model.muscles.names}
    return em.static_optimization(model, motion, settings=em.StaticSettings(control_limits=limits))


def emg_of(result, factor=1.0):
    rows = np.isin(result.time, result.window_time)
    values = factor * result.activations[rows]
    return EMG(result.muscle_names, result.time[rows], values)


def off(result, other):
    return np.abs(result.activations[5:] - other.activations[5:]).max()


def test_followed_activations_are_found_again(model, motion, stiff):
    """Of an arm that is tighter than the least squares: torques do not tell it, its EMG does."""
    names = {name: name for name in model.muscles.names}
    courses = emg_of(stiff).courses(names, delay=0.0)
    found = [
        em.static_optimization(model, motion, settings=em.StaticSettings(criterion=criterion))
        for criterion in (
            em.PoweredActivations(), em.Followed(courses, 10.0), em.Followed(courses, 1e5)
        )
    ]  # fmt: skip
    distances = [off(each, stiff) for each in found]
    assert distances[0] > 0.1
    assert distances[1] < 0.5 * distances[0]
    # Counted is what is linear in the force: on this arm up to 0.02 off.
    assert distances[2] < min(0.03, 0.5 * distances[1])
    for each in found:
        np.testing.assert_allclose(each.torques_delivered, stiff.torques_delivered, atol=1e-6)


def test_limits_hold(model, motion, stiff):
    names = {"elbow_flexor": "elbow_flexor"}
    limits = emg_of(stiff).limits(names, 0.05, delay=0.0)
    course = np.interp(motion.end, *emg_of(stiff).courses(names, delay=0.0)["elbow_flexor"])
    assert limits["elbow_flexor"].at(motion.end) == pytest.approx((course - 0.05, course + 0.05))
    settings = em.StaticSettings(control_limits=limits)
    u = em.static_optimization(model, motion, settings=settings)
    k = u.muscle_names.index("elbow_flexor")
    course = np.interp(u.window_time[1:], *emg_of(stiff).courses(names, delay=0.0)["elbow_flexor"])
    assert (np.abs(u.excitation_values[:, k] - course) <= 0.05 + 1e-9).all()


def test_scales_end_where_neither_side_gains(model, motion, stiff):
    """At the end the scales are the least squares of the activations that go with them, and the
    distance is smaller than without scales."""
    muscles = {"elbow_flexor": "elbow_flexor", "elbow_extensor": "elbow_extensor"}
    emg = emg_of(stiff, 2.0)
    emg = replace(emg, values=np.minimum(emg.values, 1.0))
    found = analysis.fit_emg_scales(model, motion, emg, muscles, weight=WEIGHT, delay=0.0)
    given = emg.courses(muscles, delay=0.0)
    rows = np.isin(found.result.time, found.result.window_time[1:])
    for name, scale in found.scales.items():
        a = found.result.activations[rows, found.result.muscle_names.index(name)]
        e = np.interp(found.result.time[rows], *given[name])
        assert scale == pytest.approx((a @ e) / (e @ e), abs=2e-4)
        np.testing.assert_allclose(found.criterion.courses[name][1], scale * given[name][1])
    plain = em.Followed(given, weight=WEIGHT)
    unscaled = em.static_optimization(model, motion, settings=em.StaticSettings(criterion=plain))
    columns = [found.result.muscle_names.index(name) for name in muscles]

    def distance(result, criterion):
        a = result.activations[rows][:, columns]
        e = [np.interp(result.time[rows], *criterion.courses[name]) for name in muscles]
        return ((a - np.array(e).T) ** 2).sum()

    assert distance(found.result, found.criterion) < 0.5 * distance(unscaled, plain)


def test_modes_carry_what_they_were_fitted_to(stiff):
    modes = analysis.fit_synergies(stiff, 2)
    W = np.array([modes[name] for name in stiff.muscle_names])
    assert W.min() >= 0.0 and W.max() == pytest.approx(1.0)
    all_modes = analysis.fit_synergies(stiff, 5)
    a = stiff.activations

    def left(W):
        from scipy.optimize import nnls

        return np.sqrt(sum(nnls(W, row)[1] ** 2 for row in a) / (a * a).sum())

    full = np.array([all_modes[name] for name in stiff.muscle_names])
    assert left(full) < left(W) < 0.2
    assert left(full) < 0.02


def test_synergies_lead_towards_their_modes(model, motion, stiff):
    modes = analysis.fit_synergies(stiff, 3)
    W = np.array([modes[name] for name in model.muscles.names])

    def left(result):
        from scipy.optimize import nnls

        return sum(nnls(W, row)[1] ** 2 for row in result.activations)

    found = [
        left(em.static_optimization(model, motion, settings=em.StaticSettings(criterion=criterion)))
        for criterion in (
            em.PoweredActivations(),
            em.Synergies(modes, 1.0),
            em.Synergies(modes, 1e3),
        )
    ]
    assert found[0] > found[1] > 3.0 * found[2]


@pytest.mark.parametrize(
    ("use", "says"),
    [
        (lambda emg: emg.courses({"a": "b"}), "EMG: there is no 'b', only a"),
        (lambda emg: replace(emg, values=2.0 * emg.values).courses({"x": "a"}), r"within \[2, 2\]"),
        (
            lambda emg: replace(emg, values=-0.2 + emg.values * [[0.0], [1.0]]).courses({"x": "a"}),
            r"within \[-0.2, 0.8\]",
        ),
        (lambda emg: emg.limits({"x": "a"}, 1.5), r"width = 1.5 is outside \[0, 1\]"),
    ],
)
def test_what_is_wrong_is_named(use, says):
    with pytest.raises(em.ParameterError, match=says):
        use(EMG(("a",), np.array([0.0, 1.0]), np.ones((2, 1))))


def test_wrong_numbers_of_modes_and_silent_emg_are_named(model, motion, stiff):
    for count in (0, 7, 1.5):
        with pytest.raises(em.ParameterError, match=f"count = {count}"):
            analysis.fit_synergies(stiff, count)
    silent = EMG(("a",), np.array([0.0, 1.0]), np.zeros((2, 1)))
    with pytest.raises(em.ParameterError, match="EMG of 'elbow_flexor' is zero throughout"):
        analysis.fit_emg_scales(model, motion, silent, {"elbow_flexor": "a"})


def test_what_filters_leave_below_zero_is_zero():
    emg = EMG(("a",), np.array([0.0, 1.0, 2.0]), np.array([[-0.02], [0.5], [1.0]]))
    np.testing.assert_array_equal(emg.courses({"x": "a"}, delay=0.0)["x"][1], [0.0, 0.5, 1.0])


def test_a_delay_in_milliseconds_and_a_record_elsewhere_are_named(model, motion):
    emg = EMG(("a",), np.array([5.0, 6.0]), np.ones((2, 1)))
    with pytest.raises(em.ParameterError, match=r"delay = 50 s is outside \[-1, 1\]"):
        emg.courses({"elbow_flexor": "a"}, delay=50)
    with pytest.raises(
        em.ParameterError, match=r"EMG from 5.05 to 6.05 s.* does not cover the motion"
    ):
        analysis.fit_emg_scales(model, motion, emg, {"elbow_flexor": "a"})
