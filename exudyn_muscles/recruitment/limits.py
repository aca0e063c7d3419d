"""Limits of controls over time: excitations of muscles, and controls of ideal actuators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError
from ..forces.actuators import Actuator, actuator_names
from ..muscle.parameters import MuscleSet
from ..numerics.kernel import kernel

Course = float | tuple[ArrayLike, ArrayLike]

# Times of nodes and of windows are rounded: a window that ends at a node ends there.
SAME_TIME = 1e-9


@dataclass(frozen=True)
class ControlLimits:
    """Limits of one actuator's control, constant or over time.

    Those at a window's end hold for the whole window. Before the first and after the last time the
    limits stay as they are there.

    Parameters
    ----------
    minimum, maximum : float or pair of (k,) sequence of float
        A number, or times [s] and values at them.
    steps : bool
        Values do not run linearly from time to time: each holds from the time before it up to its
        own, as of OpenSim's controls with `use_steps`.

    Raises
    ------
    ParameterError
        Times that do not increase, values that are no numbers, or a minimum above the maximum.
    """

    minimum: Course
    maximum: Course
    steps: bool = False
    _nodes: tuple[tuple[np.ndarray, np.ndarray], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.steps, bool):
            raise ParameterError(f"control limits: steps is True or False, got {self.steps!r}")
        nodes = (
            course_nodes("control limits: minimum", self.minimum),
            course_nodes("control limits: maximum", self.maximum),
        )
        object.__setattr__(self, "_nodes", nodes)
        for name, (t, x) in zip(("minimum", "maximum"), nodes, strict=True):
            course = getattr(self, name)
            kept = (tuple(t), tuple(x)) if isinstance(course, tuple) else float(x[0])
            object.__setattr__(self, name, kept)
        if np.inf in nodes[0][1] or -np.inf in nodes[1][1]:
            raise ParameterError("control limits: no control is above inf or below -inf")
        for t in self.times:
            low, high = self.at(t)
            if low > high:
                raise ParameterError(
                    f"control limits: minimum {low:g} is above maximum {high:g} at t = {t:g} s"
                )

    @property
    def times(self) -> np.ndarray:
        """All times of either limit [s]; one if both are constant."""
        return np.unique(np.concatenate([each[0] for each in self._nodes]))

    def at(self, t: float) -> tuple[float, float]:
        """Minimum and maximum at a time.

        Parameters
        ----------
        t : float
            [s]

        Returns
        -------
        pair of float
        """
        low, high = (course_at(t, *each, self.steps) for each in self._nodes)
        return low, high


@kernel
def course_at(t, times, values, steps):
    """The value at the time `t` of a course, as `ControlLimits` has it and NumPy interpolates."""
    last = times.size - 1
    if steps:
        return values[min(np.searchsorted(times, t - SAME_TIME), last)]
    if t <= times[0]:
        return values[0]
    if t >= times[last]:
        return values[last]
    k = np.searchsorted(times, t, "right") - 1
    if times[k] == t or values[k] == values[k + 1]:
        return values[k]
    slope = (values[k + 1] - values[k]) / (times[k + 1] - times[k])
    value = slope * (t - times[k]) + values[k]
    if np.isnan(value):  # no limit at the time before
        value = slope * (t - times[k + 1]) + values[k + 1]
    return value


@kernel
def courses_at(t, rows, starts, times, values, steps, table):
    """Write minimum and maximum at the time `t` into these rows of a table (a, 2); course 2 k of
    row k and the one behind it have the nodes from `starts` on."""
    for k in range(rows.size):
        for side in range(2):
            nodes = slice(starts[2 * k + side], starts[2 * k + side + 1])
            table[rows[k], side] = course_at(t, times[nodes], values[nodes], steps[k])


class Limits:
    """The limits of all actuators of a model at any time.

    Actuators that are not named have the limits that they were made with.

    Parameters
    ----------
    limits : mapping of str to ControlLimits
        By the names of muscles and ideal actuators.
    muscles : MuscleSet
    actuators : sequence of Actuator

    Raises
    ------
    ParameterError
        There is no actuator of a name, or a muscle's limits are outside [0, 1] or leave it no
        activation.
    """

    def __init__(
        self,
        limits: Mapping[str, ControlLimits],
        muscles: MuscleSet,
        actuators: Sequence[Actuator],
    ) -> None:
        names = [*muscles.names, *actuator_names(actuators)]
        self._optimal = np.array([actuator.optimal_force for actuator in actuators])
        controls = [(actuator.min_control, actuator.max_control) for actuator in actuators]
        excitations = [(muscle.min_control, muscle.max_control) for muscle in muscles]
        self._usual = np.array([*excitations, *controls])
        rows, courses = [], []
        for name, given in limits.items():
            if name not in names:
                raise ParameterError(
                    f"control limits of '{name}': the actuators are {', '.join(names)}"
                )
            i = names.index(name)
            if i < len(muscles):
                _check_muscle(name, given, float(muscles.minimum_activation[i]))
            rows.append(i)
            courses.append(given)
        self._lowest, self._muscles = muscles.minimum_activation, len(muscles)
        self._constant = self._split(self._usual)
        self._courses = _packed(rows, courses) if rows else None

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Excitations (2, m) and ideal actuators' forces (2, r) [N or N m], lowest and highest."""
        if self._courses is None:
            return self._constant
        table = self._usual.copy()
        courses_at(t, *self._courses, table)
        return self._split(table)

    def _split(self, table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u, forces = table[: self._muscles].T.copy(), table[self._muscles :].T * self._optimal
        np.maximum(u[0], self._lowest, out=u[0])
        return u, forces


def _packed(rows: Sequence[int], courses: Sequence[ControlLimits]) -> tuple[np.ndarray, ...]:
    """What `courses_at` takes after the time."""
    nodes = [each for course in courses for each in course._nodes]
    times, values = (np.concatenate(part) for part in zip(*nodes, strict=True))
    starts = np.cumsum([0, *(len(each[0]) for each in nodes)])
    return np.array(rows), starts, times, values, np.array([course.steps for course in courses])


def course_nodes(what: str, course: object) -> tuple[np.ndarray, np.ndarray]:
    """A course as times and values; `what` is it called in errors."""
    try:
        times, values = course if isinstance(course, tuple) else ((0.0,), (course,))
        t, x = np.array(times, dtype=float), np.array(values, dtype=float)
    except (TypeError, ValueError):
        t = x = np.array(np.nan)
    if (
        t.ndim != 1
        or t.shape != x.shape
        or not (t.size and np.isfinite(t).all() and (np.diff(t) > 0.0).all())
        or np.isnan(x).any()
    ):
        raise ParameterError(
            f"{what} is a number, or increasing times and as many values, got {course!r}"
        )
    return t, x


def _check_muscle(name: str, limits: ControlLimits, lowest: float) -> None:
    for t in limits.times:
        low, high = limits.at(t)
        if not 0.0 <= low <= high <= 1.0:
            raise ParameterError(
                f"muscle '{name}': control limits [{low:g}, {high:g}] at t = {t:g} s are outside "
                "[0, 1]"
            )
        if high < lowest:
            raise ParameterError(
                f"muscle '{name}': a maximum control of {high:g} at t = {t:g} s is below its "
                f"minimum activation of {lowest:g}"
            )
