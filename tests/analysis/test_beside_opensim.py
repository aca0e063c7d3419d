"""What OpenSim's MuscleAnalysis and metabolic probes say at the same states."""

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import analysis
from exudyn_muscles.analysis import Bhargava, Tissue, Umberger
from exudyn_muscles.analysis.metabolics import muscle_rates
from exudyn_muscles.muscle.dynamics import MuscleDynamics, muscle_dynamics
from models import pendulum

from ..make_analyses import MUSCLE
from .opensims import NAMES, at_states, opensims, ordered

LAWS = {
    "umberger": Umberger(),
    "umberger_2003": Umberger(recruits_in_order=False, forbid_negative_power=False),
    "umberger_2010": Umberger(
        recruits_in_order=False, forbid_negative_power=False, negative_work=False
    ),
    "umberger_anaerobic": Umberger(
        aerobic_factor=1.0, minimum_heat=False, basal_coefficient=1.5, basal_exponent=0.8
    ),
    "bhargava": Bhargava(),
    "bhargava_force": Bhargava(force_dependent_shortening=True),
    "bhargava_open": Bhargava(forbid_negative_power=False, minimum_heat=False, negative_work=False),
}


@pytest.fixture(scope="module", params=NAMES)
def case(request, tmp_path_factory):
    model, numbers = opensims(request.param, tmp_path_factory.mktemp("models"))
    return model, numbers, at_states(model, numbers)


@pytest.mark.parametrize("column", MUSCLE)
def test_columns_of_muscle_analysis(case, column):
    """Of muscles that may wrap lengths differ by up to 3e-5 m, where OpenSim's tangent points are
    off, and forces with them."""
    model, numbers, result = case
    muscles = ordered(model, numbers)[1]
    found = analysis.muscle_analysis(model, result)[column][1:]
    expected, straight = numbers[column][:, muscles], ~numbers["wrapping"][muscles]
    size = np.abs(expected).max()
    np.testing.assert_allclose(found[:, straight], expected[:, straight], rtol=0, atol=1e-6 * size)
    if column in ("length", "tendon_length"):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4)


def test_moment_arms_are_opensims(case):
    model, numbers, result = case
    coordinates, muscles = ordered(model, numbers)
    straight = ~numbers["wrapping"][muscles]
    table = analysis.muscle_analysis(model, result)
    for j, name in zip(coordinates, model.coordinates, strict=True):
        expected = numbers["moment_arms"][:, muscles, j]
        found = table[f"moment_arm/{name}"][1:]
        np.testing.assert_allclose(found[:, straight], expected[:, straight], rtol=0, atol=1e-6)
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-3)


def on_opensims_paths(model, numbers):
    """What all muscles do where they are as long and as fast as OpenSim's, wraps or not."""
    muscles = ordered(model, numbers)[1]
    a, l, l_rate, l_t = (
        numbers[key][:, muscles]
        for key in ("activations", "length", "lengthening_speed", "tendon_length")
    )
    rows = [muscle_dynamics(model.muscles, *row) for row in zip(a, l_t, l, l_rate, strict=True)]
    return MuscleDynamics(*(np.array(field) for field in zip(*rows, strict=True)))


@pytest.mark.parametrize(
    "field", ["tendon_force", "fiber_velocity", "active_fiber_force", "passive_fiber_force"]
)
def test_forces_of_muscles_that_wrap_are_opensims_on_its_paths(case, field):
    model, numbers, _ = case
    expected = numbers[field][:, ordered(model, numbers)[1]]
    found = getattr(on_opensims_paths(model, numbers), field)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def tissues(model, numbers):
    ratios = numbers["slow_twitch_ratios"][ordered(model, numbers)[1]]
    return [Tissue(slow_twitch_ratio=float(ratio)) for ratio in ratios]


@pytest.mark.parametrize("name", LAWS)
def test_metabolic_power_is_that_of_the_probes(case, name):
    """OpenSim's has muscles on the paths that it knows, and so have they here."""
    model, numbers, _ = case
    muscles = ordered(model, numbers)[1]
    a, u = (numbers[key][:, muscles] for key in ("activations", "excitations"))
    found = on_opensims_paths(model, numbers)
    rates = muscle_rates(model.muscles, found, a, u, LAWS[name], tissues(model, numbers))
    expected = numbers[name][:, 2:][:, muscles]
    np.testing.assert_allclose(rates.total, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("name", LAWS)
def test_metabolic_power_of_a_result(case, name):
    model, numbers, result = case
    muscles = ordered(model, numbers)[1]
    tissue = dict(zip(model.muscles.names, tissues(model, numbers), strict=True))
    table = analysis.metabolic_power(model, result, LAWS[name], tissue)
    straight = ~numbers["wrapping"][muscles]
    expected = numbers[name][:, 2:][:, muscles]
    found = table["metabolic_power"][1:]
    size = np.abs(expected).max()
    np.testing.assert_allclose(
        found[:, :-2][:, straight], expected[:, straight], rtol=0, atol=1e-8 * size
    )
    np.testing.assert_allclose(found[:, -2], numbers[name][:, 1], rtol=1e-12)
    if straight.all():
        np.testing.assert_allclose(found[:, -1], numbers[name][:, 0], rtol=1e-8)
    np.testing.assert_allclose(found[:, -1], found[:, :-1].sum(axis=1), rtol=1e-12)


def test_masses_and_ratios_matter():
    model = pendulum.build()
    result = em.static_optimization(model, pendulum.motion())
    every = analysis.metabolic_power(model, result)
    heavy = analysis.metabolic_power(model, result, tissue={"left": Tissue(mass=2.0)})
    right = "activation_maintenance_heat/right"
    np.testing.assert_array_equal(every[right], heavy[right])
    light = Tissue().mass_of(next(iter(model.muscles)))
    left = right.replace("right", "left")
    np.testing.assert_allclose(heavy[left] / every[left], 2.0 / light, rtol=1e-12)
    fast = analysis.metabolic_power(model, result, tissue=Tissue(slow_twitch_ratio=0.0))
    assert (fast[left] > every[left]).any()
    scaled = analysis.metabolic_power(model, result, Umberger(effort_scaling=0.5))
    assert scaled[left].sum() < every[left].sum()


def test_what_metabolic_power_refuses():
    model = pendulum.build()
    result = em.static_optimization(model, pendulum.motion())
    with pytest.raises(em.ParameterError, match="tissue: the model has no muscle 'middle'"):
        analysis.metabolic_power(model, result, tissue={"middle": Tissue()})
    with pytest.raises(em.ParameterError, match="tissue is a Tissue or a mapping of them, got 3"):
        analysis.metabolic_power(model, result, tissue=3)
    with pytest.raises(em.ParameterError, match=r"slow_twitch_ratio = 1\.5 is outside"):
        Tissue(slow_twitch_ratio=1.5)
    with pytest.raises(em.ParameterError, match=r"specific_tension = 25\.0"):
        Tissue(specific_tension=25.0)
    with pytest.raises(em.ParameterError, match=r"density = 1\.06 kg"):
        Tissue(density=1.06)
    with pytest.raises(em.ParameterError, match="Umberger: aerobic_factor = -1"):
        Umberger(aerobic_factor=-1.0)
    with pytest.raises(em.ParameterError, match="maintenance_length is lengths that increase"):
        Bhargava(maintenance_length=((0.0, 0.0), (1.0, 1.0)))
