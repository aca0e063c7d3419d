"""Make the stored results of all methods on all models anew:

    python -m tests.reference.make

The tolerances with which `tests/test_reference.py` compares are those of `Trajectory.compare`:
motion and torques agree between machines to rounding; forces and activations depend on the window
integration, whose steps may differ by rounding, and agree to its tolerance of 1e-4 F0.
"""

from pathlib import Path

import exudyn_muscles as em
from models import leg, pendulum, planar_arm

KP = 534.0  # the paper's gain, see the README
MODELS = {"pendulum": pendulum, "planar_arm": planar_arm, "leg": leg}
FOLDER = Path(__file__).parent


def results():
    """Name -> trajectory of every method on every model."""
    made = {}
    for name, source in MODELS.items():
        model, motion = source.build(), source.motion()
        made[f"{name}_static"] = em.static_optimization(model, motion)
        made[f"{name}_cmc"] = em.computed_muscle_control(
            model, motion, settings=em.CMCSettings(kp=KP)
        )
        for scheme in em.Scheme:
            settings = em.CosimulationSettings(kp=KP, scheme=scheme)
            made[f"{name}_{scheme.value}"] = em.cosimulate(model, motion, settings=settings)
        made[f"{name}_forward"] = em.forward_dynamics(model, made[f"{name}_cmc"].excitations)
    return made


if __name__ == "__main__":
    for name, trajectory in results().items():
        trajectory.save(FOLDER / f"{name}.npz")
        print(f"{name}: {len(trajectory.time)} points")
