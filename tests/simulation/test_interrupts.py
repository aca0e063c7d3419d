"""An interrupt in whatever line of a run: it surfaces as itself, the mbs is the user's again, what
was reached is readable, and the next run gives the same bits.
"""

import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum, planar_arm

from .. import leg
from ..interrupts import lines_of, traced
from ..runs import KP, TRAPEZOIDAL, settings

HOOKS = ("PreStep", "PreNewtonResidual", "SystemJacobian", "PostStep")
ARRAYS = ("time", "coordinates", "accelerations", "tendon_forces")
OF_WINDOWS = ("excitation_values", "force_optimal", "torques_unmet")


def one_joint():
    """The pendulum with a reserve; its user has torques, a user function and a run before."""
    built = pendulum.build()
    mbs, tree = built.mbs, built.skeleton.object
    reserves = [em.Reserve("q0", 10.0)]
    model = em.MusculoskeletalModel(mbs, tree, built.muscles, reserves=reserves)
    mbs.SetObjectParameter(tree, "jointForceVector", [0.1])
    mbs.SetPreStepUserFunction(lambda mbs, t: True)
    model.skeleton.set_initial_state(np.array([np.pi]), np.zeros(1))
    mbs.SolveDynamic(settings(end=0.02), solverType=TRAPEZOIDAL)
    return model, em.Motion.from_waypoints([0.0, 0.02], [np.pi, np.pi - 0.005])


def out_of_reach():
    motion = em.Motion.from_waypoints([0.0, 0.02], [[0.5, 0.8], [1.5, 2.5]])
    return planar_arm.build(), motion


def with_dependent_coordinates():
    model = leg.build()
    return model, em.Motion.from_waypoints([0.0, 0.02], [[0.1, -0.3], [0.11, -0.32]])


def static(model, motion):
    return em.static_optimization(model, motion)


def cmc(model, motion):
    return em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP, step=0.005))


def csf(model, motion):
    return em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    )


def css(model, motion):
    simplified = em.CosimulationSettings(kp=KP, scheme=em.Scheme.SIMPLIFIED)
    return em.cosimulate(model, motion, settings=simplified)


def forward(model, motion):
    m, r = len(model.muscles), len(model.reserves)
    u = np.linspace(0.1, 0.3, 2 * m).reshape(2, m)
    return em.forward_dynamics(model, em.Excitations([0.0, 0.01, 0.02], u, np.zeros((3, r))))


def plugin(model, motion):
    """A user's own run."""
    made = em.CosimulationPlugin(
        model, motion, em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)
    )
    with made.attached():
        model.mbs.SolveDynamic(settings(end=0.02), solverType=TRAPEZOIDAL)
    return made.result()


def users(model):
    """What in an mbs is the user's: state, torques, user functions and solver."""
    mbs = model.mbs
    state = model.skeleton.initial_arrays()
    torque = mbs.GetObjectParameter(model.skeleton.object, "jointForceVector")
    hooks = [getattr(mbs, f"Get{name}UserFunction")() for name in HOOKS]
    return (
        *(array.tolist() for array in state),
        (np.zeros(len(model.skeleton.tree)) + (torque if np.size(torque) else 0.0)).tolist(),
        [hook["function"] if isinstance(hook, dict) else hook for hook in hooks],
        sorted(mbs.sys),
    )


@pytest.mark.filterwarnings("ignore::exudyn_muscles.ExudynMusclesWarning")
def test_in_every_line_of_a_run(tmp_path):
    """Each line once with the first run that comes by, where it is executed first and last."""
    known = set()
    for build, run in (
        *((one_joint, run) for run in (csf, static, css, plugin, forward, cmc)),
        *((with_dependent_coordinates, run) for run in (csf, static, cmc)),
        (out_of_reach, csf),
    ):
        check(*build(), run, known, tmp_path)
    assert len(known) > 1000


def check(model, motion, run, known, folder):
    whole = run(model, motion)
    before = users(model)
    for at in lines_of(lambda: run(model, motion), known):
        # `caught` keeps the frames of what was interrupted alive while the next run begins.
        with pytest.raises(KeyboardInterrupt) as caught, traced(at) as tracer:
            run(model, motion)
        place = tracer.lines[-1]
        again = run(model, motion)
        assert users(model) == before, place
        for name in (*ARRAYS, *OF_WINDOWS):
            np.testing.assert_array_equal(getattr(again, name), getattr(whole, name), str(place))
        partial = getattr(caught.value, "trajectory", None)
        if partial is not None:
            file = folder / "partial.npz"
            partial.save(file)
            stored = em.Trajectory.load(file)
            # Until its end is judged, a run that has lost its motion is one that was completed.
            assert stored.status in (em.Status.INCOMPLETE, em.Status.COMPLETE, whole.status)
            for names, rows in ((ARRAYS, len(stored.time)), (OF_WINDOWS, stored.windows)):
                for name in names:
                    expected = getattr(whole, name)[:rows]
                    np.testing.assert_array_equal(getattr(stored, name), expected, str(place))
            assert stored.windows == 0 or stored.window_time[-1] == stored.time[-1], place
