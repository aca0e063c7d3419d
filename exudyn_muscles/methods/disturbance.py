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


def tracking_growth(kp: float, kv: float, step: float, gain: float, course: Course) -> float:
    """Growth of the tracking error over one step of the consistent scheme; unstable above 1.

    The largest eigenvalue of one coordinate whose acceleration meets the demand at the ends of the
    steps and runs between them by the `course`.

    Examples
    --------
    Muscles that come late, and stiff ones that overshoot within the step:

    >>> courses = [Course(mean, mean / 3.0) for mean in (0.3, 0.7, 1.5)]
    >>> [round(tracking_growth(100.0, 20.0, 0.01, 1.0, course), 2) for course in courses]
    [0.91, 0.91, 0.91]
    """
    h, (mean, moment) = step, course
    e, e_t, a, i = np.eye(4)  # of the state e, e', e'' and the estimate
    asked = 0.5 * gain * (mean - 0.5)  # of the change of e'', in return for what is lost
    before = e + h * e_t + h * h * (0.5 - moment) * a
    before_t = e_t + h * (1.0 - mean) * a
    a_1 = (asked * a - kv * before_t - kp * before - i) / (
        1.0 + asked + h * kv * mean + h * h * kp * moment
    )
    e_1, e_1t = before + h * h * moment * a_1, before_t + h * mean * a_1
    i_1 = i + 0.5 * gain * (e_1t - speed_error(e, e_t, kp, kv, h)) / h
    return float(np.abs(np.linalg.eigvals(np.array([e_1, e_1t, a_1, i_1]))).max())
