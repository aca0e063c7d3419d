"""What a muscle law is: four characteristic curves and a few numbers.

All curves are normalised: fibre lengths by the optimal fibre length, forces by the maximum
isometric force, fibre velocities by the maximum contraction velocity (shortening is negative),
tendon strains by the strain at one maximum isometric force.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import lru_cache
from typing import NamedTuple

from ...checks import number_within
from ...numerics.curves import Curve
from ..force_velocity import CURVES

# Passive curves follow their exponentials up to this many F0, and their tangents from there.
STRONGEST = 1e6
# With an elastic tendon, a fibre whose damping is below this divides by f_l and inverts f_v.
UNDAMPED = 1e-3


class HillCurves(NamedTuple):
    """The curves of one law.

    Attributes
    ----------
    active_force_length : Curve
        f_l of the fibre length.
    force_velocity : Curve
        f_v of the fibre velocity.
    inverse_force_velocity : Curve
        Fibre velocity of f_v; a law may define it apart.
    passive_force_length : Curve
        f_PE of the fibre length.
    tendon_force_length : Curve or None
        f_SE of the tendon strain over `tendon_strain_at_one_norm_force`, or of the tendon strain
        itself if the law has no such number; None for rigid tendons only.
    """

    active_force_length: Curve
    force_velocity: Curve
    inverse_force_velocity: Curve
    passive_force_length: Curve
    tendon_force_length: Curve | None


class MuscleLaw(ABC):
    """A muscle law; the built-in ones are frozen dataclasses, equal if their numbers are.

    Attributes
    ----------
    fiber_damping : float
        beta, force at the maximum contraction velocity over F0 of a damper beside the fibre.
    tendon_strain_at_one_norm_force : float or None
        Default for muscles that give none; None if the tendon curve cannot be scaled.
    shortest_fiber : float
        The fibre stops here [optimal fibre lengths].
    speed_without_activation : float
        Share of the maximum contraction velocity that is left at zero activation; it grows
        linearly to one at full activation.
    force_velocity_form : tuple of (int, float, float)
        Which formula of `muscle/force_velocity.py` relates force and velocity, af and flen of it.
        With one, the damper is part of it, and the curve is what the fibre does without.
    velocity_along_tendon : bool
        Of a rigid tendon: the velocity of f_v is that of the whole unit, whatever its pennation.
    """

    fiber_damping: float = 0.0
    tendon_strain_at_one_norm_force: float | None = None
    shortest_fiber: float = 0.0
    speed_without_activation: float = 1.0
    force_velocity_form: tuple[int, float, float] = (CURVES, 0.0, 0.0)
    velocity_along_tendon: bool = False

    @property
    def bears_no_activation(self) -> bool:
        """Whether the fibre has a velocity without activation, by a damper beside it."""
        by_curves = self.force_velocity_form[0] == CURVES and self.speed_without_activation > 0.0
        return by_curves and self.fiber_damping >= UNDAMPED

    @abstractmethod
    def make_curves(self, elastic: bool) -> HillCurves:
        """The curves of a unit, which every law has its own of.

        Parameters
        ----------
        elastic : bool
            Whether the tendon is elastic or rigid.

        Returns
        -------
        HillCurves
        """

    def keep_number(self, name: str, low: float, high: float) -> None:
        """Check a field and keep it as a float.

        Parameters
        ----------
        name : str
            Of the field.
        low, high : float
            Its range.

        Raises
        ------
        ParameterError
            It is outside its range; names the law, the field and the range.
        """
        number = number_within(f"{type(self).__name__}: {name}", getattr(self, name), low, high)
        object.__setattr__(self, name, number)

    def curves(self, elastic: bool = True) -> HillCurves:
        """The curves of a unit as the kernels see them.

        Parameters
        ----------
        elastic : bool
            Whether the tendon is elastic or rigid.

        Returns
        -------
        HillCurves
        """
        return _curves(self, elastic)


@lru_cache(maxsize=64)
def _curves(law: MuscleLaw, elastic: bool) -> HillCurves:
    """Made once: laws are values."""
    return law.make_curves(elastic)
