"""A run goes on: from where the one before ended, or from a point that was saved.

What a step takes from those before it is owned by four, and none holds what is another one's:
Exudyn's system has its arrays and time, the skeleton the load that it applies and the turns of
angles, the method's `RunState` what its steps hand on, and the `Recorder` what was accepted. A
`RunEnd` has what the first two are where a run has reached its end, a `RunPoint` all of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import exudyn as exu
import numpy as np

from ..errors import ModelError, SimulationError
from ..model import MusculoskeletalModel
from ..results.counts import Counts
from ..results.recorder import Recorded
from .solver import SAME_TIME, set_time_of_solver
from .state import RunEnd, RunState

# Arrays that a run has to begin with as the one before has ended, and what they are.
COMPARED = {"ODE2Coords": "coordinate", "ODE2Coords_t": "speed", "ODE1Coords": "ODE1 coordinate"}


class Names(NamedTuple):
    """What has to be the same of two models for a run of one to go on with the other."""

    coordinates: tuple[str, ...]
    muscles: tuple[str, ...]
    reserves: int
    array_sizes: tuple[int, ...]

    @staticmethod
    def of(model: MusculoskeletalModel) -> Names:
        """Names of the model's coordinates and muscles, number of its ideal actuators, and sizes of
        the system's arrays."""
        arrays = model.mbs.systemData.GetSystemStateDict(reference=True)
        sizes = tuple(array.size for array in arrays.values())
        return Names(model.coordinates, model.muscles.names, len(model.reserves), sizes)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class RunPoint:
    """Where a run had reached its end, with all that it takes to go on from there.

    `Plugin.save` makes it and `Plugin.restore` takes it, as often as wanted. Nothing in it changes.

    Attributes
    ----------
    time : float
        [s].
    method : str
    names : Names
        Of what it is about.
    ended : RunEnd
    handed_on : mapping
        What the method's steps hand on, by the names in its state.
    counts : Counts
    recorded : Recorded
    """

    method: str
    names: Names
    ended: RunEnd
    handed_on: Mapping[str, Any]
    counts: Counts
    recorded: Recorded

    @property
    def time(self) -> float:
        """Time of the point [s]."""
        return self.ended.time


def end_of_run(model: MusculoskeletalModel, t: float) -> RunEnd:
    """Where a run is that has reached its end at the time `t`."""
    ended = RunEnd(t, model.mbs.systemData.GetSystemStateDict(), model.skeleton.memory)
    for array in (*ended.system.values(), *ended.memory):
        array.setflags(write=False)
    return ended


def go_on(model: MusculoskeletalModel, state: RunState, t: float) -> None:
    """A run begins at the time `t` where the one before has ended: q'' is as it was there, which
    Exudyn finds anew, and so is all else.

    Raises
    ------
    ModelError
        It begins elsewhere, or the run before did not reach its end.
    """
    ended = state.ended
    if ended is None:
        raise ModelError(
            f"the run before stopped at t = {state.record.reached:g} s before its end, where no "
            "run can go on: restore() a point saved before, or attach the plugin anew"
        )
    if abs(t - ended.time) > SAME_TIME:
        raise ModelError(
            "within one attached() a run goes on from where the one before ended, at t = "
            f"{ended.time:g} s, and this one begins at t = {t:g} s: set startTime, restore() a "
            "point saved there, or attach the plugin anew"
        )
    now = model.mbs.systemData.GetSystemStateDict(reference=True)
    for name, what in COMPARED.items():
        changed = np.flatnonzero(now[name] != ended.system[name])
        if changed.size:
            k, names = changed[0], model.skeleton.system_names
            which = f" {names[k]}" if names and name != "ODE1Coords" else f" {k}"
            raise ModelError(
                "within one attached() a run goes on from where the one before ended: the mbs' "
                f"{what}{which} was {ended.system[name][k]:.17g} there and is {now[name][k]:.17g} "
                "now; call mbs.SolveDynamic with updateInitialValues=True, or attach the plugin "
                "anew for a run from elsewhere"
            )
    _put(model.mbs, ended)


def _put(mbs: exu.MainSystem, ended: RunEnd, *more: exu.ConfigurationType) -> None:
    """Write the arrays to the system's current state, and to `more` of its states."""
    for kind in (exu.ConfigurationType.Current, *more):
        arrays = mbs.systemData.GetSystemStateDict(configuration=kind, reference=True)
        for name, values in ended.system.items():
            arrays[name][:] = values


def save_point(method: str, model: MusculoskeletalModel, state: RunState) -> RunPoint:
    """The point of a run that has reached its end; see `Plugin.save`."""
    if state.ended is None:
        raise SimulationError(
            "there is no point to save: no run within attached() has reached its end, or the last "
            "one did not"
        )
    return RunPoint(
        method=method,
        names=Names.of(model),
        ended=state.ended,
        handed_on=state.handed_on(),
        counts=state.counts.copy(),
        recorded=state.record.recorded,
    )


def restore_point(
    point: RunPoint, method: str, model: MusculoskeletalModel, state: RunState, start: float
) -> None:
    """Be at a point, in a run whose plugin serves times from `start` [s]; see `Plugin.restore`."""
    if not isinstance(point, RunPoint):
        raise ModelError(f"a point is what save() returned, got {point!r}")
    if not state.attached:
        raise ModelError("restore a point within attached(), between its runs")
    _check_fits(point, method, Names.of(model), start)
    mbs, ended = model.mbs, point.ended
    mbs.systemData.SetTime(ended.time)
    _put(mbs, ended, exu.ConfigurationType.Initial)
    set_time_of_solver(mbs, ended.time)
    model.skeleton.recall(ended.memory)
    state.recall(ended, point.handed_on, point.counts)
    state.record.go_back(point.recorded)


def _check_fits(point: RunPoint, method: str, names: Names, start: float) -> None:
    if point.method != method:
        raise ModelError(f"the point is of a run by '{point.method}', and this is '{method}'")
    for what, then, now in zip(Names._fields, point.names, names, strict=True):
        if then != now:
            raise ModelError(
                f"the point is of another model, with {what.replace('_', ' ')} {then}, not {now}"
            )
    begun = point.recorded.start[0]
    if begun < start - SAME_TIME:
        raise ModelError(
            f"the point is of a run from t = {begun:g} s, and the plugin's muscles start at "
            f"{start:g} s"
        )
