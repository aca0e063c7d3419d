"""Every law, kind of tendon and activation with all methods, on the pendulum."""

import dataclasses

import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum

from ..runs import KP, rms_deg
from ..zoo import LAWS

VARIANTS = {
    **{name: {"law": law} for name, law in LAWS.items()},
    "rigid De Groote": {"ignore_tendon_compliance": True},
    "rigid Thelen": {"law": em.Thelen2003(), "ignore_tendon_compliance": True},
    "rigid Millard": {"law": em.Millard2012(), "ignore_tendon_compliance": True},
    "first order": {"activation_dynamics": em.ActivationDynamics.FIRST_ORDER},
    "smooth": {"activation_dynamics": em.ActivationDynamics.SMOOTH},
    "smooth Thelen": {"law": em.Thelen2003(), "activation_dynamics": em.ActivationDynamics.SMOOTH},
}
CSF_RMS, CSS_RMS = 0.0186, 0.1209  # deg


@pytest.fixture(scope="module", params=VARIANTS)
def model(request):
    built = pendulum.build()
    changes = VARIANTS[request.param]
    muscles = [dataclasses.replace(muscle, **changes) for muscle in built.muscles]
    return em.MusculoskeletalModel(built.mbs, 0, muscles, coordinates=["theta"])


@pytest.fixture(scope="module")
def motion():
    return pendulum.motion()


def check(result):
    assert result.status is em.Status.COMPLETE
    assert result.max_unmet_torque == 0.0
    assert result.time[-1] == pytest.approx(1.0)
    assert result.excitation_values.max() < 0.6


@pytest.mark.parametrize("integrator", em.Integrator)
def test_static_optimization_and_cosimulation(model, motion, integrator):
    static = em.static_optimization(
        model, motion, settings=em.StaticSettings(integrator=integrator)
    )
    check(static)
    csf, css = (
        em.cosimulate(
            model,
            motion,
            settings=em.CosimulationSettings(kp=KP, scheme=scheme, integrator=integrator),
        )
        for scheme in (em.Scheme.FULL, em.Scheme.SIMPLIFIED)
    )
    for result in (csf, css):
        check(result)
    # The motion does not know by which muscles it is made.
    assert rms_deg(csf)[0] == pytest.approx(CSF_RMS, abs=1e-4)
    assert rms_deg(css)[0] == pytest.approx(CSS_RMS, abs=1e-4)
    assert np.abs(static.excitation_values - csf.excitation_values).max() < 0.003


def test_computed_muscle_control_and_its_replay(model, motion):
    cmc = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP))
    check(cmc)
    # At a rigid tendon the force follows the fibre's speed within the window at once.
    rigid = next(iter(model.muscles)).ignore_tendon_compliance
    assert rms_deg(cmc)[0] < (0.04 if rigid else 0.03)
    fine = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP, window=0.005))
    assert rms_deg(fine)[0] < rms_deg(cmc)[0] / 3.5
    replay = em.forward_dynamics(model, cmc.excitations)
    assert replay.status is em.Status.COMPLETE
    assert np.abs(replay.coordinates - cmc.coordinates).max() < 1e-9
    assert np.abs(replay.tendon_forces - cmc.tendon_forces).max() < 1e-6
