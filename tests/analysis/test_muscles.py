"""Analyses of muscles and powers against what the run itself has, of trees and of bodies."""

from dataclasses import replace

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import analysis, operators
from models import leg, pedalling, pendulum

from ..runs import KP

SOURCES = {"pendulum": pendulum, "leg": leg, "pedalling": pedalling}


@pytest.fixture(scope="module", params=SOURCES)
def case(request):
    source = SOURCES[request.param]
    model, motion = source.build(), source.motion()
    settings = em.CosimulationSettings(kp=KP, scheme=em.Scheme.FULL)
    return model, em.cosimulate(model, motion, settings=settings)


def test_lengths_forces_and_torques_are_those_of_the_run(case):
    model, result = case
    table = analysis.muscle_analysis(model, result)
    np.testing.assert_allclose(table["length"], result.musculotendon_lengths, rtol=0, atol=1e-13)
    np.testing.assert_allclose(table["fiber_length"], result.fiber_lengths, rtol=0, atol=1e-13)
    F = table["tendon_force"]
    np.testing.assert_allclose(F, result.tendon_forces, rtol=0, atol=1e-9 * F.max())
    for j, name in enumerate(model.coordinates):
        moments = table[f"moment/{name}"].sum(axis=1)
        others = result.torques_ideal[:, j]
        np.testing.assert_allclose(
            moments + others, result.torques_delivered[:, j], rtol=0, atol=1e-3
        )


def test_the_tendon_bears_what_the_fibre_does(case):
    table = analysis.muscle_analysis(*case)
    along = table["active_fiber_force_along_tendon"] + table["passive_fiber_force_along_tendon"]
    np.testing.assert_allclose(along, table["tendon_force"], rtol=0, atol=1e-6)
    share, passive = table["passive_share"], np.abs(table["passive_fiber_force"])
    sizes = np.abs(table["active_fiber_force"]) + passive
    np.testing.assert_allclose(share * sizes, passive)
    assert share.min() >= 0.0 and share.max() <= 1.0


def test_powers_are_in_balance(case):
    model, result = case
    table = analysis.power(model, result)
    parts = table["fiber_power"] + table["tendon_power"]
    scale = np.abs(parts).max()
    np.testing.assert_allclose(parts, table["muscle_power"], rtol=0, atol=1e-9 * scale)
    muscles, joints = table["muscle_power"].sum(axis=1), table["joint_power"].sum(axis=1)
    muscles = muscles + table["reserve_power"].sum(axis=1)
    np.testing.assert_allclose(muscles, joints, rtol=0, atol=2e-3 * scale)


def test_work_is_the_integral_of_power():
    t = np.linspace(0.0, 1.0, 101)
    powers = analysis.Table("power", t, ("muscle_power/a",), ("W",), np.sin(3.0 * t)[:, None])
    done = analysis.work(powers)
    assert done.columns == ("muscle_work/a",) and done.units == ("J",)
    expected = (1.0 - np.cos(3.0 * t)) / 3.0
    np.testing.assert_allclose(done["muscle_work/a"], expected, rtol=0, atol=2e-8)


def test_tables(case, tmp_path):
    model, result = case
    table = analysis.power(model, result)
    frame = table.to_dataframe()
    name = f"joint_power/{model.coordinates[0]}"
    np.testing.assert_array_equal(frame[name], table[name])
    assert frame.attrs["units"][name] == "W"
    table.to_storage().write(tmp_path / "power.sto")
    again = em.read_storage(tmp_path / "power.sto")
    np.testing.assert_array_equal(again.values, table.values)
    with pytest.raises(em.ParameterError, match="no column or quantity 'heat', only fiber_power"):
        table["heat"]


def test_another_models_trajectory_is_refused():
    model, motion = pendulum.build(), pendulum.motion()
    result = em.static_optimization(model, motion)
    with pytest.raises(em.ParameterError, match="the trajectory has the coordinates"):
        analysis.muscle_analysis(leg.build(), result)
    stronger = operators.scale_max_isometric_force(model.muscles, 2.0)
    with pytest.raises(em.ParameterError, match="of other muscles: at t = 0 s the force of left"):
        analysis.power(model.replace(muscles=stronger), result)
    moved = [
        replace(muscle, path=[muscle.path[0], em.PathPoint([0.0, -0.35, 0.0], link=0)])
        for muscle in model.muscles
    ]
    with pytest.raises(em.ParameterError, match="another model: at t = 0 s the path of"):
        analysis.feasible_forces(model.replace(muscles=moved), result)
    with pytest.raises(em.ParameterError, match="work: 'length/left' of the muscle analysis is no"):
        analysis.work(analysis.muscle_analysis(model, result))
