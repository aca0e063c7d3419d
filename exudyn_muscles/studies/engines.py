"""Engines that exist: processes of this machine by joblib's loky, or a cluster by dask."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from concurrent.futures.process import BrokenProcessPool
from typing import TYPE_CHECKING, Any

from ..errors import StudyError
from ..results.trajectory import Trajectory
from .compute import compute
from .study import Row, Run

if TYPE_CHECKING:
    from distributed import Client

Done = tuple[Row, Trajectory | None]
Engine = Any  # int, str or Client, which is not imported here

# What a process has before NumPy is imported, so that it makes no threads of its own.
ENVIRONMENT = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
AHEAD = 2  # runs that wait for each process
AT_LEAST = 100  # of a cluster, which may still grow


def done(runs: Sequence[Run], engine: Engine) -> Generator[Done, None, None]:
    """Rows in the order in which they become known.

    Parameters
    ----------
    runs : sequence of Run
    engine : int, str or distributed.Client
        Number of processes, of which one is this one; or a dask scheduler's address, or a client of
        it.

    Raises
    ------
    StudyError
        There is no such engine, or its scheduler is lost.
    """
    if isinstance(engine, str):
        yield from _by_address(runs, engine)
    elif isinstance(engine, int) and not isinstance(engine, bool) and engine >= 1:
        yield from map(compute, runs) if engine == 1 else _by_processes(runs, engine)
    elif hasattr(engine, "submit") and hasattr(engine, "scheduler_info"):
        yield from _by_client(runs, engine)
    else:
        raise StudyError(
            f"engine = {engine!r}: expected a number of processes, the address of a dask scheduler "
            "or a client of it"
        )


def _by_processes(runs: Sequence[Run], processes: int) -> Iterator[Done]:
    """A process that dies takes the runs of the others with it. They are made once more, one at a
    time, so that it is known which one it was."""
    waiting, suspects = deque(runs), deque[Run]()
    while waiting or suspects:
        alone = bool(suspects)
        at_once = suspects if alone else waiting
        pool = _pool(1 if alone else processes)
        try:
            suspects = deque(
                (yield from _by_pool(pool, at_once, 1 if alone else AHEAD * processes))
            )
        finally:
            pool.shutdown(wait=True, kill_workers=True)
        if alone and suspects:
            guilty = suspects.popleft()
            yield _died(guilty, "the process of this run died"), None
            suspects.extend(at_once)


def _by_pool(pool: Any, waiting: deque[Run], most: int) -> Any:
    """Yield rows until there are no more runs or a process dies; the runs that were open then."""
    open_runs: dict[Any, Run] = {}
    while waiting or open_runs:
        while waiting and len(open_runs) < most:
            try:
                future = pool.submit(compute, waiting[0])
            except BrokenProcessPool:
                break
            open_runs[future] = waiting.popleft()
        finished, _ = wait(open_runs, return_when=FIRST_COMPLETED)
        broken = []
        for future in finished:
            if isinstance(future.exception(), BrokenProcessPool):
                broken.append(open_runs[future])
                continue
            yield _taken(future.result, open_runs.pop(future))
        if broken:
            return list(open_runs.values())
    return []


def _pool(processes: int) -> Any:
    from joblib.externals.loky import get_reusable_executor

    return get_reusable_executor(processes, reuse=False, env=ENVIRONMENT, kill_workers=True)


def _by_address(runs: Sequence[Run], address: str) -> Iterator[Done]:
    from distributed import Client

    try:
        client = Client(address, set_as_default=False)
    except (OSError, ValueError) as error:
        raise StudyError(f"engine '{address}': no dask scheduler answers ({error})") from error
    with client:
        yield from _by_client(runs, client)


def _by_client(runs: Sequence[Run], client: Client) -> Iterator[Done]:
    """dask gives a run whose workers die to others, some times, and tells of it then."""
    from distributed import CancelledError, KilledWorker, as_completed
    from distributed.comm import CommClosedError

    waiting, open_runs, finished = deque(runs), dict[Any, Run](), as_completed(loop=client.loop)
    most = max(AT_LEAST, AHEAD * sum(client.nthreads().values()))
    try:
        while waiting or open_runs:
            while waiting and len(open_runs) < most and client.status == "running":
                future = client.submit(compute, waiting[0], pure=False)
                finished.add(future)
                open_runs[future] = waiting.popleft()
            future = next(finished)
            try:
                row = _taken(future.result, open_runs[future])
            except KilledWorker as error:
                row = _died(open_runs[future], f"the worker of this run died ({error})"), None
            del open_runs[future]  # and its result on the worker
            yield row
    except (CancelledError, CommClosedError, TimeoutError, StopIteration) as error:
        raise StudyError(f"the dask scheduler is lost ({type(error).__name__}: {error})") from error
    finally:
        if client.status == "running":
            client.cancel(list(open_runs))


def _taken(result: Callable[[], Done], run: Run) -> Done:
    """The result; where a worker could not even begin, as it cannot import what it needs, a row
    that says so."""
    try:
        return result()
    except (ImportError, AttributeError) as error:
        text = f"{type(error).__name__}: {error}"
        return Row(run.number, "failed", (math.nan,) * len(run.outcomes), text), None


def _died(run: Run, message: str) -> Row:
    return Row(run.number, "died", (math.nan,) * len(run.outcomes), message)
