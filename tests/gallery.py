"""The pictures of README and docs: `python -m tests.gallery`.

Those of pages need chromium, and those of a walk OpenSim's gait2354; without them they are left as
they are, and it is said.
"""

from pathlib import Path

import numpy as np
import pytest

import exudyn_muscles as em
from models import pendulum

from .report.pages import GAIT, Opened, chromium, of_gait, of_leg, of_pedalling

FOLDER = Path(__file__).parents[1] / "docs" / "gallery"
WIDTHS = {1280: 844, 390: 844}  # of a desktop and of a phone [pixels], with their heights


def turned(angle, down):
    """Directions of a viewer who stands at an angle about the vertical and looks down [deg]."""
    a, b = np.radians([angle, down])
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    to_viewer = np.array([np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)])
    return np.array([right, np.cross(to_viewer, right), to_viewer])


def of_pendulum():
    model = pendulum.build()
    return model, em.cosimulate(model, pendulum.motion())


def pictures():
    """Name, model with result, time [s], size [pixels] and directions of Exudyn's pictures."""
    yield "leg", of_leg(), 0.28, (760, 560), turned(25.0, 10.0)
    yield "pendulum", of_pendulum(), 0.33, (480, 400), np.eye(3)
    yield "pedalling", of_pedalling(), 0.2, (480, 400), turned(20.0, 10.0)
    if GAIT.exists():
        yield "walk", of_gait(), 1.15, (480, 560), turned(35.0, 8.0)


def pages():
    """Name and model with result of the pages."""
    yield "leg", of_leg()
    if GAIT.exists():
        yield "walk", of_gait()


def main():
    FOLDER.mkdir(exist_ok=True)
    for name, (model, result), time, size, directions in pictures():
        file = FOLDER / f"{name}.png"
        em.view.render(model, result, time, file, size=size, directions=directions)
        print(f"wrote {file}")
    try:
        with chromium() as browser:
            for name, (model, result) in pages():
                photographed(browser, name, model, result)
    except pytest.skip.Exception as reason:
        print(f"no pictures of pages: {reason}")
    if not GAIT.exists():
        print(f"no pictures of a walk: {GAIT} is absent")


def photographed(browser, name, model, result):
    """Pictures of a page in the middle of its motion."""
    page = FOLDER / f"{name}.html"
    em.report(result, page, model=model)
    for width, height in WIDTHS.items():
        opened = Opened(browser, page, width, height)
        opened.page.evaluate("report.scene.setTime(0.5 * (report.data.end - report.data.start))")
        opened.page.wait_for_timeout(1500)
        file = FOLDER / f"{name}_page_{width}.png"
        opened.page.screenshot(path=file)
        assert opened.faults == []
        print(f"wrote {file}")
    page.unlink()


if __name__ == "__main__":
    main()
