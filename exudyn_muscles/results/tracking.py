"""Whether a run has kept to its motion: tracking errors against what the control law promises.

By (15) errors e = q_d - q decay as e'' = -(k_v e' + k_p e), from whatever they are at the start.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

# Errors beyond what the law promises [rad or m]: 1.1 deg or 2 cm, as much as marker data leave
# open, are said; 11 deg or 20 cm off, excitations of another motion are found; and a joint that is
# half a turn beyond all that the motion has is past looking at.
NOTICEABLE, LOST, ABSURD = 0.02, 0.2, np.pi
# More than what a start on the motion leaves [rad or m].
BEGUN_OFF = 1e-4


def promised_errors(
    time: np.ndarray, e: np.ndarray, e_t: np.ndarray, settings: Mapping[str, Any]
) -> np.ndarray:
    """Errors (T, n) that the law with the gains kp and kv of these settings leaves at the times
    (T,), from `e`, `e_t` (n,) at the first one.

    Examples
    --------
    >>> e, e_t = np.array([0.02]), np.zeros(1)
    >>> promised_errors(np.array([0.0, 0.1]), e, e_t, {"kp": 100.0}).round(4)[:, 0]
    array([0.02  , 0.0147])
    """
    t = (time - time[0])[:, None]
    kp, kv = np.asarray(settings["kp"]), settings.get("kv")
    half = np.sqrt(kp) if kv is None else 0.5 * np.asarray(kv)
    w = np.sqrt(half**2 - kp + 0j)
    fast, slow = np.exp((-half - w) * t), np.exp((-half + w) * t)
    apart = np.abs(w) * t[-1] > 1e-6
    ratio = np.where(apart, (slow - fast) / np.where(apart, 2.0 * w, 1.0), t * slow)
    return (0.5 * (slow + fast) * e + (e_t + half * e) * ratio).real


def tracking_report(fields: Mapping[str, Any], excess: np.ndarray) -> str:
    """One line a coordinate of a trajectory with these fields whose errors are beyond what the law
    promises, by `excess` (T, n): since when, and how large; the worst first, empty if none is."""
    time, lines = fields["time"], []
    errors = np.abs(fields["desired_coordinates"] - fields["coordinates"])
    for j in np.argsort(-excess.max(axis=0), kind="stable"):
        if excess[:, j].max() > NOTICEABLE:
            first, worst = (excess[:, j] > NOTICEABLE).argmax(), excess[:, j].argmax()
            name, unit = (fields[which][j] for which in ("coordinate_names", "coordinate_units"))
            lines.append(
                f"{name}: off the motion from t = {time[first]:.4g} s, by up to "
                f"{errors[worst, j]:.3g} {unit} at t = {time[worst]:.4g} s"
            )
    if lines and errors[0].max() > BEGUN_OFF:
        j = int(errors[0].argmax())
        lines.append(
            f"the run began {errors[0, j]:.3g} {fields['coordinate_units'][j]} off in "
            f"{fields['coordinate_names'][j]}: begin on the motion, or with lower gains"
        )
    return "; ".join(lines)
