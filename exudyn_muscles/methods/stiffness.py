"""Stiffness as part of CMC's feedback, and what of it has to be kept out.

Excitations that are found for the desired state at a window's end meet the demand only there. Off
it by e_1 = q - q_d muscles and ideal actuators fall short of the demand by K e_1, with

    K = r^T diag(dF_end/dl) r - (dr/dq)^T F + d(M q''_CTC + H - Q)/dq,

besides a damping that is not negative: a force at the end follows a late lengthening. In a mode
K phi = lambda M phi, phi^T M phi = 1, the error therefore obeys

    e'' + k_v e' + k_p e + lambda e_1 = 0.

lambda > 0 is a feedback within the window, which is better than that by the error at its start
alone. lambda < 0 (muscles that pass over their axis, light axial rotations, weights that topple)
works against k_p and wins where it is larger. Before that, lambda times the error that is expected
at the window's end, if e'' is what the law asks for, is added to the demand: what is left of lambda
is of third order in h.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpotrf, dsygvx  # by scipy.linalg.eigh twice the time

from ..model import MusculoskeletalModel
from ..skeleton.ahead import IMPLICIT_EULER
from ..skeleton.base import ExudynSkeleton
from ..skeleton.opened import Dynamics
from .disturbance import LINEAR
from .recruiting import Recruited

# Displacement [rad or m] by which slopes are found: about what tracking errs by, so that where a
# path jumps no more than the jump is added to the demand.
DISPLACEMENT = 1e-3
# The part of k_p that a mode may take away before it is kept out of the feedback, which means a
# second recruitment; and -lambda h^2 of the slowest one that matters without k_p: in windows of
# 10 ms it needs a second to grow.
ALLOWED, SLOWEST = 0.25, 1e-4


class Stiffness(NamedTuple):
    """The shares (n, n) in K of what pulls and of what is demanded."""

    of_forces: np.ndarray
    of_demand: np.ndarray

    @property
    def symmetric(self) -> np.ndarray:
        """The symmetric part of K."""
        K = self.of_forces + self.of_demand
        return 0.5 * (K + K.T)


def end_stiffness(
    model: MusculoskeletalModel,
    skeleton: ExudynSkeleton,
    there: Dynamics,
    a: np.ndarray,
    recruited: Recruited,
    slopes: np.ndarray,
    of_demand: np.ndarray | None,
) -> Stiffness:
    """Of what was recruited for accelerations `a` (n,) at the state `there` at a window's end.

    `slopes` (m,) are dF_end/dl [N/m]. The share of the demand is only found if it is not given: on
    trees it takes far more time than that of the forces, and changes no faster than the pose.
    """
    t, r = recruited.reached.opened.end, recruited.reached.geometry.moment_arms
    q, v = there.place[:2]
    moved = q + DISPLACEMENT * np.eye(q.size)
    if of_demand is None:
        of_demand = np.empty((q.size, q.size))
        demanded, places = there.torque(a), [there.place]
        for j, row in enumerate(moved):
            ahead = skeleton.dynamics_ahead(row, v, t, IMPLICIT_EULER)
            of_demand[:, j] = (ahead.torque(a) - demanded) / DISPLACEMENT
            places.append(ahead.place)
    else:
        places = [there.place, *skeleton.places_ahead(moved, v, t, IMPLICIT_EULER)]
    here, *torques = model.torques(places, recruited.recruitment.force)
    of_forces = (r.T * slopes) @ r - (np.array(torques) - here).T / DISPLACEMENT
    return Stiffness(of_forces, of_demand)


def torque_against(
    K: np.ndarray, M: np.ndarray, error: np.ndarray, least: float
) -> np.ndarray | None:
    """What the modes of a stiffness K with lambda < -least [1/s^2] make of an `error` (n,): torques
    (n,), or None if there is no such mode.

    Examples
    --------
    Two masses, one on a spring that pushes it away:

    >>> torque_against(np.diag([50.0, -20.0]), np.diag([1.0, 0.1]), np.array([1e-3, 2e-3]), 25.0)
    array([ 0.  , -0.04])
    >>> torque_against(np.diag([50.0, -2.0]), np.diag([1.0, 0.1]), np.array([1e-3, 2e-3]), 25.0)
    """
    # Whether there are negative ones at all does not depend on M.
    if dpotrf(K)[1] == 0:
        return None
    values, modes, found, _, failed = dsygvx(K, M, range="V", vl=-np.inf, vu=-least)
    if failed:
        raise np.linalg.LinAlgError(f"no modes of a stiffness: dsygvx returned {failed}")
    if found == 0:
        return None
    shares = M @ modes[:, :found]
    return np.asarray(shares @ (values[:found] * (shares.T @ error)))


def cmc_growth(
    kp: float, kv: float, window: float, stiffness: float, damping: float, kept_out: bool
) -> float:
    """Growth of the tracking error over one window of CMC; unstable above 1.

    The largest eigenvalue of one coordinate with a mass of one, on which muscles act with a
    stiffness [1/s^2] and a damping [1/s], and whose acceleration runs linearly through a window.
    `kept_out` says whether the stiffness is, as `torque_against` does it.

    Examples
    --------
    Muscles' stiffness as feedback loses at -k_p; kept out of it, it may be far larger than that,
    up to 2 / h^2:

    >>> [round(cmc_growth(100.0, 20.0, 0.01, x, 0.0, False), 2) for x in (-1e3, -110.0, -90.0, 0.0)]
    [1.26, 1.01, 0.99, 0.92]
    >>> [round(cmc_growth(100.0, 20.0, 0.01, x, 0.0, True), 2) for x in (-21e3, -19e3, -1e3, 0.0)]
    [1.19, 0.99, 0.92, 0.92]
    """
    h, (mean, moment) = window, LINEAR
    e, e_t, a = np.eye(3)
    before = e + h * e_t + h * h * (0.5 - moment) * a
    before_t = e_t + h * (1.0 - mean) * a
    law = -(kp * e + kv * e_t)
    expected = e + h * e_t + 0.5 * h * h * law if kept_out else np.zeros(3)
    a_1 = (law - stiffness * (before - expected) - damping * before_t) / (
        1.0 + stiffness * h * h * moment + damping * h * mean
    )
    e_1, e_1t = before + h * h * moment * a_1, before_t + h * mean * a_1
    return float(np.abs(np.linalg.eigvals(np.array([e_1, e_1t, a_1]))).max())
