"""Figures of trajectories: tracking errors, excitations, activations, and forces in their bounds;
and of muscles: the curves of their laws, and the force over length and velocity of the fibre.

Every function draws into the given matplotlib axes or into a new figure and returns the axes. Here
radians become degrees.

Muscles or coordinates have a panel each and methods a color and line style each; several of them in
one given `Axes` have a color each, and methods the line styles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import Field, fields, is_dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..checks import number_within
from ..errors import ParameterError
from ..muscle.contraction import fiber_force
from ..muscle.laws.custom import CustomLaw
from ..muscle.laws.law import MuscleLaw
from ..muscle.parameters import Muscle, MuscleSet
from ..numerics.curves import Curve
from ..results.trajectory import Trajectory

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

# Panels of the curves of a law, title and axis. Curves are drawn over the range in which muscles
# work, those of passive forces up to the highest force of interest.
PANELS = {
    "active_force_length": ("active force-length curve $f_l$", "fiber length / optimal length"),
    "force_velocity": ("force-velocity curve $f_v$", "fiber velocity / maximum velocity"),
    "passive_force_length": ("passive curve $f_\\mathrm{PE}$", "fiber length / optimal length"),
    "tendon_force_length": ("tendon curve $f_\\mathrm{SE}$", "tendon length / slack length"),
}
LENGTHS, VELOCITIES = (0.4, 1.6), (-1.0, 1.0)  # of the fibre, normalised
MARGIN = 0.1  # shown of a passive curve before it rises, and beyond the fastest fibre
HIGHEST = 1.5  # passive force over the maximum isometric force
SAMPLES = 801
GRID = 201
DERIVATIVE: dict[str, Any] = {"linestyle": (0, (4, 2)), "alpha": 0.6}
LOWER = 0.8  # height of derivatives beside their curves
LEVELS = np.arange(0.0, 2.01, 0.1)

Function = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


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


def curves(
    *laws: MuscleLaw, elastic: bool = True, axes: Sequence[Axes] | np.ndarray | None = None
) -> np.ndarray:
    """The four curves of muscle laws and, dashed, their derivatives, with their scale on the right.

    Parameters
    ----------
    *laws : MuscleLaw
    elastic : bool
        Curves of units with an elastic tendon; False: with a rigid one, without the tendon's panel.
    axes : sequence of four (or three) Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    (4,) or (3,) ndarray of Axes
        The panels of f_l, f_v, f_PE and, if a law has one, f_SE. The axes of the derivatives are
        the further ones of the figure.

    Raises
    ------
    ParameterError
        There is no law, or the axes do not fit.

    Examples
    --------
    >>> import exudyn_muscles as em
    >>> axes = em.plot.curves(em.Millard2012(), em.Thelen2003())
    >>> axes[0].figure.savefig("curves.png")  # doctest: +SKIP
    """
    if not laws:
        raise ParameterError("there is no muscle law to draw")
    for law in laws:
        if not isinstance(law, MuscleLaw):
            raise ParameterError(f"a muscle law is drawn, got {law!r}")
    functions = [_law_functions(law, elastic) for law in laws]
    names = [name for name in PANELS if any(name in found for found in functions)]
    panels = _law_panels(names, axes)
    for name, panel in zip(names, panels, strict=True):
        drawn = {k: found[name] for k, found in enumerate(functions) if name in found}
        x = np.linspace(*_shown(name, drawn.values()), SAMPLES)
        both = np.array([function(x) for function in drawn.values()])
        right = panel.twinx()
        for k, (value, slope) in zip(drawn, both, strict=True):
            color = COLORS[k % len(COLORS)]
            panel.plot(x, value, color=color, linewidth=ALONE)
            right.plot(x, slope, color=color, linewidth=ALONE, **DERIVATIVE)
        # One zero for both, and derivatives that stay lower: those of exponentials look alike.
        value, slope = both[:, 0], both[:, 1]
        top = value.max() or 1.0
        scale = (slope.max() or 1.0) / (LOWER * top)
        limits = np.array([min(value.min(), slope.min() / scale), top])
        limits += MARGIN * np.ptp(limits) * np.array([-0.5, 0.5])
        panel.set_ylim(limits)
        right.set_ylim(scale * limits)
        title, length = PANELS[name]
        panel.set_title(title, fontsize="medium")
        panel.set(xlabel=length, ylabel="force / $F^0$ [-]")
        right.set_ylabel("derivative [-]")
        right.spines["top"].set_visible(False)
        _tidy(panel)
    labels = [_law_name(law) + ("" if elastic else ", rigid tendon") for law in laws]
    entries = {label: _sample(COLORS[k % len(COLORS)]) for k, label in enumerate(labels)}
    entries["derivative, scale on the right"] = _sample("0.2", **DERIVATIVE)
    _legend(panels, entries, columns=2)
    return panels


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
            _tidy(panel)
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
        _legend(panels, self._entries)
        return self.axes


def _law_functions(law: MuscleLaw, elastic: bool) -> dict[str, Function]:
    """Value and derivative of each of the law's curves over normalised length or velocity."""
    found = law.curves(elastic)
    functions = {name: _with_derivative(getattr(found, name)) for name in list(PANELS)[:3]}
    if elastic and found.tendon_force_length is not None:
        strain = law.tendon_strain_at_one_norm_force or 1.0
        functions["tendon_force_length"] = _with_derivative(found.tendon_force_length, 1.0, strain)
    return functions


def _with_derivative(curve: Curve, origin: float = 0.0, scale: float = 1.0) -> Function:
    def function(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        s = (x - origin) / scale
        return curve(s), curve.derivative(s) / scale

    return function


def _law_panels(names: Sequence[str], axes: Sequence[Axes] | np.ndarray | None) -> np.ndarray:
    if axes is None:
        import matplotlib.pyplot as plt

        height = EXTRA_HEIGHT + 2 * 1.3 * ROW_HEIGHT
        _, grid = plt.subplots(2, 2, figsize=(PAGE_WIDTH, height), layout="constrained")
        return _without_spare(grid, len(names))
    panels = np.array(axes, dtype=object).ravel()
    if panels.size != len(names):
        raise ParameterError(f"axes: give one for each of {', '.join(names)}; got {panels.size}")
    return panels


def _shown(name: str, functions: Iterable[Function]) -> tuple[float, float]:
    """Range of a panel."""
    if name == "active_force_length":
        return LENGTHS
    if name == "force_velocity":
        return VELOCITIES
    x = np.linspace(1.0, 2.0, 1001)
    high = min(x[np.searchsorted(value(x)[0], HIGHEST).clip(max=1000)] for value in functions)
    return (LENGTHS[0] if name == "passive_force_length" else 1.0 - MARGIN * (high - 1.0)), high


def _law_name(law: MuscleLaw) -> str:
    """The name of the user's law, or the class and what is not its default."""
    if isinstance(law, CustomLaw):
        return law.name
    given: tuple[Field, ...] = fields(law) if is_dataclass(law) else ()
    values = [(one.name, getattr(law, one.name), one.default) for one in given]
    numbers = [f"{name} = {value}" for name, value, default in values if value != default]
    return ", ".join([type(law).__name__, *numbers])


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


def _sample(color: str, **line: Any) -> Artist:
    """A line for a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=color, linewidth=ALONE, **line)


def _tidy(panel: Axes) -> None:
    """What all panels look like."""
    panel.margins(x=0.0)
    panel.grid(True, color="0.88", linewidth=0.8)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)


def _legend(panels: np.ndarray, entries: dict[str, Artist], columns: int | None = None) -> None:
    """One legend for all panels, above them where the layout makes room for it."""
    figure: Figure | SubFigure = panels[0].figure
    options: dict[str, Any] = {
        "handles": list(entries.values()),
        "labels": list(entries),
        "handlelength": 3.2,
    }
    engine = panels[0].get_figure(root=True).get_layout_engine()
    if isinstance(engine, _constrained_layout()):
        columns = columns or (len(entries) if len(entries) <= 5 else 4)
        figure.align_ylabels(list(panels))
        figure.legend(loc="outside upper center", ncols=columns, frameon=False, **options)
    else:
        panels[0].legend(**options)


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
