"""The user functions of an `mbs`: the user's own, and a plugin's behind them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import exudyn as exu

from ..errors import ModelError


class Hooks:
    """The user functions that the `mbs` had, and the plugin's in front of the solver."""

    NAMES = ("PreStep", "PreNewtonResidual", "SystemJacobian", "PostStep")

    def __init__(self, mbs: exu.MainSystem) -> None:
        self._mbs = mbs
        self._before = {name: user_function(mbs, name) for name in self.NAMES}
        self._installed: dict[str, Callable] = {}
        if self._before["SystemJacobian"]:
            raise ModelError(
                "the mbs has a SystemJacobian user function; the plugin needs this one for itself"
            )

    def install(self, own: Mapping[str, Callable]) -> None:
        """Put a plugin's functions, by the names of the hooks, behind those of the user."""
        for name, function in own.items():
            self._installed[name] = _chained(name, self._before[name], function)
            getattr(self._mbs, f"Set{name}UserFunction")(self._installed[name])

    def check(self) -> None:
        """Raise ModelError if any of them is no longer there, or one has come that nobody calls."""
        expected = self._before | self._installed
        lost = [name for name, own in expected.items() if user_function(self._mbs, name) != own]
        if lost:
            raise ModelError(
                f"the mbs got another {' and another '.join(lost)} user function within "
                "attached(), without which there are no muscles; set your own ones before: they "
                "are called first"
            )

    def restore(self) -> None:
        """Put the user's functions back."""
        for name, function in self._before.items():
            getattr(self._mbs, f"Set{name}UserFunction")(function)

    @property
    def of_user(self) -> bool:
        """Whether the user has any."""
        return any(self._before.values())


def user_function(mbs: exu.MainSystem, name: str) -> Any:
    """The `mbs`'s function of such a name now; something false if there is none."""
    stored = getattr(mbs, f"Get{name}UserFunction")()
    return stored["function"] if isinstance(stored, dict) else stored


def _chained(name: str, before: Any, own: Callable) -> Callable:
    """The user's own function first, then the plugin's."""
    if not before:
        return own
    if name == "PreNewtonResidual":

        def both(*arguments: Any) -> None:
            before(*arguments)
            own(*arguments)

        return both

    def checked(*arguments: Any) -> bool:
        proceed = goes_on(name, before(*arguments))
        return own(*arguments) and proceed

    return checked


def goes_on(name: str, returned: Any) -> bool:
    """Whether a run goes on after a user function has returned this; ModelError for None."""
    if returned is None:
        raise ModelError(
            f"the {name} user function of the mbs returned None, on which Exudyn would stop "
            "without a word; return True to go on or False to stop"
        )
    return bool(returned)
