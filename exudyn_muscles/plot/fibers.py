"""Figure of a muscle: the force of its fibre over length and velocity, and a motion in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..checks import number_within
from ..errors import ParameterError
from ..muscle.contraction import fiber_force
from ..muscle.parameters import Muscle, MuscleSet
from ..results.trajectory import Trajectory
from .laws import LENGTHS, VELOCITIES
from .panels import PAGE_WIDTH
from .styles import ALONE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GRID = 201
LEVELS = np.arange(0.0, 2.01, 0.1)


def muscle(
    unit: Muscle,
    trajectory: Trajectory | None = None,
    *,
    activation: float = 1.0,
    axes: Axes | None = None,
) -> Axes:
    """Force of a muscle's fibre over its length and velocity, and the path of a motion in it.

    Parameters
    ----------
    unit : Muscle
    trajectory : Trajectory, optional
        Of a motion in which the muscle takes part; its fibre lengths and their rates are drawn as a
        line that starts at a dot. The force under the line is that at `activation`, not its own.
    activation : float
        Of the force (a f_l f_v + f_PE + beta v) F0 that the colors show.
    axes : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        The trajectory does not contain the muscle or has less than two time points, or the
        activation is outside [0, 1].

    Examples
    --------
    >>> import exudyn_muscles as em
    >>> unit = em.Muscle("unit", max_isometric_force=1000, optimal_fiber_length=0.1,
    ...                  tendon_slack_length=0.2)
    >>> em.plot.muscle(unit, activation=0.5).get_title()
    'unit, activation 0.5'
    """
    if not isinstance(unit, Muscle):
        raise ParameterError(f"a Muscle is drawn, got {unit!r}")
    number_within("activation", activation, 0.0, 1.0)
    path = None if trajectory is None else _fiber_path(unit, trajectory)
    if axes is None:
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(figsize=(PAGE_WIDTH, 0.7 * PAGE_WIDTH), layout="constrained")
    lengths, velocities = _range_of(LENGTHS, path, 0), _range_of(VELOCITIES, path, 1)
    x, v = np.linspace(*lengths, GRID), np.linspace(*velocities, GRID)
    force = _fiber_force(unit, activation, x, v)
    filled = axes.contourf(x, v, force, LEVELS, extend="both", cmap="viridis")
    lines = axes.contour(x, v, force, LEVELS[::2], colors="white", linewidths=0.6)
    axes.clabel(lines, fmt="%.1f", fontsize="small")
    axes.figure.colorbar(filled, ax=axes, ticks=LEVELS[::2], label="fiber force / $F^0$ [-]")
    if path is not None:
        from matplotlib.patheffects import withStroke

        around = [withStroke(linewidth=2.0 * ALONE, foreground="white")]
        axes.plot(*path, color="black", linewidth=ALONE, path_effects=around)
        axes.plot(*path[:, 0], color="black", marker="o", path_effects=around)
    axes.set(
        title=f"{unit.name}, activation {activation:g}",
        xlabel="fiber length / optimal length [-]",
        ylabel="fiber velocity / maximum velocity [-], lengthening positive",
    )
    return axes


def _fiber_path(unit: Muscle, trajectory: Trajectory) -> np.ndarray:
    """Rows l_m / l_m0 and l_m' / (v_max l_m0) of a muscle in a motion (2, T)."""
    if unit.name not in trajectory.muscle_names:
        raise ParameterError(
            f"muscle '{unit.name}' is not in the trajectory, whose muscles are "
            f"{', '.join(trajectory.muscle_names)}"
        )
    if len(trajectory.time) < 2:
        raise ParameterError(
            f"a trajectory of method '{trajectory.method}' has {len(trajectory.time)} time points: "
            "a path needs two"
        )
    i = trajectory.muscle_names.index(unit.name)
    length = trajectory.fiber_lengths[:, i] / unit.optimal_fiber_length
    return np.array([length, np.gradient(length, trajectory.time) / unit.max_contraction_velocity])


def _fiber_force(unit: Muscle, a: float, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Fibre force over F0 at all pairs of normalised length and velocity, (v, x)."""
    tables = MuscleSet([unit]).tables
    return np.array([[fiber_force(tables, 0, a, each, speed)[0] for each in x] for speed in v])


def _range_of(usual: tuple[float, float], path: np.ndarray | None, row: int) -> tuple[float, float]:
    """The usual range, wider if the path leaves it."""
    values = np.array(usual) if path is None else np.append(path[row], usual)
    return values.min(), values.max()
