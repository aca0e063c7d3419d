"""What muscles use: heat and work, by muscle and of the whole body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..checks import number_within
from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..muscle.dynamics import MuscleDynamics
from ..muscle.parameters import Muscle, MuscleSet
from ..results.trajectory import Trajectory
from .heat import LARGEST, EnergyLaw, EnergyRates, Fibers, Umberger
from .muscles import fibers_along
from .table import Table, tabulated

LEAST = 1e-6  # of what is divided by
# What numbers in other units are outside of: N/cm^2 and g/cm^3 among them.
TENSION, DENSITY = (1e4, 1e7), (500.0, 2000.0)


@dataclass(frozen=True, kw_only=True)
class Tissue:
    """What a muscle is made of; mammalian, as OpenSim's probes have it.

    Parameters
    ----------
    slow_twitch_ratio : float
        Ratio of slow-twitch fibres, from 0 to 1.
    specific_tension : float
        [N/m^2]
    density : float
        [kg/m^3]
    mass : float, optional
        [kg]; from the others, strength and optimal fibre length if left out.

    Raises
    ------
    ParameterError
        A number is out of its range.

    Examples
    --------
    >>> Tissue(mass=0.3).slow_twitch_ratio
    0.5
    """

    slow_twitch_ratio: float = 0.5
    specific_tension: float = 0.25e6
    density: float = 1059.7
    mass: float | None = None

    def __post_init__(self) -> None:
        number_within("Tissue: slow_twitch_ratio", self.slow_twitch_ratio, 0.0, 1.0)
        number_within("Tissue: specific_tension", self.specific_tension, *TENSION, "N/m^2")
        number_within("Tissue: density", self.density, *DENSITY, "kg/m^3")
        if self.mass is not None:
            number_within("Tissue: mass", self.mass, LEAST, LARGEST)

    def mass_of(self, muscle: Muscle) -> float:
        """The mass of a muscle [kg].

        Parameters
        ----------
        muscle : Muscle

        Returns
        -------
        float
            [kg]
        """
        if self.mass is not None:
            return self.mass
        area = muscle.max_isometric_force / self.specific_tension
        return area * self.density * muscle.optimal_fiber_length


ORDINARY, STANDARD = Tissue(), Umberger()


def metabolic_power(
    model: MusculoskeletalModel,
    result: Trajectory,
    law: EnergyLaw = STANDARD,
    tissue: Tissue | Mapping[str, Tissue] = ORDINARY,
    *,
    body_mass: float | None = None,
) -> Table:
    """Metabolic power of muscles, and of the whole body.

    Excitations are those of the window that ends at a time; at the start, of the first one.

    Parameters
    ----------
    model : MusculoskeletalModel
    result : Trajectory
        Of this model, with windows.
    law : Umberger or Bhargava
    tissue : Tissue or mapping
        Of all muscles, or by their names; others have the ordinary one.
    body_mass : float, optional
        For basal power [kg]; that of all bodies if left out.

    Returns
    -------
    Table
        `activation_maintenance_heat/muscle`, `shortening_heat/muscle`, `work_rate/muscle`, and
        `metabolic_power/muscle` of all three with the least heat kept [W]; `metabolic_power/basal`
        and `metabolic_power/total`.

    Raises
    ------
    ParameterError
        The trajectory is of another model or has no windows, there is no such muscle, or a muscle
        is called as what is reported of the whole body.
    """
    found, names = fibers_along(model, result), model.muscles.names
    if not result.windows:
        raise ParameterError("metabolic power needs excitations: the trajectory has no windows")
    for name in {"basal", "total"} & set(names):
        raise ParameterError(f"metabolic power: a muscle is called '{name}'")
    window = np.searchsorted(result.window_time, result.time - 1e-9) - 1
    u = result.excitation_values[np.clip(window, 0, result.windows - 1)]
    rates = muscle_rates(model.muscles, found, result.activations, u, law, _each(tissue, names))
    if body_mass is None:
        body_mass = sum(body.mass for body in model.skeleton.segments().bodies)
    basal = np.full((u.shape[0], 1), law.basal_coefficient * body_mass**law.basal_exponent)
    power = np.hstack([rates.total, basal, basal + rates.total.sum(axis=1, keepdims=True)])
    parts = {
        "activation_maintenance_heat": ("W", names, rates.steady),
        "shortening_heat": ("W", names, rates.shortening),
        "work_rate": ("W", names, rates.work),
        "metabolic_power": ("W", (*names, "basal", "total"), power),
    }
    return tabulated("metabolic power", result.time, parts)


def muscle_rates(
    muscles: MuscleSet,
    found: MuscleDynamics,
    a: np.ndarray,
    u: np.ndarray,
    law: EnergyLaw,
    tissues: Sequence[Tissue],
) -> EnergyRates:
    """Rates (k, m) [W] of muscles in these states with activations and excitations (k, m)."""
    each, optimal = list(muscles), muscles.optimal_fiber_length
    mass = np.array([one.mass_of(muscle) for one, muscle in zip(tissues, each, strict=True)])
    per_mass = optimal / mass
    rates = law.rates(
        Fibers(
            excitation=u,
            activation=a,
            length=found.fiber_length / optimal,
            force_length=found.active_force_length,
            velocity=found.fiber_velocity / optimal,
            active=found.active_fiber_force * per_mass,
            passive=found.passive_fiber_force * per_mass,
            fastest=np.array([muscle.max_contraction_velocity for muscle in each]),
            strength=muscles.max_isometric_force * per_mass,
            slow=np.array([one.slow_twitch_ratio for one in tissues]),
        )
    )
    return EnergyRates(*(mass * rate for rate in rates))


def _each(tissue: Tissue | Mapping[str, Tissue], names: tuple[str, ...]) -> list[Tissue]:
    if isinstance(tissue, Tissue):
        return [tissue] * len(names)
    if not isinstance(tissue, Mapping):
        raise ParameterError(f"tissue is a Tissue or a mapping of them, got {tissue!r}")
    for name in set(tissue) - set(names):
        raise ParameterError(f"tissue: the model has no muscle '{name}'")
    return [tissue.get(name, ORDINARY) for name in names]
