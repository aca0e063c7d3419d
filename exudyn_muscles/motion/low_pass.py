"""Low-pass filters for recorded motions."""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..errors import MotionError

# OpenSim's CMC pads a motion at both ends and filters it with so many samples to either side.
OPENSIM_PADDING, OPENSIM_ORDER = 60, 50


class LowPass(Enum):
    """Low-pass filters without phase."""

    BUTTERWORTH = "fourth order: a second-order one forwards and backwards"
    OPENSIM = "that of OpenSim's CMC: a windowed sinc 101 samples wide, whatever the cut-off"


def low_passed(
    t: np.ndarray, q: np.ndarray, cutoff: float, low_pass: LowPass
) -> tuple[np.ndarray, np.ndarray]:
    """Filtered samples, beyond the record's ends where the filter has them."""
    step = (t[-1] - t[0]) / (t.size - 1)
    limit = 0.5 / step
    if not 0.0 < cutoff < limit:
        raise MotionError(f"cutoff = {cutoff!r} Hz is outside (0, {limit:g}) Hz")
    if (t[-1] - t[0]) * cutoff < 1.0:
        raise MotionError(
            f"filtering at {cutoff:g} Hz needs a record of at least one period, "
            f"{1.0 / cutoff:g} s; this one has {t[-1] - t[0]:g} s"
        )
    if low_pass is LowPass.OPENSIM:
        k = np.arange(-OPENSIM_ORDER, OPENSIM_ORDER + 1)
        hamming = 0.54 + 0.46 * np.cos(np.pi * k / OPENSIM_ORDER)
        weights = np.sinc(2.0 * cutoff * step * k) * hamming
        q = _continued(q, OPENSIM_PADDING)
        around = sliding_window_view(_continued(q, OPENSIM_ORDER), k.size, axis=0)
        return _continued(t, OPENSIM_PADDING), around @ (weights / weights.sum())
    if low_pass is not LowPass.BUTTERWORTH:
        raise MotionError(f"low_pass = {low_pass!r} is not a LowPass")
    from scipy.signal import butter, sosfiltfilt  # a third of a second to import

    # The record is continued by point reflection at its ends, long enough for the filter to
    # forget that this begins somewhere: 1e-7 of a ramp is left after three periods.
    padding = min(round(3.0 / (cutoff * step)), t.size - 1)
    return t, sosfiltfilt(butter(2, cutoff / limit, output="sos"), q, axis=0, padlen=padding)


def _continued(x: np.ndarray, samples: int) -> np.ndarray:
    """Rows continued at both ends by point reflection."""
    width = [(samples, samples), *[(0, 0)] * (x.ndim - 1)]
    return np.pad(x, width, mode="reflect", reflect_type="odd")
