"""External forces over time, such as a force plate's record, as loads of an Exudyn system.

A recorded force f, its point p and a free torque act on a link as a force at the origin o of the
link's frame and a torque about it,

    F = R_f f    T = (R_p p + o_p - o) x F + R_f tau,

with the pose o_p, R_p of the frame in which the point is given and the orientation R_f of that in
which the force is; both are ground or a link. Exudyn asks for F and T at every state that it
evaluates, so that they are part of Q in its own runs and in the inverse dynamics alike.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import exudyn as exu
import numpy as np
from exudyn.itemInterface import LoadForceVector, LoadTorqueVector, MarkerKinematicTreeRigid
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from ..checks import link_number
from ..errors import ParameterError, StorageError
from ..files.storage import read_storage
from ..path.tree import GROUND
from .skeleton import tree_item

MARGIN = 1e-9  # s, accumulated time steps
LARGEST = 1e12  # of times, forces, points and torques: no skeleton bears a millionth of it
FEWEST_FOR_SPLINE = 4  # samples; OpenSim joins fewer by straight lines
NOTHING = [0.0] * 9

Vector = Sequence[float]


@dataclass(frozen=True, eq=False)
class ExternalForce:
    """A recorded force, torque or both on a link.

    Between the samples runs the natural cubic spline, as in OpenSim, and straight lines if there
    are fewer than four. Outside of the record there is no force; the methods of this package refuse
    to run there.

    Parameters
    ----------
    name : str
    link : int
        That it acts on.
    times : (k,) array_like
        Increasing [s], k >= 2.
    force : (k, 3) array_like, optional
        [N].
    point : (k, 3) array_like, optional
        Where the force acts [m]; the origin of the link's frame if left out. One given in ground
        stays there whatever the link does.
    torque : (k, 3) array_like, optional
        In addition to the force's own [N m].
    force_expressed_in, point_expressed_in : int
        The link in whose frame force and torque, or the point, are given; -1 is ground.

    Raises
    ------
    ParameterError
        Neither force nor torque, a point without a force, shapes that do not fit, times that do not
        increase, values not finite, or no such link; names the force.
    """

    name: str
    link: int
    times: np.ndarray
    force: np.ndarray | None = None
    point: np.ndarray | None = None
    torque: np.ndarray | None = None
    force_expressed_in: int = GROUND
    point_expressed_in: int = GROUND

    def __post_init__(self) -> None:
        times = self._array("times", self.times)
        if times.ndim != 1 or times.size < 2:
            raise self._error(f"times must be (k,) with k >= 2, got {times.shape}")
        wrong = np.flatnonzero(~(np.diff(times) > 0.0))
        if wrong.size:
            t, after = times[wrong[0] : wrong[0] + 2]
            raise self._error(f"times must increase, {t:g} s is followed by {after:g} s")
        object.__setattr__(self, "times", times)
        for name in ("force", "point", "torque"):
            if getattr(self, name) is None:
                continue
            values = self._array(name, getattr(self, name))
            if values.shape != (times.size, 3):
                raise self._error(f"{name} must be ({times.size}, 3), got {values.shape}")
            object.__setattr__(self, name, values)
        try:
            with np.errstate(all="ignore"):
                finite = np.isfinite(_pieces(self)).all()
        except ValueError:  # not even the spline's equations are
            finite = False
        if not finite:
            raise self._error(f"times are too close: the smallest step is {np.diff(times).min()} s")
        if self.force is None and (self.torque is None or self.point is not None):
            needed = "a force or a torque" if self.point is None else "a force at its point"
            raise self._error(f"needs {needed}")
        for name, lowest in (
            ("link", 0),
            ("force_expressed_in", GROUND),
            ("point_expressed_in", GROUND),
        ):
            link_number(f"external force '{self.name}': {name}", getattr(self, name), lowest)

    def _array(self, name: str, values: ArrayLike) -> np.ndarray:
        """Finite numbers, not to be written."""
        try:
            array = np.array(values, dtype=float)
        except (TypeError, ValueError) as error:
            raise self._error(f"{name} must be an array of numbers: {error}") from error
        unknown = np.argwhere(~np.isfinite(array))
        if unknown.size:
            row = unknown[0][0]
            raise self._error(f"{name} must be finite, row {row} is {array[row]}")
        if (largest := np.abs(array).max(initial=0.0)) > LARGEST:
            raise self._error(f"{name} goes up to {largest:g}, allowed is {LARGEST:g} in SI units")
        array.setflags(write=False)
        return array

    def _error(self, text: str) -> ParameterError:
        return ParameterError(f"external force '{self.name}': {text}")

    @classmethod
    def from_file(
        cls,
        name: str,
        link: int,
        file: str | Path,
        *,
        force: str | None = None,
        point: str | None = None,
        torque: str | None = None,
    ) -> ExternalForce:
        """A record in ground from a storage file (`.sto`, `.mot`).

        Parameters
        ----------
        name, link
            As of the class.
        file : str or Path
            As `read_storage` reads it.
        force, point, torque : str, optional
            What the labels of their three columns begin with, such as `ground_force_v`,
            `ground_force_p` and `ground_torque_`.

        Raises
        ------
        StorageError
            The file is damaged or lacks such columns; tells which there are.
        ParameterError
            As the class; names the file.
        FileNotFoundError
        """
        storage = read_storage(file)
        try:
            f, p, tau = (
                None if identifier is None else storage.vector(identifier)
                for identifier in (force, point, torque)
            )
            return cls(name, link, storage.time, f, p, tau)
        except (StorageError, ParameterError) as error:
            raise type(error)(f"{file}: {error}") from error


def add_external_force(
    mbs: exu.MainSystem, tree: int, external_force: ExternalForce
) -> tuple[int, ...]:
    """Add an external force to an Exudyn system, before `mbs.Assemble()`.

    It becomes a `LoadForceVector`, a `LoadTorqueVector` or both at the origin of the link's frame,
    called `<name>: force` and `<name>: torque`, with user functions.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    tree : ObjectIndex
        Of the `ObjectKinematicTree`.
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
    links = len(tree_item(mbs, tree)["jointTypes"])
    for name in ("link", "force_expressed_in", "point_expressed_in"):
        value = getattr(external_force, name)
        if value >= links:
            raise external_force._error(
                f"{name} = {value} is not a link of the tree, the last is {links - 1}"
            )
    acting = _Acting(mbs, tree, external_force)
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


def check_external_forces(mbs: exu.MainSystem, start: float, end: float) -> None:
    """Raise ParameterError unless the records of all external forces span `start` to `end` [s]."""
    for number in range(mbs.systemData.NumberOfLoads()):
        function = mbs.GetLoad(number).get("loadVectorUserFunction")
        function = function["function"] if isinstance(function, dict) else function
        acting = getattr(function, "__self__", None)
        if not isinstance(acting, _Acting):
            continue
        times = acting.external_force.times
        if start < times[0] - MARGIN or end > times[-1] + MARGIN:
            raise acting.external_force._error(
                f"its record spans [{times[0]:g}, {times[-1]:g}] s, the run "
                f"[{start:g}, {end:g}] s; where it is known to vanish, give it samples of zero"
            )


class _Acting:
    """An external force within an Exudyn system: the user functions of its loads."""

    def __init__(self, mbs: exu.MainSystem, tree: int, external_force: ExternalForce) -> None:
        self.external_force = external_force
        self.markers: dict[int, int] = {}
        for link in (
            external_force.link,
            external_force.force_expressed_in,
            external_force.point_expressed_in,
        ):
            if link != GROUND and link not in self.markers:
                self.markers[link] = mbs.AddMarker(
                    MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link)
                )
        self._times = external_force.times.tolist()
        self._pieces = _pieces(external_force)
        self._last = np.nan, NOTHING

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
        self._last = t, values
        return values


def _pieces(load: ExternalForce) -> np.ndarray:
    """Cubics (k - 1, 4, 9) in the time since each sample, highest power first."""
    columns = np.zeros((load.times.size, 9))
    for k, values in enumerate((load.force, load.point, load.torque)):
        if values is not None:
            columns[:, 3 * k : 3 * k + 3] = values
    if load.times.size >= FEWEST_FOR_SPLINE:
        c = CubicSpline(load.times, columns, bc_type="natural").c
    else:
        slopes = np.diff(columns, axis=0) / np.diff(load.times)[:, None]
        c = np.stack([0.0 * slopes, 0.0 * slopes, slopes, columns[:-1]])
    return np.ascontiguousarray(c.transpose(1, 0, 2))


def _position(mbs: exu.MainSystem, marker: int) -> Vector:
    return mbs.GetMarkerOutput(marker, exu.OutputVariableType.Position).tolist()


def _rotation(mbs: exu.MainSystem, marker: int) -> Vector:
    """The nine entries, row by row."""
    return mbs.GetMarkerOutput(marker, exu.OutputVariableType.RotationMatrix).tolist()


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
