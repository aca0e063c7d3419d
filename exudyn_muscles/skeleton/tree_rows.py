"""A tree's rows of Newton's matrix."""

from __future__ import annotations

import numpy as np

from .base import ExudynSkeleton, Gain
from .basis import Basis
from .opened import Dynamics, ForceSlopes, Opened, fastest


class TreeRows(ExudynSkeleton):
    """What a `Skeleton` says of Newton's matrix."""

    basis: Basis
    _opened: Opened

    @property
    def alone(self) -> bool:
        """Whether it is all that the system has to be solved for."""
        data = self.mbs.systemData
        sizes = data.ODE1Size(), data.AEsize(), data.DataSize(), self.mbs.NumberOfGeneralContacts()
        return not (self.others or any(sizes))

    def imbalance(self, there: Dynamics, a: np.ndarray, torque: np.ndarray) -> np.ndarray:
        return there.torque(a) - torque

    def rows_of_law(
        self, exact: np.ndarray, here: Dynamics, mass: float, kp: Gain, kv: Gain
    ) -> np.ndarray:
        # The residual is M (q'' - q''_CTC), whatever else acts on the skeleton.
        rows = np.zeros(exact.shape)
        rows[:, self.free] = here.M * (mass - kp - kv)
        return rows

    def rows_of_slopes(
        self, exact: np.ndarray, here: Dynamics, mass: float, slopes: np.ndarray
    ) -> np.ndarray:
        rows = exact.copy()
        rows[:, self.free] = mass * here.M - slopes
        return rows

    def reduced(self, covectors: np.ndarray) -> np.ndarray:
        return self.basis.reduced(self._opened, covectors)

    def fastest(self) -> float:
        """That of `fastest` at the current state."""
        slopes = (self.reduced_rows(x)[:, self.free] for x in self._opened.slopes())
        return fastest(self.dynamics().M, *slopes)

    def slopes(self) -> ForceSlopes:
        """Those of the forces at the current state."""
        return self._opened.slopes()

    def reduced_rows(self, exact: np.ndarray) -> np.ndarray:
        return self.basis.reduced_rows(self._opened, exact)

    def all_rows(self, wanted: np.ndarray) -> np.ndarray:
        return self.basis.all_rows(self._opened, wanted)

    # Of one that is alone.

    def whole_matrix(self, wanted: np.ndarray) -> np.ndarray:
        """Newton's matrix from the rows of the coordinates that loads act on."""
        return self.basis.whole_matrix(self._opened, wanted)

    def apply_again(self, torque: np.ndarray, change: np.ndarray, lack: np.ndarray) -> None:
        """As `apply`, at a later iterate of the same step: all forces were `lack` (N,) short of
        M q'' at the iterate before, which follows q'' by about `change` (N, N)."""
        self.basis.apply_again(self._opened, torque, change, lack)
