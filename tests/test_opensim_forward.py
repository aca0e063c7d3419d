"""Forward dynamics of four sliding blocks against OpenSim 4.6, its order, and its energy."""

import json
from functools import cache

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, quad

import exudyn_muscles as em

from .opensim import REFERENCE, needs_opensim_files
from .opensim_models import block

pytestmark = needs_opensim_files

MODELS = ["tug_of_war", "tug_of_war_millard", "twoMusclesOnBlock", "block_hanging_from_muscle"]
STEPS = [4e-4, 2e-4, 1e-4]


@cache
def reference(name):
    """Times (k,), coordinate (k, 1), speed (k, 1), activations and fibre lengths (k, m)."""
    stored = np.load(REFERENCE / f"{name}_forward.npz")
    labels, data = list(stored["labels"]), stored["data"]

    def columns(ending):
        return data[:, [k for k, label in enumerate(labels) if label.endswith(ending)]]

    endings = ("/value", "/speed", "/activation", "/fiber_length")
    return data[:, 0], *(columns(ending) for ending in endings)


def excitations(name, model, step):
    """The reference's start, and its excitations at the middle of every step."""
    time, q, v, a, fiber = reference(name)
    given = json.loads((REFERENCE / f"{name}_forward.json").read_text())
    t = np.linspace(0.0, given["T"], round(given["T"] / step) + 1)
    middle = 0.5 * (t[:-1] + t[1:])
    u = [
        wave["offset"] + wave["amplitude"] * np.sin(wave["omega"] * middle + wave["phase"])
        for wave in (given["excitation"][name] for name in model.muscles.names)
    ]
    tendon = em.tendon_length(model.muscles, fiber[0], model.geometry(q[0], v[0]).length)
    return em.Excitations(t, np.array(u).T, initial=(q[0], v[0], a[0], tendon))


@cache
def run(name, step):
    model = block(name)
    given = excitations(name, model, step)
    return model, em.forward_dynamics(model, given, settings=em.Forward(step=step))


def errors(name, step):
    """Largest differences of coordinate [m], activations [1] and fibre lengths [m]."""
    time, q, _, a, fiber = reference(name)
    result = run(name, step)[1]
    rows = np.rint(time / step).astype(int)
    np.testing.assert_allclose(result.time[rows], time, atol=1e-12)
    pairs = ((result.coordinates, q), (result.activations, a), (result.fiber_lengths, fiber))
    return np.array([np.abs(mine[rows] - theirs).max() for mine, theirs in pairs])


@pytest.mark.parametrize("name", MODELS)
def test_motion_and_muscle_states_are_opensims(name):
    assert (errors(name, STEPS[-1]) < 1e-6).all()


@pytest.mark.parametrize("name", MODELS)
def test_second_order_in_the_step(name):
    for found in np.transpose([errors(name, step) for step in STEPS]):
        assert 1.9 < np.polyfit(np.log(STEPS), np.log(found), 1)[0] < 2.1


def instants(model, result):
    """`MuscleDynamics` at the recorded points and l', (k, m) each."""
    speeds = [
        model.geometry(q, v).lengthening_speed
        for q, v in zip(result.coordinates, result.speeds, strict=True)
    ]
    states = (result.activations, result.tendon_lengths, result.musculotendon_lengths, speeds)
    rows = [em.muscle_dynamics(model.muscles, *state) for state in zip(*states, strict=True)]
    return em.MuscleDynamics(*(np.array(row) for row in zip(*rows, strict=True))), np.array(speeds)


def skeleton_energy(model, result):
    """Kinetic and potential energy (k,) [J] of the block."""
    item = model.mbs.GetObject(model.skeleton.object)
    mass, gravity = item["linkMasses"][0], np.array(item["gravity"])
    axis = np.array(item["jointTransformations"][0])[:, 0]
    q, v = result.coordinates[:, 0], result.speeds[:, 0]
    return 0.5 * mass * v**2 - mass * (gravity @ axis) * q


def stored_energy(muscle, tendon_length, fiber_length):
    """Energy [J] in tendon and passive fibre, the integrals of their curves."""
    curves = muscle.law.curves()
    stretch = muscle.tendon_strain * muscle.tendon_slack_length
    s = (tendon_length - muscle.tendon_slack_length) / stretch
    x = fiber_length / muscle.optimal_fiber_length
    tendon, fiber = (
        quad(lambda y, curve=curve: curve(np.array([y]))[0], start, end, epsabs=1e-12)[0]
        for curve, start, end in (
            (curves.tendon_force_length, 0.0, s),
            (curves.passive_force_length, 1.0, x),
        )
    )
    return muscle.max_isometric_force * (stretch * tendon + muscle.optimal_fiber_length * fiber)


@pytest.mark.parametrize("name", MODELS)
def test_energy_is_conserved(name):
    """What the fibres' active forces do, less what their dampers lose, is what all bodies, tendons
    and passive fibres gain; and the tendons' work is what the block gains.

    Powers are integrated over the recorded points by Simpson's rule, energies come from formulas of
    their own. Relative to the work that all fibres have done and taken up.
    """
    model, result = run(name, STEPS[-1])
    now, speeds = instants(model, result)
    F0 = model.muscles.max_isometric_force
    elastic = F0 * now.passive_force_length
    losses = (now.passive_fiber_force - elastic) * now.fiber_velocity
    active = now.active_fiber_force * now.fiber_velocity
    on_block = -now.tendon_force * speeds

    def work(power):
        return cumulative_simpson(power.sum(axis=1), x=result.time, initial=0.0)

    turned_over = work(np.abs(active) + np.abs(losses))[-1]
    block_energy = skeleton_energy(model, result)
    gain = block_energy - block_energy[0]
    assert np.abs(gain - work(on_block)).max() < 1e-6 * turned_over

    rows = np.linspace(0, len(result.time) - 1, 11).astype(int)
    stored = [
        sum(map(stored_energy, model.muscles, result.tendon_lengths[k], result.fiber_lengths[k]))
        for k in rows
    ]
    gain = gain[rows] + stored - stored[0]
    assert np.abs(gain + work(active + losses)[rows]).max() < 1e-6 * turned_over
