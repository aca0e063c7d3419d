"""Muscles as bodies: a belly between tendons, along the path as it was computed.

How thick and how long bellies are is a drawing's convention, as parameters of muscles do not say
it: lengths are those of the fibres, but not less than `SHORTEST` of the path, and two thirds of the
tendon lie beyond them.
"""

from __future__ import annotations

import numpy as np

from .tubes import tube

# Specific tension [N/m^2] that makes cross-sections of strengths: E. M. Arnold et al., "A model of
# the lower limb for analysis of human movement", Ann. Biomed. Eng. 38 (2010) 269-279.
SPECIFIC_TENSION = 0.61e6
SHORTEST, LONGEST = 0.4, 0.9  # parts of the path that a belly takes
BEFORE = 1.0 / 3.0  # of the tendon
RESTING = 0.35  # part of the cross-section that a muscle without force has
SLENDER = 0.16  # largest radius of a belly over its length
TENDON = 0.2  # radius over that of the belly
RINGS = (7, 20, 9)  # of the first tendon, the belly, the second one
ON_TENDON = -1.0  # in place of an activation


def shapes(
    paths: list[list[np.ndarray]], muscle: int, fibers: np.ndarray, forces: np.ndarray, F0: float
) -> np.ndarray:
    """Vertices (k, v, 3) of a muscle at k times.

    Parameters
    ----------
    paths : list of k lists of (points, 3) ndarray
        Of all muscles [m].
    muscle : int
    fibers : (k,) ndarray
        Lengths of its fibres along the tendon [m].
    forces : (k,) ndarray
        [N].
    F0 : float
        Its maximum isometric force [N].
    """
    points, radii = np.empty((len(paths), sum(RINGS), 3)), np.empty((len(paths), sum(RINGS)))
    strength = np.clip(forces / F0, 0.0, 1.5)
    for k, lines in enumerate(paths):
        points[k], length, belly = _rings(lines[muscle], fibers[k])
        widest = min(np.sqrt(F0 / (np.pi * SPECIFIC_TENSION)), SLENDER * belly)
        thickness = np.sqrt(RESTING + (1.0 - RESTING) * strength[k])
        radii[k] = widest * (TENDON + (thickness - TENDON) * _profile())
    return tube(points, radii)


def activations(values: np.ndarray) -> np.ndarray:
    """Of every ring (k, n), from those of a muscle (k,)."""
    found = np.full((len(values), sum(RINGS)), ON_TENDON)
    found[:, RINGS[0] : RINGS[0] + RINGS[1]] = np.clip(values, 0.0, 1.0)[:, None]
    return found


def _profile() -> np.ndarray:
    """How much of a belly every ring has, 0 to 1."""
    x = np.linspace(0.0, 1.0, RINGS[1])
    return np.concatenate([np.zeros(RINGS[0]), np.sin(np.pi * x) ** 0.8, np.zeros(RINGS[2])])


def _rings(line: np.ndarray, fiber: float) -> tuple[np.ndarray, float, float]:
    """Points (n, 3) along a path, its length and that of its belly [m].

    Rings are evenly spaced, but that the nearest one to each point of the path moves there, so
    that its bends are not cut.
    """
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    length = s[-1]
    belly = float(np.clip(fiber / length if length > 0.0 else 1.0, SHORTEST, LONGEST)) * length
    first = BEFORE * (length - belly)
    ends = [0.0, first, first + belly, length]
    at = np.concatenate([np.linspace(ends[i], ends[i + 1], RINGS[i]) for i in range(3)])
    fixed = np.cumsum([0, *RINGS])  # where tendons and belly begin and end
    free = np.setdiff1d(np.arange(at.size), np.concatenate([fixed[:-1], fixed[1:] - 1]))
    for bend in s[1:-1]:
        nearest = free[np.abs(at[free] - bend).argmin()]
        if at[nearest - 1] <= bend <= at[nearest + 1]:
            at[nearest] = bend
    return np.column_stack([np.interp(at, s, x) for x in line.T]), length, belly
