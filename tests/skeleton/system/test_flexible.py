"""A flexible shank in all methods, and its equations against those of its finite elements."""

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em

from .flexible import MODES, FlexibleShank
from .test_runs import METHODS, order

MOTION = em.Motion.from_waypoints([0.0, 0.5, 1.0], [[0.0], [0.5], [0.2]])


@pytest.mark.parametrize("method", list(METHODS))
@pytest.mark.filterwarnings("ignore::exudyn_muscles.FrozenBodiesWarning")
def test_all_methods_run(method):
    result = METHODS[method](FlexibleShank().model(), MOTION)
    assert result.status is em.Status.COMPLETE
    assert result.max_unmet_torque == 0.0
    # deg; a rigid one has 0.0003, 0.0194, 0.049 and 0.
    most = {"csf": 0.004, "css": 0.025, "cmc": 0.1, "static": 0.0}[method]
    assert np.degrees(result.tracking_error_rms())[0] <= most
    if method == "static":  # 1.299 Nm as the rigid one; modes that give way ask for thousands
        assert np.abs(result.torques_demanded).max() == pytest.approx(1.299, abs=0.01)


def test_simplified_cosimulation_is_of_second_order():
    steps = [0.02, 0.01, 0.005]
    errors = [
        METHODS["css"](FlexibleShank().model(), MOTION, step=step).tracking_error_rms()[0]
        for step in steps
    ]
    assert order(steps, errors) > 1.9


@pytest.mark.parametrize("window", [0.005, 0.02])
def test_computed_muscle_control_over_other_windows(window):
    """Shorter than a swing of the slowest mode, 12 ms, and longer."""
    result = METHODS["cmc"](
        FlexibleShank().model(), MOTION, window=window, prediction=em.Prediction.SHIFTED
    )
    assert result.status is em.Status.COMPLETE
    assert np.degrees(result.tracking_error_rms())[0] < 0.4


def put(model, y, y_t):
    """The opened skeleton at z and modes y and their speeds."""
    state = model.skeleton.now.state
    model.skeleton.go_to(y[:1], y_t[:1], 0.0)
    state.q[-MODES:], state.v[-MODES:] = y[1:], y_t[1:]


def test_equations_are_those_of_the_finite_elements():
    shank = FlexibleShank()
    model = shank.model()
    y = np.array([0.4, 2e-3, -1e-3, 3e-4, -2e-4])
    y_t = np.array([1.5, 0.2, -0.3, 0.1, 0.05])
    with model.skeleton.opened():
        put(model, y, y_t)
        found = model.skeleton.dynamics()
        geometry = model.geometry(*found.place)
    M, bias = shank.equations(y, y_t)
    r = shank.pulls(y)
    gone = np.linalg.solve(M[1:, 1:], np.column_stack([M[1:, :1], bias[1:], r[:, 1:].T]))
    np.testing.assert_allclose(found.M, M[:1, :1] - M[:1, 1:] @ gone[:, :1], rtol=1e-6)
    np.testing.assert_allclose(found.bias, bias[:1] - M[0, 1:] @ gone[:, 1], rtol=1e-6)
    r_eff = r[:, 0] - M[0, 1:] @ gone[:, 2:]
    np.testing.assert_allclose(geometry.moment_arms[:, 0], r_eff, rtol=1e-6)


def test_energy():
    """What the loads do becomes energy of the finite elements."""
    shank = FlexibleShank()
    model, mbs = shank.model(), shank.mbs
    energy, power, time = [], [], []
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = 1000
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    plugin = em.CMCPlugin(model, MOTION)
    model.skeleton.set_initial_state(*MOTION(0.0)[:2])

    def look(mbs, t):
        skeleton = model.skeleton
        state = skeleton.now.state
        y, y_t = (
            np.append(own, array[-MODES:])
            for own, array in ((skeleton.q, state.q), (skeleton.v, state.v))
        )
        energy.append(shank.energy(y, y_t))
        power.append(skeleton.now.load @ state.v)
        time.append(t)
        return True

    mbs.SetPostStepUserFunction(look)
    with plugin.attached():
        mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    power = np.array(power)
    work = np.append(0.0, np.cumsum(0.5 * np.diff(time) * (power[1:] + power[:-1])))
    np.testing.assert_allclose(np.array(energy) - energy[0], work, atol=1e-3 * np.ptp(work))
    assert np.ptp(work) > 0.3
