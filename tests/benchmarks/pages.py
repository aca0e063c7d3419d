"""Pages of results: their sizes, how long they take to build, and how fast they play.

`python -m tests.benchmarks.pages` prints the table of `docs/report.md`. It needs chromium; how many
frames a second it shows depends on what draws them, which the last line names.
"""

import statistics
import tempfile
import time
from pathlib import Path

import exudyn_muscles as em
from exudyn_muscles.report.frames import frame_times

from ..report.pages import GAIT, Opened, chromium, of_gait, of_leg, of_pedalling

# What the player does for a frame but drawing it, which is done once and not waited for.
UPDATE = """async () => {
  const { scene, data } = report, draw = scene.render, span = data.end - data.start, found = [];
  scene.render = () => Promise.resolve(true);
  for (let k = 0; k < 100; k++) {
    const begin = performance.now();
    await scene.setTime(span * (k + 0.5) / 100);
    found.push(performance.now() - begin);
  }
  scene.render = draw;
  return found;
}"""
PLAYED = """async (seconds) => {
  const { scene } = report;
  let count = 0;
  scene.on(scene.events.RENDERED, () => { count++; });
  scene.startAutoPlay();
  await new Promise((done) => setTimeout(done, 1000 * seconds));
  scene.stopAutoPlay();
  return count / seconds;
}"""
RENDERER = """() => {
  const gl = report.scene.getWorld().renderer.getContext();
  const told = gl.getExtension("WEBGL_debug_renderer_info");
  return gl.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
}"""
SECONDS = 10.0


def main():
    made = {"models/pedalling.py, 0.5 s": of_pedalling, "models/leg.py, 1 s": of_leg}
    if GAIT.exists():
        made["OpenSim's gait2354, 0.4 s"] = of_gait
    print("| result | segments, muscles | frames | size | CPU time to build | update | played |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        for name, make in made.items():
            model, result = make()
            file = Path(folder) / "page.html"
            em.report(result, file, model=model)  # loads the libraries
            begin = time.process_time()
            em.report(result, file, model=model)
            built = time.process_time() - begin
            opened = Opened(browser, file)
            page = opened.page
            update = statistics.median(page.evaluate(UPDATE))
            played = page.evaluate(PLAYED, SECONDS)
            frames = len(frame_times(result))
            segments = len(model.skeleton.segments().bodies)
            print(
                f"| {name} | {segments}, {len(model.muscles)} | {frames} | "
                f"{file.stat().st_size / 1e6:.1f} MB | {built:.1f} s | {update:.1f} ms | "
                f"{played:.1f} frames/s |"
            )
            assert opened.faults == []
            drawn = page.evaluate(RENDERER)
            page.context.close()
    print(f"drawn by {drawn}")


if __name__ == "__main__":
    main()
