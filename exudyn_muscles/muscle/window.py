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
from .arguments import as_rows, check_range
from .course import MAX_STEPS
from .parameters import MuscleSet
from .rosenbrock import integrate_rosenbrock
from .trapezoidal import integrate_trapezoidal

TRAPEZOIDAL, ROSENBROCK = range(2)
DEFAULT_TOLERANCE = 1e-4


class Integrator(Enum):
    """Method of the window integration.

    TRAPEZOIDAL is the paper's, of order 2. ROSENBROCK (RODASP) is of order 4 and L-stable: faster
    at every tolerance, by far at small ones.
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
    if method == ROSENBROCK:
        return integrate_rosenbrock(
            tables, i, a, l_t, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, steps
        )
    return integrate_trapezoidal(
        tables, i, a, l_t, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, steps
    )


@kernel
def integrate_all(
    method, tables, a, l_t, u, l_0, v_0, l_1, v_1, h, tolerance, mesh, steps, end
):  # fmt: skip
    """Integrate all m muscles for each of the k rows of `u`.

    `mesh` (k, m, MAX_STEPS) and `steps` (k, m) as in `integrate`, or one mesh (k, 1, MAX_STEPS)
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
    integrator: Integrator = Integrator.TRAPEZOIDAL,
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
