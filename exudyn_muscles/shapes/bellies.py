"""Muscles as bodies: a belly between tendons, along the path as it was computed.

How thick and how long bellies are is a drawing's convention, as parameters of muscles do not say
it: lengths are those of the fibres, but not less than `SHORTEST` of the path, and two thirds of the
tendon lie beyond them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .tubes import on_vertices, triangles, tube

# Specific tension [N/m^2] that makes cross-sections of strengths: E. M. Arnold et al., "A model of
# the lower limb for analysis of human movement", Ann. Biomed. Eng. 38 (2010) 269-279.
SPECIFIC_TENSION = 0.61e6
SHORTEST, LONGEST = 0.4, 0.9  # parts of the path that a belly takes
BEFORE = 1.0 / 3.0  # of the tendon
RESTING = 0.35  # part of the cross-section that a muscle without force has
SLENDER = 0.16  # largest radius of a belly over its length
TENDON = 0.2  # radius over that of the belly
# Rings of either tendon, and of a belly, along a path without bends, and at most.
TENDON_RINGS, BELLY_RINGS = (2, 8), (11, 21)


class Body(NamedTuple):
    """A muscle at k times: vertices (k, v, 3) [m], triangles (t, 3), and which of its vertices are
    of the belly (v,)."""

    vertices: np.ndarray
    triangles: np.ndarray
    on_belly: np.ndarray


def body(lines: Sequence[np.ndarray], fibers: np.ndarray, forces: np.ndarray, F0: float) -> Body:
    """The body of a muscle.

    Parameters
    ----------
    lines : sequence of k (points, 3) ndarray
        Its path [m].
    fibers : (k,) ndarray
        Lengths of its fibres along the tendon [m].
    forces : (k,) ndarray
        [N].
    F0 : float
        Its maximum isometric force [N].
    """
    bends = max(map(len, lines)) - 2
    tendon, belly = (min(least + bends, most) for least, most in (TENDON_RINGS, BELLY_RINGS))
    shape = np.concatenate([np.zeros(tendon), _profile(belly), np.zeros(tendon)])
    points, radii = np.empty((len(lines), shape.size, 3)), np.empty((len(lines), shape.size))
    strength = np.clip(forces / F0, 0.0, 1.5)
    for k, line in enumerate(lines):
        points[k], along = _rings(line, fibers[k], (tendon, belly, tendon))
        widest = min(np.sqrt(F0 / (np.pi * SPECIFIC_TENSION)), SLENDER * along)
        thickness = np.sqrt(RESTING + (1.0 - RESTING) * strength[k])
        radii[k] = widest * (TENDON + (thickness - TENDON) * shape)
    on_belly = np.repeat([False, True, False], [tendon, belly, tendon])
    return Body(tube(points, radii), triangles(shape.size), on_vertices(on_belly))


def _profile(rings: int) -> np.ndarray:
    """How much of a belly every ring of it has, 0 to 1."""
    return np.sin(np.pi * np.linspace(0.0, 1.0, rings)) ** 0.8


def _rings(
    line: np.ndarray, fiber: float, counts: tuple[int, int, int]
) -> tuple[np.ndarray, float]:
    """Points (n, 3) along a path, as many on tendon, belly and tendon as `counts` says, and the
    length of the belly [m].

    Rings are evenly spaced, but that the nearest one to each point of the path moves there, so
    that its bends are not cut.
    """
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    length = s[-1]
    belly = float(np.clip(fiber / length if length > 0.0 else 1.0, SHORTEST, LONGEST)) * length
    first = BEFORE * (length - belly)
    ends = [0.0, first, first + belly, length]
    at = np.concatenate([np.linspace(ends[i], ends[i + 1], counts[i]) for i in range(3)])
    fixed = np.cumsum([0, *counts])  # where tendons and belly begin and end
    free = np.setdiff1d(np.arange(at.size), np.concatenate([fixed[:-1], fixed[1:] - 1]))
    for bend in s[1:-1]:
        nearest = free[np.abs(at[free] - bend).argmin()]
        if at[nearest - 1] <= bend <= at[nearest + 1]:
            at[nearest] = bend
    return np.column_stack([np.interp(at, s, x) for x in line.T]), belly
