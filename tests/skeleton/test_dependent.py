"""Coordinates that follow others: against Lagrange's equations in the independent ones."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.itemInterface import (
    LoadCoordinate,
    MarkerNodeCoordinate,
    NodePoint,
    NodePointGround,
    ObjectConnectorCoordinateSpringDamper,
    ObjectMassPoint,
)
from exudyn.utilities import TreeLink
from scipy.integrate import solve_ivp

import exudyn_muscles as em
from exudyn_muscles.skeleton.opened import Opened

from .. import leg
from ..differences import difference, gradient
from ..runs import KP, TRAPEZOIDAL, csf, plugin_run, settings, start_at

GENERALIZED_ALPHA = exu.DynamicSolverType.GeneralizedAlpha
START = np.array([0.5, -0.6]), np.array([1.0, -2.0])
FREE = [leg.NAMES.index(name) for name in ("hip", "knee")]


@pytest.fixture(scope="module")
def model():
    return leg.build()


@pytest.fixture(scope="module")
def runs(model):
    motion = leg.motion()
    settings = {scheme: em.CosimulationSettings(kp=KP, scheme=scheme) for scheme in em.Scheme}
    return {
        "static": em.static_optimization(model, motion),
        "cmc": em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP)),
        **{x.value: em.cosimulate(model, motion, settings=settings[x]) for x in em.Scheme},
    }


def watch(model, residual):
    """Have the mbs append |q - q(z)|, |q' - ...|, |q'' - ...| after every accepted step."""
    tied = [j for j in range(len(leg.NAMES)) if j not in FREE]

    def look(mbs, t):
        s = model.skeleton
        exact = model.state_of_tree(s.q, s.v, s.acceleration)
        data = mbs.systemData
        now = data.GetODE2Coordinates(), data.GetODE2Coordinates_t(), data.GetODE2Coordinates_tt()
        now = [array[s.rows] for array in now]
        residual.append([abs(x[tied] - y[tied]).max() for x, y in zip(now, exact, strict=True)])
        return True

    model.mbs.SetPostStepUserFunction(look)


def fall(step, solver=TRAPEZOIDAL, end=1.0, **build):
    """The leg without muscles under its weight, from START; q and q' at the end, and the run."""
    model = leg.build([leg.idle()], **build)
    model.skeleton.set_initial_state(*START)
    excitations = em.Excitations(np.array([0.0, end]), np.array([[0.5]]))
    residual = []
    watch(model, residual)
    plugin = em.ForwardPlugin(model, excitations)
    result = plugin_run(model, plugin, settings(step, end), solver)
    # The state before the run's first step was not yet put in order when `look` saw it.
    return np.r_[result.coordinates[-1], result.speeds[-1]], result, np.array(residual[1:])


def fallen(end=1.0):
    """Reference for `fall`."""

    def rate(_, y):
        M, bias = leg.equations(y[:2], y[2:])
        return np.r_[y[2:], np.linalg.solve(M, -bias)]

    return solve_ivp(rate, (0.0, end), np.r_[START], "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


pytestmark = pytest.mark.filterwarnings("ignore::exudyn_muscles.PathWarning")


def test_names(model):
    assert model.coordinates == ("hip", "knee")
    assert model.skeleton.tree_coordinates == leg.NAMES
    assert model.skeleton.units == ("rad", "rad")
    assert len(model.skeleton) == 2 and model.skeleton.others == 0


def test_the_equations_of_motion(model):
    rng = np.random.default_rng(1)
    skeleton = model.skeleton
    with skeleton.opened():
        for _ in range(10):
            z, v = rng.uniform([-1.0, -2.0], [1.0, 0.3]), rng.uniform(-5.0, 5.0, 2)
            M, bias = skeleton.dynamics_at(z, v, 0.0)[:2]
            M_z, bias_z = leg.equations(z, v)
            np.testing.assert_allclose(M, M_z, rtol=0, atol=5e-14)
            np.testing.assert_allclose(bias, bias_z, rtol=0, atol=1e-12)


def test_user_torques_springs_and_loads_on_dependent_coordinates_are_part_of_Q():
    def extend(mbs, tree):
        node = mbs.GetObject(tree)["nodeNumber"]
        ground = mbs.AddMarker(
            MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0)
        )
        knee_x, ankle = (
            mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=j)) for j in (1, 4)
        )
        mbs.AddObject(
            ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[ground, knee_x], stiffness=300.0, damping=20.0
            )
        )
        mbs.AddLoad(LoadCoordinate(markerNumber=ankle, load=3.0))

    torque = [1.0, 2.0, -3.0, 4.0, 5.0, -6.0]
    skeleton = leg.build(extend=extend, jointForceVector=torque).skeleton
    with skeleton.opened():
        z, v = np.array([0.3, -0.7]), np.array([2.0, -3.0])
        for muscles in ([0.0, 0.0], [7.0, -5.0]):  # whatever the muscles do
            skeleton.apply(np.array(muscles))
            _, bias = skeleton.dynamics_at(z, v, 0.0)[:2]
            R = gradient(leg.tree_coordinates, z, 1e-3)
            q, q_t = leg.tree_coordinates(z), R @ v
            Q = np.array(torque)
            Q[1] -= 300.0 * q[1] + 20.0 * q_t[1]
            Q[4] += 3.0
            np.testing.assert_allclose(bias, leg.equations(z, v)[1] - R.T @ Q, rtol=0, atol=1e-10)
    assert skeleton.mbs.GetObjectParameter(skeleton.object, "jointForceVector").tolist() == torque


def test_moment_arms(model):
    """r_z = -dl/dz and l' = -r_z z', also of points that move with a dependent coordinate."""
    curve = em.simm_spline([-0.1, 0.0, 0.1, 0.2], [0.05, 0.04, 0.06, 0.05])
    path = [
        em.PathPoint([0.05, -0.1, 0.0], link=0),
        em.MovingPathPoint(curve, 0.02, 0.0, link=2, coordinate="knee_x"),
        em.PathPoint([0.04, -0.07, 0.0], link=3),
    ]
    muscle = em.Muscle("moved", **leg.HALF, tendon_slack_length=0.2, path=path)
    for geometry in (model.geometry, leg.build([muscle]).geometry):
        z, v = np.array([0.3, -0.7]), np.array([2.0, -3.0])
        length, speed, r, _ = geometry(z, v)
        slopes = gradient(lambda x, g=geometry: g(x, 0.0 * x).length, z, 1e-3)
        np.testing.assert_allclose(r, -slopes, rtol=0, atol=1e-9)
        np.testing.assert_allclose(speed, -r @ v, rtol=0, atol=1e-14)
        assert r.shape == (length.size, 2)


def test_values_of_all_coordinates(model):
    z, v, a = np.random.default_rng(2).uniform(-1.0, 0.3, (3, 5, 2))
    q, q_t, q_tt = model.state_of_tree(z, v, a)
    for k in range(5):
        np.testing.assert_allclose(q[k], leg.tree_coordinates(z[k]), rtol=0, atol=1e-13)

        def course(s, k=k):
            return leg.tree_coordinates(z[k] + s * v[k] + 0.5 * s * s * a[k])

        first = difference(course, 0.0, 1e-3)
        second = difference(lambda s, f=course: difference(f, s, 1e-3), 0.0, 1e-3)
        np.testing.assert_allclose(q_t[k], first, rtol=0, atol=1e-10)
        np.testing.assert_allclose(q_tt[k], second, rtol=0, atol=1e-8)
    (one,) = model.state_of_tree(z[0])
    np.testing.assert_array_equal(one, q[0])


@pytest.mark.parametrize("solver", [TRAPEZOIDAL, GENERALIZED_ALPHA])
def test_free_motion(solver):
    reference = fallen()
    moment = 0.0 if solver is TRAPEZOIDAL else 1e-9
    errors = []
    for step in (0.01, 0.005, 0.0025):
        state, result, residual = fall(step, solver, toes_moment=moment)
        errors.append(abs(state - reference).max())
        assert residual.max() < 1e-12
        assert result.counts.rejected_steps == 0
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 1.9).all() and errors[-1] < 3e-3, (errors, orders)


def test_generalized_alpha_cannot_start_with_a_singular_mass_matrix():
    with pytest.raises(em.ParameterError, match=r"mass matrix is singular.*TrapezoidalIndex2"):
        fall(0.01, GENERALIZED_ALPHA)


def test_newtons_matrix_has_what_follows_follow(model):
    """Its solutions are dq = R dz, of which the rows of z are the ones that were wanted."""
    skeleton, n = model.skeleton, len(leg.NAMES)
    tied = [j for j in range(n) if j not in FREE]
    wanted = np.random.default_rng(2).normal(size=(2, n))
    with skeleton.opened():
        z = skeleton.q.copy()
        R = gradient(lambda x: skeleton.state_of_tree(x)[0], z, 1e-4)
        rows = skeleton.all_rows(wanted)
    assert (rows[FREE] == wanted).all()
    assert (rows[np.ix_(tied, tied)] == np.eye(n - 2)).all()
    assert abs(R[tied]).max() > 0.1
    np.testing.assert_allclose(rows[tied] @ R, 0.0, rtol=0, atol=1e-8)


def test_free_motion_is_that_of_the_trapezoidal_rule_in_z():
    """Exudyn's scheme for M_z z'' = Q_z - H_z, solved to rounding."""
    h, n = 0.01, 50
    z, v = START
    M, bias = leg.equations(z, v)
    a = np.linalg.solve(M, -bias)
    for _ in range(n):
        next_a = a
        for _ in range(60):
            next_z, next_v = z + h * v + 0.25 * h * h * (a + next_a), v + 0.5 * h * (a + next_a)
            M, bias = leg.equations(next_z, next_v)
            next_a = np.linalg.solve(M, -bias)
        z, v, a = next_z, next_v, next_a
    state, _, _ = fall(h, end=n * h)
    np.testing.assert_allclose(state, np.r_[z, v], rtol=0, atol=1e-7)


def test_energy_is_kept_to_second_order():
    drift = []
    for step in (0.01, 0.005):
        _, result, _ = fall(step)
        energies = [leg.energy(*x) for x in zip(result.coordinates, result.speeds, strict=True)]
        drift.append(np.ptp(energies))
    assert drift[1] < 0.01 and 3.5 < drift[0] / drift[1] < 4.5, drift


def test_the_constraint_holds_after_every_accepted_step(model, runs):
    residual = []
    motion = leg.motion()
    start_at(model, motion)
    watch(model, residual)
    try:
        plugin_run(model, csf(model, motion), settings())
    finally:
        model.mbs.SetPostStepUserFunction(0)
    assert len(residual) == 101
    assert np.max(residual[1:]) < 1e-12


def test_static_optimization(runs):
    result, motion = runs["static"], leg.motion()
    assert result.max_unmet_torque == 0.0
    for t, Q in zip(result.window_time[1:], result.torques_demanded, strict=True):
        q, v, a = motion(t)
        M, bias = leg.equations(q, v)
        np.testing.assert_allclose(Q, M @ a + bias, rtol=0, atol=1e-10)


def ordinary():
    """Hip and knee of the same leg with a fixed knee axis and ankle."""
    links = leg.links()
    tree_links = [
        TreeLink(
            jointType=links[k].jointType, parent=parent, linkInertia=links[k].linkInertia,
            jointHT=leg.HTtranslate([*at, 0.0]),
        )
        for k, parent, at in ((0, -1, (0.0, 0.0)), (3, 0, leg.HIP_TO_KNEE))
    ]  # fmt: skip
    mbs = exu.SystemContainer().AddSystem()
    tree = mbs.CreateKinematicTree(listOfTreeLinks=tree_links, gravity=[*leg.GRAVITY, 0.0])
    mbs.Assemble()
    muscles = [
        em.Muscle(
            name, **leg.HALF, tendon_slack_length=slack,
            path=[em.PathPoint([x, y, 0.0], link={3: 1}.get(link, link)) for link, x, y in path],
        )
        for name, (slack, path) in leg.MUSCLES.items()
        if name != "calf"
    ]  # fmt: skip
    return em.MusculoskeletalModel(mbs, tree, muscles)


def test_tracking_is_that_of_an_ordinary_tree(runs):
    """With the demand met the tracking error of CSF and CSS does not depend on the mechanism."""
    model, motion = ordinary(), leg.motion()
    csf, css = (runs[name].tracking_errors() for name in ("csf", "css"))
    other = {
        scheme: em.cosimulate(model, motion, settings=em.CosimulationSettings(kp=KP, scheme=scheme))
        for scheme in em.Scheme
    }
    assert all(run.max_unmet_torque == 0.0 for run in [*runs.values(), *other.values()])
    np.testing.assert_allclose(csf, other[em.Scheme.FULL].tracking_errors(), rtol=0, atol=1e-13)
    assert np.degrees(runs["csf"].tracking_error_rms()).max() < 0.01
    # Of CSS only to the order of its error.
    ratio = runs["css"].tracking_error_rms() / other[em.Scheme.SIMPLIFIED].tracking_error_rms()
    assert (abs(np.log(ratio)) < 0.003).all()
    assert np.degrees(runs["cmc"].tracking_error_rms()).max() < 0.01


def test_counts_of_csf(runs):
    counts = runs["csf"].counts
    assert counts.recruitments == counts.steps + 1
    assert counts.newton_iterations == counts.steps
    assert counts.rejected_steps == 0


def test_csf_with_the_papers_first_iterate(model, runs):
    settings = em.CosimulationSettings(
        scheme=em.Scheme.FULL, kp=KP, first_iterate=em.FirstIterate.RECRUIT
    )
    result = em.cosimulate(model, leg.motion(), settings=settings)
    np.testing.assert_allclose(result.coordinates, runs["csf"].coordinates, rtol=0, atol=1e-9)


@pytest.mark.filterwarnings("ignore::exudyn_muscles.TrackingWarning")
def test_csf_tracks_beyond_the_muscles_reach():
    """The saturated Newton matrix, too, is that of the independent coordinates."""
    muscles = leg.build().muscles
    weak = [
        em.Muscle(m.name, max_isometric_force=0.05 * m.max_isometric_force, path=m.path,
                  optimal_fiber_length=m.optimal_fiber_length,
                  tendon_slack_length=m.tendon_slack_length)
        for m in muscles
    ]  # fmt: skip
    model = leg.build(weak)
    with pytest.warns(em.UnmetTorqueWarning, match="hip|knee"):
        result = em.cosimulate(
            model, leg.motion(), settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
        )
    assert result.status is em.Status.LOST and result.time[-1] == pytest.approx(leg.motion().end)
    assert result.counts.newton_iterations < 6 * result.counts.steps


def test_replay(model, runs):
    replay = em.forward_dynamics(model, runs["cmc"].excitations)
    np.testing.assert_allclose(replay.coordinates, runs["cmc"].coordinates, rtol=0, atol=1e-9)


def test_delivered_torques_balance(runs):
    """Of Exudyn's own accepted states."""
    for name in ("cmc", "csf"):
        result = runs[name]
        for k in range(0, len(result.time), 7):
            M, bias = leg.equations(result.coordinates[k], result.speeds[k])
            lack = M @ result.accelerations[k] + bias - result.torques_delivered[k]
            assert abs(lack).max() < 1e-6


@pytest.mark.parametrize("scheme", em.Scheme)
def test_rejected_steps_leave_no_trace(scheme):
    motion = leg.motion()

    def run(reject):
        model = leg.build()
        start_at(model, motion)
        residual = []
        watch(model, residual)
        if reject:
            tried = []

            def refuse(mbs, t):
                tried.append(t)
                return [10.0, 0.005] if len(tried) in (4, 30) else [0.0, -1.0]

            model.mbs.SetPostNewtonUserFunction(refuse)
        options = settings(0.005)
        options.timeIntegration.adaptiveStepRecoverySteps = 1
        result = plugin_run(model, csf(model, motion, scheme=scheme), options)
        assert np.max(residual[1:]) < 1e-12
        return result

    def run_halved(h):
        model = leg.build()
        start_at(model, motion)
        return plugin_run(model, csf(model, motion, scheme=scheme), settings(h))

    disturbed, smooth, coarse = run(True), run(False), run_halved(0.01)
    assert disturbed.counts.rejected_steps == 2
    at = np.isin(np.round(disturbed.time, 9), np.round(smooth.time, 9))
    shared = np.isin(np.round(smooth.time, 9), np.round(disturbed.time, 9))
    gap = abs(disturbed.coordinates[at] - smooth.coordinates[shared]).max()
    size = abs(coarse.coordinates - smooth.coordinates[::2]).max()
    assert gap < size


def test_other_bodies_and_a_singular_mass_matrix():
    """A body on a spring at the knee, before the tree: also its initial acceleration is right."""

    def build(moment):
        mbs = exu.SystemContainer().AddSystem()
        node = mbs.AddNode(NodePoint(initialCoordinates=[0.02, 0.0, 0.0]))
        mbs.AddObject(ObjectMassPoint(mass=2.0, nodeNumber=node))
        tree = mbs.CreateKinematicTree(listOfTreeLinks=leg.links(moment), gravity=[0.4, -9.81, 0.0])
        markers = [
            mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=number, coordinate=j))
            for number, j in ((node, 0), (mbs.GetObject(tree)["nodeNumber"], 1))
        ]
        mbs.AddObject(ObjectConnectorCoordinateSpringDamper(markerNumbers=markers, stiffness=500.0))
        mbs.Assemble()
        model = em.MusculoskeletalModel(
            mbs,
            tree,
            [leg.idle()],
            coordinates=leg.NAMES,
            dependent_coordinates=leg.dependent_coordinates(),
        )
        model.skeleton.set_initial_state(*START)
        return model

    def run(step, moment):
        model = build(moment)
        excitations = em.Excitations(np.array([0.0, 0.5]), np.array([[0.5]]))
        seen = []
        plugin = em.ForwardPlugin(model, excitations)
        data = model.mbs.systemData
        model.mbs.SetPreStepUserFunction(
            lambda mbs, t: seen.append(data.GetODE2Coordinates_tt()[0]) is None
        )
        result = plugin_run(model, plugin, settings(step, 0.5))
        return np.r_[result.coordinates[-1], data.GetODE2Coordinates()[0]], seen[0]

    def rate(_, y):
        z, v, x = y[:2], y[2:4], y[4]
        M, bias = leg.equations(z, v)
        force = 500.0 * (leg.KNEE_X(z[1]) - x)
        Q = np.array([0.0, -force * leg.KNEE_X.deriv()(z[1])])
        return np.r_[v, np.linalg.solve(M, Q - bias), y[5], force / 2.0]

    start = np.r_[*START, 0.02, 0.0]
    reference = solve_ivp(rate, (0.0, 0.5), start, "DOP853", rtol=1e-11, atol=1e-12).y[
        [0, 1, 4], -1
    ]
    errors = []
    for step in (0.004, 0.002):
        state, first = run(step, 0.0)
        assert first == pytest.approx(rate(0.0, start)[5], rel=1e-12)
        errors.append(abs(state - reference).max())
    assert 3.6 < errors[0] / errors[1] < 4.4, errors


def test_the_mbs_is_left_as_it_was(model):
    data = model.mbs.systemData
    initial = exu.ConfigurationType.Initial
    before = [0.1, 0.7, 0.7, -0.3, 0.7, 0.7]  # dependent ones anywhere
    data.SetODE2Coordinates(before, configuration=initial)
    motion = leg.motion()
    try:
        em.static_optimization(model, motion)
        em.cosimulate(model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP))
        plugin_run(model, csf(model, motion), settings(end=0.02))
        assert data.GetODE2Coordinates(configuration=initial).tolist() == before
        options = settings(end=0.02)
        with csf(model, motion).attached():
            model.mbs.SolveDynamic(options, solverType=TRAPEZOIDAL, updateInitialValues=True)
        kept = data.GetODE2Coordinates(configuration=initial)
        expected = leg.tree_coordinates(np.array(kept)[FREE])
        np.testing.assert_allclose(kept, expected, rtol=0, atol=1e-13)
    finally:
        model.skeleton.set_initial_arrays(np.zeros(6), np.zeros(6))


def test_pictures_show_dependent_coordinates(model, runs):
    result = runs["csf"]
    data = em.view.solution(result, model)["data"]
    np.testing.assert_array_equal(data[:, 1:7], model.state_of_tree(result.coordinates)[0])


def test_a_picture(model, runs, tmp_path):
    file = tmp_path / "leg.png"
    em.view.render(model, runs["csf"], 0.5, file, size=(80, 60))
    assert file.stat().st_size > 0


def test_locked_and_linear():
    line = em.linear_function(-0.4, 0.1)
    x = np.array([-3.0, -0.2, 0.0, 0.6, 1.0, 8.0])
    np.testing.assert_allclose(line(x), 0.1 - 0.4 * x, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(line.derivative(x), -0.4)
    assert em.linear_function(0.0, 0.3)(5.0) == 0.3


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ([("heel", "knee")], r"'heel' of 'knee': the tree has no coordinate 'heel', only hip"),
        ([("ankle", "heel")], r"'ankle' of 'heel': the tree has no coordinate 'heel', only hip"),
        ([("ankle", "knee"), ("ankle", "hip")], "'ankle' depends on more than one"),
        ([("ankle", "ankle")], "in a circle: ankle, ankle"),
        ([("toes", "ankle"), ("ankle", "toes")], "in a circle: toes, ankle, toes"),
    ],
)
def test_bad_dependent_coordinates(pairs, message):
    given = [
        em.DependentCoordinate(name, of=of, function=em.linear_function(1.0)) for name, of in pairs
    ]
    model = leg.build()
    with pytest.raises(em.ParameterError, match=message):
        em.MusculoskeletalModel(
            model.mbs,
            model.skeleton.object,
            model.muscles,
            coordinates=leg.NAMES,
            dependent_coordinates=given,
        )


def test_bad_arguments(model):
    with pytest.raises(
        em.ParameterError, match=r"dependent coordinate 'a': its function is a Curve.*got 0.5"
    ):
        em.DependentCoordinate("a", of="b", function=0.5)
    with pytest.raises(em.ParameterError, match="slope and intercept are finite, got nan"):
        em.linear_function(np.nan)
    with pytest.raises(
        em.ParameterError, match="dependent_coordinates must be a list of Dependent"
    ):
        em.MusculoskeletalModel(
            model.mbs, model.skeleton.object, model.muscles, dependent_coordinates=["ankle"]
        )
    motion = em.Motion.from_waypoints([0.0, 1.0], np.zeros((2, 6)))
    with pytest.raises(em.MotionError, match="6 coordinates, the model 2: hip, knee"):
        em.static_optimization(model, motion)
    with pytest.raises(em.ParameterError, match=r"reserve on 'toe': the coordinates are .*ankle"):
        em.MusculoskeletalModel(
            model.mbs, model.skeleton.object, model.muscles, coordinates=leg.NAMES,
            dependent_coordinates=leg.dependent_coordinates(), reserves=[em.Reserve("toe", 1.0)],
        )  # fmt: skip


def test_former_names(model):
    with pytest.warns(DeprecationWarning, match="Follower is now DependentCoordinate") as warned:
        old = em.Follower("toes", of="ankle", function=em.linear_function(0.2))
    assert warned[0].filename == __file__
    assert isinstance(old, em.DependentCoordinate)
    given = [old, *leg.dependent_coordinates()[1:]]
    with pytest.warns(DeprecationWarning, match="followers= is now dependent_coordinates="):
        built = em.MusculoskeletalModel(
            model.mbs, model.skeleton.object, model.muscles, coordinates=leg.NAMES, followers=given
        )
    assert built.coordinates == model.coordinates
    with pytest.warns(DeprecationWarning, match=r"model.dependent_coordinates"):
        assert built.followers == built.dependent_coordinates == tuple(given)


def test_reactions_are_of_the_equations_that_the_torque_is_of(model, monkeypatch):
    """CSF assembles M and H - Q once in an iteration, not for the reactions once more."""
    assemblies = []
    dynamics = Opened.dynamics

    def counted(self):
        assemblies.append(1)
        return dynamics(self)

    monkeypatch.setattr(Opened, "dynamics", counted)
    motion = leg.motion().between(0.0, 0.2)
    counts = em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    ).counts
    # Besides them and the predictors of all steps: those of the start.
    assert len(assemblies) <= counts.newton_iterations + counts.steps + 8
