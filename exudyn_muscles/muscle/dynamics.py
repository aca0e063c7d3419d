"""Everything that a muscle does at one instant, under OpenSim's names."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError
from ..numerics.kernel import kernel
from .activation import activation_rate
from .arguments import as_rows, check_range
from .contraction import curve_at, fiber, fiber_force, pull, stopped_rate, tendon_force
from .parameters import (
    ACTIVATION,
    ALONG,
    BETA,
    F_0,
    F_L,
    F_PE,
    F_V,
    FORM,
    L_TS,
    P_MIN,
    PER_L_M0,
    RIGID,
    SWITCH,
    TAU_A,
    TAU_D,
    V_M,
    V_REST,
    WIDTH,
    MuscleSet,
)


class MuscleDynamics(NamedTuple):
    """What m muscles do at one instant, (m,) each.

    Attributes
    ----------
    tendon_force : ndarray
        F [N], zero where the tendon is slack.
    fiber_length, fiber_velocity : ndarray
        l_m [m], l_m' [m/s].
    pennation_angle : ndarray
        alpha [rad].
    active_force_length, force_velocity, passive_force_length : ndarray
        f_l, f_v, f_PE.
    active_fiber_force, passive_fiber_force : ndarray
        F0 a f_l f_v, and the rest [N]: F0 (f_PE + beta v), or with another damper if the law has
        one. They may push where the tendon is slack; the tendon does not.
    tendon_length_rate, activation_rate : ndarray
        l_t' [m/s] and a' [1/s]; the latter NaN where no excitation was given.
    tendon_stiffness : ndarray
        dF/dl_t [N/m]: zero where the tendon is slack, infinite if it is rigid.
    """

    tendon_force: np.ndarray
    fiber_length: np.ndarray
    fiber_velocity: np.ndarray
    pennation_angle: np.ndarray
    active_force_length: np.ndarray
    force_velocity: np.ndarray
    passive_force_length: np.ndarray
    active_fiber_force: np.ndarray
    passive_fiber_force: np.ndarray
    tendon_length_rate: np.ndarray
    activation_rate: np.ndarray
    tendon_stiffness: np.ndarray


@kernel
def dynamics(tables, a, l_t, l, l_rate, u, rows):
    """Write the rows of `MuscleDynamics` (12, m)."""
    for i in range(a.size):
        F0 = tables.table[i, F_0]
        p = max(l[i] - l_t[i], tables.table[i, P_MIN])
        l_m, per_cos, _ = fiber(tables, i, p)
        x = l_m * tables.table[i, PER_L_M0]
        f_l = curve_at(tables, i, F_L, x)[0]
        f_PE = curve_at(tables, i, F_PE, x)[0]
        stopped, l_t_rate, _, _, _, _ = stopped_rate(tables, i, a[i], l_t[i], l[i], l_rate[i])
        share = 1.0 if tables.table[i, ALONG] else per_cos
        v = (l_rate[i] - l_t_rate) / (share * tables.table[i, V_M])
        s = tables.table[i, V_REST] + (1.0 - tables.table[i, V_REST]) * a[i]
        f_v = curve_at(tables, i, F_V, v / s)[0]
        F, _, F_t, _, _ = pull(tables, i, a[i], l_t[i], l[i], l_rate[i])
        rows[0, i], rows[11, i] = F, np.inf if tables.table[i, RIGID] else F_t
        rows[1, i], rows[2, i] = l_m, v * tables.table[i, V_M]
        rows[3, i] = np.arctan2(tables.table[i, WIDTH], p)
        rows[4, i], rows[5, i], rows[6, i] = f_l, f_v, f_PE
        rows[7, i] = F0 * a[i] * f_l * f_v
        rows[8, i] = F0 * (f_PE + tables.table[i, BETA] * v)
        if tables.table[i, FORM] != 0.0:
            bears = F0 * fiber_force(tables, i, a[i], x, v)[0]
            if not (tables.table[i, RIGID] or stopped):
                # Of a push there is no telling from the velocity.
                bears = tendon_force(tables, i, a[i], l_t[i], l[i], l_rate[i])[0] * per_cos
            rows[8, i] = bears - rows[7, i]
        rows[9, i] = l_t_rate
        rows[10, i] = activation_rate(
            tables.table[i, ACTIVATION],
            a[i],
            u[i],
            tables.table[i, TAU_A],
            tables.table[i, TAU_D],
            tables.table[i, SWITCH],
        )[0]


@kernel
def tendon_forces(tables, a, l_t, l, l_rate, F):
    """Write F (m,) [N], zero where the tendons are slack."""
    for i in range(a.size):
        F[i] = pull(tables, i, a[i], l_t[i], l[i], l_rate[i])[0]


@kernel
def rigid_active_forces(tables, l, l_rate, F):
    """Write what the fibres' active forces (m,) [N] along the tendon are with full activation and a
    tendon at its slack length; zero where the fibre would be shorter than its shortest."""
    for i in range(l.size):
        p = l[i] - tables.table[i, L_TS]
        F[i] = 0.0
        if p > tables.table[i, P_MIN]:
            l_m, per_cos, _ = fiber(tables, i, p)
            f_l = curve_at(tables, i, F_L, l_m * tables.table[i, PER_L_M0])[0]
            share = 1.0 if tables.table[i, ALONG] else per_cos
            v = l_rate[i] / (share * tables.table[i, V_M])
            f_v = curve_at(tables, i, F_V, v)[0]
            F[i] = tables.table[i, F_0] * f_l * f_v / per_cos


@kernel
def fiber_lengths(tables, l_t, l, l_m):
    """Write l_m (m,) [m]."""
    for i in range(l.size):
        l_m[i] = fiber(tables, i, max(l[i] - l_t[i], tables.table[i, P_MIN]))[0]


@kernel
def forces_and_fibers(tables, a, l_t, l, l_rate, F, l_m):
    """Write `tendon_forces` F and `fiber_lengths` l_m (k, m) of k states, (k, m) each."""
    for k in range(a.shape[0]):
        tendon_forces(tables, a[k], l_t[k], l[k], l_rate[k], F[k])
        fiber_lengths(tables, l_t[k], l[k], l_m[k])


def muscle_dynamics(
    muscles: MuscleSet,
    activation: ArrayLike,
    tendon_length: ArrayLike,
    length: ArrayLike,
    lengthening_speed: ArrayLike,
    excitation: ArrayLike | None = None,
) -> MuscleDynamics:
    """Forces, velocities and rates of m muscles at one instant.

    Parameters
    ----------
    muscles : MuscleSet
        m muscles.
    activation, tendon_length, length, lengthening_speed : (m,) array_like
        a between the minimum activation and 1, l_t [m], musculotendon length l [m] and l' [m/s].
        `tendon_length` gives l_t for fibre lengths; rigid tendons keep their slack length.
    excitation : (m,) array_like, optional
        u, for the activation rate.

    Returns
    -------
    MuscleDynamics

    Raises
    ------
    ParameterError
        An array does not fit the muscles, or an activation is outside its range.
    """
    a, l_t, l, l_rate = as_rows(
        muscles,
        activation=activation,
        tendon_length=tendon_length,
        length=length,
        lengthening_speed=lengthening_speed,
    )
    check_range("activation", a, muscles)
    l_t = muscles.with_rigid(l_t)
    u = np.full(a.size, np.nan)
    if excitation is not None:
        (u,) = as_rows(muscles, excitation=excitation)
    rows = np.empty((12, a.size))
    dynamics(muscles.tables, a, l_t, l, l_rate, u, rows)
    return MuscleDynamics(*rows)


def tendon_length(muscles: MuscleSet, fiber_length: ArrayLike, length: ArrayLike) -> np.ndarray:
    """l_t = l - sqrt(l_m^2 - w^2): tendon lengths (m,) [m] that go with fibre lengths.

    Parameters
    ----------
    muscles : MuscleSet
        m muscles.
    fiber_length, length : (m,) array_like
        l_m, at least the width w, and musculotendon length l [m].

    Returns
    -------
    (m,) ndarray
        [m]

    Raises
    ------
    ParameterError
        An array does not fit the muscles, or a fibre is shorter than its width.
    """
    l_m, l = as_rows(muscles, fiber_length=fiber_length, length=length)
    w = muscles.tables.table[:, WIDTH]
    for i in np.flatnonzero(l_m < w):
        raise ParameterError(
            f"muscle '{muscles.names[i]}': fiber_length = {l_m[i]:g} m is shorter than the fiber's "
            f"width of {w[i]:g} m"
        )
    return l - np.sqrt(l_m * l_m - w * w)
