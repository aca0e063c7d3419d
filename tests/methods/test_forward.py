"""Forward dynamics: against muscle states as Exudyn ODE1 coordinates, and convergence."""

import dataclasses

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import NodeGenericODE1, ObjectGenericODE1

import exudyn_muscles as em
from models import pendulum, planar_arm

from ..differences import gradient
from ..runs import plugin_run, settings


def ode1_reference(model, excitations, steps, end):
    """The same system with a and l_t as ODE1 coordinates of Exudyn itself.

    Exudyn's trapezoidal rule integrates everything; the torque is set from the iterate's l_t, which
    counts in units of a tendon's stretch.
    """
    mbs, muscles = model.mbs, model.muscles
    q_0, v_0, a_0, l_t0 = excitations.initial
    m = len(muscles)
    slack = np.array([muscle.tendon_slack_length for muscle in muscles])
    stretch = 0.049 * slack
    y_0 = np.concatenate([a_0, (l_t0 - slack) / stretch])
    node = mbs.AddNode(
        NodeGenericODE1(
            referenceCoordinates=[0.0] * 2 * m,
            initialCoordinates=list(y_0),
            numberOfODE1Coordinates=2 * m,
        )
    )
    u = excitations.values[0]

    def muscle_states(y, q, v):
        geometry = model.geometry(q, v)
        path = geometry.length, geometry.lengthening_speed
        state = np.array(y[:m]), slack + stretch * np.array(y[m:])
        return em.muscle_dynamics(muscles, *state, *path, u), geometry.moment_arms

    def rates(y, q, v):
        now, _ = muscle_states(y, q, v)
        return np.concatenate([now.activation_rate, now.tendon_length_rate / stretch])

    def state():
        data = mbs.systemData
        return np.array(data.GetODE2Coordinates()), np.array(data.GetODE2Coordinates_t())

    mbs.AddObject(
        ObjectGenericODE1(
            nodeNumbers=[node], rhsUserFunction=lambda mbs, t, item, y: rates(y, *state())
        )
    )
    mbs.Assemble()
    model.skeleton.set_initial_state(q_0, v_0)
    # Exudyn starts ODE1 rates at zero, which would cost an order.
    mbs.systemData.SetODE1Coordinates_t(
        rates(y_0, q_0, v_0), configuration=exu.ConfigurationType.Initial
    )

    def torque(y, q, v):
        now, r = muscle_states(y, q, v)
        return r.T @ now.tendon_force

    def pre_newton(mbs, t, iteration, discontinuous):
        tau = torque(mbs.systemData.GetODE1Coordinates(), *state())
        mbs.SetObjectParameter(0, "jointForceVector", tau)

    mbs.SetObjectParameter(0, "jointForceVector", torque(y_0, q_0, v_0))
    mbs.SetPreNewtonResidualUserFunction(pre_newton)
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = end
    settings.timeIntegration.newton.useModifiedNewton = False
    settings.timeIntegration.newton.maxIterations = 60
    settings.timeIntegration.newton.relativeTolerance = 1e-13
    settings.timeIntegration.newton.absoluteTolerance = 1e-11
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    y = mbs.systemData.GetODE1Coordinates()
    q, v = state()
    return q, v, y[:m], slack + stretch * y[m:], muscle_states(y, q, v)[0].tendon_force


def initial_state(model):
    """Off equilibrium, moving, with unequal muscles."""
    q, v, a = np.array([2.8]), np.array([0.5]), np.array([0.2, 0.05])
    return q, v, a, em.equilibrium(model.muscles, a, model.geometry(q, v).length).tendon_length


def test_unified_steps_equal_muscle_states_as_exudyn_ode1_coordinates():
    model, reference = pendulum.build(), pendulum.build()
    steps, end = 200, 0.2
    excitations = em.Excitations([0.0, end], [[0.5, 0.1]], initial=initial_state(model))
    result = em.forward_dynamics(model, excitations)
    q, v, a, l_t, F = ode1_reference(reference, excitations, steps, end)

    assert abs(result.coordinates[-1, 0] - q[0]) < 1e-8
    assert abs(result.speeds[-1, 0] - v[0]) < 1e-7
    assert np.abs(result.activations[-1] - a).max() < 1e-9
    assert np.abs(result.tendon_lengths[-1] - l_t).max() < 1e-10
    assert np.abs(result.tendon_forces[-1] - F).max() < 1e-8 * 3000.0
    assert abs(q[0] - 2.8) > 0.05, "the comparison needs a motion"


def test_second_order_in_the_step():
    model = pendulum.build()
    end = 0.08
    excitations = em.Excitations([0.0, end], [[0.5, 0.1]], initial=initial_state(model))

    def final(step):
        result = em.forward_dynamics(model, excitations, settings=em.ForwardSettings(step=step))
        return np.concatenate([result.coordinates[-1], result.tendon_forces[-1] / 3000.0])

    steps = np.array([4e-3, 2e-3, 1e-3])
    exact = final(2.5e-5)
    errors = [np.abs(final(step) - exact).max() for step in steps]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 1.8 < order < 2.3


def test_starts_in_the_steady_state_of_the_first_excitations():
    model = pendulum.build()
    model.skeleton.set_initial_state(np.array([np.pi]), np.array([0.0]))
    result = em.forward_dynamics(model, em.Excitations([0.0, 0.05], [[0.3, 0.3]]))
    np.testing.assert_allclose(result.coordinates, np.pi, rtol=0, atol=1e-10)
    np.testing.assert_allclose(np.ptp(result.tendon_forces, axis=0), 0.0, rtol=0, atol=1e-6)
    np.testing.assert_allclose(result.activations, 0.3, rtol=0, atol=1e-12)


@pytest.mark.parametrize("step", [0.001, 0.01])
def test_reserves_run_linearly_within_a_window(step):
    built = pendulum.build()
    reserves = [em.Reserve("q0", 10.0)]
    model = em.MusculoskeletalModel(built.mbs, 0, built.muscles, reserves=reserves)
    given = em.Excitations([0.0, 0.02, 0.03], [[0.1, 0.2]] * 2, [[1.0], [5.0], [-4.0]])
    result = em.forward_dynamics(model, given, settings=em.ForwardSettings(step=step))
    q, v, F = result.coordinates, result.speeds, result.tendon_forces
    arms = np.array([model.geometry(*state).moment_arms[:, 0] for state in zip(q, v, strict=True)])
    carried = result.torques_delivered[:, 0] - (arms * F).sum(axis=1)
    expected = np.interp(result.time, given.time, given.reserves[:, 0])
    np.testing.assert_allclose(carried, expected, rtol=0.0, atol=1e-9)


def test_rigid_tendons_start_with_their_own_length():
    built = pendulum.build()
    rigid = [dataclasses.replace(muscle, ignore_tendon_compliance=True) for muscle in built.muscles]
    model = em.MusculoskeletalModel(built.mbs, 0, rigid)
    q, v, a, l_t = initial_state(model)
    stretched = em.Excitations([0.0, 0.01], [[0.5, 0.1]], initial=(q, v, a, 1.01 * l_t))
    exact = em.Excitations([0.0, 0.01], [[0.5, 0.1]], initial=(q, v, a, l_t))
    runs = [em.forward_dynamics(model, given) for given in (stretched, exact)]
    for name in ("tendon_lengths", "fiber_lengths", "tendon_forces", "coordinates"):
        np.testing.assert_array_equal(*(getattr(run, name) for run in runs))
    slack = [muscle.tendon_slack_length for muscle in rigid]
    np.testing.assert_array_equal(runs[0].tendon_lengths, np.tile(slack, (11, 1)))


def test_excitations_below_the_minimum_activation_count_as_the_minimum():
    model = pendulum.build()
    result = em.forward_dynamics(model, em.Excitations([0.0, 0.02], [[0.0, 0.0]]))
    np.testing.assert_allclose(result.activations, 0.01, rtol=0, atol=1e-12)
    np.testing.assert_allclose(result.excitation_values, 0.01)


@pytest.mark.parametrize(
    ("time", "values", "message"),
    [
        ([0.0, 0.1], [[0.5]], "1 muscles for a model with 2"),
        ([0.0, 0.1], [[0.5, 1.2]], r"'right': excitation 1.2 at t = 0 s is outside \[0, 1\]"),
        ([0.0, 0.1], [[-0.1, 0.2]], "'left': excitation -0.1"),
        ([0.0, 0.1], [[0.5, np.nan]], "finite"),
        ([0.1, 0.1], [[0.5, 0.5]], "increase"),
        ([0.0, 0.1, 0.2], [[0.5, 0.5]], "do not fit"),
        ([0.0, 0.1], [[0.5, 0.5], [0.4, 0.4]], "2 times for as many rows .* append the end of the"),
    ],
)
def test_bad_excitations_are_named(time, values, message):
    with pytest.raises(em.ParameterError, match=message):
        em.forward_dynamics(pendulum.build(), em.Excitations(time, values))


@pytest.mark.parametrize(
    ("index", "value", "message"),
    [
        (0, [np.pi, 0.0], "initial q must be 1 finite values"),
        (1, [np.nan], "initial q' must be"),
        (2, [0.5, 5.0], r"'right': initial activation 5 is outside \[0\.01, 1\]"),
        (2, [0.0, 0.5], "'left': initial activation 0 is outside"),
        (3, [0.16], "initial l_t must be 2 finite values"),
    ],
)
def test_a_bad_start_is_named(index, value, message):
    start = [np.array([np.pi]), np.zeros(1), np.full(2, 0.3), np.full(2, 0.165)]
    start[index] = np.array(value)
    excitations = em.Excitations([0.0, 0.1], [[0.3, 0.3]], initial=tuple(start))
    with pytest.raises(em.ParameterError, match=message):
        em.forward_dynamics(pendulum.build(), excitations)


@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
@pytest.mark.filterwarnings("ignore::exudyn_muscles.UnmetTorqueWarning")
def test_a_muscle_may_be_slack_at_the_start():
    built = pendulum.build()
    muscles = [
        em.Muscle(
            muscle.name,
            max_isometric_force=3000.0,
            optimal_fiber_length=0.15,
            tendon_slack_length=0.237 if muscle.name == "left" else 0.16,
            path=muscle.path,
        )
        for muscle in built.muscles
    ]
    model = em.MusculoskeletalModel(built.mbs, 0, muscles, coordinates=["theta"])
    motion = em.Motion.from_waypoints([0.0, 0.5, 1.0], np.radians([235.0, 180.0, 235.0]))
    csf = em.cosimulate(model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL))
    slack = csf.musculotendon_lengths[0, 0] < 0.237 + 0.2 * 0.15
    assert slack
    replay = em.forward_dynamics(model, csf.excitations)
    assert replay.status is em.Status.COMPLETE


def test_newtons_matrix_has_the_slopes_of_the_muscles_torques():
    """Towards q and q' alike; exactly, as the moment arms are constant here."""
    tree = planar_arm.build()
    paths = [{"shoulder": -0.03, "elbow": -0.02}, {"shoulder": 0.04}, {"elbow": 0.03}]
    size = {"max_isometric_force": 800, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.2}
    muscles = [
        em.Muscle(
            f"muscle {k}",
            **size,
            path=em.FunctionPath([(0.29, {}), *((r, {name: 1}) for name, r in arms.items())]),
        )
        for k, arms in enumerate(paths)
    ]
    model = em.MusculoskeletalModel(
        tree.mbs, tree.skeleton.object, muscles, coordinates=["shoulder", "elbow"]
    )
    plugin = em.ForwardPlugin(model, em.Excitations([0.0, 0.1], [[0.8, 0.3, 0.5]]))
    jacobian, skeleton = plugin.jacobian, model.skeleton
    matrices = []

    def watched(exact, mass, dq, dv):
        found, t = jacobian(exact, mass, dq, dv), model.mbs.systemData.GetTime()

        def slopes(state, step):
            before = state.copy()

            def torque(x):
                state[:] = x
                return plugin.torque(t, False).copy()

            found = gradient(torque, before, step)
            torque(before)
            return found

        by_q, by_v = dq * slopes(skeleton.q, 1e-6), dv * slopes(skeleton.v, 1e-4)
        matrices.append((found - exact, by_q, by_v))
        return found

    plugin.jacobian = watched
    plugin_run(model, plugin, settings(0.01, 0.1))
    found, by_q, by_v = map(np.array, zip(*matrices, strict=True))
    assert len(found) >= 10
    np.testing.assert_allclose(found, by_q + by_v, rtol=0, atol=1e-8 * np.abs(found).max())
    for part in (by_q, by_v):
        assert np.abs(part).max() > 0.01 * np.abs(found).max()
