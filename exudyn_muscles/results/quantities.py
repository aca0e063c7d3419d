"""The arrays of a trajectory, each declared once: what stores, reads, compares, tabulates and
documents them reads this table.

A new quantity is a row here, a field of `Trajectory`, and what the recorder supplies for it. Its
`since` is the version of the first files that have it, the next one after `storing.FORMAT_VERSION`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any


class When(Enum):
    """What the rows are: T points of time, K windows, or their K + 1 ends."""

    START = ""
    POINTS = "T"
    WINDOWS = "K"
    ENDS = "K + 1"


class Owner(Enum):
    """What the columns are: n coordinates, N of the whole system, m muscles, or r reserves."""

    COORDINATES = "n"
    SYSTEM = "N"
    MUSCLES = "m"
    RESERVES = "r"


class Scale(Enum):
    """What a tolerance is relative to; of the reference."""

    NONE = ""
    FORCE = "largest tendon force"
    TORQUE = "largest torque"


@dataclass(frozen=True)
class Quantity:
    """One array of a trajectory.

    Attributes
    ----------
    field : str
        Of `Trajectory`, and in files.
    when : When
    owner : Owner or None
        None: it has no columns.
    unit : str
        `A or B`: of an angle or of a translation; empty: none.
    tolerance : float
        Of `Trajectory.compare`, times `scale`.
    scale : Scale
    description : str
    since : int
        Version of the file format that has it first.
    before : float
        Its value in older files.
    other_name : str
        For users of `compare`, `to_dataframe` and the command line, if it is not that of the field.
    """

    field: str
    when: When
    owner: Owner | None
    unit: str
    tolerance: float
    scale: Scale
    description: str
    since: int = 1
    before: float = math.nan
    other_name: str = ""

    @property
    def name(self) -> str:
        """The name for users."""
        return self.other_name or self.field

    @property
    def symbols(self) -> str:
        """The shape in symbols, such as `(T, n)`."""
        parts = [part.value for part in (self.when, self.owner) if part is not None and part.value]
        return f"({parts[0]},)" if len(parts) == 1 else f"({', '.join(parts)})"

    def columns(self, fields: Mapping[str, Any]) -> tuple[str, ...]:
        """Names of the columns, of a trajectory with these fields."""
        return () if self.owner is None else tuple(fields[NAMES_OF[self.owner]])

    def shape(self, fields: Mapping[str, Any]) -> tuple[int, ...]:
        """The shape that fits the times and names of a trajectory with these fields."""
        ends = fields["window_time"].size
        sizes = {When.POINTS: fields["time"].size, When.WINDOWS: ends - 1, When.ENDS: ends}
        rows = () if self.when is When.START else (sizes[self.when],)
        return rows if self.owner is None else (*rows, len(self.columns(fields)))


NAMES_OF = {
    Owner.COORDINATES: "coordinate_names",
    Owner.SYSTEM: "system_names",
    Owner.MUSCLES: "muscle_names",
    Owner.RESERVES: "reserve_names",
}
# Of what has these columns, in an xarray.
DIMENSIONS = {
    Owner.COORDINATES: "coordinate",
    Owner.SYSTEM: "system_coordinate",
    Owner.MUSCLES: "muscle",
    Owner.RESERVES: "reserve",
}

_START, _POINTS, _WINDOWS, _ENDS = When
_COORDINATES, _SYSTEM, _MUSCLES, _RESERVES = Owner
_NONE, _FORCE, _TORQUE = Scale

# In the order of `compare`. The window integration may choose other steps on another machine:
# excitations, activations and CMC's motion then differ within its tolerance of 1e-4, less than the
# methods differ among each other.
QUANTITIES = (
    Quantity("time", _POINTS, None, "s", 1e-9, _NONE, "points of time"),
    Quantity("window_time", _ENDS, None, "s", 1e-9, _NONE, "ends of the windows"),
    Quantity("coordinates", _POINTS, _COORDINATES, "rad or m", 1e-6, _NONE, "q"),
    Quantity("speeds", _POINTS, _COORDINATES, "rad/s or m/s", 1e-5, _NONE, "q'"),
    Quantity("accelerations", _POINTS, _COORDINATES, "rad/s^2 or m/s^2", 1e-3, _NONE, "q''"),
    Quantity(
        "system_coordinates", _POINTS, _SYSTEM, "rad, m or 1", 1e-6, _NONE,
        "x of a system of bodies and joints, as Exudyn has them; of a tree N is 0", since=4,
    ),
    Quantity(
        "system_speeds", _POINTS, _SYSTEM, "rad/s, m/s or 1/s", 1e-5, _NONE,
        "x' of it, as Exudyn has them", since=5,
    ),
    Quantity(
        "constraint_drift", _POINTS, None, "rad, m or 1", 1e-6, _NONE,
        "by how much the constraints of a system are violated at most; zero without",
        since=4, before=0.0,
    ),
    Quantity("activations", _POINTS, _MUSCLES, "", 2e-4, _NONE, "a"),
    Quantity("tendon_forces", _POINTS, _MUSCLES, "N", 2e-4, _FORCE, "F"),
    Quantity("musculotendon_lengths", _POINTS, _MUSCLES, "m", 1e-6, _NONE, "l"),
    Quantity("tendon_lengths", _POINTS, _MUSCLES, "m", 1e-5, _NONE, "l_t", since=2),
    Quantity("fiber_lengths", _POINTS, _MUSCLES, "m", 1e-5, _NONE, "l_m"),
    Quantity(
        "torques_delivered", _POINTS, _COORDINATES, "N m or N", 5e-4, _TORQUE,
        "what the skeleton got, J_m F with the reserves; CSS takes both from the predicted state, "
        "so that they differ from those of the recorded forces by the order of its error",
    ),
    Quantity(
        "torques_ideal", _POINTS, _COORDINATES, "N m or N", 5e-4, _TORQUE,
        "what of them reserves and residuals gave", since=5,
    ),
    Quantity(
        "desired_coordinates", _POINTS, _COORDINATES, "rad or m", 1e-9, _NONE,
        "q_d; NaN where nothing was desired",
    ),
    Quantity(
        "excitation_values", _WINDOWS, _MUSCLES, "", 2e-4, _NONE, "u, held over each window",
        other_name="excitations",
    ),
    Quantity(
        "torques_demanded", _WINDOWS, _COORDINATES, "N m or N", 5e-5, _TORQUE,
        "Q_m at the windows' ends",
    ),
    Quantity(
        "torques_unmet", _WINDOWS, _COORDINATES, "N m or N", 5e-4, _TORQUE,
        "what of Q_m was out of reach",
    ),
    Quantity(
        "force_min", _WINDOWS, _MUSCLES, "N", 2e-4, _FORCE,
        "lower bounds (8), at the accepted state or, with CSS, at the predicted one",
    ),
    Quantity("force_max", _WINDOWS, _MUSCLES, "N", 2e-4, _FORCE, "upper bounds (9), there too"),
    Quantity("force_optimal", _WINDOWS, _MUSCLES, "N", 2e-4, _FORCE, "recruited (10), there too"),
    Quantity(
        "reserves", _ENDS, _RESERVES, "N m or N", 5e-5, _TORQUE,
        "of the ideal actuators at the windows' ends, linear in between",
    ),
    Quantity(
        "start_unmet", When.START, _COORDINATES, "N m or N", 5e-4, _TORQUE,
        "unmet torque of the recruitment at the start",
    ),
)  # fmt: skip


def listing() -> str:
    """The quantities as attributes in a NumPy docstring."""
    return "\n".join(
        f"    {one.field} : {one.symbols} ndarray\n        {one.description}"
        + (f" [{one.unit}]" if one.unit else "")
        for one in QUANTITIES
    )
