"""External forces on a tree while the plugin carries them, and Exudyn again afterwards."""

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.skeleton import skeleton as skeletons
from exudyn_muscles.skeleton.skeleton import Skeleton

from ..runs import TRAPEZOIDAL, settings
from .test_loads import METHODS, as_model, held, pendulum, push


def acting(mbs):
    """What Exudyn has for its loads."""
    return [
        (int(load["markerNumber"]), load["loadVectorUserFunction"], list(load["loadVector"]))
        for load in map(mbs.GetLoad, range(mbs.systemData.NumberOfLoads()))
    ]


def not_carried(monkeypatch):
    monkeypatch.setattr(skeletons, "carry", lambda *_: None)


@pytest.mark.parametrize("frame", [-1, 0, 1])
def test_it_is_what_exudyn_makes_of_its_loads(monkeypatch, frame):
    rng = np.random.default_rng(1)
    forces = [push(force_expressed_in=frame), push(point_expressed_in=frame), push(point=None)]
    names = ["one", "two", "three"]
    for name, force in zip(names, forces, strict=True):
        object.__setattr__(force, "name", name)
    carried = Skeleton(*pendulum(2, forces))
    states = [(rng.uniform(-2.0, 2.0, 2), rng.normal(size=2), t) for t in (-1.0, 0.0, 0.37, 1.0)]

    def bias(skeleton):
        with skeleton.opened():
            return [skeleton.dynamics_at(*state).bias for state in states]

    by_plugin = bias(carried)
    not_carried(monkeypatch)
    np.testing.assert_allclose(by_plugin, bias(carried), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", METHODS)
def test_a_run_is_that_of_exudyns_loads(monkeypatch, name):
    model, motion = as_model(*pendulum(1, [push()])), held()
    by_plugin = METHODS[name](model, motion)
    not_carried(monkeypatch)
    by_exudyn = METHODS[name](model, motion)
    np.testing.assert_allclose(by_plugin.coordinates, by_exudyn.coordinates, rtol=0, atol=1e-9)
    forces = by_plugin.tendon_forces, by_exudyn.tendon_forces
    np.testing.assert_allclose(*forces, rtol=0, atol=1e-3)  # of 4000 N


def test_loads_act_again_after_a_run_and_after_an_error():
    mbs, tree = pendulum(1, [push()])
    model, before = as_model(mbs, tree), acting(mbs)
    em.cosimulate(model, held())
    assert acting(mbs) == before

    def stop(_):
        assert acting(mbs) != before  # they rest
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        em.cosimulate(model, held(), progress=stop)
    assert acting(mbs) == before


def test_they_rest_on_a_ground_that_is_there_or_is_added():
    for grounds in (0, 1):
        mbs = exu.SystemContainer().AddSystem()
        if grounds:
            mbs.CreateGround()
        tree = mbs.CreateKinematicTree(
            listOfTreeLinks=[
                exu.utilities.TreeLink(
                    jointType=exu.JointType.RevoluteZ,
                    linkInertia=exu.utilities.InertiaSphere(1.0, 0.1),
                )
            ]
        )
        for name in ("one", "two"):
            force = push()
            object.__setattr__(force, "name", name)
            em.add_external_force(mbs, tree, force)
        kinds = [mbs.GetObject(k)["objectType"] for k in range(mbs.systemData.NumberOfObjects())]
        assert kinds.count("Ground") == 1


def test_a_record_that_ends_is_refused_in_a_run_as_well():
    """Also where the loads rest, they say whose they are."""
    model = as_model(*pendulum(1, [push()]))
    with pytest.raises(em.ParameterError, match=r"external force 'push': its record spans"):
        em.cosimulate(model, held(0.2, 1.2))


def changed(mbs, tree, loads, what):
    """What a user does with the loads of a force, and what Exudyn has then."""
    function = mbs.GetLoad(loads[0])["loadVectorUserFunction"]["function"]
    if what == "off":
        mbs.SetLoadParameter(loads[0], "loadVectorUserFunction", 0)
    elif what == "torque off":
        mbs.SetLoadParameter(loads[1], "loadVectorUserFunction", 0)
    elif what == "scaled":
        scaled = lambda mbs, t, v: [3.0 * x for x in function(mbs, t, v)]  # noqa: E731
        mbs.SetLoadParameter(loads[0], "loadVectorUserFunction", scaled)
    elif what == "body fixed":
        mbs.SetLoadParameter(loads[0], "bodyFixed", True)
    elif what == "moved":
        marker = exu.itemInterface.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=0)
        moved = mbs.AddMarker(marker)
        mbs.Assemble()
        mbs.SetLoadParameter(loads[0], "markerNumber", moved)
    elif what == "user function":
        mbs.SetPreStepUserFunction(lambda mbs, t: True)
    elif what == "sensor":
        mbs.AddSensor(exu.itemInterface.SensorLoad(loadNumber=loads[0], storeInternal=True))
        mbs.Assemble()


@pytest.mark.parametrize(
    "what", ["off", "torque off", "scaled", "body fixed", "moved", "user function", "sensor"]
)
def test_what_a_user_has_changed_or_looks_at_is_left_to_exudyn(monkeypatch, what):
    mbs, tree = pendulum(1, [push()])
    changed(mbs, tree, [0, 1], what)
    model, before = as_model(mbs, tree), acting(mbs)
    found = em.cosimulate(model, held())
    assert acting(mbs) == before
    not_carried(monkeypatch)
    expected = em.cosimulate(model, held())
    np.testing.assert_array_equal(found.tendon_forces, expected.tendon_forces)
    if what == "sensor":
        assert np.abs(mbs.GetSensorStoredData(0)[1:, 1:]).max() > 1.0


@pytest.mark.parametrize("before_the_end", [False, True])
def test_what_is_changed_while_it_is_carried_is_an_error(before_the_end):
    mbs, tree = pendulum(1, [push()])
    model, motion = as_model(mbs, tree), held()
    model.skeleton.set_initial_state(*motion(motion.start)[:2])
    before, s = acting(mbs), settings(0.01, 0.4, start=motion.start)
    plugin = em.CosimulationPlugin(model, motion)

    def run(s):
        mbs.SolveDynamic(s, solverType=TRAPEZOIDAL, updateInitialValues=True)

    def attached():
        with plugin.attached():
            run(s)
            mbs.SetLoadParameter(0, "loadVector", [0.0, -100.0, 0.0])
            if before_the_end:
                run(settings(0.01, 0.6, start=0.4))

    with pytest.raises(em.ModelError, match=r"load 0 'push: force' was changed within attached"):
        attached()
    assert [load[:2] for load in acting(mbs)] == [load[:2] for load in before]


def test_afterwards_exudyn_alone_has_them():
    """Evaluations count them once, within a run, after it, and when the skeleton is open again."""
    model, motion = as_model(*pendulum(1, [push()])), held()
    state = (*motion(0.5)[:2], 0.5)
    with model.skeleton.opened():
        expected = model.skeleton.dynamics_at(*state).bias
    em.cosimulate(model, motion)
    np.testing.assert_allclose(model.skeleton.dynamics_at(*state).bias, expected, rtol=1e-12)
    with model.skeleton.opened():
        np.testing.assert_array_equal(model.skeleton.dynamics_at(*state).bias, expected)
