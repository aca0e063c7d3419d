"""Runs that go on: from segment to segment, step by step, and from saved points, bit by bit."""

import itertools
import re
import warnings
from pathlib import Path

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import LoadCoordinate, MarkerNodeCoordinate

import exudyn_muscles as em
from exudyn_muscles.results.quantities import QUANTITIES
from models import leg, pedalling, pendulum, planar_arm

from ..methods.test_stiffness import BEND, twisting_arm
from ..runs import TRAPEZOIDAL, settings, start_at
from ..skeleton.system.convert import as_bodies
from ..skeleton.system.models import MOTION, PASSIVE, Arm
from ..skeleton.system.test_general_contact import BUILD, DOWN

GENERALIZED_ALPHA = exu.DynamicSolverType.GeneralizedAlpha
H = 1.0 / 128.0  # of co-simulation; all times are exact
SHORT = 1.0 / 1024.0  # of CMC, whose windows of 10 ms then go beyond segments, and forward dynamics
COUNT = 26
CUTS = (0, 9, 14, COUNT)
WINDOW = 11  # of the short steps in a window of CMC


# Models and methods


def wobbling():
    return Arm(PASSIVE["wobbling mass"]).model()


MODELS = {
    "pendulum": (pendulum.build, pendulum.motion()),
    "planar arm": (planar_arm.build, planar_arm.motion()),
    "leg": (leg.build, leg.motion()),  # with dependent coordinates
    "planar arm of bodies": (lambda: as_bodies(planar_arm.build()), planar_arm.motion()),
    "closed loop": (pedalling.build, pedalling.motion()),
    "wobbling mass": (wobbling, MOTION),
    "twisting arm": (twisting_arm, BEND),  # whose muscles have a negative stiffness
}


def cosimulation(scheme, **options):
    def plugin(model, motion):
        of = em.CosimulationSettings(scheme=scheme, **options)
        return em.CosimulationPlugin(model, motion, of)

    return plugin


def cmc(model, motion):
    return em.CMCPlugin(model, motion)


def forward(model, motion):
    """A function of time and state that changes within every segment."""
    phases = np.arange(len(model.muscles))

    def u(t, state):
        return 0.1 + 0.05 * np.sin(40.0 * t + phases) + 0.2 * state.activations

    return em.ForwardPlugin(model, em.ExcitationFunction(u, end=motion.end))


def replay(model, motion):
    """Windows, some of which go on beyond a segment."""
    rng = np.random.default_rng(5)
    times = WINDOW * SHORT * np.arange(4)
    values = 0.1 + 0.3 * rng.random((3, len(model.muscles)))
    reserves = rng.random((4, len(model.reserves)))
    return em.ForwardPlugin(model, em.Excitations(times, values, reserves=reserves))


METHODS = {
    "csf": (cosimulation(em.Scheme.FULL), H),
    "css": (cosimulation(em.Scheme.SIMPLIFIED), H),
    "extrapolating": (
        cosimulation(
            em.Scheme.SIMPLIFIED, predictor=em.Predictor.EXTRAPOLATED_ACCELERATION, kp=50.0
        ),
        H,
    ),
    "consistent": (cosimulation(em.Scheme.CONSISTENT), H),
    "projected": (cosimulation(em.Scheme.FULL, project_constraints=True), H),
    "cmc": (cmc, SHORT),
    "forward": (forward, SHORT),
    "replay": (replay, SHORT),
}
ONLY = {  # what matters to some alone
    "projected": "closed loop", "extrapolating": "planar arm", "twisting arm": "cmc",
}  # fmt: skip
EVERY = [
    pytest.param(model, method, id=f"{model}-{method}")
    for model, method in itertools.product(MODELS, METHODS)
    if ONLY.get(model, method) == method and ONLY.get(method, model) == model
]


def made(model, method):
    build, motion = MODELS[model]
    built = build()
    start_at(built, motion, motion.start)
    return METHODS[method][0](built, motion)


# Ways of running


def segment(first, last, step, *, newton="full"):
    """Exudyn's settings from step to step of a run."""
    s = settings(step, last * step, start=first * step)
    s.timeIntegration.newton.useModifiedNewton = newton == "modified"
    s.linearSolver.solverType = exu.LinearSolverType.EigenDense
    return s


def solve(plugin, first, last, step=H, *, solver=TRAPEZOIDAL, update=True, **options):
    plugin.model.mbs.SolveDynamic(
        segment(first, last, step, **options), solverType=solver, updateInitialValues=update
    )


def at_once(plugin, step, **options):
    with plugin.attached():
        solve(plugin, 0, COUNT, step, **options)
    return plugin.result()


def in_segments(plugin, step, **options):
    with plugin.attached():
        for first, last in itertools.pairwise(CUTS):
            solve(plugin, first, last, step, **options)
    return plugin.result()


def own_solver(plugin, step, *, newmark=True, adaptive=True):
    """A solver as users of SolveSteps make it, known to the mbs, with its settings."""
    mbs, own = plugin.model.mbs, segment(0, 1, step)
    own.timeIntegration.adaptiveStep = adaptive
    own.timeIntegration.minimumStepSize = 0.3 * step
    own.timeIntegration.generalizedAlpha.useNewmark = newmark
    own.timeIntegration.generalizedAlpha.useIndex2Constraints = newmark
    solver = exu.MainSolverImplicitSecondOrder()
    mbs.sys["dynamicSolver"], mbs.sys["simulationSettings"] = solver, own
    solver.InitializeSolver(mbs, own)
    return solver, own


def stepped(plugin, step, *, newmark=True):
    """One control interval at a time."""
    with plugin.attached():
        solver, own = own_solver(plugin, step, newmark=newmark)
        for _ in range(COUNT):
            solver.it.endTime = solver.it.currentTime + step
            assert solver.SolveSteps(plugin.model.mbs, own)
        solver.FinalizeSolver(plugin.model.mbs, own)
    return plugin.result()


def as_exudyns_gym(plugin, step):
    """As `OpenAIGymInterfaceEnv.IntegrateStep` of Exudyn does it."""
    mbs, data = plugin.model.mbs, plugin.model.mbs.systemData
    with plugin.attached():
        solver, own = own_solver(plugin, step)
        for k in range(COUNT):
            own.timeIntegration.startTime, own.timeIntegration.endTime = k * step, (k + 1) * step
            solver.InitializeSolverInitialConditions(mbs, own)
            assert solver.SolveSteps(mbs, own)
            data.SetSystemState(data.GetSystemState(), configuration=exu.ConfigurationType.Initial)
        solver.FinalizeSolver(mbs, own)
    return plugin.result()


def assert_same_bits(found, expected, rows=slice(None)):
    """In all quantities and counts, or in these rows of the quantities at recorded times."""
    for one in QUANTITIES:
        values, wanted = (np.asarray(getattr(x, one.field))[rows] for x in (found, expected))
        numbers = values.dtype.kind == "f"
        assert np.array_equal(values, wanted, equal_nan=numbers), one.field
    if rows == slice(None):
        assert found.counts == expected.counts
        assert found.status is expected.status is em.Status.COMPLETE


@pytest.fixture(autouse=True)
def starts_anywhere():
    """Some of the runs begin off their motions, and their reserves do not suffice."""
    with warnings.catch_warnings():
        for kind in (em.StartWarning, em.UnmetTorqueWarning, em.TrackingWarning):
            warnings.simplefilter("ignore", kind)
        yield


# One run, and the same in pieces


@pytest.mark.parametrize(("model", "method"), EVERY)
def test_segments_and_steps_are_one_run(model, method):
    step = METHODS[method][1]
    expected = at_once(made(model, method), step)
    assert len(expected.time) == COUNT + 1
    for way in (in_segments, stepped, as_exudyns_gym):
        assert_same_bits(way(made(model, method), step), expected)


@pytest.mark.parametrize(("model", "method"), EVERY)
def test_a_restored_point_gives_the_same_bits(model, method):
    """After one step beyond it and after many, and in a new run of the same model made anew; within
    a window and where one begins."""
    step = METHODS[method][1]
    expected = at_once(made(model, method), step)
    plugin, anew = made(model, method), made(model, method)
    with plugin.attached():
        solve(plugin, 0, 9, step)
        point = plugin.save()
        solve(plugin, 9, 10, step)
        plugin.restore(point)
        assert plugin.result().time[-1] == point.time == 9 * step
        solve(plugin, 9, WINDOW, step)
        later = plugin.save()
        solve(plugin, WINDOW, COUNT, step)
        assert_same_bits(plugin.result(), expected)
        plugin.restore(point)
        solve(plugin, 9, COUNT, step)
        assert_same_bits(plugin.result(), expected)
    with anew.attached():
        anew.restore(later)
        solve(anew, WINDOW, COUNT, step)
    assert_same_bits(anew.result(), expected)


@pytest.mark.parametrize("form", list(BUILD))
@pytest.mark.parametrize("method", ["csf", "consistent"])
def test_contacts_are_those_of_the_point(form, method):
    """Of a GeneralContact, which keeps them within itself."""

    def fresh():
        return METHODS[method][0](BUILD[form]("triangles"), DOWN)

    plugin = fresh()
    with plugin.attached():
        solve(plugin, 0, 9)
        point = plugin.save()
        solve(plugin, 9, COUNT)  # pressed on the table
        plugin.restore(point)
        solve(plugin, 9, COUNT)
    expected = at_once(fresh(), H)
    assert_same_bits(plugin.result(), expected)
    assert_same_bits(in_segments(fresh(), H), expected)


@pytest.mark.parametrize("method", ["csf", "css", "consistent", "cmc"])
def test_steps_that_are_no_binary_fractions(method):
    """Times differ by rounding: each step is the same where it is given as the time before and the
    step; segments that meet in rounded times are apart by that."""
    step = {H: 0.01, SHORT: 0.001}[METHODS[method][1]]
    expected = at_once(made("planar arm", method), step)
    # The last step of a run at once is cut at its end.
    assert_same_bits(stepped(made("planar arm", method), step), expected, slice(0, -1))
    found = in_segments(made("planar arm", method), step)
    for name, apart in (("coordinates", 1e-13), ("activations", 1e-11), ("tendon_forces", 1e-8)):
        np.testing.assert_allclose(
            getattr(found, name), getattr(expected, name), rtol=0, atol=apart
        )
    assert found.counts == expected.counts


def test_exudyns_default_newton():
    """Modified Newton begins every segment with a new matrix; CSF asks for one in every step."""
    for method, apart in (("csf", 0.0), ("css", 1e-8)):
        expected = at_once(made("planar arm", method), H, newton="modified")
        found = in_segments(made("planar arm", method), H, newton="modified")
        np.testing.assert_allclose(found.coordinates, expected.coordinates, rtol=0, atol=apart)


def test_generalized_alpha():
    """Its algorithmic accelerations are the solver's: lost with it, and found anew."""
    expected = at_once(made("planar arm", "csf"), H, solver=GENERALIZED_ALPHA)
    assert_same_bits(stepped(made("planar arm", "csf"), H, newmark=False), expected)
    found = in_segments(made("planar arm", "csf"), H, solver=GENERALIZED_ALPHA)
    np.testing.assert_allclose(found.coordinates, expected.coordinates, rtol=0, atol=2e-6)


def test_the_initial_accelerations_of_a_segment_do_not_matter():
    """Exudyn's own would be those of the load that it finds; the trapezoidal rule keeps them."""
    plugin = made("pendulum", "csf")
    with plugin.attached():
        solve(plugin, 0, 9)
        later = segment(9, COUNT, H)
        later.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        plugin.model.mbs.SolveDynamic(later, solverType=TRAPEZOIDAL)
    assert_same_bits(plugin.result(), at_once(made("pendulum", "csf"), H))


def test_steps_of_fixed_length():
    """Exudyn counts them from the start that it knows."""
    plugin = made("planar arm", "csf")
    with plugin.attached():
        solver, own = own_solver(plugin, H, adaptive=False)
        for k in range(COUNT):
            solver.it.startTime, solver.it.endTime = k * H, (k + 1) * H
            assert solver.SolveSteps(plugin.model.mbs, own)
    assert_same_bits(plugin.result(), at_once(made("planar arm", "csf"), H))

    def without(plugin):
        with plugin.attached():
            solver, own = own_solver(plugin, H, adaptive=False)
            for k in range(2):
                solver.it.endTime = (k + 1) * H
                solver.SolveSteps(plugin.model.mbs, own)

    with pytest.raises(em.ModelError, match=r"it\.startTime = 0 s, and SolveSteps begins"):
        without(made("planar arm", "csf"))


def pushed_arm():
    """With a load on the elbow."""
    model, motion = planar_arm.build(), planar_arm.motion()
    node = model.mbs.GetObjectParameter(0, "nodeNumber")
    marker = model.mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=1))
    push = model.mbs.AddLoad(LoadCoordinate(markerNumber=marker, load=0.0))
    model.mbs.Assemble()
    start_at(model, motion)
    return model, motion, push


def test_branches():
    """Two futures of one point under different loads, and the first one again."""
    model, motion, push = pushed_arm()
    plugin, futures = cosimulation(em.Scheme.CONSISTENT)(model, motion), []
    with plugin.attached():
        solve(plugin, 0, 9)
        point = plugin.save()
        for load in (0.0, 3.0, 0.0):
            plugin.restore(point)
            model.mbs.SetLoadParameter(push, "load", load)
            solve(plugin, 9, COUNT)
            futures.append(plugin.result())
            # A point of each future holds its own past.
            later = plugin.save()
            plugin.restore(point)
            plugin.restore(later)
            assert_same_bits(plugin.result(), futures[-1])
    free, pushed, again = futures
    assert_same_bits(again, free)
    assert np.array_equal(pushed.coordinates[:10], free.coordinates[:10])
    assert np.abs(pushed.torques_delivered[11:, 1] - free.torques_delivered[11:, 1]).min() > 2.0


@pytest.mark.parametrize("as_gym", [False, True])
def test_points_of_steps(as_gym):
    """A solver of the user's own goes back with the system, whichever way it is asked to go on."""
    plugin = made("planar arm of bodies", "consistent")
    mbs = plugin.model.mbs
    with plugin.attached():
        solver, own = own_solver(plugin, H)

        def step():
            if as_gym and solver.it.currentTime:
                own.timeIntegration.startTime = solver.it.currentTime
                own.timeIntegration.endTime = solver.it.currentTime + H
                solver.InitializeSolverInitialConditions(mbs, own)
            solver.it.endTime = solver.it.currentTime + H
            assert solver.SolveSteps(mbs, own)
            state = mbs.systemData.GetSystemState()
            mbs.systemData.SetSystemState(state, configuration=exu.ConfigurationType.Initial)

        for k in range(COUNT):
            step()
            if k % 5 == 3:  # look ahead, and come back
                point = plugin.save()
                step()
                step()
                plugin.restore(point)
    assert_same_bits(plugin.result(), at_once(made("planar arm of bodies", "consistent"), H))


@pytest.mark.parametrize("method", ["csf", "css", "consistent"])
def test_shorter_steps_after_a_while(method):
    """Whatever a scheme extrapolates from the steps before knows their lengths."""
    plugin = made("planar arm", method)
    with plugin.attached():
        solve(plugin, 0, 9)
        solve(plugin, 18, 2 * COUNT, 0.5 * H)
    expected = at_once(made("planar arm", method), H)
    result = plugin.result()
    assert len(result.time) == 10 + 2 * (COUNT - 9)
    np.testing.assert_allclose(
        result.coordinates[9::2], expected.coordinates[9:], rtol=0, atol=2e-4
    )


def test_angles_keep_their_turns():
    """A crank beyond half a turn, which a new run would count from the motion's start."""
    plugin, anew = made("closed loop", "csf"), made("closed loop", "csf")
    with plugin.attached():
        solve(plugin, 0, 100)
        point = plugin.save()
        solve(plugin, 100, 103)
    with anew.attached():
        anew.restore(point)
        solve(anew, 100, 103)
    assert anew.result().coordinates[-1, 0] > np.pi
    assert_same_bits(anew.result(), plugin.result())


def test_a_run_that_begins_far_off_may_stay_there():
    """How far is known of the start, and so of the point."""
    plugin, anew = made("pendulum", "csf"), made("pendulum", "csf")
    plugin.skeleton.set_initial_state(np.array([1.0]), np.zeros(1))
    with plugin.attached():
        solve(plugin, 0, 1)
    with anew.attached():
        assert anew.state.widest < plugin.state.widest
        anew.restore(plugin.save())
    assert anew.state.widest == plugin.state.widest


def test_a_point_outlives_its_run():
    """It can be saved when the run is over, whatever is simulated then."""
    plugin = made("planar arm of bodies", "csf")
    with plugin.attached():
        solve(plugin, 0, 9)
    point = plugin.save()
    expected = at_once(made("planar arm of bodies", "csf"), H)
    solve(plugin, 0, 3)  # of the mbs alone
    with plugin.attached():
        plugin.restore(point)
        solve(plugin, 9, COUNT, update=False)
    assert_same_bits(plugin.result(), expected)


def test_warnings_are_not_repeated_but_for_another_step():
    model, motion = pendulum.build(), pendulum.motion()
    start_at(model, motion)
    plugin = cosimulation(em.Scheme.SIMPLIFIED, kp=1e4)(model, motion)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", em.StabilityWarning)
        with plugin.attached():
            solve(plugin, 0, 2)
            solve(plugin, 2, 4)
            assert len(caught) == 1
            solve(plugin, 2, 3, 2.0 * H)
    texts = [str(one.message) for one in caught if one.category is em.StabilityWarning]
    assert len(texts) == 2 and "0.0078125 s" in texts[0] and "0.015625 s" in texts[1]


def test_what_the_documents_show_runs_as_it_stands():
    text = (Path(__file__).parents[2] / "docs/continuing.md").read_text()
    segments, steps, points = re.findall(r"```python\n(.*?)```", text, re.S)
    futures = []
    for shown_code in (segments, steps, points):
        model, motion, push = pushed_arm()
        shown = {
            "exu": exu, "plugin": em.CosimulationPlugin(model, motion), "mbs": model.mbs,
            "push": push, "first": segment(0, 9, H), "second": segment(9, COUNT, H),
            "settings": segment(0, 1, 0.01), "rule": TRAPEZOIDAL, "candidates": [0.0, 3.0],
            "judge": futures.append,
        }  # fmt: skip
        exec(shown_code, shown)
        last = 9 if shown_code is points else 100 if shown_code is steps else COUNT
        assert len(shown["plugin"].result().time) == last + 1
        if shown_code is segments:
            result = shown["result"]
    free, pushed = futures
    assert_same_bits(pushed, result)
    assert free.time[-1] == pushed.time[-1] == COUNT * H
    assert np.abs(free.activations[-1] - pushed.activations[-1]).max() > 1e-3


# What cannot go on


def refused(plugin, do, message, error=em.ModelError):
    """`do` is done after a first segment, and raises."""

    def run():
        with plugin.attached():
            solve(plugin, 0, 9)
            do(plugin)

    with pytest.raises(error, match=message):
        run()
    assert plugin.result().time[-1] == 9 * H


def changed(name):
    def do(plugin):
        data, initial = plugin.model.mbs.systemData, exu.ConfigurationType.Initial
        values = np.array(getattr(data, f"Get{name}")(configuration=initial))
        values[-1] = np.nextafter(values[-1], 9.0)
        getattr(data, f"Set{name}")(values, configuration=initial)
        solve(plugin, 9, 12)

    return do


def without_update(plugin):
    plugin.restore(point := plugin.save())
    solve(plugin, 9, 12, update=False)
    assert plugin.result().time[-1] == 12 * H
    plugin.restore(point)
    solve(plugin, 9, 12, update=False)
    plugin.restore(point)
    changed("ODE2Coordinates")(plugin)


def unknown_solver(plugin):
    mbs, own = plugin.model.mbs, segment(9, 10, H)
    solver = exu.MainSolverImplicitSecondOrder()
    solver.InitializeSolver(mbs, own)
    solver.SolveSteps(mbs, own)


@pytest.mark.parametrize(
    ("do", "message"),
    [
        (lambda plugin: solve(plugin, 0, 9), "at t = 0.0703125 s, and this one begins at t = 0 s"),
        (lambda plugin: solve(plugin, 10, 12), "begins at t = 0.078125 s: set startTime"),
        (changed("ODE2Coordinates"), "coordinate 1 was .* updateInitialValues=True"),
        (changed("ODE2Coordinates_t"), "speed 1 was .* and is .* now"),
        (without_update, "coordinate 1 was"),
        (unknown_solver, r"a solver of your own .* mbs.sys\['dynamicSolver'\]"),
        (lambda plugin: plugin.model.mbs.SolveStatic(), "works with mbs.SolveDynamic"),
    ],
)
def test_a_run_that_begins_elsewhere(do, message):
    refused(made("planar arm", "csf"), do, message)


def test_what_is_changed_has_its_name():
    """Of a system of bodies, whose coordinates have some."""
    plugin = made("planar arm of bodies", "csf")
    name = plugin.skeleton.system_names[-1]
    refused(plugin, changed("ODE2Coordinates"), f"coordinate {name} was")


def test_a_motion_that_is_over():
    plugin = made("planar arm", "csf")
    refused(plugin, lambda plugin: solve(plugin, 9, 200), "beyond the end at", em.MotionError)


def test_the_users_own_run_in_between():
    """Of another mbs it does not matter; with `changed` it is said."""
    plugin, other = made("planar arm", "csf"), made("pendulum", "csf")
    with plugin.attached():
        solve(plugin, 0, 9)
        at_once(other, H)
        solve(other, 0, 3)
        solve(plugin, 9, COUNT)
    assert_same_bits(plugin.result(), at_once(made("planar arm", "csf"), H))


def failing_from(plugin, t_fail):
    """Have the plugin's mbs reject every step beyond a time; how to end that."""
    mbs = plugin.model.mbs
    mbs.SetPostNewtonUserFunction(lambda mbs, t: [9.0, 1e-6] if t > t_fail else [0.0, -1.0])
    return lambda: mbs.SetPostNewtonUserFunction(0)


@pytest.mark.parametrize("again", [9, 11, 12, 13])
def test_a_failure_that_the_user_catches(again):
    """No run goes on from the middle, wherever it is said to begin; from a saved point it does, as
    if nothing had happened."""
    plugin = made("planar arm", "consistent")
    mbs = plugin.model.mbs
    with plugin.attached():
        solve(plugin, 0, 9)
        point, mend = plugin.save(), failing_from(plugin, 11.5 * H)
        failing = segment(9, COUNT, H)
        failing.timeIntegration.minimumStepSize = 0.3 * H
        with pytest.raises(exu.ExudynError):
            mbs.SolveDynamic(failing, solverType=TRAPEZOIDAL, updateInitialValues=True)
        mend()
        assert 11 * H <= plugin.result().time[-1] < 11.5 * H
        with pytest.raises(em.SimulationError, match="no point to save"):
            plugin.save()
        with pytest.raises(exu.ExudynError) as caught:
            solve(plugin, again, COUNT)
        cause = caught.value.__cause__
        assert isinstance(cause, em.ModelError)
        assert "stopped at t = 0.0882813 s before its end" in str(cause)
        plugin.restore(point)
        solve(plugin, 9, COUNT)
    assert_same_bits(plugin.result(), at_once(made("planar arm", "consistent"), H))


def test_steps_that_fail_in_silence():
    """SolveSteps of a user's own solver says so by False alone."""
    plugin = made("planar arm", "csf")
    mend = failing_from(plugin, 3.1 * H)

    def run():
        with plugin.attached():
            solver, own = own_solver(plugin, H)
            while solver.SolveSteps(plugin.model.mbs, own):
                solver.it.endTime = solver.it.currentTime + H

    with pytest.warns(em.IncompleteRunWarning, match=r"Exudyn, which gave up, at t = 0\.0234"):
        run()
    mend()
    assert plugin.result().status is em.Status.INCOMPLETE


def test_a_run_that_was_stopped_and_one_that_is_lost():
    plugin = made("planar arm", "csf")
    plugin.model.mbs.SetPostStepUserFunction(lambda mbs, t: t < 8.5 * H)

    def twice(plugin):
        with plugin.attached():
            for first, last in ((0, 20), (9, 12)):
                solve(plugin, first, last)

    with pytest.raises(em.ModelError, match=r"stopped at t = 0\.0703125 s before its end"):
        twice(plugin)
    weak = made("pendulum", "csf")
    weak.model.mbs.SetObjectParameter(0, "jointForceVector", [3e3])  # N m

    def lost(plugin):
        with plugin.attached():
            solve(plugin, 0, 100)
            assert plugin.result().time[-1] < 90 * H
            solve(plugin, 100, 101)

    with pytest.raises(em.ModelError, match="before its end, where no run can go on"):
        lost(weak)


# Points that do not fit


def point_of(plugin):
    with plugin.attached():
        solve(plugin, 0, 9)
    return plugin.save()


@pytest.mark.parametrize(
    ("other", "method", "message"),
    [
        ("planar arm", "css", "a run by 'csf', and this is 'css'"),
        ("pendulum", "csf", r"another model, with coordinates \('shoulder', 'elbow'\), not"),
        ("planar arm of bodies", "csf", "another model, with array sizes "),
    ],
)
def test_points_of_something_else(other, method, message):
    point, plugin = point_of(made("planar arm", "csf")), made(other, method)

    def restore():
        with plugin.attached():
            plugin.restore(point)

    with pytest.raises(em.ModelError, match=message):
        restore()


def test_points_at_the_wrong_time():
    plugin = made("planar arm", "csf")
    with pytest.raises(em.SimulationError, match="no point to save"):
        plugin.save()
    point = point_of(plugin)
    with pytest.raises(em.ModelError, match="within attached"):
        plugin.restore(point)
    literal = em.CosimulationSettings(scheme=em.Scheme.FULL)
    late = em.CosimulationPlugin(plugin.model, planar_arm.motion(), literal, start=0.5)

    def restore():
        with late.attached():
            late.restore(point)

    with pytest.raises(em.ModelError, match=r"from t = 0 s, .* muscles start at 0\.5 s"):
        restore()
