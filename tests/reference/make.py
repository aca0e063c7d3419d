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
PAPERS = {"integrator": em.Integrator.TRAPEZOIDAL}
MODELS = {"pendulum": pendulum, "planar_arm": planar_arm, "leg": leg}
FOLDER = Path(__file__).parent


def results():
    """Name -> trajectory of every method on every model by the paper's rule, and of those that make
    smaller files with the default integrator, too."""
    made = {}
    for name, source in MODELS.items():
        model, motion = source.build(), source.motion()
        made |= {f"{name}_{kind}": run for kind, run in windows(model, motion, PAPERS).items()}
        made |= {f"{name}_{kind}_default": run for kind, run in windows(model, motion, {}).items()}
        cmc = em.CMCSettings(kp=KP, **PAPERS)
        made[f"{name}_cmc"] = em.computed_muscle_control(model, motion, settings=cmc)
        made[f"{name}_forward"] = em.forward_dynamics(model, made[f"{name}_cmc"].excitations)
    return made


def windows(model, motion, options):
    """Trajectories of static optimization and all schemes of co-simulation."""
    static = em.StaticSettings(**options)
    made = {"static": em.static_optimization(model, motion, settings=static)}
    for scheme in em.Scheme:
        settings = em.CosimulationSettings(kp=KP, scheme=scheme, **options)
        made[scheme.value] = em.cosimulate(model, motion, settings=settings)
    return made


if __name__ == "__main__":
    for name, trajectory in results().items():
        trajectory.save(FOLDER / f"{name}.npz")
        print(f"{name}: {len(trajectory.time)} points")
