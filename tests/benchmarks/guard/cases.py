"""What all benchmarks have in common."""

import warnings
from pathlib import Path
from time import process_time

import exudyn_muscles as em
from tests.benchmarks.timed import FILES, SETUPS

ROOT = Path(__file__).parents[3]
ROUNDS = 7  # at least,
ENOUGH = 0.5  # s, and until they have lasted that long
LONGEST = 300.0  # s, of a benchmark: the first one of a version compiles


def needs(model):
    """asv leaves out a benchmark whose files are not beside the repository."""
    if model in SETUPS and not (ROOT / SETUPS[model].folder).is_dir():
        raise NotImplementedError(f"{model} needs {FILES}")


def least(run, number=1):
    """CPU seconds of `run()` in the fastest of many rounds, each of `number` calls.

    The first call does not count: it compiles.
    """
    times = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", em.ExudynMusclesWarning)
        run()
        while len(times) < ROUNDS or sum(times) < ENOUGH:
            begun = process_time()
            for _ in range(number):
                run()
            times.append(process_time() - begun)
    return min(times) / number
