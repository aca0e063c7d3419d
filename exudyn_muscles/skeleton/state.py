"""Views of a system's state."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import exudyn as exu
import numpy as np

COORDINATES = ("ODE2Coords", "ODE2Coords_t", "ODE2Coords_tt")


def hermite(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights (k, 4) of q_0, h q_0', q_1, h q_1' in q and h q' of a cubic, at parts (k,) of h."""
    value = [(1.0 + 2.0 * s) * (1.0 - s) ** 2, s * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s)]
    slope = [6.0 * s * (s - 1.0), (1.0 - s) * (1.0 - 3.0 * s), 6.0 * s * (1.0 - s)]
    return (
        np.column_stack([*value, s * s * (s - 1.0)]),
        np.column_stack([*slope, s * (3.0 * s - 2.0)]),
    )


class State:
    """Views of Exudyn's arrays, which dangle once the system has grown.

    Attributes
    ----------
    current, at_start : tuple of three ndarray
        The whole system's coordinates, speeds and accelerations, and those at the step's start.
    q, v, a : (N,) ndarray
        The tree's part of the current ones.
    start : tuple of three (N,) ndarray
        Its part of those at the start of the step.
    data : (k,) ndarray
        The system's data coordinates, as of contacts.
    """

    def __init__(self, mbs: exu.MainSystem, rows: slice) -> None:
        self._data = mbs.systemData
        self.current, self.at_start = (
            tuple(
                self._data.GetSystemStateDict(configuration=kind, reference=True)[name]
                for name in COORDINATES
            )
            for kind in (exu.ConfigurationType.Current, exu.ConfigurationType.StartOfStep)
        )
        self.q, self.v, self.a = (array[rows] for array in self.current)
        self.start = tuple(array[rows] for array in self.at_start)
        self.data = self._data.GetSystemStateDict(reference=True)["dataCoords"]
        self._whole = (*self.current, self.data) if self.data.size else self.current

    def snapshot(self) -> tuple[list[np.ndarray], float]:
        """The system's current coordinates, speeds, accelerations, data and time."""
        return [array.copy() for array in self._whole], self._data.GetTime()

    def restore(self, snapshot: tuple[list[np.ndarray], float]) -> None:
        """Put a snapshot back."""
        arrays, time = snapshot
        for array, values in zip(self._whole, arrays, strict=True):
            array[:] = values
        self._data.SetTime(time)

    def go_on_until(self, t: float) -> None:
        """Put all bodies where their state at the start of the step leads with constant
        acceleration, which is of second order."""
        h = t - self._data.GetTime(exu.ConfigurationType.StartOfStep)
        q_0, v_0, a_0 = self.at_start
        self.current[0][:] = q_0 + h * v_0 + 0.5 * h * h * a_0
        self.current[1][:] = v_0 + h * a_0

    def go_back_to(self, t: float) -> None:
        """Put all bodies where the cubic through the start of the step and the current state has
        them at a time within the step."""
        t_0 = self._data.GetTime(exu.ConfigurationType.StartOfStep)
        h = self._data.GetTime() - t_0
        value, slope = hermite(np.array([(t - t_0) / h]))
        (q_0, v_0, _), (q_1, v_1, _) = self.at_start, self.current
        ends = np.array([q_0, h * v_0, q_1, h * v_1])
        q_1[:], v_1[:] = value[0] @ ends, slope[0] @ ends / h

    @contextmanager
    def within(self, t: float) -> Iterator[None]:
        """Be there at this time."""
        before = self.snapshot()
        try:
            self.go_back_to(t)
            self._data.SetTime(t)
            yield
        finally:
            self.restore(before)
