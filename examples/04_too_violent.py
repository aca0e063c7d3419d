"""What happens when the muscles cannot follow: a motion twice as fast as the paper's.

The methods then differ, because each estimates the end of the step in its own way (the last
paragraph of the paper). None stops: each delivers the nearest torque within reach and says how far
it falls short. Once behind, the feedback asks for ever more, so that the demand grows with the
error.
"""

import sys
import warnings
from pathlib import Path

import numpy as np

import exudyn_muscles as em

sys.path.append(str(Path(__file__).resolve().parents[1]))
from models import pendulum

model = pendulum.build()
violent = em.Motion.from_waypoints([0, 1 / 6, 2 / 6, 1 / 2], np.radians([180, 120, 240, 180]))
gain = {"kp": 534.0}

with warnings.catch_warnings():
    # Reported below: they fall short, and lose the motion by it.
    warnings.simplefilter("ignore", em.UnmetTorqueWarning)
    warnings.simplefilter("ignore", em.TrackingWarning)
    results = [
        em.static_optimization(model, violent),
        em.computed_muscle_control(model, violent, settings=em.CMCSettings(**gain)),
        em.cosimulate(
            model, violent, settings=em.CosimulationSettings(scheme=em.Scheme.FULL, **gain)
        ),
        em.cosimulate(
            model, violent, settings=em.CosimulationSettings(scheme=em.Scheme.SIMPLIFIED, **gain)
        ),
    ]

for result in results:
    short = np.abs(result.torques_unmet[:, 0])
    line = (
        f"{result.method:7} falls short in {np.count_nonzero(short):2} of {len(short)} windows, "
        f"by up to {short.max():5.1f} N m"
    )
    if result is not results[0]:  # static optimization does not move the skeleton
        line += f"; tracking error {np.degrees(result.tracking_error_rms()[0]):5.2f} deg (RMS)"
    print(line)
    if off := result.tracking_report():
        print(f"{'':7} {result.status.name}: {off}")
print("csf:", results[2].unmet_torque_report())
