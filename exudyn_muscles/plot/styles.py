"""How methods are called and drawn: the same in all figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..results.trajectory import Trajectory

METHOD_NAMES = {
    "static": "Static",
    "cmc": "CMC",
    "csf": "CSF",
    "css": "CSS",
    "consistent": "Consistent CSF",
    "forward": "Forward",
}
# Okabe and Ito's colors, which stay apart for color-blind readers; their yellow is too light for
# lines on paper.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#000000", "#CC79A7", "#E69F00", "#56B4E9")
LINE_STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2)), (0, (8, 2)))
# A method looks the same in all figures.
METHOD_STYLES = {"cmc": 0, "csf": 1, "css": 2, "static": 3, "forward": 4, "consistent": 5}
# Methods agree so closely that their lines cover each other: a wide light one lies lowest, the
# narrowest broken one on top.
WIDTHS = (4.0, 2.2, 1.5, 1.5, 1.5, 1.5, 1.5)  # pt
ALONE = 1.8  # pt


class Style(NamedTuple):
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


def styles(trajectories: Sequence[Trajectory]) -> list[Style]:
    """A label and a look for each; several of one method are numbered."""
    methods = [one.method for one in trajectories]
    taken: set[int] = set()
    found = []
    for k, method in enumerate(methods):
        label = METHOD_NAMES.get(method, method)
        if methods.count(method) > 1:
            label += f" ({methods[: k + 1].count(method)})"
        number = METHOD_STYLES.get(method, len(METHOD_STYLES))
        if number in taken:
            reserved = {METHOD_STYLES[name] for name in methods if name in METHOD_STYLES}
            number = next(i for i in range(len(methods) + len(COLORS)) if i not in taken | reserved)
        taken.add(number)
        found.append(Style(label, number, len(methods) == 1))
    return found
