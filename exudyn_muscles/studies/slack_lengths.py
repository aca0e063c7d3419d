"""Tendon slack lengths by what the fibres are to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..motion import Motion, check_motion
from ..muscle.equilibrium import equilibrium
from ..muscle.parameters import RANGES, Muscle, MuscleSet

STEP = 0.01  # s between the poses of a motion that are looked at
BISECTIONS = 60  # to the last bit
WITHIN = 1e-9  # of the optimal fibre length


def choose_tendon_slack_lengths(
    model: MusculoskeletalModel,
    motion: Motion,
    fiber_range: tuple[float, float],
    names: Iterable[str] | None = None,
    *,
    activation: float = 1.0,
) -> list[Muscle]:
    """The model's muscles, with tendons so long that the fibres work within a range.

    The middle between the shortest and the longest fibre of the motion comes to the middle of the
    range. Fibre and tendon balance at rest in every pose, with rigid and with elastic tendons;
    between the poses fibres follow the paths.

    Parameters
    ----------
    model : MusculoskeletalModel
    motion : Motion
    fiber_range : pair of float
        Shortest and longest fibre over the optimal fibre length, such as (0.6, 1.2).
    names : iterable of str, optional
        Muscles that are changed; all if left out.
    activation : float
        At which they balance: full, as in the contractions from which such ranges are measured, or
        1e-2 for fibres at rest.

    Returns
    -------
    list of Muscle
        For `model.replace`.

    Raises
    ------
    MotionError
        The motion is one of other coordinates.
    ParameterError
        A fibre does not stay within the range whatever its tendon, or the path is too short for
        it: names all such muscles and the optimal fibre lengths that would do.

    Examples
    --------
    >>> from models import planar_arm
    >>> model, motion = planar_arm.build(), planar_arm.motion()
    >>> chosen = choose_tendon_slack_lengths(model, motion, (0.4, 1.4))
    >>> model.replace(muscles=chosen).check_lengths(motion([0.0, 0.5])[0])
    """
    try:
        low, high = map(float, fiber_range)
    except (TypeError, ValueError):
        low = high = 0.0
    if not 0.0 < low < high:
        raise ParameterError(f"fiber_range = {fiber_range!r} are not two increasing numbers")
    check_motion(motion, model.coordinates)
    muscles = list(model.muscles)
    there = [muscle.name for muscle in muscles]
    chosen = there if names is None else list(names)
    for name in set(chosen) - set(there):
        raise ParameterError(f"there is no muscle '{name}', only {', '.join(there)}")
    times = np.linspace(motion.start, motion.end, 1 + round((motion.end - motion.start) / STEP))
    lengths = model.lengths_along(motion(times)[0])
    ends = np.array([lengths.min(axis=0), lengths.max(axis=0)])  # (2, m)
    activations = np.maximum(activation, model.muscles.minimum_activation)

    def fibers(slack: np.ndarray) -> np.ndarray:
        """Over the optimal lengths at both ends, (2, m)."""
        units = MuscleSet(_with_slack(muscles, slack))
        found = [equilibrium(units, activations, l).fiber_length for l in ends]
        return np.array(found) / units.optimal_fiber_length

    shortest = RANGES["tendon_slack_length"][0]
    least, most = np.full(len(muscles), shortest), np.maximum(ends[1], shortest)
    for _ in range(BISECTIONS):
        middle = 0.5 * (least + most)
        too_long = fibers(middle).mean(axis=0) > 0.5 * (low + high)
        least, most = np.where(too_long, middle, least), np.where(too_long, most, middle)
    slack = 0.5 * (least + most)
    found = fibers(slack)
    meant = np.isin(there, chosen)
    _check(muscles, meant, found, fiber_range)
    kept = np.where(meant, slack, [muscle.tendon_slack_length for muscle in muscles])
    return _with_slack(muscles, kept)


def _with_slack(muscles: list[Muscle], slack: np.ndarray) -> list[Muscle]:
    return [
        replace(muscle, tendon_slack_length=float(l_ts))
        for muscle, l_ts in zip(muscles, slack, strict=True)
    ]


def _check(
    muscles: list[Muscle], meant: np.ndarray, found: np.ndarray, fiber_range: tuple[float, float]
) -> None:
    low, high = fiber_range
    faults = []
    for muscle, is_meant, (first, last) in zip(muscles, meant, found.T, strict=True):
        if not is_meant or (first >= low - WITHIN and last <= high + WITHIN):
            continue
        text = f"'{muscle.name}' from {first:.3g} to {last:.3g}"
        if last - first > high - low:
            wanted = muscle.optimal_fiber_length * (last - first) / (high - low)
            text += f", with an optimal_fiber_length of at least some {wanted:.3g} m it could"
        else:
            text += ", its path is too short for its fiber"
        faults.append(text)
    if faults:
        raise ParameterError(
            f"fibers that do not stay from {low:g} to {high:g} optimal lengths in this motion, "
            f"whatever their tendons: {'; '.join(faults)}"
        )
