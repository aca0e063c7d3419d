"""User functions of an `mbs` outside of Exudyn's solver, which are how controllers are written."""

from __future__ import annotations

import exudyn as exu

from .hooks import goes_on, user_function


class UserControllers:
    """The functions that act on a step, called where no solver calls them; false without any."""

    def __init__(self, mbs: exu.MainSystem) -> None:
        self._mbs = mbs
        self._pre_step = user_function(mbs, "PreStep")
        self._pre_newton = user_function(mbs, "PreNewtonResidual")

    def __bool__(self) -> bool:
        return bool(self._pre_step or self._pre_newton)

    def before_step(self, t: float) -> bool:
        """A step to the time `t` begins at the current state; False: stop.

        Raises
        ------
        ModelError
            The function returned None.
        """
        if not self._pre_step:
            return True
        self._mbs.systemData.SetTime(t)  # as Exudyn has it there
        return goes_on("PreStep", self._pre_step(self._mbs, t))

    def before_residual(self, t: float) -> None:
        """The forces at the current state, at the time `t`, are wanted."""
        if self._pre_newton:
            self._pre_newton(self._mbs, t, 0, 0)
