"""What a method does at each event of a run; when they happen is in `plugin.py`."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from ..motion import Motion
from ..results.recorder import Window
from ..skeleton.opened import ForceSlopes
from ..skeleton.tree_rows import TreeRows
from .settings import RunSettings
from .state import RunState


class Method(ABC):
    """What `Plugin` asks of a method.

    Attributes
    ----------
    method : str
        Its name in results.
    feeds_back : bool
        The torque depends on the iterate, so that Newton's matrix has to know it.
    goes_by_rule : bool
        The coordinates are where Exudyn's rule has them.
    settings : RunSettings
    motion : Motion, optional
        What is tracked, if anything.
    state : RunState
    """

    method: str
    feeds_back = True
    goes_by_rule = True
    settings: RunSettings
    motion: Motion | None
    state: RunState

    @abstractmethod
    def new_state(self) -> RunState:
        """State of a run that has not begun."""

    @abstractmethod
    def begin(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Set the state's `a`, `l_t` (m,) and `geometry` at the start; return the torque (n,).

        They are the committed state from then on; only `accept` replaces them.
        """

    @abstractmethod
    def ready(self, step: float) -> None:
        """The run begins, or goes on, with steps of length `step` [s]: a last chance to warn."""

    @abstractmethod
    def open_step(self, t_0: float, t_1: float) -> None:
        """A step is tried: `skeleton.start` holds q, q', q'' at `t_0`."""

    @abstractmethod
    def torque(self, t: float, first: bool) -> np.ndarray | None:
        """The torque (n,) at Exudyn's iterate; None leaves the last one.

        `first` marks Exudyn's predictor, where q'' is zero.
        """

    @abstractmethod
    def jacobian(self, exact: np.ndarray, mass: float, dq: float, dv: float) -> np.ndarray:
        """The tree's rows of the Newton matrix (n, N) in place of Exudyn's `exact` ones.

        N counts all coordinates of the system, the tree's are `skeleton.free`. Exudyn's matrix is
        mass * M + dq * dR/dq + dv * dR/dq', where dq, dv < 0 are its own factors and R is its
        right-hand side with the muscles' torque held.
        """

    @abstractmethod
    def slopes(self, tree: TreeRows) -> ForceSlopes | None:
        """Those from which `exact` is made where this tree is alone; None: `jacobian` does not look
        at it."""

    @abstractmethod
    def accept(self, t_0: float, t_1: float) -> tuple[np.ndarray, Window | None]:
        """The step is accepted at the last iterate: commit.

        Returned are the reserves (r,) and, unless the window before goes on, the window.
        """
