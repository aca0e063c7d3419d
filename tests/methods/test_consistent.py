"""Consistent co-simulation: excitations that reproduce the motion, tracking with real forces."""

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.forces.passive.on_coordinates import CoordinateSpring
from exudyn_muscles.methods.consistent import learned
from exudyn_muscles.methods.course.nodes import NODES
from exudyn_muscles.methods.disturbance import LINEAR, Course, speed_error, tracking_growth
from exudyn_muscles.skeleton.passive import add_passive_forces
from models import leg as leg_3d
from models import pendulum, planar_arm

from .. import leg
from ..runs import KP, plugin_run, settings, start_at

CONSISTENT = em.Scheme.CONSISTENT
GENERALIZED_ALPHA = exu.DynamicSolverType.GeneralizedAlpha


def run(model, motion, kp=KP, **options):
    given = em.CosimulationSettings(kp=kp, scheme=CONSISTENT, **options)
    return em.cosimulate(model, motion, settings=given)


def plugin(model, motion, kp=KP, **options):
    given = em.CosimulationSettings(kp=kp, scheme=CONSISTENT, **options)
    return em.CosimulationPlugin(model, motion, given)


def drift(model, result, step=2e-4):
    """Largest difference of a coordinate from its replay."""
    replayed = em.forward_dynamics(
        model, result.excitations, settings=em.ForwardSettings(step=step)
    )
    at = np.searchsorted(replayed.time, result.time - 1e-9)
    np.testing.assert_allclose(replayed.time[at], result.time, rtol=0, atol=1e-9)
    return np.abs(replayed.coordinates[at] - result.coordinates).max()


CASES = {  # drift and tracking error [rad] that CMC and CSF have in brackets
    "pendulum": (pendulum, KP, 8e-4, 5e-5),  # (4.7e-4, 7.9e-2; 2.3e-4, 3.2e-4)
    "planar_arm": (planar_arm, KP, 8e-6, 8e-6),  # (4.4e-6, 1.4e-3; 2.5e-5, 4.8e-5)
    "leg": (leg_3d, KP, 1.2e-5, 9e-5),  # (2.3e-5, 2.9e-3; 9.1e-5, 2.4e-4)
}


@pytest.mark.parametrize("name", CASES)
def test_the_excitations_reproduce_a_motion_that_is_tracked(name):
    source, kp, most_drift, most_error = CASES[name]
    model, motion = source.build(), source.motion()
    result = run(model, motion, kp)
    assert result.method == "consistent" and result.max_unmet_torque == 0.0
    assert result.tracking_error_rms().max() < most_error
    assert drift(model, result) < most_drift


def test_without_the_disturbances_the_law_is_off_by_what_the_course_takes():
    model, motion = planar_arm.build(), planar_arm.motion()
    plain = run(model, motion, disturbance_gain=0.0)
    half = run(model, motion, disturbance_gain=0.5)
    whole = run(model, motion)
    errors = [result.tracking_error_rms().max() for result in (whole, half, plain)]
    assert errors[0] < 0.6 * errors[1] and errors[1] < 0.5 * errors[2]
    assert drift(model, plain) < 2e-5


def test_orders():
    """The tracking error is of second order or better, the drift falls below that of its replay."""
    model, motion = planar_arm.build(), planar_arm.motion()
    steps = [0.02, 0.01, 0.005]
    results = [run(model, motion, step=step, window_tolerance=1e-6) for step in steps]
    errors = [result.tracking_error_rms().max() for result in results]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 1.9
    drifts = [drift(model, result) for result in results]
    assert drifts[1] < 0.5 * drifts[0] and drifts[2] < 5e-6


def test_what_is_recorded_is_the_state_that_the_replay_has():
    model, motion = planar_arm.build(), planar_arm.motion()
    result = run(model, motion)
    replayed = em.forward_dynamics(
        model, result.excitations, settings=em.ForwardSettings(step=2e-4)
    )
    at = np.searchsorted(replayed.time, result.time - 1e-9)
    F0 = [muscle.max_isometric_force for muscle in model.muscles]
    np.testing.assert_allclose(result.activations, replayed.activations[at], rtol=0, atol=2e-5)
    gap = np.abs(result.tendon_forces - replayed.tendon_forces[at]) / F0
    assert gap.max() < 2e-3 and np.median(gap) < 2e-5
    # Their torque is the recorded one, and the one that accelerates.
    r = np.array([model.geometry(q, q).moment_arms for q in result.coordinates])
    torques = np.einsum("tij,ti->tj", r, result.tendon_forces)
    np.testing.assert_allclose(torques, result.torques_delivered, rtol=0, atol=1e-9)
    states = zip(result.coordinates, result.speeds, result.accelerations, strict=True)
    with model.skeleton.opened() as skeleton:
        for (q, v, a), torque in zip(states, torques, strict=True):
            M, bias, _ = skeleton.dynamics_at(q, v, 0.0)
            np.testing.assert_allclose(M @ a + bias, torque, rtol=0, atol=5e-3)


def test_dependent_coordinates():
    model, motion = leg.build(), leg.motion()
    result = run(model, motion)
    cmc = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP))
    csf = em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    )
    assert drift(model, result) < 2.0 * drift(model, cmc) < 0.1 * drift(model, csf)
    assert result.tracking_error_rms().max() < cmc.tracking_error_rms().max()


def refusing(steps):
    """A PostNewton function that has the attempts of these numbers repeated with half the step."""
    tried = []

    def refuse(mbs, t):
        tried.append(t)
        return [10.0, 0.005] if len(tried) in steps else [0.0, -1.0]

    return refuse


@pytest.mark.parametrize("build", [planar_arm, leg], ids=["tree", "dependent"])
def test_rejected_steps_leave_no_trace(build):
    """A step that is refused and tried again from the same start gives the same bits as a run that
    took the shorter step at once."""
    motion = build.motion()

    def tried(again):
        model = build.build()
        start_at(model, motion)
        if again:
            model.mbs.SetPostNewtonUserFunction(refusing((6,)))
        options = settings(0.01, end=0.05) if not again else settings(0.01, end=0.2)
        options.timeIntegration.adaptiveStepRecoverySteps = 1
        return plugin_run(model, plugin(model, motion), options)

    smooth, disturbed = tried(False), tried(True)
    assert disturbed.counts.rejected_steps == 1
    for name in ("coordinates", "speeds", "activations", "tendon_lengths"):
        a, b = getattr(smooth, name), getattr(disturbed, name)[: len(smooth.time)]
        np.testing.assert_array_equal(a, b)
    assert np.isclose(np.diff(disturbed.time), 0.005).any()
    assert disturbed.tracking_error_rms().max() < 2e-4
    assert drift(build.build(), disturbed) < 2e-5


def test_repeated_newton_iterations_begin_at_the_same_state():
    """Discontinuous iterations come back to the predictor, and the step to where it leads."""
    motion = planar_arm.motion()

    def run_with(again):
        model = planar_arm.build()
        start_at(model, motion)
        calls = []

        def iterate(mbs, t):
            calls.append(t)
            return [10.0, -1.0] if len(calls) in again else [0.0, -1.0]

        model.mbs.SetPostNewtonUserFunction(iterate)
        return plugin_run(model, plugin(model, motion), settings(0.01, end=0.3))

    np.testing.assert_allclose(
        run_with((5, 17)).coordinates, run_with(()).coordinates, rtol=0, atol=2e-6
    )


def test_generalized_alpha_and_modified_newton():
    """Where a step leads depends on the muscles, not on how Exudyn integrates."""
    model, motion = planar_arm.build(), planar_arm.motion()
    start_at(model, motion)
    reference = plugin_run(model, plugin(model, motion), settings())
    alpha = plugin_run(model, plugin(model, motion), settings(), GENERALIZED_ALPHA)
    assert drift(model, alpha) < 2e-5
    np.testing.assert_allclose(alpha.coordinates, reference.coordinates, rtol=0, atol=1e-4)


def test_reserves_are_part_of_the_force():
    weak = pendulum.build()
    reserves = [em.Reserve("theta", optimal_force=1.0)]
    model = em.MusculoskeletalModel(
        weak.mbs, 0, list(weak.muscles), coordinates=["theta"], reserves=reserves
    )
    violent = em.Motion.from_waypoints(
        np.array([0, 1 / 3, 2 / 3, 1]) * 0.5, np.radians([180.0, 120.0, 240.0, 180.0])
    )
    result = run(model, violent)
    assert np.abs(result.reserves).max() > 10.0 and result.max_unmet_torque == 0.0
    assert drift(model, result) < 1e-3


@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
def test_out_of_reach_the_estimate_waits():
    model = pendulum.build()
    violent = em.Motion.from_waypoints(
        np.array([0, 1 / 3, 2 / 3, 1, 1.5]) * 0.5,
        np.radians([180.0, 120.0, 240.0, 180.0, 180.0]),
    )
    with pytest.warns(em.UnmetTorqueWarning):
        result = run(model, violent)
    assert result.status is em.Status.COMPLETE
    assert abs(result.tracking_errors()[-1, 0]) < 0.02


def pushed(kp, offset, gain=1.0):
    """A pendulum on a strong reserve, whose torque runs linearly, beside where it is to stand."""
    bare = pendulum.build()
    model = em.MusculoskeletalModel(
        bare.mbs, 0, list(bare.muscles), coordinates=["theta"],
        reserves=[em.Reserve("theta", optimal_force=1e6)],
    )  # fmt: skip
    model.skeleton.set_initial_state(np.array([np.pi + offset]), np.zeros(1))
    still = em.Motion.from_waypoints([0.0, 0.6], [np.pi, np.pi])
    return plugin_run(
        model, plugin(model, still, kp, disturbance_gain=gain), settings(0.01, end=0.6)
    )


@pytest.mark.filterwarnings("ignore::exudyn_muscles.StabilityWarning")
@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
@pytest.mark.parametrize("share", [0.9, 1.05])
def test_disturbances_grow_and_decay_as_the_eigenvalues_say(share):
    """At the limit of stability of accelerations that run linearly, which is kp h^2 = 11.8."""
    kp = share * 11.82 / 0.01**2
    expected = tracking_growth(kp, 2.0 * kp**0.5, 0.01, 1.0, LINEAR)
    assert (expected < 1.0) == (share < 1.0)
    a = np.abs(pushed(kp, 1e-5).accelerations[:, 0])
    growth = (a[40] / a[20]) ** (1 / 20)
    assert growth == pytest.approx(expected, rel=0.01)


def test_disturbances_decay_as_the_law_promises():
    expected = tracking_growth(KP, 2.0 * KP**0.5, 0.01, 1.0, LINEAR)
    a = np.abs(pushed(KP, 1e-2).accelerations[:, 0])
    assert (a[58] / a[48]) ** (1 / 10) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("kp", [25.0, 100.0, KP])
def test_the_estimate_is_stable_for_any_course_of_the_force(kp):
    """From forces that first go the wrong way to those that overshoot fivefold."""
    for mean in np.linspace(-0.2, 5.0, 27):
        growth = tracking_growth(kp, 2.0 * kp**0.5, 0.01, 1.0, Course(mean, mean / 3.0))
        assert growth < 0.96
        assert growth == pytest.approx(np.exp(-0.01 * kp**0.5), rel=0.1)


def test_iterates_that_are_close_keep_their_excitations():
    """One recruitment more in half of the steps, not in every one."""
    model = leg_3d.build()
    result = run(model, leg_3d.motion())
    assert result.counts.recruitments < 1.65 * result.counts.steps
    assert drift(model, result) < 2.4e-5  # CMC's


@pytest.mark.parametrize("kp", [100.0, KP])
def test_kept_excitations_leave_the_law_stable_where_forces_run_smoothly(kp):
    """Overshooting muscles are off by more than is kept before long."""

    def growth(mean, kept):
        return tracking_growth(kp, 2.0 * kp**0.5, 0.01, 1.0, Course(mean, mean / 3.0), kept)

    assert growth(0.5, True) == pytest.approx(growth(0.5, False), abs=2e-3)
    assert growth(0.52, True) < 0.91
    assert growth(1.0, True) > 1.5


def test_the_ideal_error():
    """Against the trapezoidal rule solved as a system."""
    e, e_t, kp, kv, h = 0.02, -0.3, 534.0, 46.0, 0.01
    A = np.array([[0.0, 1.0], [-kp, -kv]])
    then = np.linalg.solve(np.eye(2) - 0.5 * h * A, (np.eye(2) + 0.5 * h * A) @ [e, e_t])
    assert speed_error(e, e_t, kp, kv, h) == pytest.approx(then[1], rel=1e-12)


def test_without_a_gain():
    """kp = 0, as the other schemes take it."""
    model, motion = pendulum.build(), pendulum.motion()
    settings = em.CosimulationSettings(kp=0.0, kv=5.0, scheme=em.Scheme.CONSISTENT)
    run = em.cosimulate(model, motion.between(0.0, 0.2), settings=settings)
    assert run.tracking_error_rms().max() < 1e-3


def test_quadrature():
    nodes = NODES
    for p in range(8):
        x = nodes.s**p
        assert nodes.weights @ x == pytest.approx(1 / (p + 1), rel=1e-12)
        assert nodes.moments @ x == pytest.approx(1 / ((p + 1) * (p + 2)), rel=1e-12)
    ends = np.array([0.3, -0.2, 0.7, 1.1])
    cubic = np.polynomial.Polynomial(
        [ends[0], ends[1], 3 * (ends[2] - ends[0]) - 2 * ends[1] - ends[3],
         2 * (ends[0] - ends[2]) + ends[1] + ends[3]]
    )  # fmt: skip
    np.testing.assert_allclose(nodes.value @ ends, cubic(nodes.s), rtol=0, atol=1e-14)
    np.testing.assert_allclose(nodes.slope @ ends, cubic.deriv()(nodes.s), rtol=0, atol=1e-14)
    np.testing.assert_allclose(nodes.smooth.sum(axis=1), 1.0, rtol=0, atol=1e-13)


def test_responses_are_learned():
    """Of a linear answer, in as many moves as there are directions."""
    rng = np.random.default_rng(1)
    J = 0.4 * rng.normal(size=(3, 3)) / 3**0.5
    response, x, target = np.eye(3), np.zeros(3), rng.normal(size=3)
    for _ in range(7):
        away = target + J @ x - x
        moved = response @ away
        x = x + moved
        response = learned(response, moved, away, target + J @ x - x)
    np.testing.assert_allclose(x, np.linalg.solve(np.eye(3) - J, target), rtol=1e-8)
    worse = learned(response, np.ones(3), np.ones(3), 2.0 * np.ones(3))
    np.testing.assert_array_equal(worse, np.eye(3))


def test_settings_of_other_schemes_are_refused():
    with pytest.raises(em.ParameterError, match=r"disturbance_gain = 1\.5"):
        em.CosimulationSettings(scheme=CONSISTENT, disturbance_gain=1.5)
    with pytest.raises(em.ParameterError, match=r"disturbance_gain = 0\.5 does nothing"):
        em.CosimulationSettings(scheme=em.Scheme.FULL, disturbance_gain=0.5)
    literal = {"scheme": CONSISTENT, "first_iterate": em.FirstIterate.RECRUIT}
    with pytest.raises(em.ParameterError, match=r"first_iterate = .* does nothing"):
        em.CosimulationSettings(**literal)


def test_demands_out_of_reach_raise_only_where_a_step_is_accepted():
    motion = em.Motion.from_waypoints(
        np.array([0, 1 / 3, 2 / 3, 1]) * 0.5, np.radians([180.0, 120.0, 240.0, 180.0])
    )
    with pytest.raises(em.UnmetTorqueError, match=r"t = 0\.\d+ s, short by {'theta'"):
        run(pendulum.build(), motion, raise_on_unmet_torque=True)


def test_gains_that_are_too_high_are_warned_of():
    with pytest.warns(em.StabilityWarning, match=r"kp h\^2 = 2\.5 is above 2"):
        pushed(2.5e4, 1e-5)


@pytest.mark.parametrize(("stiffness", "damping"), [(3.0e3, 0.0), (0.0, 60.0)])
def test_stiff_springs_and_dampers_of_a_tree_are_warned_of(stiffness, damping):
    """Of the pendulum's joint: w^2 = k / M, and half of c / M."""
    model = pendulum.build()
    spring = CoordinateSpring("spring", "theta", stiffness=stiffness, rest=np.pi, viscosity=damping)
    add_passive_forces(model.mbs, model.skeleton.object, [spring], ["theta"])
    with model.skeleton.opened():
        M = model.skeleton.dynamics().M[0, 0]
        expected = max(np.sqrt(stiffness / M), 0.5 * damping / M)
        assert model.skeleton.fastest() == pytest.approx(expected, rel=1e-2)
    with pytest.warns(em.StabilityWarning, match=r"let the system swing with 1\d\d rad/s"):
        run(model, pendulum.motion().between(0.0, 0.04), 100.0, step=0.02)
