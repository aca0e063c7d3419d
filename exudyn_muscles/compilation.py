"""A word to the user when numba is about to compile the kernels for the first time."""

from __future__ import annotations

import logging
import os
from functools import cache
from typing import Any

from .muscle.window import integrate_all
from .path.geometry import path_geometry
from .recruitment.excitation import excitations

logger = logging.getLogger("exudyn_muscles")

# Every method that recruits needs these; most of the time goes into the last one.
COMMON = (path_geometry, integrate_all, excitations)


def announce_compilation(*kernels: Any) -> None:
    """Log one line, once a process, if kernels are not in numba's cache of this machine.

    Parameters
    ----------
    *kernels : numba dispatchers
        Those about to be used; the ones common to the recruiting methods if left out.
    """
    if not all(is_compiled(kernel) for kernel in kernels or COMMON):
        _tell()


def is_compiled(kernel: Any) -> bool:
    """Whether a kernel was used in this process or is in numba's cache, for this very machine.

    True too where nothing can be known: numba was switched off, or keeps its cache otherwise.
    """
    try:
        if kernel.signatures:
            return True
        # An index of another numba version or of an older source file loads as an empty one.
        file = kernel._cache._cache_file
        machine = kernel.targetctx.codegen().magic_tuple()
        return any(
            key[1] == machine and os.path.exists(file._data_path(name))
            for key, name in file._load_index().items()
        )
    except Exception:
        return True


@cache
def _tell() -> None:
    # A warning, because these reach stderr without any configuration of logging.
    logger.warning("compiling the muscle kernels for this machine, some 20 s, once")
