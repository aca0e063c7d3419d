"""Constraints between bodies against OpenSim's numbers, in runs, and what is wrong in a file."""

import numpy as np
import pytest

import exudyn_muscles as em

from ..differences import gradient
from ..opensim_models import rebuilt
from ..own_models import FOLDER
from ..runs import plugin_run, settings
from . import loop_models

NAMES = tuple(loop_models.DEFAULTS)
FREEDOMS = {
    "distance": 6, "distance_and_coupler": 5, "point": 4, "redundant": 4, "line": 5, "weld": 1,
    "polynomial": 6, "chain": 5, "piecewise": 6, "distance_and_polynomial": 5,
}  # fmt: skip
ALL = pytest.mark.parametrize("name", loop_models.CONSTRAINTS)


def load(tmp_path, name, text=None, **options):
    file = tmp_path / "model.osim"
    file.write_text(loop_models.model(name, **options) if text is None else text)
    return em.opensim.load_model(file)


@pytest.fixture(scope="module")
def numbers():
    with np.load(FOLDER / "loops.npz") as stored:
        return dict(stored)


def states(model, numbers, name):
    """OpenSim's states: z, z', and all of q, u, a, a with muscles in the order of the tree."""
    order = [NAMES.index(each) for each in model.skeleton.tree_coordinates]
    free = [NAMES.index(each) for each in model.coordinates]
    q, u, a, pulled = (numbers[f"{name}_{key}"] for key in ("q", "u", "a", "a_muscles"))
    found = (q[:, free], u[:, free], *(each[:, order] for each in (q, u, a, pulled)))
    return zip(*found, numbers[f"{name}_F"], strict=True)


@ALL
def test_poses_and_accelerations_are_opensims(name, tmp_path, numbers):
    """OpenSim's states meet the constraints to 1e-10; accelerations are as of them to 1e-8."""
    model = load(tmp_path, name)
    assert len(model.coordinates) == FREEDOMS[name]
    assert np.abs(numbers[f"{name}_u"]).max() > 1.0
    with model.skeleton.opened():
        for z, v, q, u, a, pulled, F in states(model, numbers, name):
            M, bias, _ = model.skeleton.dynamics_at(z, v, 0.0)
            torque = model.geometry(z, v).moment_arms.T @ F
            for expected, right in ((a, -bias), (pulled, torque - bias)):
                found = model.state_of_tree(z, v, np.linalg.solve(M, right))
                np.testing.assert_allclose(found[0], q, rtol=0, atol=1e-9)
                np.testing.assert_allclose(found[1], u, rtol=0, atol=1e-8)
                if name in loop_models.AT_REST and u.any():
                    continue
                np.testing.assert_allclose(
                    found[2], expected, rtol=0, atol=1e-8 * np.abs(expected).max()
                )


@ALL
def test_the_pose_of_the_file_is_where_it_begins(name, tmp_path, numbers):
    """It meets the constraints already, but for the coupled coordinate."""
    model = load(tmp_path, name)
    (q,) = model.state_of_tree(model.skeleton.initial_state()[0])
    order = [NAMES.index(each) for each in model.skeleton.tree_coordinates]
    np.testing.assert_allclose(q, numbers[f"{name}_q"][0, order], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", sorted(loop_models.CONSTRAINTS.keys() - set(loop_models.AT_REST)))
def test_it_falls_as_in_opensim(name, tmp_path, numbers):
    """The plugin's steps leave an error of second order: what they agree on is OpenSim's end."""
    model = load(tmp_path, name, muscles=False)
    ends = []
    for step in (2e-3, 1e-3):
        plugin = em.ForwardPlugin(
            model, em.Excitations(np.array([0.0, loop_models.SPAN]), np.empty((1, 0)))
        )
        ends.append(plugin_run(model, plugin, settings(step, loop_models.SPAN)).coordinates[-1])
    *_, (z, *_) = states(model, numbers, name)
    assert np.abs(ends[1] - z).max() < 1e-3
    np.testing.assert_allclose((4.0 * ends[1] - ends[0]) / 3.0, z, rtol=0, atol=1e-6)


@ALL
def test_moment_arms_know_what_the_constraints_hold(name, tmp_path):
    model = load(tmp_path, name)
    z, v = model.skeleton.initial_state()[0] + 0.02, np.ones(len(model.skeleton))
    length, speed, r, _ = model.geometry(z, v)
    slopes = gradient(lambda x: model.geometry(x, v).length, z, 1e-3)
    assert np.abs(r).max() > 0.005
    np.testing.assert_allclose(r, -slopes, rtol=0, atol=1e-8)
    np.testing.assert_allclose(speed, -r @ v, rtol=0, atol=1e-14)


def test_methods_track_a_motion_and_its_replay_gives_it_back(tmp_path):
    model = load(tmp_path, "weld")
    reserves = [em.Reserve(name, 50.0) for name in model.coordinates]
    model = rebuilt(model, list(model.muscles), reserves)
    t = np.linspace(0.0, 0.5, 26)
    motion = em.Motion.from_samples(
        t, model.skeleton.initial_state()[0] + 0.1 * np.sin(4.0 * t[:, None]) ** 2
    )
    settings = em.CosimulationSettings(scheme=em.Scheme.CONSISTENT)
    for result in (
        em.cosimulate(model, motion, settings=settings),
        em.computed_muscle_control(model, motion),
    ):
        assert result.tracking_error_rms() < 1e-4
        again = em.forward_dynamics(model, result.excitations)
        np.testing.assert_allclose(again.coordinates[-1], result.coordinates[-1], rtol=0, atol=1e-5)


def test_a_pose_does_not_depend_on_the_ones_before(tmp_path):
    """To the bit."""
    model = load(tmp_path, "point")
    z, rest = model.skeleton.initial_state()[0], np.zeros(4)
    (there,) = model.state_of_tree(z + 0.2)
    for step in (0.05, 0.1, -0.1):
        model.state_of_tree(z + step)
    np.testing.assert_array_equal(model.state_of_tree(z + 0.2)[0], there)
    with model.skeleton.opened():
        model.skeleton.go_to(z + 0.3, rest, 0.0)
        model.skeleton.go_to(z + 0.2, rest, 0.0)
        np.testing.assert_array_equal(model.skeleton.tree_state()[0], there)


def test_what_may_follow_constraints_is_held_first(tmp_path):
    """Else it is the last one that the constraint knows well enough."""
    text = loop_models.model("distance")
    assert load(tmp_path, "", text).coordinates == ("a", "b", "c", "d", "f", "g")
    free = "<is_free_to_satisfy_constraints>true</is_free_to_satisfy_constraints>"
    model = load(tmp_path, "", text.replace('name="a">', f'name="a">{free}'))
    assert model.coordinates == ("b", "c", "d", "e", "f", "g")


def test_actuators_may_be_on_coordinates_that_are_held(tmp_path):
    """What they do to the independent ones is as coupler and rod have it."""
    text = loop_models.model("distance_and_coupler")
    actuators = "".join(
        f'<CoordinateActuator name="on_{each}"><coordinate>{each}</coordinate></CoordinateActuator>'
        for each in NAMES
    )
    text = text.replace("<ForceSet><objects>", f"<ForceSet><objects>{actuators}")
    model = load(tmp_path, "", text)
    z, v = model.skeleton.initial_state()
    R = gradient(lambda x: model.state_of_tree(x)[0], z, 1e-3)
    rows = [model.skeleton.tree_coordinates.index(each) for each in NAMES]
    np.testing.assert_allclose(model.geometry(z, v).columns.T, R[rows], rtol=0, atol=1e-8)


def test_constraints_of_bodies_that_are_welded_already_do_nothing(tmp_path):
    text = loop_models.model("point")
    model = load(
        tmp_path, "", text.replace("<socket_body_2>/ground", "<socket_body_2>/bodyset/three")
    )
    assert len(model.coordinates) == 7


@pytest.mark.parametrize("locked", ["d", "cd"])
def test_coupled_to_coordinates_that_are_locked(locked, tmp_path):
    """They follow the others, or rest."""
    text, whole = loop_models.model("polynomial"), load(tmp_path, "polynomial")
    for each in locked:
        text = text.replace(
            f'<Coordinate name="{each}">', f'<Coordinate name="{each}"><locked>1</locked>'
        )
    model = load(tmp_path, "", text)
    assert set(model.coordinates) == set("abcdef") - set(locked)
    z = model.skeleton.initial_state()[0] + 0.1
    values = loop_models.DEFAULTS | dict(zip(model.coordinates, z, strict=True))
    (expected,) = whole.state_of_tree(np.array([values[each] for each in whole.coordinates]))
    (found,) = model.state_of_tree(z)
    g = whole.skeleton.tree_coordinates.index("g"), model.skeleton.tree_coordinates.index("g")
    assert found[g[1]] == pytest.approx(expected[g[0]], abs=1e-14)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("polynomial", ">c d<", ">c d e<", "its dimension is that of 3 coordinates"),
        ("polynomial", ">c d<", ">c h<", "there is no coordinate 'h'"),
        ("chain", "0.7 -0.2 0.42", "0.7 0.42", "expected 3 numbers, got 2"),
        ("chain", ">a c<", ">a g<", "dependent coordinates in a circle"),
        ("polynomial", "MultivariatePolynomialFunction", "Sine", "cannot be represented"),
        ("distance", "<constant_distance>", "<constant_distance>-", "rod.*: distance = -0.93"),
        ("distance", "<constant_distance>0", "<constant_distance>1", "loops .* cannot be closed"),
        ("distance", "<constant_distance>0.9346848979873492</constant_distance>", "",
         "there is no constant_distance"),
        ("point", "/bodyset/three</socket_body_1>", "/bodyset/four</socket_body_1>",
         "there is no frame '/bodyset/four'"),
        ("line", "1 2 -0.5", "0 0 0", "line_direction_vec has no length"),
        ("weld", "<socket_frame2>place", "<socket_frame2>nowhere", "there is no frame 'nowhere'"),
        ("weld", "WeldConstraint", "RollingOnSurfaceConstraint", "cannot be represented"),
    ],
)  # fmt: skip
def test_what_is_wrong(name, old, new, message, tmp_path):
    text = loop_models.model(name)
    assert old in text
    with pytest.raises(em.ModelFileError, match=message):
        load(tmp_path, "", text.replace(old, new))


def test_a_run_that_comes_to_a_dead_point_says_so(tmp_path):
    model = load(tmp_path, "point")
    z = model.skeleton.initial_state()[0]
    with pytest.raises(em.ModelError, match=r"closures of the tree's loops .*: a = "):
        model.state_of_tree(z + 2.5)
