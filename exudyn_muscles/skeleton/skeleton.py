"""The skeleton: M, H - Q and the tree of an Exudyn system, at the running iterate or elsewhere.

Equations of motion (1): M(q) q'' + H(q, q') = Q_m + Q. A second solver object assembles them from
the whole system, so that springs, loads, user functions and contacts are all part of Q. It reads
and leaves the system's current state as it finds it.

Coordinates are Exudyn's: without the reference coordinates of the node.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NoReturn

import exudyn as exu
import numpy as np

from ..errors import ModelError
from .followers import Followers
from .hold import Hold, hold
from .tree import PRISMATIC, Tree

JOINTS = {
    exu.JointType.RevoluteX: 0,
    exu.JointType.RevoluteY: 1,
    exu.JointType.RevoluteZ: 2,
    exu.JointType.PrismaticX: 3,
    exu.JointType.PrismaticY: 4,
    exu.JointType.PrismaticZ: 5,
}


class Skeleton:
    """An `ObjectKinematicTree` within an assembled Exudyn system.

    Parameters
    ----------
    mbs : exudyn.MainSystem
        Assembled.
    tree : ObjectIndex
        Of the `ObjectKinematicTree`.
    coordinates : sequence of str, optional
        Names of the n coordinates; `q0`, `q1`, ... if left out.

    Attributes
    ----------
    object : ObjectIndex
        The kinematic tree.
    coordinates : tuple of str
        Names of the independent coordinates, which are all of the tree's here.
    followers : Followers or None
        None: all coordinates are independent. `DependentSkeleton` has some.
    tree_coordinates : tuple of str
        Names of all coordinates of the tree.
    tree : Tree
    rows : slice
        The tree's coordinates within the system.
    free : slice or (n,) int ndarray
        The independent ones within the system.
    q, v, acceleration : (n,) ndarray
        The independent coordinates in the current state, their speeds and accelerations.
    start : tuple of three (n,) ndarray
        The same at the start of the step.
    tree_q, tree_v, tree_a : (N,) ndarray
        Views of all coordinates of the tree in the current state, their speeds and accelerations.

    Raises
    ------
    ModelError
        The system is not assembled, the object is not a kinematic tree, the system has algebraic
        constraints, or the names do not fit the coordinates.
    """

    followers: Followers | None = None
    # Attributes, as they are read in every iteration; `DependentSkeleton` has properties.
    q: np.ndarray
    v: np.ndarray
    acceleration: np.ndarray
    start: tuple[np.ndarray, ...]
    free: slice | np.ndarray

    def __init__(
        self, mbs: exu.MainSystem, tree: int, coordinates: Sequence[str] | None = None
    ) -> None:
        self.mbs = mbs
        self.object = tree
        self.check_assembled()
        item = tree_item(mbs, tree)
        n = len(item["jointTypes"])
        names = [f"q{i}" for i in range(n)] if coordinates is None else list(coordinates)
        if len(names) != n or len(set(names)) != n:
            raise ModelError(
                f"coordinates: the tree needs {n} different names, got {len(names)}: {names}"
            )
        self.coordinates = self.tree_coordinates = tuple(names)
        self.tree = _read_tree(item, mbs)
        self.attach_views()

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the coordinates, rad or m."""
        return tuple("m" if joint >= PRISMATIC else "rad" for joint in self.tree.joints)

    @property
    def others(self) -> int:
        """Number of the system's ODE2 coordinates outside the tree."""
        return self.mbs.systemData.ODE2Size() - len(self.tree)

    def __len__(self) -> int:
        return len(self.coordinates)

    def check_assembled(self) -> None:
        """Raise ModelError unless Exudyn can solve the system and its coordinates are free."""
        if not self.mbs.systemIsConsistent:
            raise ModelError("the mbs is not assembled: call mbs.Assemble() first")
        constrained = constrained_objects(self.mbs)
        if constrained:
            raise ModelError(
                f"the mbs has algebraic constraints, of {', '.join(constrained)}; the methods need "
                "independent coordinates. Rigid bodies have none with "
                "nodeType=exu.NodeType.RotationRxyz; instead of joints between bodies build links "
                "of the kinematic tree, instead of constraints between its coordinates give the "
                "model followers"
            )

    def attach_views(self) -> None:
        """Fetch Exudyn's state arrays anew: they dangle once the system has grown."""
        data = self.mbs.systemData
        index = data.GetObjectLTGODE2(self.object)
        self.rows = slice(index[0], index[0] + len(self.tree))
        current = data.GetSystemStateDict(reference=True)
        start = data.GetSystemStateDict(
            configuration=exu.ConfigurationType.StartOfStep, reference=True
        )
        names = ("ODE2Coords", "ODE2Coords_t", "ODE2Coords_tt")
        self._current = tuple(current[name] for name in names)
        self._at_start = tuple(start[name] for name in names)
        self.tree_q, self.tree_v, self.tree_a = (array[self.rows] for array in self._current)
        self._tree_start = tuple(array[self.rows] for array in self._at_start)
        self._attach()

    def _attach(self) -> None:
        self.q, self.v, self.acceleration = self.tree_q, self.tree_v, self.tree_a
        self.start, self.free = self._tree_start, self.rows

    @contextmanager
    def opened(self) -> Iterator[Skeleton]:
        """`open` for a block."""
        with hold(self.mbs) as held:
            self.open(held)
            yield self

    def open(self, held: Hold) -> None:
        """Prepare for evaluations; the system's current state becomes its initial state.

        Whoever has the hold gets the tree back with the user's own joint torques.

        Raises
        ------
        ModelError
            The system cannot be driven.
        """
        self.check_assembled()
        current = _read_tree(tree_item(self.mbs, self.object), self.mbs)
        for name in vars(current):
            if not np.array_equal(getattr(current, name), getattr(self.tree, name)):
                raise ModelError(
                    f"the {name} of the kinematic tree have changed since the model was built; "
                    "build the MusculoskeletalModel anew"
                )
        try:
            self._prepare(held)
        except exu.ExudynError as error:
            raise_as_itself(original(error), error)

    def _prepare(self, held: Hold) -> None:
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.active = False
        settings.timeIntegration.verboseMode = 0
        # Those of a tree with followers come later, from M_z: its M may be singular.
        initial = self.followers is None
        settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = initial
        self._solver = exu.MainSolverImplicitSecondOrder()
        self._solver.InitializeSolver(self.mbs, settings)
        self.attach_views()
        self._set = self.mbs.SetObjectParameter
        torque = self.mbs.GetObjectParameter(self.object, "jointForceVector")
        self._user_torque = np.zeros(len(self.tree)) + (torque if np.size(torque) else 0.0)
        self._total = self._user_torque
        held.keep(self._leave)
        self._check_mass_matrix()

    def _check_mass_matrix(self) -> None:
        M, _ = self.dynamics()
        if not np.isfinite(M).all():
            raise ModelError(
                "the mass matrix is not finite: check masses and inertias of the links; the last "
                "link of a chain needs a mass"
            )
        values, vectors = np.linalg.eigh(M)
        if not values[0] > 1e-12 * values[-1]:
            j = int(np.abs(vectors[:, 0]).argmax())
            raise ModelError(
                f"the mass matrix is not positive definite (smallest eigenvalue {values[0]:.3g}), "
                f"mostly in coordinate '{self.coordinates[j]}': check masses, centers of mass and "
                "inertias of the links"
            )

    def _leave(self) -> None:
        self._total = self._user_torque
        self._set(self.object, "jointForceVector", self._total)

    def apply(self, torque: np.ndarray) -> None:
        """Set the muscles' torques (n,), on top of the user's own `jointForceVector`."""
        self._total = self._user_torque + torque
        self._set(self.object, "jointForceVector", self._total)

    @property
    def applied(self) -> np.ndarray:
        """The muscles' torques (n,) that Exudyn has now."""
        return self._total - self._user_torque

    def begin(self, torque: np.ndarray) -> None:
        """Set the muscles' torques (n,) at the start of a run, which is the current state."""
        self.apply(torque)

    def settle(self) -> bool:
        """The run begins at the current state; whether Exudyn's initial accelerations may stay."""
        return True

    def follow(self) -> None:
        """Exudyn has a new iterate: put followers where they belong."""

    def hold(self) -> None:
        """Leave the muscles' torques at a new iterate, with other reactions of followers."""

    def state_of_tree(self, *state: np.ndarray) -> tuple[np.ndarray, ...]:
        """Values of all coordinates of the tree (..., N), if asked also speeds and accelerations.

        From those of the independent ones, (..., n) each.
        """
        return state

    def reduced(self, covectors: np.ndarray) -> np.ndarray:
        """x R (..., n) of torques or moment arms x (..., N) at the current state."""
        return covectors

    def reduced_rows(self, exact: np.ndarray) -> np.ndarray:
        """The tree's rows of Exudyn's Newton matrix as those of the independent coordinates."""
        return exact

    def all_rows(self, wanted: np.ndarray) -> np.ndarray:
        """The tree's rows of a Newton matrix with those of the independent coordinates."""
        return wanted

    def initial_arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Initial coordinates and speeds of the whole system."""
        initial = exu.ConfigurationType.Initial
        data = self.mbs.systemData
        return (
            np.array(data.GetODE2Coordinates(configuration=initial)),
            np.array(data.GetODE2Coordinates_t(configuration=initial)),
        )

    def set_initial_arrays(self, coordinates: np.ndarray, speeds: np.ndarray) -> None:
        """Set the initial state of the whole system."""
        initial = exu.ConfigurationType.Initial
        self.mbs.systemData.SetODE2Coordinates(coordinates, configuration=initial)
        self.mbs.systemData.SetODE2Coordinates_t(speeds, configuration=initial)

    def initial_state(self) -> tuple[np.ndarray, np.ndarray]:
        """Initial coordinates and speeds (n,) each, as the next run will use them."""
        coordinates, speeds = self.initial_arrays()
        return coordinates[self.free], speeds[self.free]

    def set_initial_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Set the tree's initial coordinates and speeds (n,); other bodies keep theirs."""
        coordinates, speeds = self.initial_arrays()
        coordinates[self.rows], speeds[self.rows] = self.state_of_tree(q, v)
        self.set_initial_arrays(coordinates, speeds)

    def dynamics(self) -> tuple[np.ndarray, np.ndarray]:
        """M (n, n) and H - Q (n,), without the muscles, at the system's current state and time."""
        solver, mbs = self._solver, self.mbs
        solver.ComputeMassMatrix(mbs)
        solver.ComputeODE2RHS(mbs)
        M = solver.GetSystemMassMatrix()[self.rows, self.rows]
        return M, self._total - self._user_torque - solver.GetSystemResidual()[self.rows]

    def dynamics_at(self, q: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        """M (n, n) and H - Q (n,) at coordinates `q`, speeds `v` and time `t`.

        Other bodies of the system stay where they are. The system's state and time are as before
        afterwards, to the last bit.
        """
        before = self.snapshot()
        try:
            self.tree_q[:], self.tree_v[:] = self.state_of_tree(q, v)
            self.mbs.systemData.SetTime(t)
            return self.dynamics()
        finally:
            self.restore(before)

    def dynamics_ahead(
        self, q: np.ndarray, v: np.ndarray, t: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """As `dynamics_at`, with the other bodies where their state at the start of the step leads.

        They go on with constant acceleration, which is of second order.
        """
        before = self.snapshot()
        try:
            h = t - self.mbs.systemData.GetTime(exu.ConfigurationType.StartOfStep)
            q_0, v_0, a_0 = self._at_start
            self._current[0][:] = q_0 + h * v_0 + 0.5 * h * h * a_0
            self._current[1][:] = v_0 + h * a_0
            self.tree_q[:], self.tree_v[:] = self.state_of_tree(q, v)
            self.mbs.systemData.SetTime(t)
            return self.dynamics()
        finally:
            self.restore(before)

    def snapshot(self) -> tuple[list[np.ndarray], float]:
        """The system's current coordinates, speeds, accelerations and time."""
        return [array.copy() for array in self._current], self.mbs.systemData.GetTime()

    def restore(self, snapshot: tuple[list[np.ndarray], float]) -> None:
        """Put a snapshot back."""
        arrays, time = snapshot
        for array, values in zip(self._current, arrays, strict=True):
            array[:] = values
        self.mbs.systemData.SetTime(time)


def constrained_objects(mbs: exu.MainSystem) -> list[str]:
    """Types, names and numbers of the objects that have algebraic equations."""
    data = mbs.systemData
    if data.AEsize() == 0:
        return []
    numbers = [k for k in range(data.NumberOfObjects()) if data.GetObjectLTGAE(k)]
    items = {k: mbs.GetObject(k) for k in numbers}
    return [f"{item['objectType']} '{item['name']}' (object {k})" for k, item in items.items()]


def original(error: BaseException) -> BaseException:
    """The exception that a user function raised, which Exudyn wraps, once for every solver.

    An interrupt in compiled code may come as SystemError.
    """
    while isinstance(error, (exu.ExudynError, SystemError)) and error.__cause__ is not None:
        error = error.__cause__
    return error


def raise_as_itself(raised: BaseException, caught: BaseException) -> NoReturn:
    """Raise the `original` of a caught exception with the context that it had."""
    if raised is caught:
        raise raised
    context, hidden = raised.__context__, raised.__suppress_context__
    try:
        raise raised
    finally:
        raised.__context__, raised.__suppress_context__ = context, hidden


def tree_item(mbs: exu.MainSystem, tree: int) -> dict:
    """What Exudyn tells about a kinematic tree.

    Raises
    ------
    ModelError
        There is no such object, or it is another one.
    """
    try:
        item = mbs.GetObject(tree)
    except Exception as error:
        raise ModelError(f"tree = {tree!r} is not an object of this mbs") from error
    if item["objectType"] != "KinematicTree":
        raise ModelError(
            f"tree = {tree!r} is an object of type {item['objectType']}; "
            "the skeleton must be an ObjectKinematicTree"
        )
    return item


def _read_tree(item: dict, mbs: exu.MainSystem) -> Tree:
    n = len(item["jointTypes"])
    for number, joint in enumerate(item["jointTypes"]):
        if joint not in JOINTS:
            raise ModelError(f"link {number}: joint type {joint} is not one of {list(JOINTS)}")
    reference = mbs.GetNodeParameter(item["nodeNumber"], "referenceCoordinates")
    return Tree(
        joints=np.array([JOINTS[joint] for joint in item["jointTypes"]], dtype=np.int64),
        parents=np.array(item["linkParents"], dtype=np.int64),
        rotations=np.array(item["jointTransformations"].GetPythonObject()).reshape(n, 3, 3),
        offsets=np.array(item["jointOffsets"].GetPythonObject(), dtype=float).reshape(n, 3),
        base=np.array(item["baseOffset"], dtype=float),
        reference=np.zeros(n) + (reference if np.size(reference) else 0.0),
    )
