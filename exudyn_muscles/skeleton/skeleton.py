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

from ..checks import check_link_exists
from ..errors import ModelError
from ..forces.actuator_table import ActuatorTable
from ..path.paths import Paths
from .ahead import Rule
from .basis import basis_of
from .carried import carry
from .closures import Loops
from .coupling import DependentCoordinate
from .geometry import (
    Mounted,
    compile_columns,
    compile_geometry,
    compile_torques,
    with_columns,
)
from .hold import Hold, hold
from .opened import Dynamics, NotOpen, Opened
from .reading import (
    check_assembled,
    check_mass_matrix,
    check_unconstrained,
    original,
    raise_as_itself,
    read_tree,
)
from .segments import Segments, tree_segments
from .shown import OwnGraphics, coordinates_shown, tree_graphics
from .tree import PRISMATIC, tree_frames
from .tree_rows import TreeRows


class Skeleton(TreeRows):
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
    loops : Loops, optional
        Those that are closed.

    Attributes
    ----------
    object : ObjectIndex
        The kinematic tree.
    basis : Independent, Dependent or Closed
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
        loops: Loops | None = None,
    ) -> None:
        super().__init__(mbs)
        self.object = tree
        self.tree = read_tree(mbs, tree)
        self.check_assembled()
        n = len(self.tree)
        names = [f"q{i}" for i in range(n)] if coordinates is None else list(coordinates)
        if len(names) != n or len(set(names)) != n:
            raise ModelError(
                f"coordinates: the tree needs {n} different names, got {len(names)}: {names}"
            )
        first = mbs.systemData.GetObjectLTGODE2(tree)[0]
        self.rows = slice(first, first + n)
        near = self.initial_arrays()[0][self.rows]
        self.basis = basis_of(self.tree, names, dependent, loops, near)
        free = self.basis.part(np.arange(n))
        self.tree_coordinates = tuple(names)
        self.coordinates = tuple(names[j] for j in free)
        self.system_names = ()
        self.units = tuple("m" if self.tree.joints[j] >= PRISMATIC else "rad" for j in free)
        self.free = self.basis.within(self.rows)
        # Since the last `open`; read in every iteration, so that nothing is asked on the way.
        self._opened = cast(Opened, NotOpen(mbs, self.rows))

    def frame_number(self, what: str, link: int) -> int:
        return check_link_exists(what, link, len(self.tree))

    def mount(self, paths: Paths, muscles: Sequence[str], actuators: ActuatorTable) -> Mounted:
        columns = compile_columns(self.tree, actuators)
        geometry = compile_geometry(self.tree, paths, muscles)
        if len(actuators.rows):
            geometry = with_columns(geometry, columns)
        of_tree = compile_torques(self.tree, paths, muscles, columns)

        def torques(places: Sequence[tuple], forces: np.ndarray) -> np.ndarray:
            q, _, reduced = self.basis.along(*map(np.array, zip(*places, strict=True)))
            return reduced(of_tree(q, forces))

        return Mounted(self.basis.geometry(geometry), columns, torques)

    @property
    def known_to_exudyn(self) -> bool:
        return self.basis.known_to_exudyn

    @property
    def width(self) -> int:
        return len(self.tree)

    @property
    def others(self) -> int:
        return self.mbs.systemData.ODE2Size() - len(self.tree)

    def check_assembled(self) -> None:
        check_assembled(self.mbs)
        check_unconstrained(self.mbs, self.object)

    def state_of_tree(self, *state: np.ndarray) -> tuple[np.ndarray, ...]:
        return self.basis.state_of_tree(*state)

    def frames_shown(self, near: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        q = coordinates_shown(self.mbs)[self.rows]
        return *tree_frames(self.tree, q)[:2], q

    def own_graphics(self) -> OwnGraphics:
        return tree_graphics(self.mbs, int(self.object), self.tree)

    def segments(self) -> Segments:
        return tree_segments(self.mbs, int(self.object), self.tree, self.rows)

    # The initial state, as the next run will use it.

    def initial_state(self) -> tuple[np.ndarray, np.ndarray]:
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
        with hold(self.mbs) as held:
            self.open(held)
            yield self

    def open(self, held: Hold, near: np.ndarray | None = None) -> None:
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
            carried, knows = carry(self.mbs, self.object, self.tree, held), self.known_to_exudyn
            self._opened = Opened(self.mbs, self.object, self.rows, knows, carried)
            held.keep(self._opened.leave)
            self._opened.contacts.begin(held)
            check_mass_matrix(self.dynamics().M, self.coordinates)
        except exu.ExudynError as error:
            raise_as_itself(original(error), error)

    # The current state and, once it is open, evaluations there.

    @property
    def q(self) -> np.ndarray:
        return self.basis.part(self._opened.state.q)

    @property
    def v(self) -> np.ndarray:
        return self.basis.part(self._opened.state.v)

    @property
    def acceleration(self) -> np.ndarray:
        return self.basis.part(self._opened.state.a)

    @property
    def start(self) -> tuple[np.ndarray, ...]:
        part, (q, v, a) = self.basis.part, self._opened.state.start
        return part(q), part(v), part(a)

    def tree_state(self) -> tuple[np.ndarray, np.ndarray]:
        """All coordinates of the tree and their speeds (N,) in the current state."""
        return self.basis.state(self._opened)

    @property
    def place(self) -> tuple:
        return self.q, self.v

    def dynamics(self) -> Dynamics:
        return self.basis.dynamics(self._opened, self.place)

    def places_ahead(self, q: np.ndarray, v: np.ndarray, t: float, rule: Rule) -> Iterator[tuple]:
        return ((row, v) for row in q)

    def dynamics_within(self, q: np.ndarray, v: np.ndarray, times: np.ndarray) -> list[Dynamics]:
        """M and H - Q at states (k, n) and times (k,) within the step that leads to the current
        state, with everything else on its cubic over the step and contacts as they are at its
        end."""
        state, found = self._opened.state, []
        before = state.snapshot()
        try:
            for place, t in zip(zip(q, v, strict=True), times, strict=True):
                if self.others:
                    state.restore(before)
                    state.go_back_to(t)
                state.current[0][self.free], state.current[1][self.free] = place
                self.mbs.systemData.SetTime(t)
                found.append(self.basis.dynamics(self._opened, place))
        finally:
            state.restore(before)
        return found

    def _dynamics_there(
        self, q: np.ndarray, v: np.ndarray, t: float, ahead: Rule | None
    ) -> Dynamics:
        state, contacts = self._opened.state, self._opened.contacts
        before = state.snapshot()
        try:
            if ahead is not None:
                state.go_on_until(t)
            self._place(q, v, t)
            if ahead is not None:
                contacts.settle_ahead(before[1])
            return self.basis.dynamics(self._opened, (q, v))
        finally:
            state.restore(before)
            if ahead is not None:
                contacts.settle_at_start()

    def go_to(self, q: np.ndarray, v: np.ndarray, t: float) -> None:
        self._place(q, v, t)
        self._opened.contacts.settle()

    def _place(self, q: np.ndarray, v: np.ndarray, t: float) -> None:
        coordinates, speeds, _ = self._opened.state.current
        coordinates[self.free], speeds[self.free] = q, v
        self.basis.state(self._opened)  # what depends on them follows
        self.mbs.systemData.SetTime(t)

    # In a run.

    def begin(self, torque: np.ndarray) -> None:
        self.basis.begin(self._opened, torque)

    def settle(self, newmark: bool) -> None:
        self.basis.settle(self._opened, newmark)

    def along(self, q: np.ndarray) -> Iterator[tuple]:
        rest = np.zeros(len(self))
        return ((row, rest) for row in q)

    def move(self, dq: np.ndarray, dv: np.ndarray) -> None:
        """Add to the coordinates and speeds (n,) of the current state."""
        q, v, _ = self._opened.state.current
        q[self.free] += dq
        v[self.free] += dv
        self.basis.state(self._opened)  # what depends on them follows

    def put(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> None:
        """Have these coordinates, speeds and accelerations (n,) in the current state."""
        for whole, values in zip(self._opened.state.current, (q, v, a), strict=True):
            whole[self.free] = values
        self.basis.state(self._opened)  # what depends on them follows

    def apply(self, torque: np.ndarray | None, here: Dynamics | None = None) -> None:
        self.basis.apply(self._opened, torque, here)

    def check_carried(self) -> None:
        self._opened.check_carried()

    @property
    def memory(self) -> tuple[np.ndarray, ...]:
        return self._opened.memory

    def recall(self, memory: tuple[np.ndarray, ...]) -> None:
        self._opened.recall(memory)
        self._opened.contacts.settle_general()

    def applied(self, place: tuple) -> np.ndarray:
        return self.basis.applied(self._opened)
