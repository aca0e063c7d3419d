"""What a study keeps of a run: numbers, by name.

`max(tendon_forces/soleus)`, `rms(tracking_errors/knee)`, `at(activations/soleus, 0.35)` reduce a
column of the result over time, or all columns of a quantity at once: `max(activations)`. Columns of
analyses have the analysis before them: `max(power:joint_power/knee)`,
`max(joint_forces:size/knee)`. `max_unmet_torque` and other numbers of a result stand for
themselves.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import analysis
from ..analysis.joint_loads import force_sizes
from ..analysis.table import tabulated
from ..errors import StudyError
from ..model import MusculoskeletalModel
from ..results.quantities import QUANTITIES, Quantity, When
from ..results.trajectory import Trajectory
from .source import found

Function = Callable[[MusculoskeletalModel, Trajectory], float]

# NaN, as of a quantity that was not recorded, stays NaN.
REDUCTIONS: dict[str, Callable[[np.ndarray], Any]] = {
    "max": np.max,
    "min": np.min,
    "mean": np.mean,
    "rms": lambda values: np.sqrt(np.mean(np.square(values))),
    "range": np.ptp,
    "absmax": lambda values: np.max(np.abs(values)),
    "last": lambda values: np.max(values[-1]),
}


def _joint_forces(model: MusculoskeletalModel, result: Trajectory) -> analysis.Table:
    """Sizes of the forces in joints, `size/joint` [N]."""
    loads = analysis.joint_loads(model, result)
    names, sizes = force_sizes(loads)
    return tabulated("joint forces", loads.time, {"size": ("N", names, sizes)})


ANALYSES: dict[str, Callable[[MusculoskeletalModel, Trajectory], analysis.Table]] = {
    "muscle_analysis": analysis.muscle_analysis,
    "power": analysis.power,
    "work": lambda model, result: analysis.work(analysis.power(model, result)),
    "feasible_forces": analysis.feasible_forces,
    "metabolic_power": analysis.metabolic_power,
    "joint_loads": analysis.joint_loads,
    "joint_forces": _joint_forces,
}
NUMBERS = ("max_unmet_torque", "max_constraint_drift")  # of a Trajectory
AT = "at"
ERRORS = "tracking_errors"
FORM = re.compile(r"\s*(\w+)\(\s*(?:(\w+)\s*:)?\s*([^,():]+?)\s*(?:,\s*([-+.\deE]+)\s*)?\)\s*")
BY_NAME = {one.name: one for one in QUANTITIES if one.when is not When.START}


@dataclass(frozen=True)
class Outcome:
    """A number of a run.

    Parameters
    ----------
    name : str
        Of its column in the table.
    what : str or callable
        As above, or a function of model and trajectory -> float: itself, or `module:function`.

    Raises
    ------
    StudyError
        It cannot be read.
    """

    name: str
    what: str | Function

    def __post_init__(self) -> None:
        what = self.what
        if callable(what) or what in NUMBERS or re.fullmatch(r"[\w.]+:\w+", what):
            return
        form = FORM.fullmatch(what)
        if form is None:
            raise StudyError(
                f"outcome '{what}': expected REDUCTION(QUANTITY/NAME), at(QUANTITY/NAME, TIME), "
                f"REDUCTION(ANALYSIS:QUANTITY/NAME), module:function or {' or '.join(NUMBERS)}"
            )
        reduction, analysed, _, time = form.groups()
        if reduction not in (*REDUCTIONS, AT) or (time is not None) != (reduction == AT):
            raise StudyError(
                f"outcome '{what}': reductions are {', '.join(REDUCTIONS)}, and {AT}(..., TIME)"
            )
        if analysed is not None and analysed not in ANALYSES:
            raise StudyError(f"outcome '{what}': analyses are {', '.join(ANALYSES)}")


def values(
    outcomes: tuple[Outcome, ...], model: MusculoskeletalModel, result: Trajectory
) -> tuple[float, ...]:
    """All of them, each analysis made once.

    Raises
    ------
    StudyError
        The result has no such column, or a function gives no number.
    """
    tables: dict[str, analysis.Table] = {}
    return tuple(_value(outcome.what, model, result, tables) for outcome in outcomes)


def _value(
    what: str | Function,
    model: MusculoskeletalModel,
    result: Trajectory,
    tables: dict[str, analysis.Table],
) -> float:
    if isinstance(what, str) and what in NUMBERS:
        return float(getattr(result, what))
    form = None if callable(what) else FORM.fullmatch(what)
    if form is None:
        given = found(what)(model, result)
        try:
            return float(given)
        except (TypeError, ValueError):
            raise StudyError(f"outcome '{what}' gives no number but {given!r}") from None
    reduction, analysed, column, moment = form.groups()
    if analysed is None:
        time, chosen = _column(result, column)
    else:
        if analysed not in tables:
            tables[analysed] = ANALYSES[analysed](model, result)
        table = tables[analysed]
        time, chosen = table.time, table[column]
    if not chosen.size:
        raise StudyError(f"outcome '{what}': there is nothing in this result")
    if reduction != AT:
        return float(REDUCTIONS[reduction](chosen))
    t = float(moment)
    if not time[0] - 1e-9 <= t <= time[-1] + 1e-9:
        raise StudyError(f"outcome '{what}': the result spans {time[0]:g} to {time[-1]:g} s")
    columns = chosen.reshape(len(time), -1).T
    return float(max(np.interp(t, time, values) for values in columns))


def _column(result: Trajectory, column: str) -> tuple[np.ndarray, np.ndarray]:
    """Times, and a column (k,) or a quantity (k, columns)."""
    quantity, _, name = column.partition("/")
    one = BY_NAME.get(quantity)
    if quantity != ERRORS and one is None:
        raise StudyError(f"there is no quantity '{quantity}', only {', '.join((*BY_NAME, ERRORS))}")
    fields: Mapping[str, Any] = vars(result)
    if one is None:
        time, array, names = result.time, result.tracking_errors(), result.coordinate_names
    else:
        time, array, names = _times(one, result), fields[one.field], one.columns(fields)
    if not name:
        return time, array
    if name not in names:
        raise StudyError(f"{quantity}: there is no '{name}', only {', '.join(names) or 'none'}")
    return time, array[:, names.index(name)]


def _times(one: Quantity, result: Trajectory) -> np.ndarray:
    ends = result.window_time
    return {When.POINTS: result.time, When.WINDOWS: ends[1:], When.ENDS: ends}[one.when]
