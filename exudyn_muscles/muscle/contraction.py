"""Contraction dynamics (4), F' = f_F(a, F, l, l'), of a Hill unit with constant width.

With f = F / F0, the tendon length l_t = l_ts x_SE(f), the fibre's projection p = l - l_t on the
tendon, the fibre length l_m = sqrt(p^2 + w^2), w = l_m0 sin(alpha_0), cos(alpha) = p / l_m and
V = v_max l_m0:

    v   = f_v^-1((f / cos(alpha) - f_PE) / (a f_l))
    f_F = F0 / (l_ts dx_SE/df) (l' - V v / cos(alpha))

Near its shortest length the fibre's shortening dies out; a path that is shorter still leaves the
tendon slack. The fibre velocity l_m' = V v is divided by cos(alpha), not multiplied: the pennation
angle changes with the fibre length. Tension and lengthening are positive.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError
from ..kernel import kernel
from .curves import (
    C3,
    SLACK_TANGENT,
    active_force_length,
    inverse_force_velocity,
    passive_force_length,
    tendon_force,
    tendon_length,
)
from .parameters import (
    A_MIN,
    F_0,
    K_T,
    L_M0,
    L_TS,
    P_MIN,
    V_M,
    WIDTH,
    MuscleSet,
)

# The fibre slows down over this part of its optimal length before it stops at its shortest length:
# a sudden stop has no implicit step across it.
STOP = 0.01
BISECTIONS = 60  # halves the bracket to the last bit


@kernel
def fiber(table, i, F, l):
    """Projection p, fibre length l_m, dp/dF, dp/dl and dF/dl_t at tension `F` and length `l`.

    Below the shortest fibre p is held and its derivatives are zero.
    """
    x_t, slope = tendon_length(F / table[F_0, i], table[K_T, i])
    p = l - table[L_TS, i] * x_t
    stiffness = table[F_0, i] / (table[L_TS, i] * slope)
    dp_dF = -1.0 / stiffness
    dp_dl = 1.0
    if p < table[P_MIN, i]:
        p = table[P_MIN, i]
        dp_dF = 0.0
        dp_dl = 0.0
    l_m = math.sqrt(p * p + table[WIDTH, i] * table[WIDTH, i])
    return p, l_m, dp_dF, dp_dl, stiffness


@kernel
def force_rate(table, i, a, F, l, v):
    """f_F [N/s] and its derivatives with respect to a, F, l and l' at length `l`, velocity `v`."""
    F0 = table[F_0, i]
    f = F / F0
    p, l_m, dp_dF, dp_dl, stiffness = fiber(table, i, F, l)
    cos = p / l_m
    dcos_dp = table[WIDTH, i] * table[WIDTH, i] / (l_m * l_m * l_m)
    dx_dp = cos / table[L_M0, i]
    f_l, df_l = active_force_length(l_m / table[L_M0, i])
    f_PE, df_PE = passive_force_length(l_m / table[L_M0, i])

    capacity = 1.0 / (a * f_l)
    multiplier = (f / cos - f_PE) * capacity
    dm_dp = (-f / (cos * cos) * dcos_dp - df_PE * dx_dp - multiplier * a * df_l * dx_dp) * capacity
    v_m, dv_m = inverse_force_velocity(multiplier)
    dv_dp = dv_m * dm_dp
    room = p - table[P_MIN, i]
    if v_m < 0.0 and room < STOP * table[L_M0, i]:
        share = room / (STOP * table[L_M0, i])
        dv_dp = share * dv_dp + v_m / (STOP * table[L_M0, i])
        v_m, dv_m = share * v_m, share * dv_m

    V = table[V_M, i]
    stretch = v - V * v_m / cos
    drate_dp = -stiffness * V * (dv_dp - v_m / cos * dcos_dp) / cos
    # d(dF/dl_t)/dF: k_T / l_ts on the exponential, zero on its tangent.
    dstiffness = table[K_T, i] / table[L_TS, i] if f + C3 >= SLACK_TANGENT else 0.0
    dF = (
        dstiffness * stretch - stiffness * V * dv_m * capacity / (F0 * cos * cos) + drate_dp * dp_dF
    )
    da = stiffness * V * dv_m * multiplier / (a * cos)
    return stiffness * stretch, da, dF, drate_dp * dp_dl, stiffness


@kernel
def isometric_force(table, i, a, p):
    """Force of the resting fibre along the tendon, over F0, at the projection `p`."""
    l_m = math.sqrt(p * p + table[WIDTH, i] * table[WIDTH, i])
    x = l_m / table[L_M0, i]
    return (a * active_force_length(x)[0] + passive_force_length(x)[0]) * p / l_m


@kernel
def equilibrium_force(table, i, a, l):
    """Tension [N] at which the resting fibre and the tendon balance, by bisection in p."""
    F0, l_ts, k_T = table[F_0, i], table[L_TS, i], table[K_T, i]
    low = table[P_MIN, i]
    high = max(l - 0.5 * l_ts, low)  # the tendon never shortens to half its slack length
    for _ in range(BISECTIONS):
        p = 0.5 * (low + high)
        if tendon_force((l - p) / l_ts, k_T)[0] > isometric_force(table, i, a, p):
            low = p
        else:
            high = p
    return F0 * tendon_force((l - low) / l_ts, k_T)[0]


@kernel
def equilibrium_forces(table, a, l):
    """`equilibrium_force` of all m muscles (m,) [N]."""
    F = np.empty(a.size)
    for i in range(a.size):
        F[i] = equilibrium_force(table, i, a[i], l[i])
    return F


@kernel
def steady_activations(table, F, l):
    """Activations (m,) whose equilibrium is the force `F`, as far as they are allowed."""
    a = np.empty(F.size)
    for i in range(F.size):
        p, l_m, _, _, _ = fiber(table, i, F[i], l[i])
        x = l_m / table[L_M0, i]
        active = F[i] / table[F_0, i] * l_m / p - passive_force_length(x)[0]
        a[i] = min(max(active / active_force_length(x)[0], table[A_MIN, i]), 1.0)
    return a


@kernel
def fiber_lengths(table, F, l):
    """Fibre lengths l_m (m,) [m] at the forces `F` and lengths `l`."""
    l_m = np.empty(F.size)
    for i in range(F.size):
        l_m[i] = fiber(table, i, F[i], l[i])[1]
    return l_m


def equilibrium(muscles: MuscleSet, activation: ArrayLike, length: ArrayLike) -> np.ndarray:
    """Tendon force of resting muscles, where fibre and tendon balance.

    Parameters
    ----------
    muscles : MuscleSet
        m muscles.
    activation : (m,) array_like
        Activations between the minimum activation and 1.
    length : (m,) array_like
        Musculotendon lengths [m].

    Returns
    -------
    (m,) ndarray
        Tendon forces [N]: the steady state of (4) with constant length. Where the musculotendon
        unit is too short to be taut the value is below zero: the tendon is slack.

    Examples
    --------
    >>> import exudyn_muscles as em
    >>> unit = em.Muscle("unit", max_isometric_force=1000, optimal_fiber_length=0.1,
    ...                  tendon_slack_length=0.2)
    >>> em.equilibrium(em.MuscleSet([unit]), [1.0], [0.3]).round(1)
    array([950.8])
    """
    a, l = as_rows(muscles, activation=activation, length=length)
    check_range("activation", a, muscles)
    return equilibrium_forces(muscles.table, a, l)


def contraction_rate(
    muscles: MuscleSet,
    activation: ArrayLike,
    force: ArrayLike,
    length: ArrayLike,
    lengthening_speed: ArrayLike,
) -> np.ndarray:
    """f_F of (4) and its derivatives.

    Parameters
    ----------
    muscles : MuscleSet
        m muscles.
    activation, force, length, lengthening_speed : (m,) array_like
        a between the minimum activation and 1, tendon force F [N], musculotendon length l [m] and
        l' [m/s].

    Returns
    -------
    (m, 5) ndarray
        Columns F' [N/s], dF'/da, dF'/dF, dF'/dl, dF'/dl'.
    """
    a, F, l, v = as_rows(
        muscles,
        activation=activation,
        force=force,
        length=length,
        lengthening_speed=lengthening_speed,
    )
    check_range("activation", a, muscles)
    return np.array([force_rate(muscles.table, i, a[i], F[i], l[i], v[i]) for i in range(a.size)])


def as_rows(muscles: MuscleSet, **arrays: ArrayLike) -> list[np.ndarray]:
    """Contiguous float copies, one value a muscle each."""
    rows = []
    for name, values in arrays.items():
        try:
            row = np.array(values, dtype=float)
        except (TypeError, ValueError):
            row = np.array(np.nan)
        if row.shape != (len(muscles),) or not np.isfinite(row).all():
            raise ParameterError(
                f"{name}: expected {len(muscles)} finite values, one a muscle, got {values!r}"
            )
        rows.append(row)
    return rows


def check_range(name: str, values: np.ndarray, muscles: MuscleSet) -> None:
    """Raise ParameterError for an activation or excitation below the minimum or above 1."""
    low = muscles.minimum_activation
    for i in np.flatnonzero((values < low - 1e-12) | (values > 1.0 + 1e-12)):
        raise ParameterError(
            f"muscle '{muscles.names[i]}': {name} {values[i]:g} is outside [{low[i]:g}, 1]"
        )
