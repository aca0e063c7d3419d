"""What is checked when Exudyn has begun a run."""

from __future__ import annotations

import exudyn as exu
import numpy as np

from ..errors import MotionError, ParameterError, StartWarning, warn
from ..motion import Motion
from ..skeleton.skeleton import Skeleton

# Tracking error at the start [rad or m] above which a user is told.
FAR_AWAY = 0.02


def check_times(t: float, run_end: float, start: float, end: float) -> None:
    """Raise ParameterError or MotionError unless a run from `t` to `run_end` [s] is one that
    begins at `start` and ends by `end`."""
    if abs(t - start) > 1e-9:
        raise ParameterError(
            f"timeIntegration.startTime = {t:g} s, but the plugin's muscles start at {start:g} s; "
            "give the plugin the start of the run with start="
        )
    if run_end > end + 1e-9:
        raise MotionError(f"timeIntegration.endTime = {run_end:g} s is beyond the end at {end:g} s")


def warn_of_distance(motion: Motion, t: float, q: np.ndarray) -> None:
    """StartWarning if the coordinates `q` (n,) are away from the motion at the time `t`."""
    away = motion(t)[0] - q
    if np.abs(away).max() > FAR_AWAY:
        warn(
            f"the run starts away from the motion, with tracking errors {away} at t = {t:g} s; set "
            "the initial coordinates of the mbs",
            StartWarning,
        )


def check_accelerations(mbs: exu.MainSystem, skeleton: Skeleton) -> None:
    """Settle the skeleton's initial accelerations, and check that they balance the torques.

    Raises
    ------
    ParameterError
        They do not, or the solver goes on from others.
    """
    algorithm = mbs.sys["simulationSettings"].timeIntegration.generalizedAlpha
    if not (skeleton.settle() or algorithm.useNewmark):
        raise ParameterError(
            "generalized alpha starts from initial accelerations of its own, which cannot be right "
            "here: the tree's mass matrix is singular without its followers' reactions, or "
            "generalizedAlpha.computeInitialAccelerations = False; use TrapezoidalIndex2"
        )
    # Exudyn's own q'' at the start, which the trapezoidal rule never forgets.
    M, bias = skeleton.dynamics()
    torque = skeleton.applied
    lack = np.abs(M @ skeleton.acceleration + bias - torque).max()
    if lack > 1e-6 * (np.abs(torque).max() + np.abs(bias).max()) + 1e-9:
        raise ParameterError(
            "the initial accelerations do not balance the initial torques; use an implicit solver "
            "with timeIntegration.generalizedAlpha.computeInitialAccelerations = True"
        )
