"""Equilibrium of fibre and tendon, and the activation that a force asks for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..numerics.kernel import kernel
from .arguments import as_rows, check_range
from .contraction import fiber, fiber_force, pull, tendon
from .parameters import A_MIN, ALONG, F_0, L_TS, P_MIN, PER_L_M0, RIGID, V_M, MuscleSet

BISECTIONS = 100  # halves any bracket to the last bit
ROUNDING = 1e-12  # of forces over F0
SHORTEST_TENDON = 0.5  # no tendon shortens to this part of its slack length


@kernel(inline=True)
def along_tendon(tables, i, a, p, v):
    """Fibre force along the tendon over F0 at the projection `p`, its derivative [1/m], and
    cos(alpha)."""
    l_m, per_cos, cos_p = fiber(tables, i, p)
    cos = 1.0 / per_cos
    force, _, force_x, _ = fiber_force(tables, i, a, l_m * tables.table[i, PER_L_M0], v)
    stiffness = force_x * cos * cos * tables.table[i, PER_L_M0] + force * cos_p
    return force * cos, stiffness, cos


@kernel
def moving_fiber(tables, i, a, l, l_rate, p):
    """Fibre force along the tendon over F0 at the projection `p`, the fibre velocity [m/s] and the
    stiffnesses of tendon and fibre [F0/m].

    Of the unit's speed l' the fibre takes the share that its compliance at rest has in the unit's.
    """
    _, k_t = tendon(tables, i, l - p)
    _, k_m, cos = along_tendon(tables, i, a, p, 0.0)
    share = 0.0
    if tables.table[i, RIGID]:
        share = 1.0
    elif k_t > 0.0:
        share = k_t / (k_t + max(k_m, 0.0))
    speed = share * l_rate * cos
    v = l_rate if tables.table[i, ALONG] else speed
    force, k_m, _ = along_tendon(tables, i, a, p, v / tables.table[i, V_M])
    return force, speed, k_t, k_m


@kernel
def equilibrium_length(tables, i, a, l, l_rate):
    """Tendon length [m] at which fibre and tendon balance, by bisection."""
    if tables.table[i, RIGID]:
        return tables.table[i, L_TS]
    low = tables.table[i, P_MIN]
    high = max(l - SHORTEST_TENDON * tables.table[i, L_TS], low)
    for _ in range(BISECTIONS):
        p = 0.5 * (low + high)
        if tendon(tables, i, l - p)[0] > moving_fiber(tables, i, a, l, l_rate, p)[0]:
            low = p
        else:
            high = p
    return l - low


@kernel
def equilibria(tables, a, l, l_rate, rows):
    """Write the rows F, l_t, l_m, l_m', stiffness (5, m) of all muscles."""
    for i in range(a.size):
        l_t = equilibrium_length(tables, i, a[i], l[i], l_rate[i])
        p = max(l[i] - l_t, tables.table[i, P_MIN])
        l_m, per_cos, _ = fiber(tables, i, p)
        F, _, _, stiffness, _ = pull(tables, i, a[i], l_t, l[i], l_rate[i])
        speed = l_rate[i] / per_cos
        if not tables.table[i, RIGID]:
            _, speed, k_t, k_m = moving_fiber(tables, i, a[i], l[i], l_rate[i], p)
            taut = F > 0.0 and k_t > 0.0
            stiffness = tables.table[i, F_0] * k_t * k_m / (k_t + k_m) if taut else 0.0
        rows[0, i], rows[1, i], rows[2, i], rows[3, i], rows[4, i] = F, l_t, l_m, speed, stiffness


@kernel
def steady_activations(tables, F, l, l_rate, a):
    """Write activations (m,) whose equilibrium in motion is the force `F`, as far as allowed, by
    bisection."""
    for i in range(F.size):
        p = max(l[i] - tendon_length_at(tables, i, F[i]), tables.table[i, P_MIN])
        wanted = F[i] / tables.table[i, F_0]
        low, high = tables.table[i, A_MIN], 1.0
        # What the fibre cannot bear actively asks for no activation, or rounding would.
        if moving_fiber(tables, i, low, l[i], l_rate[i], p)[0] >= wanted - ROUNDING:
            high = low
        elif moving_fiber(tables, i, high, l[i], l_rate[i], p)[0] <= wanted:
            low = high
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            if moving_fiber(tables, i, middle, l[i], l_rate[i], p)[0] < wanted:
                low = middle
            else:
                high = middle
        a[i] = high


@kernel
def tendon_length_at(tables, i, F):
    """Longest tendon length [m] that bears no more than `F`."""
    l_ts = tables.table[i, L_TS]
    if tables.table[i, RIGID]:
        return l_ts
    low, high = SHORTEST_TENDON * l_ts, 2.0 * l_ts
    for _ in range(BISECTIONS):
        l_t = 0.5 * (low + high)
        if tables.table[i, F_0] * tendon(tables, i, l_t)[0] <= F:
            low = l_t
        else:
            high = l_t
    return low


class Equilibrium(NamedTuple):
    """MuscleTables whose fibre and tendon balance, (m,) each.

    Attributes
    ----------
    force : ndarray
        Tendon force F [N], zero where the tendon is slack.
    tendon_length, fiber_length : ndarray
        l_t and l_m [m].
    fiber_velocity : ndarray
        l_m' [m/s].
    stiffness : ndarray
        dF/dl [N/m] of fibre and tendon in series at fixed activation and velocity; zero where the
        tendon is slack.
    """

    force: np.ndarray
    tendon_length: np.ndarray
    fiber_length: np.ndarray
    fiber_velocity: np.ndarray
    stiffness: np.ndarray


def equilibrium(
    muscles: MuscleSet,
    activation: ArrayLike,
    length: ArrayLike,
    lengthening_speed: ArrayLike | None = None,
) -> Equilibrium:
    """Balance of fibre and tendon at given activations and musculotendon lengths.

    Parameters
    ----------
    muscles : MuscleSet
        m muscles.
    activation : (m,) array_like
        Activations between the minimum activation and 1.
    length : (m,) array_like
        Musculotendon lengths l [m].
    lengthening_speed : (m,) array_like, optional
        l' [m/s]; left out, the fibres rest: the steady state of (4). In a moving unit fibre and
        tendon share l' by their compliances, as in OpenSim's `computeEquilibrium`. At the kinks of
        Thelen's curves the shares jump, and a unit may balance on neither side; of `Schutte1993` a
        fibre whose share is faster than it shortens without load bears f_PE alone.

    Returns
    -------
    Equilibrium
        Where the path is too short to be taut, the fibre has its shortest length and the tendon is
        slack: it does not push, whatever its curve says of such lengths. Of several equilibria (on
        the descending limb of f_l) the one with the longest fibre that bisection meets.

    Raises
    ------
    ParameterError
        An array does not fit the muscles, or an activation is outside its range.

    Examples
    --------
    >>> import exudyn_muscles as em
    >>> unit = em.Muscle("unit", max_isometric_force=1000, optimal_fiber_length=0.1,
    ...                  tendon_slack_length=0.2)
    >>> em.equilibrium(em.MuscleSet([unit]), [1.0], [0.3]).force.round(1)
    array([950.8])
    """
    at_rest = np.zeros(len(muscles))
    a, l, l_rate = as_rows(
        muscles,
        activation=activation,
        length=length,
        lengthening_speed=at_rest if lengthening_speed is None else lengthening_speed,
    )
    check_range("activation", a, muscles)
    rows = np.empty((5, a.size))
    equilibria(muscles.tables, a, l, l_rate, rows)
    return Equilibrium(*rows)
