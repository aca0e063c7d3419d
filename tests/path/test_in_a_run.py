"""An elbow whose muscles wrap, move and follow a function, in Exudyn."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import InertiaCylinder, TreeLink

import exudyn_muscles as em

UNIT = {"max_isometric_force": 1000, "optimal_fiber_length": 0.12, "tendon_slack_length": 0.19}
BONE = em.WrapCylinder(0.03, 0.1, side="-x", name="humerus")


def elbow(muscles):
    mbs = exu.SystemContainer().AddSystem()
    forearm = InertiaCylinder(density=1100, length=0.26, outerRadius=0.04, axis=1)
    link = TreeLink(
        jointType=exu.JointType.RevoluteZ,
        jointHT=np.eye(4),
        linkInertia=forearm.Translated([0, -0.13, 0]),
    )
    tree = mbs.CreateKinematicTree(listOfTreeLinks=[link], gravity=[0, -9.81, 0])
    mbs.Assemble()
    return em.MusculoskeletalModel(mbs, tree, muscles, coordinates=["elbow"])


def muscles():
    via = em.ConditionalPathPoint([0.03, 0.02, 0.0], coordinate="elbow", range=(-1.0, 3.0))
    moving = em.MovingPathPoint(
        em.Curve(lambda q: 0.01 + 0.005 * np.sin(q), [0.0, 3.0]), -0.04, 0.0, 0, coordinate="elbow"
    )
    front = [em.PathPoint([0.02, 0.3, 0]), via, moving]
    back = [em.PathPoint([-0.035, 0.3, 0]), em.PathPoint([-0.032, -0.05, 0.01], link=0)]
    function = em.FunctionPath([(0.33, {}), (-0.03, {"elbow": 1}), (0.002, {"elbow": 2})])
    return [
        em.Muscle("flexor", **UNIT, path=front),
        em.Muscle("extensor", **UNIT, path=back, wraps=[BONE]),
        em.Muscle("brachialis", **UNIT, path=function),
    ]


MOTION = em.Motion.from_waypoints([0, 0.4, 0.8], np.radians([20, 70, 30]))


@pytest.mark.parametrize("run", [em.cosimulate, em.computed_muscle_control])
def test_tracks_and_replays(run):
    model = elbow(muscles())
    result = run(model, MOTION)
    assert np.degrees(result.tracking_error_rms())[0] < 0.03
    # A full turn around the bone: the arm is its radius.
    i = result.muscle_names.index("extensor")
    rest = np.zeros(1)
    arms = [model.geometry(q, rest).moment_arms[i, 0] for q in result.coordinates]
    np.testing.assert_allclose(arms, -0.03, rtol=0, atol=3e-5)
    again = em.forward_dynamics(elbow(muscles()), result.excitations)
    assert np.isfinite(again.coordinates).all()


@pytest.mark.parametrize("run", [em.cosimulate, em.computed_muscle_control, em.static_optimization])
def test_on_the_rim_of_a_pulley(run):
    """As a micrometre outside of it."""

    def result(outside):
        def over(side, x, slack):
            size = {**UNIT, "tendon_slack_length": slack}
            end = em.PathPoint([0.0, -0.04 - outside, 0.0], link=0)
            path, pulley = [em.PathPoint([x, 0.3, 0.0]), end], em.WrapCylinder(0.04, side=side)
            return em.Muscle(f"over {side}", **size, path=path, wraps=[pulley])

        return run(elbow([over("x", 0.02, 0.22), over("-x", -0.02, 0.27)]), MOTION)

    on, near = result(0.0), result(1e-6)
    assert on.status is near.status is em.Status.COMPLETE
    assert not on.torques_unmet.any()
    np.testing.assert_allclose(on.coordinates, near.coordinates, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(on.torques_delivered, near.torques_delivered, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(on.tendon_forces, near.tendon_forces, rtol=0.0, atol=1e-3)


def test_a_muscle_that_only_wraps_over_a_link_crosses_it():
    ends = [em.PathPoint([-0.1, 0.1, 0.0]), em.PathPoint([-0.1, -0.1, 0.0])]
    ball = em.WrapSphere(0.05, position=[-0.08, 0.0, 0.0], link=0)
    elbow([em.Muscle("sling", **UNIT, path=ends, wraps=[ball])])  # no warning
    for path in (ends, em.FunctionPath([(0.3, {})])):
        with pytest.warns(em.PathWarning, match="'sling' crosses no coordinate"):
            elbow([em.Muscle("sling", **UNIT, path=path)])


def test_picture(tmp_path):
    model = elbow(muscles())
    result = em.cosimulate(model, MOTION, settings=em.CosimulationSettings(scheme=em.Scheme.FULL))
    file = tmp_path / "elbow.png"
    em.view.render(model, result, 0.4, file, size=(240, 200))
    assert file.stat().st_size > 1000
