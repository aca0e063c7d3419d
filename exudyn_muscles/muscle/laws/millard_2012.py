"""The curves of Millard et al. (2013) as in OpenSim's `Millard2012EquilibriumMuscle`.

M. Millard, T. Uchida, A. Seth, S. L. Delp, "Flexing computational muscle: modeling and simulation
of musculotendon dynamics", Journal of Biomechanical Engineering 135 (2013), 021005.

Every curve is a chain of quintic Bezier segments. A segment joins two points with given slopes: its
six control points are the two ends, each end's two neighbours moved together towards the crossing
of the two end tangents.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...errors import ParameterError
from ...numerics.curves import Curve
from .law import UNDAMPED, HillCurves, MuscleLaw

# Constants of OpenSim's curve classes that no property of a model changes.
ACTIVE_CURVINESS = 1.0
NEAR_VMAX = 0.9  # where the slope "near vmax" holds
PASSIVE_STIFFNESS = 2.0  # at F0, times the strain from zero force to F0
# Undamped, OpenSim keeps f_l above this, and the slopes of f_v at v_max above this part of those
# near it.
ACTIVE_FLOOR = 0.1
SLOPE_SHARE = 0.5
BISECTIONS, NEWTON = 10, 5  # for a segment's parameter


class Point(NamedTuple):
    """A joint of two segments."""

    x: float
    y: float
    slope: float


def corner(start: Point, end: Point, curviness: float) -> np.ndarray:
    """Control points (2, 6) of the segment between two points."""
    c = 0.1 + 0.8 * curviness
    x = (end.y - start.y - end.x * end.slope + start.x * start.slope) / (start.slope - end.slope)
    crossing = np.array([x, start.y + (x - start.x) * start.slope])
    first, last = np.array(start[:2]), np.array(end[:2])
    near_first, near_last = first + c * (crossing - first), last + c * (crossing - last)
    return np.array([first, near_first, near_first, near_last, near_last, last]).T


def bernstein(points: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Value and derivative at the parameter `u` of the polynomial with six control values."""
    w = 1.0 - u
    basis = [w**5, 5 * u * w**4, 10 * u**2 * w**3, 10 * u**3 * w**2, 5 * u**4 * w, u**5]
    slope_basis = [w**4, 4 * u * w**3, 6 * u**2 * w**2, 4 * u**3 * w, u**4]
    value = sum(p * b for p, b in zip(points, basis, strict=True))
    slope = sum(5.0 * p * b for p, b in zip(np.diff(points), slope_basis, strict=True))
    return value, slope


@cache  # the muscles of a model often differ in one of their curves only
def bezier(joints: tuple[Point, ...], curviness: tuple[float, ...], inverse: bool = False) -> Curve:
    """The chain of segments through the joints, y of x or x of y.

    The parameter of an x is found by bisection and, from close by, Newton's method.
    """
    segments = [
        corner(start, end, c) for (start, end), c in zip(pairwise(joints), curviness, strict=True)
    ]
    across, along = (1, 0) if inverse else (0, 1)
    edges = np.array([joint[across] for joint in joints])

    def function(x: np.ndarray) -> np.ndarray:
        which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(segments) - 1)
        y = np.empty_like(x)
        for k, segment in enumerate(segments):
            place = x[which == k]
            low, high = np.zeros_like(place), np.ones_like(place)
            for _ in range(BISECTIONS):
                u = 0.5 * (low + high)
                below = bernstein(segment[across], u)[0] < place
                low, high = np.where(below, u, low), np.where(below, high, u)
            for _ in range(NEWTON):
                value, slope = bernstein(segment[across], u)
                u = np.clip(u + (place - value) / slope, 0.0, 1.0)
            y[which == k] = bernstein(segment[along], u)[0]
        return y

    slopes = [1.0 / joint.slope if inverse else joint.slope for joint in (joints[0], joints[-1])]
    return Curve(function, edges.tolist(), (slopes[0], slopes[1]))


@dataclass(frozen=True, kw_only=True)
class Millard2012(MuscleLaw):
    """OpenSim's `Millard2012EquilibriumMuscle`, damped (the default) or undamped.

    Parameters
    ----------
    fiber_damping : float
        beta; 0 (below 0.001) gives the undamped form, with `minimum_value` as the floor of f_l.
    min_norm_active_fiber_length, transition_norm_fiber_length, max_norm_active_fiber_length : float
        Start, shoulder and end of f_l.
    shallow_ascending_slope, minimum_value : float
        Slope below the plateau; floor of f_l in undamped units with an elastic tendon.
    concentric_slope_at_vmax, concentric_slope_near_vmax, isometric_slope : float
        Slopes of f_v.
    eccentric_slope_at_vmax, eccentric_slope_near_vmax : float
        Slopes of f_v.
    max_eccentric_velocity_force_multiplier : float
        f_v at the maximum velocity of lengthening.
    concentric_curviness, eccentric_curviness : float
        How sharply f_v bends, between 0 and 1.
    fiber_strain_at_zero_force, fiber_strain_at_one_norm_force : float
        Fibre strains where f_PE begins and is one.
    fiber_stiffness_at_low_force, fiber_stiffness_at_one_norm_force : float
        Slopes of f_PE where it begins and is one; the latter 2 over the difference of both strains
        if left out.
    fiber_curviness, tendon_curviness : float
        How sharply f_PE and f_SE bend, between 0 and 1.
    tendon_stiffness : float
        Slope of f_SE at F0 times the tendon strain there.
    norm_force_at_toe_end : float
        f_SE where its straight part begins.
    """

    fiber_damping: float = 0.1
    min_norm_active_fiber_length: float = 0.4441
    transition_norm_fiber_length: float = 0.73
    max_norm_active_fiber_length: float = 1.8123
    shallow_ascending_slope: float = 0.8616
    minimum_value: float = ACTIVE_FLOOR
    concentric_slope_at_vmax: float = 0.0
    concentric_slope_near_vmax: float = 0.25
    isometric_slope: float = 5.0
    eccentric_slope_at_vmax: float = 0.0
    eccentric_slope_near_vmax: float = 0.15
    max_eccentric_velocity_force_multiplier: float = 1.4
    concentric_curviness: float = 0.6
    eccentric_curviness: float = 0.9
    fiber_strain_at_zero_force: float = 0.0
    fiber_strain_at_one_norm_force: float = 0.7
    fiber_stiffness_at_low_force: float = 0.2
    fiber_stiffness_at_one_norm_force: float | None = None
    fiber_curviness: float = 0.75
    tendon_stiffness: float = 1.375
    norm_force_at_toe_end: float = 2.0 / 3.0
    tendon_curviness: float = 0.5

    tendon_strain_at_one_norm_force = 0.049  # not a field

    def __post_init__(self) -> None:
        self.keep_number("fiber_damping", 0.0, 10.0)
        if self.fiber_damping < UNDAMPED:
            object.__setattr__(self, "fiber_damping", 0.0)
        self.keep_number("min_norm_active_fiber_length", 0.01, 0.9)
        low = self.min_norm_active_fiber_length
        for name, least, most in (
            ("transition_norm_fiber_length", low + 0.01, 0.94),
            ("max_norm_active_fiber_length", 1.2, 5.0),
            ("shallow_ascending_slope", 0.01, 1.0 / (1.0 - low)),
            ("minimum_value", 0.0, 0.4),
            ("concentric_slope_at_vmax", 0.0, 0.99),
            ("concentric_slope_near_vmax", 0.01, 0.99),
            ("isometric_slope", 1.1, 100.0),
            ("max_eccentric_velocity_force_multiplier", 1.05, 5.0),
            ("eccentric_slope_at_vmax", 0.0, 1.0),
            ("eccentric_slope_near_vmax", 0.01, 1.0),
            ("fiber_strain_at_zero_force", -0.5, 2.0),
            ("concentric_curviness", 0.0, 1.0),
            ("eccentric_curviness", 0.0, 1.0),
            ("fiber_stiffness_at_low_force", 1e-6, 100.0),
            ("fiber_curviness", 0.0, 1.0),
            ("tendon_stiffness", 1.001, 100.0),
            ("norm_force_at_toe_end", 0.01, 0.99),
            ("tendon_curviness", 0.0, 1.0),
        ):
            self.keep_number(name, least, most)
        least = self.fiber_strain_at_zero_force + 0.01
        self.keep_number("fiber_strain_at_one_norm_force", least, 10.0)
        if self.fiber_stiffness_at_one_norm_force is not None:
            self.keep_number("fiber_stiffness_at_one_norm_force", 0.01, 1e4)

        for floored in (True, False):
            check_corners("active force-length curve", self._active_joints(floored))
            check_corners("force-velocity curve", self._velocity_joints(floored))
        check_corners("passive force-length curve", self._passive_joints())
        check_corners("tendon force-length curve", self._tendon_joints())

    @property
    def shortest_fiber(self) -> float:  # type: ignore[override]
        """OpenSim stops the fibre where the active curve begins."""
        return self.min_norm_active_fiber_length

    def make_curves(self, elastic: bool) -> HillCurves:
        floored = elastic and self.fiber_damping == 0.0
        invertible = self._velocity_joints(True)
        velocity = (self.concentric_curviness,) * 2 + (self.eccentric_curviness,) * 2
        return HillCurves(
            bezier(tuple(self._active_joints(floored)), (ACTIVE_CURVINESS,) * 5),
            bezier(tuple(self._velocity_joints(floored)), velocity),
            bezier(tuple(invertible), velocity, inverse=True),
            bezier(tuple(self._passive_joints()), (self.fiber_curviness,) * 2),
            bezier(tuple(self._tendon_joints()), (self.tendon_curviness,) * 2),
        )

    def _active_joints(self, floored: bool) -> list[Point]:
        """Joints of f_l, with a floor that can be divided by or without."""
        x_0, x_1, x_3 = (
            self.min_norm_active_fiber_length,
            self.transition_norm_fiber_length,
            self.max_norm_active_fiber_length,
        )
        floor = max(self.minimum_value, ACTIVE_FLOOR) if floored else 0.0
        plateau = 0.05  # half its width
        y_1 = 1.0 - self.shallow_ascending_slope * (1.0 - plateau - x_1)
        return [
            Point(x_0, floor, 0.0),
            Point(0.5 * (x_0 + x_1), 0.5 * y_1, 1.25 * y_1 / (x_1 - x_0)),
            Point(0.5 * (x_1 + 1.0 - plateau), 0.5 * (y_1 + 1.0), self.shallow_ascending_slope),
            Point(1.0, 1.0, 0.0),
            Point(0.5 * (1.0 + plateau + x_3), 0.5, -1.0 / (x_3 - 1.0 - 2.0 * plateau)),
            Point(x_3, floor, 0.0),
        ]

    def _velocity_joints(self, floored: bool) -> list[Point]:
        """Joints of f_v, with slopes at the maximum velocities that can be inverted or without."""
        near_c, near_e = self.concentric_slope_near_vmax, self.eccentric_slope_near_vmax
        slopes = (0.0, 0.0)
        if floored:
            slopes = (
                max(self.concentric_slope_at_vmax, SLOPE_SHARE * near_c),
                max(self.eccentric_slope_at_vmax, SLOPE_SHARE * near_e),
            )
        far, most = 1.0 - NEAR_VMAX, self.max_eccentric_velocity_force_multiplier
        return [
            Point(-1.0, 0.0, slopes[0]),
            Point(-NEAR_VMAX, 0.5 * far * (near_c + slopes[0]), near_c),
            Point(0.0, 1.0, self.isometric_slope),
            Point(NEAR_VMAX, most - 0.5 * far * (near_e + slopes[1]), near_e),
            Point(1.0, most, slopes[1]),
        ]

    def _passive_joints(self) -> list[Point]:
        """Joints of f_PE."""
        start = 1.0 + self.fiber_strain_at_zero_force
        end = 1.0 + self.fiber_strain_at_one_norm_force
        low, stiffness = self.fiber_stiffness_at_low_force, self.fiber_stiffness_at_one_norm_force
        if stiffness is None:
            stiffness = PASSIVE_STIFFNESS / (end - start)
        toe = min(0.1 / stiffness, 0.1 * (end - start))
        return [
            Point(start, 0.0, 0.0),
            Point(start + toe, low * 0.5 * toe, low),
            Point(end, 1.0, stiffness),
        ]

    def _tendon_joints(self) -> list[Point]:
        """Joints of f_SE over the tendon strain over its value at one F0: it scales with that."""
        stiffness, toe_force = self.tendon_stiffness, self.norm_force_at_toe_end
        toe = 1.0 - (1.0 - toe_force) / stiffness
        foot = 0.1 * toe
        middle = 1.0 - (1.0 - 0.5 * toe_force) / stiffness
        slope = 0.5 * toe_force / (middle - foot)
        return [
            Point(0.0, 0.0, 0.0),
            Point(0.5 * (foot + middle), 0.5 * slope * (middle - foot), slope),
            Point(toe, toe_force, stiffness),
        ]


def check_corners(name: str, joints: Sequence[Point]) -> None:
    """Raise ParameterError where a curve would not bend one way only between two joints."""
    for start, end in pairwise(joints):
        steepness = (end.y - start.y) / (end.x - start.x)
        low, high = sorted([start.slope, end.slope])
        if not low < steepness < high:
            raise ParameterError(
                f"Millard2012: {name}: no smooth corner from x = {start.x:.4g} to {end.x:.4g}: the "
                f"slope between them, {steepness:.4g}, is outside ({low:.4g}, {high:.4g})"
            )
