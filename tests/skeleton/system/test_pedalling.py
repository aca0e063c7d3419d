"""A closed loop of bodies with real muscles in all methods, and the same leg as a tree."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import HomogeneousTransformation, InertiaCuboid, RotationMatrixZ, TreeLink

import exudyn_muscles as em
from models import pedalling

from .test_runs import METHODS, order

MOTION = pedalling.motion()


@pytest.mark.parametrize("method", list(METHODS))
def test_all_methods(method):
    result = METHODS[method](pedalling.build(), MOTION)
    assert result.status is em.Status.COMPLETE
    assert result.max_unmet_torque == 0.0
    most = {"csf": 0.012, "css": 0.6, "cmc": 0.2, "static": 0.0}[method]  # deg
    assert np.degrees(result.tracking_error_rms())[0] <= most


def test_order_and_newton_iterations():
    steps = [0.02, 0.01, 0.005, 0.0025]
    runs = [METHODS["csf"](pedalling.build(), MOTION, step=step) for step in steps]
    errors = [run.tracking_error_rms()[0] for run in runs]
    assert order(steps, errors) == pytest.approx(2.0, abs=0.02)
    for run, held in zip(runs, (iterations_with_forces_held(step) for step in steps), strict=True):
        assert run.counts.newton_iterations / run.counts.steps < held + 1.0


def iterations_with_forces_held(step):
    """Newton iterations a step of the mechanism alone, driven by the torque of a run's record."""
    model = pedalling.build()
    torque = METHODS["csf"](model, MOTION, step=step)
    mbs = model.mbs
    place = model.skeleton._forces[0]
    counted = []

    def hold(mbs, t):
        k = min(round(t / step), len(torque.time) - 1)
        with_T = model.skeleton.pose().T[0]
        mbs.SetObjectParameter(place, "forceVector", torque.torques_delivered[k, 0] * with_T)
        return True

    model.skeleton.set_initial_state(*MOTION(0.0)[:2])
    with model.skeleton.opened():
        mbs.SetPreStepUserFunction(hold)
        mbs.SetPreNewtonResidualUserFunction(lambda mbs, t, k, _: counted.append(k))
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = round(1.0 / step)
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.newton.relativeTolerance = 1e-8
        settings.timeIntegration.newton.absoluteTolerance = 1e-9
        settings.solution.file.write = False
        mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    mbs.SetPreStepUserFunction(0)
    mbs.SetPreNewtonResidualUserFunction(0)
    return (np.array(counted) > 0).sum() * step


def test_the_same_leg_as_a_tree_with_dependent_coordinates():
    of_bodies, of_tree = (
        METHODS["csf"](model, MOTION, step=0.0025) for model in (pedalling.build(), as_tree())
    )
    np.testing.assert_allclose(of_tree.coordinates, of_bodies.coordinates, rtol=0, atol=5e-5)
    np.testing.assert_allclose(
        of_tree.musculotendon_lengths, of_bodies.musculotendon_lengths, rtol=0, atol=3e-5
    )
    demanded = of_bodies.torques_demanded
    np.testing.assert_allclose(of_tree.torques_demanded, demanded, rtol=0, atol=0.05)


def as_tree():
    """Thigh and shank in a chain, the crank beside; functions of its angle close the loop."""
    (_, hip, thigh, _), (_, _, shank, _), (_, axle, crank, _) = pedalling._pose()
    mbs = exu.SystemContainer().AddSystem()
    lengths = {"thigh": pedalling.THIGH, "shank": pedalling.SHANK, "crank": pedalling.CRANK}

    def link(name, parent, place, turn):
        length = lengths[name]
        inertia = InertiaCuboid(pedalling.MASSES[name] / (length * 0.0081), [length, 0.09, 0.09])
        return TreeLink(
            jointType=exu.JointType.RevoluteZ,
            parent=parent,
            jointHT=HomogeneousTransformation(RotationMatrixZ(turn), place),
            linkInertia=inertia.Translated([length / 2, 0, 0]),
            PDcontrol=(0.0, pedalling.BRAKE) if name == "crank" else None,
        )

    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=[
            link("thigh", -1, hip, thigh),
            link("shank", 0, [lengths["thigh"], 0, 0], shank - thigh),
            link("crank", -1, axle, crank),
        ],
        gravity=[0.0, -9.81, 0.0],
    )
    mbs.Assemble()
    angles = np.linspace(-0.2, 2.0 * np.pi + 0.2, 801)
    poses = np.array([closed(angle) for angle in angles])
    dependent = [
        em.DependentCoordinate("hip", of="crank", function=em.simm_spline(angles, poses[:, 0])),
        em.DependentCoordinate("knee", of="crank", function=em.simm_spline(angles, poses[:, 1])),
    ]
    number = {"thigh": 0, "shank": 1}

    def point(body, place):
        if body is None:
            return em.PathPoint(place)
        return em.PathPoint(np.add(place, [lengths[body] / 2, 0, 0]), link=number[body])

    return em.MusculoskeletalModel(
        mbs, tree, pedalling.muscles(point), coordinates=["hip", "knee", "crank"],
        dependent_coordinates=dependent, reserves=[em.Reserve("crank", optimal_force=10.0)],
    )  # fmt: skip


def closed(angle):
    """Hip and knee as turned from the start, at an angle of the crank from the start."""
    (_, _, thigh_0, _), (_, _, shank_0, _), _ = pedalling._pose()
    turned = pedalling.START + angle
    pedal = pedalling.AXLE + pedalling.CRANK * np.array([np.cos(turned), np.sin(turned), 0.0])
    reach = pedal - pedalling.HIP
    distance = np.linalg.norm(reach)
    a, b = pedalling.THIGH, pedalling.SHANK
    thigh = np.arctan2(reach[1], reach[0]) + np.arccos(
        (a**2 + distance**2 - b**2) / (2.0 * a * distance)
    )
    knee = pedalling.HIP + a * np.array([np.cos(thigh), np.sin(thigh), 0.0])
    shank = np.arctan2(*(pedal - knee)[[1, 0]])
    return thigh - thigh_0, (shank - thigh) - (shank_0 - thigh_0)
