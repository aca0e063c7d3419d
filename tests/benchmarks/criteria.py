"""What criteria of recruitment do and cost: the tables of `docs/recruitment.md`.

    python -m tests.benchmarks.criteria

from the repository's root; the full-body walk is in `../shared`. Asserts nothing.
"""

import time
import warnings
from dataclasses import replace

import numpy as np

import exudyn_muscles as em
from exudyn_muscles.recruitment.normalizers import SMALLEST_SHARE
from models import leg

from ..opensim import REFERENCE

WALK = REFERENCE.parent / "cmc" / "gait2354" / "subject01_Setup_CMC.xml"
ACTIVE = 0.05  # activation from which on a muscle is counted as used
MODES = 4


def criteria(model, motion, settings):
    """Settings by what is least; measured courses and modes are those of squared activations."""
    squares = {"criterion": em.PoweredActivations()}
    yield "squares of F/N (10), N the reachable maximum", {}
    yield "squares of F/F0", {"normalizer": em.MaximumIsometricForce()}
    for exponent in (3.0, 10.0):
        yield f"power {exponent:g} of F/N", {"criterion": em.PoweredForces(exponent)}
    yield "squares of activations", squares
    yield "power 3 of activations", {"criterion": em.PoweredActivations(3.0)}
    yield (
        "squares of activations times volumes",
        {**squares, "weights": em.volume_weights(model.muscles)},
    )
    yield "largest F/N", {"criterion": em.MinMax()}
    yield "largest activation", {"criterion": em.MinMax(em.Quantity.ACTIVATION)}
    given = em.static_optimization(model, motion, settings=replace(settings, **squares))
    rows = np.isin(given.time, given.window_time)
    course = given.time[rows], np.clip(1.5 * given.activations[rows, 0], 0.0, 1.0)
    followed = em.Followed({model.muscles.names[0]: course}, weight=10.0)
    yield "first muscle follows half as much again", {"criterion": followed}
    modes = em.analysis.fit_synergies(given, MODES)
    yield f"{MODES} synergies, weight 100", {"criterion": em.Synergies(modes, weight=100.0)}


def table(model, motion, limits):
    span = motion.end - motion.start
    static = em.StaticSettings(control_limits=limits)
    cosimulation = em.CosimulationSettings(control_limits=limits, scheme=em.Scheme.FULL)
    print(
        "| least is | static, CPU s/s | CSF, CPU s/s | largest activation | sum of squared |",
        end="",
    )
    print(" muscles in use | forces other than by (10) |")
    print("|---|---|---|---|---|---|---|")
    F0, plain = model.muscles.max_isometric_force, None
    em.static_optimization(model, motion, settings=static)
    em.cosimulate(model, motion.between(motion.start, motion.start + 0.05), settings=cosimulation)
    for name, given in criteria(model, motion, static):
        cells = []
        for run, settings in (
            (em.static_optimization, static),
            (em.cosimulate, cosimulation),
        ):
            start = time.process_time()
            result = run(model, motion, settings=replace(settings, **given))
            cells.append(f"{(time.process_time() - start) / span:.2f}")
            if run is em.static_optimization:
                found = result
        a = found.activations
        plain = found.tendon_forces if plain is None else plain
        off = np.sqrt((((found.tendon_forces - plain) / F0) ** 2).mean())
        used = (a > ACTIVE).sum(axis=1).mean()
        lost = f" ({result.counts.not_preferred})" if result.counts.not_preferred else ""
        print(
            f"| {name}{lost} | {' | '.join(cells)} | {a.max():.3f} | "
            f"{(a * a).sum(axis=1).mean():.3f} | {used:.1f} | {off:.3f} |",
            flush=True,
        )


def linear_between(model, motion):
    """How far activations are from what criteria count: linear in the force between those at its
    limits. Largest and mean over windows, halfway between the limits."""
    from exudyn_muscles.muscle.window import DEFAULT_TOLERANCE, Integrator
    from exudyn_muscles.recruitment.windows import (
        MuscleState,
        Windows,
        excite,
        open_window,
        reach_end,
    )

    result = em.static_optimization(model, motion)
    m = len(model.muscles)
    windows = Windows(model.muscles, DEFAULT_TOLERANCE, Integrator.TRAPEZOIDAL)
    u, off = np.array([model.muscles.minimum_activation, np.ones(m)]), []
    place = zip(result.coordinates, result.speeds, strict=True)
    geometry = [model.geometry(q, v) for q, v in place]
    for k in range(result.time.size - 1):
        here, there = geometry[k], geometry[k + 1]
        state = MuscleState(
            result.activations[k], result.tendon_lengths[k], here.length, here.lengthening_speed
        )
        window = open_window(windows, state, result.time[k + 1] - result.time[k], u)
        reach = reach_end(window, there.length, there.lengthening_speed)
        end = excite(reach, 0.5 * (reach.low + reach.high)).activation
        off.append(np.abs(end - reach.ends[0].mean(axis=0)))
    print(f"activations off the line: {np.max(off):.3g} at most, {np.mean(off):.3g} in the mean")


def knee_loads():
    """What the knee of the leg bears by static optimization, and what that costs in squares."""
    print("\n| criterion | largest load | mean load | squares |")
    print("|---|---|---|---|")
    spared = [em.JointLoad("knee", force) for force in (1000.0, 300.0, 30.0)]
    for criterion in (em.SquaredForces(), *spared):
        model = leg.build()
        settings = em.StaticSettings(criterion=criterion)
        result = em.static_optimization(model, leg.motion(), settings=settings)
        loads = em.analysis.joint_loads(model, result, ["knee"])
        size = np.linalg.norm(loads["force"], axis=1)
        N = np.maximum(result.force_max, SMALLEST_SHARE * model.muscles.max_isometric_force)
        squares = ((result.force_optimal / N) ** 2).sum(axis=1).mean()
        print(f"| `{criterion}` | {size.max():.0f} N | {size.mean():.0f} N | {squares:.3f} |")


def main():
    warnings.simplefilter("ignore", em.ExudynMusclesWarning)
    print("leg of `models/leg.py`:\n")
    table(leg.build(), leg.motion(), {})
    linear_between(leg.build(), leg.motion())
    knee_loads()
    if WALK.is_file():
        print(f"\n{WALK.parent.name}, the published CMC set-up:\n")
        setup = em.opensim.load_setup(WALK)
        table(setup.model, setup.motion, setup.settings.control_limits)
        linear_between(setup.model, setup.motion)
    else:
        print(f"{WALK} is absent")


if __name__ == "__main__":
    main()
