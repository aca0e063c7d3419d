"""How to look at a result: figures for paper, pictures of the moving muscles, Exudyn's viewer.

Writes the figures and three pictures to `out/`; with the argument `--window` it then plays the
motion in Exudyn's SolutionViewer, which needs a display.
"""

import sys
from pathlib import Path

import matplotlib

import exudyn_muscles as em
from exudyn_muscles import plot, view

sys.path.append(str(Path(__file__).resolve().parents[1]))
from models import pendulum

matplotlib.use("Agg")  # figures go to files; without this line they open in windows with plt.show()
out = Path("out")
out.mkdir(exist_ok=True)

model, motion = pendulum.build(), pendulum.motion()
static = em.static_optimization(model, motion)
cmc = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=534.0))
coupled = em.cosimulate(model, motion, settings=em.CosimulationSettings(kp=534.0))

# Figures: each function returns its axes, so that you can go on drawing in them.
plot.comparison(static, cmc, coupled).savefig(out / "comparison.png", dpi=200)
panels = plot.forces(coupled)
for panel in panels:
    panel.axvline(1 / 3, color="0.5", linestyle=":")  # the motion's turning point at 120 deg
panels[0].figure.savefig(out / "forces.png", dpi=200)

# Pictures: muscles are blue at activation 0 and red at 1. They need no display.
for time in (0.0, 0.33, 0.67):
    view.render(model, coupled, time, out / f"pendulum_{round(1000 * time):04d}_ms.png")

print("written:", ", ".join(sorted(file.name for file in out.glob("*.png"))))

# The same in motion. To look at your own run while it is computed, or with your own settings:
#     with view.show_muscles(model, coupled):
#         mbs.SolutionViewer(view.solution(coupled, model))
if "--window" in sys.argv:
    view.view(model, coupled)
