"""Slack tendons do not push: what is reported is what acted, in every method."""

import dataclasses
import warnings

import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum

from ..runs import KP, plugin_run, settings, start_at


def slack_pendulum(law):
    """Its tendons are too long for a part of the motion, but for the rest strong enough."""
    model = pendulum.build()
    muscles = [
        dataclasses.replace(
            muscle, law=law, tendon_slack_length=0.25, max_isometric_force=20000.0,
        )
        for muscle in model.muscles
    ]  # fmt: skip
    return em.MusculoskeletalModel(model.mbs, 0, muscles, coordinates=["theta"])


@pytest.fixture(scope="module", params=[em.DeGrooteFregly2016(), em.DeGrooteFregly2016Published()])
def results(request):
    """Of all methods that recruit at the accepted state, and the model."""
    model, motion = slack_pendulum(request.param), pendulum.motion()
    with warnings.catch_warnings():
        # A tendon that has just become taut has to be stretched first.
        warnings.simplefilter("ignore", em.UnmetTorqueWarning)
        cmc = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP))
        return model, {
            "static": em.static_optimization(model, motion),
            "cmc": cmc,
            "csf": em.cosimulate(
                model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
            ),
            "forward": em.forward_dynamics(model, cmc.excitations),
        }


@pytest.mark.parametrize("method", ["static", "cmc", "csf", "forward"])
def test_forces_and_torques_agree(results, method):
    model, result = results[0], results[1][method]
    law = next(iter(model.muscles)).law
    curve = law.curves(True).tendon_force_length
    strain = next(iter(model.muscles)).tendon_strain
    lowest = curve((result.tendon_lengths.min() / 0.25 - 1.0) / strain)
    assert lowest < -0.05  # the curve would push by as much of F0
    slack = curve((result.tendon_lengths / 0.25 - 1.0) / strain) <= 0.0
    assert 0.1 < slack.mean() < 0.6
    np.testing.assert_array_equal(result.tendon_forces[slack], 0.0)
    assert (result.tendon_forces[~slack] > 0.0).all()
    for name in ("force_min", "force_optimal", "force_max"):
        forces = getattr(result, name)
        assert np.isnan(forces).all() if method == "forward" else (forces >= 0.0).all()
    for k in range(len(result.time)):
        arms = model.geometry(result.coordinates[k], result.speeds[k]).moment_arms
        np.testing.assert_allclose(
            arms.T @ result.tendon_forces[k], result.torques_delivered[k], atol=1e-9 * 20000.0 * 0.1
        )


def test_files_and_the_plugin_say_so(results):
    model, motion = results[0], pendulum.motion()
    stored = em.opensim.result_files.forces(results[1]["csf"])
    assert stored.values[:, :2].min() == 0.0
    start_at(model, motion)
    lowest = []
    plugin = em.CosimulationPlugin(
        model, motion, em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP),
        progress=lambda t: lowest.append(plugin.tendon_forces.min()),
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", em.UnmetTorqueWarning)
        plugin_run(model, plugin, settings())
    assert min(lowest) == 0.0
