"""One muscle, and a set of them as a struct of arrays.

Names and units are OpenSim's, the symbols are the paper's.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..checks import number_within
from ..errors import ParameterError
from ..numerics.curves import Curve, PackedCurves, pack
from .activation import ActivationDynamics
from .laws.de_groote_fregly_2016 import DeGrooteFregly2016
from .laws.law import MuscleLaw

if TYPE_CHECKING:
    from ..path.functions import FunctionPath
    from ..path.points import MovingPathPoint, PathPoint
    from ..path.surfaces import PathWrap, WrapSurface

# Columns of `MuscleTables.table`. The last five are the numbers of the curves; FORM, AF and FLEN
# are those of `force_velocity.py`, ALONG says that f_v takes no cosine of the pennation.
(
    F_0, L_M0, PER_L_M0, L_TS, PER_E, PER_STRETCH, WIDTH, V_M, V_REST, BETA, P_MIN, RIGID,
    A_MIN, TAU_A, TAU_D, SWITCH, ACTIVATION, FORM, AF, FLEN, ALONG, F_L, F_V, INVERSE_F_V, F_PE,
    F_SE, COLUMNS,
) = range(27)  # fmt: skip

CURVES = slice(F_L, COLUMNS)

NO_CURVE = Curve.line(0.0, 0.0)  # kernels get at least one

# Fibres without a damper divide by the activation.
LEAST_ACTIVATION = 1e-3
AT_ONCE = 1e-4  # s, of an activation that is its excitation: shorter than any step
# OpenSim's limit for all fixed-width units; the fibre would stand across the tendon at 90 deg.
MAXIMUM_PENNATION = math.acos(0.1)


class MuscleTables(NamedTuple):
    """What the compiled kernels see of m muscles.

    Attributes
    ----------
    table : (m, COLUMNS) ndarray
        Parameters, a muscle in a row.
    curves : PackedCurves
        The curves of all laws in use.
    found : (m, 5) ndarray of int
        In which piece of each of its curves a muscle was found last: where it is looked for first,
        which a processor does while `x` is still to be computed. No number depends on it.
    """

    table: np.ndarray
    curves: PackedCurves
    found: np.ndarray


# Lowest and highest allowed value and unit of every parameter.
RANGES = {
    "max_isometric_force": (1e-3, 1e6, "N"),
    "optimal_fiber_length": (1e-4, 10.0, "m"),
    "tendon_slack_length": (1e-5, 10.0, "m"),
    "pennation_angle_at_optimal": (0.0, 1.4, "rad"),
    "max_contraction_velocity": (0.1, 100.0, "optimal fiber lengths/s"),
    "activation_time_constant": (1e-4, 10.0, "s"),
    "deactivation_time_constant": (1e-4, 10.0, "s"),
    "minimum_activation": (0.0, 0.5, ""),
    "min_control": (0.0, 1.0, ""),
    "max_control": (0.0, 1.0, ""),
    "activation_dynamics_smoothing": (1e-3, 1e3, ""),
    "maximum_pennation_angle": (0.0, MAXIMUM_PENNATION, "rad"),
}


@dataclass(frozen=True)
class Muscle:
    """A musculotendon unit: Hill-type fibre with constant width, elastic or rigid tendon.

    Parameters
    ----------
    name : str
        Unique within a model.
    max_isometric_force : float
        F0 [N].
    optimal_fiber_length : float
        l_m0 [m].
    tendon_slack_length : float
        l_ts [m]; it may be zero if the tendon is rigid.
    pennation_angle_at_optimal : float
        alpha_0 [rad].
    max_contraction_velocity : float
        v_max [optimal fibre lengths/s]. 10 is OpenSim's default.
    activation_time_constant, deactivation_time_constant : float
        tau_a and tau_d [s] of (5); 15 and 50 ms as in Thelen (2003).
    activation_dynamics : ActivationDynamics
        Law (5); the paper's linear filter.
    activation_dynamics_smoothing : float
        b of the smooth law: 0.1 as published, 10 as OpenSim recommends.
    minimum_activation : float
        a_min, below which no excitation goes either; 0.01 as in OpenSim. Fibres with a damper may
        have none, all others at least 0.001.
    min_control, max_control : float
        Lowest and highest excitation that a method may find.
    law : MuscleLaw
        The characteristic curves.
    tendon_strain_at_one_norm_force : float, optional
        Tendon strain at F0; the law's own if left out.
    ignore_tendon_compliance : bool
        The tendon is rigid: the fibre takes up all changes of length.
    maximum_pennation_angle : float
        The fibre does not shorten further once it is reached [rad]; acos(0.1) as in OpenSim.
    path : sequence of PathPoint, ConditionalPathPoint or MovingPathPoint
        From origin to insertion, straight lines between the points. Or a `FunctionPath`.
    wraps : sequence of PathWrap or of surfaces
        What the lines wrap over; a surface alone is for the whole path.

    Raises
    ------
    ParameterError
        Names the muscle, the parameter, its value and the allowed range.
    """

    name: str
    _: KW_ONLY
    max_isometric_force: float
    optimal_fiber_length: float
    tendon_slack_length: float
    pennation_angle_at_optimal: float = 0.0
    max_contraction_velocity: float = 10.0
    activation_time_constant: float = 0.015
    deactivation_time_constant: float = 0.050
    activation_dynamics: ActivationDynamics = ActivationDynamics.LINEAR_FILTER
    activation_dynamics_smoothing: float = 0.1
    minimum_activation: float = 0.01
    min_control: float = 0.0
    max_control: float = 1.0
    law: MuscleLaw = DeGrooteFregly2016()  # noqa: RUF009 (frozen, too)
    tendon_strain_at_one_norm_force: float | None = None
    ignore_tendon_compliance: bool = False
    maximum_pennation_angle: float = MAXIMUM_PENNATION
    path: Sequence[PathPoint | MovingPathPoint] | FunctionPath = ()
    wraps: Sequence[PathWrap | WrapSurface] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise ParameterError(f"a muscle's name is a non-empty string, got {self.name!r}")
        for parameter, (low, high, unit) in RANGES.items():
            name = f"muscle '{self.name}': {parameter}"
            if parameter == "tendon_slack_length" and self.ignore_tendon_compliance is True:
                low = 0.0
            number = number_within(name, getattr(self, parameter), low, high, unit)
            object.__setattr__(self, parameter, number)
        if self.pennation_angle_at_optimal > self.maximum_pennation_angle:
            raise ParameterError(
                f"muscle '{self.name}': pennation_angle_at_optimal = "
                f"{self.pennation_angle_at_optimal:g} is outside "
                f"[0, maximum_pennation_angle = {self.maximum_pennation_angle:g}] rad"
            )
        if not max(self.min_control, self.minimum_activation) <= self.max_control:
            raise ParameterError(
                f"muscle '{self.name}': max_control = {self.max_control:g} is below "
                f"min_control = {self.min_control:g} or minimum_activation = "
                f"{self.minimum_activation:g}"
            )
        if isinstance(self.path, Iterable):
            object.__setattr__(self, "path", tuple(self.path))
        object.__setattr__(self, "wraps", tuple(self.wraps))
        self._check_law()

    def _check_law(self) -> None:
        """Raise ParameterError unless law, tendon and activation fit together."""
        kinds = {
            "law": MuscleLaw,
            "activation_dynamics": ActivationDynamics,
            "ignore_tendon_compliance": bool,
        }
        for parameter, kind in kinds.items():
            if not isinstance(getattr(self, parameter), kind):
                raise ParameterError(
                    f"muscle '{self.name}': {parameter} = {getattr(self, parameter)!r} is not a "
                    f"{kind.__name__}"
                )
        if self.minimum_activation < LEAST_ACTIVATION and not self.law.bears_no_activation:
            raise ParameterError(
                f"muscle '{self.name}': minimum_activation = {self.minimum_activation:g} is below "
                f"{LEAST_ACTIVATION:g}: {type(self.law).__name__} divides by the activation"
            )
        strain, own = self.tendon_strain_at_one_norm_force, self.law.tendon_strain_at_one_norm_force
        if strain is not None:
            name = f"muscle '{self.name}': tendon_strain_at_one_norm_force"
            if own is None:
                raise ParameterError(f"{name} = {strain!r}: the tendon of {self.law} has no scale")
            number = number_within(name, strain, 1e-3, 1.0)
            object.__setattr__(self, "tendon_strain_at_one_norm_force", number)

    @property
    def tendon_strain(self) -> float:
        """What the tendon curve's strain is divided by: the strain at F0, or 1."""
        own = self.law.tendon_strain_at_one_norm_force
        return self.tendon_strain_at_one_norm_force or own or 1.0

    @property
    def shortest_fiber(self) -> float:
        """Length [m] at which the fibre stops: the law's, or that of the maximum pennation."""
        shortest = self.law.shortest_fiber * self.optimal_fiber_length
        if self.width > 0.0:
            shortest = max(shortest, self.width / math.sin(self.maximum_pennation_angle))
        return shortest

    @property
    def width(self) -> float:
        """w = l_m0 sin(alpha_0) [m], constant."""
        return self.optimal_fiber_length * math.sin(self.pennation_angle_at_optimal)


class MuscleSet:
    """m muscles as a struct of arrays.

    Parameters
    ----------
    muscles : iterable of Muscle

    Attributes
    ----------
    names : tuple of str
    tables : MuscleTables
        As the compiled kernels use them; what numbers depend on is read-only.

    Raises
    ------
    ParameterError
        Two muscles share a name.
    """

    def __init__(self, muscles: Iterable[Muscle]) -> None:
        self._muscles = tuple(muscles)
        self.names = tuple(muscle.name for muscle in self._muscles)
        twice = [name for name, count in Counter(self.names).items() if count > 1]
        if twice:
            raise ParameterError(f"muscle names must be unique, used more than once: {twice}")
        numbers: dict[Curve, int] = {}
        rows = [_row(muscle, numbers) for muscle in self._muscles]
        table = np.array(rows).reshape(-1, COLUMNS)
        table.setflags(write=False)
        curves = pack(list(numbers) or [NO_CURVE])
        first = curves.bins[curves.grids[:, 3].astype(int)]
        found = first[table[:, CURVES].astype(int)]
        self.tables = MuscleTables(table, curves, found)

    def __len__(self) -> int:
        return len(self._muscles)

    def __iter__(self) -> Iterator[Muscle]:
        return iter(self._muscles)

    @property
    def max_isometric_force(self) -> np.ndarray:
        """F0, (m,) [N]."""
        return self.tables.table[:, F_0]

    @property
    def minimum_activation(self) -> np.ndarray:
        """a_min, (m,)."""
        return self.tables.table[:, A_MIN]

    @property
    def optimal_fiber_length(self) -> np.ndarray:
        """l_m0, (m,) [m]."""
        return self.tables.table[:, L_M0]

    def with_rigid(self, l_t: np.ndarray) -> np.ndarray:
        """Tendon lengths, with the slack length where the tendon is rigid.

        Parameters
        ----------
        l_t : (m,) ndarray
            [m]

        Returns
        -------
        (m,) ndarray
            [m]
        """
        return np.where(self.tables.table[:, RIGID] == 1.0, self.tables.table[:, L_TS], l_t)

    @property
    def shortest_taut_length(self) -> np.ndarray:
        """Musculotendon length (m,) [m] below which the tendon is slack at the shortest fibre."""
        return self.tables.table[:, L_TS] + self.tables.table[:, P_MIN]


def _row(muscle: Muscle, numbers: dict[Curve, int]) -> list[float]:
    """One muscle's row of the table; adds its curves to those that have a number."""
    law, elastic = muscle.law, not muscle.ignore_tendon_compliance
    curves = law.curves(elastic)
    row = [0.0] * COLUMNS
    row[F_0] = muscle.max_isometric_force
    row[L_M0] = muscle.optimal_fiber_length
    row[PER_L_M0] = 1.0 / muscle.optimal_fiber_length
    row[L_TS] = muscle.tendon_slack_length
    row[WIDTH] = muscle.width
    row[V_M] = muscle.max_contraction_velocity * muscle.optimal_fiber_length
    row[V_REST] = law.speed_without_activation
    row[BETA] = law.fiber_damping
    row[FORM], row[AF], row[FLEN] = law.force_velocity_form
    row[ALONG] = law.velocity_along_tendon
    # The tendon curve's argument is (l_t / l_ts - 1) / e = l_t PER_STRETCH - PER_E.
    row[PER_E] = 1.0 / muscle.tendon_strain
    # Of a rigid one it is only a scale.
    row[PER_STRETCH] = row[PER_E] / (muscle.tendon_slack_length or muscle.optimal_fiber_length)
    row[P_MIN] = math.sqrt(muscle.shortest_fiber**2 - muscle.width**2)
    row[RIGID] = muscle.ignore_tendon_compliance
    row[A_MIN] = muscle.minimum_activation
    row[TAU_A] = muscle.activation_time_constant
    row[TAU_D] = muscle.deactivation_time_constant
    row[SWITCH] = muscle.activation_dynamics_smoothing
    row[ACTIVATION] = muscle.activation_dynamics.value
    row[F_L] = numbers.setdefault(curves.active_force_length, len(numbers))
    row[F_V] = numbers.setdefault(curves.force_velocity, len(numbers))
    row[INVERSE_F_V] = numbers.setdefault(curves.inverse_force_velocity, len(numbers))
    row[F_PE] = numbers.setdefault(curves.passive_force_length, len(numbers))
    if curves.tendon_force_length is not None:
        row[F_SE] = numbers.setdefault(curves.tendon_force_length, len(numbers))
    elif elastic:
        raise ParameterError(
            f"muscle '{muscle.name}': {law} has no tendon curve; give it one, or set "
            "ignore_tendon_compliance"
        )
    return row
