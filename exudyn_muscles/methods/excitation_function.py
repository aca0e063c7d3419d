"""Excitations as a function of time, or of time and state: reflexes, controllers, policies."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import number_within
from ..errors import ParameterError


@dataclass(frozen=True, eq=False)
class SensedState:
    """The state at the start of a step, as a function of excitations may sense it.

    Attributes
    ----------
    coordinates, speeds : (n,) ndarray
        q and q' [rad or m, per s].
    activations : (m,) ndarray
    tendon_forces : (m,) ndarray
        F [N].
    musculotendon_lengths, lengthening_speeds : (m,) ndarray
        l [m] and l' [m/s].
    fiber_lengths : (m,) ndarray
        l_m [m].
    """

    coordinates: np.ndarray
    speeds: np.ndarray
    activations: np.ndarray
    tendon_forces: np.ndarray
    musculotendon_lengths: np.ndarray
    lengthening_speeds: np.ndarray
    fiber_lengths: np.ndarray

    def __post_init__(self) -> None:
        for name, values in vars(self).items():
            own = np.array(values, dtype=float)
            own.setflags(write=False)
            object.__setattr__(self, name, own)


@dataclass(frozen=True, eq=False)
class ExcitationFunction:
    """Excitations that a function gives as the run goes on.

    They are held over each step and are in the result: `result.excitations` replays them.

    Parameters
    ----------
    function : callable
        u(t), asked for the middle of every step that is tried, or u(t, state) with a `SensedState`,
        asked once at the start `t` of every step, from what was accepted there: never within
        iterations, and not again where the step is rejected, so that it may keep a memory. It
        returns m excitations in the order of the muscles, or a mapping with one for each name,
        all within [0, 1]; below the minimum activations they count as these.
    end, start : float
        Times that can be simulated [s].
    activations : float, (m,) array_like or mapping of str to float, optional
        Those that the muscles start with, in their steady state. Left out, they are the excitations
        at the start of a function of time, and of one of the state the minimum activations.

    Raises
    ------
    ParameterError
        The function is none of t, or of t and the state, or the times are not increasing.
    """

    function: Callable[..., ArrayLike | Mapping[str, float]]
    end: float
    start: float = 0.0
    activations: float | ArrayLike | Mapping[str, float] | None = None
    senses: bool = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "senses", _takes_state(self.function))
        start = number_within("start", self.start, -math.inf, math.inf, "s")
        end = number_within("end", self.end, -math.inf, math.inf, "s")
        if not end > start:
            raise ParameterError(f"excitations: end = {end:g} s is not after start = {start:g} s")


def _takes_state(function: Any) -> bool:
    """Whether it is a function of time and state; a function of time can be called without."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError) as error:
        raise ParameterError(
            f"excitations: expected a function of t, or of t and the state, got {function!r}"
        ) from error
    for number in (1, 2):
        try:
            signature.bind(*range(number))
        except TypeError:
            continue
        return number == 2
    raise ParameterError(
        f"excitations: the function takes {signature}, expected (t), or (t, state)"
    )
