"""A muscle law of your own: measured points for one curve, formulas for the others.

The pendulum's muscles become those of a frog and do the same motion. Whatever the curves come from,
they run at the speed of the built-in ones: only the pieces they are cut into meet the simulation.
"""

import dataclasses
import sys
from pathlib import Path

import matplotlib
import numpy as np

import exudyn_muscles as em

sys.path.append(str(Path(__file__).resolve().parents[1]))
from models import pendulum

matplotlib.use("Agg")
out = Path("out")
out.mkdir(exist_ok=True)

# The corners of the tension over the sarcomere length [um] by A. M. Gordon, A. F. Huxley and
# F. J. Julian, J. Physiol. 184 (1966), 170-192; the optimal length is the middle of the plateau.
sarcomere = np.array([1.27, 1.67, 2.00, 2.25, 3.65]) / 2.125
tension = [0.0, 0.84, 1.0, 1.0, 0.0]


def force_velocity(v):
    """Hill's hyperbola (1938) with a/F0 = 0.25; its continuation beyond v = 0 is made up."""
    return (1 + v) / (1 - 4 * v) if v < 0 else 1.4 - 0.4 / (1 + 12.5 * v)


frog = em.CustomLaw(
    "frog",
    active_force_length=(sarcomere, tension),
    force_velocity=force_velocity,
    passive_force_length=lambda x: 4 * np.maximum(x - 1, 0) ** 2,  # made up: F0 at 1.5
    tendon_force_length=lambda x: (np.maximum(x - 1, 0) / 0.04) ** 2,  # made up: F0 at 4 %
    fiber_damping=0.1,  # where f_l is zero, something else has to keep the fibre's speed finite
)
em.plot.curves(frog, em.DeGrooteFregly2016())[0].figure.savefig(out / "laws.png", dpi=200)

human, motion = pendulum.build(), pendulum.motion()
muscles = [dataclasses.replace(muscle, law=frog) for muscle in human.muscles]
amphibian = em.MusculoskeletalModel(
    human.mbs, human.skeleton.object, muscles, coordinates=human.coordinates
)
for model, name in ((human, "De Groote"), (amphibian, "frog")):
    result = em.cosimulate(model, motion, settings=em.CosimulationSettings(kp=534.0))
    error = np.degrees(result.tracking_error_rms()[0])
    largest = result.excitation_values.max()
    print(f"{name:9}: largest excitation {largest:.3f}, tracking error {error:.4f} deg (RMS)")

# The fibre lengths and velocities that the motion used, on the force that the muscle has there.
em.plot.muscle(muscles[0], result).figure.savefig(out / "left_muscle.png", dpi=200)
