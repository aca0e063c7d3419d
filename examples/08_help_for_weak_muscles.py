"""A leg with weak muscles: who falls short, and what reserves on its coordinates have to add."""

import dataclasses
import sys
import warnings
from pathlib import Path

import numpy as np

import exudyn_muscles as em

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from models import leg

model, motion = leg.build(), leg.motion()
weak = [
    dataclasses.replace(muscle, max_isometric_force=0.3 * muscle.max_isometric_force)
    for muscle in model.muscles
]
# Excitations may not rise above 0.8 at once, but over the first half second.
rising = em.ControlLimits(minimum=0.0, maximum=([0.0, 0.5], [0.5, 0.8]))
settings = em.CosimulationSettings(
    kp=400.0, control_limits={"iliopsoas": rising}, normalizer=em.MaximumIsometricForce()
)


def weakened(reserves=()):
    """The leg with the weak muscles, on the same Exudyn system."""
    return em.MusculoskeletalModel(
        model.mbs,
        model.skeleton.object,
        weak,
        coordinates=leg.COORDINATES,
        dependent_coordinates=model.dependent_coordinates,
        reserves=reserves,
    )


with warnings.catch_warnings():
    warnings.simplefilter("ignore", em.UnmetTorqueWarning)  # both printed below
    warnings.simplefilter("ignore", em.TrackingWarning)
    alone = em.cosimulate(weakened(), motion, settings=settings)
print("alone:", alone.unmet_torque_report().replace("; ", "\n       "))
print("      ", alone.tracking_report().replace("; ", "\n       "))

# The smaller the optimal force, the dearer: these help only where the muscles do not suffice.
reserves = [em.Reserve(name, optimal_force=1.0) for name in model.coordinates]
helped = em.cosimulate(weakened(reserves), motion, settings=settings)
print("with reserves:", helped.unmet_torque_report() or "everything met")
print("  reserves gave", helped.reserve_report().replace("; ", "\n                "))
print("  largest error:", np.degrees(np.abs(helped.tracking_errors()).max()).round(2), "deg")
