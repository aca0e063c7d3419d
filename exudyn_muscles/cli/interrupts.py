"""Ctrl-C, and the SIGTERM that clusters send at the time limit."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class Terminated(KeyboardInterrupt):
    """SIGTERM; it ends a run just as Ctrl-C does."""


@contextmanager
def terminable() -> Iterator[None]:
    """SIGTERM raises `Terminated` within, unless the process has its own way with it."""
    if not _is_main() or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextmanager
def uninterrupted() -> Iterator[list[int]]:
    """Signals that would interrupt are only collected."""
    waiting: list[int] = []
    if not _is_main():
        yield waiting
        return
    before = [(each, signal.getsignal(each)) for each in (signal.SIGINT, signal.SIGTERM)]
    for number, _ in before:
        signal.signal(number, lambda received, _: waiting.append(received))
    try:
        yield waiting
    finally:
        for number, handler in before:
            signal.signal(number, handler)


def _is_main() -> bool:
    """Signals are the main thread's."""
    return threading.current_thread() is threading.main_thread()


def _terminate(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # once is enough
    raise Terminated
