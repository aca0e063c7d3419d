"""What closes loops of a kinematic tree: a constant distance, a common point, a line, a weld.

Each is one or more equations phi(q) = 0 between two frames on links, whose rates are

    phi' = G q',    phi'' = G q'' + gamma(q, q').
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from ..checks import check_link_exists, link_number, number_within
from ..errors import ParameterError
from ..forces.jacobian import ON_LINK_AS_TORQUE, PRISMATIC
from ..forces.passive.between_frames import add_to_both
from ..forces.passive.on_coordinates import LARGEST
from ..numerics.kernel import kernel
from ..path.frames import turned
from ..path.geodesic import dot
from ..path.pulls import FORCE, ON_LINK, POINT, PULL_COLUMNS
from ..path.rope import cross
from .tree import link_frames

# Kinds of equations: |x_1 - x_0| = d, u_0 . (x_1 - x_0) = 0, and u_0 . w_1 = 0.
APART, ALONG, ACROSS = range(3)
# Columns of an equation: kind, links, points and axes in their frames, and d.
KIND, LINKS, POINT_0, POINT_1, AXIS_0, AXIS_1, DISTANCE, COLUMNS = (
    0, slice(1, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 15), 15, 16
)  # fmt: skip

NO_ROTATION = 1e-6  # of R^T R - 1: files have six digits


class ClosureKind(Enum):
    """What two frames have to do with one another."""

    DISTANCE = "their origins are as far from one another as they are told to be"
    POINT = "their origins are the same point"
    LINE = "the second one's origin is on the first one's z axis"
    WELD = "they are the same frame"


@dataclass(frozen=True)
class Closure:
    """A constraint between two frames on links, which closes a loop of the tree.

    Parameters
    ----------
    kind : ClosureKind
    link_0, link_1 : int
        -1 is ground.
    frame_0, frame_1 : (4, 4) array_like
        In the links' frames.
    distance : float
        [m], of `ClosureKind.DISTANCE` alone.
    name : str
        For messages.
    """

    kind: ClosureKind
    link_0: int
    link_1: int
    frame_0: Sequence[Sequence[float]] = field(default_factory=lambda: np.eye(4).tolist())
    frame_1: Sequence[Sequence[float]] = field(default_factory=lambda: np.eye(4).tolist())
    distance: float = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        what = f"closure '{self.name}'"
        if not isinstance(self.kind, ClosureKind):
            raise ParameterError(f"{what}: kind is a ClosureKind, got {self.kind!r}")
        for name in ("link_0", "link_1"):
            object.__setattr__(self, name, link_number(f"{what}: {name}", getattr(self, name)))
        for name in ("frame_0", "frame_1"):
            H = np.array(getattr(self, name), dtype=float)
            if H.shape != (4, 4) or not np.isfinite(H).all():
                raise ParameterError(f"{what}: {name} is a finite (4, 4) matrix")
            turn = H[:3, :3]
            if np.abs(turn.T @ turn - np.eye(3)).max() > NO_ROTATION or np.linalg.det(turn) < 0.0:
                raise ParameterError(f"{what}: {name} does not turn by a rotation, got {turn}")
            object.__setattr__(self, name, H.tolist())
        if self.kind is ClosureKind.DISTANCE:
            number_within(f"{what}: distance", self.distance, 1e-9, LARGEST)
        elif self.distance:
            raise ParameterError(f"{what}: distance = {self.distance!r} is of a DISTANCE alone")


@dataclass(frozen=True)
class Loops:
    """The closed loops of a kinematic tree.

    Closures hold as many coordinates as they determine, which become dependent ones.

    Parameters
    ----------
    closures : sequence of Closure
        They may be redundant as long as they do not contradict each other.
    held_first : sequence of str
        Coordinates in the order in which they may be held; others follow, the last one first. One
        that moves nearly as those that are held already stays independent.
    """

    closures: Sequence[Closure]
    held_first: Sequence[str] = ()

    def __post_init__(self) -> None:
        closures = tuple(self.closures)
        if not closures or not all(isinstance(each, Closure) for each in closures):
            raise ParameterError(f"closures are one or more Closure objects, got {self.closures!r}")
        object.__setattr__(self, "closures", closures)
        if isinstance(self.held_first, str):
            raise ParameterError(f"held_first is a sequence of names, got {self.held_first!r}")
        object.__setattr__(self, "held_first", tuple(self.held_first))


def closure_rows(closures: Sequence[Closure], links: int) -> np.ndarray:
    """The equations (c, COLUMNS) of closures on a tree with so many links.

    Raises
    ------
    ParameterError
        A closure names a link that the tree does not have.
    """
    return np.array([row for each in closures for row in _rows(each, links)])


def _rows(closure: Closure, links: int) -> list[np.ndarray]:
    for link in (closure.link_0, closure.link_1):
        check_link_exists(f"closure '{closure.name}'", link, links)
    H_0, H_1 = np.array(closure.frame_0), np.array(closure.frame_1)
    common = np.zeros(COLUMNS)
    common[LINKS] = closure.link_0, closure.link_1
    common[POINT_0], common[POINT_1] = H_0[:3, 3], H_1[:3, 3]
    common[DISTANCE] = closure.distance
    if closure.kind is ClosureKind.DISTANCE:
        return [common]
    rows = []
    for axis in range(2 if closure.kind is ClosureKind.LINE else 3):
        row = common.copy()
        row[KIND], row[AXIS_0] = ALONG, H_0[:3, axis]
        rows.append(row)
    if closure.kind is ClosureKind.WELD:
        for axis in range(3):
            row = common.copy()
            row[KIND], row[AXIS_0], row[AXIS_1] = ACROSS, H_0[:3, axis], H_1[:3, (axis + 1) % 3]
            rows.append(row)
    return rows


@kernel(allocates=True)
def link_motion(joints, parents, p, axes, q_t, motion):
    """Write the motion (n, 4, 3) of all links at speeds q' with q'' = 0: angular velocity and
    acceleration, velocity and acceleration of the origin."""
    turning, arm, spare = np.empty(3), np.empty(3), np.empty(3)
    for i in range(joints.size):
        k = parents[i]
        here = motion[i]
        here[:] = 0.0
        if k >= 0:
            here[:2] = motion[k, :2]
            move(motion[k], p[i] - p[k], here[2], here[3], arm)
        turning[:] = axes[i] * q_t[i]
        cross(here[0], turning, spare)
        if joints[i] >= PRISMATIC:
            here[2] += turning
            here[3] += 2.0 * spare
        else:
            here[0] += turning
            here[1] += spare


@kernel
def move(motion, arm, v, a, spare):
    """Write velocity and acceleration of a point that a link with this motion (4, 3) has at `arm`
    from its origin."""
    cross(motion[0], arm, spare)
    cross(motion[0], spare, a)
    for i in range(3):
        v[i] = motion[2, i] + spare[i]
        a[i] += motion[3, i]
    cross(motion[1], arm, spare)
    for i in range(3):
        a[i] += spare[i]


@kernel(allocates=True)
def closure_equations(joints, parents, rotations, offsets, reference, rows, q, q_t, phi, G, gamma):
    """Write phi (c,), G (c, n) and gamma (c,) at q, q' (n,)."""
    n = joints.size
    R, p, axes, motion = (
        np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 4, 3))
    )  # fmt: skip
    link_frames(joints, parents, rotations, offsets, reference, q, R, p, axes)
    link_motion(joints, parents, p, axes, q_t, motion)
    # Of both links: their motion, the points' place, velocity and acceleration, and the axes.
    both, at, u = np.zeros((2, 4, 3)), np.empty((2, 3)), np.empty((2, 3))
    v, a = np.empty((2, 3)), np.empty((2, 3))
    force, spare, values, zero = np.empty(3), np.empty(3), np.zeros(PULL_COLUMNS), np.zeros(3)
    for k in range(rows.shape[0]):
        row = rows[k]
        kind, links = int(row[KIND]), row[LINKS]
        for side in range(2):
            link = int(links[side])
            turned(R, link, row[POINT_1] if side else row[POINT_0], at[side])
            turned(R, link, row[AXIS_1] if side else row[AXIS_0], u[side])
            both[side] = 0.0
            if link >= 0:
                at[side] += p[link]
                both[side] = motion[link]
        apart = at[1] - at[0]
        for side in range(2):
            link = int(links[side])
            # Along a line the first link's own point is where the second one's is.
            point = at[1] if kind == ALONG else at[side]
            move(both[side], point - (p[link] if link >= 0 else zero), v[side], a[side], spare)
        speed, away = v[1] - v[0], a[1] - a[0]
        G[k] = 0.0
        values[POINT : POINT + 3] = at[1]
        if kind == APART:
            far = math.sqrt(dot(apart, apart))
            force[:] = apart / far
            phi[k] = far - row[DISTANCE]
            closing = dot(force, speed)
            gamma[k] = dot(force, away) + (dot(speed, speed) - closing * closing) / far
        elif kind == ALONG:
            force[:] = u[0]
            phi[k] = dot(force, apart)
            cross(both[0, 0], speed, spare)
            gamma[k] = dot(force, away) - 2.0 * dot(force, spare)
        else:
            values[POINT : POINT + 3] = 0.0
            cross(u[1], u[0], force)
            phi[k] = dot(u[0], u[1])
            gamma[k] = dot(both[1, 1] - both[0, 1], force)
            rate = both[1, 0] - both[0, 0]
            cross(both[1, 0], u[1], spare)
            cross(spare, u[0], speed)
            gamma[k] += dot(rate, speed)
            cross(both[0, 0], u[0], spare)
            cross(u[1], spare, speed)
            gamma[k] += dot(rate, speed)
        values[FORCE : FORCE + 3] = force
        as_torque = ON_LINK_AS_TORQUE if kind == ACROSS else ON_LINK
        add_to_both(joints, parents, p, axes, as_torque, links, values, G[k])
