"""Muscles at rest in `mbs.SolveStatic`: poses at which a run with the same excitations stays."""

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum, planar_arm

from ..runs import TRAPEZOIDAL, settings
from ..skeleton.system.models import Arm, spring_hand

QUIET = 1e-7  # rad or m, what Exudyn's tolerance and rounding leave of a rest


def static():
    s = exu.SimulationSettings()
    s.staticSolver.verboseMode = 0
    s.staticSolver.newton.relativeTolerance = 1e-10
    s.staticSolver.newton.absoluteTolerance = 1e-9
    s.solution.file.write = False
    return s


def solve(model, activations, **options):
    with em.muscles_at_rest(model, activations):
        model.mbs.SolveStatic(static(), updateInitialValues=True, **options)
    return model.mbs.sys["staticSolver"].it.newtonSteps


def drift(model, activations, end=0.3):
    """How far a run with these excitations goes from the pose."""
    given = em.ExcitationFunction(lambda t: activations, end=end)
    result = em.forward_dynamics(model, given)
    return np.abs(result.coordinates - result.coordinates[0]).max()


def raised(arm):
    """An arm of bodies where its muscles have arms, which at 0 they have not."""
    model = arm.model()
    model.skeleton.set_initial_state(np.array([0.6]), np.zeros(1))
    return model


@pytest.mark.parametrize(
    ("build", "activations", "most"),
    [
        (pendulum.build, [0.4, 0.2], 10),
        (planar_arm.build, [0.3, 0.2, 0.3, 0.2, 0.2, 0.2], 5),
        (lambda: raised(Arm()), [0.3, 0.02], 5),
        (lambda: raised(Arm(spring_hand)), [0.5, 0.02], 6),
    ],
    ids=["pendulum", "tree", "bodies", "passive"],
)
def test_a_run_with_the_same_excitations_stays(build, activations, most):
    model = build()
    before, start = drift(model, activations), model.skeleton.initial_state()[0]
    iterations = solve(model, activations)
    assert before > 0.05
    assert np.abs(model.skeleton.initial_state()[0] - start).max() > 0.05
    assert drift(model, activations) < QUIET
    assert iterations <= most, "Newton's matrix knows how muscles and joints' forces turn"


def test_a_number_and_names_are_activations_too():
    poses = []
    for given in (0.3, {"right": 0.3, "left": 0.3}, [0.3, 0.3]):
        model = pendulum.build()
        model.skeleton.set_initial_state(np.array([0.3]), np.zeros(1))
        solve(model, given)
        poses.append(model.skeleton.initial_state()[0])
    assert poses[0] == poses[1] == poses[2]
    assert poses[0][0] == pytest.approx(0.0, abs=1e-8), "the muscles are symmetric"


def test_the_mbs_is_as_before_and_its_own_functions_are_called():
    model = planar_arm.build()
    mbs, calls = model.mbs, []
    mbs.SetObjectParameter(model.skeleton.object, "jointForceVector", [0.5, 0.0])

    def own(mbs, t):
        calls.append(t)
        return True

    mbs.SetPreStepUserFunction(own)
    solve(model, 0.2)
    assert calls == [1.0]
    assert mbs.GetPreStepUserFunction()["function"] is own
    assert mbs.GetPreNewtonResidualUserFunction() == 0 == mbs.GetSystemJacobianUserFunction()
    torque = mbs.GetObjectParameter(model.skeleton.object, "jointForceVector")
    assert torque.tolist() == [0.5, 0.0]
    assert drift(model, np.full(6, 0.2)) < QUIET, "the user's own torque was part of the balance"


def test_what_does_not_fit_is_named():
    model = pendulum.build()
    with pytest.raises(em.ParameterError, match=r"'right': activation = .*1\.5.* outside \[0, 1\]"):
        solve(model, [0.5, 1.5])
    with pytest.raises(em.ParameterError, match="the names are toe, expected left, right"):
        solve(model, {"toe": 0.5})
    with (
        pytest.raises(em.ModelError, match=r"is for mbs\.SolveStatic with its default"),
        em.muscles_at_rest(model, 0.2),
    ):
        model.mbs.SolveDynamic(settings(), solverType=TRAPEZOIDAL)

    def replaced():
        with em.muscles_at_rest(model, 0.2):
            model.mbs.SetPreNewtonResidualUserFunction(lambda mbs, t, i, d: None)
            model.mbs.SolveStatic(static())

    with pytest.raises(em.ModelError, match="another PreNewtonResidual user function"):
        replaced()
    assert model.mbs.GetPreNewtonResidualUserFunction() == 0


def test_dependent_coordinates_are_refused():
    arm = planar_arm.build()
    follows = em.DependentCoordinate("elbow", of="shoulder", function=em.linear_function(0.5))
    model = em.MusculoskeletalModel(
        arm.mbs, arm.skeleton.object, arm.muscles, coordinates=["shoulder", "elbow"],
        dependent_coordinates=[follows],
    )  # fmt: skip
    with pytest.raises(em.ModelError, match="dependent_coordinates"):
        solve(model, 0.2)


def test_a_pose_without_equilibrium_is_an_error():
    model = planar_arm.build()
    model.mbs.SetObjectParameter(model.skeleton.object, "jointForceVector", [1e5, 0.0])
    with pytest.raises(em.SimulationError, match="found no equilibrium, last tried was q ="):
        solve(model, 0.2)
