"""The forces that would also have done: for every muscle the least and the largest force with which
the same torques can be met, and the activations that they take.

For every window two linear programs a muscle, min and max F_i subject to

    r^T F = r^T F_opt,    F_min <= F <= F_max,

solved by HiGHS, each from where the one before has ended.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import RecruitmentError
from ..model import MusculoskeletalModel
from ..muscle.window import Integrator
from ..recruitment.settings import RecruitmentSettings
from ..recruitment.windows import MuscleState, Windows, excite, open_window, reach_end
from ..results.trajectory import Trajectory
from .states import check_fits, geometries
from .table import Table, tabulated

# Of forces over max_isometric_force, and of torques over what a row's muscles can do together.
FEASIBLE = 1e-9
SAME_TIME = 1e-9  # s


def feasible_forces(model: MusculoskeletalModel, result: Trajectory) -> Table:
    """Ranges of the muscles' forces at the windows' ends.

    Ideal actuators keep the forces that they had, so that it is muscles alone that replace each
    other. The recruited forces lie within. Activations are those at the end of a window from the
    state that the result has at its start, with the excitation that leads to the force.

    Parameters
    ----------
    model : MusculoskeletalModel
    result : Trajectory
        Of this model, with windows.

    Returns
    -------
    Table
        `force_least/muscle`, `force_optimal/muscle`, `force_largest/muscle` [N], and likewise
        `activation_least`, `activation_optimal`, `activation_largest` [1], one row a window.

    Raises
    ------
    ParameterError
        The trajectory is of another model.
    RecruitmentError, WindowError
        No range, or no activation, was found in a window; names it.
    ImportError
        highspy is not installed (`pip install exudyn_muscles[analysis]`).
    """
    check_fits(model, result)
    names, ends = model.muscles.names, result.window_time[1:]
    F0 = model.muscles.max_isometric_force
    # The ends of the windows, the start of the first among them: there models are told apart.
    rows = np.searchsorted(result.time, result.window_time - SAME_TIME)
    at = geometries(model, result, rows)
    before: Any = next(at, None)
    least, largest = np.empty((2, ends.size, len(names)))
    activations = np.empty((3, ends.size, len(names)))
    windows = Windows(model.muscles, *_integration(result))
    u = np.array([model.muscles.minimum_activation, np.ones(len(names))])
    for k, (t, geometry) in enumerate(zip(ends, at, strict=True)):
        F, low, high = result.force_optimal[k], result.force_min[k], result.force_max[k]
        # Forces that a step really ended with may be off their limits by a window's tolerance.
        low, high = np.minimum(low, F), np.maximum(high, F)
        try:
            least[k], largest[k] = force_ranges(geometry.moment_arms, F, low, high, F0)
        except RecruitmentError as error:
            raise RecruitmentError(f"window that ends at t = {t:g} s: {error}") from error
        a, l_t = result.activations[rows[k]], result.tendon_lengths[rows[k]]
        state = MuscleState(a, l_t, before.length, before.lengthening_speed)
        window = open_window(windows, state, t - result.window_time[k], u)
        reach = reach_end(window, geometry.length, geometry.lengthening_speed)
        for each, force in zip(activations, (least[k], F, largest[k]), strict=True):
            each[k] = excite(reach, np.clip(force, reach.low, reach.high)).activation
        before = geometry
    parts = {
        "force_least": ("N", names, least),
        "force_optimal": ("N", names, result.force_optimal),
        "force_largest": ("N", names, largest),
        "activation_least": ("1", names, activations[0]),
        "activation_optimal": ("1", names, activations[1]),
        "activation_largest": ("1", names, activations[2]),
    }
    return tabulated("feasible forces", ends, parts)


def _integration(result: Trajectory) -> tuple[float, Integrator]:
    """Tolerance and integrator of the windows of a result, or the usual ones if it has none."""
    usual, given = RecruitmentSettings(), result.settings
    tolerance = given.get("window_tolerance", usual.window_tolerance)
    return tolerance, Integrator[given.get("integrator", usual.integrator.name)]


def force_ranges(
    r: np.ndarray, F: np.ndarray, low: np.ndarray, high: np.ndarray, size: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The least and the largest forces (m,) [N] between `low` and `high` (m,) that do the torques
    of `F` (m,) with the arms `r` (m, n); they are scaled by `size` (m,).

    Raises
    ------
    RecruitmentError
        The solver does not find them.
    """
    import highspy

    m, n = r.shape
    A = (r * size[:, None]).T  # (n, m) of x = F / size
    scale = np.abs(A).max(axis=1, initial=0.0)
    A, scale = A[scale > 0.0], scale[scale > 0.0]
    A = A / scale[:, None]
    b = A @ (F / size)
    solver = highspy.Highs()
    solver.setOptionValue("output_flag", False)
    for tolerance in ("primal_feasibility_tolerance", "dual_feasibility_tolerance"):
        solver.setOptionValue(tolerance, FEASIBLE)
    solver.setOptionValue("presolve", "off")  # which would begin anew every time
    solver.setOptionValue("threads", 1)
    solver.addVars(m, low / size, high / size)
    columns = np.arange(m, dtype=np.int32)
    for row, value in zip(A, b, strict=True):
        solver.addRow(value, value, m, columns, row)
    ranges = np.empty((2, m))
    for i in range(m):
        for side, sign in enumerate((1.0, -1.0)):
            solver.changeColCost(i, sign)
            solver.run()
            if solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
                status = solver.modelStatusToString(solver.getModelStatus())
                raise RecruitmentError(f"range of the force of muscle {i}: HiGHS says {status}")
            ranges[side, i] = sign * solver.getObjectiveValue() * size[i]
        solver.changeColCost(i, 0.0)
    return ranges[0], ranges[1]
