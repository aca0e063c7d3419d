"""A word to the user while numba compiles the kernels, which takes long the first time."""

from __future__ import annotations

import logging
from time import process_time

from numba.core import event
from numba.core.event import Event

from .kernel_cache import KernelCache

logger = logging.getLogger("exudyn_muscles")

PACKAGE = __name__.split(".")[0]
PATIENCE = 5.0  # s of CPU time between two lines


class _Compilation(event.Listener):
    """Logs that kernels of the package are compiled, how many so far, and in which CPU time.

    As warnings, because these reach stderr without any configuration of logging.
    """

    def __init__(self) -> None:
        self._kernels = 0
        self._spent = self._said = 0.0

    def on_start(self, event: Event) -> None:
        if not _is_ours(event):
            return
        self._begun = process_time()
        if self._kernels == 0:
            kept = event.data["dispatcher"].stats.cache_path is not None
            logger.warning(
                "compiling the muscle kernels%s", ", once for this machine" if kept else ""
            )

    def on_end(self, event: Event) -> None:
        if not _is_ours(event):
            return
        # Not is_failed, which numba 0.68 has the wrong way round.
        failed = getattr(event, "_exc_details", None) is not None
        if failed and isinstance(event.data["dispatcher"]._cache, KernelCache):
            event.data["dispatcher"]._cache.give_up()
        self._kernels += 1
        self._spent += process_time() - self._begun
        if self._spent - self._said > PATIENCE:
            self._said = self._spent
            logger.warning(
                "compiled %d kernels in %.0f s of CPU time so far", self._kernels, self._spent
            )


def _is_ours(event: Event) -> bool:
    return event.data["dispatcher"].py_func.__module__.split(".")[0] == PACKAGE


def tell_of_compilation() -> None:
    """Log compilations from now on."""
    event.register("numba:compile", _Compilation())
