"""A window from the committed muscle state: open, reach, excite.

    window = open_window(windows, start, h, u)      excitations u held for the time h
    reach = reach_end(window, l, v)                 (8), (9) where it ends with l and l'
    excite(reach, F_opt)                            (11)
    end_slopes(reach, u)                            how F at the end follows l there

Every evaluation within one window uses the time steps that its first evaluation chose: the forces
are then smooth functions of the end's lengths and speeds, as Newton's method needs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..muscle.course import MAX_STEPS
from ..muscle.parameters import MuscleSet
from ..muscle.window import Integrator, check_window, integrate_all, length_slopes
from .excitation import excitations

# Room that windows ask for first. For the most steps it takes megabytes, whose first use costs a
# run's first interval 20 ms.
USUAL_STEPS = 256


class Windows:
    """What a run's windows share: the muscles, how they are integrated, and memory for the steps.

    Parameters
    ----------
    muscles : MuscleSet
    tolerance : float
    integrator : Integrator
        Of the window integration, see `exudyn_muscles.integrate_window`.

    Attributes
    ----------
    tally : list of two int
        Integrations of one muscle, and windows opened, so far.
    """

    def __init__(self, muscles: MuscleSet, tolerance: float, integrator: Integrator) -> None:
        m = len(muscles)
        self.muscles, self.tolerance, self.method = muscles, tolerance, integrator.value
        self._meshes, self.scratch = [np.empty((2, m, USUAL_STEPS))], np.empty(MAX_STEPS)
        self.steps = np.zeros((2, m), dtype=np.int64)
        self.tally = [0, 0]

    @property
    def mesh(self) -> np.ndarray:
        """Room for the steps of all windows (2, m, k)."""
        return self._meshes[0]

    def make_room(self) -> bool:
        """Whether there was less room than for the most steps; now there is not."""
        before = self.mesh
        if before.shape[2] == MAX_STEPS:
            return False
        self._meshes[0] = np.empty((*before.shape[:2], MAX_STEPS))
        self._meshes[0][..., : before.shape[2]] = before
        return True


class MuscleState(NamedTuple):
    """a, l_t, l and l' of m muscles, (m,) each."""

    activation: np.ndarray
    tendon_length: np.ndarray
    length: np.ndarray
    lengthening_speed: np.ndarray


class OpenWindow(NamedTuple):
    """A window of the length `h` [s] from `start`; u (2, m) are the lowest and highest excitations.

    It lasts until the next one is opened; `number` tells them apart.
    """

    windows: Windows
    start: MuscleState
    h: float
    u: np.ndarray
    number: int


class Reach(NamedTuple):
    """Lowest and highest force (m,) [N] at the end of a window, which has these lengths and speeds.

    `ends` (4, 2, m) are a, l_t, F and its slope with the lowest and highest excitation.
    """

    window: OpenWindow
    length: np.ndarray
    lengthening_speed: np.ndarray
    ends: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Excitation(NamedTuple):
    """Held excitation u, and a, l_t and F at the window's end, (m,) each."""

    excitation: np.ndarray
    activation: np.ndarray
    tendon_length: np.ndarray
    force: np.ndarray


def open_window(windows: Windows, start: MuscleState, h: float, u: np.ndarray) -> OpenWindow:
    """Begin a window; the one before is over."""
    windows.steps[:] = 0
    windows.tally[1] += 1
    return OpenWindow(windows, start, h, u, windows.tally[1])


def reach_end(window: OpenWindow, l: np.ndarray, v: np.ndarray) -> Reach:
    """(8), (9): what forces are within reach where the window ends with lengths `l`, speeds `v`.

    A tendon cannot push, so that none is below zero.

    Raises
    ------
    WindowError
        A muscle's equations could not be integrated; names it.
    RuntimeError
        Another window was opened meanwhile.
    """
    windows, start, ends = window.windows, window.start, np.empty((4, 2, l.size))
    _check_open(window)
    for _ in range(2):
        failed = integrate_all(
            windows.method, windows.muscles.tables, start.activation, start.tendon_length,
            window.u, start.length, start.lengthening_speed, l, v, window.h, windows.tolerance,
            windows.mesh, windows.steps, ends,
        )  # fmt: skip
        if failed < 0 or not windows.make_room():
            break
    check_window(failed, windows.muscles, *start, window.h)
    windows.tally[0] += 2 * l.size
    low, high = np.maximum(ends[2], 0.0)
    return Reach(window, l, v, ends, low, high)


def excite(reach: Reach, F_opt: np.ndarray) -> Excitation:
    """(11): excitations that end in `F_opt` (m,) [N].

    Raises
    ------
    WindowError
        A muscle's excitation was not found; names it.
    RuntimeError
        Another window was opened meanwhile.
    """
    window, ends = reach.window, reach.ends
    windows, start = window.windows, window.start
    _check_open(window)
    u, end = np.empty(F_opt.size), np.empty((3, F_opt.size))
    count, failed = excitations(
        windows.method, windows.muscles.tables, start.activation, start.tendon_length, window.u,
        F_opt, ends[:, 0], ends[:, 1], start.length, start.lengthening_speed, reach.length,
        reach.lengthening_speed, window.h, windows.tolerance, windows.scratch, u, end,
    )  # fmt: skip
    windows.tally[0] += count
    check_window(failed, windows.muscles, *start, window.h)
    return Excitation(u, end[0], end[1], np.maximum(end[2], 0.0))


def end_slopes(reach: Reach, u: np.ndarray) -> np.ndarray:
    """How the forces at the end follow the lengths there with held excitations `u` (m,) [N/m].

    Raises
    ------
    WindowError
        A muscle's equations could not be integrated; names it.
    RuntimeError
        Another window was opened meanwhile.
    """
    window = reach.window
    windows, start = window.windows, window.start
    _check_open(window)
    slopes = np.empty(u.size)
    failed = length_slopes(
        windows.method, windows.muscles.tables, start.activation, start.tendon_length, u,
        start.length, start.lengthening_speed, reach.length, reach.lengthening_speed, window.h,
        windows.tolerance, windows.scratch, slopes,
    )  # fmt: skip
    check_window(failed, windows.muscles, *start, window.h)
    windows.tally[0] += 2 * u.size
    return slopes


def _check_open(window: OpenWindow) -> None:
    if window.number != window.windows.tally[1]:
        raise RuntimeError("the window is over: another one was opened meanwhile")
