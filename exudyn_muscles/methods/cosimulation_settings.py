"""Settings of co-simulation."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ..checks import check_step, number_within
from ..errors import ParameterError
from .tracking import TrackingSettings


class Scheme(Enum):
    """When within a step the muscles are recruited, and which course of their force the skeleton
    feels.

    FULL: in every corrector iteration, as the paper has it; the torque runs through the step as
    Exudyn's integrator has it.
    SIMPLIFIED: once a step, at a predicted state.
    CONSISTENT: the default; as FULL, and the skeleton feels the force that the muscles really have
    within the step, so that the excitations reproduce the motion.
    """

    FULL = "csf"
    SIMPLIFIED = "css"
    CONSISTENT = "consistent"


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

    DEMAND: recruitment begins with the next iterate, to which the demanded torque itself leads, or
    of a tree that is alone and without user functions the control law at once. The converged step
    is the same, with one recruitment less.
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
    disturbance_gain : float
        Of the consistent scheme: the part of what the last step's acceleration was off the control
        law by that is added to the demand, in [0, 1]; 0 leaves the control law alone.

    Raises
    ------
    ParameterError
        A value is outside its range, or belongs to another scheme.
    """

    scheme: Scheme = Scheme.CONSISTENT
    step: float = 0.01
    predictor: Predictor = Predictor.CONSTANT_ACCELERATION
    first_iterate: FirstIterate = FirstIterate.DEMAND
    disturbance_gain: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_step("step", self.step)
        kinds = {"scheme": Scheme, "predictor": Predictor, "first_iterate": FirstIterate}
        for name, kind in kinds.items():
            if not isinstance(getattr(self, name), kind):
                raise ParameterError(f"{name} = {getattr(self, name)!r} is not a {kind.__name__}")
        number_within("disturbance_gain", self.disturbance_gain, 0.0, 1.0)
        for name, (scheme, usual) in OF_ONE_SCHEME.items():
            if self.scheme is not scheme and getattr(self, name) != usual:
                raise ParameterError(
                    f"{name} = {getattr(self, name)} does nothing with scheme = {self.scheme}"
                )


# What only one scheme knows, and what it is where nobody asked for anything else.
OF_ONE_SCHEME = {
    "predictor": (Scheme.SIMPLIFIED, Predictor.CONSTANT_ACCELERATION),
    "first_iterate": (Scheme.FULL, FirstIterate.DEMAND),
    "disturbance_gain": (Scheme.CONSISTENT, 1.0),
}
