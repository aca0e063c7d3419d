"""How forces are found: the settings that all methods share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..checks import number_within
from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..muscle.window import DEFAULT_TOLERANCE, Integrator, check_integration
from .criteria.criterion import Criterion
from .criteria.forces import SquaredForces
from .limits import ControlLimits
from .normalizers import Normalizer, ReachableMaximum
from .optimization import Solver


@dataclass(frozen=True, kw_only=True)
class RecruitmentSettings:
    """How forces are found, common to static optimization, CMC and co-simulation.

    Parameters
    ----------
    normalizer : Normalizer
        Of the objective (10); the reachable maximum as in the paper.
    weights : mapping of str to float
        Of muscles in the objective (10), by name; 1 for those that are not named. An ideal
        actuator's weight is its optimal force.
    coordinate_weights : float or (n,) sequence of float
        Where a demand is out of reach, coordinates with larger weights come nearer to theirs; only
        their ratios matter.
    control_limits : mapping of str to ControlLimits
        Of muscles and ideal actuators, by name; for the others see `MusculoskeletalModel`.
    criterion : Criterion
        What is preferred among forces that deliver the same torques; (10) as in the paper.
    solver : Solver
        Of the quadratic program.
    window_tolerance : float
        Of the muscle integration, over F0.
    integrator : Integrator
        Of the muscles over a window; the paper's is the trapezoidal rule.
    raise_on_unmet_torque : bool
        Stop with UnmetTorqueError instead of recording and going on.

    Raises
    ------
    ParameterError
        A value is outside its range; names it.
    """

    normalizer: Normalizer = ReachableMaximum()  # noqa: RUF009 (frozen, too)
    weights: Mapping[str, float] = field(default_factory=dict)
    coordinate_weights: float | Sequence[float] = 1.0
    control_limits: Mapping[str, ControlLimits] = field(default_factory=dict)
    criterion: Criterion = SquaredForces()
    solver: Solver = Solver.DAQP
    window_tolerance: float = DEFAULT_TOLERANCE
    integrator: Integrator = Integrator.ROSENBROCK
    raise_on_unmet_torque: bool = False

    def __post_init__(self) -> None:
        check_integration(self.window_tolerance, self.integrator)
        if not isinstance(self.solver, Solver):
            raise ParameterError(f"solver = {self.solver!r} is not one of {list(Solver)}")
        if not callable(self.normalizer):
            raise ParameterError(f"normalizer = {self.normalizer!r} is not a function")
        if isinstance(self.criterion, type) or not callable(
            getattr(self.criterion, "prepare", None)
        ):
            raise ParameterError(
                f"criterion = {self.criterion!r} is no object with a function prepare"
            )
        self._keep_each("coordinate_weights", 1e-6, 1e6)
        for name in ("weights", "control_limits"):
            if not isinstance(getattr(self, name), Mapping):
                raise ParameterError(
                    f"{name} = {getattr(self, name)!r} is no mapping of names, such as a dict"
                )
        for name, weight in self.weights.items():
            number_within(f"weights: '{name}'", weight, 1e-6, 1e6)
        for name, limits in self.control_limits.items():
            if not isinstance(limits, ControlLimits):
                raise ParameterError(f"control_limits: '{name}' = {limits!r} is no ControlLimits")

    def _keep_each(self, name: str, low: float, high: float, unit: str = "") -> None:
        """Check and keep one number, or a tuple with one for each coordinate."""
        given = getattr(self, name)
        if isinstance(given, str) or np.ndim(given) == 0:
            kept: float | tuple[float, ...] = number_within(name, given, low, high, unit)
        else:
            kept = tuple(
                number_within(f"{name}[{j}]", value, low, high, unit)
                for j, value in enumerate(given)
            )
        object.__setattr__(self, name, kept)


def check_fit(settings: RecruitmentSettings, model: MusculoskeletalModel) -> None:
    """Check what settings say of coordinates, muscles and actuators, before anything runs.

    Raises
    ------
    ParameterError
        What is given for each coordinate does not fit the model's, or a name in `weights` is none
        of its muscles. (Those in `control_limits` are checked by `Limits`.)
    """
    n, names = len(model.coordinates), ", ".join(model.coordinates)
    for name in ("kp", "kv", "coordinate_weights"):
        size = np.size(getattr(settings, name, 1.0))
        if size not in (1, n):
            raise ParameterError(f"{name} has {size} values for the {n} coordinates {names}")
    for name in settings.weights:
        if name not in model.muscles.names:
            raise ParameterError(
                f"weights of '{name}': the muscles are {', '.join(model.muscles.names)}"
            )
