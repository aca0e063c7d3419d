"""What is said when a run is over."""

from __future__ import annotations

from typing import NoReturn

import exudyn as exu
import numpy as np

from ..errors import (
    CriterionWarning,
    IncompleteRunWarning,
    SimulationError,
    TrackingWarning,
    UnmetTorqueWarning,
    warn,
)
from ..results.counts import Status
from ..results.recorder import Recorder
from ..results.tracking import NOTICEABLE
from ..skeleton.base import ExudynSkeleton
from ..skeleton.reading import original, raise_as_itself


def warn_of_early_end(
    record: Recorder, solver: exu.MainSolverImplicitSecondOrder, within_step: bool
) -> None:
    """Exudyn also returns True when it was stopped early, and SolveSteps raises nothing when it
    gave up `within_step`."""
    why = "a user function" if solver.output.simulationStoppedByUserFunction else "the user"
    if within_step:
        why = "Exudyn, which gave up,"
    if solver.output.simulationTimeout:
        why = "exudyn.special.solver.timeout"
    warn_of_stop(record, why, solver.it.endTime)


def warn_of_stop(record: Recorder, why: str, end: float) -> None:
    """Someone or something has stopped a run that was to go on until `end` [s]."""
    text = f"stopped by {why} at t = {record.reached:g} s before {end:g} s"
    record.note(text)
    warn(text, IncompleteRunWarning)


def judge_tracking(record: Recorder, end: float) -> str:
    """How a run that was to go on until `end` [s] is off its motion by more than its control law
    promises, empty if it is not; one that has lost the motion says so in its status."""
    if record.strayed <= NOTICEABLE:
        return ""
    trajectory = record.trajectory()
    text = trajectory.tracking_report()
    if text and not record.fell_short:
        text += "; no torque was out of reach: shorter steps may hold the motion, or other gains"
    if trajectory.has_lost_its_motion:
        if record.status is Status.INCOMPLETE:
            text += f"; stopped at t = {trajectory.time[-1]:g} s before {end:g} s"
        record.lose(text)
    return text


def warn_of_shortfalls(record: Recorder, off: str) -> None:
    """One UnmetTorqueWarning, one CriterionWarning and one TrackingWarning, of how the run is
    `off`, for a whole run, if there is anything to say."""
    if record.fell_short:
        text = record.trajectory().unmet_torque_report()
        warn(f"unmet torque: {text}", UnmetTorqueWarning)
    counts = record.counts
    if counts.not_preferred:
        warn(
            f"in {counts.not_preferred} of {counts.recruitments} recruitments what the criterion "
            "prefers was not found; their forces are those of the least squares",
            CriterionWarning,
        )
    if off:
        warn(f"tracking: {off}", TrackingWarning)


def fail(record: Recorder, error: BaseException, where: str) -> NoReturn:
    """Raise what was raised in a run as itself, and Exudyn's errors as a SimulationError; the
    record keeps it, with `where` it was."""
    raised = original(error)
    if isinstance(raised, exu.ExudynError):
        raised = SimulationError(f"Exudyn gave up {where}: {raised}")
        record.fail(raised, where)
        raise raised from error
    if record.reached is not None:
        raised.add_note(f"raised in the simulation {where}")
    record.fail(raised, where)
    raise_as_itself(raised, error)


def place(skeleton: ExudynSkeleton, reached: float) -> str:
    """Time and state, for messages of a run that was accepted up to `reached` [s]."""
    return (
        f"at t = {skeleton.mbs.systemData.GetTime():.6g} s (accepted up to {reached:.6g} s), "
        f"q = {np.array2string(skeleton.q, precision=5)}, "
        f"q' = {np.array2string(skeleton.v, precision=5)}"
    )
