"""Laws of the heat that fibres set free, as OpenSim 4.6 has them in its probes.

Rates are per kilogram of muscle. In both laws lengthening velocities are positive.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..checks import number_within
from ..errors import ParameterError

LEAST_HEAT = 1.0  # W/kg, of a muscle that is alive: Umberger et al. (2003), p. 104
LARGEST = 1e6
# Umberger: heat of fast over slow fibres and of slow ones [W/kg]; exponents of A; heat of
# shortening of fast and slow fibres at their largest velocity, which is 2.5 times as large in fast
# ones, and the largest of slow ones [W/kg]; what lengthening sets free over what shortening does
# where its work counts, and where it does not; and what of the steady heat depends on length.
FAST_OVER_SLOW, SLOW, STEADY_POWER, SHORTENING_POWER = 128.0, 25.0, 0.6, 2.0
FAST_SHORTENING, SLOW_SHORTENING, FAST_OVER_SLOW_VELOCITY, MOST = 153.0, 100.0, 2.5, 100.0
LENGTHENING, LENGTHENING_WITHOUT_WORK, OF_LENGTH = 4.0, 0.3, 0.6
# Bhargava: heat of shortening over force times velocity, and the same as a function of the
# isometric and the real force, when the fibre shortens and lengthens.
OF_FORCE, OF_ISOMETRIC, OF_SHORTENING, OF_LENGTHENING = 0.25, 0.16, 0.18, 0.157


class Fibers(NamedTuple):
    """What m fibres do at k times, (k, m) unless said otherwise.

    Attributes
    ----------
    excitation, activation : ndarray
    length : ndarray
        Over the optimal one.
    force_length : ndarray
        f_l
    velocity : ndarray
        In optimal lengths a second.
    active, passive : ndarray
        Forces over the muscle's mass, times optimal length [W s/kg], so that times `velocity` they
        are powers.
    fastest : (m,) ndarray
        v_max in optimal lengths a second.
    strength : (m,) ndarray
        F0, as the forces.
    slow : (m,) ndarray
        Ratio of slow-twitch fibres.
    """

    excitation: np.ndarray
    activation: np.ndarray
    length: np.ndarray
    force_length: np.ndarray
    velocity: np.ndarray
    active: np.ndarray
    passive: np.ndarray
    fastest: np.ndarray
    strength: np.ndarray
    slow: np.ndarray

    @property
    def shortens(self) -> np.ndarray:
        """Where fibres do not lengthen."""
        return self.velocity <= 0.0

    def recruited(self) -> tuple[np.ndarray, np.ndarray]:
        """How much of slow and of fast fibres is excited: slow ones first (Bhargava et al.)."""
        angle = 0.5 * np.pi * self.excitation
        return self.slow * np.sin(angle), (1.0 - self.slow) * (1.0 - np.cos(angle))


class EnergyRates(NamedTuple):
    """Rates (k, m) [W/kg or W]: heat of activation and maintenance, heat of shortening or
    lengthening, work, and all together."""

    steady: np.ndarray
    shortening: np.ndarray
    work: np.ndarray
    total: np.ndarray


@dataclass(frozen=True, kw_only=True)
class EnergyLaw(ABC):
    """What all laws have in common.

    Parameters
    ----------
    negative_work : bool
        Work that is done on lengthening fibres counts.
    forbid_negative_power : bool
        More heat is set free where a fibre would take up power on the whole (T. K. Uchida et al.,
        PLOS ONE 11 (2016) e0150378).
    minimum_heat : bool
        Heat is at least 1 W/kg.
    effort_scaling : float
        Factor on excitations, activations and active forces.
    basal_coefficient, basal_exponent : float
        Basal power [W] is the coefficient times the body's mass [kg] to the exponent: 1.2 W/kg of
        somebody who stands, Umberger et al. (2003), p. 105.

    Raises
    ------
    ParameterError
        A number is out of its range.
    """

    negative_work: bool = True
    forbid_negative_power: bool = True
    minimum_heat: bool = True
    effort_scaling: float = 1.0
    basal_coefficient: float = 1.2
    basal_exponent: float = 1.0

    def __post_init__(self) -> None:
        for name in ("effort_scaling", "basal_coefficient", "basal_exponent"):
            number_within(f"{type(self).__name__}: {name}", getattr(self, name), 0.0, LARGEST)

    @abstractmethod
    def heat(self, fibers: Fibers) -> tuple[np.ndarray, np.ndarray]:
        """Heat over the muscles' mass.

        Parameters
        ----------
        fibers : Fibers
            State of m muscles' fibres at k times.

        Returns
        -------
        pair of (k, m) ndarray
            Heat of activation and maintenance, and of shortening or lengthening [W/kg].
        """

    def rates(self, fibers: Fibers) -> EnergyRates:
        """All rates of fibres.

        Parameters
        ----------
        fibers : Fibers
            State of m muscles' fibres at k times.

        Returns
        -------
        EnergyRates
            (k, m) each [W/kg].
        """
        scaled = fibers._replace(
            excitation=self.effort_scaling * fibers.excitation,
            activation=self.effort_scaling * fibers.activation,
            active=self.effort_scaling * fibers.active,
        )
        steady, shortening = self.heat(scaled)
        work = -self.working_force(scaled) * fibers.velocity
        if not self.negative_work:
            work = np.where(fibers.shortens, work, 0.0)
        if self.forbid_negative_power:
            shortening = shortening + np.maximum(-(steady + shortening + work), 0.0)
        heat = steady + shortening
        if self.minimum_heat:
            heat = np.maximum(heat, LEAST_HEAT)
        return EnergyRates(steady, shortening, work, heat + work)

    def working_force(self, fibers: Fibers) -> np.ndarray:
        """The force that does the work.

        Parameters
        ----------
        fibers : Fibers
            State of m muscles' fibres at k times.

        Returns
        -------
        (k, m) ndarray
            As `active` of the fibres.
        """
        return fibers.active


@dataclass(frozen=True, kw_only=True)
class Umberger(EnergyLaw):
    """B. R. Umberger, K. G. Gerritsen and P. E. Martin, Comput. Methods Biomech. Biomed. Eng. 6
    (2003) 99-111; B. R. Umberger, J. R. Soc. Interface 7 (2010) 1329-1340.

    As published in 2003 are `recruits_in_order=False, forbid_negative_power=False`; as published in
    2010 also `negative_work=False`.

    Parameters
    ----------
    aerobic_factor : float
        S: 1.5 where it is mostly aerobic, 1.0 where it is not.
    recruits_in_order : bool
        Slow fibres first, as Bhargava et al. and Uchida et al. have it; if not, the ratio of slow
        fibres is that of the muscle whatever is excited.
    """

    aerobic_factor: float = 1.5
    recruits_in_order: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        number_within("Umberger: aerobic_factor", self.aerobic_factor, 0.0, LARGEST)

    def heat(self, fibers: Fibers) -> tuple[np.ndarray, np.ndarray]:
        u, a, v = fibers.excitation, fibers.activation, fibers.velocity
        slow = fibers.slow + np.zeros_like(u)
        if self.recruits_in_order:
            of_slow, of_fast = fibers.recruited()
            both = of_slow + of_fast
            slow = np.divide(of_slow, both, out=np.ones_like(both), where=both > 0.0)
        A = np.where(u > a, u, 0.5 * (u + a))
        f_l = np.where(fibers.length > 1.0, fibers.force_length, 1.0)
        steady = self.aerobic_factor * A**STEADY_POWER * (FAST_OVER_SLOW * (1.0 - slow) + SLOW)
        steady = steady * (1.0 - OF_LENGTH + OF_LENGTH * f_l)
        per_slow = SLOW_SHORTENING * FAST_OVER_SLOW_VELOCITY / fibers.fastest
        per_fast = FAST_SHORTENING / fibers.fastest
        shortening = np.minimum(-per_slow * v, MOST) * slow - per_fast * v * (1.0 - slow)
        lengthening = LENGTHENING if self.negative_work else LENGTHENING_WITHOUT_WORK
        moving = np.where(
            fibers.shortens, A**SHORTENING_POWER * shortening, A * lengthening * per_slow * v
        )
        return steady, self.aerobic_factor * moving * f_l

    def working_force(self, fibers: Fibers) -> np.ndarray:
        return np.maximum(fibers.active, 0.0)


@dataclass(frozen=True, kw_only=True)
class Bhargava(EnergyLaw):
    """L. J. Bhargava, M. G. Pandy and F. C. Anderson, J. Biomech. 37 (2004) 81-88.

    Heat of activation does not decay within a contraction, as F. C. Anderson and M. G. Pandy and
    OpenSim have it.

    Parameters
    ----------
    activation_heat, maintenance_heat : pair of float
        Of slow and fast fibres that are fully excited [W/kg].
    maintenance_length : pair of sequences of float
        Normalized lengths, and the factor that maintenance has there, linear in between.
    force_dependent_shortening : bool
        Heat of shortening depends on the isometric force as well.
    """

    activation_heat: tuple[float, float] = (40.0, 133.0)
    maintenance_heat: tuple[float, float] = (74.0, 111.0)
    maintenance_length: tuple[Sequence[float], Sequence[float]] = (
        (0.0, 0.5, 1.0, 1.5, 2.0),
        (0.5, 0.5, 1.0, 0.0, 0.0),
    )
    force_dependent_shortening: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("activation_heat", "maintenance_heat"):
            for value in getattr(self, name):
                number_within(f"Bhargava: {name}", value, 0.0, LARGEST)
        x, y = self.maintenance_length
        if not (len(x) == len(y) > 1 and (np.diff(x) > 0.0).all()):
            raise ParameterError(
                "Bhargava: maintenance_length is lengths that increase and factors"
            )

    def heat(self, fibers: Fibers) -> tuple[np.ndarray, np.ndarray]:
        slow, fast = fibers.recruited()
        kept = np.interp(fibers.length, *self.maintenance_length)
        activation, maintenance = (
            of_slow * slow + of_fast * fast
            for of_slow, of_fast in (self.activation_heat, self.maintenance_heat)
        )
        F = fibers.active + fibers.passive
        per = np.where(fibers.shortens, OF_FORCE * F, 0.0)
        if self.force_dependent_shortening:
            isometric = fibers.activation * fibers.force_length * fibers.strength
            shortens = OF_ISOMETRIC * isometric + OF_SHORTENING * F
            per = np.where(fibers.shortens, shortens, OF_LENGTHENING * F)
        return activation + kept * maintenance, -per * fibers.velocity
