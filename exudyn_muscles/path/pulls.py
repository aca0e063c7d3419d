"""How muscles pull: unit forces at points of links, and on coordinates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..numerics.kernel import kernel

# Kinds of rows of `Pulls`.
ON_LINK, ON_COORDINATE = 0, 1
# Columns of their values; a generalized force stands where the force's x does.
POINT, FORCE, PULL_COLUMNS = 0, 3, 6


class Pulls(NamedTuple):
    """What a unit of force in each of m muscles does, row by row.

    `kinds` (k,) are ON_LINK or ON_COORDINATE, `numbers` (k,) the link or coordinate; `values`
    (k, 6) hold a global point [m] and the force there, or the generalized force. Muscle i has the
    rows firsts[i] to lasts[i]. Forces on ground are left out.
    """

    kinds: np.ndarray
    numbers: np.ndarray
    values: np.ndarray
    firsts: np.ndarray
    lasts: np.ndarray


@kernel(inline=True)
def pull_link(pulls, k, link, points, row, e, sign):
    """Write sign * e at a point of a link as row `k`; returns the number of the next one."""
    if link < 0:
        return k
    pulls.kinds[k], pulls.numbers[k] = ON_LINK, link
    for axis in range(3):
        pulls.values[k, POINT + axis] = points[row, axis]
        pulls.values[k, FORCE + axis] = sign * e[axis]
    return k + 1


@kernel(inline=True)
def pull_coordinate(pulls, k, coordinate, force):
    """Write a generalized force as row `k`; returns the number of the next one."""
    pulls.kinds[k], pulls.numbers[k] = ON_COORDINATE, coordinate
    pulls.values[k, FORCE] = force
    return k + 1
