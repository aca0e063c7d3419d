"""What a motion is warned of: angles that cannot be radians, locked coordinates that move."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from ..errors import MotionError, MotionWarning, StorageError, warn
from ..files.storage import Storage
from .coordinate import Coordinate

# Recorded angles begin within two turns of zero, swing by less to and fro, and what turns farther,
# a crank or a wheel, is slower than six turns a second. Degrees taken for radians are 57 times as
# large and fast.
TURNS = 4.0 * math.pi
FAST = 40.0  # rad/s
# The least that an angle has to be beyond its range to be told from a careless one [rad].
BEYOND = 1.0
# A locked coordinate's column is where the model holds it, but for this [rad or m].
MOVES = 1e-3


def check_unit(
    storage: Storage,
    samples: np.ndarray,
    names: Sequence[str],
    units: Sequence[str],
    described: Iterable[Coordinate],
    source: str,
) -> None:
    """Warn of a file's angles that cannot be radians.

    Parameters
    ----------
    storage : Storage
    samples : (k, n) ndarray
        Of the coordinates `names` in their `units` [rad or m].
    described : iterable of Coordinate
        What a model's file says of its coordinates.
    source : str
        The storage's file.

    Raises
    ------
    MotionError
        A coordinate turns several times farther than its range: these are degrees.

    Warns
    -----
    MotionWarning
        Names the coordinate, its values and its range.
    """
    if storage.in_degrees:
        return
    ranges = {each.name: each.range for each in described}
    for name, unit, x in zip(names, units, samples.T, strict=True):
        low, high = ranges.get(name, (-math.inf, math.inf))
        if unit == "rad" and high - low < TURNS < max(x.max() - high, low - x.min()):
            raise MotionError(
                f"{source}: coordinate '{name}' runs from {x.min():.4g} to {x.max():.4g}, its "
                f"range is [{low:.4g}, {high:.4g}] rad: are these degrees? The file does not say "
                "so. in_degrees=True takes them for degrees (--angles degrees on the command "
                "line), in_degrees=False for radians"
            )
    for text in doubtful_angles(storage.time, samples, names, units, ranges):
        warn(f"{source}: {text} A file of degrees says inDegrees=yes", MotionWarning)


def warn_of_locked(storage: Storage, described: Iterable[Coordinate], source: str) -> None:
    """Warn of locked coordinates that move in a file.

    Warns
    -----
    MotionWarning
        Names the coordinate, its values and its range.
    """
    for each in described:
        unit = "rad" if each.rotates else "m"
        try:
            x = storage.coordinates([each.name], [unit]) if each.locked else np.empty(0)
        except StorageError:  # it has no column
            continue
        if np.abs(x - each.default_value).max(initial=0.0) > MOVES:
            low, high = each.range
            warn(
                f"{source}: coordinate '{each.name}' runs from {x.min():.4g} to {x.max():.4g} "
                f"{unit}, but the model holds it at {each.default_value:.4g} {unit}: it is locked; "
                f"its range is [{low:.4g}, {high:.4g}] {unit}",
                MotionWarning,
            )


def doubtful_angles(
    t: np.ndarray,
    q: np.ndarray,
    names: Sequence[str],
    units: Sequence[str],
    ranges: dict[str, tuple[float, float]],
) -> list[str]:
    """A text for every angle that cannot be in radians."""
    texts = []
    for name, unit, x in zip(names, units, q.T, strict=True):
        if unit == "rad" and np.isfinite(x).all():
            why = _why(t, x, ranges.get(name))
            if why:
                texts.append(
                    f"coordinate '{name}' runs from {x.min():.4g} to {x.max():.4g} rad{why}: are "
                    "these degrees?"
                )
    return texts


def _why(t: np.ndarray, x: np.ndarray, limits: tuple[float, float] | None) -> str:
    """Why an angle cannot be in radians; empty if it can."""
    low, high = limits or (-math.inf, math.inf)
    if high - low < TURNS:
        beyond = max(low - x.min(), x.max() - high)
        if beyond > max(high - low, BEYOND):
            return f", far beyond its range of [{low:.4g}, {high:.4g}] rad"
        return ""
    if abs(x[0]) > TURNS:
        return f" and begins {abs(x[0]) / (2.0 * math.pi):.3g} turns from zero"
    rise, fall = (np.max(y - np.minimum.accumulate(y)) for y in (x, -x))
    if min(rise, fall) > TURNS:
        return f", {min(rise, fall) / (2.0 * math.pi):.3g} turns to and fro"
    speed = np.abs(np.diff(x) / np.diff(t)).max(initial=0.0)
    if np.ptp(x) > TURNS and speed > FAST:
        return f" at up to {speed / (2.0 * math.pi):.3g} turns a second"
    return ""
