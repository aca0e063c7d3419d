"""Where two trajectories differ by more than their quantities' tolerances allow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..errors import ParameterError
from .quantities import QUANTITIES, Quantity, Scale, When

SAME = (
    "method", "coordinate_names", "coordinate_units", "system_names", "muscle_names",
    "reserve_names", "status",
)  # fmt: skip
# Torques of muscles that hold against each other cancel: then their scale is that of the largest
# tendon force at an arm of this share of the longest muscle.
ARM = 0.01


class Difference(NamedTuple):
    """The first place where two trajectories differ by more than allowed.

    Attributes
    ----------
    quantity : str
    time : float or None
        [s]; None, as what follows, for a difference in names or shapes.
    size, tolerance : float or None
        In the quantity's unit.
    """

    quantity: str
    time: float | None
    size: float | None
    tolerance: float | None

    def __str__(self) -> str:
        if self.time is None:
            return f"{self.quantity} differ"
        return (
            f"{self.quantity} differ by {self.size:.3g} at t = {self.time:.6g} s, "
            f"allowed is {self.tolerance:.3g}"
        )


def first_difference(
    mine: Mapping[str, Any], reference: Mapping[str, Any], tolerances: Mapping[str, float]
) -> Difference | None:
    """`Trajectory.compare`, of the fields of two trajectories."""
    scales = _scales(reference)
    allowed = {one.name: one.tolerance * scales[one.scale] for one in QUANTITIES}
    unknown = set(tolerances) - set(allowed)
    if unknown:
        raise ParameterError(f"tolerances: no such quantities: {sorted(unknown)}")
    allowed |= tolerances
    for name in SAME:
        if mine[name] != reference[name]:
            return Difference(name, None, None, None)
    if _other_kinds(mine["settings"], reference["settings"]):
        return Difference("kinds of settings", None, None, None)
    for quantity in QUANTITIES:
        found = _difference(quantity, mine, reference, allowed[quantity.name])
        if found is not None:
            return found
    return None


def _difference(
    quantity: Quantity, mine: Mapping[str, Any], reference: Mapping[str, Any], tolerance: float
) -> Difference | None:
    x, y = mine[quantity.field], reference[quantity.field]
    if x.shape != y.shape:
        return Difference(quantity.name, None, None, None)
    if quantity.since > 1 and np.isnan(y).all():  # the reference's file did not have it yet
        return None
    gap = np.abs(x - y)
    gap[np.isnan(x) & np.isnan(y)] = 0.0
    rows = gap[None] if quantity.when is When.START else gap
    beyond = ~(rows <= tolerance).all(axis=tuple(range(1, rows.ndim)))
    if not beyond.any():
        return None
    k = int(beyond.argmax())
    clock = reference["time" if quantity.when is When.POINTS else "window_time"]
    late = quantity.when is When.WINDOWS  # a window's time is its end
    return Difference(quantity.name, float(clock[k + late]), float(rows[k].max()), tolerance)


def _scales(fields: Mapping[str, Any]) -> dict[Scale, float]:
    force = _largest(fields["tendon_forces"])
    torques = ("torques_delivered", "torques_demanded", "start_unmet")
    lever = ARM * _largest(fields["musculotendon_lengths"])
    torque = max(force * lever, *(_largest(fields[name]) for name in torques))
    return {Scale.NONE: 1.0, Scale.FORCE: force, Scale.TORQUE: torque}


def _largest(values: np.ndarray) -> float:
    return float(np.fmax.reduce(np.abs(values), axis=None, initial=0.0))


def _other_kinds(settings: Mapping[str, Any], reference: Mapping[str, Any]) -> bool:
    """Whether settings are those of something else: no name is common, or a common one has a number
    here and a truth value, text, list or mapping there. None stands for what is usual.

    Single names may have changed between versions.
    """
    common = set(settings) & set(reference)
    pairs = [(settings[name], reference[name]) for name in common]
    kinds = [tuple(float if type(x) is int else type(x) for x in pair) for pair in pairs]
    differ = any(a is not b and type(None) not in (a, b) for a, b in kinds)
    return differ or not (common or settings == reference)
