"""Coordinates of a tree that are all independent: the basis is the identity.

This and `dependent.py` are what a skeleton's coordinates can be, with the same methods. With the
independent coordinates z, their basis R = dq/dz and the coordinates q of the whole tree, (1)
becomes M_z z'' + H_z - Q_z = R^T r^T F. Another kind is another file.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import ParameterError
from .geometry import Geometry
from .opened import Dynamics, Opened


class Independent:
    """z = q.

    Attributes
    ----------
    known_to_exudyn : bool
        Whether Exudyn itself integrates z: its initial accelerations and its Newton matrix are
        right.
    """

    known_to_exudyn = True

    def part(self, values: np.ndarray) -> np.ndarray:
        """Those of the independent coordinates among values (N,) of the whole tree."""
        return values

    def within(self, rows: slice) -> slice | np.ndarray:
        """The independent coordinates within a system in which the tree has these rows."""
        return rows

    def state_of_tree(self, *state: np.ndarray) -> tuple[np.ndarray, ...]:
        """Values (..., N) of the whole tree: q, if asked also q' and q''.

        From z, z', z'' (..., n).
        """
        return state

    def along(
        self, z: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, Callable[[np.ndarray], np.ndarray]]:
        """q, q' (k, N) of states z, z' (k, n), and what makes torques (k, n) of those on q."""
        return z, v, lambda torques: torques

    def geometry(self, of_tree: Callable[..., Geometry]) -> Callable[..., Geometry]:
        """The function (z, z') -> Geometry with r_z = r R from that of all coordinates."""
        return of_tree

    def state(self, opened: Opened) -> tuple[np.ndarray, np.ndarray]:
        """q, q' (N,) at Exudyn's iterate."""
        return opened.state.q, opened.state.v

    def dynamics(self, opened: Opened, place: tuple) -> Dynamics:
        """M_z (n, n) and H_z - Q_z (n,) at the current state, which is the `place`."""
        M, bias, _ = opened.dynamics()
        return Dynamics(M, bias, place)

    def begin(self, opened: Opened, torque: np.ndarray) -> None:
        """Set the muscles' torques (n,) at the start of a run, which is the current state."""
        opened.apply(torque)

    def settle(self, opened: Opened, newmark: bool) -> None:
        """The run begins at the current state, by Newmark's method or by generalized alpha.

        Raises
        ------
        ParameterError
            The solver's initial accelerations are wrong, and stay so.
        """
        # Exudyn's own q'' at the start, which the trapezoidal rule never forgets.
        M, bias, _ = opened.dynamics()
        torque = opened.applied
        lack = np.abs(M @ opened.state.a + bias - torque).max()
        if lack > 1e-6 * (np.abs(torque).max() + np.abs(bias).max()) + 1e-9:
            raise ParameterError(
                "the initial accelerations do not balance the initial torques; use an implicit "
                "solver with timeIntegration.generalizedAlpha.computeInitialAccelerations = True"
            )

    def apply(self, opened: Opened, torque: np.ndarray | None, here: Dynamics | None) -> None:
        """Set the muscles' torques (n,) at the iterate, where the `dynamics` are `here` if they are
        known; None: those that Exudyn has stay."""
        opened.apply(torque)

    def apply_again(
        self, opened: Opened, torque: np.ndarray, change: np.ndarray, lack: np.ndarray
    ) -> None:
        """As `apply`, at a later iterate of the same step: all forces were `lack` (N,) short of
        M q'' at the iterate before, which follows q'' by about `change` (N, N)."""
        opened.apply(torque)

    def applied(self, opened: Opened) -> np.ndarray:
        """The muscles' torques (n,) that Exudyn has now."""
        return opened.applied

    def reduced(self, opened: Opened, covectors: np.ndarray) -> np.ndarray:
        """x R (..., n) of torques or moment arms x (..., N) at the current state."""
        return covectors

    def reduced_rows(self, opened: Opened, exact: np.ndarray) -> np.ndarray:
        """The tree's rows of Exudyn's Newton matrix as those of z."""
        return exact

    def all_rows(self, opened: Opened, wanted: np.ndarray) -> np.ndarray:
        """The tree's rows of a Newton matrix with those of z."""
        return wanted

    def whole_matrix(self, opened: Opened, wanted: np.ndarray) -> np.ndarray:
        """Newton's matrix (N, N) of a tree that is alone from the rows of z."""
        return wanted
