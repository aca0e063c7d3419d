"""Forces between two frames: bushings.

Frame 2 is off frame 1 by the body-fixed angles about x, y and z and by the position in frame 1,
x = (theta, delta). What opposes it, f = -(K x + C x'), or formulas or curves of x in place of K x,
acts in these directions: its virtual work is f dx.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np

from ...checks import link_number, number_within
from ...errors import ParameterError
from ...numerics.curves import Curve, evaluate
from ...numerics.kernel import kernel
from ...path.pulls import FORCE, ON_LINK, POINT, PULL_COLUMNS
from ..jacobian import ON_LINK_AS_TORQUE, add_generalized
from .expressions import Program, program, run
from .on_coordinates import LARGEST

# Columns of their table: both links and frames on them, K, C, the first of six programs or -1, and
# of six curves or -1.
LINKS, POSES, STIFFNESS, DAMPING, PROGRAM, CURVE, COLUMNS = 0, 2, 26, 32, 38, 39, 40
VARIABLES = "theta_x", "theta_y", "theta_z", "delta_x", "delta_y", "delta_z"


@dataclass(frozen=True, eq=False)
class Bushing:
    """Springs and dampers between two frames in all six directions.

    Parameters
    ----------
    name : str
    links : pair of int
        Of a kinematic tree; -1 is ground.
    frames : pair of (4, 4) array_like
        On the links.
    stiffness, damping : (6,) sequence of float
        K, C: three of angles [N m/rad, N m s/rad], three of positions [N/m, N s/m].
    formulas : six str, optional
        Moments [N m] and forces [N] in place of K x, of theta_x ... delta_z; as in `expressions`.
    curves : six Curve, optional
        The same, each of its own angle [rad] or position [m].

    Raises
    ------
    ParameterError
        A number is not finite, a formula or curve is none, or there are both.
    """

    name: str
    _: KW_ONLY
    links: tuple[int, int]
    frames: tuple[np.ndarray, np.ndarray]
    stiffness: Sequence[float] = (0.0,) * 6
    damping: Sequence[float] = (0.0,) * 6
    formulas: Sequence[str] = ()
    curves: Sequence[Curve] = ()

    def __post_init__(self) -> None:
        what = f"bushing '{self.name}'"
        links = tuple(link_number(f"{what}: link", link) for link in self.links)
        object.__setattr__(self, "links", links)
        for name in ("stiffness", "damping"):
            given = getattr(self, name)
            if len(given) != len(VARIABLES):
                raise ParameterError(f"{what}: {name} is six numbers, got {len(given)}")
            for value in given:
                number_within(f"{what}: {name}", value, -LARGEST, LARGEST)
        for name in ("formulas", "curves"):
            if len(getattr(self, name)) not in (0, len(VARIABLES)):
                raise ParameterError(f"{what}: {name} are six, got {len(getattr(self, name))}")
        if self.curves and (self.formulas or not all(isinstance(c, Curve) for c in self.curves)):
            raise ParameterError(f"{what}: curves are Curve objects without formulas beside them")
        _ = self.programs

    @property
    def programs(self) -> list[Program]:
        """Of the formulas."""
        return [program(formula, VARIABLES) for formula in self.formulas]


def bushing_row(force: Bushing, program: int, curve: int) -> np.ndarray:
    """A bushing's row, with the numbers of its first program and curve."""
    row = np.zeros(COLUMNS)
    row[LINKS:POSES] = force.links
    frames = [np.asarray(frame, dtype=float) for frame in force.frames]
    row[POSES:STIFFNESS] = np.concatenate([np.r_[H[:3, :3].ravel(), H[:3, 3]] for H in frames])
    row[STIFFNESS:DAMPING], row[DAMPING:PROGRAM] = force.stiffness, force.damping
    row[PROGRAM] = program if force.formulas else -1.0
    row[CURVE] = curve if force.curves else -1.0
    return row


@kernel
def placed(R, p, link, given, rotation, position):
    """Write a frame's rotation (3, 3) and position (3,) in ground, from its twelve numbers."""
    for i in range(3):
        for j in range(3):
            rotation[i, j] = given[3 * i + j]
        position[i] = given[9 + i]
    if link < 0:
        return
    for i in range(3):
        position[i] = p[link, i]
        for k in range(3):
            position[i] += R[link, i, k] * given[9 + k]
        for j in range(3):
            rotation[i, j] = 0.0
            for k in range(3):
                rotation[i, j] += R[link, i, k] * given[3 * k + j]


@kernel
def add_to_both(joints, parents, p, axes, kind, links, values, Q):
    """Add what a force or torque on the second link, and against the first, is on coordinates."""
    if links[1] >= 0:
        add_generalized(joints, parents, p, axes, kind, int(links[1]), values, Q)
    if links[0] >= 0:
        for k in range(3):
            values[FORCE + k] = -values[FORCE + k]
        add_generalized(joints, parents, p, axes, kind, int(links[0]), values, Q)


@kernel(allocates=True)
def add_bushing(joints, parents, R, p, axes, row, curves, programs, v, stack, Q):
    """Add a bushing's generalized forces to Q (N,), at the speeds v (N,) of the tree."""
    n = v.size
    links = row[LINKS:POSES]
    R_1, R_2, x_1, x_2 = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    placed(R, p, int(links[0]), row[POSES : POSES + 12], R_1, x_1)
    placed(R, p, int(links[1]), row[POSES + 12 : STIFFNESS], R_2, x_2)
    R_12 = R_1.T @ R_2
    x, rows, values = np.empty(6), np.zeros((6, n)), np.zeros(PULL_COLUMNS)
    x[0] = math.atan2(-R_12[1, 2], R_12[2, 2])
    x[1] = math.asin(min(max(R_12[0, 2], -1.0), 1.0))
    x[2] = math.atan2(-R_12[0, 1], R_12[0, 0])
    # Axes of the angles' rates in frame 2: theta' = N omega, so that a moment is N^T f.
    s_1, c_1, s_2, c_2 = math.sin(x[1]), math.cos(x[1]), math.sin(x[2]), math.cos(x[2])
    N = np.zeros((3, 3))
    N[0, 0], N[0, 1] = c_2 / c_1, -s_2 / c_1
    N[1, 0], N[1, 1] = s_2, c_2
    N[2, 0], N[2, 1], N[2, 2] = -s_1 * c_2 / c_1, s_1 * s_2 / c_1, 1.0
    for k in range(3):
        x[3 + k] = 0.0
        for i in range(3):
            x[3 + k] += R_1[i, k] * (x_2[i] - x_1[i])
            values[FORCE + i] = R_2[i, 0] * N[k, 0] + R_2[i, 1] * N[k, 1] + R_2[i, 2] * N[k, 2]
        add_to_both(joints, parents, p, axes, ON_LINK_AS_TORQUE, links, values, rows[k])
        for i in range(3):
            values[POINT + i], values[FORCE + i] = x_2[i], R_1[i, k]
        add_to_both(joints, parents, p, axes, ON_LINK, links, values, rows[3 + k])
        for i in range(3):
            values[POINT + i] = 0.0
    for k in range(6):
        rate = 0.0
        for j in range(n):
            rate += rows[k, j] * v[j]
        f = row[STIFFNESS + k] * x[k]
        if row[PROGRAM] >= 0.0:
            f = run(programs, int(row[PROGRAM]) + k, x, stack)
        elif row[CURVE] >= 0.0:
            f = evaluate(curves, int(row[CURVE]) + k, x[k])[0]
        f += row[DAMPING + k] * rate
        for j in range(n):
            Q[j] -= f * rows[k, j]
