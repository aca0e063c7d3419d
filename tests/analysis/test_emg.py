"""Envelopes of made signals, and their agreement with excitations of which it is known."""

from dataclasses import replace

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.analysis import EMG, compare_emg
from models import planar_arm

T = np.arange(0.0, 2.0, 1e-3)


@pytest.fixture(scope="module")
def result():
    return em.static_optimization(planar_arm.build(), planar_arm.motion())


def bump(t, at, width=0.15):
    return np.exp(-0.5 * ((t - at) / width) ** 2)


def raw(amplitude):
    """Noise of the band of muscles with an amplitude over time."""
    return amplitude * np.random.default_rng(0).normal(size=amplitude.size)


def test_an_envelope_follows_the_amplitude():
    amplitude = 0.05 + bump(T, 1.0)
    found = EMG(("a",), T, raw(amplitude)[:, None] + 0.3).envelope().normalized()
    assert found.values.min() >= 0.0 and found.values.max() == 1.0
    inner = (T > 0.2) & (T < 1.8)
    assert np.corrcoef(found.values[inner, 0], amplitude[inner])[0, 1] > 0.97
    # The offset of the electrode is gone: where nothing happens there is nothing.
    assert found.values[T < 0.3].max() < 0.15


def test_what_is_smoothed_keeps_its_place():
    x = bump(T, 0.8)[:, None]
    smooth = EMG(("a",), T, x).envelope(band=None, cutoff=10.0)
    assert T[smooth.values[:, 0].argmax()] == pytest.approx(0.8, abs=2e-3)
    later = smooth.delayed(0.04)
    assert later.at("a", np.array([0.84])) == pytest.approx(smooth.values.max(), rel=1e-6)
    assert np.isnan(later.at("a", np.array([0.01]))).all()


def test_agreement_of_what_is_known(result):
    """Its own excitations as EMG, an electromechanical delay earlier and of another size."""
    t = 0.5 * (result.window_time[:-1] + result.window_time[1:])
    u = result.excitation_values
    own = EMG(result.muscle_names, t - 0.05, 3.0 * u)
    names = {name: name for name in result.muscle_names}
    found = compare_emg(result, own, names)
    varies = np.ptp(u, axis=0) > 0.0
    for name, there in zip(names, varies, strict=True):
        assert found[name].rms == pytest.approx(0.0, abs=1e-9)
        assert found[name].correlation == pytest.approx(1.0) or not there
    later = compare_emg(result, own, names, delay=0.08)
    lag = np.array([agreement.onset for agreement in later.values()])
    assert np.nanmin(np.abs(lag + 0.03)) < 0.011  # to a window


def test_bad_input_is_named(result):
    emg = EMG(("a",), T, np.ones((T.size, 1)))
    for message, call in {
        "no 'b', only a": lambda: compare_emg(result, emg, {result.muscle_names[0]: "b"}),
        "no muscle 'x'": lambda: compare_emg(result, emg, {"x": "a"}),
        "covers 0 windows": lambda: compare_emg(
            result, replace(emg, time=T + 50.0), {result.muscle_names[0]: "a"}
        ),
        "'soleus'": lambda: compare_emg(result, emg, ["soleus"]),
        "do not fit": lambda: EMG(("a", "b"), T, emg.values),
        "times must increase": lambda: replace(emg, time=-T),
        "'a' has values that are no numbers": lambda: replace(
            emg, values=emg.values * np.nan
        ).envelope(),
        "a band of frequencies increases": lambda: emg.envelope(band=(400.0, 20.0)),
        "equal steps": lambda: replace(emg, time=T**2 + T).envelope(),
        "half of the sampling rate": lambda: emg.envelope(cutoff=900.0),
        "needs more than": lambda: replace(emg, time=T * 50.0).envelope(),
        "EMG of 'a' is to be divided by 0": lambda: emg.normalized([0.0]),
    }.items():
        with pytest.raises(em.ParameterError, match=message):
            call()
