"""An external force within an Exudyn system: the user functions of its loads."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence

import exudyn as exu
import numpy as np

from ..errors import ModelError
from ..forces.external import ExternalForce, cubics
from ..forces.external_loads import MARGIN
from ..path.frames import GROUND

NOTHING = [0.0] * 9
LAID_DOWN = "exudyn_muscles: external forces laid down"  # in mbs.sys, by their loads
USER_FUNCTIONS = ("PreStep", "PostStep", "PreNewtonResidual", "PostNewton")

Vector = Sequence[float]


def acting_in(mbs: exu.MainSystem, number: int) -> Acting | None:
    """The external force that a load is of."""
    if number in (laid_down := mbs.sys.get(LAID_DOWN, {})):
        return laid_down[number]
    function = mbs.GetLoad(number).get("loadVectorUserFunction")
    function = function["function"] if isinstance(function, dict) else function
    acting = getattr(function, "__self__", None)
    return acting if isinstance(acting, Acting) else None


def carried_on_tree(mbs: exu.MainSystem, tree: int) -> dict[int, Acting]:
    """The external forces on a tree, by its object number, that can be carried: by their loads.

    All loads of a force are as they were made, and nobody looks at them: no sensor, and no user
    function of the `mbs`, which might change them as well.
    """
    if any(getattr(mbs, f"Get{name}UserFunction")() for name in USER_FUNCTIONS):
        return {}
    found: dict[int, Acting] = {}
    for number in range(mbs.systemData.NumberOfLoads()):
        acting = acting_in(mbs, number)
        if acting is not None and acting.is_as_made(mbs, number, tree):
            found[number] = acting
    watched = {
        int(sensor["loadNumber"])
        for sensor in map(mbs.GetSensor, range(mbs.systemData.NumberOfSensors()))
        if sensor["sensorType"] == "Load"
    }
    whole = {
        id(acting)
        for acting in found.values()
        if len(acting.functions) == sum(each is acting for each in found.values())
        and not any(found[k] is acting for k in watched & found.keys())
    }
    return {number: acting for number, acting in found.items() if id(acting) in whole}


class Acting:
    """An external force within an Exudyn system: the user functions of its loads."""

    def __init__(
        self,
        mbs: exu.MainSystem,
        markers: dict[int, int],
        rest: int | None,
        external_force: ExternalForce,
    ) -> None:
        self.external_force, self.markers, self.rest = external_force, markers, rest
        self._times = external_force.times.tolist()
        self._pieces = cubics(external_force)
        self._last: list = [np.nan, NOTHING]

    @property
    def functions(self) -> dict[str, Callable[..., Vector]]:
        """What Exudyn asks in each kind of load that there is."""
        record, kinds = self.external_force, {}
        if record.force is not None:
            kinds["ForceVector"] = self.force
        if record.point is not None or record.torque is not None:
            kinds["TorqueVector"] = self.torque
        return kinds

    def is_as_made(self, mbs: exu.MainSystem, load: int, tree: int) -> bool:
        """Whether a load is as `add_external_force` has made it on this tree."""
        given = mbs.GetLoad(load)
        marker = mbs.GetMarker(given["markerNumber"])
        function = given["loadVectorUserFunction"]
        return (
            not given["bodyFixed"]
            and int(given["markerNumber"]) == int(self.markers[self.external_force.link])
            and marker["markerType"] == "KinematicTreeRigid"
            and int(marker["objectNumber"]) == int(tree)
            and isinstance(function, dict)
            and function["function"] == self.functions.get(given["loadType"])
        )

    def lay_down(self, mbs: exu.MainSystem, load: int) -> None:
        """Have one of the loads do nothing, as someone else applies the force."""
        assert self.rest is not None
        mbs.SetLoadParameter(load, "loadVectorUserFunction", 0)
        mbs.SetLoadParameter(load, "markerNumber", self.rest)
        mbs.sys.setdefault(LAID_DOWN, {})[load] = self

    def check_rests(self, mbs: exu.MainSystem, load: int) -> None:
        """Raise ModelError if a load that was laid down is not as it was then."""
        given, rest = mbs.GetLoad(load), self.rest
        assert rest is not None
        if (
            given["loadVectorUserFunction"]
            or np.any(given["loadVector"])
            or given["bodyFixed"]
            or int(given["markerNumber"]) != int(rest)
        ):
            raise ModelError(
                f"load {load} '{given['name']}' was changed within attached(), where the plugin "
                f"carries external force '{self.external_force.name}' itself: change it before, or "
                "in a PreStep user function that is set before"
            )

    def take_up(self, mbs: exu.MainSystem, load: int) -> None:
        """Have it act again."""
        kind = mbs.GetLoad(load)["loadType"]
        mbs.SetLoadParameter(load, "loadVectorUserFunction", self.functions[kind])
        mbs.SetLoadParameter(load, "markerNumber", self.markers[self.external_force.link])
        mbs.sys.get(LAID_DOWN, {}).pop(load, None)

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
