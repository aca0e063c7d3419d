"""Tracking with the forces that muscles really have: what they leave of the control law is
estimated, step by step, and added to the next demand.

With e = q_d - q, the law (15) promises e'' = -(k_v e' + k_p e). Over a step that begins with e, e'
the trapezoidal rule makes e'_ideal of it; a step that ends with another e' had an acceleration that
was off by (e' - e'_ideal)/h on the average, and

    d <- d + g (e' - e'_ideal)/h,    q''_CTC = q_d'' + k_v e' + k_p e + d.
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
    steps and runs between them by the `course`, with the disturbance estimated by `gain`.

    Examples
    --------
    The estimate alone, z^2 - (1 - g mean) z + g (1 - mean) = 0, is stable for g (1 - mean) < 1:

    >>> alone = [tracking_growth(0.0, 0.0, 0.01, 1.0, Course(mean, 1 / 6)) for mean in (0.5, 0.4)]
    >>> [round(growth, 9) for growth in alone]
    [1.0, 1.0]
    """
    h, (mean, moment) = step, course
    e, e_t, a, d = np.eye(4)  # of the state e, e', e'' and d
    # e_1 and e_1' with e_1'' = -(k_v e_1' + k_p e_1 + d)
    before = e + h * e_t + h * h * (0.5 - moment) * a
    before_t = e_t + h * (1.0 - mean) * a
    a_1 = -(kv * before_t + kp * before + d) / (1.0 + h * kv * mean + h * h * kp * moment)
    e_1, e_1t = before + h * h * moment * a_1, before_t + h * mean * a_1
    d_1 = d + gain * (e_1t - speed_error(e, e_t, kp, kv, h)) / h
    return float(np.abs(np.linalg.eigvals(np.array([e_1, e_1t, a_1, d_1]))).max())
