"""Processes of one machine that take turns in compiling, so that the next one loads what the one
before has compiled."""

from __future__ import annotations

import logging
import os
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from filelock import BaseFileLock

logger = logging.getLogger("exudyn_muscles")

# All kernels take a minute. Who has waited longer compiles for himself.
LONGEST = 600.0  # s


def begin_turn(stamp: str) -> bool:
    """Wait until no other process compiles kernels of these sources; whether one did.

    Turns are within turns, as kernels are compiled within the ones that call them. Where there can
    be no lock, everybody has a turn.
    """
    from filelock import Timeout  # slow to import, and needed at the first use on a machine alone

    try:
        _lock(stamp).acquire(timeout=0)
        return False
    except Timeout:
        logger.warning("waiting for another process, which compiles the muscle kernels")
        with suppress(Timeout):
            _lock(stamp).acquire(timeout=LONGEST)
    except OSError:
        pass
    return True


def end_turn(stamp: str) -> None:
    """The next one, if this was the outermost turn."""
    with suppress(OSError):
        _lock(stamp).release()


@cache
def _lock(stamp: str) -> BaseFileLock:
    from filelock import FileLock

    user = os.getuid() if hasattr(os, "getuid") else os.getlogin()
    return FileLock(Path(tempfile.gettempdir()) / f"exudyn_muscles-{user}-{stamp[:16]}.lock")
