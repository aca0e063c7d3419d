"""Sensors of Exudyn that show muscles, and what joints bear."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import SensorUserFunction

from ..errors import ParameterError
from ..joints import check_frame, model_joints
from ..muscle.dynamics import fiber_lengths
from ..skeleton.assembly import assembled_anew
from ..skeleton.hold import hold
from ..skeleton.joints import JointFrame
from .plugin import Plugin

LOAD = 6  # components of force and torque


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

    return _added(mbs, quantity if muscle is None else f"{quantity} of {muscle}", values)


def joint_load_sensor(
    plugin: Plugin,
    joint: str,
    *,
    expressed_in: JointFrame = JointFrame.GROUND,
    on_parent: bool = False,
) -> exu.SensorIndex:
    """Add a sensor to the `mbs` that stores what a joint bears as a run goes on.

    It has six components, force [N] and torque [N m] about the joint's center, as
    `analysis.joint_loads` has them from a result, and is called `load of <joint>`. NaN before a
    run. Of a tree, loads that user functions change in a run are as they were when it was added.

    Parameters
    ----------
    plugin : Plugin
        Whose runs it shows.
    joint, expressed_in, on_parent
        As of `analysis.joint_loads`.

    Returns
    -------
    SensorIndex

    Raises
    ------
    ParameterError
        There is no such joint or frame.
    ModelError
        A run is attached to the `mbs`, or as `analysis.joint_loads`.
    """
    check_frame(expressed_in)
    model, mbs = plugin.model, plugin.model.mbs
    joints = model_joints(model, [joint])

    def values(*_: Any) -> list[float]:
        record, skeleton = plugin.state.record, model.skeleton
        if record.reached is None:
            return [np.nan] * LOAD
        loads = joints.now(
            skeleton.q, skeleton.v, mbs.systemData.GetTime(), plugin.tendon_forces, record.reserve
        )
        return loads.written(expressed_in, on_parent)[0, :LOAD].tolist()

    return _added(mbs, f"load of {joint}", values)


def _added(mbs: exu.MainSystem, name: str, values: Callable[..., list[float]]) -> exu.SensorIndex:
    """A sensor with a user function, in an `mbs` that is assembled anew."""
    with hold(mbs), assembled_anew(mbs):
        return mbs.AddSensor(
            SensorUserFunction(
                name=name, sensorUserFunction=values, storeInternal=True, writeToFile=False
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
