"""Panels of a figure, a name each, with what all of them look like."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ParameterError
from .styles import ALONE, COLORS, Style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.gridspec import SubplotSpec

PAGE_WIDTH = 7.0  # in
ROW_HEIGHT = 2.1  # in
EXTRA_HEIGHT = 0.6  # in, for legend and time axis
LOW_ROW = 1.35  # in, of a row of a full page
TABLE_ROW = 0.125  # in
# What a page of 7 x 11 in holds beside a table of 80 names.
MOST = 15
TABLE_COLUMNS = 3
HALF = 9  # panels where two figures share a page
FEW = 6  # coordinates that stand below one another
HIGH_ROWS = 2  # more rows of panels are lower ones


class Panels:
    """The axes of named panels, one page of them; `shared` if they are all the same one.

    Attributes
    ----------
    shown : (k,) int ndarray
        Which of the names have a panel.
    names : sequence of str
        Theirs.
    axes : (k,) ndarray of Axes
    """

    def __init__(
        self,
        names: Sequence[str],
        axes: Axes | Sequence[Axes] | np.ndarray | None,
        largest: np.ndarray,
        weight: np.ndarray | None = None,
        columns: int | None = None,
    ) -> None:
        """`largest` (count,) is what is told of a name that has no panel. Where not all fit on a
        page those have one for which it, or the `weight`, is largest."""
        count = len(names)
        order = np.argsort(-(largest if weight is None else weight), kind="stable")
        self.shown = np.sort(order[:MOST]) if axes is None else np.arange(count)
        self._rest: dict[str, float] = {}
        if axes is None:
            self._rest = {names[i]: float(largest[i]) for i in order[MOST:]}
            self.axes = _page(self.shown.size, len(self._rest), columns)
        else:
            given = np.atleast_1d(np.array(axes, dtype=object)).ravel()
            if given.size not in (1, count) and not 1 < given.size < count > MOST:
                raise ParameterError(
                    f"axes: give one, or one for each of {', '.join(names)}; got {given.size}"
                )
            if 1 < given.size < count:
                self.shown = np.sort(order[: given.size])
            self.axes = np.repeat(given, count) if given.size < self.shown.size else given
        self.names = [names[i] for i in self.shown]
        self.shared = count > 1 and all(panel is self.axes[0] for panel in self.axes)
        self._entries: dict[str, Artist] = {}

    def line(self, k: int, x: np.ndarray, y: np.ndarray, style: Style, **options: str) -> None:
        """Draw y over x in panel k."""
        from matplotlib.lines import Line2D

        color = COLORS[k % len(COLORS)] if self.shared else style.color
        self.axes[k].plot(x, y, color=color, label=style.label, **style.line, **options)
        if self.shared:
            # All names and then all methods, instead of all their pairs.
            for i, name in enumerate(self.names):
                thick = Line2D([], [], color=COLORS[i % len(COLORS)], linewidth=4.0)
                self._entries.setdefault(name, thick)
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
            tidy(panel)
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
                # With a place of its own: looking for one takes as long as drawing the panel.
                panel.set_title(self.names[k], fontsize="medium", y=1.0)
        legend(panels, self._entries)
        if self._rest:
            _table(self.axes[0].figure, self._rest, f"largest {label} of the others")
        return self.axes


def row_height(rows: int) -> float:
    """Of so many rows of panels [in]."""
    return ROW_HEIGHT if rows <= HIGH_ROWS else LOW_ROW


def _page(count: int, others: int, columns: int | None) -> np.ndarray:
    """Axes of a new figure, with room for a table of the `others` below them."""
    import matplotlib.pyplot as plt

    rows, width = grid_size(count, columns)
    table = TABLE_ROW * (1 + -(-others // TABLE_COLUMNS)) if others else 0.0
    height = EXTRA_HEIGHT + row_height(rows) * rows + table
    figure = plt.figure(figsize=(PAGE_WIDTH, height), layout="constrained")
    within: Any = figure
    if others:
        halves: Any = figure.subfigures(2, 1, height_ratios=[height - table, table])
        within = halves[0]
    grid = within.subplots(rows, width, sharex=True, sharey=columns is None, squeeze=False)
    return without_spare(grid, count)


def _table(panels: Any, values: dict[str, float], title: str) -> None:
    """Write names and values below the panels of a page."""
    below = panels.get_figure(root=True).subfigs[1]
    rows = 1 + -(-len(values) // TABLE_COLUMNS)
    below.text(0.02, 1.0 - 0.5 / rows, title, fontsize=7, va="center", weight="bold")
    for k, (name, value) in enumerate(values.items()):
        column, row = divmod(k, rows - 1)
        y = 1.0 - (row + 1.5) / rows
        x = 0.02 + column / TABLE_COLUMNS
        below.text(x, y, name, fontsize=6.5, va="center")
        below.text(
            x + 0.9 / TABLE_COLUMNS, y, f"{value:.3g}", fontsize=6.5, va="center", ha="right"
        )


def sample(color: str, **line: Any) -> Artist:
    """A line for a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=color, linewidth=ALONE, **line)


def tidy(panel: Axes) -> None:
    """What all panels look like."""
    panel.margins(x=0.0)
    panel.grid(True, color="0.88", linewidth=0.8)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)


def legend(panels: np.ndarray, entries: dict[str, Artist], columns: int | None = None) -> None:
    """One legend for all panels, above them where the layout makes room for it."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    figure: Figure | SubFigure = panels[0].figure
    options: dict[str, Any] = {
        "handles": list(entries.values()),
        "labels": list(entries),
        "handlelength": 3.2,
    }
    engine = panels[0].get_figure(root=True).get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        columns = columns or (len(entries) if len(entries) <= 5 else 4)
        # Of all of them, the layout would compare every panel's numbers with every other's.
        figure.align_ylabels([panel for panel in panels if panel.get_ylabel()])
        figure.legend(loc="outside upper center", ncols=columns, frameon=False, **options)
    else:
        panels[0].legend(**options)


def without_spare(grid: np.ndarray, count: int) -> np.ndarray:
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


def grid_size(count: int, columns: int | None = None) -> tuple[int, int]:
    """Rows and columns for `count` panels, of which few may have other `columns`."""
    if columns is None or count > FEW:
        columns = count if count <= 3 else 2 if count == 4 else 3
    return -(-count // columns), columns
