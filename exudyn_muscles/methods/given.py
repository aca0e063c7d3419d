"""Excitations that are given: windows from a result or a file, or a function that is asked for them
as the run goes on."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..checks import number_within
from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..muscle.arguments import check_range
from ..muscle.dynamics import fiber_lengths
from ..muscle.equilibrium import equilibrium
from ..results.excitations import Excitations
from ..simulation.state import HANDED_ON, RunState
from ..skeleton.geometry import Geometry
from .excitation_function import ExcitationFunction, SensedState


class GivenWindow(NamedTuple):
    """A window that begins: excitations (m,), and its end [s] with the reserves (r,) there."""

    excitation: np.ndarray
    end: float
    reserve: np.ndarray


class Given(ABC):
    """Where a forward run has its excitations from.

    Attributes
    ----------
    start, end : float
        Times that can be simulated [s].
    initial : tuple of ndarray or None
        q (n,), q' (n,), a (m,) and l_t (m,) at the start, if they are given.
    """

    start: float
    end: float
    initial: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None = None

    @property
    @abstractmethod
    def first_reserve(self) -> np.ndarray:
        """Reserves (r,) at the start."""

    @abstractmethod
    def first_activations(self) -> np.ndarray:
        """Activations (m,) of the steady state at the start, where no initial state is given."""

    @abstractmethod
    def window(self, state: ForwardRun, t_0: float, t_1: float) -> GivenWindow | None:
        """The window that begins with a step from `t_0` to `t_1`; None: the one before goes on."""


@dataclass(eq=False, kw_only=True)
class ForwardRun(RunState):
    """What a forward run remembers of its excitations.

    Attributes
    ----------
    window : int
        Number of the one that goes on.
    decided : float
        Start of the step [s] that a function of the state was last asked for.
    held : (m,) ndarray
        Excitations of the window that goes on.
    """

    window: int = field(default=-1, metadata=HANDED_ON)
    decided: float = field(default=math.nan, metadata=HANDED_ON)
    held: np.ndarray = field(init=False, metadata=HANDED_ON)


class Windows(Given):
    """Windows of `Excitations`, checked against the model."""

    def __init__(self, model: MusculoskeletalModel, excitations: Excitations) -> None:
        time, values = excitations.time, excitations.values
        names = model.muscles.names
        if values.shape[1] != len(names):
            raise ParameterError(
                f"excitations of {values.shape[1]} muscles for a model with {len(names)}: values "
                f"have the shape {values.shape}, expected ({len(values)}, {len(names)}) with the "
                f"columns {', '.join(names)}"
            )
        if excitations.reserves.shape[1] != len(model.reserves):
            raise ParameterError(
                f"excitations with {excitations.reserves.shape[1]} reserves for a model with "
                f"{len(model.reserves)}"
            )
        for k in np.flatnonzero(~((values >= 0.0) & (values <= 1.0)).all(axis=1))[:1]:
            _check_excitations(names, values[k], time[k])
        self.initial = excitations.initial
        if self.initial is not None:
            _check_initial(model, *self.initial)
        self.start, self.end = float(time[0]), float(time[-1])
        self._given = excitations
        self._u = np.maximum(values, model.muscles.minimum_activation)

    @property
    def first_reserve(self) -> np.ndarray:
        return self._given.reserves[0]

    def first_activations(self) -> np.ndarray:
        return self._u[0]

    def window(self, state: ForwardRun, t_0: float, t_1: float) -> GivenWindow | None:
        k = self._given.window(0.5 * (t_0 + t_1))
        if k == state.window:
            return None
        state.window = k
        return GivenWindow(self._u[k], self._given.time[k + 1], self._given.reserves[k + 1])


class Asked(Given):
    """What an `ExcitationFunction` gives; ideal actuators do nothing."""

    def __init__(self, model: MusculoskeletalModel, given: ExcitationFunction) -> None:
        self.start, self.end = float(given.start), float(given.end)
        self._model, self._given = model, given
        self._lowest = model.muscles.minimum_activation
        self._none = np.zeros(len(model.reserves))

    @property
    def first_reserve(self) -> np.ndarray:
        return self._none

    def first_activations(self) -> np.ndarray:
        given = self._given.activations
        if given is not None:
            return activations_of(self._model, given)
        return self._lowest.copy() if self._given.senses else self._at(self.start)

    def window(self, state: ForwardRun, t_0: float, t_1: float) -> GivenWindow | None:
        if not self._given.senses:
            u = self._at(0.5 * (t_0 + t_1))
        elif state.decided == t_0:  # the step before was rejected
            return None
        else:
            u = self._at(t_0, self._sensed(state))
            state.decided = t_0
        if state.window >= 0 and np.array_equal(u, state.held):
            return None
        state.window += 1
        return GivenWindow(u, t_1, self._none)

    def _at(self, t: float, *state: SensedState) -> np.ndarray:
        return self._allowed(f"excitations at t = {t:g} s", self._given.function(t, *state), t)

    def _allowed(self, what: str, given: ArrayLike | Mapping[str, float], t: float) -> np.ndarray:
        names = self._model.muscles.names
        u = _one_each(what, names, given)
        _check_excitations(names, u, t)
        return np.maximum(u, self._lowest)

    def _sensed(self, state: ForwardRun) -> SensedState:
        model, geometry, a, l_t = self._model, state.geometry, state.a, state.l_t
        q, v, _ = model.skeleton.start
        fiber = np.empty(a.size)
        fiber_lengths(model.muscles.tables, l_t, geometry.length, fiber)
        F = model.tendon_forces(geometry, a, l_t)
        return SensedState(q, v, a, F, geometry.length, geometry.lengthening_speed, fiber)


def given_for(model: MusculoskeletalModel, excitations: Excitations | ExcitationFunction) -> Given:
    """What a user gives, checked against the model.

    Raises
    ------
    ParameterError
    """
    if isinstance(excitations, ExcitationFunction):
        return Asked(model, excitations)
    if isinstance(excitations, Excitations):
        return Windows(model, excitations)
    instead = "Excitations.from_mapping(time, mapping, muscles)"
    if callable(excitations):
        instead = "ExcitationFunction(function, end=...)"
    elif not isinstance(excitations, Mapping):
        instead = "Excitations(time, values)"
    raise ParameterError(
        "expected Excitations, such as a result's .excitations, or an ExcitationFunction, got "
        f"{type(excitations).__name__}; give it as {instead}"
    )


def activations_of(
    model: MusculoskeletalModel, given: float | ArrayLike | Mapping[str, float]
) -> np.ndarray:
    """Activations (m,) of a number for all muscles, or of one for each.

    Raises
    ------
    ParameterError
        They do not fit the muscles, or are outside [0, 1].
    """
    names = model.muscles.names
    if isinstance(given, (int, float)):
        given = np.full(len(names), float(given))
    a = _one_each("activations", names, given)
    for name, value in zip(names, a, strict=True):
        number_within(f"muscle '{name}': activation", value, 0.0, 1.0)
    return np.maximum(a, model.muscles.minimum_activation)


def start_state(
    model: MusculoskeletalModel, given: Given, geometry: Geometry
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """a, l_t (m,) and reserves (r,) with which a run begins."""
    if given.initial is None:
        a = given.first_activations()
        return a, equilibrium(model.muscles, a, geometry.length).tendon_length, given.first_reserve
    a, l_t = (np.array(x, dtype=float) for x in given.initial[2:])
    return a, model.muscles.with_rigid(l_t), given.first_reserve


def _one_each(
    what: str, names: tuple[str, ...], given: ArrayLike | Mapping[str, float]
) -> np.ndarray:
    """Values (m,), one a muscle, of an array or a mapping; `what` they are is for the message."""
    if isinstance(given, Mapping):
        if set(given) != set(names):
            raise ParameterError(
                f"{what}: the names are {', '.join(map(str, given))}, expected {', '.join(names)}"
            )
        given = [given[name] for name in names]
    try:
        u = np.array(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{what}: {given!r} are no numbers") from error
    if u.shape != (len(names),):
        raise ParameterError(
            f"{what}: the shape is {u.shape}, expected ({len(names)},), one value for each of "
            f"{', '.join(names)}"
        )
    return u


def _check_excitations(names: tuple[str, ...], u: np.ndarray, t: float) -> None:
    """Raise ParameterError unless all u (m,) are within [0, 1]."""
    for i in np.flatnonzero(~((u >= 0.0) & (u <= 1.0))):
        raise ParameterError(
            f"muscle '{names[i]}': excitation {u[i]:g} at t = {t:g} s is outside [0, 1]"
        )


def _check_initial(
    model: MusculoskeletalModel, q: np.ndarray, v: np.ndarray, a: np.ndarray, l_t: np.ndarray
) -> None:
    """Raise ParameterError unless a start fits the model and lies in the muscles' range."""
    n, m = len(model.coordinates), len(model.muscles)
    for name, values, size in (("q", q, n), ("q'", v, n), ("a", a, m), ("l_t", l_t, m)):
        array = np.asarray(values, dtype=float)
        if array.shape != (size,) or not np.isfinite(array).all():
            raise ParameterError(
                f"excitations: initial {name} must be {size} finite values, got {values!r}"
            )
    check_range("initial activation", np.asarray(a, dtype=float), model.muscles)
    for muscle, length in zip(model.muscles, l_t, strict=True):
        name, longest = f"muscle '{muscle.name}': initial l_t", 2.0 * muscle.tendon_slack_length
        number_within(name, length, 0.0, longest, "m")
