"""A closed loop: a leg of bodies and joints pedals, seen in a picture, and what drifts in it."""

import sys
from pathlib import Path

import numpy as np

import exudyn_muscles as em

sys.path.append(str(Path(__file__).parents[1]))
from models import pedalling

model, motion = pedalling.build(), pedalling.motion()
result = em.cosimulate(model, motion)
print("tracking error (RMS):", np.degrees(result.tracking_error_rms()).round(4), "deg")
print("largest forces:", result.muscle_names, result.tendon_forces.max(axis=0).round(), "N")
print(f"largest gap in the loop: {1e3 * result.max_constraint_drift:.2f} mm")

closing = em.CosimulationSettings(project_constraints=True)
closed = em.cosimulate(model, motion, settings=closing)
print(f"closed after every step: {1e3 * closed.max_constraint_drift:.0e} mm, tracking error (RMS):",
      np.degrees(closed.tracking_error_rms()).round(4), "deg")  # fmt: skip

out = Path("out")
out.mkdir(exist_ok=True)
em.view.render(model, result, 0.4, out / "pedalling.png")
print(f"wrote {out / 'pedalling.png'}")
