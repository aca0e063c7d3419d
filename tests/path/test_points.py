"""Path points and paths: what is not one is refused by name."""

import numpy as np
import pytest

import exudyn_muscles as em

from .trees import paths_of

PARAMETERS = {"max_isometric_force": 1.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.1}


@pytest.mark.parametrize(
    "position",
    [[0.0, 0.0], [0.0] * 4, [0.0, 0.0, np.nan], [np.inf, 0.0, 0.0], None, 1.0, ["x", 0, 0], []],
)
def test_bad_position(position):
    with pytest.raises(em.ParameterError, match="position is three finite numbers"):
        em.PathPoint(position)


@pytest.mark.parametrize("link", [-2, 0.5, 1.0, np.nan, np.inf, None, "0", [0], True])
def test_bad_link(link):
    with pytest.raises(em.ParameterError, match="link is the number of a link"):
        em.PathPoint([0.0, 0.0, 0.0], link=link)


def test_good_point():
    point = em.PathPoint(np.array([1, 2, 3]), link=np.int64(4))
    assert point.position == (1.0, 2.0, 3.0)
    assert point.link == 4
    assert em.PathPoint([0, 0, 0]).link == -1


def test_paths_as_arrays():
    ground, first, second = (em.PathPoint([k, 0, 0], link=k) for k in (-1, 0, 1))
    muscles = em.MuscleSet(
        [
            em.Muscle("a", **PARAMETERS, path=[ground, first]),
            em.Muscle("b", **PARAMETERS, path=[ground, first, second]),
        ]
    )
    paths = paths_of(muscles, 2)
    np.testing.assert_array_equal(paths.starts, [0, 2, 5])
    np.testing.assert_array_equal(paths.links, [-1, 0, -1, 0, 1])
    np.testing.assert_array_equal(paths.positions[:, 0], [-1, 0, -1, 0, 1])


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ([], "'soleus': a path needs at least two points, got 0"),
        ([em.PathPoint([0, 0, 0])], "'soleus': a path needs at least two points, got 1"),
        (
            [em.PathPoint([0, 0, 0]), em.PathPoint([0, 0, 0], link=2)],
            "'soleus': path point 1 is on link 2, but the tree has links 0 to 1",
        ),
        ([[0, 0, 0], [1, 0, 0]], r"'soleus': path point 0 is a PathPoint, got \[0, 0, 0\]"),
    ],
)
def test_bad_path_names_the_muscle(path, message):
    with pytest.raises(em.ParameterError, match=message):
        paths_of(em.MuscleSet([em.Muscle("soleus", **PARAMETERS, path=path)]), 2)


def test_coordinates_of_moving_points_are_kept_as_floats():
    point = em.MovingPathPoint(1, np.float32(0.5), 0, coordinate=0)
    assert [type(x) for x in (point.x, point.y, point.z)] == [float] * 3


def test_which_paths_cross_a_joint():
    """By points on several links, by surfaces, and by what moves with a coordinate."""
    ends = [em.PathPoint([0, 0, 0]), em.PathPoint([1, 0, 0])]
    curve = em.simm_spline([0.0, 1.0], [0.0, 0.1])
    moving = em.MovingPathPoint(curve, 0.0, 0.0, coordinate=0)
    cases = [
        (ends, [], False),
        ([ends[0], em.PathPoint([1, 0, 0], link=0)], [], True),
        ([em.PathPoint(x, link=0) for x in np.eye(3)[:2]], [], False),
        (ends, [em.WrapSphere(0.1, link=0)], True),
        (ends, [em.WrapSphere(0.1)], False),
        ([ends[0], moving, ends[1]], [], True),
        (em.FunctionPath([(0.3, {})]), [], False),
        (em.FunctionPath([(0.3, {}), (0.1, {0: 1})]), [], True),
        (ends, [], False),
    ]
    muscles = [
        em.Muscle(f"muscle {i}", **PARAMETERS, path=path, wraps=wraps)
        for i, (path, wraps, _) in enumerate(cases)
    ]
    paths = paths_of(muscles, 1)
    found = [paths.crosses_a_joint(i) for i in range(len(cases))]
    assert found == [crosses for *_, crosses in cases]
