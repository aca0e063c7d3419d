"""The pages of results in a real browser without a network."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from scipy.spatial import ConvexHull

import exudyn_muscles as em
from exudyn_muscles.skeleton.tree import tree_frames
from models import leg, pendulum

from ..opensim import ABSENT
from .pages import GAIT, NO_PLAYER, RESULTS, Opened, chromium, needs

NAMES = list(RESULTS)
# A muscle in front of everything else, where the motion starts and where it ends.
IN_FRONT = {"leg": "extensor_digitorum", "pedalling": "gluteus", "gait": "med_gas_r"}


@pytest.fixture(scope="module")
def browser():
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Model, result and page by name."""
    needs("k3d", "plotly", reason=NO_PLAYER)
    made = {}

    def write(name):
        if name == "gait" and not GAIT.exists():
            pytest.skip(ABSENT)
        if name not in made:
            model, result = RESULTS[name]()
            file = tmp_path_factory.mktemp("pages") / f"{name}.html"
            em.report(result, file, model=model, groups={"front": [IN_FRONT[name]]})
            made[name] = model, result, file
        return made[name]

    return write


@pytest.fixture(scope="module")
def seen(browser, written):
    """The opened page by name; the tests share it, as a browser takes seconds to open one."""
    made = {}

    def opened(name):
        if name not in made:
            made[name] = Opened(browser, written(name)[2])
        return made[name]

    return opened


def places(name, model, result):
    """Where the frames of all segments are (T, s, 3), by the coordinates of the result."""
    if name == "pedalling":  # x of a body begins with its displacement
        start = [np.array(model.mbs.GetNode(k)["referenceCoordinates"][:3]) for k in range(3)]
        return result.system_coordinates.reshape(-1, 3, 7)[:, :, :3] + start
    masses = np.array(model.mbs.GetObject(model.skeleton.object)["linkMasses"])
    (q,) = model.state_of_tree(result.coordinates)
    return np.array([tree_frames(model.skeleton.tree, row)[1][masses > 0.0] for row in q])


@pytest.mark.parametrize("name", NAMES)
def test_the_slider_moves_bones_as_far_as_the_result_says(seen, written, name):
    model, result, _ = written(name)
    opened, expected = seen(name), places(name, model, result)
    moved = 0.0
    for key, row in (("Home", 0), ("End", -1)):
        assert opened.go(key) == pytest.approx(result.time[row], abs=1e-6)
        assert opened.page.locator("#now").inner_text() == f"{result.time[row]:.3f} s"
        for segment, place in enumerate(expected[row]):
            if not opened.page.evaluate("(k) => report.data.results[0].bones[k]", segment):
                continue
            shown = opened.pose(segment)[:3, 3]
            np.testing.assert_allclose(shown, place, atol=1e-5)
            moved = max(moved, float(np.linalg.norm(place - expected[0, segment])))
    assert moved > 0.05
    left = opened.page.evaluate(
        "() => { const box = (id) => document.getElementById(id).getBoundingClientRect();"
        "return [box('cursor').left - box('curves').left, box('curves').width]; }"
    )
    assert left[0] == pytest.approx(left[1] - 12.0, abs=1.5)  # the right end of the curves
    assert opened.faults == []


@pytest.mark.parametrize("name", NAMES)
def test_play_advances_and_stops(seen, name):
    opened = seen(name)
    opened.go("Home")
    before = opened.page.evaluate("report.scene.parameters.time")
    opened.page.locator("#play").click()
    opened.page.wait_for_function(
        "(t) => report.scene.parameters.time > t + 0.02", arg=before, timeout=60000
    )
    opened.page.locator("#play").click()
    assert opened.page.locator("#play").inner_text() == "Play"
    assert not opened.page.evaluate("report.scene.autoPlayed")
    assert opened.faults == []


@pytest.mark.parametrize("name", NAMES)
def test_a_click_on_a_muscle_shows_its_curves(seen, name):
    """Where it is by then."""
    opened, muscle = seen(name), IN_FRONT[name]
    for key in ("Home", "End"):
        opened.go(key)
        opened.page.select_option("#group", label="none")
        assert opened.chosen() == []
        opened.click(muscle)
        assert opened.chosen() == [muscle]
        assert {f"{muscle}: u", f"{muscle}: a", muscle} <= set(opened.drawn())
        pressed = opened.page.locator("#muscles button[aria-pressed=true]")
        assert pressed.all_inner_texts() == [muscle]
    assert opened.faults == []


def test_muscles_are_chosen_by_group_and_in_the_list(seen):
    opened = seen("leg")
    opened.page.select_option("#group", label="strongest five")
    assert len(opened.chosen()) == 5
    opened.page.select_option("#group", label="front")
    assert opened.chosen() == ["extensor_digitorum"]
    opened.page.fill("#filter", "sol")
    visible = opened.page.locator("#muscles button:visible")
    assert visible.all_inner_texts() == ["soleus"]
    visible.click()
    assert opened.chosen() == ["extensor_digitorum", "soleus"]
    opened.page.fill("#filter", "")


@pytest.mark.parametrize("name", NAMES)
def test_the_player_has_few_parts_to_move(seen, written, name):
    """What a frame costs it goes with their number: all muscles are one."""
    opened = seen(name)
    count = opened.page.evaluate("Object.keys(report.scene.getWorld().ObjectsById).length")
    result = opened.page.evaluate("report.data.results[0]")
    bones, moving = sum(map(bool, result["bones"])), len(result["flesh"] + result["surfaces"])
    assert count <= 1 + bones + moving + 3  # ground, and both feet's forces
    assert result["starts"][-1] == opened.page.evaluate(
        "report.scene.getObjectById(report.data.results[0].muscles)"
        ".geometry.attributes.position.count"
    )


@pytest.mark.parametrize("name", NAMES)
def test_pictures(seen, tmp_path, name):
    """Bones, muscles, and no part beyond an edge, on a wide and on a narrow screen."""
    opened = seen(name)
    for width in (390, 1280):
        opened.page.set_viewport_size({"width": width, "height": 844})
        opened.page.wait_for_timeout(1500)
        picture = tmp_path / f"{name}_{width}.png"
        opened.page.locator("#scene").screenshot(path=picture)
        image = imread(picture)[3:-3, 3:-3, :3]  # without lines beside it
        red, green, blue = np.moveaxis(image, -1, 0)
        assert ((red > green) & (green > blue) & (red - blue < 0.25) & (red < 0.9)).mean() > 0.01
        assert (blue > red + 0.2).mean() > 1e-3
        for edge in (image[:2], image[-2:], image[:, :2], image[:, -2:]):
            assert (edge == 1.0).mean() > 0.98  # nothing is cut off
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= width
    assert opened.faults == []


def test_results_side_by_side_and_bones_of_the_users(browser, written, tmp_path):
    """A cube in place of the thigh, and the curves of both results."""
    model, result, _ = written("leg")
    stored = Path(__file__).parents[1] / "reference" / "leg_csf.npz"
    cube = 0.1 * np.array(list(product((0.0, 1.0), repeat=3)))
    meshes = {leg.THIGH: (cube, ConvexHull(cube).simplices)}
    file = tmp_path / "both.html"
    em.report([result, em.Trajectory.load(stored)], file, model=model, meshes=meshes)
    opened = Opened(browser, file)
    assert opened.page.locator("#title").inner_text() == "Consistent CSF | CSF (dashed)"
    vertices, places = opened.page.evaluate(
        "() => { const two = report.data.results.map((one) => "
        "report.scene.getObjectById(one.bones[0])); return ["
        "two.map((bone) => bone.geometry.attributes.position.count),"
        "two.map((bone) => bone.matrixWorld.elements[12])]; }"
    )
    assert vertices == [8, 8]
    assert places[1] - places[0] > 0.3
    opened.page.select_option("#group", label="none")
    opened.click("extensor_digitorum", result=1)
    assert opened.chosen() == ["extensor_digitorum"]
    both = {f"extensor_digitorum, {name}: u" for name in ("Consistent CSF", "CSF")}
    assert both <= set(opened.drawn())
    assert opened.faults == []


def test_what_analyses_found_is_drawn(browser, written, tmp_path):
    model, result, _ = written("pedalling")
    loads = em.analysis.joint_loads(model, result, ["hip", "pedal"])
    emg = em.analysis.EMG(("one",), result.time, np.cos(result.time)[:, None])
    file = tmp_path / "loads.html"
    em.report(result, file, model=model, joint_loads=loads, emg=emg, measured={"gluteus": "one"})
    opened = Opened(browser, file)
    opened.page.select_option("#group", label="all muscles")
    assert {"hip", "pedal", "gluteus: EMG"} <= set(opened.drawn())
    assert "vasti: EMG" not in opened.drawn()
    assert "force in joints [N]" in opened.page.locator("#curves").text_content()
    assert opened.faults == []


NO_WEBGL = """
const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
  return kind.startsWith("webgl") ? null : get.call(this, kind, ...more);
};
"""


def test_without_webgl_the_curves_are_there(browser, written):
    opened = Opened(browser, written("pedalling")[2], before=NO_WEBGL)
    assert "WebGL is off" in opened.page.locator("#scene").inner_text()
    assert opened.page.locator("#curves .scatterlayer .trace").count() > 0
    opened.page.evaluate(
        "() => { const s = document.getElementById('time'); s.value = 0.3;"
        " s.dispatchEvent(new Event('input')); }"
    )
    assert opened.page.locator("#now").inner_text() == "0.300 s"
    assert opened.page.locator("#play").is_disabled()


def test_names_are_no_html(browser, tmp_path):
    needs("k3d", "plotly", reason=NO_PLAYER)
    made = pendulum.build()
    names = ["<script>window.harm = 1</script>", "</script><img src=x onerror='window.harm = 1'>"]
    model = em.MusculoskeletalModel(
        made.mbs,
        made.skeleton.object,
        [replace(muscle, name=name) for muscle, name in zip(made.muscles, names, strict=True)],
        coordinates=["</title>&amp;<b>"],
    )
    result = em.static_optimization(model, pendulum.motion().between(0.0, 0.1))
    em.report(result, tmp_path / "x.html", model=model, groups={"<i>both": names})
    opened = Opened(browser, tmp_path / "x.html")
    assert opened.page.locator("#muscles button").all_inner_texts() == names
    assert opened.page.evaluate("window.harm === undefined")
    assert "&lt;script&gt;window.harm = 1&lt;/script&gt;" in opened.drawn()
    assert opened.faults == []
