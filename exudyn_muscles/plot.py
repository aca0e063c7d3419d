"""Figures of trajectories: tracking errors, excitations, activations, and forces in their bounds.

Every function draws into the given matplotlib axes or into a new figure and returns the axes. Here
radians become degrees.

Muscles or coordinates have a panel each and methods a color and line style each; several of them in
one given `Axes` have a color each, and methods the line styles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .errors import ParameterError
from .result import Trajectory

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.gridspec import SubplotSpec

METHOD_NAMES = {
    "static": "Static",
    "cmc": "CMC",
    "csf": "CSF",
    "css": "CSS",
    "forward": "Forward",
}
# Okabe and Ito's colors, which stay apart for color-blind readers; their yellow is too light for
# lines on paper.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#000000", "#CC79A7", "#E69F00", "#56B4E9")
LINE_STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2)), (0, (8, 2)))
# A method looks the same in all figures.
METHOD_STYLES = {"cmc": 0, "csf": 1, "css": 2, "static": 3, "forward": 4}
# The paper's figure 6 shows the excitations of these.
COMPARED = ("cmc", "csf")
# Methods agree so closely that their lines cover each other: a wide light one lies lowest, the
# narrowest broken one on top.
WIDTHS = (4.0, 2.2, 1.5, 1.5, 1.5, 1.5, 1.5)  # pt
ALONE = 1.8  # pt
PAGE_WIDTH = 7.0  # in
ROW_HEIGHT = 2.1  # in
EXTRA_HEIGHT = 0.6  # in, for legend and time axis


class _Style(NamedTuple):
    """How one trajectory is called and drawn: `number` counts through the styles above."""

    label: str
    number: int
    alone: bool

    @property
    def color(self) -> str:
        return COLORS[self.number % len(COLORS)]

    @property
    def line(self) -> dict[str, Any]:
        """Line style, width and order, as matplotlib takes them."""
        if self.alone:
            return {"linewidth": ALONE}
        k = self.number % len(LINE_STYLES)
        return {
            "linestyle": LINE_STYLES[k],
            "linewidth": WIDTHS[k],
            "alpha": 0.45 if k == 0 else 1.0,
            "zorder": 2.0 + 0.01 * self.number,
        }


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
        The panel of each coordinate.

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
    panels = _Panels(names, axes, columns=1)
    for one, style in zip(tracked, _styles(tracked), strict=True):
        errors = one.tracking_errors() * np.where(angles, np.degrees(1.0), 1.0)
        for j in range(len(names)):
            panels.line(j, one.time, errors[:, j], style)
    return panels.finish(label)


def excitations(
    *trajectories: Trajectory, axes: Axes | Sequence[Axes] | np.ndarray | None = None
) -> np.ndarray:
    """Excitations, constant over each window, one panel a muscle.

    Parameters
    ----------
    *trajectories : Trajectory
        Of the same muscles.
    axes : Axes or sequence of m Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    (m,) ndarray of Axes
        The panel of each muscle.

    Raises
    ------
    ParameterError
        A trajectory has no windows, or the trajectories or axes do not fit each other.
    """
    names = _same("muscle_names", trajectories)
    for one in trajectories:
        _need_rows(one, one.excitation_values, "windows")
    panels = _Panels(names, axes)
    for one, style in zip(trajectories, _styles(trajectories), strict=True):
        u = np.vstack([one.excitation_values, one.excitation_values[-1:]])
        for i in range(len(names)):
            panels.line(i, one.window_time, u[:, i], style, drawstyle="steps-post")
    return panels.finish("excitation [-]", bottom=0.0)


def activations(
    *trajectories: Trajectory, axes: Axes | Sequence[Axes] | np.ndarray | None = None
) -> np.ndarray:
    """Activations over time, one panel a muscle.

    Parameters, returned axes and errors are those of `excitations`.
    """
    names = _same("muscle_names", trajectories)
    for one in trajectories:
        _need_rows(one, one.time, "time points")
    panels = _Panels(names, axes)
    for one, style in zip(trajectories, _styles(trajectories), strict=True):
        for i in range(len(names)):
            panels.line(i, one.time, one.activations[:, i], style)
    return panels.finish("activation [-]", bottom=0.0)


def forces(
    trajectory: Trajectory, axes: Axes | Sequence[Axes] | np.ndarray | None = None
) -> np.ndarray:
    """Recruited tendon forces (10) between their bounds (8), (9) at the windows' ends [N].

    Parameters
    ----------
    trajectory : Trajectory
    axes : Axes or sequence of m Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    (m,) ndarray of Axes
        The panel of each muscle.

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
    panels = _Panels(trajectory.muscle_names, axes)
    time = trajectory.window_time[1:]
    for i, panel in enumerate(panels.axes):
        color = COLORS[i % len(COLORS)] if panels.shared else COLORS[0]
        name = f"{trajectory.muscle_names[i]}: " if panels.shared else ""
        band = panel.fill_between(
            time, low[:, i], high[:, i], color=color, alpha=0.25, linewidth=0.0
        )
        (line,) = panel.plot(time, recruited[:, i], color=color, linewidth=ALONE)
        panels.entry(f"{name}reachable, $F_\\mathrm{{min}}$ to $F_\\mathrm{{max}}$", band)
        panels.entry(f"{name}recruited, $F_\\mathrm{{opt}}$", line)
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
    rows, columns = _grid(len(muscles))
    heights = [EXTRA_HEIGHT + ROW_HEIGHT * count for count in (len(coordinates), rows)]
    figure = plt.figure(figsize=(PAGE_WIDTH, sum(heights)), layout="constrained")
    try:
        halves: Any = figure.subfigures(2, 1, height_ratios=heights)
        top, bottom = halves
        upper = top.subplots(len(coordinates), 1, sharex=True, squeeze=False)
        lower = bottom.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        tracking_errors(*trajectories, axes=upper[:, 0])
        excitations(*compared, axes=_without_spare(lower, len(muscles)))
    except ParameterError:
        plt.close(figure)
        raise
    return figure


class _Panels:
    """The axes of named panels; `shared` if they are all the same one."""

    def __init__(
        self,
        names: Sequence[str],
        axes: Axes | Sequence[Axes] | np.ndarray | None,
        columns: int | None = None,
    ) -> None:
        self.names = names
        count = len(names)
        if axes is None:
            import matplotlib.pyplot as plt

            rows, width = _grid(count) if columns is None else (-(-count // columns), columns)
            _, grid = plt.subplots(
                rows, width, figsize=(PAGE_WIDTH, EXTRA_HEIGHT + ROW_HEIGHT * rows), sharex=True,
                sharey=columns is None, squeeze=False, layout="constrained",
            )  # fmt: skip
            self.axes = _without_spare(grid, count)
        else:
            given = np.atleast_1d(np.array(axes, dtype=object)).ravel()
            if given.size not in (1, count):
                raise ParameterError(
                    f"axes: give one, or one for each of {', '.join(names)}; got {given.size}"
                )
            self.axes = np.repeat(given, count) if given.size < count else given
        self.shared = count > 1 and all(panel is self.axes[0] for panel in self.axes)
        self._entries: dict[str, Artist] = {}

    def line(self, k: int, x: np.ndarray, y: np.ndarray, style: _Style, **options: str) -> None:
        """Draw y over x in panel k."""
        from matplotlib.lines import Line2D

        color = COLORS[k % len(COLORS)] if self.shared else style.color
        self.axes[k].plot(x, y, color=color, label=style.label, **style.line, **options)
        if self.shared:
            # All names and then all methods, instead of all their pairs.
            for i, name in enumerate(self.names):
                sample = Line2D([], [], color=COLORS[i % len(COLORS)], linewidth=4.0)
                self._entries.setdefault(name, sample)
            color = "0.2"
        if not (style.alone and self.shared):
            self._entries[style.label] = Line2D([], [], color=color, **style.line)

    def entry(self, label: str, artist: Artist) -> None:
        """A further entry of the legend."""
        self._entries.setdefault(label, artist)

    def finish(self, label: str, bottom: float | None = None) -> np.ndarray:
        """Labels, titles, limits, legend; the axes."""
        panels = self.axes[:1] if self.shared else self.axes
        for k, panel in enumerate(panels):
            panel.margins(x=0.0)
            panel.grid(True, color="0.88", linewidth=0.8)
            panel.set_axisbelow(True)
            panel.spines[["top", "right"]].set_visible(False)
            place = panel.get_subplotspec()
            if bottom is not None:
                panel.set_ylim(bottom=bottom)
            if place is None or place.is_first_col():
                panel.set_ylabel(label)
            if place is None or _is_lowest(place, panels):
                panel.set_xlabel("time [s]")
            if place is not None and place.get_gridspec().ncols > 2:
                panel.locator_params(axis="x", nbins=4, steps=[1, 2, 5, 10])
            if len(self.names) > 1 and not self.shared:
                panel.set_title(self.names[k], fontsize="medium")
        self._legend(panels)
        return self.axes

    def _legend(self, panels: np.ndarray) -> None:
        """One legend for all panels, above them where the layout makes room for it."""
        figure: Figure | SubFigure = panels[0].figure
        entries: dict[str, Any] = {
            "handles": list(self._entries.values()),
            "labels": list(self._entries),
            "handlelength": 3.2,
        }
        engine = panels[0].get_figure(root=True).get_layout_engine()
        if isinstance(engine, _constrained_layout()):
            columns = len(self._entries) if len(self._entries) <= 5 else 4
            figure.align_ylabels(list(panels))
            figure.legend(loc="outside upper center", ncols=columns, frameon=False, **entries)
        else:
            panels[0].legend(**entries)


def _constrained_layout() -> type:
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return ConstrainedLayoutEngine


def _without_spare(grid: np.ndarray, count: int) -> np.ndarray:
    """The first `count` axes of a grid; the others become invisible."""
    columns = grid.shape[1]
    axes = grid.ravel()
    for k in range(count, axes.size):
        axes[k].set_visible(False)
        axes[k - columns].tick_params(labelbottom=True)  # now the lowest of its column
    return axes[:count]


def _is_lowest(place: SubplotSpec, panels: np.ndarray) -> bool:
    """Whether none of the panels lies below `place` in the same grid."""
    others = (panel.get_subplotspec() for panel in panels)
    return not any(
        other is not None
        and other.get_gridspec() is place.get_gridspec()
        and other.rowspan.start >= place.rowspan.stop
        and other.colspan.start == place.colspan.start
        for other in others
    )


def _grid(count: int) -> tuple[int, int]:
    """Rows and columns for `count` panels."""
    columns = count if count <= 3 else 2 if count == 4 else 3
    return -(-count // columns), columns


def _styles(trajectories: Sequence[Trajectory]) -> list[_Style]:
    """A label and a look for each; several of one method are numbered."""
    methods = [one.method for one in trajectories]
    taken: set[int] = set()
    styles = []
    for k, method in enumerate(methods):
        label = METHOD_NAMES.get(method, method)
        if methods.count(method) > 1:
            label += f" ({methods[: k + 1].count(method)})"
        number = METHOD_STYLES.get(method, len(METHOD_STYLES))
        if number in taken:
            reserved = {METHOD_STYLES[name] for name in methods if name in METHOD_STYLES}
            number = next(i for i in range(len(methods) + len(COLORS)) if i not in taken | reserved)
        taken.add(number)
        styles.append(_Style(label, number, len(methods) == 1))
    return styles


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
