"""The rows of a table in a storage file."""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence

import numpy as np

from ..errors import StorageError, StorageWarning, cut, warn


def read_table(
    file: str,
    lines: Sequence[str],
    rows: Sequence[int],
    labels: Sequence[str],
    announced: tuple[int, int] | None,
) -> np.ndarray:
    """The rows (k, c), whose first column is a time that does not decrease.

    Parameters
    ----------
    file : str
    lines : sequence of str
        All of the file.
    rows : sequence of int
        Which of them are rows.
    labels : (c,) sequence of str
    announced : (int, int), optional
        How many rows the header announces, and in what line. What is damaged behind these is left
        out.

    Raises
    ------
    StorageError
        A row is damaged; names its line.

    Warns
    -----
    StorageWarning
        There are more or fewer rows than are announced.
    """
    numbers = array("d")
    last, read = -math.inf, 0
    for k in rows:
        try:
            row = _numbers(file, k, lines[k].split(), labels, last)
        except StorageError:
            if announced is None or read < announced[0]:
                raise
            break
        last, read = row[0], read + 1
        numbers.extend(row)
    if announced is not None and announced[0] != len(rows):
        text = f"nRows={announced[0]}, but there are {len(rows)} rows, "
        text += "which are read" if read == len(rows) else f"of which the first {read} are read"
        warn(f"{file}, line {announced[1]}: {text}", StorageWarning)
    return np.array(numbers).reshape(read, len(labels))


def _numbers(
    file: str, k: int, words: Sequence[str], labels: Sequence[str], last: float
) -> list[float]:
    """The words of line k as numbers, of which the first is no time before `last`."""
    here = f"{file}, line {k + 1}"
    if len(words) != len(labels):
        raise StorageError(f"{here}: {len(words)} values for {len(labels)} columns")
    row: list[float] = []
    try:
        row.extend(map(float, words))
    except ValueError:
        word, label = cut(words[len(row)]), cut(labels[len(row)])
        raise StorageError(f"{here}: '{word}' in column '{label}' is no number") from None
    if not last <= row[0] < math.inf:
        raise StorageError(f"{here}: time must increase, {row[0]} s follows {last} s")
    return row
