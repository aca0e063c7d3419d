"""A run's hold on an `mbs`: what it changes there, and how that was before.

How something was is noted before it is changed, where the `mbs` itself leads to it. Whatever ends a
run, everything is put back: at once or, after an interrupt in the middle of putting back, before
the next run begins.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager, suppress
from inspect import GEN_CLOSED, getgeneratorstate

import exudyn as exu

from ..errors import ModelError

HELD = "exudyn_muscles"  # in mbs.sys


class Hold:
    """One run's hold, from `take` to `release`.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    lasts : callable
        Whether the run still goes on; what is left of one that does not may be put back.
    """

    def __init__(self, mbs: exu.MainSystem, lasts: Callable[[], bool] = lambda: True) -> None:
        self._mbs = mbs
        self._lasts = lasts
        self._before: list[Callable[[], object]] = []

    def take(self) -> None:
        """Raise ModelError if another run holds the `mbs`."""
        last = self._mbs.sys.get(HELD)
        if last is not None:
            if last._lasts():
                raise ModelError(
                    "another run is attached to this mbs: one attached() serves one run at a time"
                )
            last.release()
        self._mbs.sys[HELD] = self

    def keep(self, put_back: Callable[[], object]) -> None:
        """Note how something is put back that is about to be changed."""
        self._before.append(put_back)

    def release(self) -> None:
        """Put everything back, what was changed last first; once more does no harm."""
        for put_back in reversed(self._before):
            with suppress(exu.ExudynError):  # a user may have reset the mbs meanwhile
                put_back()
        self._mbs.sys.pop(HELD, None)


def hold(mbs: exu.MainSystem) -> AbstractContextManager[Hold]:
    """The hold of one run, released where the block ends.

    Raises
    ------
    ModelError
        Another run holds the `mbs`.
    """

    def lasts() -> bool:
        run = current()
        return run is not None and getgeneratorstate(run) != GEN_CLOSED

    def steps() -> Generator[Hold]:
        held = Hold(mbs, lasts)
        held.take()
        try:
            yield held
        finally:
            try:
                held.release()
            except BaseException:  # an interrupt at this very moment
                held.release()
                raise

    running = steps()
    # A generator knows exactly whether it has ended, which no flag that it sets does.
    current = weakref.ref(running)
    return contextmanager(lambda: running)()
