"""Sensors of Exudyn that show muscles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import SensorUserFunction

from ..errors import ParameterError
from ..muscle.dynamics import fiber_lengths
from ..skeleton.assembly import assembled_anew
from ..skeleton.hold import hold
from .plugin import Plugin


def muscle_sensor(plugin: Plugin, quantity: str, muscle: str | None = None) -> exu.SensorIndex:
    """Add a sensor to the `mbs` that stores a quantity of muscles as a run goes on.

    It is one for `mbs.GetSensorStoredData` and `mbs.PlotSensor`, with a component for each muscle,
    and is called after its quantity and muscle. The `mbs` is assembled anew, its state stays. Its
    values are those of the last accepted step; NaN before a run, and at a run's start for
    excitations, which belong to the steps.

    Parameters
    ----------
    plugin : Plugin
        Whose runs it shows.
    quantity : str
        "activations", "excitations", "tendon_forces" [N], "musculotendon_lengths" [m],
        "lengthening_speeds" [m/s] or "fiber_lengths" [m].
    muscle : str, optional
        All muscles, in the model's order, if left out.

    Returns
    -------
    SensorIndex

    Raises
    ------
    ParameterError
        There is no such quantity or muscle.
    ModelError
        A run is attached to the `mbs`.
    """
    names, mbs = plugin.model.muscles.names, plugin.model.mbs
    if quantity not in QUANTITIES:
        raise ParameterError(f"sensor of '{quantity}': the quantities are {', '.join(QUANTITIES)}")
    if muscle is not None and muscle not in names:
        raise ParameterError(f"sensor of '{muscle}': the muscles are {', '.join(names)}")
    shown = slice(None) if muscle is None else slice(names.index(muscle), names.index(muscle) + 1)

    def values(*_: Any) -> list[float]:
        if plugin.state.record.reached is None:
            return [np.nan] * len(names[shown])
        return QUANTITIES[quantity](plugin)[shown].tolist()

    with hold(mbs), assembled_anew(mbs):
        return mbs.AddSensor(
            SensorUserFunction(
                name=quantity if muscle is None else f"{quantity} of {muscle}",
                sensorUserFunction=values,
                storeInternal=True,
                writeToFile=False,
            )
        )


def _excitations(plugin: Plugin) -> np.ndarray:
    found = plugin.state.record.excitation
    return np.full(len(plugin.model.muscles), np.nan) if found is None else found


def _fiber_lengths(plugin: Plugin) -> np.ndarray:
    state, l_m = plugin.state, np.empty(len(plugin.model.muscles))
    fiber_lengths(plugin.model.muscles.tables, state.l_t, state.geometry.length, l_m)
    return l_m


# Of (m,) each, at the committed state of a run that has begun.
QUANTITIES: dict[str, Callable[[Plugin], np.ndarray]] = {
    "activations": lambda plugin: plugin.state.a,
    "excitations": _excitations,
    "tendon_forces": lambda plugin: plugin.tendon_forces,
    "musculotendon_lengths": lambda plugin: plugin.state.geometry.length,
    "lengthening_speeds": lambda plugin: plugin.state.geometry.lengthening_speed,
    "fiber_lengths": _fiber_lengths,
}
