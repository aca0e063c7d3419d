"""Compiled kernels on disk: numba's cache, which does without what is damaged or has no place."""

from __future__ import annotations

import logging
import pickle
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    InTreeCacheLocator,
    NullCache,
)
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps

from ..files.disk import write_file
from .turns import begin_turn, end_turn, turn_of

logger = logging.getLogger("exudyn_muscles")

INSTALLED = {"site-packages", "dist-packages"}  # folders of packages that pip has copied
CHECKSUM = 32  # bytes, of SHA-256


def kernel_cache(function: Callable, stamp: str) -> FunctionCache | NullCache:
    """Where the compiled versions of a kernel are kept for as long as `stamp` stays the same."""
    try:
        return KernelCache(function, stamp)
    except Exception as error:  # numba found no folder that can be written
        folder = Path(function.__code__.co_filename).parent / "__pycache__"
        _warn_once(NOT_KEPT, str(folder), error)
        return NullCache()


class _Elsewhere(CompileResultCacheImpl):
    """Not beside the sources: what is stored among installed packages stays there when they are
    removed, and hides those that are installed from a checkout."""

    _locator_classes = tuple(
        each
        for each in CompileResultCacheImpl._locator_classes
        if not issubclass(each, InTreeCacheLocator)
    )


class KernelCache(FunctionCache):
    """numba's cache of one function, for which a file that cannot be used is a missing one.

    Attributes
    ----------
    turn : str
        In which it is compiled, see `turns.py`.

    Raises
    ------
    RuntimeError
        No folder can be written.
    """

    def __init__(self, function: Callable, stamp: str) -> None:
        if INSTALLED & set(Path(function.__code__.co_filename).parts):
            self._impl_class = _Elsewhere
        super().__init__(function)
        self.turn = turn_of(stamp, function.__module__, function.__code__.co_filename)
        self._cache_file = _Versions(Path(self.cache_path), self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is stored; None, and its turn to compile, if nothing can be used."""
        found = self._stored(sig, target_context)
        if found is None and begin_turn(self.turn):
            found = self._stored(sig, target_context)
            if found is not None:
                self.give_up()
        return found

    def give_up(self) -> None:
        """End the turn without a compiled kernel."""
        end_turn(self.turn)

    def _stored(self, sig: Any, target_context: Any) -> Any:
        # numba's own load_overload first imports all that it can compile, 0.3 s of which a stored
        # kernel needs nothing but the memory of its arrays; its compiler does so by itself.
        try:
            rtsys.initialize(target_context)
            return self._load_overload(sig, target_context)
        except Exception as error:  # of the file system, of pickle or of LLVM
            _warn_once(DAMAGED, self.cache_path, error)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except Exception as error:
            _warn_once(NOT_KEPT, self.cache_path, error)
        finally:
            end_turn(self.turn)


class _Versions:
    """The compiled versions of one kernel: an index of their signatures, and a file for each.

    Takes the place of numba's `IndexDataCacheFile`. A file begins with its checksum, without which
    damaged machine code would be run, and says what it is for, as other processes may write here at
    the same time.
    """

    def __init__(self, folder: Path, name: str, stamp: str) -> None:
        self._folder, self._name, self._stamp = folder, name, stamp.encode()

    def load(self, key: Any) -> Any:
        """The version for a signature, None if there is none."""
        number = self._index().get(key)
        try:
            found, version = (None, None) if number is None else pickle.loads(self._read(number))
        except FileNotFoundError:
            return None
        return version if found == key else None

    def save(self, key: Any, version: Any) -> None:
        """Add a version, or replace one that cannot be used."""
        try:
            index = self._index()
        except Exception:  # as `load` has said
            index = {}
        number = index.setdefault(key, max(index.values(), default=0) + 1)
        self._write(number, dumps((key, version)))
        self._write("index", self._stamp + dumps(index))

    def flush(self) -> None:
        """Forget all versions."""
        self._write("index", self._stamp + dumps({}))

    def _index(self) -> dict[Any, int]:
        """Numbers of the versions by signature; none if they are of other sources."""
        try:
            content = self._read("index")
        except FileNotFoundError:
            return {}
        # The stamp is read first: the rest may name types of a module that was moved since.
        if not content.startswith(self._stamp):
            return {}
        return pickle.loads(content[len(self._stamp) :])

    def _path(self, which: int | str) -> Path:
        return self._folder / f"{self._name}.{which}.kernel"

    def _read(self, which: int | str) -> bytes:
        content = self._path(which).read_bytes()
        if sha256(content[CHECKSUM:]).digest() != content[:CHECKSUM]:
            raise ValueError(f"{self._path(which).name} is damaged")
        return content[CHECKSUM:]

    def _write(self, which: int | str, content: bytes) -> None:
        write_file(self._path(which), sha256(content).digest() + content)


# What is said, each once a process for all kernels together. It goes to the log, not to `warnings`,
# which may be errors: the state of a machine must not stop a run.
DAMAGED = "stored kernels in %s cannot be used and are compiled anew: %s"
NOT_KEPT = (
    "compiled kernels cannot be kept in %s, so that every process compiles its own: %s; the "
    "environment variable NUMBA_CACHE_DIR can name another folder"
)
_said: set[str] = set()


def _warn_once(text: str, folder: str, error: Exception) -> None:
    if text not in _said:
        _said.add(text)
        logger.warning(text, folder, str(error) or repr(error))
