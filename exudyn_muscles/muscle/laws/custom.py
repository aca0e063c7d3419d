"""A law of the user's own: every curve a Python function or measured points.

The functions are evaluated here, once; a simulation sees only the pieces that they become.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass, field
from typing import Any

import numpy as np

from ...checks import number_within
from ...errors import ParameterError
from ...numerics.curves import ORIGIN, Curve
from .law import UNDAMPED, HillCurves, MuscleLaw

Given = Callable[[Any], Any] | tuple[Sequence[float], Sequence[float]]

# Where functions are followed; measured points have their own range.
LONGEST = 2.0  # farther end of the fibre's curves [optimal fibre lengths]
FASTEST = 1.0  # both ends of f_v
STRONGEST, LONGEST_TENDON = 5.0, 2.0  # f_SE is followed to this force [F0], or to this length

FEWEST_POINTS = 4
SAMPLES = 2001  # of a curve, where its shape is checked
TOLERANCE = 1e-3  # of curves that are 0 or 1 somewhere
ROUNDING = 1e-9
JUMP, CLOSE = 1e-3, 1e-5  # change of value between places so close that no curve is so steep
PEAK = 0.2  # how far from 1 the maximum of f_l and its place may lie
STALL = 0.1  # what is left of f_v at the maximum contraction velocity
# What an undamped fibre needs of f_l and of the slope of f_v.
LEAST_ACTIVE, LEAST_SLOPE = 1e-4, 1e-3
# With a damper the inverse only starts Newton's method: that of f_v with this slope added.
STARTING_SLOPE = 0.1


@dataclass(frozen=True)
class CustomLaw(MuscleLaw):
    """Muscle law from curves of the user's own.

    A curve is a function, which takes arrays or single numbers, or a pair (x, y) of at least four
    measured points, which are joined smoothly and without overshoot (PCHIP).

    Parameters
    ----------
    name : str
        In messages and figures.
    active_force_length : callable or pair
        f_l of the fibre length over the optimal one, followed from `shortest_fiber` to 2, constant
        beyond.
    force_velocity : callable or pair
        f_v of the fibre velocity over the maximum contraction velocity, shortening negative,
        followed from -1 to 1, on along its tangents beyond.
    passive_force_length : callable or pair
        f_PE of the fibre length over the optimal one, followed from `shortest_fiber` to 2, on along
        its tangent beyond.
    tendon_force_length : callable or pair, optional
        f_SE of the tendon length over its slack length, followed from 1 to five maximum isometric
        forces, on along its tangent beyond. Without it the law is for rigid tendons.
    fiber_damping : float
        beta of a damper beside the fibre.
    shortest_fiber : float
        The fibre stops here [optimal fibre lengths].

    Raises
    ------
    ParameterError
        A curve is not what its name says; names the law, the curve, the place and the value.
        f_l is not negative and has its maximum of 1 at 1, f_v increases through f_v(-1) = 0 and
        f_v(0) = 1, f_PE does not decrease, f_SE does not decrease from f_SE(1) = 0 to 1 at least.
        With an elastic tendon and without damping f_l is at least 1e-4 and the slope of f_v 1e-3.

    Examples
    --------
    >>> law = CustomLaw(
    ...     "points and formulas",
    ...     active_force_length=([0.4, 0.7, 1.0, 1.3, 1.8], [0.02, 0.7, 1.0, 0.7, 0.02]),
    ...     force_velocity=lambda v: (1 + v) / (1 - 4 * v) if v < 0 else 1.4 - 0.4 / (1 + 12.5 * v),
    ...     passive_force_length=lambda x: 4 * max(x - 1, 0) ** 2,
    ...     tendon_force_length=lambda x: (20 * max(x - 1, 0)) ** 2,
    ... )
    >>> law.curves().active_force_length([0.7, 0.85, 1.0]).round(4)
    array([0.7  , 0.902, 1.   ])
    """

    name: str
    _: KW_ONLY
    active_force_length: Given = field(repr=False)
    force_velocity: Given = field(repr=False)
    passive_force_length: Given = field(repr=False)
    tendon_force_length: Given | None = field(default=None, repr=False)
    fiber_damping: float = 0.0
    shortest_fiber: float = 0.2

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise ParameterError(f"a law's name is a non-empty string, got {self.name!r}")
        for number, high, unit in (
            ("fiber_damping", 10.0, ""),
            ("shortest_fiber", 0.8, "optimal fiber lengths"),
        ):
            value = number_within(self._label(number), getattr(self, number), 0.0, high, unit)
            object.__setattr__(self, number, value)
        for curve in ("active_force_length", "force_velocity", "passive_force_length"):
            self._keep(curve)
        if self.tendon_force_length is not None:
            self._keep("tendon_force_length")
        self.curves(self.tendon_force_length is not None)  # complains, if there is a reason to

    def make_curves(self, elastic: bool) -> HillCurves:
        undamped = self.tendon_force_length is not None and self.fiber_damping < UNDAMPED
        force_velocity = self._force_velocity(undamped)
        return HillCurves(
            self._active_force_length(undamped),
            force_velocity,
            _inverse(force_velocity, 0.0 if undamped else STARTING_SLOPE),
            self._passive_force_length(),
            None if self.tendon_force_length is None else self._tendon_force_length(),
        )

    # The curves and what is expected of them.

    def _active_force_length(self, undamped: bool) -> Curve:
        name = "active_force_length"
        curve = self._curve(name, (self.shortest_fiber, LONGEST), (0.0, 0.0))
        x, y = _samples(curve)
        if undamped:
            rule = f"an elastic tendon without fiber_damping needs {LEAST_ACTIVE:g} at least"
            self._require(name, x, y, y >= LEAST_ACTIVE - ROUNDING, rule)
        self._require(name, x, y, y >= -ROUNDING, "it must not be negative")
        top = [np.argmax(y)]
        good = (np.abs(x - 1.0) <= PEAK) & (np.abs(y - 1.0) <= PEAK)
        rule = f"this is its maximum, which has to be 1 at x = 1, both within {PEAK:g}"
        self._require(name, x[top], y[top], good[top], rule)
        return curve

    def _force_velocity(self, undamped: bool) -> Curve:
        name = "force_velocity"
        curve = self._curve(name, (-FASTEST, FASTEST))
        x, y = _samples(curve, -1.0, 1.0)
        self._require_rising(name, x, y)
        if undamped:
            rule = f"an elastic tendon without fiber_damping needs a slope of {LEAST_SLOPE:g}"
            steep = _rising(x, y, LEAST_SLOPE)
            steep[[0, -1]] &= curve.derivative(x[[0, -1]]) >= LEAST_SLOPE
            self._require(name, x, y, steep, rule)
        for place, value, tolerance in ((0.0, 1.0, TOLERANCE), (-1.0, 0.0, STALL)):
            self._require_value(name, place, curve(place), value, tolerance)
        return curve

    def _passive_force_length(self) -> Curve:
        name = "passive_force_length"
        curve = self._curve(name, (self.shortest_fiber, LONGEST), (0.0, None))
        x, y = _samples(curve)
        self._require(name, x, y, y >= -TOLERANCE, "it must not be negative")
        self._require_rising(name, x, y)
        return curve

    def _tendon_force_length(self) -> Curve:
        """f_SE of the strain, which is small beside the length."""
        name = "tendon_force_length"
        ends = (1.0, 1.0)
        if callable(self.tendon_force_length):
            function = self._function(name)
            strain = 0.01
            while strain < LONGEST_TENDON - 1.0 and function(np.array([1.0 + strain])) < STRONGEST:
                strain *= 1.2
            ends = (1.0, min(1.0 + strain, LONGEST_TENDON))
        curve = self._curve(name, ends, (0.0, None), origin=1.0)
        self._require_value(name, 1.0, curve(0.0), 0.0, TOLERANCE)
        x, y = _samples(curve)
        self._require_rising(name, 1.0 + x, y)
        rule = "it has to reach 1 within its range"
        self._require(name, 1.0 + x[-1:], y[-1:], y[-1:] >= 1.0 - ROUNDING, rule)
        return curve

    # What the user gave.

    def _label(self, name: str) -> str:
        return f"law '{self.name}': {name}"

    def _keep(self, name: str) -> None:
        """Put what was given for a curve into a form that has a hash."""
        label, given = self._label(name), getattr(self, name)
        if callable(given):
            kept: Any = given.__call__ if given.__hash__ is None else given
        else:
            kept = _measured(label, given)
        object.__setattr__(self, name, kept)

    def _function(self, name: str) -> Callable[[np.ndarray], np.ndarray]:
        """What was given for a curve as a function of arrays."""
        from scipy.interpolate import PchipInterpolator  # slow to import

        label, given = self._label(name), getattr(self, name)
        return _of_arrays(label, given) if callable(given) else PchipInterpolator(*given)

    def _curve(
        self,
        name: str,
        ends: tuple[float, float],
        slopes: tuple[float | None, float | None] = (None, None),
        origin: float = 0.0,
    ) -> Curve:
        """A curve over x - origin; `ends` are those of a function."""
        function, given = self._function(name), getattr(self, name)
        breaks = [place - origin for place in (ends if callable(given) else given[0])]
        curve = Curve(lambda x: function(x + origin), breaks, slopes, self._label(name))
        x = curve.pieces[1:, ORIGIN]
        y = curve(x)
        good = (np.abs(np.diff(y, prepend=y[0])) < JUMP) | (np.diff(x, prepend=-np.inf) > CLOSE)
        self._require(name, x + origin, y, good, "it jumps to this value")
        return curve

    def _require(
        self, name: str, x: np.ndarray, y: np.ndarray, good: np.ndarray, rule: str
    ) -> None:
        """Raise ParameterError that names the first place that is not good."""
        for k in np.flatnonzero(~good)[:1]:
            raise ParameterError(f"{self._label(name)} is {y[k]:.4g} at x = {x[k]:.4g}; {rule}")

    def _require_rising(self, name: str, x: np.ndarray, y: np.ndarray) -> None:
        self._require(name, x, y, _rising(x, y, 0.0), "it must not decrease")

    def _require_value(
        self, name: str, x: float, y: np.ndarray, value: float, tolerance: float
    ) -> None:
        rule = f"it has to be {value:g} within {tolerance:g}"
        places, values = np.atleast_1d(x, y)
        self._require(name, places, values, np.abs(values - value) <= tolerance, rule)


def _measured(label: str, given: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Checked points as tuples."""
    try:
        x, y = (np.array(part, dtype=float) for part in given)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{label} is a function or a pair (x, y) of measured points, got {type(given).__name__}"
        ) from None
    if x.ndim != 1 or x.shape != y.shape or x.size < FEWEST_POINTS:
        raise ParameterError(
            f"{label}: x {x.shape} and y {y.shape} of measured points do not fit: expected (k,) "
            f"and (k,) with k of at least {FEWEST_POINTS}"
        )
    for k in np.flatnonzero(~(np.isfinite(x) & np.isfinite(y)))[:1]:
        raise ParameterError(f"{label}: point {k} is not finite: ({x[k]:g}, {y[k]:g})")
    for k in np.flatnonzero(np.diff(x) <= 0.0)[:1]:
        raise ParameterError(
            f"{label}: x of measured points has to increase, but {x[k + 1]:g} follows {x[k]:g}"
        )
    return tuple(x.tolist()), tuple(y.tolist())


def _of_arrays(label: str, function: Callable) -> Callable[[np.ndarray], np.ndarray]:
    """A function of arrays from one of arrays or of single numbers."""

    def one(x: float) -> float:
        try:
            return float(function(x))
        except Exception as error:
            raise ParameterError(
                f"{label} fails at x = {x:.6g}: {type(error).__name__}: {error}"
            ) from error

    def every(x: np.ndarray) -> np.ndarray:
        y = np.empty(0)
        with np.errstate(all="ignore"):
            with suppress(Exception):  # written for single numbers
                y = np.asarray(function(x.copy()), dtype=float)
            if y.shape != x.shape:
                y = np.array([one(place) for place in x.tolist()])
        for k in np.flatnonzero(~np.isfinite(y))[:1]:
            raise ParameterError(f"{label} is not finite at x = {x[k]:.6g}: {y[k]}")
        return y

    return every


def _inverse(curve: Curve, slope: float) -> Curve:
    """The x at which a curve plus `slope` x, which increase, have a value."""
    from scipy.optimize.elementwise import find_root  # slow to import

    low, high = curve.range
    least, most = (float(curve(x) + slope * x) for x in (low, high))

    def function(y: np.ndarray) -> np.ndarray:
        return find_root(
            lambda x, y: curve(x) + slope * x - y,
            (np.full_like(y, low), np.full_like(y, high)),
            args=(np.clip(y, least, most),),
        ).x

    return Curve(function, (least, most))


def _samples(
    curve: Curve, low: float | None = None, high: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Values of a curve over its range or another one."""
    first, last = curve.range
    x = np.linspace(first if low is None else low, last if high is None else high, SAMPLES)
    return x, curve(x)


def _rising(x: np.ndarray, y: np.ndarray, slope: float) -> np.ndarray:
    """Whether the slope up to each place is no smaller."""
    return np.diff(y, prepend=y[0]) >= slope * np.diff(x, prepend=x[0]) - ROUNDING
