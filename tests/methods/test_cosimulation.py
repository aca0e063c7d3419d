"""Co-simulation on the pendulum and the arm: the paper's figures, orders, predictors, stability."""

import dataclasses
import warnings

import exudyn as exu
import exudyn.rigidBodyUtilities as rigid
import numpy as np
import pytest
from exudyn.utilities import (
    HomogeneousTransformation,
    LoadForceVector,
    MarkerKinematicTreeRigid,
    RigidBodyInertia,
    TreeLink,
)

import exudyn_muscles as em
from exudyn_muscles.methods import csf
from exudyn_muscles.methods.css import css_growth, css_limit
from exudyn_muscles.skeleton.skeleton import Skeleton
from models import leg, pendulum, planar_arm

from ..differences import gradient
from ..runs import KP, plugin_run, rms_deg, start_at
from ..runs import settings as run_settings

FULL, SIMPLIFIED = em.Scheme.FULL, em.Scheme.SIMPLIFIED
CONSTANT, EXTRAPOLATED = em.Predictor.CONSTANT_ACCELERATION, em.Predictor.EXTRAPOLATED_ACCELERATION


@pytest.fixture(scope="module")
def model():
    return pendulum.build()


@pytest.fixture(scope="module")
def motion():
    return pendulum.motion()


def run(model, motion, kp=KP, scheme=FULL, **options):
    return em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=scheme, kp=kp, **options)
    )


def test_csf_has_the_error_of_the_papers_table_2(model, motion):
    result = run(model, motion)
    assert rms_deg(result)[0] == pytest.approx(0.0186, abs=5e-5)
    assert result.counts.recruitments - 1 <= 2.1 * 100
    assert result.max_unmet_torque == 0.0
    assert result.excitation_values.max() < 0.45


def test_the_papers_literal_scheme_gives_the_same_motion_with_two_recruitments(model, motion):
    ours = run(model, motion)
    literal = run(model, motion, first_iterate=em.FirstIterate.RECRUIT)
    np.testing.assert_allclose(ours.coordinates, literal.coordinates, rtol=0, atol=1e-9)
    assert ours.counts.recruitments == 101
    assert literal.counts.recruitments - 1 >= 2 * 100


@pytest.mark.parametrize("source", [pendulum, planar_arm, leg])
@pytest.mark.parametrize("scheme", [FULL, em.Scheme.CONSISTENT])
def test_a_step_begins_where_the_law_leads(monkeypatch, source, scheme):
    """With one evaluation for each recruitment, and as from the demand's own first iterate."""
    model, motion = source.build(), source.motion()
    motion, asked = motion.between(motion.start, motion.start + 0.2), []
    dynamics = Skeleton.dynamics
    monkeypatch.setattr(Skeleton, "dynamics", lambda self: asked.append(0) or dynamics(self))
    ours = run(model, motion, scheme=scheme)
    assert len(asked) <= ours.counts.recruitments + 2  # where the run begins
    monkeypatch.setattr(csf, "goes_by_newmark", lambda mbs: False)
    stepwise = run(model, motion, scheme=scheme)
    assert len(asked) > 2.5 * ours.counts.recruitments
    np.testing.assert_allclose(ours.coordinates, stepwise.coordinates, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        ours.excitations.values, stepwise.excitations.values, rtol=0, atol=1e-6
    )


def kicked(mbs, t):
    """A PreStep function that changes the speeds of one step."""
    if abs(t - 0.11) < 1e-9:
        state = mbs.systemData.GetODE2Coordinates_t()
        mbs.systemData.SetODE2Coordinates_t(np.asarray(state) + 0.05)
    return True


def damped(mbs, t, iteration, discontinuous):
    """A PreNewtonResidual function that sets a load by the iterate's speeds."""
    speeds = np.asarray(mbs.systemData.GetODE2Coordinates_t())
    mbs.SetLoadParameter(0, "loadVector", [0.0, -5.0 * speeds[0], 0.0])


@pytest.mark.parametrize("hook", ["PreStep", "PreNewtonResidual"])
@pytest.mark.parametrize("scheme", [FULL, em.Scheme.CONSISTENT])
def test_user_functions_see_and_change_newtons_iterates(monkeypatch, scheme, hook):
    """Not where the law leads: the same results as without that."""
    results = []
    for by_law in (True, False):
        if not by_law:
            monkeypatch.setattr(csf, "goes_by_newmark", lambda mbs: False)
        model, motion = planar_arm.build(), planar_arm.motion()
        mbs = model.mbs
        marker = MarkerKinematicTreeRigid(objectNumber=0, linkNumber=1, localPosition=[0.1, 0, 0])
        mbs.AddLoad(LoadForceVector(markerNumber=mbs.AddMarker(marker), loadVector=[0, 0, 0]))
        mbs.Assemble()
        getattr(mbs, f"Set{hook}UserFunction")(kicked if hook == "PreStep" else damped)
        start_at(model, motion)
        plugin = em.CosimulationPlugin(model, motion, em.CosimulationSettings(scheme=scheme))
        results.append(plugin_run(model, plugin, run_settings(0.01, end=0.3)))
    np.testing.assert_array_equal(*(result.coordinates for result in results))


def test_csf_at_one_millisecond(model, motion):
    assert rms_deg(run(model, motion, step=0.001))[0] < 2.5e-4


@pytest.mark.parametrize(
    ("options", "steps"),
    [
        ({"scheme": FULL}, [0.01, 0.005, 0.0025]),
        ({"scheme": SIMPLIFIED}, [0.01, 0.005, 0.0025]),
        ({"scheme": SIMPLIFIED, "predictor": EXTRAPOLATED}, [0.005, 0.0025, 0.00125]),
    ],
)
def test_second_order_in_the_step(model, motion, options, steps):
    errors = [rms_deg(run(model, motion, step=step, **options))[0] for step in steps]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order > 1.9


def test_css(model, motion):
    constant = run(model, motion, scheme=SIMPLIFIED)
    extrapolated = run(model, motion, scheme=SIMPLIFIED, predictor=EXTRAPOLATED)
    assert rms_deg(constant)[0] <= 0.1215
    assert rms_deg(extrapolated)[0] <= 0.035
    for result in (constant, extrapolated):
        assert result.counts.recruitments - 1 == 100


@pytest.mark.parametrize("scheme", [FULL, SIMPLIFIED])
def test_forces_and_their_bounds_belong_to_one_state(model, motion, scheme):
    """Of the state with which the muscles were recruited: the one that pulls the wrong way does so
    exactly at its lower bound.
    """
    result = run(model, motion, scheme=scheme)
    F, low, high = result.force_optimal, result.force_min, result.force_max
    assert ((low <= F) & (high >= F)).all()
    resting = np.isclose(F, low, rtol=1e-13, atol=0.0).any(axis=1)
    assert resting.mean() > 0.95


@pytest.mark.parametrize("predictor", [CONSTANT, EXTRAPOLATED])
@pytest.mark.parametrize("share", [0.9, 1.1])
def test_disturbances_grow_and_decay_as_the_stability_limit_says(model, predictor, share):
    still = em.Motion.from_waypoints([0.0, 1.5], [np.pi, np.pi])
    kp = share * css_limit(0.01, predictor)
    settings = em.CosimulationSettings(kp=kp, scheme=SIMPLIFIED, predictor=predictor)
    model.skeleton.set_initial_state(np.array([np.pi + 1e-6]), np.array([0.0]))
    with warnings.catch_warnings():
        # Grown large, the disturbance also asks for more than there is.
        warnings.simplefilter("ignore", em.ExudynMusclesWarning)
        result = plugin_run(
            model, em.CosimulationPlugin(model, still, settings), run_settings(end=1.5)
        )
    a = np.abs(result.accelerations[:, 0])
    growth = (a[90] / a[50]) ** (1 / 40)
    expected = css_growth(kp, 2.0 * np.sqrt(kp), 0.01, predictor)
    assert (expected < 1.0) == (share < 1.0)
    assert growth == pytest.approx(expected, rel=0.005)


def test_css_outside_its_limit_warns_with_the_limit(model, motion):
    with pytest.warns(em.StabilityWarning, match=r"stable up to kp = 2020 .*\(kp step\^2 = 0\.202"):
        em.cosimulate(
            model,
            em.Motion.from_waypoints([0.0, 0.02], [np.pi, np.pi]),
            settings=em.CosimulationSettings(kp=2500.0, scheme=SIMPLIFIED),
        )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(model, motion, kp=2500.0)
        run(model, motion, kp=1000.0, scheme=SIMPLIFIED)


@pytest.mark.parametrize("predictor", em.Predictor)
def test_the_warning_begins_at_the_limit(model, motion, predictor):
    limit = css_limit(0.01, predictor)
    short = motion.between(0.0, 0.02)
    with pytest.warns(em.StabilityWarning):
        run(model, short, kp=1.01 * limit, scheme=SIMPLIFIED, predictor=predictor)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(model, short, kp=0.99 * limit, scheme=SIMPLIFIED, predictor=predictor)


def test_velocity_feedback_alone_can_be_unstable_too(model):
    still = em.Motion.from_waypoints([0.0, 0.02], [np.pi, np.pi])
    with pytest.warns(em.StabilityWarning, match="kp = 0, kv = 1000"):
        run(model, still, kp=0.0, kv=1000.0, scheme=SIMPLIFIED)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(model, still, kp=0.0, kv=10.0, scheme=SIMPLIFIED)


def test_growth_at_known_gains():
    assert css_growth(2500.0, 100.0, 0.01, CONSTANT) > 1.0
    assert css_growth(1000.0, 2 * 1000**0.5, 0.01, EXTRAPOLATED) > 1.0
    assert css_growth(KP, 2 * KP**0.5, 0.01, CONSTANT) < 1.0
    assert css_growth(KP, 2 * KP**0.5, 0.01, EXTRAPOLATED) < 1.0


def test_csf_is_stable_at_high_gains(model, motion):
    result = run(model, motion, kp=40000.0)
    assert result.counts.newton_iterations <= 110
    assert rms_deg(result)[0] < 0.006


def test_the_planar_arm():
    model, motion = planar_arm.build(), planar_arm.motion()
    result = run(model, motion)
    assert (rms_deg(result) < 0.007).all()
    assert result.max_unmet_torque == 0.0
    assert result.counts.newton_iterations <= 110
    css = run(model, motion, scheme=SIMPLIFIED)
    assert css.max_unmet_torque == 0.0
    assert (rms_deg(css) < 0.05).all()


@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
def test_out_of_reach_the_run_goes_on_and_says_so(model):
    violent = em.Motion.from_waypoints(
        np.array([0, 1 / 3, 2 / 3, 1]) * 0.5, np.radians([180.0, 120.0, 240.0, 180.0])
    )
    with pytest.warns(em.UnmetTorqueWarning, match="theta: demand out of reach in") as caught:
        result = run(model, violent)
    assert len([w for w in caught if w.category is em.UnmetTorqueWarning]) == 1
    assert result.status is em.Status.LOST and result.time[-1] == pytest.approx(0.5)
    assert result.counts.rejected_steps == 0
    short = result.torques_unmet[:, 0] != 0.0
    assert 5 < short.sum() < 50
    np.testing.assert_allclose(
        (result.torques_delivered[1:] + result.torques_unmet)[short],
        result.torques_demanded[short],
        rtol=0,
        atol=1e-6,
    )
    # Where short, the muscle that pulls the right way pulls its best.
    full = np.isclose(result.force_optimal, result.force_max, rtol=1e-6).any(axis=1)
    assert full[short].all()


def watch_saturated(model, look):
    """A run beyond the muscles' reach; `look` gets the plugin, its state, the factors and the rows
    of every saturated Newton matrix."""
    violent = em.Motion.from_waypoints(
        np.array([0, 1 / 3, 2 / 3, 1]) * 0.5, np.radians([180.0, 120.0, 240.0, 180.0])
    )
    plugin = em.CosimulationPlugin(
        model, violent, em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    )
    jacobian = plugin._scheme.jacobian

    def watched(state, exact, *factors):
        before = state.recruited
        found = jacobian(state, exact, *factors)
        assert state.recruited is before
        if before is not None and before.recruitment.unmet.any():
            look(plugin, state, factors, found)
        return found

    plugin._scheme.jacobian = watched
    model.skeleton.set_initial_state(*violent(0.0)[:2])
    with pytest.warns(em.UnmetTorqueWarning):
        plugin_run(model, plugin, run_settings(end=0.5))


@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
def test_a_saturated_newton_matrix_leaves_the_recruitment_alone(model):
    """Differences recruit at other states; what is recorded is the accepted one's."""
    seen = []
    watch_saturated(model, lambda *of: seen.append(of))
    assert len(seen) > 5


@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
def test_a_saturated_newton_matrix_is_the_slope_of_the_residual(model):
    """Towards q and q' alike, as which Exudyn's factors have them move."""
    matrices = []

    def look(plugin, state, factors, found):
        skeleton, t = plugin.skeleton, model.mbs.systemData.GetTime()
        q, v, a = (x.copy() for x in (skeleton.q, skeleton.v, skeleton.acceleration))

        def residual(q, v):
            there = skeleton.dynamics_at(q, v, t)
            served = plugin._scheme.serve(state, state.tracking.demand(t, there), there)
            return there.M @ a + there.bias - served.recruitment.torque

        mass, dq, dv = factors
        by_q = -dq * gradient(lambda x: residual(x, v), q, 1e-6)
        by_v = -dv * gradient(lambda x: residual(q, x), v, 1e-4)
        matrices.append(np.array([found, mass * state.here.M, by_q, by_v])[:, 0, 0])

    watch_saturated(model, look)
    found, *parts = np.array(matrices).T
    np.testing.assert_allclose(found, sum(parts), rtol=1e-6)
    assert (np.abs(parts[1:]) > 1e-3 * found).all()


def test_out_of_reach_can_be_an_error(model):
    violent = em.Motion.from_waypoints(
        np.array([0, 1 / 3, 2 / 3, 1]) * 0.5, np.radians([180.0, 120.0, 240.0, 180.0])
    )
    with pytest.raises(em.UnmetTorqueError, match=r"t = 0\.\d+ s, short by {'theta'") as caught:
        run(model, violent, raise_on_unmet_torque=True)
    assert caught.value.trajectory.max_unmet_torque == 0.0


@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
@pytest.mark.parametrize("run", [em.static_optimization, em.computed_muscle_control, em.cosimulate])
def test_a_start_out_of_reach(model, run):
    """Ten times the torque that the muscles can deliver, from the very first instant."""
    times = np.linspace(0.0, 0.05, 11)
    motion = em.Motion.from_samples(times, np.pi + 5000.0 * times[:, None] ** 2)
    with pytest.warns(em.UnmetTorqueWarning, match="theta: .* short at the start"):
        result = run(model, motion)
    Q_m = result.torques_delivered[0] + result.start_unmet
    M, bias = (x.item() for x in dynamics(model, *motion(0.0)[:2]))
    assert Q_m[0] == pytest.approx(M * motion(0.0)[2][0] + bias, rel=1e-9)
    assert abs(result.start_unmet[0]) > 0.5 * abs(Q_m[0])
    settings = {
        em.static_optimization: em.StaticSettings,
        em.computed_muscle_control: em.CMCSettings,
        em.cosimulate: em.CosimulationSettings,
    }[run]
    with pytest.raises(em.UnmetTorqueError, match=r"t = 0 s, short by {'theta'"):
        run(model, motion, settings=settings(raise_on_unmet_torque=True))


def dynamics(model, q, v):
    with model.skeleton.opened() as skeleton:
        return skeleton.dynamics_at(q, v, 0.0)[:2]


def test_only_accepted_steps_count_as_out_of_reach(model):
    """Exudyn's predictor asks for more than the step: the literal scheme meets that only there."""
    motion = em.Motion.from_waypoints(
        np.array([0, 1 / 3, 2 / 3, 1]) * 0.8, np.radians([180.0, 120.0, 240.0, 180.0])
    )
    result = run(model, motion, first_iterate=em.FirstIterate.RECRUIT, raise_on_unmet_torque=True)
    assert result.status is em.Status.COMPLETE
    assert result.max_unmet_torque == 0.0


def test_a_reserve_takes_over_where_the_muscles_end():
    weak = pendulum.build()
    model = em.MusculoskeletalModel(
        weak.mbs,
        0,
        list(weak.muscles),
        coordinates=["theta"],
        reserves=[em.Reserve("theta", optimal_force=1.0)],
    )
    violent = em.Motion.from_waypoints(
        np.array([0, 1 / 3, 2 / 3, 1]) * 0.5, np.radians([180.0, 120.0, 240.0, 180.0])
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = run(model, violent)
    assert result.max_unmet_torque == 0.0
    assert np.abs(result.reserves).max() > 10.0
    assert rms_deg(result)[0] < 0.2
    muscles = np.einsum(
        "tij,ti->tj",
        np.array([model.geometry(q, q).moment_arms for q in result.coordinates]),
        result.tendon_forces,
    )
    np.testing.assert_allclose(
        muscles + result.reserves, result.torques_delivered, rtol=0, atol=1e-5
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kp": -1.0}, "kp = -1.0 1/s.2 is outside"),
        ({"kp": np.nan}, "kp = nan"),
        ({"kp": "100"}, "kp = '100'"),
        ({"step": "0.01"}, "step = '0.01'"),
        ({"kp": True}, "kp = True"),
        ({"kv": -2.0}, "kv = -2.0"),
        ({"step": 0.0}, "step = 0.0 s is outside"),
        ({"scheme": "full"}, "scheme = 'full' is not a Scheme"),
        ({"solver": "daqp"}, "solver = 'daqp'"),
        ({"window_tolerance": 0.0}, "tolerance = 0.0 is outside"),
        ({"predictor": 1}, "predictor = 1"),
        (
            {"predictor": EXTRAPOLATED},
            "predictor = .* does nothing with scheme = Scheme.CONSISTENT",
        ),
        (
            {"scheme": SIMPLIFIED, "first_iterate": em.FirstIterate.RECRUIT},
            "first_iterate = .* does nothing with scheme = Scheme.SIMPLIFIED",
        ),
    ],
)
def test_bad_settings_are_named(options, message):
    with pytest.raises(em.ParameterError, match=message):
        em.CosimulationSettings(**options)


@pytest.mark.parametrize("make", [em.CosimulationPlugin, em.CMCPlugin])
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"weights": {"toe": 2.0}}, "weights of 'toe': the muscles are "),
        ({"control_limits": {"toe": em.ControlLimits(0.0, 0.5)}}, "control limits of 'toe'"),
        ({"kp": [1.0, 2.0]}, "kp has 2 values for the 1 coordinates theta"),
    ],
)
def test_settings_meet_the_model_before_anything_runs(model, motion, make, options, message):
    kinds = {em.CosimulationPlugin: em.CosimulationSettings, em.CMCPlugin: em.CMCSettings}
    with pytest.raises(em.ParameterError, match=message):
        make(model, motion, kinds[make](**options))


def test_a_step_longer_than_the_motion(model):
    short = em.Motion.from_waypoints([0.0, 0.005], [np.pi, np.pi])
    with pytest.raises(em.ParameterError, match=r"step = 0\.01 s is longer than the span"):
        run(model, short)


@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
def test_the_report_names_the_muscles_that_could_do_no_more():
    """Each of a coordinate's own: no elbow muscle for the shoulder, no extensor for a flexion."""
    arm = planar_arm.build()
    weak = [
        dataclasses.replace(muscle, max_isometric_force=0.05 * muscle.max_isometric_force)
        for muscle in arm.muscles
    ]
    model = em.MusculoskeletalModel(arm.mbs, 0, weak, coordinates=["shoulder", "elbow"])
    with pytest.warns(em.UnmetTorqueWarning):
        result = em.cosimulate(
            model,
            planar_arm.motion(),
            settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP),
        )
    shoulder, elbow = result.saturated
    assert shoulder == ("shoulder_flexor", "biarticular_flexor")
    assert elbow == ("elbow_flexor", "biarticular_flexor")
    report = result.unmet_torque_report()
    assert "where shoulder_flexor, biarticular_flexor pulled at most" in report


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.1])
def test_a_joint_that_no_muscle_crosses_changes_nothing(turn):
    """The pendulum behind a joint across its plane, on a base turned by any angle: arms of 1e-18 m
    on that joint are none."""
    R = rigid.RotationMatrixY(turn)
    mbs = exu.SystemContainer().AddSystem()
    still = RigidBodyInertia(mass=0.1, inertiaTensor=1e-3 * np.eye(3), com=[0, 0, 0])
    bar = RigidBodyInertia(mass=1.0, inertiaTensor=np.diag([0.25, 1e-3, 0.25]), com=[0, -0.5, 0])
    joints = [(exu.JointType.RevoluteX, R, still), (exu.JointType.RevoluteZ, np.eye(3), bar)]
    links = [
        TreeLink(jointType=kind, parent=k - 1, jointHT=HomogeneousTransformation(T, [0, 0, 0]),
                 linkInertia=inertia)
        for k, (kind, T, inertia) in enumerate(joints)
    ]  # fmt: skip
    tree = mbs.CreateKinematicTree(listOfTreeLinks=links, gravity=[0, -9.81, 0])
    mbs.Assemble()
    size = {"max_isometric_force": 3e3, "optimal_fiber_length": 0.15, "tendon_slack_length": 0.16}
    muscles = [
        em.Muscle(name, **size, path=[
            em.PathPoint(R @ [side * 0.05, 0, 0]), em.PathPoint([0, -0.3, 0], link=1)
        ])
        for name, side in (("left", -1.0), ("right", 1.0))
    ]  # fmt: skip
    model = em.MusculoskeletalModel(mbs, tree, muscles)
    swing = np.column_stack([np.zeros(4), np.radians([180, 120, 240, 180])])
    motion = em.Motion.from_waypoints([0, 1 / 3, 2 / 3, 1], swing)
    result = em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    )
    assert result.max_unmet_torque == 0.0
    assert rms_deg(result)[1] == pytest.approx(0.0186, abs=1e-4)
