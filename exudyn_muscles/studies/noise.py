"""Motions with errors, as measurements have them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..motion import Motion

# Errors of markers that have passed the usual low-pass filter of gait, 6 Hz, and so are as good as
# independent in points of half its period (D. A. Winter, Biomechanics and Motor Control of Human
# Movement, 4th ed., section 3.4).
INTERVAL = 1.0 / 12.0  # s


class NoisyMotion(Motion):
    """A motion and a smooth error of every coordinate: the spline through independent normal values
    in equal steps of some 1/12 s.

    Parameters
    ----------
    motion : Motion
    deviation : float
        Standard deviation of these values [rad or m].
    seed : numpy.random.SeedSequence
        The same seed, the same error.
    """

    def __init__(self, motion: Motion, deviation: float, seed: np.random.SeedSequence) -> None:
        steps = max(2, round((motion.end - motion.start) / INTERVAL))
        values = np.random.default_rng(seed).standard_normal((steps + 1, len(motion)))
        times = np.linspace(motion.start, motion.end, steps + 1)
        self._motion = motion
        self._error = Motion.from_waypoints(times, deviation * values)
        self.start, self.end, self.source = motion.start, motion.end, motion.source

    def __len__(self) -> int:
        return len(self._motion)

    def __call__(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        q, v, a = self._motion(t)
        e, e_t, e_tt = self._error(t)
        return q + e, v + e_t, a + e_tt
