"""The decorator of all compiled kernels."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
from numba.core.dispatcher import Dispatcher

from .compilation import tell_of_compilation
from .kernel_cache import kernel_cache

# Kernels call each other and freeze constants across these files.
SOURCES = (
    "numerics", "muscle", "path", "forces", "forces/passive", "skeleton/tree.py",
    "skeleton/carried.py", "skeleton/geometry.py", "skeleton/passive.py", "skeleton/dependent.py",
    "skeleton/closures.py", "skeleton/rotations.py", "skeleton/system/frames.py",
    "skeleton/system/measuring.py", "skeleton/system/geometry.py", "recruitment",
    "methods/unified.py", "methods/tracking.py", "methods/course",
)  # fmt: skip


def kernel(
    function: Callable | None = None, *, inline: bool = False, allocates: bool = False
) -> Any:
    """Compile with numba at the first call, and keep the result on disk.

    numba forgets a stored kernel when its own file changes, but not when another file does whose
    kernels or constants it contains. Here it is kept for as long as no kernel source changes at
    all.

    Parameters
    ----------
    function : callable
    inline : bool
        Every caller gets a copy of its own: for what inner loops call.
    allocates : bool
        It makes arrays. Others do without the reference counts of the arrays that they are given,
        which took more than half of the time.
    """
    if function is None:
        return partial(kernel, inline=inline, allocates=allocates)
    # Without fastmath, which would save a sixth: fused multiply-adds fall differently in the
    # process that compiles a kernel and in those that load it, and so would a result's last bits.
    compiler = numba.njit(error_model="numpy", forceinline=inline, _nrt=allocates)
    dispatcher = compiler(function)
    if isinstance(dispatcher, Dispatcher):  # numba's compiler is not switched off
        dispatcher._cache = kernel_cache(function, _stamp())
    return dispatcher


tell_of_compilation()


@cache
def _stamp() -> str:
    """Hash of the version of numba and the contents of all kernel sources."""
    root = Path(__file__).parents[1]
    content = sha256(numba.__version__.encode())
    for source in SOURCES:
        path = root / source
        for file in sorted(path.glob("*.py")) if path.is_dir() else [path]:
            content.update(file.read_bytes())
    return content.hexdigest()
