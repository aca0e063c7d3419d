"""The skeleton: M, H - Q and the tree of an Exudyn system, at the running iterate or elsewhere.

Equations of motion (1): M(q) q'' + H(q, q') = Q_m + Q. What Exudyn says of all coordinates of the
tree (`opened.py`) becomes equations of the independent ones (`independent.py`, `dependent.py`).

Coordinates are Exudyn's: without the reference coordinates of the node.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import cast

import exudyn as exu
import numpy as np

from ..errors import ModelError
from .coupling import DependentCoordinate
from .dependent import Dependent
from .hold import Hold, hold
from .independent import Independent
from .opened import Dynamics, NotOpen, Opened, State
from .system import check_assembled, original, raise_as_itself, read_tree
from .tree import PRISMATIC


class Skeleton:
    """An `ObjectKinematicTree` within an assembled Exudyn system.

    Parameters
    ----------
    mbs : exudyn.MainSystem
        Assembled.
    tree : ObjectIndex
        Of the `ObjectKinematicTree`.
    coordinates : sequence of str, optional
        Names of the N coordinates; `q0`, `q1`, ... if left out.
    dependent : sequence of DependentCoordinate
        Those that are functions of others.

    Attributes
    ----------
    object : ObjectIndex
        The kinematic tree.
    basis : Independent or Dependent
        What the independent coordinates z are in the tree's.
    coordinates : tuple of str
        Names of the n independent coordinates.
    units : tuple of str
        Their units, rad or m.
    tree_coordinates : tuple of str
        Names of all coordinates of the tree.
    tree : Tree
    rows : slice
        The tree's coordinates within the system.
    free : slice or (n,) int ndarray
        The independent ones within the system.

    Raises
    ------
    ModelError
        The system is not assembled, the object is not a kinematic tree, the system has algebraic
        constraints, or the names do not fit the coordinates.
    ParameterError
        Coordinates cannot depend on each other as given.
    """

    def __init__(
        self,
        mbs: exu.MainSystem,
        tree: int,
        coordinates: Sequence[str] | None = None,
        dependent: Sequence[DependentCoordinate] = (),
    ) -> None:
        self.mbs = mbs
        self.object = tree
        self.check_assembled()
        self.tree = read_tree(mbs, tree)
        n = len(self.tree)
        names = [f"q{i}" for i in range(n)] if coordinates is None else list(coordinates)
        if len(names) != n or len(set(names)) != n:
            raise ModelError(
                f"coordinates: the tree needs {n} different names, got {len(names)}: {names}"
            )
        self.basis = Dependent(dependent, names) if dependent else Independent()
        free = self.basis.part(np.arange(n))
        self.tree_coordinates = tuple(names)
        self.coordinates = tuple(names[j] for j in free)
        self.units = tuple("m" if self.tree.joints[j] >= PRISMATIC else "rad" for j in free)
        first = mbs.systemData.GetObjectLTGODE2(tree)[0]
        self.rows = slice(first, first + n)
        self.free = self.basis.within(self.rows)
        # Since the last `open`; read in every iteration, so that nothing is asked on the way.
        self._opened = cast(Opened, NotOpen(mbs, self.rows))

    @property
    def others(self) -> int:
        """Number of the system's ODE2 coordinates outside the tree."""
        return self.mbs.systemData.ODE2Size() - len(self.tree)

    def __len__(self) -> int:
        return len(self.coordinates)

    def check_assembled(self) -> None:
        """Raise ModelError unless Exudyn can solve the system and its coordinates are free."""
        check_assembled(self.mbs)

    def state_of_tree(self, *state: np.ndarray) -> tuple[np.ndarray, ...]:
        """Values of all coordinates of the tree (..., N), if asked also speeds and accelerations.

        From those of the independent ones, (..., n) each.
        """
        return self.basis.state_of_tree(*state)

    # The initial state, as the next run will use it.

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
        """Initial coordinates and speeds (n,) each."""
        coordinates, speeds = self.initial_arrays()
        return coordinates[self.free], speeds[self.free]

    def set_initial_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Set the tree's initial coordinates and speeds (n,); other bodies keep theirs."""
        self.set_initial_arrays(*self._initial_arrays_with(q, v))

    def _initial_arrays_with(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        coordinates, speeds = self.initial_arrays()
        coordinates[self.rows], speeds[self.rows] = self.state_of_tree(q, v)
        return coordinates, speeds

    # Opening.

    @contextmanager
    def opened(self) -> Iterator[Skeleton]:
        """`open` for a block."""
        with hold(self.mbs) as held:
            self.open(held)
            yield self

    def open(self, held: Hold) -> None:
        """Prepare for evaluations; the system's current state becomes its initial state.

        Whoever has the hold gets the tree back with the user's own joint torques, and with the
        initial values that dependent coordinates had.

        Raises
        ------
        ModelError
            The system cannot be driven.
        """
        self.check_assembled()
        current = read_tree(self.mbs, self.object)
        for name in vars(current):
            if not np.array_equal(getattr(current, name), getattr(self.tree, name)):
                raise ModelError(
                    f"the {name} of the kinematic tree have changed since the model was built; "
                    "build the MusculoskeletalModel anew"
                )
        before = self.initial_arrays()
        placed = self._initial_arrays_with(*self.initial_state())

        def put_back() -> None:  # but not where the run has left something else
            each = zip(self.initial_arrays(), placed, before, strict=True)
            self.set_initial_arrays(*(b if np.array_equal(x, p) else x for x, p, b in each))

        held.keep(put_back)
        self.set_initial_arrays(*placed)
        try:
            self._opened = Opened(self.mbs, self.object, self.rows, self.basis.known_to_exudyn)
            held.keep(self._opened.leave)
            self._check_mass_matrix()
        except exu.ExudynError as error:
            raise_as_itself(original(error), error)

    def _check_mass_matrix(self) -> None:
        M = self.dynamics().M
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

    def snapshot(self) -> tuple[list[np.ndarray], float]:
        """The system's current coordinates, speeds, accelerations and time."""
        return State(self.mbs, self.rows).snapshot()

    def restore(self, snapshot: tuple[list[np.ndarray], float]) -> None:
        """Put a snapshot back."""
        State(self.mbs, self.rows).restore(snapshot)

    # The current state and, once it is open, evaluations there.

    @property
    def q(self) -> np.ndarray:
        """Independent coordinates (n,) of the current state."""
        return self.basis.part(self._opened.state.q)

    @property
    def v(self) -> np.ndarray:
        """Their speeds (n,)."""
        return self.basis.part(self._opened.state.v)

    @property
    def acceleration(self) -> np.ndarray:
        """Their accelerations (n,)."""
        return self.basis.part(self._opened.state.a)

    @property
    def start(self) -> tuple[np.ndarray, ...]:
        """The same three at the start of the step."""
        part, (q, v, a) = self.basis.part, self._opened.state.start
        return part(q), part(v), part(a)

    def tree_state(self) -> tuple[np.ndarray, np.ndarray]:
        """All coordinates of the tree and their speeds (N,) in the current state."""
        return self.basis.state(self._opened)

    @property
    def place(self) -> tuple:
        """What the model's `geometry` takes at the current state."""
        return self.q, self.v

    def dynamics(self) -> Dynamics:
        """M and H - Q, without the muscles, at the system's current state and time."""
        M, bias = self.basis.dynamics(self._opened)
        return Dynamics(M, bias, self.place)

    def dynamics_at(self, q: np.ndarray, v: np.ndarray, t: float) -> Dynamics:
        """As `dynamics`, at coordinates `q`, speeds `v` and time `t`.

        Other bodies of the system stay where they are. The system's state and time are as before
        afterwards, to the last bit.
        """
        return self._dynamics_there(q, v, t, ahead=False)

    def dynamics_ahead(self, q: np.ndarray, v: np.ndarray, t: float) -> Dynamics:
        """As `dynamics_at`, with the other bodies where their state at the start of the step leads.

        They go on with constant acceleration, which is of second order.
        """
        return self._dynamics_there(q, v, t, ahead=True)

    def _dynamics_there(self, q: np.ndarray, v: np.ndarray, t: float, *, ahead: bool) -> Dynamics:
        state = self._opened.state
        before = state.snapshot()
        try:
            if ahead:
                state.go_on_until(t)
            self.go_to(q, v, t)
            return Dynamics(*self.basis.dynamics(self._opened), (q, v))
        finally:
            state.restore(before)

    def go_to(self, q: np.ndarray, v: np.ndarray, t: float) -> None:
        """Put the tree at coordinates `q` and speeds `v` (n,) at the time `t`."""
        state = self._opened.state
        state.q[:], state.v[:] = self.state_of_tree(q, v)
        self.mbs.systemData.SetTime(t)

    # In a run.

    def begin(self, torque: np.ndarray) -> None:
        """Set the muscles' torques (n,) at the start of a run, which is the current state."""
        self.basis.begin(self._opened, torque)

    def settle(self, newmark: bool) -> None:
        """The run begins here; raise ParameterError if with wrong accelerations (`Independent`)."""
        self.basis.settle(self._opened, newmark)

    def place_at(self, q: np.ndarray, v: np.ndarray) -> tuple:
        """What the model's `geometry` takes at coordinates `q` and speeds `v` (n,)."""
        return q, v

    def ideal_load(self, there: Dynamics, torque: np.ndarray) -> np.ndarray:
        """What torques (n,) on the coordinates themselves are for Exudyn."""
        return torque

    def apply(self, torque: np.ndarray | None) -> None:
        """Set the muscles' torques (n,) at Exudyn's iterate, on top of the user's own
        `jointForceVector`; None: the last ones stay."""
        self.basis.apply(self._opened, torque)

    @property
    def applied(self) -> np.ndarray:
        """The muscles' torques (n,) that Exudyn has now."""
        return self.basis.applied(self._opened)

    def imbalance(self, there: Dynamics, a: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """M z'' + H - Q - Q_m (n,) with accelerations `a` and torques (n,)."""
        return there.M @ a + there.bias - torque

    def rows_of_law(
        self,
        exact: np.ndarray,
        here: Dynamics,
        mass: float,
        kp: float | np.ndarray,
        kv: float | np.ndarray,
    ) -> np.ndarray:
        """Rows of the Newton matrix with the demand of (15) met, as `Plugin.jacobian`; the gains
        `kp`, `kv` are times its factors dq, dv."""
        # The residual is M (q'' - q''_CTC), whatever else acts on the skeleton.
        rows = np.zeros_like(exact)
        rows[:, self.free] = here.M * (mass - kp - kv)
        return rows

    def rows_of_slopes(
        self, exact: np.ndarray, here: Dynamics, mass: float, slopes: np.ndarray
    ) -> np.ndarray:
        """The same with slopes (n, n) of `imbalance` but for its q'', times the factor dq."""
        rows = exact.copy()
        rows[:, self.free] = mass * here.M - slopes
        return rows

    def reduced(self, covectors: np.ndarray) -> np.ndarray:
        """x R (..., n) of torques or moment arms x (..., N) at the current state."""
        return self.basis.reduced(self._opened, covectors)

    def reduced_rows(self, exact: np.ndarray) -> np.ndarray:
        """The tree's rows of Exudyn's Newton matrix as those of the independent coordinates."""
        return self.basis.reduced_rows(self._opened, exact)

    def all_rows(self, wanted: np.ndarray) -> np.ndarray:
        """The tree's rows of a Newton matrix with those of the independent coordinates."""
        return self.basis.all_rows(self._opened, wanted)
