"""What is checked when Exudyn has begun a run."""

from __future__ import annotations

import numpy as np

from ..errors import MotionError, ParameterError, StartWarning, warn
from ..motion import Motion

# Tracking error at the start [rad or m] above which a user is told.
FAR_AWAY = 0.02


def check_start_time(t: float, start: float) -> None:
    """Raise ParameterError unless a run from the time `t` begins at `start` [s]."""
    if abs(t - start) > 1e-9:
        raise ParameterError(
            f"timeIntegration.startTime = {t:g} s, but the plugin's muscles start at {start:g} s; "
            "give the plugin the start of the run with start="
        )


def check_end_time(t: float, run_end: float, end: float) -> None:
    """Raise ParameterError or MotionError unless a run from `t` to `run_end` [s] has steps and ends
    by `end`."""
    if not run_end > t:
        raise ParameterError(f"timeIntegration.endTime = {run_end:g} s is not after t = {t:g} s")
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
