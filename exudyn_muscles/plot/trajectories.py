"""Figures of trajectories: tracking errors, excitations, activations, and forces in their bounds.

Every function draws into the given matplotlib axes or into a new figure and returns the axes. Here
radians become degrees.

Muscles or coordinates have a panel each and methods a color and line style each; several of them in
one given `Axes` have a color each, and methods the line styles. A new figure is a page at most: of
many muscles or coordinates those with the largest values have panels, in the model's order, and a
table below them tells the largest values of the others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.emg import EMG, measured_beside
from ..analysis.table import Table
from ..errors import ParameterError
from ..results.trajectory import Trajectory
from .panels import (
    EXTRA_HEIGHT,
    HALF,
    MOST,
    PAGE_WIDTH,
    Panels,
    grid_size,
    row_height,
    without_spare,
)
from .styles import ALONE, COLORS, styles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The paper's figure 6 shows the excitations of these.
COMPARED = ("cmc", "csf")


def tracking_errors(
    *trajectories: Trajectory, axes: Axes | Sequence[Axes] | np.ndarray | None = None
) -> np.ndarray:
    """Tracking errors q_d - q over time, one panel a coordinate [deg].

    Trajectories of the static method are left out: they are the desired motion itself.

    Parameters
    ----------
    *trajectories : Trajectory
        Of the same coordinates.
    axes : Axes or sequence of n Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    (n,) ndarray of Axes
        The panel of each coordinate that has one.

    Raises
    ------
    ParameterError
        No trajectory tracks a motion, or one has no desired coordinates, as those of forward
        dynamics; or the trajectories or axes do not fit each other.
    """
    tracked = [one for one in trajectories if one.method != "static"]
    if not tracked:
        raise ParameterError("tracking errors need a trajectory of CMC, CSF or CSS; got none")
    names = _same("coordinate_names", tracked)
    for one in tracked:
        _need_rows(one, one.time, "time points")
        if not np.isfinite(one.desired_coordinates).all():
            raise ParameterError(
                f"a trajectory of method '{one.method}' has no desired coordinates: there is no "
                "tracking error to draw"
            )
    units = _same("coordinate_units", tracked)
    angles = np.array([unit == "rad" for unit in units])
    label = f"tracking error [{'deg' if angles.all() else 'm'}]"
    if len(set(units)) > 1:  # every panel says its own unit
        label = "tracking error"
        names = tuple(
            f"{name} [{'deg' if angle else 'm'}]" for name, angle in zip(names, angles, strict=True)
        )
    errors = [one.tracking_errors() * np.where(angles, np.degrees(1.0), 1.0) for one in tracked]
    weight = _largest([one.tracking_errors() for one in tracked])
    panels = Panels(names, axes, _largest(errors), weight, columns=1)
    for one, error, style in zip(tracked, errors, styles(tracked), strict=True):
        for k, j in enumerate(panels.shown):
            panels.line(k, one.time, error[:, j], style)
    return panels.finish(label)


def excitations(
    *trajectories: Trajectory,
    axes: Axes | Sequence[Axes] | np.ndarray | None = None,
    emg: EMG | None = None,
    measured: Mapping[str, str] | None = None,
) -> np.ndarray:
    """Excitations, constant over each window, one panel a muscle.

    Parameters
    ----------
    *trajectories : Trajectory
        Of the same muscles.
    axes : Axes or sequence of m Axes, optional
        Where to draw; a new figure if left out.
    emg : EMG, optional
        Envelopes, drawn as they are: normalized and delayed.
    measured : mapping, optional
        Muscle -> name of its EMG.

    Returns
    -------
    (m,) ndarray of Axes
        The panel of each muscle that has one.

    Raises
    ------
    ParameterError
        A trajectory has no windows, or the trajectories or axes do not fit each other.
    """
    names = _same("muscle_names", trajectories)
    for one in trajectories:
        _need_rows(one, one.excitation_values, "windows")
    panels = Panels(names, axes, _largest([one.excitation_values for one in trajectories]))
    for one, style in zip(trajectories, styles(trajectories), strict=True):
        u = np.vstack([one.excitation_values, one.excitation_values[-1:]])
        for k, i in enumerate(panels.shown):
            panels.line(k, one.window_time, u[:, i], style, drawstyle="steps-post")
    if emg is not None:
        t = np.unique(np.concatenate([one.window_time for one in trajectories]))
        envelopes = measured_beside(emg, measured or {}, names, t)
        for panel, i in zip(panels.axes, panels.shown, strict=True):
            if names[i] in envelopes:
                band = panel.fill_between(t, envelopes[names[i]], color="0.8", linewidth=0.0)
                panels.entry("EMG", band)
    return panels.finish("excitation [-]", bottom=0.0)


def activations(
    *trajectories: Trajectory, axes: Axes | Sequence[Axes] | np.ndarray | None = None
) -> np.ndarray:
    """Activations over time, one panel a muscle.

    Parameters
    ----------
    *trajectories : Trajectory
        Of the same muscles.
    axes : Axes or sequence of m Axes, optional
        As of `excitations`.

    Returns
    -------
    ndarray of Axes
        As of `excitations`.

    Raises
    ------
    ParameterError
        As of `excitations`.
    """
    names = _same("muscle_names", trajectories)
    for one in trajectories:
        _need_rows(one, one.time, "time points")
    panels = Panels(names, axes, _largest([one.activations for one in trajectories]))
    for one, style in zip(trajectories, styles(trajectories), strict=True):
        for k, i in enumerate(panels.shown):
            panels.line(k, one.time, one.activations[:, i], style)
    return panels.finish("activation [-]", bottom=0.0)


def forces(
    trajectory: Trajectory,
    axes: Axes | Sequence[Axes] | np.ndarray | None = None,
    *,
    feasible: Table | None = None,
) -> np.ndarray:
    """Recruited tendon forces (10) between their bounds (8), (9) at the windows' ends [N].

    Parameters
    ----------
    trajectory : Trajectory
    axes : Axes or sequence of m Axes, optional
        Where to draw; a new figure if left out.
    feasible : Table, optional
        Of `analysis.feasible_forces`: what would have done the same.

    Returns
    -------
    (m,) ndarray of Axes
        The panel of each muscle that has one.

    Raises
    ------
    ParameterError
        The trajectory has no windows or no bounds, as those of forward dynamics, or the axes do not
        fit.
    """
    _need_rows(trajectory, trajectory.excitation_values, "windows")
    low, recruited, high = trajectory.force_min, trajectory.force_optimal, trajectory.force_max
    if not (np.isfinite(low).all() and np.isfinite(recruited).all() and np.isfinite(high).all()):
        raise ParameterError(
            f"a trajectory of method '{trajectory.method}' has no recruited forces and no bounds"
        )
    panels = Panels(trajectory.muscle_names, axes, _largest([recruited]))
    time = trajectory.window_time[1:]
    for i, panel in zip(panels.shown, panels.axes, strict=True):
        color = COLORS[i % len(COLORS)] if panels.shared else COLORS[0]
        name = f"{trajectory.muscle_names[i]}: " if panels.shared else ""
        band = panel.fill_between(
            time, low[:, i], high[:, i], color=color, alpha=0.25, linewidth=0.0
        )
        (line,) = panel.plot(time, recruited[:, i], color=color, linewidth=ALONE)
        panels.entry(f"{name}reachable, $F_\\mathrm{{min}}$ to $F_\\mathrm{{max}}$", band)
        panels.entry(f"{name}recruited, $F_\\mathrm{{opt}}$", line)
        if feasible is not None:
            muscle = trajectory.muscle_names[i]
            for end in ("least", "largest"):
                y = feasible[f"force_{end}/{muscle}"]
                (line,) = panel.plot(feasible.time, y, color=color, linewidth=0.8, linestyle="--")
            panels.entry(f"{name}would have done", line)
    shown = panels.finish("tendon force [N]", bottom=0.0)
    for panel in shown:
        panel.set_xlim(left=trajectory.window_time[0])
    return shown


def comparison(*trajectories: Trajectory) -> Figure:
    """Figure 6 of the paper: tracking errors of the methods, below them excitations of CMC and CSF.

    Parameters
    ----------
    *trajectories : Trajectory
        Of the same coordinates and muscles, at least one of a method that tracks. Without one of
        CMC or CSF the excitations of all of them are drawn.

    Returns
    -------
    Figure

    Raises
    ------
    ParameterError
        As `tracking_errors` and `excitations`.
    """
    import matplotlib.pyplot as plt

    coordinates = _same("coordinate_names", trajectories)
    muscles = _same("muscle_names", trajectories)
    compared = [one for one in trajectories if one.method in COMPARED] or list(trajectories)
    counts = [HALF if len(names) > MOST else len(names) for names in (coordinates, muscles)]
    sizes = grid_size(counts[0], 1), grid_size(counts[1])
    heights = [EXTRA_HEIGHT + row_height(rows) * rows for rows, _ in sizes]
    figure = plt.figure(figsize=(PAGE_WIDTH, sum(heights)), layout="constrained")
    try:
        halves: Any = figure.subfigures(2, 1, height_ratios=heights)
        top, bottom = halves
        upper = top.subplots(*sizes[0], sharex=True, squeeze=False)
        lower = bottom.subplots(*sizes[1], sharex=True, sharey=True, squeeze=False)
        tracking_errors(*trajectories, axes=without_spare(upper, counts[0]))
        excitations(*compared, axes=without_spare(lower, counts[1]))
    except ParameterError:
        plt.close(figure)
        raise
    return figure


def _largest(values: Sequence[np.ndarray]) -> np.ndarray:
    """The largest size (m,) of what is drawn (t, m)."""
    return np.max([np.abs(each).max(axis=0, initial=0.0) for each in values], axis=0)


def _same(field: str, trajectories: Sequence[Trajectory]) -> tuple[str, ...]:
    """The names that all trajectories share, or ParameterError."""
    if not trajectories:
        raise ParameterError("there is no trajectory to draw")
    names = getattr(trajectories[0], field)
    for one in trajectories[1:]:
        if getattr(one, field) != names:
            raise ParameterError(
                f"the trajectories differ in their {field}: {names} and {getattr(one, field)}"
            )
    return names


def _need_rows(trajectory: Trajectory, rows: np.ndarray, what: str) -> None:
    """ParameterError if nothing was recorded."""
    if len(rows) == 0:
        raise ParameterError(f"a trajectory of method '{trajectory.method}' has no {what}")
