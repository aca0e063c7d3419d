"""All methods on systems of bodies and joints, beside trees, and with what is passive in them."""

from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import InertiaCuboid, MarkerBodyRigid, MarkerKinematicTreeRigid

import exudyn_muscles as em
from models import pendulum, planar_arm

from ...runs import plugin_run, settings
from .convert import EULER, TAIT_BRYAN, VECTOR, as_bodies
from .models import MOTION, PASSIVE, Arm, spring_hand, wobbling_mass

METHODS = {
    "csf": lambda model, motion, **of: em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, **of)
    ),
    "css": lambda model, motion, **of: em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.SIMPLIFIED, **of)
    ),
    "cmc": lambda model, motion, **of: em.computed_muscle_control(
        model, motion, settings=em.CMCSettings(**of)
    ),
    "static": lambda model, motion, **of: em.static_optimization(
        model, motion, settings=em.StaticSettings(**of)
    ),
}


def order(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize("source", [pendulum, planar_arm])
@pytest.mark.parametrize("node_type", [EULER, TAIT_BRYAN, VECTOR])
def test_equations_of_a_tree_built_of_bodies(source, node_type):
    tree, bodies = source.build(), as_bodies(source.build(), node_type)
    q, v, _ = source.motion()(0.3)
    found = []
    for model in (tree, bodies):
        with model.skeleton.opened():
            M, bias, place = model.skeleton.dynamics_at(q, v, 0.0)
        found.append((M, bias, *model.geometry(*place)[:3]))
    for of_tree, of_bodies in zip(*found, strict=True):
        scale = max(1.0, np.abs(of_tree).max())
        np.testing.assert_allclose(of_bodies, of_tree, rtol=0, atol=1e-10 * scale)


@pytest.mark.parametrize("source", [pendulum, planar_arm])
@pytest.mark.parametrize("method", ["csf", "css"])
def test_a_tree_built_of_bodies_runs_as_the_tree(source, method):
    """To the difference of the discretisations, which falls with the square of the step."""
    steps, apart = [0.02, 0.01, 0.005], []
    for step in steps:
        of_tree, of_bodies = (
            METHODS[method](model, source.motion(), step=step)
            for model in (source.build(), as_bodies(source.build()))
        )
        apart.append(np.abs(of_tree.coordinates - of_bodies.coordinates).max())
    assert order(steps, apart) == pytest.approx(2.0, abs=0.25)
    assert apart[1] < 1e-3


def test_static_optimization_is_the_same_for_both_forms():
    one, other = (
        METHODS["static"](model, planar_arm.motion())
        for model in (planar_arm.build(), as_bodies(planar_arm.build()))
    )
    for name in ("tendon_forces", "activations", "excitation_values", "torques_demanded"):
        found, expected = getattr(other, name), getattr(one, name)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def test_computed_muscle_control_and_replay():
    of_tree, of_bodies = (
        METHODS["cmc"](model, planar_arm.motion())
        for model in (planar_arm.build(), as_bodies(planar_arm.build()))
    )
    np.testing.assert_allclose(of_tree.coordinates, of_bodies.coordinates, rtol=0, atol=2e-5)
    again = em.forward_dynamics(as_bodies(planar_arm.build()), of_bodies.excitations)
    np.testing.assert_allclose(again.coordinates, of_bodies.coordinates, rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def errors_of_the_tree():
    """RMS errors of the paper's pendulum by steps [rad]."""
    return {step: _error_of_the_pendulum(pendulum.build(), step) for step in (0.01, 0.005, 0.0025)}


def _error_of_the_pendulum(model, step, **settings):
    run = METHODS["csf"](model, pendulum.motion(), kp=534.0, step=step, **settings)
    return run.tracking_error_rms()[0]


@pytest.mark.parametrize("node_type", [TAIT_BRYAN, VECTOR])
def test_the_papers_table_of_the_pendulum(errors_of_the_tree, node_type):
    """About one axis these coordinates are the angle itself, to which the tree has the trapezoidal
    rule applied as well: the same error at every step."""
    for step, of_tree in errors_of_the_tree.items():
        error = _error_of_the_pendulum(as_bodies(pendulum.build(), node_type), step)
        assert error == pytest.approx(of_tree, rel=1e-4)


def test_the_papers_table_with_euler_parameters(errors_of_the_tree):
    """The rule goes along chords of the circle on which they are: order 2 with another constant, 15
    % less at every step. On the angle itself, by the projection, it is the tree's but for what
    higher orders differ."""
    away = []
    for step, of_tree in errors_of_the_tree.items():
        plain, projected = (
            _error_of_the_pendulum(as_bodies(pendulum.build()), step, project_constraints=on)
            for on in (False, True)
        )
        assert plain == pytest.approx(0.85 * of_tree, rel=0.01)
        away.append(abs(projected / of_tree - 1.0))
    assert away[0] < 0.03 and away[1] < 0.02
    assert order(list(errors_of_the_tree), away) > 0.9


@pytest.mark.parametrize("passive", list(PASSIVE))
@pytest.mark.parametrize("method", list(METHODS))
@pytest.mark.filterwarnings("ignore::exudyn_muscles.FrozenBodiesWarning")
def test_passive_directions_move_as_they_do(passive, method):
    result = METHODS[method](Arm(PASSIVE[passive]).model(), MOTION)
    assert result.status is em.Status.COMPLETE
    assert result.max_unmet_torque == 0.0
    # deg; CSS recruits at a state ahead, where a cable's fast modes are predicted.
    most = {"csf": 0.005, "css": 0.1, "cmc": 0.06, "static": 0.0}[method]
    assert np.degrees(result.tracking_error_rms())[0] <= most


def test_order_with_a_passive_hand():
    steps = [0.02, 0.01, 0.005]
    errors = [
        METHODS["csf"](Arm(spring_hand).model(), MOTION, step=step).tracking_error_rms()[0]
        for step in steps
    ]
    assert order(steps, errors) == pytest.approx(2.0, abs=0.02)


def test_energy_with_a_wobbling_mass():
    """What the loads do becomes energy: a run of 1 ms steps, no damping."""
    arm = Arm(lambda arm: wobbling_mass(arm, damping=0.0))
    model, mbs = arm.model(), arm.mbs
    energy, power, time = [], [], []
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = 1000
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    plugin = em.CMCPlugin(model, MOTION)
    model.skeleton.set_initial_state(*MOTION(0.0)[:2])

    def look(mbs, t):
        state = model.skeleton.now.state
        kinetic = 0.5 * state.v @ model.skeleton.now._equations.matrix()[:10, :10] @ state.v
        x = state.q + model.skeleton.pose().tables.reference
        end = mbs.GetObjectOutputBody(
            arm.forearm, exu.OutputVariableType.Position, localPosition=[0.1, 0, 0]
        )
        potential = 9.81 * (3.0 * x[1] + 1.0 * x[8]) + 1000.0 * np.sum((x[7:10] - end) ** 2)
        energy.append(kinetic + potential)
        power.append(model.skeleton.now.load @ state.v)
        time.append(t)
        return True

    mbs.SetPostStepUserFunction(look)
    with plugin.attached():
        mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    energy, work = np.array(energy), np.concatenate([[0.0], np.cumsum(
        0.5 * np.diff(time) * (np.array(power)[1:] + np.array(power)[:-1])
    )])  # fmt: skip
    np.testing.assert_allclose(energy - energy[0], work, rtol=0, atol=2e-4 * np.ptp(work))
    assert np.ptp(work) > 3.0


def test_a_trees_coordinates_may_be_left_untracked():
    """By the coordinates of its node, muscles on markers of its links."""
    tree = planar_arm.build()
    mbs, number = tree.mbs, tree.skeleton.object
    node = mbs.GetObject(number)["nodeNumber"]
    markers = [
        mbs.AddMarker(MarkerKinematicTreeRigid(objectNumber=number, linkNumber=k)) for k in range(2)
    ]
    mbs.Assemble()
    muscles = [_on_markers(muscle, markers) for muscle in tree.muscles]
    both = {name: em.NodeCoordinate(node, k) for k, name in enumerate(tree.coordinates)}
    motion = planar_arm.motion()
    every = METHODS["csf"](em.MusculoskeletalModel(mbs, both, muscles), motion)
    plain = METHODS["csf"](planar_arm.build(), motion)
    np.testing.assert_allclose(every.coordinates, plain.coordinates, rtol=0, atol=1e-8)
    times = np.linspace(0.0, motion.end, 201)
    first = em.Motion.from_samples(times, motion(times)[0][:, :1])
    model = em.MusculoskeletalModel(mbs, {"shoulder": both["shoulder"]}, muscles)
    result = METHODS["csf"](model, first)
    assert result.status is em.Status.COMPLETE
    assert np.degrees(result.tracking_error_rms())[0] < 0.01


def _on_markers(muscle, markers):
    def on(item):
        return item if item.link < 0 else replace(item, link=markers[item.link])

    return replace(muscle, path=[on(point) for point in muscle.path], wraps=[])


@pytest.mark.parametrize(
    "solver", [exu.DynamicSolverType.TrapezoidalIndex2, exu.DynamicSolverType.GeneralizedAlpha]
)
@pytest.mark.parametrize("adaptive", [False, True])
def test_in_a_users_own_run(solver, adaptive):
    arm = Arm(spring_hand)
    model = arm.model()
    model.skeleton.set_initial_state(*MOTION(0.0)[:2])
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = 20 if adaptive else 100
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    if adaptive:
        settings.timeIntegration.newton.maxIterations = 3
    plugin = em.CosimulationPlugin(model, MOTION, em.CosimulationSettings(scheme=em.Scheme.FULL))
    with plugin.attached():
        arm.mbs.SolveDynamic(settings, solverType=solver)
    result = plugin.result()
    assert result.status is em.Status.COMPLETE
    assert (result.counts.rejected_steps > 0) == adaptive
    assert np.degrees(result.tracking_error_rms())[0] < 0.006
    # Afterwards nothing of the muscles is left in the system.
    assert not np.any(arm.mbs.GetObjectParameter(model.skeleton._forces[0], "forceVector"))


def test_the_same_run_twice_has_the_same_bits():
    arm = Arm(wobbling_mass)
    model = arm.model()
    for method in ("csf", "cmc"):
        one, other = (METHODS[method](model, MOTION) for _ in range(2))
        fresh = METHODS[method](Arm(wobbling_mass).model(), MOTION)
        for again in (other, fresh):
            for name in ("coordinates", "tendon_forces", "excitation_values", "torques_delivered"):
                np.testing.assert_array_equal(getattr(again, name), getattr(one, name))


def test_a_constrained_body_beside_a_tree():
    """The equations of the tree do not change; Exudyn's Newton iterations stop by the residuals of
    the whole system, so that they stop earlier or later within their tolerance."""
    plain = pendulum.build()
    methods = {name: METHODS[name](plain, pendulum.motion()) for name in METHODS}
    for swinging in (False, True):
        built = pendulum.build()
        mbs = built.mbs
        ground = mbs.CreateGround()
        door = mbs.CreateRigidBody(
            inertia=InertiaCuboid(1000, [0.3, 0.1, 0.1]),
            referencePosition=[2.15 if swinging else 2.0, 0.0 if swinging else -0.15, 0.0],
            gravity=[0, -9.81, 0],
        )
        mbs.CreateRevoluteJoint(itemNumbers=[ground, door], position=[2, 0, 0], axis=[0, 0, 1])
        mbs.Assemble()
        model = em.MusculoskeletalModel(
            mbs, built.skeleton.object, list(built.muscles), coordinates=["theta"]
        )
        for name, alone in methods.items():
            if name == "static":
                with pytest.warns(em.FrozenBodiesWarning):
                    beside = METHODS[name](model, pendulum.motion())
            else:
                beside = METHODS[name](model, pendulum.motion())
            for field in ("coordinates", "activations", "torques_delivered"):
                found, expected = getattr(beside, field), getattr(alone, field)
                within = 0.0 if name == "static" else 2e-8 * np.abs(expected).max()
                np.testing.assert_allclose(found, expected, rtol=0, atol=within)


def test_a_constraint_on_a_tree_is_named():
    built = pendulum.build()
    mbs = built.mbs
    ground = mbs.CreateGround()
    ends = [
        mbs.AddMarker(MarkerBodyRigid(bodyNumber=ground, localPosition=[0.3, 0, 0])),
        mbs.AddMarker(
            MarkerKinematicTreeRigid(
                objectNumber=built.skeleton.object, linkNumber=0, localPosition=[0, -0.3, 0]
            )
        ),
    ]
    from exudyn.utilities import DistanceConstraint

    mbs.AddObject(DistanceConstraint(name="rod", markerNumbers=ends, distance=0.5))
    mbs.Assemble()
    with pytest.raises(em.ModelError, match=r"'rod' \(object \d+\).*mapping of what is tracked"):
        em.MusculoskeletalModel(
            mbs, built.skeleton.object, list(built.muscles), coordinates=["theta"]
        )


def test_an_exoskeleton_in_a_pre_step_function():
    """A controller of the usual kind acts in static optimization as in co-simulation, and no run
    depends on what ran before."""

    def build():
        arm = Arm()
        marker = arm.mbs.AddMarker(MarkerBodyRigid(bodyNumber=arm.forearm))
        from exudyn.utilities import Torque

        load = arm.mbs.AddLoad(Torque(markerNumber=marker, loadVector=[0, 0, 0]))

        def control(mbs, t):
            coordinates = mbs.GetNodeOutput(0, exu.OutputVariableType.CoordinatesTotal)
            angle = 2.0 * np.arctan2(coordinates[6], coordinates[3])
            mbs.SetLoadParameter(load, "loadVector", [0.0, 0.0, 3.0 + 2.0 * angle])
            return True

        arm.mbs.SetPreStepUserFunction(control)
        arm.mbs.Assemble()
        return arm, arm.model(), load

    arm, model, load = build()
    first = METHODS["static"](model, MOTION)
    coupled = METHODS["csf"](model, MOTION)
    again = METHODS["static"](model, MOTION)
    np.testing.assert_array_equal(again.excitation_values, first.excitation_values)
    fresh = METHODS["csf"](build()[1], MOTION)
    np.testing.assert_array_equal(coupled.excitation_values, fresh.excitation_values)
    assert not np.any(arm.mbs.GetLoadParameter(load, "loadVector"))
    difference = np.abs(first.torques_demanded - coupled.torques_demanded)[1:].max()
    assert difference < 0.02 * np.abs(coupled.torques_demanded).max()
    without = METHODS["static"](Arm().model(), MOTION)
    assert np.abs(first.torques_demanded - without.torques_demanded).max() > 2.5


def test_a_pre_step_function_stops_static_optimization():
    arm = Arm()
    arm.mbs.SetPreStepUserFunction(lambda mbs, t: t < 0.3)
    with pytest.warns(em.IncompleteRunWarning, match=r"a user function at t = 0\.29"):
        result = METHODS["static"](arm.model(), MOTION)
    assert result.status is em.Status.INCOMPLETE
    assert result.time[-1] == pytest.approx(0.29)
    arm.mbs.SetPreStepUserFunction(lambda mbs, t: None)
    with pytest.raises(em.ModelError, match="returned None"):
        METHODS["static"](arm.model(), MOTION)


def test_actuators_and_recorded_forces_on_bodies():
    """Residual forces and torques carry a body that no muscle carries, against a recorded force."""
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()
    box = mbs.CreateRigidBody(inertia=InertiaCuboid(1000, [0.3, 0.2, 0.1]), gravity=[0, -9.81, 0])
    base = mbs.AddMarker(MarkerBodyRigid(bodyNumber=ground))
    middle = mbs.AddMarker(MarkerBodyRigid(bodyNumber=box))
    times, force = np.linspace(0.0, 1.0, 11), np.tile([3.0, 20.0, 0.0], (11, 1))
    push = em.ExternalForce("push", box, times, force, point=np.tile([0.05, 0, 0], (11, 1)))
    em.add_external_force(mbs, None, push)
    mbs.CreateGenericJoint(
        itemNumbers=[ground, box], position=[0, 0, 0], constrainedAxes=[0, 0, 1, 1, 1, 0]
    )
    mbs.Assemble()
    tracked = {
        "x": em.RelativePosition(base, middle, axis=[1, 0, 0]),
        "y": em.RelativePosition(base, middle, axis=[0, 1, 0]),
        "turn": em.RelativeRotation(base, middle, axis=[0, 0, 1]),
    }
    residuals = [
        em.PointActuator(
            name, link=box, point=[0, 0, 0], direction=direction, optimal_force=10.0,
            force_is_global=True,
        )
        for name, direction in (("f_x", [1, 0, 0]), ("f_y", [0, 1, 0]))
    ]  # fmt: skip
    residuals.append(em.TorqueActuator("t_z", link=box, axis=[0, 0, 1], optimal_force=1.0))
    slack = em.Muscle(
        "slack", max_isometric_force=1e-3, optimal_fiber_length=0.2, tendon_slack_length=0.05,
        path=[em.PathPoint([0.2, 0, 0], link=ground), em.PathPoint([0, 0, 0], link=box)],
    )  # fmt: skip
    model = em.MusculoskeletalModel(mbs, tracked, [slack], reserves=residuals)
    motion = em.Motion.from_waypoints([0.0, 1.0], [[0, 0, 0], [0.02, -0.03, 0.4]])
    result = em.static_optimization(model, motion)
    q, _, a = motion(result.window_time)
    expected = np.array([6.0 * a[:, 0] - 3.0, 6.0 * (a[:, 1] + 9.81) - 20.0]).T
    np.testing.assert_allclose(result.reserves[:, :2], expected, rtol=0, atol=0.01)
    # The recorded point stays in ground, the body moves on.
    inertia = 6.0 / 12.0 * (0.3**2 + 0.2**2)
    torque = inertia * a[:, 2] - ((0.05 - q[:, 0]) * 20.0 + q[:, 1] * 3.0)
    np.testing.assert_allclose(result.reserves[:, 2], torque, rtol=0, atol=0.01)
    coupled = em.cosimulate(model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL))
    assert np.abs(coupled.tracking_error_rms()).max() < 2e-5


def test_a_replay_counts_turns_from_where_the_motion_began():
    """Angles of the system itself end at half a turn; excitations know where they start."""
    times = np.linspace(0.0, 1.0, 101)
    turned = em.Motion.from_samples(times, MOTION(times)[0] + 4.0 * np.pi)
    result = METHODS["cmc"](Arm().model(), turned)
    again = em.forward_dynamics(Arm().model(), result.excitations)
    np.testing.assert_allclose(again.coordinates, result.coordinates, rtol=0, atol=1e-9)
    assert result.coordinates.min() > 3.9 * np.pi


@pytest.mark.filterwarnings("ignore::exudyn_muscles.FrozenBodiesWarning")
def test_geometry_between_runs_leaves_the_system_alone():
    """At any coordinates, also where the `mbs` was assembled anew since the last run."""
    arm = Arm(spring_hand)
    model, data = arm.model(), arm.mbs.systemData
    before = METHODS["static"](model, MOTION)
    arm.mbs.Assemble()
    state = [np.array(x) for x in data.GetSystemState()]
    q, v = before.coordinates[30], before.speeds[30]
    length = model.geometry(q, v).length
    np.testing.assert_allclose(length, before.musculotendon_lengths[30], rtol=0, atol=1e-12)
    for now, then in zip(data.GetSystemState(), state, strict=True):
        np.testing.assert_array_equal(now, then)


def test_a_replay_begins_where_what_is_passive_began(tmp_path):
    """In a run of the user's own from a deflected hand, replayed from a file in a fresh system."""

    def deflected():
        arm = Arm(spring_hand)
        both = arm.model({"elbow": arm.elbow, "wrist": arm.wrist}).skeleton
        both.set_initial_state(np.array([0.0, 0.2]), np.array([0.0, -1.0]))
        return arm

    arm = deflected()
    model = arm.model()
    plugin = em.CMCPlugin(model, MOTION)
    as_replayed = settings(1e-3, 0.3)
    as_replayed.timeIntegration.newton.absoluteTolerance = 1e-9
    result = plugin_run(model, plugin, as_replayed)
    result.save(tmp_path / "run.npz")
    excitations = em.Trajectory.load(tmp_path / "run.npz").excitations
    again = em.forward_dynamics(Arm(spring_hand).model(), excitations)
    np.testing.assert_allclose(again.coordinates, result.coordinates, rtol=0, atol=1e-8)
    np.testing.assert_allclose(
        again.system_coordinates, result.system_coordinates, rtol=0, atol=1e-8
    )
    np.testing.assert_array_equal(again.system_speeds[0], result.system_speeds[0])
    # Of another system, or one not known, what is passive begins where its mbs has it.
    unknown = replace(excitations, system=None)
    elsewhere = em.forward_dynamics(Arm(spring_hand).model(), unknown)
    assert np.abs(elsewhere.coordinates - result.coordinates).max() > 0.02
    other = Arm(spring_hand, node_type=TAIT_BRYAN).model()
    np.testing.assert_allclose(
        em.forward_dynamics(other, excitations).coordinates,
        elsewhere.coordinates,
        rtol=0,
        atol=1e-3,
    )
