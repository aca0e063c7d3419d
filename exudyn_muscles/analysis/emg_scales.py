"""Scales between EMG and activations, which nobody measures, from the motion's torques."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..errors import ParameterError
from ..methods.static import StaticSettings, static_optimization
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..recruitment.criteria.followed import Followed
from ..results.trajectory import Trajectory
from .emg import DELAY, EMG

CLOSE = 1e-4  # of a scale
# Of a scale: EMG over its largest value is at most one, and muscles are hardly all but idle.
LEAST = 1e-3
# Of a motion so much may lie outside of the record [s]: a usual delay, and some more.
LACK = 0.1


class Scaled(NamedTuple):
    """Scales of EMG.

    Attributes
    ----------
    scales : dict of str to float
        By muscle.
    criterion : Followed
        With which they were found.
    result : Trajectory
        Of static optimization by it.
    """

    scales: dict[str, float]
    criterion: Followed
    result: Trajectory


def fit_emg_scales(
    model: MusculoskeletalModel,
    motion: Motion,
    emg: EMG,
    muscles: Mapping[str, str],
    *,
    weight: float = 10.0,
    delay: float = DELAY,
    settings: StaticSettings = StaticSettings(),
    rounds: int = 50,
) -> Scaled:
    """The scales s with which activations of `static_optimization` by `Followed` come nearest to s
    times the EMG, over the whole motion.

    Forces follow from scales, and scales from activations (the least squares, between 0.001 and
    what makes the largest value one); where both agree is found by Anderson's mixing.

    Parameters
    ----------
    model, motion
        Of a static optimization.
    emg : EMG
        Envelopes over their largest value, or any other with values within [0, 1].
    muscles : mapping
        Muscle -> name of its EMG; every muscle gets a scale of its own.
    weight, delay
        As of `Followed` and `compare_emg`.
    settings : StaticSettings
        Their criterion is replaced.
    rounds : int
        At most.

    Returns
    -------
    Scaled

    Raises
    ------
    ParameterError
        As `EMG.courses` and `Followed`, EMG does not cover the motion, or scales still change by
        more than 1e-4 after all rounds.
    """
    from scipy.optimize import NoConvergence, anderson  # slow to import

    courses = emg.courses(muscles, delay=delay)
    names = list(courses)
    largest = np.array([x.max() for _, x in courses.values()])
    if not names:
        raise ParameterError("muscles: no EMG is given")
    times = next(iter(courses.values()))[0]
    if not (times[0] <= motion.start + LACK and motion.end - LACK <= times[-1]):
        raise ParameterError(
            f"EMG from {times[0]:g} to {times[-1]:g} s, {delay:g} s later than measured, does not "
            f"cover the motion from {motion.start:g} to {motion.end:g} s"
        )
    if not (largest > 0.0).all():
        raise ParameterError(f"EMG of '{names[int(largest.argmin())]}' is zero throughout")

    def by(scales: np.ndarray) -> tuple[Followed, Trajectory]:
        scaled = {
            name: (t, s * x) for s, (name, (t, x)) in zip(scales, courses.items(), strict=True)
        }
        criterion = Followed(scaled, weight=weight)
        own = replace(settings, criterion=criterion)
        return criterion, static_optimization(model, motion, settings=own)

    def allowed(scales: np.ndarray) -> np.ndarray:
        return np.clip(scales, LEAST, 1.0 / largest)

    def change(scales: np.ndarray) -> np.ndarray:
        _, result = by(allowed(scales))
        ends = np.isin(result.time, result.window_time[1:])
        a = result.activations[ends][:, [result.muscle_names.index(name) for name in names]]
        e = np.array([np.interp(result.time[ends], *course) for course in courses.values()]).T
        found = (a * e).sum(axis=0) / np.maximum((e * e).sum(axis=0), np.finfo(float).tiny)
        return allowed(found) - scales

    try:
        # Without a search along its steps, which bounds on the scales would end.
        scales = anderson(
            change, np.ones(len(names)), alpha=1.0, f_tol=CLOSE, maxiter=rounds, line_search=None
        )
    except NoConvergence:
        raise ParameterError(
            f"scales of EMG still change by more than {CLOSE:g} after {rounds} rounds; more of "
            "them, or a smaller weight, may end it"
        ) from None
    scales = allowed(scales)
    return Scaled(dict(zip(names, map(float, scales), strict=True)), *by(scales))
