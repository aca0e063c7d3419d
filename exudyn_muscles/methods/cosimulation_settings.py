"""Settings of co-simulation."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ..checks import check_step
from ..errors import ParameterError
from .tracking import TrackingSettings


class Scheme(Enum):
    """How often the muscles are recruited within a step."""

    FULL = "csf"
    SIMPLIFIED = "css"


class Predictor(Enum):
    """The state at which CSS recruits, from the start of the step.

    CONSTANT_ACCELERATION: q + h q' + h^2/2 q'', q' + h q''.
    EXTRAPOLATED_ACCELERATION: q'' continues linearly from the last step and the trapezoidal rule
    leads to q and q'; more accurate, with a lower limit of stability.
    """

    CONSTANT_ACCELERATION = "constant"
    EXTRAPOLATED_ACCELERATION = "extrapolated"


class FirstIterate(Enum):
    """What CSF does at Exudyn's predictor, whose q'' is zero.

    DEMAND: the demanded torque itself goes to Exudyn; recruitment begins with the next iterate. The
    converged step is the same, with one recruitment less.
    RECRUIT: recruit there too, as the paper has it.
    """

    DEMAND = "demand"
    RECRUIT = "recruit"


@dataclass(frozen=True, kw_only=True)
class CosimulationSettings(TrackingSettings):
    """Settings of `cosimulate` and `CosimulationPlugin`.

    Parameters
    ----------
    scheme : Scheme
    step : float
        Step of the skeleton [s]; with the plugin, Exudyn's settings decide.
    predictor : Predictor
        Of the simplified scheme.
    first_iterate : FirstIterate
        Of the full scheme.

    Raises
    ------
    ParameterError
        A value is outside its range, or belongs to the other scheme.
    """

    scheme: Scheme = Scheme.FULL
    step: float = 0.01
    predictor: Predictor = Predictor.CONSTANT_ACCELERATION
    first_iterate: FirstIterate = FirstIterate.DEMAND

    def __post_init__(self) -> None:
        super().__post_init__()
        check_step("step", self.step)
        kinds = {"scheme": Scheme, "predictor": Predictor, "first_iterate": FirstIterate}
        for name, kind in kinds.items():
            if not isinstance(getattr(self, name), kind):
                raise ParameterError(f"{name} = {getattr(self, name)!r} is not a {kind.__name__}")
        name = "predictor" if self.scheme is Scheme.FULL else "first_iterate"
        usual = {"predictor": Predictor.CONSTANT_ACCELERATION, "first_iterate": FirstIterate.DEMAND}
        if getattr(self, name) is not usual[name]:
            raise ParameterError(
                f"{name} = {getattr(self, name)} does nothing with scheme = {self.scheme}"
            )
