"""Some muscles given, as from EMG, the others recruited: limits of controls that are equal."""

import numpy as np
import pytest

import exudyn_muscles as em
from models import planar_arm

TIMES = np.linspace(0.0, 1.0, 11)
EMG = 0.1 + 0.08 * np.sin(9.0 * TIMES) ** 2


def static(model, motion, **limits):
    return em.static_optimization(model, motion, settings=em.StaticSettings(**limits))


def csf(model, motion, **limits):
    return em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=400.0, **limits)
    )


def css(model, motion, **limits):
    chosen = em.CosimulationSettings(kp=400.0, scheme=em.Scheme.SIMPLIFIED, **limits)
    return em.cosimulate(model, motion, settings=chosen)


def consistent(model, motion, **limits):
    chosen = em.CosimulationSettings(kp=400.0, scheme=em.Scheme.CONSISTENT, **limits)
    return em.cosimulate(model, motion, settings=chosen)


def cmc(model, motion, **limits):
    return em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=400.0, **limits))


@pytest.mark.parametrize("method", [static, csf, css, consistent, cmc])
def test_given_muscles_have_their_excitations_and_the_others_do_the_rest(method):
    model, motion = planar_arm.build(), planar_arm.motion()
    names = model.muscles.names
    emg = TIMES, EMG
    given = {
        "biarticular_flexor": em.ControlLimits(emg, emg),
        "elbow_extensor": em.ControlLimits(0.15, 0.15),
    }
    plain, result = method(model, motion), method(model, motion, control_limits=given)
    u = result.excitation_values
    expected = np.interp(result.window_time[1:], TIMES, EMG)
    np.testing.assert_allclose(u[:, names.index("biarticular_flexor")], expected, rtol=1e-12)
    np.testing.assert_allclose(u[:, names.index("elbow_extensor")], 0.15, rtol=1e-12)
    assert result.status is em.Status.COMPLETE
    assert result.max_unmet_torque == 0.0
    # The motion is the same, and flexors make up for what is given.
    np.testing.assert_allclose(result.coordinates, plain.coordinates, rtol=0, atol=2e-3)
    changed = np.abs(u - plain.excitation_values).max(axis=0)
    assert changed[names.index("elbow_flexor")] > 0.1
    assert changed[names.index("shoulder_flexor")] > 0.05
