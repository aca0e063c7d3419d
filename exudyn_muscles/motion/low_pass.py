"""Low-pass filters for recorded motions."""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..errors import MotionError

# OpenSim's CMC pads a motion at both ends and filters it with so many samples to either side.
OPENSIM_PADDING, OPENSIM_ORDER = 60, 50
# Beyond its ends a record goes on for a period of the cut-off by SHARE as a cubic that is fitted to
# its last period, with what that leaves of it reflected about the end, and by the rest as its own
# reflection; from there by reflection alone. Reflection makes the acceleration at the end zero; the
# cubic alone has it there in smooth motions, but follows what noise and impacts do. Of parts of
# recorded gait, against the whole records at 6 Hz, the first sample's acceleration is wrong by 0.80
# to 0.92 of the usual one (root mean square), 0.99 to 1.03 with reflection, and 1.3 to 3 with a
# polynomial of any degree, span or weight by its own residual. In other records natural smoothing
# splines of degree 5 with the same cut-off, as Woltring's, err by 0.8 to 1.5, this by 0.7 to 1.2.
FIT_DEGREE, SHARE = 3, 0.35


class LowPass(Enum):
    """Low-pass filters without phase."""

    BUTTERWORTH = "fourth order: a second-order one forwards and backwards"
    BUTTERWORTH_6 = (
        "sixth order: a third-order one forwards and backwards, as in OpenSim's analyses"
    )
    OPENSIM = (
        "that of OpenSim's CMC: a windowed sinc 101 samples wide, whatever the cut-off; no "
        "accelerations at the record's ends"
    )
    WINDOWED_SINC = "the same, with a part of the record's accelerations at its ends"


BUTTERWORTHS = {LowPass.BUTTERWORTH: 2, LowPass.BUTTERWORTH_6: 3}  # orders of one pass


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
    period = 1.0 / (cutoff * step)
    if low_pass in (LowPass.OPENSIM, LowPass.WINDOWED_SINC):
        k = np.arange(-OPENSIM_ORDER, OPENSIM_ORDER + 1)
        hamming = 0.54 + 0.46 * np.cos(np.pi * k / OPENSIM_ORDER)
        weights = np.sinc(2.0 * cutoff * step * k) * hamming
        if low_pass is LowPass.OPENSIM:
            q = _reflected(_reflected(q, OPENSIM_PADDING), OPENSIM_ORDER)
        else:
            q = _continued(q, OPENSIM_PADDING + OPENSIM_ORDER, period)
        around = sliding_window_view(q, k.size, axis=0)
        return _reflected(t, OPENSIM_PADDING), around @ (weights / weights.sum())
    if low_pass not in BUTTERWORTHS:
        raise MotionError(f"low_pass = {low_pass!r} is not a LowPass")
    from scipy.signal import butter, sosfiltfilt  # a third of a second to import

    # Long enough for the filter to forget that the record begins somewhere: 1e-7 of a ramp is left
    # after three periods.
    padding = min(round(3.0 / (cutoff * step)), t.size - 1)
    q = _continued(q, padding, period)
    filtered = sosfiltfilt(
        butter(BUTTERWORTHS[low_pass], cutoff / limit, output="sos"), q, axis=0, padlen=0
    )
    return t, filtered[padding:-padding]


def _continued(q: np.ndarray, samples: int, period: float) -> np.ndarray:
    """Rows (k, n) continued at both ends, with a part of the accelerations that they have there.

    `period` is that of the cut-off in samples.
    """
    near = min(samples, max(round(period), 1), len(q) - 1)
    before, behind = (_before(rows, near, period) for rows in (q, q[::-1]))
    return _reflected(np.concatenate([before, q, behind[::-1]]), samples - near)


def _before(q: np.ndarray, samples: int, period: float) -> np.ndarray:
    """So many rows before the first one."""
    k = min(max(round(period), FIT_DEGREE + 2), len(q))
    powers = np.vander(np.arange(-samples, max(k, samples + 1)) / k, FIT_DEGREE + 1)
    fit = powers @ np.linalg.lstsq(powers[samples : samples + k], q[:k], rcond=None)[0]
    left = q[: samples + 1] - fit[samples : 2 * samples + 1]
    cubic = fit[:samples] + 2.0 * left[0] - left[:0:-1]
    return SHARE * cubic + (1.0 - SHARE) * (2.0 * q[0] - q[samples:0:-1])


def _reflected(x: np.ndarray, samples: int) -> np.ndarray:
    """Rows continued at both ends by point reflection."""
    width = [(samples, samples), *[(0, 0)] * (x.ndim - 1)]
    return np.pad(x, width, mode="reflect", reflect_type="odd")
