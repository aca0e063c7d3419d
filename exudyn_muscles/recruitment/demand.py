"""What is asked of muscles and ideal actuators together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

NOTHING_KNOWN = np.empty((2, 0))


class Demand(NamedTuple):
    """Torques (10) for m muscles and ideal actuators at one time, the k muscles first.

    Attributes
    ----------
    r : (m, n) ndarray
        Moment arms of muscles, columns of ideal actuators.
    Q_m : (n,) ndarray
        Demanded torques.
    F_min, F_max, N : (m,) ndarray
        Bounds and normalising forces [N, or N m].
    t : float
        Time of the window's end [s].
    excitation, activation : (2, k) ndarray
        Lowest and highest ones of the muscles, with which the window ends at F_min and F_max.
    cheaper : (k,) ndarray
        What weights have made of the normalising forces: N is this many times the normalizer's.
    near : (m,) int ndarray
        Which bounds the solution is likely to be at, as `Recruitment.at_bounds`; none if left out.
    place : tuple
        What `MusculoskeletalModel.geometry` takes there; views of what a run moves on. It begins
        with coordinates and speeds (n,).
    """

    r: np.ndarray
    Q_m: np.ndarray
    F_min: np.ndarray
    F_max: np.ndarray
    N: np.ndarray
    t: float = 0.0
    excitation: np.ndarray = NOTHING_KNOWN
    activation: np.ndarray = NOTHING_KNOWN
    cheaper: np.ndarray = NOTHING_KNOWN[0]
    near: np.ndarray | None = None
    place: tuple = ()
