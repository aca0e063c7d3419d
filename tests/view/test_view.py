import dataclasses
import os
import subprocess
import sys

import exudyn as exu
import numpy as np
import pytest
from exudyn import graphics
from exudyn.utilities import (
    HTtranslate,
    LoadSolutionFile,
    RigidBodyInertia,
    SetSolutionState,
    TreeLink,
)
from matplotlib.image import imread

import exudyn_muscles as em
from exudyn_muscles import view
from exudyn_muscles.errors import ParameterError
from exudyn_muscles.shapes import bellies
from exudyn_muscles.view.colors import BONE, FLESH, FLESH_OPACITY
from models import pendulum

SETTINGS = em.CosimulationSettings(scheme=em.Scheme.FULL, kp=534.0)


@pytest.fixture
def model():
    return pendulum.build()


@pytest.fixture(scope="module")
def trajectory():
    return em.cosimulate(pendulum.build(), pendulum.motion(), settings=SETTINGS)


def drawn(model):
    """Colors and points of everything that Exudyn would draw now."""
    data = model.mbs.GetSystemContainer().renderer.GetGraphicsData(flatShapes=True)["triangles"]
    return np.array(data["colors"]).reshape(-1, 4), np.array(data["points"]).reshape(-1, 3)


def set_pose(model, q, t):
    model.mbs.systemData.SetODE2Coordinates([q])
    model.mbs.systemData.SetTime(t)


def has_color(colors, rgba):
    return bool((np.abs(colors - np.array(rgba)) < 1e-5).all(axis=1).any())


def same_trajectory(one, other):
    return all(
        np.array_equal(getattr(one, item.name), getattr(other, item.name), equal_nan=True)
        for item in dataclasses.fields(one)
        if isinstance(getattr(one, item.name), np.ndarray)
    )


def test_color_goes_from_blue_to_red():
    low, middle, high = (view.activation_color(a) for a in (0.0, 0.5, 1.0))
    assert low[2] > 2 * low[0] and high[0] > 2 * high[2]
    np.testing.assert_allclose(middle, (np.array(low) + high) / 2)
    assert view.activation_color(7.0) == high
    assert view.activation_color(np.nan)[:3] == view.UNKNOWN


@pytest.mark.parametrize("row", [0, 33, 66])
def test_muscles_have_the_color_of_their_activation(model, trajectory, row):
    set_pose(model, trajectory.coordinates[row, 0], trajectory.time[row])
    with view.show_muscles(model, trajectory):
        colors, _ = drawn(model)
    for activation in trajectory.activations[row]:
        assert has_color(colors, view.activation_color(activation))
    assert not has_color(colors, view.activation_color(0.9))


def test_activation_is_interpolated_in_time(model, trajectory):
    set_pose(model, 0.0, 0.5 * (trajectory.time[30] + trajectory.time[31]))
    with view.show_muscles(model, trajectory):
        colors, _ = drawn(model)
    assert has_color(colors, view.activation_color(trajectory.activations[30:32, 0].mean()))


def test_bellies_thicken_with_force(model, trajectory):
    """And in depth, where a path of the pendulum has none."""
    depth = []
    set_pose(model, trajectory.coordinates[50, 0], trajectory.time[50])
    for force in (0.0, 3000.0):
        forces = np.full_like(trajectory.tendon_forces, force)
        with view.show_muscles(model, dataclasses.replace(trajectory, tendon_forces=forces)):
            colors, points = drawn(model)
        belly = (*view.activation_color(trajectory.activations[50, 0])[:3], 1.0)
        depth.append(np.ptp(points[(np.abs(colors - belly) < 1e-5).all(axis=1), 2]))
    assert depth[0] == pytest.approx(np.sqrt(bellies.RESTING) * depth[1], rel=1e-6)


def test_neutral_color_without_a_trajectory(model):
    with view.show_muscles(model):
        colors, _ = drawn(model)
    assert has_color(colors, (*view.UNKNOWN, 1.0))


def test_drawing_follows_the_pose(model):
    with view.show_muscles(model):
        for angle in (0.0, 1.0):
            set_pose(model, angle, 0.0)
            colors, points = drawn(model)
            tip = pendulum.LENGTH * np.array([np.sin(angle), -np.cos(angle), 0.0])
            bone = points[(np.abs(colors - (*BONE, 1.0)) < 1e-5).all(axis=1)]
            reach = np.linalg.norm(bone, axis=1).max()
            assert pendulum.LENGTH < reach < 1.1 * pendulum.LENGTH
            ball = points[(np.abs(colors - (*FLESH, FLESH_OPACITY)) < 1e-5).all(axis=1)]
            np.testing.assert_allclose(ball.mean(axis=0), tip, atol=1e-3 * pendulum.LENGTH)


def test_nothing_remains_drawn_or_hidden(model, trajectory):
    before = drawn(model)
    for _ in range(3):
        with view.show_muscles(model, trajectory):
            assert len(drawn(model)[0]) != len(before[0])
        np.testing.assert_array_equal(drawn(model)[1], before[1])
    assert model.mbs.GetSystemContainer().NumberOfSystems() == 2


def test_own_graphics_of_the_tree_in_place_of_sticks(model):
    own = drawn(model)[1]
    with view.show_muscles(model, sticks=False):
        colors, points = drawn(model)
    assert has_color(colors, (*view.UNKNOWN, 1.0))
    assert not has_color(colors, (*BONE, 1.0))
    np.testing.assert_array_equal(points[: len(own)], own)
    with view.show_muscles(model):
        colors, points = drawn(model)
    assert has_color(colors, (*BONE, 1.0))
    assert not np.array_equal(points[: len(own)], own)


@pytest.mark.parametrize("offset", [[0.0, 0.0, 0.0], [0.4, 0.3, 0.0]])
def test_the_ground_that_comes_with_a_tree_goes_with_its_graphics(offset):
    """Its block from the base to the first joint; the user's own ground stays."""
    mbs = exu.SystemContainer().AddSystem()
    mine, own = (0.1, 0.9, 0.2, 1.0), tuple(graphics.color.defaultBody)
    mbs.CreateGround(graphicsDataList=[graphics.Brick(size=[0.01] * 3, color=list(mine))])
    inertia = RigidBodyInertia(mass=1.0, inertiaTensor=np.eye(3), com=[0.0, -0.1, 0.0])
    link = TreeLink(
        jointType=exu.JointType.RevoluteZ, parent=-1, linkInertia=inertia,
        jointHT=HTtranslate(offset), graphicsDataList=[],
    )  # fmt: skip
    tree = mbs.CreateKinematicTree(listOfTreeLinks=[link], gravity=[0.0, -9.81, 0.0])
    mbs.Assemble()
    path = [em.PathPoint([0.5, 0.5, 0.0]), em.PathPoint([0.02, -0.1, 0.0], link=0)]
    size = {"optimal_fiber_length": 0.1, "tendon_slack_length": 0.2}
    muscle = em.Muscle("muscle", max_isometric_force=100.0, **size, path=path)
    built = em.MusculoskeletalModel(mbs, tree, [muscle])
    before, _ = drawn(built)
    assert has_color(before, mine) and has_color(before, own) == any(offset)
    with view.show_muscles(built):
        colors, _ = drawn(built)
    assert has_color(colors, mine) and not has_color(colors, own)
    assert np.array_equal(drawn(built)[0], before)


def test_model_and_results_are_undisturbed(model, trajectory, tmp_path):
    motion = pendulum.motion()
    sizes = model.mbs.systemData.ODE2Size(), model.mbs.systemData.NumberOfObjects()
    set_pose(model, 0.3, 0.1)
    with view.show_muscles(model, trajectory):
        inside = em.cosimulate(model, motion, settings=SETTINGS)
    set_pose(model, 0.3, 0.1)
    view.render(model, trajectory, 0.5, tmp_path / "a.png", size=(40, 30))
    assert model.mbs.systemData.GetODE2Coordinates()[0] == 0.3
    assert model.mbs.systemData.GetTime() == 0.1
    after = em.cosimulate(model, motion, settings=SETTINGS)
    assert model.mbs.systemIsConsistent
    assert sizes == (model.mbs.systemData.ODE2Size(), model.mbs.systemData.NumberOfObjects())
    assert same_trajectory(inside, trajectory)
    assert same_trajectory(after, trajectory)


def test_picture_has_its_size_and_colors(model, trajectory, tmp_path):
    file = tmp_path / "picture.png"
    view.render(model, trajectory, 0.33, file, size=(301, 203))
    image = imread(file)[..., :3]
    assert image.shape == (203, 301, 3)
    model_part = image[:, : int(0.84 * 301)]
    blue = model_part[..., 2] > model_part[..., 0] + 0.3
    bone = (np.ptp(model_part, axis=2) < 0.2) & (model_part[..., 0] < 0.9)
    assert blue.sum() > 30 and bone.sum() > 100  # the belly alone has the color
    assert (model_part[0, 150:] == 1.0).all()  # the model is not cut off
    other = tmp_path / "other.png"
    view.render(model, trajectory, 0.67, other, size=(301, 203))
    assert (imread(other)[..., :3] != image).any()


def test_a_picture_leaves_settings_and_view(model, trajectory, tmp_path):
    container = model.mbs.GetSystemContainer()
    container.visualizationSettings.view0.window.renderWindowSize = [90, 70]
    before = container.renderer.RedrawAndGetImage(useRaytracer=True)
    settings = str(container.visualizationSettings.GetDictionary())
    view.render(model, trajectory, 0.5, tmp_path / "a.png", size=(40, 30))
    assert str(container.visualizationSettings.GetDictionary()) == settings
    after = container.renderer.RedrawAndGetImage(useRaytracer=True)
    np.testing.assert_array_equal(after, before)


def test_directions_turn_the_picture(model, trajectory, tmp_path):
    front, back = tmp_path / "front.png", tmp_path / "back.png"
    view.render(model, trajectory, 0.33, front, size=(400, 300))
    mirrored = [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]
    view.render(model, trajectory, 0.33, back, size=(400, 300), directions=mirrored)

    def center(file):
        """Of the box around all that is seen: the light comes from another side of the model."""
        image = imread(file)[40:, :320, :3]
        seen = np.argwhere((image < 0.99).any(axis=2))
        return 0.5 * (seen.min(axis=0) + seen.max(axis=0))

    # The motion is symmetric, so that both pictures look at the same point.
    (row, column), (row_back, column_back) = center(front), center(back)
    assert abs(row - row_back) <= 0.5
    assert abs(column + column_back - 336.0) < 4.0
    assert column > column_back + 50.0


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"time": 1.5}, "outside the trajectory"),
        ({"size": (0, 10)}, "size"),
        ({"directions": np.ones((3, 3))}, "perpendicular"),
    ],
)
def test_render_checks_its_input(model, trajectory, tmp_path, changed, message):
    given = {"time": 0.5, "file": tmp_path / "x.png", **changed}
    with pytest.raises(ParameterError, match=message):
        view.render(model, trajectory, **given)


def test_trajectory_of_another_model(model, trajectory):
    other = dataclasses.replace(trajectory, muscle_names=("a", "b"))
    with pytest.raises(ParameterError, match="another model"):
        view.solution(other, model)
    with pytest.raises(ParameterError, match="another model"), view.show_muscles(model, other):
        pass
    empty = dataclasses.replace(trajectory, time=trajectory.time[:0])
    with pytest.raises(ParameterError, match="no time points"):
        view.solution(empty, model)


def test_solution_is_what_exudyn_loads(model, trajectory, tmp_path):
    """The layout is that of a file which Exudyn's solver wrote for the same system."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = 3
    settings.timeIntegration.endTime = 0.03
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.name = str(tmp_path / "solution.txt")
    model.mbs.SolveDynamic(settings)
    loaded = LoadSolutionFile(str(tmp_path / "solution.txt"), verbose=False)
    made = view.solution(trajectory, model)
    assert made.keys() == loaded.keys()
    assert list(made["columnsExported"]) == list(loaded["columnsExported"])
    assert made["nColumns"] == loaded["nColumns"]
    assert made["data"].shape == (made["nRows"], loaded["data"].shape[1])
    SetSolutionState(model.mbs, made, 40, exu.ConfigurationType.Visualization)
    data = model.mbs.systemData
    assert data.GetTime(exu.ConfigurationType.Visualization) == trajectory.time[40]
    shown = data.GetODE2Coordinates(configuration=exu.ConfigurationType.Visualization)
    np.testing.assert_array_equal(shown, trajectory.coordinates[40])
    SetSolutionState(model.mbs, made, 40, exu.ConfigurationType.Current)
    np.testing.assert_array_equal(data.GetODE2Coordinates_t(), trajectory.speeds[40])
    np.testing.assert_array_equal(data.GetODE2Coordinates_tt(), trajectory.accelerations[40])


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
def test_viewer_without_a_display_is_an_error(tmp_path, trajectory):
    """In a process of its own, which Exudyn's renderer would abort."""
    trajectory.save(tmp_path / "csf.npz")
    script = (
        "import sys, exudyn_muscles as em; from exudyn_muscles import view\n"
        "from models import pendulum\n"
        "try: view.view(pendulum.build(), em.Trajectory.load(sys.argv[1]))\n"
        "except em.DisplayError as error: print('caught:', error)\n"
    )
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "csf.npz")],
        capture_output=True, text=True, env=environment, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "caught:" in done.stdout
