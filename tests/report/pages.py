"""Results whose pages are tested, and the browser that opens them."""

import shutil
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import exudyn_muscles as em
from models import leg, pedalling

from ..opensim import REFERENCE

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
NO_PLAYER = "k3d or plotly is not installed: pip install 'exudyn_muscles[report]'"
NO_BROWSER = f"playwright is not installed, or none of {', '.join(BROWSERS)}"
GAIT = REFERENCE.parent / "cmc" / "gait2354" / "subject01_Setup_CMC.xml"
SOFTWARE_GL = [
    "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--disable-gpu-compositing",
]  # fmt: skip


def needs(*modules, reason):
    """Skip unless these can be imported."""
    for module in modules:
        pytest.importorskip(module, reason=reason)


def of_leg():
    stored = Path(__file__).parents[1] / "reference" / "leg_consistent.npz"
    return leg.build(), em.Trajectory.load(stored)


def of_pedalling():
    model = pedalling.build()
    return model, em.static_optimization(model, pedalling.motion().between(0.0, 0.5))


def of_gait():
    setup = em.opensim.load_setup(GAIT)
    settings = setup.cosimulation(em.Scheme.FULL)
    return setup.model, em.cosimulate(setup.model, setup.motion, settings=settings)


RESULTS = {"leg": of_leg, "pedalling": of_pedalling, "gait": of_gait}


@contextmanager
def chromium():
    """A headless browser that has no network."""
    needs("playwright", reason=NO_BROWSER)
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        pytest.skip(NO_BROWSER)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=SOFTWARE_GL)
        yield browser
        browser.close()


class Opened:
    """A page in the browser, and what went wrong in it."""

    def __init__(self, browser, file, width=1280, height=800, before="0"):
        self.faults = []
        context = browser.new_context(viewport={"width": width, "height": height}, offline=True)
        context.add_init_script(before)
        self.page = context.new_page()
        self.page.on("console", self._said)
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("request", self._asked)
        self.page.goto(f"file://{file}")
        self.page.wait_for_selector("body[data-ready=yes]", timeout=90000)

    def _said(self, message):
        if message.type == "error":
            self.faults.append(message.text)

    def _asked(self, request):
        if not request.url.startswith(("file:", "data:", "blob:")):
            self.faults.append(f"asked for {request.url}")

    def chosen(self):
        """Names of the muscles whose curves are shown."""
        return self.page.evaluate("[...report.chosen].map((i) => report.data.muscles[i])")

    def drawn(self):
        """Names of all curves."""
        return self.page.evaluate("document.getElementById('curves').data.map((one) => one.name)")

    def pose(self, segment):
        """The pose (4, 4) of a segment's bones, as the browser has it."""
        elements = self.page.evaluate(
            "(k) => { const bone = report.scene.getObjectById(report.data.results[0].bones[k]);"
            "bone.updateMatrixWorld(); return bone.matrixWorld.elements; }",
            segment,
        )
        return np.reshape(elements, (4, 4)).T

    def go(self, key):
        """Press a key on the slider, and wait until the scene is there."""
        self.page.locator("#time").press(key)
        self.page.wait_for_timeout(400)
        return self.page.evaluate("report.data.start + report.scene.parameters.time")

    def click(self, muscle, result=0):
        """Click on the middle of a muscle's belly."""
        x, y = self.page.evaluate(
            """([name, result]) => {
              const { scene, data } = report, world = scene.getWorld();
              const { muscles, starts } = data.results[result], i = data.muscles.indexOf(name);
              const at = scene.getObjectById(muscles).geometry.attributes.position;
              // Rings of eight, then both ends; the middle ring is that of the belly.
              const ring = starts[i] + 8 * ((starts[i + 1] - starts[i] - 2) / 8 - 1) / 2;
              const middle = world.camera.position.clone().set(0, 0, 0), one = middle.clone();
              for (let k = 0; k < 8; k++) middle.add(one.fromBufferAttribute(at, ring + k));
              world.camera.updateMatrixWorld();
              middle.multiplyScalar(1 / 8).project(world.camera);
              const box = document.querySelector("#scene canvas").getBoundingClientRect();
              return [box.left + (middle.x + 1) / 2 * box.width,
                      box.top + (1 - middle.y) / 2 * box.height];
            }""",
            [muscle, result],
        )
        self.page.mouse.move(x, y)
        self.page.mouse.click(x, y)
        self.page.wait_for_timeout(500)
