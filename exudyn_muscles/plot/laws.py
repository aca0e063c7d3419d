"""Figures of muscle laws: their curves and derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import Field, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ParameterError
from ..muscle.laws.custom import CustomLaw
from ..muscle.laws.law import MuscleLaw
from ..numerics.curves import Curve
from .panels import EXTRA_HEIGHT, PAGE_WIDTH, ROW_HEIGHT, legend, sample, tidy, without_spare
from .styles import ALONE, COLORS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
DERIVATIVE: dict[str, Any] = {"linestyle": (0, (4, 2)), "alpha": 0.6}
LOWER = 0.8  # height of derivatives beside their curves

Function = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


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
        tidy(panel)
    labels = [_law_name(law) + ("" if elastic else ", rigid tendon") for law in laws]
    entries = {label: sample(COLORS[k % len(COLORS)]) for k, label in enumerate(labels)}
    entries["derivative, scale on the right"] = sample("0.2", **DERIVATIVE)
    legend(panels, entries, columns=2)
    return panels


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
        return without_spare(grid, len(names))
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
