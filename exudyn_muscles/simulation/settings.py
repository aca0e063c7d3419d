"""Settings of every run of Exudyn's solver, whatever the method."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import ParameterError


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """What a run does besides its method.

    Parameters
    ----------
    project_constraints : bool
        After every step, move the system to where its constraints are met: what is tracked by the
        trapezoidal rule on its own accelerations, all else the least way, by its masses. Exudyn's
        TrapezoidalIndex2 meets the rates of constraints alone, so that joints open a little. Where
        there are none nothing changes.

    Raises
    ------
    ParameterError
        Not a bool.
    """

    project_constraints: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.project_constraints, bool):
            raise ParameterError(
                f"project_constraints is True or False, got {self.project_constraints!r}"
            )
