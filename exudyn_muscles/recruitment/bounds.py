"""Reachable forces (8), (9) and the excitation (11) between them, for all muscles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..muscle.course import MAX_STEPS
from ..muscle.equilibrium import equilibria, steady_activations
from ..muscle.parameters import MuscleSet
from ..muscle.window import Integrator, check_window, integrate_all
from .excitation import excitations


class Excitation(NamedTuple):
    """Held excitation u, and a, l_t and F at the window's end, (m,) each."""

    excitation: np.ndarray
    activation: np.ndarray
    tendon_length: np.ndarray
    force: np.ndarray


class ReachableForces:
    """The window from a committed muscle state, opened once and then evaluated for any end.

    Every evaluation within one window uses the time steps that its first evaluation chose: the
    forces are then smooth functions of the end's lengths and speeds, as Newton's method needs.

    Parameters
    ----------
    muscles : MuscleSet
    tolerance : float
    integrator : Integrator
        Of the window integration, see `exudyn_muscles.integrate_window`.
    """

    def __init__(self, muscles: MuscleSet, tolerance: float, integrator: Integrator) -> None:
        m = len(muscles)
        self.integrations = 0
        self._muscles = muscles
        self._tolerance = tolerance
        self._method = integrator.value
        self._mesh = np.empty((2, m, MAX_STEPS))
        self._steps = np.zeros((2, m), dtype=np.int64)
        self._scratch = np.empty(MAX_STEPS)
        self._end = np.empty((4, 2, m))

    def open(
        self, a: np.ndarray, l_t: np.ndarray, l: np.ndarray, v: np.ndarray, h: float, u: np.ndarray
    ) -> None:
        """Begin a window of length `h` [s] at a, l_t, l and l', (m,) each.

        `u` (2, m) are the lowest and highest excitations.
        """
        self._start = (a, l_t, l, v)
        self._limits = u
        self._h = h
        self._steps[:] = 0

    def bounds(self, l: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(8), (9): lowest and highest force (m,) [N] at the window's end with lengths `l`, `v`.

        A tendon cannot push, so that neither is below zero.

        Raises
        ------
        WindowError
            A muscle's equations could not be integrated; names it.
        """
        a, l_t, l_0, v_0 = self._start
        failed = integrate_all(
            self._method, self._muscles.tables, a, l_t, self._limits, l_0, v_0, l, v, self._h,
            self._tolerance, self._mesh, self._steps, self._end,
        )  # fmt: skip
        check_window(failed, self._muscles, a, l_t, l_0, v_0, self._h)
        self._goal = (l, v)
        self.integrations += 2 * a.size
        low, high = np.maximum(self._end[2], 0.0)
        return low, high

    def excite(self, F_opt: np.ndarray) -> Excitation:
        """(11): excitations that end in `F_opt` (m,) [N] at the last bounds' end.

        Raises
        ------
        WindowError
            A muscle's excitation was not found; names it.
        """
        a, l_t, l_0, v_0 = self._start
        u, end = np.empty(a.size), np.empty((3, a.size))
        count, failed = excitations(
            self._method, self._muscles.tables, a, l_t, self._limits, F_opt, self._end[:, 0],
            self._end[:, 1], l_0, v_0, *self._goal, self._h, self._tolerance, self._scratch, u, end,
        )  # fmt: skip
        self.integrations += count
        check_window(failed, self._muscles, a, l_t, l_0, v_0, self._h)
        return Excitation(u, end[0], end[1], np.maximum(end[2], 0.0))


def steady_bounds(
    muscles: MuscleSet, u: np.ndarray, l: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The start's bounds: forces (m,) [N] of muscles that move steadily with the lengths `l`,
    speeds `v` and activations `u` (2, m)."""
    low, high = (_steady(muscles, np.ascontiguousarray(row), l, v)[0] for row in u)
    return low, high


def steady_state(
    muscles: MuscleSet, u: np.ndarray, F: np.ndarray, l: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Activations and tendon lengths (m,) of the steady motion nearest to the forces `F`, with
    activations between the excitations `u` (2, m)."""
    a = np.empty(F.size)
    steady_activations(muscles.tables, F, l, v, a)
    a = np.clip(a, *u)
    return a, _steady(muscles, a, l, v)[1]


def _steady(
    muscles: MuscleSet, a: np.ndarray, l: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forces and tendon lengths (m,) of muscles in equilibrium."""
    rows = np.empty((5, a.size))
    equilibria(muscles.tables, a, l, v, rows)
    return rows[0], rows[1]
