"""Tracking with the forces that muscles really have: what their course leaves of the control law is
asked for in addition.

Accelerations that do not run through a step as the trapezoidal rule has it lose (or win) a part m
of what is demanded, the mean of q'' over the step less that of its ends. Half of it is asked for
within the step itself, which answers at once. The other half is estimated step by step: with
e = q_d - q, the law (15) promises e'' = -(k_v e' + k_p e), of which the trapezoidal rule makes
e'_ideal at the step's end, and

    q''_CTC = q_d'' + k_v e' + k_p e + d,   d = i - g/2 m,   i <- i + g/2 (e' - e'_ideal) / h.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Gain = float | np.ndarray


class Course(NamedTuple):
    """How accelerations that change from 0 to 1 in a step run there, x(s): `mean` is the integral
    of x over s from 0 to 1, `moment` that of (1 - s) x."""

    mean: float
    moment: float


LINEAR = Course(1 / 2, 1 / 6)


def speed_error(e: np.ndarray, e_t: np.ndarray, kp: Gain, kv: Gain, h: float) -> np.ndarray:
    """e' (n,) after a step of e'' = -(k_v e' + k_p e) by the trapezoidal rule."""
    now = kv * e_t + kp * e
    then = kv * (e_t - 0.5 * h * now) + kp * (e + h * e_t - 0.25 * h * h * now)
    return e_t - 0.5 * h * (now + then / (1.0 + 0.5 * h * kv + 0.25 * h * h * kp))


def tracking_growth(
    kp: float, kv: float, step: float, gain: float, course: Course, kept: bool = False
) -> float:
    """Growth of the tracking error over one step of the consistent scheme; unstable above 1.

    The largest eigenvalue of one coordinate whose acceleration meets the demand at the ends of the
    steps and runs between them by the `course`. If the excitations of iterates are `kept` that are
    off by little, the demand is that of where the step was expected to end, by the trapezoidal rule
    and what the two steps before were moved by.

    Examples
    --------
    Muscles that come late, and stiff ones that overshoot within the step:

    >>> courses = [Course(mean, mean / 3.0) for mean in (0.3, 0.7, 1.5)]
    >>> [round(tracking_growth(100.0, 20.0, 0.01, 1.0, course), 2) for course in courses]
    [0.91, 0.91, 0.91]
    >>> [round(tracking_growth(100.0, 20.0, 0.01, 1.0, course, True), 2) for course in courses]
    [0.91, 0.98, 2.88]
    """
    h, (mean, moment) = step, course
    # Of the state e, e', e'', the estimate, and the changes of e'' in the last two steps.
    e, e_t, a, i, change, earlier = np.eye(6)
    at_end, at_end_t = h * h * moment, h * mean  # what e'' at the step's end adds to e and e'
    lead, lead_t = e + h * e_t + h * h * (0.5 - moment) * a, e_t + h * (1.0 - mean) * a
    if kept:
        expected = 2.0 * change - earlier
        seen, seen_t = 0.25 * h * h, 0.5 * h
        before = e + h * e_t + 0.25 * h * h * (a + (4.0 * moment - 1.0) * expected)
        before_t = e_t + 0.5 * h * (a + (2.0 * mean - 1.0) * expected)
        asked, lost = 0.0, (mean - 0.5) * expected
    else:
        seen, seen_t, before, before_t = at_end, at_end_t, lead, lead_t
        asked, lost = 0.5 * gain * (mean - 0.5), (mean - 0.5) * -a  # and e'' at the end, asked
    a_1 = -(kv * before_t + kp * before + i + 0.5 * gain * lost) / (
        1.0 + asked + kv * seen_t + kp * seen
    )
    e_1, e_1t = lead + at_end * a_1, lead_t + at_end_t * a_1
    i_1 = i + 0.5 * gain * (e_1t - speed_error(e, e_t, kp, kv, h)) / h
    return float(np.abs(np.linalg.eigvals(np.array([e_1, e_1t, a_1, i_1, a_1 - a, change]))).max())
