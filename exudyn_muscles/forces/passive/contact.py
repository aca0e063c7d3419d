"""Contact of a sphere with a half-space or another sphere, after Hunt and Crossley, with Stribeck
friction.

With the indentation d, the normal speed d' and the slip speed s, k and c of both surfaces together
and the sphere's radius R, of two spheres R_1 R_2 / (R_1 + R_2),

    f_H = 4/3 k d sqrt(R k d)    f = f_H (1 + 3/2 c d')    friction f mu(s)

    mu = min(s/v_t, 1) (mu_d + 2 (mu_s - mu_d) / (1 + (s/v_t)^2)) + mu_v s

The smooth form has d replaced by sqrt(d^2 + c_f) and both transitions by tanh.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np

from ...checks import link_number, number_within, three_numbers
from ...errors import ParameterError
from ...numerics.kernel import kernel
from ...path.pulls import FORCE, ON_LINK, POINT, PULL_COLUMNS
from .between_frames import add_to_both, placed
from .on_coordinates import LARGEST

# Columns of their table: links of half-space and sphere, the half-space's frame, the sphere's
# center and radius, numbers in the order of `GIVEN_NUMBERS`, whether it is smooth, R, and the other
# sphere's radius.
LINKS, POSE, CENTER, RADIUS, GIVEN, COLUMNS = 0, 2, 14, 17, 18, 31
GIVEN_NUMBERS = (
    "stiffness", "dissipation", "static_friction", "dynamic_friction", "viscous_friction",
    "transition_velocity", "share", "constant_contact_force", "hertz_smoothing",
    "hunt_crossley_smoothing",
)  # fmt: skip
SMOOTH = GIVEN + len(GIVEN_NUMBERS)
EFFECTIVE, OTHER = SMOOTH + 1, SMOOTH + 2
K, C, MU_S, MU_D, MU_V, V_T, SHARE, C_F, B_D, B_V = range(GIVEN, SMOOTH)


@dataclass(frozen=True, eq=False)
class SphereContact:
    """A sphere on one link and a half-space, or another sphere, on another, or on ground.

    Parameters
    ----------
    name : str
    sphere, half_space : int
        Links of a kinematic tree; -1 is ground.
    center : (3,) sequence of float
        Of the sphere, on its link [m].
    radius : float
        [m]
    frame : (4, 4) array_like
        Of the half-space, on its link: it is where x is positive.
    other_radius : float
        Of a sphere about the frame's origin in place of the half-space; 0: there is none.
    stiffness : float
        k: stiffness^(2/3) of both materials as springs in series [N^(2/3)/m^(4/3)].
    dissipation : float
        c [s/m]
    static_friction, dynamic_friction : float
    viscous_friction : float
        [s/m]
    transition_velocity : float
        v_t [m/s]
    share : float
        Part of the indentation that the sphere takes.
    smooth : bool
        The smooth form, with the three numbers that follow.
    constant_contact_force : float
        c_f [m^2]; in friction [m^2/s^2].
    hertz_smoothing : float
        [1/m]
    hunt_crossley_smoothing : float
        [s/m]

    Raises
    ------
    ParameterError
        A number is out of its range.
    """

    name: str
    _: KW_ONLY
    sphere: int
    half_space: int
    center: Sequence[float]
    radius: float
    frame: np.ndarray
    stiffness: float
    dissipation: float
    static_friction: float = 0.0
    dynamic_friction: float = 0.0
    viscous_friction: float = 0.0
    transition_velocity: float = 0.01
    other_radius: float = 0.0
    share: float = 0.5
    smooth: bool = False
    constant_contact_force: float = 1e-5
    hertz_smoothing: float = 300.0
    hunt_crossley_smoothing: float = 50.0

    def __post_init__(self) -> None:
        what = f"contact '{self.name}'"
        for name in ("sphere", "half_space"):
            link = link_number(f"{what}: {name}", getattr(self, name))
            object.__setattr__(self, name, link)
        object.__setattr__(self, "center", three_numbers(f"{what}: center", self.center, "m"))
        for name in ("radius", "other_radius", *GIVEN_NUMBERS):
            least = 1e-12 if name in ("radius", "transition_velocity") else 0.0
            value = number_within(f"{what}: {name}", getattr(self, name), least, LARGEST)
            object.__setattr__(self, name, value)
        if self.share > 1.0:
            raise ParameterError(f"{what}: share = {self.share:g} is outside [0, 1]")
        if self.smooth and self.other_radius:
            raise ParameterError(f"{what}: the smooth form is of a half-space")


def contact_row(force: SphereContact) -> np.ndarray:
    """A contact's row."""
    row = np.zeros(COLUMNS)
    row[LINKS:POSE] = force.half_space, force.sphere
    H = np.asarray(force.frame, dtype=float)
    row[POSE:CENTER] = np.r_[H[:3, :3].ravel(), H[:3, 3]]
    row[CENTER:RADIUS], row[RADIUS] = force.center, force.radius
    row[GIVEN:SMOOTH] = [getattr(force, name) for name in GIVEN_NUMBERS]
    row[SMOOTH], row[OTHER] = force.smooth, force.other_radius
    row[EFFECTIVE] = force.radius
    if force.other_radius:
        row[EFFECTIVE] /= 1.0 + force.radius / force.other_radius
    return row


@kernel
def normal_force(row, d, d_rate):
    """The force across the surface, at an indentation and its rate."""
    k, c, radius = row[K], row[C], row[EFFECTIVE]
    if row[SMOOTH] == 0.0:
        if d <= 0.0:
            return 0.0
        return max(4.0 / 3.0 * k * d * math.sqrt(radius * k * d) * (1.0 + 1.5 * c * d_rate), 0.0)
    hertz = 4.0 / 3.0 * k * math.sqrt(radius * k) * math.sqrt(d * d + row[C_F]) ** 1.5
    hertz *= 0.5 + 0.5 * math.tanh(row[B_D] * d)
    falling = 0.5 + 0.5 * math.tanh(row[B_V] * (d_rate + 2.0 / (3.0 * c)))
    return hertz * (1.0 + 1.5 * c * d_rate) * falling


@kernel
def friction(row, slip):
    """mu at a slip speed."""
    ratio = slip / row[V_T]
    mu = row[MU_D] + 2.0 * (row[MU_S] - row[MU_D]) / (1.0 + ratio * ratio)
    return min(ratio, 1.0) * mu + row[MU_V] * slip


@kernel(allocates=True)
def towards(way, R):
    """Write a rotation R (3, 3) whose x points along a way (3,), which is not zero."""
    x = way / math.sqrt(way @ way)
    least = np.abs(x).argmin()
    y = -x[least] * x
    y[least] += 1.0
    y /= math.sqrt(y @ y)
    R[:, 0], R[:, 1], R[:, 2] = x, y, np.cross(x, y)


@kernel(allocates=True)
def add_contact(joints, parents, R, p, axes, row, v, Q):
    """Add a contact's generalized forces to Q (N,), at the speeds v (N,) of the tree."""
    n, links = v.size, row[LINKS:POSE]
    R_h, x_h, center = np.empty((3, 3)), np.empty(3), np.empty(3)
    placed(R, p, int(links[0]), row[POSE:CENTER], R_h, x_h)
    number = int(links[1])
    for i in range(3):
        center[i] = row[CENTER + i]
        if number >= 0:
            center[i] = p[number, i]
            for k in range(3):
                center[i] += R[number, i, k] * row[CENTER + k]
    if row[OTHER] > 0.0:
        towards(x_h - center, R_h)
    d = row[RADIUS] + row[OTHER]
    for i in range(3):
        d += R_h[i, 0] * (center[i] - x_h[i])
    if row[SMOOTH] == 0.0 and d <= 0.0:
        return
    values, rows, rates = np.zeros(PULL_COLUMNS), np.zeros((3, n)), np.zeros(3)
    for k in range(3):
        for i in range(3):
            values[FORCE + i] = R_h[i, k]
            # Both surfaces give way: the force is where they meet.
            values[POINT + i] = center[i] + (row[RADIUS] - row[SHARE] * d) * R_h[i, 0]
        add_to_both(joints, parents, p, axes, ON_LINK, links, values, rows[k])
        for j in range(n):
            rates[k] += rows[k, j] * v[j]
    f = normal_force(row, d, rates[0])
    slipping = rates[1] * rates[1] + rates[2] * rates[2]
    slip = math.sqrt(slipping + (row[C_F] if row[SMOOTH] != 0.0 else 0.0))
    tangential = f * friction(row, slip) / slip if slip > 0.0 else 0.0
    for j in range(n):
        Q[j] -= f * rows[0, j] + tangential * (rates[1] * rows[1, j] + rates[2] * rows[2, j])
