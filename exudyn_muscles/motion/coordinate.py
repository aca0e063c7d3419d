"""What is known of a coordinate beside its motion."""

from __future__ import annotations

from dataclasses import dataclass

from ..numerics.curves import Curve


@dataclass(frozen=True)
class Coordinate:
    """What a file says about a coordinate.

    Attributes
    ----------
    name : str
    default_value, default_speed : float
        [rad or m, /s].
    range : (2,) tuple of float
        Lowest and highest value [rad or m]; nothing keeps to it here.
    clamped : bool
        OpenSim keeps to the range where a user sets a value.
    locked : bool
        Held at its default value: the model has no such coordinate.
    rotates : bool
        It is an angle, not what an axis only depends on or moves by; only angles are in degrees.
    joint : str
        Path of the joint that it belongs to in OpenSim 4, such as `/jointset/elbow`.
    prescribed : Curve or None
        Its values over time [s], if OpenSim moves it by a function whatever the forces are.
    follows_constraints : bool
        Where constraints hold coordinates, OpenSim lets it follow the others.
    """

    name: str
    default_value: float
    default_speed: float
    range: tuple[float, float]
    clamped: bool
    locked: bool
    rotates: bool = True
    joint: str = ""
    prescribed: Curve | None = None
    follows_constraints: bool = False
