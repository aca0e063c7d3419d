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
print("largest forces [N]:", dict(zip(result.muscle_names, result.tendon_forces.max(axis=0).round())))
print(f"largest gap in the loop: {1e6 * result.constraint_drift.max():.1f} um")

out = Path("out")
out.mkdir(exist_ok=True)
em.view.render(model, result, out / "pedalling.png", time=0.4)
print(f"wrote {out / 'pedalling.png'}")
