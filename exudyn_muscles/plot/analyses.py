"""Figures of what joints bear."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.joint_loads import force_sizes
from ..analysis.table import Table
from .panels import Panels
from .styles import ALONE, COLORS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def joint_loads(loads: Table, axes: Axes | Sequence[Axes] | np.ndarray | None = None) -> np.ndarray:
    """The force in every joint over time, its size and components, one panel a joint [N].

    Parameters
    ----------
    loads : Table
        Of `analysis.joint_loads`.
    axes : Axes or sequence of Axes, optional
        Where to draw, one a joint or one for all, which then shows sizes alone; a new figure if
        left out.

    Returns
    -------
    ndarray of Axes
        The panel of each joint that has one.

    Raises
    ------
    ParameterError
        The table is of another analysis, or the axes do not fit.
    """
    names, sizes = force_sizes(loads)
    panels = Panels(names, axes, sizes.max(axis=0, initial=0.0))
    for panel, k in zip(panels.axes, panels.shown, strict=True):
        if panels.shared:
            (line,) = panel.plot(loads.time, sizes[:, k], color=COLORS[k % len(COLORS)])
            panels.entry(names[k], line)
            continue
        for axis, part, color in zip("xyz", loads[f"force/{names[k]}"].T, COLORS, strict=False):
            (line,) = panel.plot(loads.time, part, color=color, linewidth=1.0)
            panels.entry(axis, line)
        (line,) = panel.plot(loads.time, sizes[:, k], color="0.2", linewidth=ALONE)
        panels.entry("size", line)
    return panels.finish("force in the joint [N]")
