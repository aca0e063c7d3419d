"""What one evaluation of a walking body costs, and what the plugin spares:

    python -m tests.benchmarks.floors

from the repository's root, with OpenSim's gait2354 in `../shared/opensim/cmc`. Prints microseconds
of a call, the least of many, and iterations; asserts nothing.
"""

import warnings
from time import process_time

import numpy as np

import exudyn_muscles as em
from exudyn_muscles.methods import unified
from exudyn_muscles.recruitment import optimization
from exudyn_muscles.recruitment.program import Program
from exudyn_muscles.skeleton import skeleton as skeletons

from .timed import FILES, SETUPS

CASE = SETUPS["gait2354"]
CALLS, ROUNDS = 200, 9


def microseconds(call):
    best = np.inf
    for _ in range(ROUNDS):
        begun = process_time()
        for _ in range(CALLS):
            call()
        best = min(best, process_time() - begun)
    return best / CALLS * 1e6


def evaluations(model, motion):
    """Rows of what is evaluated at a state, by Exudyn and by the plugin."""
    mbs, (q, v, _) = model.mbs, motion(motion.start)
    carry = skeletons.carry
    for label, given in (("forces with the loads at rest", carry), ("with all loads", None)):
        skeletons.carry = given or (lambda *_: None)
        with model.skeleton.opened() as skeleton:
            skeleton.go_to(q, v, motion.start)
            opened, solver = skeleton._opened, skeleton._opened._solver
            yield f"Exudyn's {label}", microseconds(lambda s=solver: s.ComputeODE2RHS(mbs))
            if given is None:
                continue
            yield "what is carried instead", microseconds(opened.carried_here)
            yield "Exudyn's M", microseconds(lambda s=solver: s.ComputeMassMatrix(mbs))
            yield "Exudyn's differences for Newton's matrix", microseconds(opened.slopes)
            yield "paths of all muscles", microseconds(lambda: model.geometry(q, v))
    skeletons.carry = carry


def iterations(model, setup):
    """Rows of iterations of Newton's method in CMC."""
    usual = unified.KEPT
    for kept in (1, usual):
        unified.KEPT = kept
        counts = em.computed_muscle_control(model, setup.motion, settings=setup.settings).counts
        yield (
            f"Newton's a step of CMC, slopes kept for {kept}",
            counts.newton_iterations / counts.steps,
        )
    unified.KEPT = usual


def recruitments(model, setup):
    """Rows of what the quadratic programs of a run of CSF take."""
    programs, usual = [], optimization.from_bounds

    def kept(*program):
        programs.append([np.array(x) for x in program])
        return usual(*program)

    optimization.from_bounds = kept
    em.cosimulate(model, setup.motion, settings=setup.cosimulation(em.Scheme.FULL))
    optimization.from_bounds = usual
    each = [Program(np.eye(x[2].size), np.zeros(x[2].size), *x[:4]) for x in programs]
    for label, solve, given in (
        ("DAQP, from nowhere", optimization.SOLVERS[em.Solver.DAQP], [(x,) for x in each]),
        ("from the bounds of the step before", usual, programs),
    ):
        solve(*given[0])
        costs = [microseconds(lambda x=x, solve=solve: solve(*x)) for x in given]
        yield f"quadratic program of CSF, {label}", np.mean(costs)


def main():
    warnings.simplefilter("ignore", em.ExudynMusclesWarning)
    if not FILES.is_dir():
        raise SystemExit(f"OpenSim's CMC cases are not beside this repository: no {FILES}")
    setup = em.opensim.load_setup(CASE.folder / CASE.setup, **CASE.span)
    print("| gait2354 | us |\n|---|---|")
    for label, cost in evaluations(setup.model, setup.motion):
        print(f"| {label} | {cost:.1f} |")
    for label, cost in recruitments(setup.model, setup):
        print(f"| {label} | {cost:.1f} |")
    print("\n| iterations | |\n|---|---|")
    for label, number in iterations(setup.model, setup):
        print(f"| {label} | {number:.2f} |")


if __name__ == "__main__":
    main()
