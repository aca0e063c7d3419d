"""Integration of one muscle's equations (4), (5) over a time window with the excitation held.

The rule is the implicit trapezoidal one, as the paper's ode23t:

    F_1 = F_0 + h/2 (f_F(a_0, F_0, l_0, l_0') + f_F(a_1, F_1, l_1, l_1')).

Activation does not depend on force, so that one scalar equation remains for every muscle. Two uses:
`integrate` takes as many steps as its tolerance asks for, with the exact a(t); `step` takes one
step for a and F together, as a monolithic integrator of skeleton and muscles does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..checks import number_within
from ..errors import WindowError
from ..kernel import kernel
from .activation import held, time_constant, trapezoidal
from .contraction import as_rows, check_range, force_rate
from .parameters import F_0, TAU_A, TAU_D, MuscleSet

MAX_STEPS = 10000  # of one window; at 1e-4 the worst states of the allowed box need some 500
NEWTON = 12  # iterations of one step; two or three are usual
CONVERGED = 1e-9  # last Newton correction over F0: the next one would be below 1e-16
DEFAULT_TOLERANCE = 1e-4

# Part of the tolerance that one time constant's steps may use up together; set so that the force at
# the end of the window meets the tolerance over the whole box of states that
# tests/muscle/test_window.py draws from.
SHARE = 0.25
# Longest step [s], a thirtieth of the activation time constant: a longer one may straddle a change
# that the error estimate, made from the slopes at its ends, does not see (one window in 500 of that
# box exceeded the tolerance).
LONGEST = 5e-4
# Shortest step over the window. Weak fibres under high force have time constants of 1e-9 s, and a
# kink (the shortest fibre) takes a small part of that.
SHORTEST = 1e-15


@kernel
def implicit_step(table, i, F, rate, a_1, l_1, v_1, h, guess):
    """Solve one trapezoidal step from `F` with slope `rate`; converged, F_1 and f_F's partials."""
    F0 = table[F_0, i]
    F_1 = guess
    for _ in range(NEWTON):
        r, da, dF, dl, dv = force_rate(table, i, a_1, F_1, l_1, v_1)
        gradient = 1.0 - 0.5 * h * dF
        if not gradient > 0.0:
            return False, F_1, r, da, dF, dl, dv
        correction = (F + 0.5 * h * (rate + r) - F_1) / gradient
        correction = min(max(correction, -F0), F0)
        F_1 += correction
        if abs(correction) < CONVERGED * F0:
            return True, F_1, r + dF * correction, da, dF, dl, dv
    return False, F_1, r, da, dF, dl, dv


@kernel
def integrate(table, i, a_0, F, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, steps):
    """Integrate muscle `i` over a window of length `h`.

    Musculotendon length is the cubic through both ends' lengths and velocities. `steps` = 0 chooses
    the steps and writes their ends into `mesh`; otherwise the `steps` ends in `mesh` are used
    again, which makes the result a smooth function of all arguments.

    Returns (steps, a, F, dF/du), with steps = -1 if the window could not be integrated.
    """
    F0 = table[F_0, i]
    tau = time_constant(a_0, u, table[TAU_A, i], table[TAU_D, i])
    c_2 = 3.0 * (l_1 - l_0) - h * (2.0 * v_0 + v_1)
    c_3 = h * (v_0 + v_1) - 2.0 * (l_1 - l_0)
    allowed = SHARE * tolerance * F0

    chosen = steps == 0
    a, a_t, a_u = held(a_0, u, tau, 0.0)
    r, r_a, r_F, r_l, r_v = force_rate(table, i, a, F, l_0, v_0)
    # y'' at the start serves the first error estimate and the first step.
    r_t = r_a * a_t + r_F * r + r_l * v_0 + r_v * 2.0 * c_2 / (h * h)
    rate_p, h_p = 0.0, 0.0
    F_u = 0.0
    t = 0.0
    n = 0
    if chosen:
        h_n = min(h, np.cbrt(12.0 * allowed / (abs(r_t) * (abs(r_F) + 1.0 / h) + 1e-300)))
    else:
        h_n = mesh[0]
    for _ in range(4 * MAX_STEPS):
        if chosen:
            rest = h - t
            h_n = min(h_n, LONGEST)
            if h_n > 0.999 * rest:
                h_n = rest
            elif h_n > 0.5 * rest:
                h_n = 0.5 * rest
            end = h if h_n == rest else t + h_n
        else:
            end = mesh[n]
        h_n = end - t  # from the mesh: using it again gives the same bits
        s = end / h
        a_1, _, a_u1 = held(a_0, u, tau, end)
        l = l_0 + s * (h * v_0 + s * (c_2 + s * c_3))
        v = v_0 + s * (2.0 * c_2 + 3.0 * s * c_3) / h
        guess = F + h_n * (r + 0.5 * h_n * r_t)
        guess = min(max(guess, F - 0.5 * F0), F + 0.5 * F0)
        converged, F_1, q, q_a, q_F, q_l, q_v = implicit_step(table, i, F, r, a_1, l, v, h_n, guess)
        if chosen:
            # Local error h^3 y'''/12, y''' from divided differences of the slopes; the factor
            # (1 - h/2 df/dF)^-1 keeps fast components from being overrated.
            if n == 0:
                third = 2.0 * ((q - r) / h_n - r_t) / h_n
            else:
                third = 2.0 * ((q - r) / h_n - (r - rate_p) / h_p) / (h_n + h_p)
            error = abs(third) * h_n * h_n * h_n / 12.0 / (1.0 + 0.5 * h_n * abs(q_F))
            # Errors older than the time constant 1/|df/dF| have decayed by the window's end, so
            # that one time constant's (or the window's) steps share the tolerance.
            allowed = SHARE * tolerance * F0 * min(h_n * max(abs(q_F), 1.0 / h), 1.0)
            if not converged or not error <= allowed:
                shrink = 0.25
                if converged and error < 1e6 * allowed:
                    shrink = max(0.8 * np.cbrt(allowed / error), 0.1)
                h_n *= shrink
                if h_n < SHORTEST * h:
                    return -1, a, F, F_u
                continue
        elif not converged:
            return -1, a, F, F_u
        F_u = ((1.0 + 0.5 * h_n * r_F) * F_u + 0.5 * h_n * (r_a * a_u + q_a * a_u1)) / (
            1.0 - 0.5 * h_n * q_F
        )
        rate_p, h_p = r, h_n
        a, a_u, F, t = a_1, a_u1, F_1, end
        r_t = (q - r) / h_n
        r, r_a, r_F = q, q_a, q_F
        if chosen:
            mesh[n] = end
        n += 1
        if (chosen and end == h) or n == steps:
            return n, a, F, F_u
        if chosen:
            if n == MAX_STEPS:
                return -1, a, F, F_u
            h_n *= min(0.85 * np.cbrt(allowed / (error + 1e-300)), 4.0)
    return -1, a, F, F_u


@kernel
def integrate_all(table, a, F, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, steps, end):
    """Integrate all m muscles for each of the k rows of `u`.

    `mesh` (k, m, MAX_STEPS) and `steps` (k, m) as in `integrate`; `end` (3, k, m) receives a, F and
    dF/du. Returns the first muscle that failed, or -1.
    """
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            for _ in range(2):
                n, a_1, F_1, F_u = integrate(
                    table, i, a[i], F[i], u[k, i], l_0[i], v_0[i], l_1[i], v_1[i], h, tolerance,
                    mesh[k, i], steps[k, i],
                )  # fmt: skip
                if n > 0 or steps[k, i] == 0:
                    break
                steps[k, i] = 0  # the old steps no longer fit: choose anew
            if n < 0:
                return i
            steps[k, i] = n
            end[0, k, i] = a_1
            end[1, k, i] = F_1
            end[2, k, i] = F_u
    return -1


@kernel
def step(table, i, a_0, F, u, l_0, v_0, l_1, v_1, h):
    """One trapezoidal step of a and F.

    Returns (converged, a_1, F_1, dF_1/dl_1, dF_1/dl_1').
    """
    tau = time_constant(a_0, u, table[TAU_A, i], table[TAU_D, i])
    a_1 = trapezoidal(a_0, u, tau, h)
    r, _, dF, _, _ = force_rate(table, i, a_0, F, l_0, v_0)
    guess = F + h * r / (1.0 - min(h * dF, 0.0))
    converged, F_1, _, _, dF, dl, dv = implicit_step(table, i, F, r, a_1, l_1, v_1, h, guess)
    if not converged:
        converged, F_1, dF, dl, dv = bisect_step(table, i, F, r, a_1, l_1, v_1, h)
    gain = 0.5 * h / (1.0 - 0.5 * h * dF)
    return converged, a_1, F_1, gain * dl, gain * dv


@kernel
def bisect_step(table, i, F, rate, a_1, l_1, v_1, h):
    """The same equation as `implicit_step` by bisection, for steps that are long for the muscle."""
    F0 = table[F_0, i]
    low, high = -F0, 20.0 * F0
    dF, dl, dv = 0.0, 0.0, 0.0
    for _ in range(60):
        F_1 = 0.5 * (low + high)
        r, _, dF, dl, dv = force_rate(table, i, a_1, F_1, l_1, v_1)
        if F + 0.5 * h * (rate + r) > F_1:
            low = F_1
        else:
            high = F_1
    return high < 20.0 * F0 and low > -F0, F_1, dF, dl, dv


class WindowEnd(NamedTuple):
    """State of m muscles at the end of a window, each (m,).

    `sensitivity` is dF/du [N], `steps` the number of trapezoidal steps taken.
    """

    activation: np.ndarray
    force: np.ndarray
    sensitivity: np.ndarray
    steps: np.ndarray


def integrate_window(
    muscles: MuscleSet,
    activation: ArrayLike,
    force: ArrayLike,
    excitation: ArrayLike,
    length: tuple[ArrayLike, ArrayLike],
    lengthening_speed: tuple[ArrayLike, ArrayLike],
    window: float,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
) -> WindowEnd:
    """Integrate the muscle equations (4), (5) over one window with held excitations.

    Musculotendon length runs through the window as the cubic given by the lengths and speeds at
    both ends, as in section 4 of the paper.

    Parameters
    ----------
    muscles : MuscleSet
        m muscles.
    activation, force, excitation : (m,) array_like
        a and F [N] at the start, and u; a and u between the minimum activation and 1.
    length, lengthening_speed : pair of (m,) array_like
        l [m] and l' [m/s] at the start and at the end.
    window : float
        Length of the window [s], at most 1.
    tolerance : float
        Allowed error of the force at the end over the maximum isometric force.

    Returns
    -------
    WindowEnd

    Raises
    ------
    ParameterError
        An array does not fit the muscles or is not finite, the window is not positive, or the
        tolerance is outside its range.
    WindowError
        A muscle's equations could not be integrated; names it.
    """
    number_within("window", window, 1e-9, 1.0, "s")
    check_tolerance(tolerance)
    a, F, u, l_0, l_1, v_0, v_1 = as_rows(
        muscles,
        activation=activation,
        force=force,
        excitation=excitation,
        length_at_start=length[0],
        length_at_end=length[1],
        speed_at_start=lengthening_speed[0],
        speed_at_end=lengthening_speed[1],
    )
    for name, values in (("activation", a), ("excitation", u)):
        check_range(name, values, muscles)
    m = len(muscles)
    mesh, steps = np.empty((1, m, MAX_STEPS)), np.zeros((1, m), dtype=np.int64)
    end = np.empty((3, 1, m))
    failed = integrate_all(
        muscles.table, a, F, u[None], l_0, v_0, l_1, v_1, window, tolerance, mesh, steps, end
    )
    check_window(failed, muscles, a, F, l_0, v_0, window)
    return WindowEnd(end[0, 0], end[1, 0], end[2, 0], steps[0])


def check_tolerance(tolerance: float) -> None:
    """Raise ParameterError for a window tolerance outside [1e-6, 1e-2]."""
    number_within("tolerance", tolerance, 1e-6, 1e-2)


def check_window(
    failed: int, muscles: MuscleSet, a: np.ndarray, F: np.ndarray, l: np.ndarray, v: np.ndarray,
    h: float,
) -> None:  # fmt: skip
    """Raise an error that names muscle `failed` and its state, if there is one."""
    if failed >= 0:
        raise WindowError(
            f"muscle '{muscles.names[failed]}': the equations could not be integrated over "
            f"{h:g} s from activation {a[failed]:.4g}, force {F[failed]:.4g} N, "
            f"length {l[failed]:.5g} m, lengthening speed {v[failed]:.4g} m/s"
        )
