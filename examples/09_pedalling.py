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
print(f"largest gap in the loop: {1e3 * result.max_constraint_drift:.1g} mm")

# As the trapezoidal rule alone leaves it, and closed after every step.
gaps = {}
for closing in (False, True):
    papers = em.CosimulationSettings(scheme=em.Scheme.FULL, project_constraints=closing)
    literal = em.cosimulate(model, motion, settings=papers)
    gaps[closing] = literal.max_constraint_drift
    error = np.degrees(literal.tracking_error_rms()).round(4)
    print(f"CSF, project_constraints={closing}: {1e3 * gaps[closing]:.1g} mm, RMS {error} deg")

out = Path("out")
out.mkdir(exist_ok=True)
em.view.render(model, result, 0.4, out / "pedalling.png")
print(f"wrote {out / 'pedalling.png'}")
