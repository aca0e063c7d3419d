"""External forces over time, such as a force plate's record, as loads of an Exudyn system.

A recorded force f, its point p and a free torque act on a link as a force at the origin o of the
link's frame and a torque about it,

    F = R_f f    T = (R_p p + o_p - o) x F + R_f tau,

with the pose o_p, R_p of the frame in which the point is given and the orientation R_f of that in
which the force is; both are ground or a link. Exudyn asks for F and T at every state that it
evaluates, so that they are part of Q in its own runs and in the inverse dynamics alike.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from functools import partial

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    LoadForceVector,
    LoadTorqueVector,
    MarkerBodyRigid,
    MarkerKinematicTreeRigid,
)

from ..checks import ItemNumber, MarkerNumber, check_link_exists
from ..errors import ParameterError
from ..forces.external import ExternalForce, cubics
from ..path.frames import GROUND
from .reading import tree_item

MARGIN = 1e-9  # s, accumulated time steps
NOTHING = [0.0] * 9

Vector = Sequence[float]


def add_external_force(
    mbs: exu.MainSystem, tree: int | None, external_force: ExternalForce
) -> tuple[int, ...]:
    """Add an external force to an Exudyn system, before `mbs.Assemble()`.

    It becomes a `LoadForceVector`, a `LoadTorqueVector` or both at the origin of the link's frame,
    called `<name>: force` and `<name>: torque`, with user functions.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    tree : ObjectIndex or None
        Of the `ObjectKinematicTree`; None where the force's links are bodies or markers, by their
        ObjectIndex or MarkerIndex.
    external_force : ExternalForce

    Returns
    -------
    tuple of LoadIndex
        The loads.

    Raises
    ------
    ModelError
        The object is not a kinematic tree.
    ParameterError
        The tree lacks a link that the force names.
    exudyn.ModelError
        The system has loads of these names.
    """
    acting = _Acting(mbs, _link_markers(mbs, tree, external_force), external_force)
    items = []
    if external_force.force is not None:
        items.append((LoadForceVector, "force", acting.force))
    if external_force.point is not None or external_force.torque is not None:
        items.append((LoadTorqueVector, "torque", acting.torque))
    return tuple(
        mbs.AddLoad(
            kind(
                name=f"{external_force.name}: {what}",
                markerNumber=acting.markers[external_force.link],
                loadVector=[0.0, 0.0, 0.0],
                loadVectorUserFunction=function,
            )
        )
        for kind, what, function in items
    )


def check_external_forces(mbs: exu.MainSystem, start: float, end: float) -> float:
    """The time [s] at which the first record of an external force ends.

    Raises
    ------
    ParameterError
        One does not span `start` to `end` [s].
    """
    known = math.inf
    for number in range(mbs.systemData.NumberOfLoads()):
        acting = _acting(mbs, number)
        if acting is None:
            continue
        name, times = acting.external_force.name, acting.external_force.times
        if start < times[0] - MARGIN or end > times[-1] + MARGIN:
            raise ParameterError(
                f"external force '{name}': its record spans [{times[0]:g}, {times[-1]:g}] s, the "
                f"run [{start:g}, {end:g}] s; where it is known to vanish, give it samples of zero"
            )
        known = min(known, float(times[-1]))
    return known


def external_forces_shown(mbs: exu.MainSystem) -> dict[str, Callable[[float], np.ndarray]]:
    """Functions of time for all external forces that have a force, by their names: where it acts
    [m] and what it is [N], (2, 3) in ground at Exudyn's visualization state."""
    found: dict[str, Callable[[float], np.ndarray]] = {}
    for number in range(mbs.systemData.NumberOfLoads()):
        acting = _acting(mbs, number)
        if acting is not None and acting.external_force.force is not None:
            found[acting.external_force.name] = partial(acting.shown, mbs)
    return found


def _acting(mbs: exu.MainSystem, number: int) -> _Acting | None:
    """The external force that a load is of."""
    function = mbs.GetLoad(number).get("loadVectorUserFunction")
    function = function["function"] if isinstance(function, dict) else function
    acting = getattr(function, "__self__", None)
    return acting if isinstance(acting, _Acting) else None


def _link_markers(
    mbs: exu.MainSystem, tree: int | None, external_force: ExternalForce
) -> dict[int, int]:
    """New markers at the origins of all links that a force names."""
    links = 0 if tree is None else len(tree_item(mbs, tree)["jointTypes"])
    named = {}
    for name in ("link", "force_expressed_in", "point_expressed_in"):
        what = f"external force '{external_force.name}': {name}"
        link = getattr(external_force, name)
        if link != GROUND:
            named[link] = what
            if tree is not None:
                check_link_exists(what, link, links)
            elif not isinstance(link, ItemNumber):
                raise ParameterError(
                    f"{what} = {link!r} is the ObjectIndex of a body or the MarkerIndex of a "
                    "marker where there is no tree"
                )
    return {link: _marker(mbs, tree, link, what) for link, what in named.items()}


def _marker(mbs: exu.MainSystem, tree: int | None, link: int, what: str) -> int:
    if isinstance(link, MarkerNumber):
        return exu.MarkerIndex(int(link))
    if tree is not None:
        return mbs.AddMarker(MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link))
    try:
        mbs.GetObject(int(link))
    except Exception as error:
        raise ParameterError(f"{what}: the mbs has no object {int(link)}") from error
    return mbs.AddMarker(MarkerBodyRigid(bodyNumber=exu.ObjectIndex(int(link))))


class _Acting:
    """An external force within an Exudyn system: the user functions of its loads."""

    def __init__(
        self, mbs: exu.MainSystem, markers: dict[int, int], external_force: ExternalForce
    ) -> None:
        self.external_force, self.markers = external_force, markers
        self._times = external_force.times.tolist()
        self._pieces = cubics(external_force)
        self._last: list = [np.nan, NOTHING]

    def force(self, mbs: exu.MainSystem, t: float, _: Vector) -> Vector:
        """F in ground, for Exudyn."""
        return self._turned(mbs, self._sample(t)[:3])

    def torque(self, mbs: exu.MainSystem, t: float, _: Vector) -> Vector:
        """T in ground, for Exudyn."""
        sample = self._sample(t)
        tau = self._turned(mbs, sample[6:])
        if self.external_force.point is None or sample is NOTHING:
            return tau
        return _sum(tau, _cross(self._arm(mbs, sample[3:6]), self._turned(mbs, sample[:3])))

    def shown(self, mbs: exu.MainSystem, t: float) -> np.ndarray:
        """Point and force (2, 3) in ground, at the visualization state."""
        sample, record = np.array(self._sample(t)), self.external_force

        def frame(link: int) -> tuple[np.ndarray, np.ndarray]:
            if link == GROUND:
                return np.eye(3), np.zeros(3)
            R, p = (
                mbs.GetMarkerOutput(self.markers[link], kind, exu.ConfigurationType.Visualization)
                for kind in (
                    exu.OutputVariableType.RotationMatrix,
                    exu.OutputVariableType.Position,
                )
            )
            return np.reshape(R, (3, 3)), p

        R, p = frame(record.link if record.point is None else record.point_expressed_in)
        turn, _ = frame(record.force_expressed_in)
        return np.array([p + R @ sample[3:6], turn @ sample[:3]])

    def _arm(self, mbs: exu.MainSystem, point: Vector) -> Vector:
        """From the origin of the link's frame to a recorded point, in ground."""
        link, frame = self.external_force.link, self.external_force.point_expressed_in
        arm = point
        if frame != GROUND:
            arm = _rotated(_rotation(mbs, self.markers[frame]), arm)
        if frame == link:
            return arm
        if frame != GROUND:
            arm = _sum(arm, _position(mbs, self.markers[frame]))
        return _difference(arm, _position(mbs, self.markers[link]))

    def _turned(self, mbs: exu.MainSystem, vector: Vector) -> Vector:
        """A recorded force or torque in ground."""
        link = self.external_force.force_expressed_in
        if link == GROUND:
            return vector
        return _rotated(_rotation(mbs, self.markers[link]), vector)

    def _sample(self, t: float) -> list[float]:
        """Force, point and torque at time `t`, kept as both loads ask at every iterate."""
        if t == self._last[0]:
            return self._last[1]
        times = self._times
        values = NOTHING
        if times[0] - MARGIN <= t <= times[-1] + MARGIN:
            k = min(max(bisect_right(times, t) - 1, 0), len(times) - 2)
            s = t - times[k]
            values = (np.array([s * s * s, s * s, s, 1.0]) @ self._pieces[k]).tolist()
        self._last[:] = t, values
        return values


# Looked up once: these functions are called at every iterate.
POSITION, ROTATION = exu.OutputVariableType.Position, exu.OutputVariableType.RotationMatrix


def _position(mbs: exu.MainSystem, marker: int) -> Vector:
    return mbs.GetMarkerOutput(marker, POSITION).tolist()


def _rotation(mbs: exu.MainSystem, marker: int) -> Vector:
    """The nine entries, row by row."""
    return mbs.GetMarkerOutput(marker, ROTATION).tolist()


# On lists of three numbers, for which NumPy takes ten times as long.


def _rotated(R: Vector, a: Vector) -> Vector:
    return [
        R[0] * a[0] + R[1] * a[1] + R[2] * a[2],
        R[3] * a[0] + R[4] * a[1] + R[5] * a[2],
        R[6] * a[0] + R[7] * a[1] + R[8] * a[2],
    ]


def _cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _sum(a: Vector, b: Vector) -> Vector:
    return [a[0] + b[0], a[1] + b[1], a[2] + b[2]]


def _difference(a: Vector, b: Vector) -> Vector:
    return [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
