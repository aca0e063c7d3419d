"""Random cases of every kind until the time is over, and a line for every finding:

    python -m tests.fuzz --minutes 5 [--seed N]
    python -m tests.fuzz --kind paths --seed 123 --count 1

Every kind is a module with a function `check(rng)` that draws one case, raises whatever is wrong
with it, and says in a word how it went. The case with the seed s is drawn from
`np.random.default_rng(s)`; a run's cases of each kind have the seeds N, N + 1, ... The kinds share
the time. The exit status is 1 if there was a finding.
"""

import argparse
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from contextlib import contextmanager

import exudyn as exu
import numpy as np

from . import files, interrupts, models, paths, recruitments, windows

KINDS = {
    "windows": windows,
    "recruitments": recruitments,
    "paths": paths,
    "models": models,
    "files": files,
    "interrupts": interrupts,
}
LIMIT = 120.0  # CPU seconds of one case, unless the kind has a limit of its own


@contextmanager
def limited(seconds):
    """CPU time that a case may take: so much whatever else the machine does."""

    def stop(*_):
        raise TimeoutError(f"took more than {seconds:g} s")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def case(kind, seed):
    """How one case went, and the exception that is a finding, if there is one."""
    module = KINDS[kind]
    try:
        with warnings.catch_warnings(), limited(getattr(module, "LIMIT", LIMIT)):
            warnings.simplefilter("ignore")
            return module.check(np.random.default_rng(seed)), None
    except Exception as error:
        return "FINDING", error


def line(kind, seed, error):
    text = " ".join(f"{type(error).__name__}: {error}".split())
    place = traceback.extract_tb(error.__traceback__)[-1]
    return (
        f"FINDING {text[:300]} ({place.filename}, line {place.lineno})\n"
        f"    python -m tests.fuzz --kind {kind} --seed {seed} --count 1"
    )


def run(kinds, seed, minutes, count):
    """Cases until the time is over or every kind had its count; returns how they went, by kind."""
    spent, went = dict.fromkeys(kinds, 0.0), {kind: Counter() for kind in kinds}
    waiting, end = list(kinds), time.monotonic() + 60.0 * minutes
    while waiting and time.monotonic() < end:
        kind = min(waiting, key=spent.get)
        begun, number = time.monotonic(), seed + went[kind].total()
        outcome, error = case(kind, number)
        if error is not None:
            print(line(kind, number, error), flush=True)
            if count == 1:
                traceback.print_exception(error)
        spent[kind] += time.monotonic() - begun
        went[kind][outcome] += 1
        if went[kind].total() == count:
            waiting.remove(kind)
    for kind, counter in went.items():
        parts = ", ".join(f"{number} {outcome}" for outcome, number in counter.most_common())
        print(f"{kind}: {counter.total()} cases in {spent[kind]:.0f} s: {parts}")
    return went


def main(arguments=None):
    parser = argparse.ArgumentParser("python -m tests.fuzz", description=__doc__.split("\n")[0])
    parser.add_argument("--minutes", type=float, default=np.inf, help="of the whole run")
    parser.add_argument("--seed", type=int, help="of the first case of each kind; any if left out")
    parser.add_argument("--kind", choices=KINDS, action="append", help="all if left out")
    parser.add_argument("--count", type=int, help="of cases of each kind")
    given = parser.parse_args(arguments)
    if given.count is None and given.minutes == np.inf:
        parser.error("give --minutes or --count")
    exu.config.printToConsole = False  # the solver's complaints about motions that are too violent
    seed = int(np.random.SeedSequence().entropy % 10**9) if given.seed is None else given.seed
    print(f"seed {seed}", flush=True)
    went = run(given.kind or list(KINDS), seed, given.minutes, given.count)
    return int(any(counter["FINDING"] for counter in went.values()))


if __name__ == "__main__":
    sys.exit(main())
