"""The plugin in users' own runs: solvers, rejections, repeated runs, and the host's traps."""

import signal
import threading
import warnings

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import (
    LoadCoordinate,
    MarkerKinematicTreeRigid,
    MarkerNodeCoordinate,
    SensorUserFunction,
)

import exudyn_muscles as em
from models import pendulum, planar_arm

from ..runs import KP, TRAPEZOIDAL, csf, plugin_run, rms_deg, settings, start_at


@pytest.fixture
def model():
    built = pendulum.build()
    start_at(built, pendulum.motion())
    return built


@pytest.fixture(scope="module")
def motion():
    return pendulum.motion()


def same_bits(first, second):
    return all(
        np.array_equal(getattr(first, name), getattr(second, name), equal_nan=True)
        for name in ("coordinates", "speeds", "accelerations", "tendon_forces", "excitation_values")
    )


# Solvers and settings


def test_a_users_run_equals_the_method(model, motion):
    s = settings()
    s.timeIntegration.newton.useModifiedNewton = False
    result = plugin_run(model, csf(model, motion), s)
    method = em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    )
    assert result.status is em.Status.COMPLETE
    np.testing.assert_allclose(result.coordinates, method.coordinates, atol=1e-9)


@pytest.mark.parametrize("modified", [True, False])
@pytest.mark.parametrize("solver", [TRAPEZOIDAL, exu.DynamicSolverType.GeneralizedAlpha])
def test_both_implicit_solvers_with_both_newton_methods(model, motion, solver, modified):
    s = settings()
    s.timeIntegration.newton.useModifiedNewton = modified
    result = plugin_run(model, csf(model, motion), s, solver)
    assert result.counts.steps == 100 and result.counts.rejected_steps == 0
    assert rms_deg(result)[0] < 0.03
    # The Newton matrix knows the control law: one iteration a step.
    assert result.counts.newton_iterations <= 1.1 * 100


@pytest.mark.parametrize("solver", [TRAPEZOIDAL, exu.DynamicSolverType.GeneralizedAlpha])
def test_cmc_in_a_users_run(model, motion, solver):
    plugin = em.CMCPlugin(model, motion, em.CMCSettings(kp=KP))
    result = plugin_run(model, plugin, settings(0.001), solver)
    assert rms_deg(result)[0] < 0.0186
    assert len(result.excitation_values) == 100


def test_explicit_solvers_are_refused(model, motion):
    with pytest.raises(em.ModelError, match="explicit solvers cannot be used"):
        plugin_run(model, csf(model, motion), settings(0.001), exu.DynamicSolverType.RK44)


# Rejected steps


def force_rejections(mbs, every):
    """Reject each `every`-th step at its full size, as a contact model might: halve it once."""
    seen = {"calls": 0, "rejected": 0}

    def post_newton(mbs, t):
        seen["calls"] += 1
        h = t - mbs.systemData.GetTime(exu.ConfigurationType.StartOfStep)
        # Exudyn doubles the step again after ten good ones.
        if seen["calls"] % every == 0:
            seen["rejected"] += 1
            return [10.0, 0.5 * h]
        return [0.0, -1.0]

    mbs.SetPostNewtonUserFunction(post_newton)
    return seen


def rejected_run(make, step, reject):
    model, motion = pendulum.build(), pendulum.motion()
    start_at(model, motion)
    seen = force_rejections(model.mbs, 23) if reject else {"rejected": 0}
    result = plugin_run(model, make(model, motion), settings(step))
    assert result.counts.rejected_steps == seen["rejected"]
    return result


def test_forced_rejections_keep_csf_second_order_and_the_muscles_consistent():
    errors = []
    for step in (0.02, 0.01, 0.005):
        result = rejected_run(csf, step, True)
        assert result.counts.rejected_steps >= 2
        errors.append(rms_deg(result)[0])
        # The committed force is the one that the window's excitation leads to, from the committed
        # state before: integrate the recorded windows again.
        model = pendulum.build()
        for k in range(0, len(result.time) - 1, 13):
            ends = [model.geometry(result.coordinates[j], result.speeds[j]) for j in (k, k + 1)]
            end = em.integrate_window(
                model.muscles,
                result.activations[k],
                result.tendon_lengths[k],
                result.excitation_values[k],
                [g.length for g in ends],
                [g.lengthening_speed for g in ends],
                result.time[k + 1] - result.time[k],
            )
            np.testing.assert_allclose(end.force, result.tendon_forces[k + 1], atol=2e-4 * 3000)
            np.testing.assert_allclose(end.activation, result.activations[k + 1], atol=1e-12)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 1.7).all()


def test_forced_rejections_do_not_change_the_cmc_windows():
    def cmc(model, motion):
        return em.CMCPlugin(model, motion, em.CMCSettings(kp=KP))

    plain, rejected = (rejected_run(cmc, 0.001, reject) for reject in (False, True))
    assert rejected.counts.rejected_steps > 40
    # Steps of half the size may end between the windows' ends: the windows follow the steps.
    assert len(rejected.excitation_values) in (99, 100)
    final = np.interp(0.5, rejected.time, rejected.coordinates[:, 0])
    assert abs(final - plain.coordinates[500, 0]) < 2e-6


# Repeated runs


def test_a_repeated_run_gives_the_same_bits(model, motion):
    plugin = csf(model, motion)
    first = plugin_run(model, plugin, settings())
    second = plugin_run(model, plugin, settings())
    third = plugin_run(model, csf(model, motion), settings())
    assert same_bits(first, second) and same_bits(first, third)


def test_two_models_in_one_process_do_not_meet(model, motion):
    alone = plugin_run(model, csf(model, motion), settings())
    arm = planar_arm.build()
    start_at(arm, planar_arm.motion())
    other = pendulum.build()
    start_at(other, motion)
    plugin = csf(other, motion)
    with plugin.attached():
        # A whole run of another model while this one is attached.
        assert plugin_run(arm, csf(arm, planar_arm.motion()), settings()).counts.steps == 100
        other.mbs.SolveDynamic(settings(), solverType=TRAPEZOIDAL)
    assert same_bits(alone, plugin.result())


def test_consecutive_runs_continue_a_motion(model, motion):
    whole = plugin_run(model, csf(model, motion), settings())
    first = csf(model, motion)
    with first.attached():
        model.mbs.SolveDynamic(settings(end=0.5), solverType=TRAPEZOIDAL, updateInitialValues=True)
    second = em.CosimulationPlugin(
        model, motion, em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP), start=0.5
    )
    with second.attached():
        model.mbs.SolveDynamic(settings(start=0.5, end=1.0), solverType=TRAPEZOIDAL)
    assert first.result().time[-1] == pytest.approx(0.5)
    np.testing.assert_allclose(
        second.result().coordinates[:, 0], whole.coordinates[50:, 0], atol=2e-4
    )


def test_the_users_mbs_is_as_before(model, motion):
    mbs = model.mbs
    mbs.SetObjectParameter(0, "jointForceVector", [0.25])
    q, v = model.skeleton.initial_state()

    def own(mbs, t):
        return True

    mbs.SetPreStepUserFunction(own)
    em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP))
    em.static_optimization(model, motion)
    assert mbs.GetObjectParameter(0, "jointForceVector") == pytest.approx([0.25])
    assert mbs.GetPreStepUserFunction()["function"] is own
    assert mbs.GetPostStepUserFunction() == 0
    assert mbs.GetPreNewtonResidualUserFunction() == 0
    assert mbs.GetSystemJacobianUserFunction() == 0
    after = model.skeleton.initial_state()
    assert np.array_equal(after[0], q) and np.array_equal(after[1], v)
    mbs.SolveDynamic(settings(end=0.1), solverType=TRAPEZOIDAL)


def test_the_users_own_torque_load_and_spring_are_part_of_the_demand(model, motion):
    """A known torque on the joint: the muscles deliver the rest, the motion is the same."""
    plain = plugin_run(model, csf(model, motion), settings())
    model.mbs.SetObjectParameter(0, "jointForceVector", [1.5])
    node = model.mbs.GetObjectParameter(0, "nodeNumber")
    marker = model.mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    model.mbs.AddLoad(
        LoadCoordinate(
            markerNumber=marker, load=0.0, loadUserFunction=lambda mbs, t, load: 2.0 * np.sin(9 * t)
        )
    )
    model.mbs.Assemble()
    start_at(model, motion)
    loaded = plugin_run(model, csf(model, motion), settings())
    np.testing.assert_allclose(loaded.coordinates, plain.coordinates, atol=1e-8)
    t = loaded.time[1:]
    given = 1.5 + 2.0 * np.sin(9 * t)
    np.testing.assert_allclose(
        loaded.torques_delivered[1:, 0] + given, plain.torques_delivered[1:, 0], atol=1e-5
    )


def test_sensors_and_own_user_functions_see_the_run(model, motion):
    mbs = model.mbs
    plugin = csf(model, motion)

    def forces(mbs, t, numbers, factors, configuration):
        return list(plugin.tendon_forces)  # also asked for before the run

    sensor = mbs.AddSensor(
        SensorUserFunction(
            sensorNumbers=[],
            factors=[],
            storeInternal=True,
            sensorUserFunction=forces,
        )
    )
    calls = []
    mbs.SetPreStepUserFunction(lambda mbs, t: calls.append(t) is None)
    mbs.Assemble()
    start_at(model, motion)
    s = settings()
    s.solution.sensors.writePeriod = 0.01
    result = plugin_run(model, plugin, s)
    stored = mbs.GetSensorStoredData(sensor)
    assert len(calls) == 100
    np.testing.assert_array_equal(stored[1:, 1:], result.tendon_forces[1:])


# Traps of the host


def test_the_torque_at_the_start_is_in_the_initial_accelerations(model, motion):
    result = plugin_run(model, csf(model, motion), settings())
    M, bias = model.skeleton.dynamics_at(result.coordinates[0], result.speeds[0], 0.0)[:2]
    expected = np.linalg.solve(M, result.torques_delivered[0] - bias)
    np.testing.assert_allclose(result.accelerations[0], expected, atol=1e-10)


def test_without_initial_accelerations_the_run_is_refused(model, motion):
    start_at(model, motion)
    model.skeleton.set_initial_state(np.array([np.pi]), np.array([0.5]))
    s = settings()
    s.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
    with pytest.raises(em.ParameterError, match="computeInitialAccelerations"):
        plugin_run(model, csf(model, motion), s)


def test_the_first_iterate_of_exudyn_has_no_acceleration(model, motion):
    """The contract that the predictors rest on: a new release that changes it is seen here."""
    seen = []
    plugin = csf(model, motion)
    original = plugin.torque

    def spy(t, first):
        h = t - model.mbs.systemData.GetTime(exu.ConfigurationType.StartOfStep)
        q, v, a = (x.copy() for x in model.skeleton.start)
        if first:
            seen.append(
                np.concatenate(
                    [
                        model.skeleton.q - (q + h * v + 0.25 * h * h * a),
                        model.skeleton.v - (v + 0.5 * h * a),
                        model.skeleton.acceleration,
                    ]
                )
            )
        return original(t, first)

    plugin.torque = spy
    plugin_run(model, plugin, settings())
    assert len(seen) == 100
    assert np.abs(seen).max() < 1e-13


def test_a_user_function_that_returns_none_is_an_error(model, motion):
    model.mbs.SetPreStepUserFunction(lambda mbs, t: None)
    with pytest.raises(em.ModelError, match="PreStep user function of the mbs returned None"):
        plugin_run(model, csf(model, motion), settings())


def test_a_run_that_a_user_function_stops_is_incomplete(model, motion):
    model.mbs.SetPostStepUserFunction(lambda mbs, t: t < 0.495)
    with pytest.warns(em.IncompleteRunWarning, match=r"stopped by a user function at t = 0\.5"):
        result = plugin_run(model, csf(model, motion), settings())
    assert result.status is em.Status.INCOMPLETE
    assert result.time[-1] == pytest.approx(0.5)
    assert "stopped" in result.message


class Disaster(Exception):
    """Something that goes wrong in a user's code."""


def failing_at(t_fail, error):
    def progress(t):
        if t >= t_fail:
            raise error

    return progress


@pytest.mark.parametrize("error", [Disaster("boom"), KeyboardInterrupt()])
def test_exceptions_inside_surface_as_themselves(model, motion, error):
    plugin = em.CosimulationPlugin(
        model,
        motion,
        em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP),
        progress=failing_at(0.3, error),
    )
    with pytest.raises(type(error)) as caught:
        plugin_run(model, plugin, settings())
    assert caught.value is error
    assert "at t = 0.3 s" in error.__notes__[0] and "q = " in error.__notes__[0]
    partial = plugin.result()
    assert partial.status is em.Status.INCOMPLETE
    assert partial.time[-1] == pytest.approx(0.3)
    assert error.trajectory.time[-1] == pytest.approx(0.3)
    assert error.trajectory.cpu_time > 0.0
    # The mbs is usable at once.
    again = plugin_run(model, csf(model, motion), settings())
    assert again.status is em.Status.COMPLETE


@pytest.mark.parametrize("error", [Disaster("boom"), KeyboardInterrupt()])
@pytest.mark.parametrize("method", ["csf", "cmc", "static"])
def test_exceptions_in_the_users_loads_surface_as_themselves(model, motion, method, error):
    """Exudyn wraps them twice: the plugin's own solver assembles the loads as well."""

    def load(mbs, t, load):
        if t > 0.25:
            raise error
        return 0.0

    node = model.mbs.GetObjectParameter(0, "nodeNumber")
    marker = model.mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    model.mbs.AddLoad(LoadCoordinate(markerNumber=marker, load=0.0, loadUserFunction=load))
    model.mbs.Assemble()
    run = {
        "csf": em.cosimulate,
        "cmc": em.computed_muscle_control,
        "static": em.static_optimization,
    }[method]
    with pytest.raises(type(error)) as caught:
        run(model, motion)
    assert caught.value is error
    assert 0.2 < error.trajectory.time[-1] < 0.26
    assert error.trajectory.status is em.Status.INCOMPLETE
    assert error.trajectory.window_time[-1] == error.trajectory.time[-1]


@pytest.mark.parametrize("run", [em.cosimulate, em.computed_muscle_control, em.static_optimization])
def test_ctrl_c_in_the_very_first_load(model, motion, run):
    def load(mbs, t, load):
        raise KeyboardInterrupt

    node = model.mbs.GetObjectParameter(0, "nodeNumber")
    marker = model.mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    model.mbs.AddLoad(LoadCoordinate(markerNumber=marker, load=0.0, loadUserFunction=load))
    model.mbs.Assemble()
    with pytest.raises(KeyboardInterrupt):
        run(model, motion)
    assert "exudyn_muscles" not in model.mbs.sys


def test_the_context_of_an_error_is_kept(model, motion):
    def progress(t):
        try:
            1 / 0  # noqa: B018
        except ZeroDivisionError:
            raise Disaster  # noqa: B904

    with pytest.raises(Disaster) as caught:
        em.cosimulate(
            model,
            motion,
            progress=progress,
            settings=em.CosimulationSettings(scheme=em.Scheme.FULL),
        )
    assert isinstance(caught.value.__context__, ZeroDivisionError)
    assert not caught.value.__suppress_context__


def test_an_error_of_the_users_own_after_a_complete_run(model, motion):
    plugin = csf(model, motion)

    def run():
        with plugin.attached():
            model.mbs.SolveDynamic(settings(), solverType=TRAPEZOIDAL)
            raise Disaster

    with pytest.raises(Disaster) as caught:
        run()
    assert plugin.result().status is em.Status.COMPLETE
    assert caught.value.trajectory.time[-1] == pytest.approx(1.0)


def test_ctrl_c_from_the_keyboard(model, motion):
    def interrupt_at_half(t):
        if abs(t - 0.5) < 1e-9:
            signal.raise_signal(signal.SIGINT)

    assert threading.current_thread() is threading.main_thread()
    # A process that was started in the background may ignore the signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt) as caught:
            em.cosimulate(
                model,
                motion,
                settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP),
                progress=interrupt_at_half,
            )
    finally:
        signal.signal(signal.SIGINT, before)
    assert 0.48 < caught.value.trajectory.time[-1] < 0.52


def test_an_unreachable_tolerance_is_a_simulation_error(model, motion):
    s = settings()
    s.timeIntegration.newton.maxIterations = 1
    s.timeIntegration.newton.relativeTolerance = 1e-300
    s.timeIntegration.newton.absoluteTolerance = 1e-300
    plugin = csf(model, motion)
    with pytest.raises(em.SimulationError, match="Exudyn gave up at t = "):
        plugin_run(model, plugin, s)
    assert len(plugin.result().time) >= 1
    assert plugin_run(model, csf(model, motion), settings()).status is em.Status.COMPLETE


def test_nonfinite_loads_of_the_user_are_reported(model, motion):
    marker = model.mbs.AddMarker(
        MarkerKinematicTreeRigid(objectNumber=0, linkNumber=0, localPosition=[0.0, -0.5, 0.0])
    )
    from exudyn.utilities import LoadForceVector

    model.mbs.AddLoad(
        LoadForceVector(
            markerNumber=marker,
            loadVectorUserFunction=lambda mbs, t, load: [np.nan if t > 0.205 else 0.0, 0.0, 0.0],
        )
    )
    model.mbs.Assemble()
    start_at(model, motion)
    with pytest.raises(em.RecruitmentError, match=r"torques \[nan\]") as raised:
        plugin_run(model, csf(model, motion), settings())
    assert any("t = 0.21 s" in note for note in raised.value.__notes__)


# Misuse


def test_run_beyond_the_motions_end(model, motion):
    plugin = csf(model, motion)
    with pytest.raises(em.MotionError, match=r"endTime = 1\.5 s is beyond the end at 1 s"):
        plugin_run(model, plugin, settings(end=1.5))
    with pytest.raises(em.SimulationError, match="no result"):
        plugin.result()


def test_wrong_start_time(model, motion):
    with pytest.raises(em.ParameterError, match=r"startTime = 0\.2 s"):
        plugin_run(model, csf(model, motion), settings(start=0.2))


def test_two_runs_in_one_attachment(model, motion):
    plugin = csf(model, motion)

    def twice():
        with plugin.attached():
            for _ in range(2):
                model.mbs.SolveDynamic(settings(), solverType=TRAPEZOIDAL)

    with pytest.raises(em.ModelError, match="attach the plugin anew"):
        twice()
    assert plugin.result().time[-1] == pytest.approx(1.0)


def test_attached_twice(model, motion):
    plugin = csf(model, motion)
    with plugin.attached():
        second = plugin.attached()
        with pytest.raises(em.ModelError, match="another run is attached"):
            second.__enter__()


def test_nothing_else_runs_on_an_attached_mbs(model, motion):
    model.mbs.SetObjectParameter(0, "jointForceVector", [0.25])
    plugin = csf(model, motion)
    with plugin.attached():
        with pytest.raises(em.ModelError, match="another run is attached"):
            em.static_optimization(model, motion)
        model.mbs.SolveDynamic(settings(), solverType=TRAPEZOIDAL)
    assert same_bits(plugin.result(), plugin_run(model, csf(model, motion), settings()))
    assert model.mbs.GetObjectParameter(0, "jointForceVector") == pytest.approx([0.25])


def test_a_failed_attachment_leaves_the_plugin_usable(model, motion):
    plugin = csf(model, motion)
    model.mbs.SetSystemJacobianUserFunction(lambda *arguments: exu.MatrixContainer())
    with pytest.raises(em.ModelError, match="SystemJacobian user function"):
        plugin_run(model, plugin, settings())
    model.mbs.SetSystemJacobianUserFunction(0)
    assert plugin_run(model, plugin, settings()).status is em.Status.COMPLETE


@pytest.mark.parametrize("name", ["PreStep", "PreNewtonResidual", "SystemJacobian", "PostStep"])
@pytest.mark.parametrize("at", [0.0, 0.5])
def test_a_user_function_replaced_within_the_run_is_named(model, motion, name, at):
    """At once, whichever it is and whenever; what was accepted before is kept."""
    mbs = model.mbs

    def replace():
        if name == "SystemJacobian":
            getattr(mbs, f"Set{name}UserFunction")(0)
        else:
            getattr(mbs, f"Set{name}UserFunction")(lambda *arguments: True)

    def progress(t):
        if abs(t - at) < 1e-9:
            replace()

    plugin = em.CosimulationPlugin(
        model, motion, em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP), progress=progress
    )

    def run():
        with plugin.attached():
            if at == 0.0:
                replace()
            mbs.SolveDynamic(settings(), solverType=TRAPEZOIDAL)

    with pytest.raises(em.ModelError, match=f"another {name} user function") as caught:
        run()
    if at:
        ends = {"SystemJacobian": 1.0, "PostStep": at}
        assert caught.value.trajectory.time[-1] == pytest.approx(ends.get(name, at), abs=1e-9)
    assert getattr(mbs, f"Get{name}UserFunction")() == 0
    assert plugin_run(model, csf(model, motion), settings()).status is em.Status.COMPLETE


def test_a_jacobian_that_comes_within_the_run_is_named(model, motion):
    """Where the plugin has none itself, as with CSS: nobody would put it back or keep it."""

    def run():
        with csf(model, motion, scheme=em.Scheme.SIMPLIFIED).attached():
            model.mbs.SetSystemJacobianUserFunction(lambda *arguments: exu.MatrixContainer())
            model.mbs.SolveDynamic(settings(), solverType=TRAPEZOIDAL)

    with pytest.raises(em.ModelError, match="another SystemJacobian user function"):
        run()
    assert model.mbs.GetSystemJacobianUserFunction() == 0


def test_the_solver_of_the_users_last_run_comes_back(model, motion):
    """Where the plugin's run had none, or static optimization, which needs none in the mbs."""
    mbs = model.mbs
    mbs.SolveDynamic(settings(end=0.02), solverType=TRAPEZOIDAL)
    solver, of_user = mbs.sys["dynamicSolver"], mbs.sys["simulationSettings"]
    with csf(model, motion).attached():
        assert not {"dynamicSolver", "simulationSettings"} & set(mbs.sys)
    assert mbs.sys["dynamicSolver"] is solver and mbs.sys["simulationSettings"] is of_user
    em.static_optimization(model, motion)
    assert mbs.sys["dynamicSolver"] is solver and mbs.sys["simulationSettings"] is of_user
    plugin_run(model, csf(model, motion), settings(end=0.02))
    assert mbs.sys["dynamicSolver"] is not solver


def test_a_changed_step_gets_a_matrix_of_its_own():
    """With one coordinate the unified mode keeps its matrix otherwise: shorter steps are easier,
    but not with the matrix of longer ones.
    """

    def cmc(model, motion):
        return em.CMCPlugin(model, motion, em.CMCSettings(kp=KP))

    plain, shorter = (rejected_run(cmc, 0.001, reject).counts for reject in (False, True))
    tried = shorter.steps + shorter.rejected_steps
    assert shorter.rejected_steps > 40
    assert shorter.newton_iterations / tried < plain.newton_iterations / plain.steps


def test_css_extrapolates_over_steps_of_different_lengths():
    """The demand is that of the state which the last two accepted steps lead to."""

    def css(model, motion):
        predictor = em.Predictor.EXTRAPOLATED_ACCELERATION
        settings = em.CosimulationSettings(kp=KP, scheme=em.Scheme.SIMPLIFIED, predictor=predictor)
        return em.CosimulationPlugin(model, motion, settings)

    result = rejected_run(css, 0.01, True)
    model, motion = pendulum.build(), pendulum.motion()
    t, q, v, a = result.time, result.coordinates, result.speeds, result.accelerations
    h = np.diff(t)
    changes = np.flatnonzero(np.abs(np.diff(h)) > 1e-4) + 1
    assert len(changes) > 8
    for k in changes:
        a_next = a[k] + (a[k] - a[k - 1]) * (h[k] / h[k - 1])
        q_p = q[k] + h[k] * v[k] + 0.25 * h[k] ** 2 * (a[k] + a_next)
        v_p = v[k] + 0.5 * h[k] * (a[k] + a_next)
        q_d, v_d, a_d = motion(t[k + 1])
        with model.skeleton.opened() as skeleton:
            M, bias = skeleton.dynamics_at(q_p, v_p, t[k + 1])[:2]
        wanted = M @ (a_d + 2.0 * KP**0.5 * (v_d - v_p) + KP * (q_d - q_p)) + bias
        np.testing.assert_allclose(result.torques_demanded[k], wanted, rtol=1e-10)


def test_static_optimization_leaves_the_state_of_the_users_run(model, motion):
    plugin_run(model, csf(model, motion), settings(end=0.3))
    before, t = model.skeleton.q.copy(), model.mbs.systemData.GetTime()
    em.static_optimization(model, motion)
    assert np.array_equal(model.skeleton.q, before)
    assert model.mbs.systemData.GetTime() == t


def test_static_optimization_leaves_the_state_of_an_mbs_that_has_grown(model, motion):
    for _ in range(5):
        model.mbs.CreateMassPoint(referencePosition=[0.0, 0.0, 0.0], mass=1.0)
    model.mbs.Assemble()
    state = np.arange(16) / 10.0
    model.mbs.systemData.SetODE2Coordinates(state)
    with pytest.warns(em.FrozenBodiesWarning):
        em.static_optimization(model, motion)
    np.testing.assert_array_equal(model.mbs.systemData.GetODE2Coordinates(), state)


def test_warnings_without_a_module(model, motion):
    model.skeleton.set_initial_state(np.array([3.0]), np.array([0.0]))
    names = {"model": model, "plugin": csf(model, motion), "settings": settings(end=0.05)}
    code = "with plugin.attached():\n    model.mbs.SolveDynamic(settings)"
    with pytest.warns(em.StartWarning):
        exec(code, names)


def test_the_time_limit_of_exudyn_is_an_incomplete_run(model, motion):
    before = exu.special.solver.timeout
    exu.special.solver.timeout = 1e-3
    try:
        with pytest.warns(em.IncompleteRunWarning, match=r"exudyn\.special\.solver\.timeout"):
            result = plugin_run(model, csf(model, motion), settings())
    finally:
        exu.special.solver.timeout = before
    assert result.status is em.Status.INCOMPLETE


def test_warnings_point_at_the_users_line(model):
    violent = em.Motion.from_waypoints(
        np.array([0, 1 / 3, 2 / 3, 1]) * 0.5, np.radians([180.0, 120.0, 240.0, 180.0])
    )
    for method in (em.static_optimization, em.cosimulate):
        with pytest.warns(em.ExudynMusclesWarning) as caught:
            method(model, violent)
        assert {each.filename for each in caught} == {__file__}
    start_at(model, violent)
    with pytest.warns(em.ExudynMusclesWarning) as caught, csf(model, violent).attached():
        model.mbs.SolveDynamic(settings(end=0.5), solverType=TRAPEZOIDAL)
    assert {each.filename for each in caught} == {__file__}
    assert [each.category for each in caught] == [em.UnmetTorqueWarning, em.TrackingWarning]


def test_a_start_away_from_the_motion_is_told(model, motion):
    model.skeleton.set_initial_state(np.array([3.0]), np.array([0.0]))
    with pytest.warns(em.StartWarning, match=r"tracking errors \[0\.1415"):
        plugin_run(model, csf(model, motion), settings(end=0.1))


def test_a_tree_that_changed_needs_a_new_model(model, motion):
    model.mbs.SetObjectParameter(0, "baseOffset", [0.02, 0.0, 0.0])
    model.mbs.Assemble()
    with pytest.raises(em.ModelError, match="base of the kinematic tree have changed"):
        em.cosimulate(model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL))


def test_a_mass_matrix_that_is_not_one_is_named():
    from exudyn.utilities import HTtranslate, RigidBodyInertia, TreeLink

    mbs = exu.SystemContainer().AddSystem()
    inertia = RigidBodyInertia(mass=1.0, inertiaTensor=np.diag([0.01, 0.01, 0.01]))
    negative = RigidBodyInertia(mass=1.0, inertiaTensor=np.diag([0.01, 0.01, -0.01]))
    links = [
        TreeLink(
            jointType=exu.JointType.RevoluteZ,
            parent=parent,
            jointHT=HTtranslate([0.0, -0.3, 0.0]),
            linkInertia=part,
        )
        for parent, part in ((-1, inertia), (0, negative))
    ]
    tree = mbs.CreateKinematicTree(listOfTreeLinks=links, gravity=[0.0, -9.81, 0.0])
    mbs.Assemble()
    path = [em.PathPoint([0.05, 0.0, 0.0]), em.PathPoint([0.0, -0.3, 0.0], link=1)]
    unit = em.Muscle(
        "unit",
        max_isometric_force=100.0,
        optimal_fiber_length=0.3,
        tendon_slack_length=0.5,
        path=path,
    )
    strange = em.MusculoskeletalModel(mbs, tree, [unit], coordinates=["hip", "knee"])
    motion = em.Motion.from_waypoints([0.0, 0.1], np.zeros((2, 2)))
    with pytest.raises(em.ModelError, match=r"not positive definite .* coordinate 'knee'"):
        em.cosimulate(strange, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL))


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda m, d: em.cosimulate(m, None), em.MotionError, "expected a Motion, got NoneType"),
        (
            lambda m, d: em.cosimulate(m, d, settings=em.CMCSettings()),
            em.ParameterError,
            "Cosimulation",
        ),
        (
            lambda m, d: em.cosimulate(m, d, settings=em.CosimulationSettings),
            em.ParameterError,
            "settings",
        ),
        (lambda m, d: em.computed_muscle_control(m, d, settings={}), em.ParameterError, "CMC"),
        (lambda m, d: em.static_optimization(m, d, settings=None), em.ParameterError, "Static"),
        (lambda m, d: em.forward_dynamics(m, d), em.ParameterError, r"such as a result's"),
        (lambda m, d: em.MusculoskeletalModel(None, 0, []), em.ModelError, "exudyn.MainSystem"),
        (
            lambda m, d: em.MusculoskeletalModel(m.mbs, 0, ["a"]),
            em.ParameterError,
            "list of Muscle",
        ),
    ],
)
def test_wrong_types_are_named(model, motion, call, error, message):
    with pytest.raises(error, match=message):
        call(model, motion)


def test_modified_newton_recruits_once_a_step_on_the_arm_too():
    arm, reaching = planar_arm.build(), planar_arm.motion()
    start_at(arm, reaching)
    result = plugin_run(arm, csf(arm, reaching), settings())
    assert result.counts.recruitments <= 1.1 * 100


def test_result_before_a_run(model, motion):
    with pytest.raises(em.SimulationError, match="no result yet"):
        csf(model, motion).result()


def test_cpu_time_is_that_of_the_run_alone(model, motion):
    plugin = csf(model, motion)
    result = plugin_run(model, plugin, settings())
    assert plugin.result().cpu_time == result.cpu_time > 0.0


def test_mbs_changed_after_the_model_was_built(model, motion):
    model.mbs.AddMarker(MarkerKinematicTreeRigid(objectNumber=0, linkNumber=0))
    with pytest.raises(em.ModelError, match="not assembled"):
        em.cosimulate(model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL))


def test_wrong_number_of_coordinates(model):
    arm = planar_arm.motion()
    for call in (em.cosimulate, em.computed_muscle_control, em.static_optimization):
        with pytest.raises(em.MotionError, match="motion has 2 coordinates, the model 1"):
            call(model, arm)


def test_no_warnings_in_a_clean_run(model, motion):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plugin_run(model, csf(model, motion), settings())
