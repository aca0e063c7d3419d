"""One run of Exudyn's implicit trapezoidal solver with a plugin, as the methods use it."""

from __future__ import annotations

import math
from functools import partial

import exudyn as exu
import numpy as np

from ..errors import ParameterError
from ..results.trajectory import Trajectory
from ..skeleton.hold import hold
from .plugin import Plugin

# Far below any torque of interest and above the rounding of the recruited torques (1e-12 N m).
ABSOLUTE_TOLERANCE = 1e-9
RELATIVE_TOLERANCE = 1e-8
# Coordinates of a tree up to which Exudyn's own dense solver, which inverts, is as fast as Eigen's.
SMALL = 20


def number_of_steps(start: float, end: float, step: float) -> int:
    """Whole steps in the span; a last incomplete one is left out.

    Raises
    ------
    ParameterError
        Not even one step fits.
    """
    steps = math.floor((end - start) / step * (1.0 + 1e-12) + 1e-9)
    if steps < 1:
        raise ParameterError(f"step = {step:g} s is longer than the span of {end - start:g} s")
    return steps


def simulate(
    plugin: Plugin,
    step: float,
    initial: tuple[np.ndarray, np.ndarray] | None,
    *,
    modified_newton: bool,
    end: float = math.inf,
    whole: tuple[np.ndarray, np.ndarray] | None = None,
) -> Trajectory:
    """Run the plugin over its span, to `end` at most, in fixed steps from `initial` q, q', or the
    mbs's own; `whole` are all coordinates and speeds of the system there, if they are known.

    Modified Newton pays where the Newton matrix costs more than the torque.
    The initial state of the user's `mbs` is as before afterwards.
    """
    skeleton = plugin.skeleton
    skeleton.check_assembled()
    steps = number_of_steps(plugin.start_time, min(plugin.end_time, end), step)
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.startTime = plugin.start_time
    integration.endTime = plugin.start_time + steps * step
    integration.numberOfSteps = steps
    integration.minimumStepSize = step / 1024
    integration.verboseMode = 0
    # Of dependent coordinates the plugin knows them, even with a singular M.
    knows = skeleton.known_to_exudyn
    integration.generalizedAlpha.computeInitialAccelerations = knows
    integration.newton.useModifiedNewton = modified_newton
    integration.newton.relativeTolerance = RELATIVE_TOLERANCE
    integration.newton.absoluteTolerance = ABSOLUTE_TOLERANCE
    if skeleton.system_names or skeleton.width > SMALL:
        settings.linearSolver.solverType = exu.LinearSolverType.EigenDense
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = step
    state = plugin.new_state()
    with hold(skeleton.mbs) as held:
        held.keep(partial(skeleton.set_initial_arrays, *skeleton.initial_arrays()))
        if whole is not None:
            skeleton.set_initial_arrays(*whole)
        elif initial is not None:
            skeleton.set_initial_state(*initial)
        with plugin.attached_to(held, state):
            skeleton.mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    return plugin.result()
