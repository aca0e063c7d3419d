"""A run knows when it has lost its motion, and says which coordinate, when, and by how much."""

import dataclasses
import warnings
from dataclasses import replace

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.results.tracking import promised_errors
from models import pendulum, planar_arm

from ..runs import plugin_run, settings, start_at

CSS = em.Scheme.SIMPLIFIED
CONSISTENT = em.Scheme.CONSISTENT


def csf(model, motion, scheme=em.Scheme.FULL, **of):
    return em.cosimulate(model, motion, settings=em.CosimulationSettings(scheme=scheme, **of))


def cmc(model, motion, **of):
    return em.computed_muscle_control(model, motion, settings=em.CMCSettings(**of))


def weak(source, factor=0.02, **more):
    """The model with muscles too weak for it."""
    model = source.build()
    muscles = [
        replace(muscle, max_isometric_force=factor * muscle.max_isometric_force)
        for muscle in model.muscles
    ]
    names = model.coordinates
    return em.MusculoskeletalModel(
        model.mbs, model.skeleton.object, muscles, coordinates=names, **more
    )


def oscillation(model, hertz, size=0.3):
    """Every coordinate to and fro about where the pendulum or the arm is."""
    t = np.arange(0.0, 1.0, 0.1 / hertz / 4)
    q = model.skeleton.initial_state()[0] if len(model.coordinates) > 1 else np.array([np.pi])
    return em.Motion.from_samples(t, q + size * np.sin(2 * np.pi * hertz * t)[:, None])


def pendulum_run(run, **of):
    return lambda: run(pendulum.build(), pendulum.motion(), **of)


def arm_run(run, **of):
    return lambda: run(planar_arm.build(), planar_arm.motion(), **of)


LOST = {
    "windows too long": pendulum_run(cmc, window=0.1),
    "windows as long as steps": arm_run(cmc, window=0.25, step=0.25),
    "long windows, shifted": pendulum_run(
        cmc, window=0.25, step=0.01, prediction=em.Prediction.SHIFTED
    ),
    "CMC, weak muscles": lambda: cmc(weak(pendulum), pendulum.motion()),
    "CSF, weak muscles": lambda: csf(weak(pendulum), pendulum.motion()),
    "CSS, weak muscles": lambda: csf(weak(pendulum), pendulum.motion(), scheme=CSS),
    "consistent, weak muscles": lambda: csf(weak(pendulum), pendulum.motion(), scheme=CONSISTENT),
    "weak arm": lambda: csf(weak(planar_arm), planar_arm.motion()),
    "weak arm with weak reserves": lambda: csf(
        weak(planar_arm, reserves=[em.Reserve("elbow", 1e-3, -1.0, 1.0)]), planar_arm.motion()
    ),
    "faster than muscles": lambda: csf(pendulum.build(), oscillation(pendulum.build(), 6.0, 1.0)),
    "no feedback to speak of": lambda: cmc(
        pendulum.build(), oscillation(pendulum.build(), 1.5, 1.2), kp=0.01, window=0.05
    ),
    "steps too coarse": pendulum_run(csf, step=0.2, kp=900.0),
}


@pytest.mark.parametrize("how", LOST)
@pytest.mark.filterwarnings("ignore::exudyn_muscles.UnmetTorqueWarning")
@pytest.mark.filterwarnings("ignore::exudyn_muscles.StabilityWarning")
def test_a_run_that_has_lost_its_motion_says_so(how):
    with pytest.warns(em.TrackingWarning, match=r"off the motion from t = .* by up to .* at t"):
        result = LOST[how]()
    assert result.status is em.Status.LOST
    errors = np.abs(result.tracking_errors())
    worst = result.coordinate_names[int(errors.max(axis=0).argmax())]
    assert f"{worst}: off the motion" in result.message == result.tracking_report() or (
        result.message.startswith(result.tracking_report())
    )
    assert errors.max() > 0.2
    assert ("no torque was out of reach" in result.message) == (result.max_unmet_torque == 0.0)
    # Half a turn beyond the motion, and what one step adds to it.
    q, q_d = result.coordinates, result.desired_coordinates
    assert (q < q_d.max(axis=0) + np.pi + 0.5).all() and (q > q_d.min(axis=0) - np.pi - 0.5).all()


def test_it_is_stopped_before_the_numbers_are_absurd():
    model = weak(pendulum, 1e-3)
    model.skeleton.set_initial_state(np.array([np.pi]), np.array([40.0]))
    away = em.Motion.from_waypoints([0.0, 2.0], [np.pi, np.pi])
    plugin = em.CosimulationPlugin(model, away, em.CosimulationSettings(scheme=em.Scheme.FULL))
    with pytest.warns(em.ExudynMusclesWarning) as said:
        result = plugin_run(model, plugin, settings(0.01, end=2.0))
    assert {each.category for each in said} == {em.TrackingWarning, em.UnmetTorqueWarning}
    assert result.status is em.Status.LOST and result.time[-1] < 0.5
    assert np.pi < np.abs(result.tracking_errors()[-1, 0]) < np.pi + 0.5


def test_what_is_kept_or_promised_is_not_lost():
    """A run that starts off its motion comes back as the law has it; nothing is said after that."""
    model, motion = pendulum.build(), em.Motion.from_waypoints([0.0, 0.6], [np.pi, np.pi])
    strong = em.MusculoskeletalModel(
        model.mbs, model.skeleton.object, list(model.muscles), coordinates=["theta"],
        reserves=[em.Reserve("theta", 1e4)],
    )  # fmt: skip
    strong.skeleton.set_initial_state(np.array([np.pi - 0.4]), np.zeros(1))
    plugin = em.CosimulationPlugin(strong, motion, em.CosimulationSettings(scheme=em.Scheme.FULL))
    with pytest.warns(em.StartWarning):
        result = plugin_run(strong, plugin, settings(0.01, end=0.6))
    assert result.status is em.Status.COMPLETE and result.tracking_report() == ""
    assert np.abs(result.tracking_errors()[0]) > 0.3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert csf(pendulum.build(), pendulum.motion()).tracking_report() == ""


def test_a_step_too_coarse_is_said_without_a_loss():
    with pytest.warns(em.TrackingWarning, match="shorter steps may hold the motion"):
        result = csf(pendulum.build(), pendulum.motion(), step=0.05)
    assert result.status is em.Status.COMPLETE


@pytest.mark.parametrize(
    ("kp", "kv"), [(100.0, None), (100.0, 5.0), (100.0, 90.0), (0.0, 3.0), (0.0, 0.0)]
)
def test_what_the_law_promises(kp, kv):
    e, e_t, t = 0.3, -1.0, np.linspace(0.0, 1.0, 10001)
    damping = 2.0 * kp**0.5 if kv is None else kv
    A = np.array([[0.0, 1.0], [-kp, -damping]])
    half = 0.5 * (t[1] - t[0]) * A
    step = np.linalg.solve(np.eye(2) - half, np.eye(2) + half)
    state, expected = np.array([e, e_t]), []
    for _ in t:
        expected.append(state[0])
        state = step @ state
    found = promised_errors(t, np.array([e]), np.array([e_t]), {"kp": kp, "kv": kv})
    np.testing.assert_allclose(found[:, 0], expected, rtol=0, atol=1e-6)


def test_coarse_steps_promise_nothing():
    """The first step's own error is no promise: one that is all of the run is said."""
    short = pendulum.motion().between(0.0, 0.3)
    with pytest.warns(em.ExudynMusclesWarning) as said:
        result = csf(weak(pendulum), short, kp=0.01, step=0.3)
    assert result.status is em.Status.LOST
    assert {each.category for each in said} == {em.TrackingWarning, em.UnmetTorqueWarning}


def test_errors_in_the_middle_carry_what_was_off():
    """A run that ends in an error because it has lost its motion says that too."""
    model = weak(pendulum)

    def fail(mbs, t):
        if t > 0.5:
            raise RuntimeError("enough")
        return True

    model.mbs.SetPostStepUserFunction(fail)
    with pytest.raises(RuntimeError) as raised:
        csf(model, pendulum.motion())
    assert any("tracking before: theta: off the motion" in x for x in raised.value.__notes__)
    model.mbs.SetPostStepUserFunction(0)


@pytest.mark.filterwarnings("ignore::exudyn_muscles.ExudynMusclesWarning")
def test_a_start_off_the_motion_is_named_where_it_cost_the_motion():
    """Ten degrees are more than weak muscles can win back, whatever the gains."""
    model = weak(pendulum, 0.02)
    start_at(model, pendulum.motion())
    q, v = model.skeleton.initial_state()
    model.skeleton.set_initial_state(q - np.radians(10.0), v)
    plugin = em.CosimulationPlugin(
        model, pendulum.motion(), em.CosimulationSettings(kp=400.0, scheme=CONSISTENT)
    )
    try:
        result = plugin_run(model, plugin, settings(0.01, end=1.0))
        said = result.message
        assert result.status is em.Status.LOST
    except em.WindowError as error:
        said = " ".join(error.__notes__)
    assert "the run began 0.175 rad off in theta: begin on the motion, or with lower gains" in said


def test_what_reserves_carry_is_reported():
    model = weak(planar_arm, reserves=[em.Reserve("shoulder", 5.0), em.Reserve("elbow", 5.0)])
    result = csf(model, planar_arm.motion())
    assert result.status is em.Status.COMPLETE
    shoulder, elbow = result.reserve_report().split("; ")
    share = float(shoulder.removeprefix("shoulder: ").split("%")[0])
    demand, torque = result.torques_demanded[:, 0], result.torques_ideal[:, 0]
    assert share == pytest.approx(100 * np.sqrt(np.mean(torque**2) / np.mean(demand**2)), abs=0.06)
    assert share > 50.0 and "elbow" in elbow and elbow.endswith("N m")
    r = np.array([model.geometry(q, q).moment_arms for q in result.coordinates])
    muscles = np.einsum("tij,ti->tj", r, result.tendon_forces)
    np.testing.assert_allclose(
        muscles + result.torques_ideal, result.torques_delivered, rtol=0, atol=1e-6
    )
    assert csf(planar_arm.build(), planar_arm.motion()).reserve_report() == ""
    replayed = em.forward_dynamics(model, result.excitations)  # which demands nothing
    assert replayed.reserve_report().startswith("shoulder: up to ")
    older = dataclasses.replace(result, torques_ideal=np.full_like(result.torques_ideal, np.nan))
    assert older.reserve_report() == ""
