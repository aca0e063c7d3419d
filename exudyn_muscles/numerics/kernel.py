"""The decorator of all compiled kernels."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property, partial, update_wrapper
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

# Kernels call each other and freeze constants across these files.
SOURCES = (
    "numerics", "muscle", "path", "forces", "forces/passive", "skeleton/tree.py",
    "skeleton/carried.py", "skeleton/geometry.py", "skeleton/passive.py", "skeleton/dependent.py",
    "skeleton/tied.py", "skeleton/closures.py", "skeleton/rotations.py",
    "skeleton/system/frames.py", "skeleton/system/measuring.py", "skeleton/system/geometry.py",
    "recruitment",
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
    return Kernel(function, inline, allocates)


class Kernel:
    """A compiled function. numba, which is slow to import, comes with the first call.

    Each is of a class of its own, which Python asks for what a call is.
    """

    def __new__(cls, *_: Any) -> Kernel:
        return super().__new__(type(cls.__name__, (cls,), {}))

    def __init__(self, function: Callable, inline: bool, allocates: bool) -> None:
        update_wrapper(self, function)
        self._function, self._options = function, (inline, allocates)

    def __call__(self, *args: Any) -> Any:
        # From now on without a step in between.
        type(self).__call__ = staticmethod(self.entry)  # type: ignore[method-assign]
        return self.entry(*args)

    def __reduce__(self) -> str:
        return self._function.__qualname__

    @cached_property
    def entry(self) -> Any:
        """What Python calls: numba's dispatcher, the function if its compiler is switched off."""
        from . import dispatchers

        return dispatchers.entry(self._function, *self._options, _stamp())

    @cached_property
    def part(self) -> Any:
        """What other kernels call."""
        from . import dispatchers

        return dispatchers.Part(self.entry)

    @property
    def _numba_type_(self) -> Any:
        return self.part._numba_type_


@cache
def _stamp() -> str:
    """Hash of the version of numba and the contents of all kernel sources."""
    root = Path(__file__).parents[1]
    content = sha256(version("numba").encode())
    for source in SOURCES:
        path = root / source
        for file in sorted(path.glob("*.py")) if path.is_dir() else [path]:
            content.update(file.read_bytes())
    return content.hexdigest()
