"""Bodies outside the skeleton: part of Q, and where they are matters."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import (
    LoadCoordinate,
    MarkerBodyPosition,
    MarkerKinematicTreeRigid,
    MarkerNodeCoordinate,
    Mass1D,
    Node1D,
    ObjectConnectorSpringDamper,
)

import exudyn_muscles as em
from models import pendulum

from ..runs import KP, plugin_run, rms_deg, settings, start_at


def with_a_mass_on_a_spring(stiffness=500.0, damping=20.0):
    """The pendulum with a mass of 1 kg hanging on its tip by a spring and damper."""
    built = pendulum.build()
    mbs = built.mbs
    body = mbs.CreateMassPoint(referencePosition=[0.0, 0.2, 0.0], mass=1.0)
    tip = mbs.AddMarker(
        MarkerKinematicTreeRigid(objectNumber=0, linkNumber=0, localPosition=[0.0, -0.5, 0.0])
    )
    mass = mbs.AddMarker(MarkerBodyPosition(bodyNumber=body))
    mbs.AddObject(
        ObjectConnectorSpringDamper(
            markerNumbers=[tip, mass], referenceLength=0.3, stiffness=stiffness, damping=damping
        )
    )
    mbs.Assemble()
    strong = [
        em.Muscle(
            muscle.name,
            max_isometric_force=30000.0,
            optimal_fiber_length=0.15,
            tendon_slack_length=0.16,
            path=muscle.path,
        )
        for muscle in built.muscles
    ]
    model = em.MusculoskeletalModel(mbs, 0, strong, coordinates=["theta"])
    start_at(model, pendulum.motion())
    return model


def run(scheme, step, **spring):
    model, motion = with_a_mass_on_a_spring(**spring), pendulum.motion()
    plugin = em.CosimulationPlugin(model, motion, em.CosimulationSettings(kp=KP, scheme=scheme))
    s = settings(step)
    s.timeIntegration.newton.useModifiedNewton = False
    return plugin_run(model, plugin, s)


@pytest.mark.parametrize("scheme", list(em.Scheme))
def test_co_simulation_stays_second_order(scheme):
    steps = [0.005, 0.0025, 0.00125]
    results = [run(scheme, step) for step in steps]
    errors = [rms_deg(result)[0] for result in results]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 1.8
    assert all(result.max_unmet_torque == 0.0 for result in results)


def test_csf_needs_few_iterations_with_a_stiff_spring():
    result = run(em.Scheme.FULL, 0.01, stiffness=5000.0)
    assert rms_deg(result)[0] < 0.03
    assert result.counts.newton_iterations < 4 * 100


def test_cmc_predicts_the_other_bodies():
    model, motion = with_a_mass_on_a_spring(), pendulum.motion()
    cmc = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=KP))
    csf = run(em.Scheme.FULL, 0.01)
    assert rms_deg(cmc)[0] < 0.1
    difference = np.abs(cmc.torques_demanded - csf.torques_demanded).max()
    assert difference < 0.05 * np.abs(csf.torques_demanded).max()


def test_a_prediction_moves_other_bodies_with_their_acceleration():
    """A mass falls freely beside the pendulum, whose torque depends on the mass's place and speed:
    the prediction from the start of a step is then exact.
    """
    built, motion = pendulum.build(), pendulum.motion()
    mbs = built.mbs
    node = mbs.AddNode(Node1D(referenceCoordinates=[0.0], initialVelocities=[0.3]))
    mbs.AddObject(Mass1D(nodeNumber=node, mass=2.0))
    place = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    mbs.AddLoad(LoadCoordinate(markerNumber=place, load=-5.0))

    def torque(mbs, t, load):
        x, v = (
            mbs.GetNodeOutput(node, kind)
            for kind in (exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t)
        )
        return 3.0 * float(np.sum(x)) + 0.5 * float(np.sum(v))

    angle = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=0, coordinate=0))
    mbs.AddLoad(LoadCoordinate(markerNumber=angle, load=0.0, loadUserFunction=torque))
    mbs.Assemble()
    model = em.MusculoskeletalModel(mbs, 0, built.muscles, coordinates=["theta"])
    start_at(model, motion)
    errors = []

    def look(mbs, t):
        q, v, _ = motion(t)
        predicted = model.skeleton.dynamics_ahead(q, v, t)[1]
        x, x_t = 0.3 * t - 1.25 * t * t, 0.3 - 2.5 * t
        expected = 9.81 * 0.5 * np.sin(q) - 3.0 * x - 0.5 * x_t
        errors.append(np.abs(predicted - expected).max())
        return True

    mbs.SetPreStepUserFunction(look)
    plugin_run(
        model,
        em.CosimulationPlugin(model, motion, em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP)),
        settings(),
    )
    assert len(errors) == 100
    assert max(errors) < 1e-12


def test_static_optimization_says_that_it_holds_them():
    model = with_a_mass_on_a_spring()
    with pytest.warns(em.FrozenBodiesWarning, match="holds the 3 coordinates"):
        em.static_optimization(model, em.Motion.from_waypoints([0.0, 0.02], [np.pi, np.pi]))


def test_forward_dynamics_knows_their_part_of_the_newton_matrix():
    model = with_a_mass_on_a_spring(stiffness=5e6, damping=0.0)
    given = em.Excitations([0.0, 0.1], [[0.3, 0.2]])
    result = plugin_run(model, em.ForwardPlugin(model, given), full_newton(0.001, 0.1))
    assert result.counts.newton_iterations <= 3 * 100


def full_newton(step, end):
    s = settings(step, end)
    s.timeIntegration.newton.useModifiedNewton = False
    return s
