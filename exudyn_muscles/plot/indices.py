"""Figures of sensitivity indices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import ParameterError
from .panels import EXTRA_HEIGHT, PAGE_WIDTH, tidy
from .styles import COLORS

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

# Columns that are drawn, and how they are called.
LABELS = {
    "S1": "first index $S_1$",
    "ST": "total index $S_T$",
    "mu_star": "mean size of effects $\\mu^*$",
    "sigma": "deviation of effects $\\sigma$",
}
BAR = 0.4  # of the place of a parameter
BAR_HEIGHT = 0.3  # in


def indices(table: pandas.DataFrame, axes: Axes | None = None) -> Axes:
    """Bars of `studies.indices`, the largest at the top, with their intervals of confidence.

    Parameters
    ----------
    table : pandas.DataFrame
    axes : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        It has no indices.
    """
    shown = [name for name in LABELS if name in table.columns]
    if not shown:
        raise ParameterError(f"there are no indices among {', '.join(map(str, table.columns))}")
    if axes is None:
        import matplotlib.pyplot as plt

        size = PAGE_WIDTH, 2.0 * EXTRA_HEIGHT + BAR_HEIGHT * len(table) * len(shown)
        axes = plt.figure(figsize=size, layout="constrained").subplots()
    ordered = table.sort_values("ST" if "ST" in shown else "mu_star")
    places = np.arange(len(ordered), dtype=float)
    for k, name in enumerate(shown):
        spread = ordered.get(f"{name}_conf")
        axes.barh(
            places + BAR * (0.5 - k), ordered[name], BAR, xerr=spread, color=COLORS[k],
            ecolor="0.2", capsize=2.0, label=LABELS[name],
        )  # fmt: skip
    tidy(axes)
    axes.set_yticks(places, [str(name) for name in ordered.index])
    axes.margins(x=0.02)
    axes.set_title(str(table.attrs.get("outcome", "")), fontsize="medium")
    axes.legend(loc="lower right")
    return axes
