"""Integration of the muscle equations (4), (5) over a time window with the excitation held.

Two methods: the adaptive trapezoidal rule, as in the paper, and an L-stable Rosenbrock method of
order 4, which needs fewer evaluations for the same accuracy.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..checks import number_within
from ..errors import ParameterError, WindowError
from ..numerics.kernel import kernel
from . import rosenbrock, trapezoidal
from .activation import activation_rate
from .arguments import as_rows, check_range
from .contraction import drift, stopped_rate, tendon_force
from .course import MAX_STEPS, cubic, length_at, next_end, sensitivity
from .parameters import (
    ACTIVATION,
    LEAST_ACTIVATION,
    PER_L_M0,
    SWITCH,
    TAU_A,
    TAU_D,
    MuscleSet,
)  # fmt: skip
from .rosenbrock import FEWEST, LEAST, MEMORY
from .trapezoidal import LONGEST

TRAPEZOIDAL, ROSENBROCK = range(2)
DEFAULT_TOLERANCE = 1e-4
# Shortest step over the window. Weak fibres under high force have time constants of 1e-12 s, and
# what is shorter than rounding of 1 s is no step.
SHORTEST = 1e-18
# A mesh that is used again serves as long as no step's error is this many times what was allowed.
REUSE = 10.0
# Half of the difference of lengths by which slopes are found, over the optimal fibre length: far
# above rounding, far below what bends the force's curve.
STRETCH = 1e-4


class Integrator(Enum):
    """Method of the window integration.

    ROSENBROCK (RODASP), the default, is of order 4 and L-stable. TRAPEZOIDAL is the paper's, of
    order 2: slower at every tolerance, by far at small ones.
    """

    TRAPEZOIDAL = TRAPEZOIDAL
    ROSENBROCK = ROSENBROCK


@kernel
def integrate(method, tables, i, a, l_t, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, steps):
    """Integrate muscle `i` over a window of length `h`.

    Musculotendon length is the cubic through both ends' lengths and velocities. `steps` = 0 chooses
    the steps and writes their ends into `mesh`; otherwise the `steps` ends in `mesh` are used
    again, which makes the result a smooth function of all arguments.

    Returns (steps, a, l_t, F, dF/du), with steps = -1 if the window could not be integrated.
    """
    law, b = tables.table[i, ACTIVATION], tables.table[i, SWITCH]
    tau_a, tau_d = tables.table[i, TAU_A], tables.table[i, TAU_D]
    c = cubic(l_0, v_0, l_1, v_1, h)
    chosen = steps == 0
    t, n, a_u, y_u = 0.0, 0, 0.0, 0.0
    start = stopped_rate(tables, i, a, l_t, l_0, v_0)
    rate_a, f_a, f_u = activation_rate(law, a, u, tau_a, tau_d, b)
    moved = drift(tables, i, start[4], v_0, length_at(c, 0.0)[2])
    second = start[2] * rate_a + start[3] * start[1] + moved  # l_t''
    if method == ROSENBROCK:
        growth = abs(rate_a) / max(a, LEAST_ACTIVATION)
        h_n = rosenbrock.first_step(tables, i, start, second, growth, h, tolerance)
        longest = h / FEWEST
    else:
        h_n, longest = trapezoidal.first_step(tables, i, start, second, h, tolerance), LONGEST
    h_p, constant, factor = 0.0, 0.0, 1.0  # the step before, its error over h^4, what comes next
    expected = 0.0
    for _ in range(4 * MAX_STEPS):
        end = next_end(t, min(h_n, longest), h) if chosen else mesh[n]
        h_n = end - t  # from the mesh: using it again gives the same bits
        l, v, _ = length_at(c, end)
        if method == ROSENBROCK:
            start_1, allowed = start, 1.0
            a_1, l_t1, error = rosenbrock.window_step(
                tables, i, a, u, l_t, start, f_a, c, t, h_n, h, tolerance
            )
            if chosen:
                fourth = (h_n * h_n) * (h_n * h_n)
                error = max(error, MEMORY * constant * fourth)
                expected = max(error, LEAST) / fourth
                factor = rosenbrock.step_factor(error, constant / expected if n else 1.0)
        else:
            a_1, l_t1, start_1, error, allowed = trapezoidal.window_step(
                tables, i, a, u, l_t, start, second, h_p, l, v, h_n, h, tolerance
            )
            if chosen:
                factor = trapezoidal.step_factor(error, allowed)
        if not error <= (allowed if chosen else REUSE * allowed):
            h_n *= factor
            if not chosen or h_n < SHORTEST * h:
                break
            continue
        if chosen:
            if n == mesh.size:
                break
            mesh[n] = end
        if method == ROSENBROCK:
            start_1 = stopped_rate(tables, i, a_1, l_t1, l, v)
            constant = expected
        _, f_a1, f_u1 = activation_rate(law, a_1, u, tau_a, tau_d, b)
        a_u1 = sensitivity(a_u, f_a, f_a1, f_u, f_u1, h_n)
        y_u = sensitivity(y_u, start[3], start_1[3], start[2] * a_u, start_1[2] * a_u1, h_n)
        second, h_p = (start_1[1] - start[1]) / h_n, h_n
        a, l_t, start, a_u, f_a, f_u = a_1, l_t1, start_1, a_u1, f_a1, f_u1
        t = end
        n += 1
        if (chosen and end == h) or n == steps:
            F, F_a, F_t, _, _ = tendon_force(tables, i, a, l_t, l, v)
            return n, a, l_t, F, F_t * y_u + F_a * a_u
        h_n *= factor
    return -1, a, l_t, 0.0, 0.0


@kernel
def integrate_all(
    method, tables, a, l_t, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, steps, end
):  # fmt: skip
    """Integrate all m muscles for each of the k rows of `u`.

    `mesh` (k, m, s) and `steps` (k, m) as in `integrate`, or one mesh (k, 1, s)
    that nobody uses again; `end` (4, k, m) receives a, l_t, F and dF/du. Returns the first muscle
    that failed, or -1.
    """
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            for _ in range(2):
                n, a_1, l_t1, F, F_u = integrate(
                    method, tables, i, a[i], l_t[i], u[k, i], l_0[i], v_0[i], l_1[i], v_1[i], h,
                    tolerance, mesh[k, min(i, mesh.shape[1] - 1)], steps[k, i],
                )  # fmt: skip
                if n > 0 or steps[k, i] == 0:
                    break
                steps[k, i] = 0  # the old steps no longer fit: choose anew
            if n < 0:
                return i
            steps[k, i] = n
            end[0, k, i], end[1, k, i], end[2, k, i], end[3, k, i] = a_1, l_t1, F, F_u
    return -1


@kernel
def length_slopes(method, tables, a, l_t, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, slopes):
    """Write how the forces (m,) at the window's end change with the lengths `l_1` there, while the
    excitations `u` (m,) and all speeds stay [N/m].

    Of a muscle whose steps fit one of the lengths and not the other nothing is known: zero. `mesh`
    is scratch of MAX_STEPS. Returns the first muscle that failed, or -1.
    """
    for i in range(u.size):
        d = STRETCH / tables.table[i, PER_L_M0]
        n, _, _, high, _ = integrate(
            method, tables, i, a[i], l_t[i], u[i], l_0[i], v_0[i], l_1[i] + d, v_1[i], h,
            tolerance, mesh, 0,
        )  # fmt: skip
        if n < 0:
            return i
        n, _, _, low, _ = integrate(
            method, tables, i, a[i], l_t[i], u[i], l_0[i], v_0[i], l_1[i] - d, v_1[i], h,
            tolerance, mesh, n,
        )  # fmt: skip
        slopes[i] = 0.0 if n < 0 else (max(high, 0.0) - max(low, 0.0)) / (2.0 * d)
    return -1


class WindowEnd(NamedTuple):
    """State of m muscles at the end of a window, each (m,).

    Attributes
    ----------
    activation, tendon_length, force : ndarray
        a, l_t [m] and F [N], zero where the tendon is slack.
    sensitivity : ndarray
        dF/du [N], good to some per cent of it and of F0 together; of a slack tendon that of its
        curve.
    steps : ndarray
        Number of steps taken.
    """

    activation: np.ndarray
    tendon_length: np.ndarray
    force: np.ndarray
    sensitivity: np.ndarray
    steps: np.ndarray


def integrate_window(
    muscles: MuscleSet,
    activation: ArrayLike,
    tendon_length: ArrayLike,
    excitation: ArrayLike,
    length: tuple[ArrayLike, ArrayLike],
    lengthening_speed: tuple[ArrayLike, ArrayLike],
    window: float,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    integrator: Integrator = Integrator.ROSENBROCK,
) -> WindowEnd:
    """Integrate the muscle equations (4), (5) over one window with held excitations.

    Musculotendon length runs through the window as the cubic given by the lengths and speeds at
    both ends, as in section 4 of the paper.

    Parameters
    ----------
    muscles : MuscleSet
        m muscles.
    activation, tendon_length, excitation : (m,) array_like
        a and l_t [m] at the start, and u; a and u between the minimum activation and 1.
    length, lengthening_speed : pair of (m,) array_like
        l [m] and l' [m/s] at the start and at the end.
    window : float
        Length of the window [s], at most 1.
    tolerance : float
        Allowed error of the force at the end over the maximum isometric force.
    integrator : Integrator

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
    window = number_within("window", window, 1e-9, 1.0, "s")
    tolerance = check_integration(tolerance, integrator)
    ends = {"length": length, "lengthening_speed": lengthening_speed}
    for name, pair in ends.items():
        if not isinstance(pair, (tuple, list)) or len(pair) != 2:
            raise ParameterError(
                f"{name} must be a pair, at the start and at the end, got {pair!r}"
            )
    a, l_t, u, l_0, l_1, v_0, v_1 = as_rows(
        muscles,
        activation=activation,
        tendon_length=tendon_length,
        excitation=excitation,
        length_at_start=length[0],
        length_at_end=length[1],
        speed_at_start=lengthening_speed[0],
        speed_at_end=lengthening_speed[1],
    )
    for name, values in (("activation", a), ("excitation", u)):
        check_range(name, values, muscles)
    l_t = muscles.with_rigid(l_t)
    m = len(muscles)
    mesh, steps = np.empty((1, 1, MAX_STEPS)), np.zeros((1, m), dtype=np.int64)
    end = np.empty((4, 1, m))
    failed = integrate_all(
        integrator.value, muscles.tables, a, l_t, u[None], l_0, v_0, l_1, v_1, window, tolerance,
        mesh, steps, end,
    )  # fmt: skip
    check_window(failed, muscles, a, l_t, l_0, v_0, window)
    return WindowEnd(end[0, 0], end[1, 0], np.maximum(end[2, 0], 0.0), end[3, 0], steps[0])


def check_integration(tolerance: float, integrator: Integrator) -> float:
    """The tolerance; ParameterError if it is outside [1e-6, 1e-2] or the integrator unknown."""
    tolerance = number_within("tolerance", tolerance, 1e-6, 1e-2)
    if not isinstance(integrator, Integrator):
        raise ParameterError(f"integrator = {integrator!r} is not one of {list(Integrator)}")
    return tolerance


def check_window(
    failed: int, muscles: MuscleSet, a: np.ndarray, l_t: np.ndarray, l: np.ndarray, v: np.ndarray,
    h: float,
) -> None:  # fmt: skip
    """Raise an error that names muscle `failed` and its state, if there is one."""
    if failed >= 0:
        raise WindowError(
            f"muscle '{muscles.names[failed]}': the equations could not be integrated over "
            f"{h:g} s from activation {a[failed]:.4g}, tendon length {l_t[failed]:.5g} m, "
            f"length {l[failed]:.5g} m, lengthening speed {v[failed]:.4g} m/s"
        )
