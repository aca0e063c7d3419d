"""A forearm that is pressed on a table by its muscles, through a GeneralContact of Exudyn."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import (
    InertiaCuboid,
    MarkerBodyRigid,
    MarkerKinematicTreeRigid,
    TreeLink,
)

import exudyn_muscles as em

from ...runs import plugin_run, settings
from .models import GRAVITY, LENGTH, SIZE, Arm
from .test_runs import METHODS

STIFFNESS, DAMPING, FRICTION = 4e3, 20.0, 0.3  # N/m, N s/m, of each of both
RADIUS, TABLE = 0.1, -0.14  # m
DOWN = em.Motion.from_waypoints([0.0, 0.25, 0.5], [[0.0], [-0.2], [0.0]])
PRESSED = em.Motion.from_waypoints([0.0, 0.2], [[-0.2], [-0.15]])
FORMS = pytest.mark.parametrize("form", ["tree", "bodies"])
SURFACES = pytest.mark.parametrize("surface", ["triangles", "sphere"])


def touch(mbs, ground, hand, surface):
    """The contact of a marker, a sphere, with the table."""
    contact = mbs.AddGeneralContact()
    contact.SetFrictionPairings(FRICTION * np.eye(1))
    contact.SetFrictionProportionalZone(0.01)
    contact.SetSearchTreeCellSize([4, 4, 4])
    law = {
        "contactStiffness": STIFFNESS, "contactDamping": DAMPING, "frictionMaterialIndex": 0
    }  # fmt: skip
    if surface == "triangles":
        corners = [[-1, TABLE, -1], [1, TABLE, -1], [1, TABLE, 1], [-1, TABLE, 1]]
        table = mbs.AddMarker(MarkerBodyRigid(bodyNumber=ground))
        contact.AddTrianglesRigidBodyBased(
            table, pointList=corners, triangleList=[[0, 2, 1], [0, 3, 2]], **law
        )
    else:
        place = [LENGTH, TABLE - 1.0, 0.0]
        table = mbs.AddMarker(MarkerBodyRigid(bodyNumber=ground, localPosition=place))
        contact.AddSphereWithMarker(table, radius=1.0, **law)
    contact.AddSphereWithMarker(hand, radius=RADIUS, **law)


def of_bodies(surface):
    def add(arm):
        place = [LENGTH / 2, 0, 0]
        hand = arm.mbs.AddMarker(MarkerBodyRigid(bodyNumber=arm.forearm, localPosition=place))
        touch(arm.mbs, arm.ground, hand, surface)

    return Arm(add).model(reserve=10.0)


def of_a_tree(surface):
    mbs = exu.SystemContainer().AddSystem()
    inertia = InertiaCuboid(3.0 / (LENGTH * 0.0064), [LENGTH, 0.08, 0.08])
    link = TreeLink(
        jointType=exu.JointType.RevoluteZ, parent=-1, jointHT=np.eye(4),
        linkInertia=inertia.Translated([LENGTH / 2, 0, 0]),
    )  # fmt: skip
    tree = mbs.CreateKinematicTree(listOfTreeLinks=[link], gravity=GRAVITY)
    place = [LENGTH, 0, 0]
    hand = mbs.AddMarker(
        MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=0, localPosition=place)
    )
    touch(mbs, mbs.CreateGround(), hand, surface)
    mbs.Assemble()
    muscles = [
        em.Muscle(
            name,
            path=[
                em.PathPoint([-0.2, side * 0.05, 0]),
                em.PathPoint([LENGTH / 2 - 0.12, side * 0.03, 0], link=0),
            ],
            **SIZE,
        )
        for name, side in (("flexor", 1.0), ("extensor", -1.0))
    ]
    reserves = [em.Reserve("elbow", 10.0)]
    return em.MusculoskeletalModel(mbs, tree, muscles, coordinates=["elbow"], reserves=reserves)


BUILD = {"tree": of_a_tree, "bodies": of_bodies}


@FORMS
def test_forces(form):
    """In H - Q as the surfaces have them, wherever the arm was before."""
    skeleton = BUILD[form]("triangles").skeleton
    weight = 3.0 * 9.81 * LENGTH / 2
    with skeleton.opened():
        for q in (0.0, -0.2, -0.05, -0.15, 0.1):
            skeleton.go_to(np.array([q]), np.zeros(1), 0.0)
            sinking = max(0.0, RADIUS + TABLE - LENGTH * np.sin(q))
            # Both surfaces in series.
            expected = (weight - STIFFNESS / 2 * sinking * LENGTH) * np.cos(q)
            assert skeleton.dynamics().bias[0] == pytest.approx(expected, rel=1e-9)


@SURFACES
def test_both_forms_have_the_same_forces(surface):
    """With damping and friction, at any speed."""
    found = []
    for build in BUILD.values():
        skeleton = build(surface).skeleton
        with skeleton.opened():
            for q, v in ((-0.2, 0.4), (-0.18, -0.02), (0.0, 1.0), (-0.15, -1.0)):
                skeleton.go_to(np.array([q]), np.array([v]), 0.0)
                found.append(skeleton.dynamics().bias[0])
    np.testing.assert_allclose(found[4:], found[:4], rtol=1e-9)


@FORMS
@SURFACES
@pytest.mark.parametrize("method", list(METHODS))
def test_all_methods(form, surface, method):
    result = METHODS[method](BUILD[form](surface), DOWN)
    assert result.status is em.Status.COMPLETE
    assert result.max_unmet_torque == 0.0
    most = {"csf": 3e-4, "css": 1e-3, "cmc": 1e-3, "static": 0.0}[method]
    assert result.tracking_error_rms()[0] <= most
    # Pressed down by four times the arm's weight.
    pressed = {"triangles": -26.6, "sphere": -27.1}[surface]
    assert result.torques_demanded[1:].min() == pytest.approx(pressed, abs=0.3)


@FORMS
def test_a_run_that_begins_in_contact(form):
    """The muscles' start, Exudyn's initial accelerations and the first step all know of it."""
    static, full = (METHODS[one](BUILD[form]("triangles"), PRESSED) for one in ("static", "csf"))
    assert static.torques_delivered[0] == pytest.approx(-25.0, abs=0.5)
    np.testing.assert_allclose(
        full.torques_delivered[0], static.torques_delivered[0], rtol=0, atol=1e-6
    )
    away = np.abs(full.accelerations[0] - PRESSED(0.0)[2]).max()
    assert away < 1e-6
    assert full.tracking_error_rms()[0] < 3e-4


@FORMS
def test_no_run_depends_on_the_contacts_of_the_one_before(form):
    model = BUILD[form]("triangles")
    fresh = METHODS["cmc"](BUILD[form]("triangles"), DOWN)
    METHODS["static"](model, PRESSED)
    after = METHODS["cmc"](model, DOWN)
    np.testing.assert_array_equal(after.excitation_values, fresh.excitation_values)
    # Nor does one of the user alone.
    passive = []
    for one in (model, BUILD[form]("triangles")):
        one.mbs.SolveDynamic(settings(end=0.3), solverType=exu.DynamicSolverType.TrapezoidalIndex2)
        passive.append(np.array(one.mbs.systemData.GetODE2Coordinates()))
    np.testing.assert_array_equal(*passive)


@FORMS
def test_rejected_steps(form):
    model, repeated = BUILD[form]("triangles"), iter(range(10**6))
    model.mbs.SetPostNewtonUserFunction(
        lambda mbs, t: [10.0, 0.004] if next(repeated) % 7 == 3 else [0.0, -1.0]
    )
    model.skeleton.set_initial_state(*DOWN(0.0)[:2])
    plugin = em.CosimulationPlugin(model, DOWN, em.CosimulationSettings(scheme=em.Scheme.FULL))
    result = plugin_run(model, plugin, settings(0.01, 0.5))
    assert result.status is em.Status.COMPLETE
    assert result.counts.rejected_steps > 5
    assert result.tracking_error_rms()[0] < 3e-4


def test_a_users_post_newton_function_is_called_by_exudyn_alone():
    model, calls = of_bodies("triangles"), []
    model.mbs.SetPostNewtonUserFunction(lambda mbs, t: (calls.append(t), [0.0, -1.0])[1])
    METHODS["static"](model, PRESSED)
    assert not calls
    result = METHODS["css"](model, PRESSED)
    assert len(calls) == result.counts.steps
    assert model.mbs.GetPostNewtonUserFunction()


def test_friction_that_remembers_is_named():
    model = of_bodies("triangles")
    model.mbs.GetGeneralContact(0).sphereSphereFrictionRecycle = True
    with pytest.raises(em.ModelError, match=r"GeneralContact 0 .* sphereSphereFrictionRecycle = F"):
        METHODS["csf"](model, PRESSED)


def test_exudyns_steps_begin_with_the_contacts_of_the_last_one():
    """What `Contacts.settle_ahead` relies on: no step is repeated when a contact closes in it."""
    model, seen = of_a_tree("triangles"), []
    mbs = model.mbs
    mbs.SetPreNewtonResidualUserFunction(lambda mbs, t, k, repeated: seen.append(repeated))
    model.skeleton.set_initial_state(np.zeros(1), np.array([-2.0]))
    mbs.SolveDynamic(settings(end=0.2), solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    assert mbs.systemData.GetODE2Coordinates()[0] != 0.0
    assert not any(seen)
