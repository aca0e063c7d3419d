"""Excitations of a published walk beside measured EMG, under every criterion: the table of
`docs/analysis.md`.

    python -m tests.benchmarks.emg

from the repository's root; its files are in `../shared`. Asserts nothing, and nothing is tuned;
the last two criteria know the EMG up to a scale for each muscle.
"""

import sys
import time
import warnings
from dataclasses import replace

import numpy as np

import exudyn_muscles as em
from exudyn_muscles import analysis, operators

from ..opensim import REFERENCE

WALK = REFERENCE.parent / "emg18"
ARM = REFERENCE.parent / "cmc" / "arm26_emg"
SETTLED = 0.05  # s: from a start where the muscle is nearly at rest
# The file does not say of which leg: its soleus works while the left foot is on its plate.
SAME = {
    "soleus_l": "soleus",
    "gasmed_l": "gastrocnemius",
    "tibant_l": "tibialis_anterior",
    "semimem_l": "hamstrings",
    "bfsh_l": "biceps_femoris",
    "vasint_l": "vastus",
    "recfem_l": "rectus_femoris",
    "glmax2_l": "gluteus",
}
SPAN = 0.84, 1.98  # s: EMG is known, and a foot that stands is on a plate
# Reserves [N m or N]: strong where 18 muscles of the sagittal plane cannot do what is demanded, on
# pelvis, trunk, and the hips' adduction and rotation, or muscles would pull against each other to
# help there; weak elsewhere.
OUT_OF_PLANE = ("pelvis", "lumbar", "hip_adduction", "hip_rotation")
STRONG, WEAK = 50.0, 5.0


def criteria(model, motion, emg):
    """Settings by the name of what is least."""
    for normalizer in (em.MaximumIsometricForce(), em.ReachableMaximum(), em.RigidTendonForce()):
        yield f"squares over {type(normalizer).__name__}", {"normalizer": normalizer}
    for exponent in (3.0, 5.0, 10.0):
        yield f"power {exponent:g}", {"criterion": em.PoweredForces(exponent)}
    for exponent in (2.0, 3.0):
        yield f"activations, power {exponent:g}", {"criterion": em.PoweredActivations(exponent)}
    yield "largest force", {"criterion": em.MinMax()}
    yield "largest activation", {"criterion": em.MinMax(em.Quantity.ACTIVATION)}
    weights = em.volume_weights(model.muscles)
    yield "activations, volumes", {"criterion": em.PoweredActivations(), "weights": weights}
    for weight in (1.0, 10.0):
        scaled = analysis.fit_emg_scales(model, motion, emg, SAME, weight=weight)
        yield f"EMG followed, weight {weight:g}", {"criterion": scaled.criterion}


def walk():
    """The model with the operators that its publishers chain, and its motion."""
    model = em.opensim.load_model(
        WALK / "subject_walk_armless_18musc.osim", external_loads=WALK / "external_loads.xml"
    )
    motion = em.Motion.from_file(
        WALK / "coordinates.mot", model.coordinates, model.skeleton.units, cutoff=6.0
    )
    muscles = operators.replace_law(model.muscles, em.DeGrooteFregly2016())
    muscles = operators.ignore_passive_fiber_forces(muscles)
    muscles = operators.scale_active_fiber_force_curve_width(muscles, 1.5)
    reserves = [
        em.Reserve(name, STRONG if name.startswith(OUT_OF_PLANE) else WEAK)
        for name in model.coordinates
    ]
    return model.replace(muscles=muscles, reserves=reserves), motion.between(*SPAN)


def arm():
    """Rows of the arm whose published set-up tracks a long biceps with an activation that nothing
    of the motion asks for."""
    setup = em.opensim.load_setup(ARM / "arm26_Setup_ComputedMuscleControl_EMG.xml")
    emg = analysis.EMG.from_file(ARM / "muscle_emg.sto")
    course = {"BIClong": emg.courses({"BIClong": "BIClong.activation"}, delay=0.0)["BIClong"]}
    limits = dict(setup.settings.control_limits)
    given = limits.pop("BIClong")
    settings = em.CosimulationSettings(control_limits=limits)
    cases = {
        "squares (10)": settings,
        "squares of activations": replace(settings, criterion=em.PoweredActivations()),
        "power 3 of activations": replace(settings, criterion=em.PoweredActivations(3.0)),
        "largest activation": replace(settings, criterion=em.MinMax(em.Quantity.ACTIVATION)),
    }
    for weight in (1.0, 10.0, 1000.0):
        followed = em.Followed(course, weight=weight)
        cases[f"EMG followed, weight {weight:g}"] = replace(settings, criterion=followed)
    cases["excitations given, as the set-up is read"] = replace(
        settings, control_limits={**limits, "BIClong": given}
    )
    em.cosimulate(setup.model, setup.motion, settings=settings)  # loads kernels
    for name, each in cases.items():
        start = time.process_time()
        result = em.cosimulate(setup.model, setup.motion, settings=each)
        cpu = time.process_time() - start
        a = result.activations[:, result.muscle_names.index("BIClong")]
        e = np.interp(result.time, *course["BIClong"])
        later = result.time > result.time[0] + SETTLED
        x, y = a[later], e[later]
        error = np.abs(result.coordinates - result.desired_coordinates).max()
        unmet = np.abs(result.torques_unmet).max()
        yield (
            f"| {name} | {cpu:.2f} | {np.corrcoef(x, y)[0, 1]:.2f} | "
            f"{np.sqrt(np.mean((x - y) ** 2)):.3f} | {np.degrees(error):.3f} | {unmet:.2g} |"
        )


def main():
    warnings.simplefilter("ignore", em.ExudynMusclesWarning)
    if not WALK.is_dir():
        sys.exit(f"{WALK} is absent")
    model, motion = walk()
    emg = analysis.EMG.from_file(WALK / "emg.sto").normalized()
    print("| criterion | CPU s | " + " | ".join(SAME.values()) + " | mean |")
    print("|---|---|" + "---|" * (len(SAME) + 1))
    em.static_optimization(model, motion)  # compiles kernels
    for name, options in criteria(model, motion, emg):
        start = time.process_time()
        result = em.static_optimization(model, motion, settings=em.StaticSettings(**options))
        cpu = time.process_time() - start
        found = analysis.compare_emg(result, emg, SAME)
        cells = [f"{x.correlation:.2f}, {x.rms:.2f}" for x in found.values()]
        mean = np.mean([(x.correlation, x.rms) for x in found.values()], axis=0)
        print(f"| {name} | {cpu:.2f} | {' | '.join(cells)} | {mean[0]:.2f}, {mean[1]:.2f} |")
    print("\n| arm26 | CPU s | correlation | RMS | tracking [deg] | unmet [N m] |")
    print("|---|---|---|---|---|---|")
    for row in arm():
        print(row)


if __name__ == "__main__":
    main()
