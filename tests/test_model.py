"""The model: what does not fit the tree is named, before anything runs."""

from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import MarkerBodyPosition

import exudyn_muscles as em
from models import pendulum

from .path.trees import add_tree, random_links

PARAMETERS = {
    "max_isometric_force": 1000.0,
    "optimal_fiber_length": 0.1,
    "tendon_slack_length": 0.1,
}


@pytest.fixture
def system():
    mbs = exu.SystemContainer().AddSystem()
    rng = np.random.default_rng(0)
    tree = add_tree(mbs, rng, random_links(rng, 3))
    mbs.Assemble()
    return mbs, tree


def muscle(name, *links, **more):
    path = [em.PathPoint([0.1 * k, 0.2, 0.3], link=link) for k, link in enumerate(links)]
    return em.Muscle(name, **{**PARAMETERS, **more}, path=path)


def test_a_model(system):
    reserves = [em.Reserve("elbow", 10.0), em.Reserve("shoulder", 20.0), em.Reserve("elbow", 1.0)]
    model = em.MusculoskeletalModel(
        *system,
        (muscle(name, -1, 2) for name in "ab"),
        coordinates=["shoulder", "elbow", "wrist"],
        reserves=reserves,
    )
    assert model.muscles.names == ("a", "b")
    assert model.coordinates == ("shoulder", "elbow", "wrist")
    assert model.mbs is system[0]
    assert model.reserves == tuple(reserves)
    np.testing.assert_array_equal(model.columns(np.zeros(3)), [[0, 1, 0], [1, 0, 1], [0, 0, 0]])
    geometry = model.geometry(np.zeros(3), np.ones(3))
    assert geometry.length.shape == (2,)
    assert geometry.moment_arms.shape == (2, 3)


def test_torques(system):
    """r^T F of the taut tendons, and the reserves."""
    muscles = [
        muscle("taut", -1, 2),
        muscle("slack", 0, 1),
        muscle("rigid", -1, 1, ignore_tendon_compliance=True),
    ]
    model = em.MusculoskeletalModel(*system, muscles, reserves=[em.Reserve("q1", 5.0)])
    geometry = model.geometry(np.array([0.1, -0.3, 0.2]), np.array([0.1, 0.0, -0.2]))
    a, l_t = np.array([0.3, 0.4, 0.5]), np.array([0.103, 0.099, 0.1])
    torque = model.torque(geometry, a, l_t, np.array([3.0]))
    state = model.muscles, a, l_t, geometry.length, geometry.lengthening_speed
    F = em.muscle_dynamics(*state).tendon_force
    assert F[0] > 100.0 and F[1] == 0.0 and F[2] > 100.0
    expected = geometry.moment_arms[[0, 2]].T @ F[[0, 2]] + [0.0, 3.0, 0.0]
    np.testing.assert_allclose(torque, expected)


def test_power_balance(system):
    """tau . q' + F . l' = 0."""
    model = em.MusculoskeletalModel(*system, [muscle("a", -1, 2), muscle("b", 0, 1, -1)])
    rng = np.random.default_rng(5)
    for _ in range(10):
        q, v = rng.uniform(-2.0, 2.0, (2, 3))
        a, l_t = rng.uniform(0.01, 1.0, 2), rng.uniform(0.1, 0.105, 2)
        geometry = model.geometry(q, v)
        path = geometry.length, geometry.lengthening_speed
        F = em.muscle_dynamics(model.muscles, a, l_t, *path).tendon_force
        torque = model.torque(geometry, a, l_t, np.zeros(0))
        assert torque @ v == pytest.approx(-F @ geometry.lengthening_speed, abs=1e-11)


@pytest.mark.parametrize(
    ("muscles", "message"),
    [
        (["a", "b", "a"], r"more than once: \['a'\]"),
    ],
)
def test_bad_sets(system, muscles, message):
    with pytest.raises(em.ParameterError, match=message):
        em.MusculoskeletalModel(*system, [muscle(name, -1, 0) for name in muscles])


def test_link_that_does_not_exist(system):
    with pytest.raises(em.ParameterError, match=r"'far': path point 1 is on link 3, .* 0 to 2"):
        em.MusculoskeletalModel(*system, [muscle("near", -1, 2), muscle("far", -1, 3)])


def test_path_too_short(system):
    with pytest.raises(em.ParameterError, match="'short': a path needs at least two points, got 1"):
        em.MusculoskeletalModel(*system, [muscle("short", -1)])


def test_points_that_are_none(system):
    bad = em.Muscle("bad", **PARAMETERS, path=[[0, 0, 0], [1, 0, 0]])
    with pytest.raises(em.ParameterError, match="'bad': path point 0 is a PathPoint"):
        em.MusculoskeletalModel(*system, [bad])


def test_reserve_called_like_a_muscle(system):
    reserve = em.Reserve("q1", 1.0, name="a")
    with pytest.raises(em.ParameterError, match="reserves: 'a' is the name of a muscle"):
        em.MusculoskeletalModel(*system, [muscle("a", -1, 0)], reserves=[reserve])


def test_reserve_on_no_coordinate(system):
    with pytest.raises(em.ParameterError, match=r"'toe': the coordinates are \['q0', 'q1', 'q2'\]"):
        em.MusculoskeletalModel(*system, [muscle("a", -1, 0)], reserves=[em.Reserve("toe", 1.0)])


@pytest.mark.parametrize("link", [-1, 0, 2])
def test_a_muscle_that_crosses_no_coordinate(system, link):
    with pytest.warns(em.PathWarning, match="'idle' crosses no coordinate") as caught:
        em.MusculoskeletalModel(*system, [muscle("idle", link, link), muscle("works", -1, 2)])
    assert len(caught) == 1
    assert caught[0].filename == __file__


def slack_pendulum(slack):
    """The pendulum; the left muscle with another tendon. Its path is 0.35 m long at most."""
    model = pendulum.build()
    path = next(iter(model.muscles)).path
    left = em.Muscle(
        "left",
        max_isometric_force=3000.0,
        optimal_fiber_length=0.15,
        tendon_slack_length=slack,
        path=path,
    )
    return em.MusculoskeletalModel(model.mbs, 0, [left], coordinates=["theta"])


def test_tendon_too_long_for_the_motion():
    q = pendulum.motion()(np.linspace(0.0, 1.0, 101))[0]
    longest = max(slack_pendulum(0.16).geometry(row, np.zeros(1)).length[0] for row in q)
    allowed = longest - 0.2 * 0.15  # the shortest fibre
    slack_pendulum(0.999 * allowed).check_lengths(q)
    with pytest.raises(em.ParameterError) as error:
        slack_pendulum(1.2).check_lengths(q)
    for part in ("'left'", "tendon_slack_length = 1.2 m", f"at most {longest:.4g} m"):
        assert part in str(error.value)
    assert f"allowed is up to {allowed:.4g} m" in str(error.value)
    with pytest.raises(em.ParameterError, match="too long"):
        slack_pendulum(1.001 * allowed).check_lengths(q)


METHODS = [
    lambda model, motion: em.static_optimization(model, motion, step=0.01),
    lambda model, motion: em.computed_muscle_control(
        model, motion, settings=em.CMCSettings(kp=534.0)
    ),
    lambda model, motion: em.cosimulate(
        model, motion, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=534.0)
    ),
]


@pytest.mark.parametrize("method", METHODS)
def test_methods_refuse_a_tendon_that_is_too_long(method):
    with pytest.raises(em.ParameterError, match=r"'left': tendon_slack_length = 1\.2 m is too"):
        method(slack_pendulum(1.2), pendulum.motion())


@pytest.mark.parametrize("method", METHODS)
def test_methods_refuse_the_wrong_number_of_coordinates(method):
    two = em.Motion.from_waypoints([0.0, 1.0], [[3.0, 1.0], [3.2, 1.0]])
    with pytest.raises(em.MotionError, match="motion has 2 coordinates, the model 1: theta"):
        method(pendulum.build(), two)


@pytest.mark.parametrize(
    ("fiber", "tendon", "message"),
    [
        (
            0.01,
            0.16,
            r"'left': optimal_fiber_length = 0\.01 m .* is too short: .* stretches the fiber",
        ),
        (5.0, 0.16, r"'left': optimal_fiber_length = 5 m is too long, .* shortest fiber of 1 m"),
    ],
)
def test_fibers_that_do_not_fit_the_path_are_named(fiber, tendon, message):
    built = pendulum.build()
    unit = em.Muscle(
        "left",
        max_isometric_force=3000.0,
        optimal_fiber_length=fiber,
        tendon_slack_length=tendon,
        path=next(iter(built.muscles)).path,
    )
    model = em.MusculoskeletalModel(built.mbs, 0, [unit])
    with pytest.raises(em.ParameterError, match=message):
        em.static_optimization(model, pendulum.motion())


def acts_on(kind, link):
    """Anything on a link, whose number must be one of the tree's."""
    where = {"point": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0], "optimal_force": 1.0}
    times, force = [0.0, 1.0], np.zeros((2, 3))
    return {
        "point": lambda: em.PathPoint([0.0, 0.0, 0.0], link=link),
        "moving": lambda: em.MovingPathPoint(0.0, 0.0, 0.0, link, coordinate=0),
        "surface": lambda: em.WrapSphere(1.0, link=link),
        "force": lambda: em.PointActuator("A", link=link, **where),
        "torque": lambda: em.TorqueActuator("A", link=link, axis=[0, 0, 1], optimal_force=1.0),
        "against": lambda: em.TorqueActuator(
            "A", link=0, against=link, axis=[0, 0, 1], optimal_force=1.0
        ),
        "record": lambda: em.ExternalForce("F", link, times, force),
        "frame": lambda: em.ExternalForce("F", 0, times, force, force_expressed_in=link),
    }[kind]


@pytest.mark.parametrize(
    "kind", ["point", "moving", "surface", "force", "torque", "against", "record", "frame"]
)
@pytest.mark.parametrize("link", [True, 1.0, "1", None, -2])
def test_a_link_is_checked_in_one_way_everywhere(kind, link):
    with pytest.raises(em.ParameterError, match=rf"link in the kinematic tree.*got {link!r}"):
        acts_on(kind, link)()


@pytest.mark.parametrize(
    "kind", ["point", "moving", "surface", "force", "torque", "against", "record", "frame"]
)
def test_a_number_of_another_list_is_told_apart(kind):
    """A body's or marker's number looks like one of a link when it is printed: a tree has neither,
    other systems have no links, and a node is nothing to be on."""
    mbs = exu.SystemContainer().AddSystem()
    body = mbs.CreateMassPoint(mass=1.0)
    marker = mbs.AddMarker(MarkerBodyPosition(bodyNumber=body))
    for number, shown in (
        (body, r"ObjectIndex\(0\), one of the mbs's objects"),
        (marker, r"MarkerIndex\(0\), one of the mbs's markers"),
    ):
        with pytest.raises(em.ParameterError, match=f"{shown}, but the skeleton is a kinematic"):
            put_on_a_tree(acts_on(kind, number)())
    with pytest.raises(em.ParameterError, match=r"got NodeIndex\(0\), one of the mbs's nodes"):
        acts_on(kind, exu.NodeIndex(0))()


def put_on_a_tree(item):
    """A model of the pendulum with it; links of other systems are refused there."""
    built = pendulum.build()
    if isinstance(item, em.ExternalForce):
        return em.add_external_force(built.mbs, built.skeleton.object, item)
    if isinstance(item, (em.PointActuator, em.TorqueActuator)):
        return em.MusculoskeletalModel(built.mbs, 0, list(built.muscles), reserves=[item])
    left = next(iter(built.muscles))
    if isinstance(item, em.WrapSphere):
        changed = replace(left, wraps=[item])
    else:
        changed = replace(left, path=[left.path[0], item])
    return em.MusculoskeletalModel(built.mbs, 0, [changed])
