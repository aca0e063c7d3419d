"""One chain as a kinematic tree and as bodies with joints: CPU of CSF, in a table.

pytest tests/benchmarks/test_skeletons.py -n 0 -s
"""

import time
import warnings

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import HomogeneousTransformation, InertiaCuboid, TreeLink

import exudyn_muscles as em

from ..skeleton.system.convert import TAIT_BRYAN, as_bodies

LINK = 0.2  # m
SPAN, STEP = 0.5, 0.01  # s
SIZE = {"max_isometric_force": 4000.0, "optimal_fiber_length": 0.12, "tendon_slack_length": 0.1}


def chain(n, muscles):
    """n links in a row about alternating axes, with antagonists from each to the one before."""
    mbs = exu.SystemContainer().AddSystem()
    kinds = (exu.JointType.RevoluteZ, exu.JointType.RevoluteX)
    inertia = InertiaCuboid(5000.0 / n, [0.04, LINK, 0.04]).Translated([0, -LINK / 2, 0])
    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=[
            TreeLink(
                jointType=kinds[k % 2],
                parent=k - 1,
                jointHT=HomogeneousTransformation(np.eye(3), [0, -LINK if k else 0, 0]),
                linkInertia=inertia,
            )
            for k in range(n)
        ],
        gravity=[0, 0, -1.0],
    )
    mbs.Assemble()
    made = []
    for i in range(muscles):
        k, angle = i % n, 2.0 * np.pi * (i // n + 0.25 * (i % 2)) * n / max(muscles, n)
        side = 0.04 * np.array([np.cos(angle), 0.0, np.sin(angle)])
        start = em.PathPoint(side + np.array([0, 0.12 - (LINK if k else 0.0), 0]), link=k - 1)
        made.append(
            em.Muscle(
                f"m{i}", path=[start, em.PathPoint(side - np.array([0, 0.1, 0]), link=k)], **SIZE
            )
        )
    return em.MusculoskeletalModel(
        mbs, tree, made, reserves=[em.Reserve(f"q{k}", 50.0) for k in range(n)]
    )


SIZES = [(5, 20), (10, 40), (20, 80), (40, 160), (60, 200)]


@pytest.fixture(scope="module")
def rows():
    """What was measured, printed at the end: by size and form, what a run costs, what Exudyn alone
    would cost at as many iterations, and iterations a step."""
    found = {}
    yield found
    print("\n\nCPU s a simulated second      tree: all, Exudyn    bodies: all, Exudyn    ratio")
    for n, muscles in SIZES:
        if (n, "tree") in found and (n, "bodies") in found:
            (tree, tree_alone, _), (bodies, alone, iterations) = (
                found[n, form] for form in ("tree", "bodies")
            )
            print(
                f"{n:3d} coordinates, {muscles:3d} muscles {tree:10.3f} {tree_alone:9.3f} "
                f"{bodies:12.3f} {alone:9.3f} {bodies / tree:8.1f}"
                f"   ({iterations:.1f} iterations a step)"
            )


@pytest.mark.parametrize(("n", "muscles"), SIZES)
@pytest.mark.parametrize("form", ["tree", "bodies"])
def test_cosimulation(benchmark, rows, form, n, muscles):
    model = chain(n, muscles)
    if form == "bodies":
        model = as_bodies(model, TAIT_BRYAN)
    motion = em.Motion.from_waypoints([0.0, SPAN], np.array([np.zeros(n), np.full(n, 0.05)]))
    settings = em.CosimulationSettings(scheme=em.Scheme.FULL, step=STEP)

    def run():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return em.cosimulate(model, motion, settings=settings)

    small = n <= 20
    result = benchmark.pedantic(run, rounds=3 if small else 1, warmup_rounds=1 if small else 0)
    counts = result.counts
    iterations = counts.newton_iterations / counts.steps
    alone = seconds_an_iteration(model.mbs, form) * counts.newton_iterations
    rows[n, form] = result.cpu_time / SPAN, alone / SPAN, iterations
    assert result.status is em.Status.COMPLETE


def seconds_an_iteration(mbs, form):
    """CPU s of one of Exudyn's full Newton iterations, with no muscles."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = 5
    settings.timeIntegration.endTime = 5 * STEP
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.newton.useModifiedNewton = False
    settings.solution.file.write = False
    if form == "bodies":  # as a run has it
        settings.linearSolver.solverType = exu.LinearSolverType.EigenDense
    start = time.process_time()
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    return (time.process_time() - start) / mbs.sys["dynamicSolver"].it.newtonStepsCount
