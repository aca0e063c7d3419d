"""A joint's load in the cost: its force is that of the analysis, and what is least is least."""

from dataclasses import replace

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import analysis
from exudyn_muscles.analysis.states import reserves_along
from exudyn_muscles.joints import Recorded, joint_force, model_joints
from exudyn_muscles.recruitment.normalizers import ReachableMaximum
from models import leg, planar_arm

from ..opensim import loop_models
from ..runs import plugin_run, settings, start_at
from ..skeleton.system.convert import TAIT_BRYAN, as_bodies

REFERENCE = 300.0  # N, a third less than what the leg's knee bears at most by squares


def leg_with_actuators():
    """The leg, whose knee slides with two dependent coordinates, and actuators of three kinds."""
    model = leg.build()
    reserves = [
        em.Reserve("knee", 5.0),
        em.Reserve("knee_y", 20.0),
        em.PointActuator(
            "push", link=leg.FOOT, point=[0.1, 0.0, 0.0], direction=[0.0, 1.0, 0.0],
            force_is_global=True, optimal_force=2.0,
        ),
        em.TorqueActuator("turn", link=leg.SHANK, axis=[0.0, 0.0, 1.0], optimal_force=2.0),
    ]  # fmt: skip
    return model.replace(reserves=reserves)


SOURCES = {
    "arm": (planar_arm.build, planar_arm.motion, ("shoulder", "elbow")),
    "leg": (leg_with_actuators, leg.motion, ("hip_rotation", "knee", "ankle")),
}


@pytest.mark.parametrize("source", SOURCES)
def test_it_is_the_load_of_the_analysis(source):
    """At the ends of all windows, and in random states under forces that serve no demand."""
    build, motion, joints = SOURCES[source]
    model = build()
    result = em.static_optimization(model, motion())
    table, forces = (
        analysis.joint_loads(model, result, joints),
        np.hstack([result.tendon_forces, reserves_along(result)]),
    )
    rng, m = np.random.default_rng(7), len(model.muscles)
    rows = rng.integers(0, result.time.size, 20)
    t, q = result.time[rows], result.coordinates[rows]
    v, F = rng.normal(size=q.shape), rng.uniform(-300.0, 900.0, (20, forces.shape[1]))
    none = np.empty((20, 0))
    random = Recorded(t, q, v, none, none, F[:, :m], F[:, m:])
    of_random = [there.loads.force for there in model_joints(model, joints).along(random)]
    for j, joint in enumerate(joints):
        force = joint_force(model, joint)
        for k, time in enumerate(result.time):
            constant, by_forces = force(result.coordinates[k], result.speeds[k], time)
            np.testing.assert_allclose(
                constant + by_forces @ forces[k], table[f"force/{joint}"][k], rtol=0, atol=1e-9
            )
        for k, expected in enumerate(of_random):
            constant, by_forces = force(q[k], v[k], t[k])
            found = constant + by_forces @ F[k]
            np.testing.assert_allclose(found, expected[j], rtol=1e-10, atol=1e-8)


METHODS = {
    "static": (em.static_optimization, em.StaticSettings()),
    "cmc": (em.computed_muscle_control, em.CMCSettings()),
    "csf": (em.cosimulate, em.CosimulationSettings(scheme=em.Scheme.FULL)),
}


@pytest.mark.parametrize("method", ["static", "csf"])
def test_nothing_that_keeps_the_torques_costs_less(method):
    """Along directions that change no torque, the slopes of the sum of squares and of the joint's
    load, which is the analysis', cancel out."""
    model, (run, given) = leg.build(), METHODS[method]
    given = replace(given, criterion=em.JointLoad("knee", REFERENCE))
    result = run(model, leg.motion(), settings=given)
    times, m, none = result.time.size, len(model.muscles), np.empty((2, 0))
    arms = analysis.muscle_analysis(model, result)["moment_arm"].reshape(times, -1, m)
    joints, checked = model_joints(model, ["knee"]), 0
    for k in range(5, times, 10):
        F, low, high = (
            x[k - 1] for x in (result.force_optimal, result.force_min, result.force_max)
        )
        N = ReachableMaximum()(model.muscles, high, None)
        free = np.flatnonzero(np.minimum(F - low, high - F) > 1e-6 * N)
        _, s, V = np.linalg.svd(arms[k][:, free])
        for direction in V[np.count_nonzero(s > 1e-9 * s[0]) :]:
            way = np.zeros(m)
            way[free] = 10.0 * direction
            twice = (np.array([x[k]] * 2) for x in (result.time, result.coordinates, result.speeds))
            states = Recorded(*twice, none, none, F + np.array([way, -way]), none)
            ahead, behind = (there.loads.force[0] for there in joints.along(states))
            of_load = ((ahead @ ahead) - (behind @ behind)) / REFERENCE**2
            of_squares = (((F + way) / N) ** 2 - ((F - way) / N) ** 2).sum()
            assert of_load + of_squares == pytest.approx(0.0, abs=1e-6 * abs(of_load) + 1e-9)
            checked += abs(of_load) > 1e-3
    assert checked >= 10


@pytest.mark.parametrize("method", METHODS)
def test_the_knee_bears_less(method):
    run, given = METHODS[method]
    criteria = (em.SquaredForces(), em.JointLoad("knee", REFERENCE), em.JointLoad("knee", 30.0))
    peak, mean, squares = [], [], []
    for criterion in criteria:
        model = leg.build()
        result = run(model, leg.motion(), settings=replace(given, criterion=criterion))
        assert result.counts.not_preferred == 0 and not result.torques_unmet.any()
        size = np.linalg.norm(analysis.joint_loads(model, result, ["knee"])["force"], axis=1)
        N = np.maximum(result.force_max, 1e-3 * model.muscles.max_isometric_force)
        peak.append(size.max())
        mean.append(size.mean())
        squares.append(((result.force_optimal / N) ** 2).sum(axis=1).mean())
    assert peak[1] < 0.94 * peak[0] and mean[1] < 0.96 * mean[0]
    assert peak[2] < 0.91 * peak[0] and mean[2] < 0.94 * mean[0]
    assert squares[0] < squares[1] < 1.05 * squares[0] < squares[2] < 1.1 * squares[0]


def test_in_runs_of_the_users_own():
    """Twice within one plugin, of an `mbs` that is held."""
    model, motion = leg.build(), leg.motion()
    chosen = em.CosimulationSettings(
        scheme=em.Scheme.FULL, criterion=em.JointLoad("knee", REFERENCE)
    )
    plugin = em.CosimulationPlugin(model, motion, chosen)
    run, results = settings(0.01, 0.1), []
    for _ in range(2):
        start_at(model, motion)
        results.append(plugin_run(model, plugin, run))
    whole = em.cosimulate(model, motion, settings=chosen)
    for result in results:
        found = result.tendon_forces
        np.testing.assert_allclose(found, whole.tendon_forces[: len(found)], rtol=1e-5, atol=1e-3)


def test_what_is_refused_is_refused_before_a_run(tmp_path):
    file = tmp_path / "model.osim"
    file.write_text(loop_models.model("distance"))
    for model, joint in (
        (as_bodies(planar_arm.build(), TAIT_BRYAN), "elbow"),
        (em.opensim.load_model(file), "b"),
    ):
        assert joint in analysis.joint_names(model)
        with pytest.raises(em.ModelError, match=f"joint '{joint}': .* kinematic trees without"):
            em.JointLoad(joint, 100.0).prepare(model)
