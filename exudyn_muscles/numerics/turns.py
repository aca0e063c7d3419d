"""Processes of one machine that take turns in compiling, so that the next one loads what the one
before has compiled.

There is a turn for each room of the package and place where kernels are stored.
"""

from __future__ import annotations

import logging
import os
import tempfile
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from numba.core import config

if TYPE_CHECKING:
    from filelock import BaseFileLock

logger = logging.getLogger("exudyn_muscles")

# All kernels take a minute. Who has waited longer compiles for himself.
LONGEST = 600.0  # s


def turn_of(stamp: str, module: str, file: str) -> str:
    """What the turn to compile kernels of a module in a `file`, of sources with this `stamp`, is
    called."""
    room, package = module.split(".")[:2], Path(file).parents[max(module.count(".") - 1, 0)]
    return sha256(f"{stamp} {room} {config.CACHE_DIR} {package}".encode()).hexdigest()[:32]


def begin_turn(turn: str) -> bool:
    """Wait until no other process has this turn; whether one did.

    Where there can be no lock, everybody has a turn.
    """
    from filelock import Timeout  # slow to import, and needed at the first use on a machine alone

    try:
        _lock(turn).acquire(timeout=0)
        return False
    except Timeout:
        logger.warning("waiting for another process, which compiles the muscle kernels")
        with suppress(Timeout):
            _lock(turn).acquire(timeout=LONGEST)
    except OSError:
        pass
    return True


def end_turn(turn: str) -> None:
    """The next one's turn."""
    with suppress(OSError):
        _lock(turn).release()


@cache
def _lock(turn: str) -> BaseFileLock:
    from filelock import FileLock

    user = os.getuid() if hasattr(os, "getuid") else os.getlogin()
    return FileLock(Path(tempfile.gettempdir()) / f"exudyn_muscles-{user}-{turn}.lock")
