"""What a skeleton is for the methods, whatever Exudyn system it is.

Equations of motion (1) of its n coordinates q: M(q) q'' + H(q, q') = Q_m + Q. Forces are handed to
Exudyn as a *load*: torques on the independent coordinates of a tree, generalized forces on all
coordinates x of any other system.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager

import exudyn as exu
import numpy as np

from ..forces.actuator_table import ActuatorTable
from ..path.paths import Paths
from .ahead import TRAPEZOIDAL, Rule
from .geometry import Mounted
from .hold import Hold
from .opened import Dynamics
from .segments import Segments
from .shown import OwnGraphics
from .state import State

Gain = float | np.ndarray  # of one coordinate or each

NO_COORDINATES = np.empty(0)


class ExudynSkeleton(ABC):
    """The interface of all skeletons.

    Attributes
    ----------
    mbs : exudyn.MainSystem
    coordinates : tuple of str
        Names of the n coordinates that the methods know.
    units : tuple of str
        Their units, rad or m.
    tree_coordinates : tuple of str
        Names of those that paths and functions may depend on, dependent ones included.
    system_names : tuple of str
        Names of the N coordinates x of the whole system; none of a tree, whose coordinates say all.
    rows, free : slice or int ndarray
        In Exudyn's Newton matrix, the rows that the plugin replaces, and among its columns those
        that `Plugin.jacobian` is about.
    """

    mbs: exu.MainSystem
    coordinates: tuple[str, ...]
    units: tuple[str, ...]
    tree_coordinates: tuple[str, ...]
    system_names: tuple[str, ...]
    rows: slice
    free: slice | np.ndarray

    def __init__(self, mbs: exu.MainSystem) -> None:
        self.mbs = mbs

    def __len__(self) -> int:
        return len(self.coordinates)

    @property
    @abstractmethod
    def known_to_exudyn(self) -> bool:
        """Whether Exudyn itself integrates the coordinates: its initial accelerations and its
        Newton matrix are right."""

    # The model's muscles.

    @property
    @abstractmethod
    def width(self) -> int:
        """How many coordinates unit forces of muscles are first written on."""

    @property
    @abstractmethod
    def others(self) -> int:
        """Number of directions in which the system moves besides the n coordinates."""

    @abstractmethod
    def frame_number(self, what: str, link: int) -> int:
        """That of the frame of a link, body or marker.

        Raises
        ------
        ParameterError
            There is none; names `what` is on it.
        """

    @abstractmethod
    def mount(self, paths: Paths, muscles: Sequence[str], actuators: ActuatorTable) -> Mounted:
        """The paths of these muscles and the actuators, put on it."""

    @abstractmethod
    def check_assembled(self) -> None:
        """Raise ModelError unless Exudyn can solve the system and it can be driven."""

    @abstractmethod
    def state_of_tree(self, *state: np.ndarray) -> tuple[np.ndarray, ...]:
        """Values of all `tree_coordinates` (..., N), if asked also speeds and accelerations.

        From those of the independent ones, (..., n) each.
        """

    # Pictures.

    @abstractmethod
    def frames_shown(self, near: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Frames R (f, 3, 3), p (f, 3) that paths are on, and the values of `tree_coordinates`,
        at Exudyn's visualization state; `near` as of `open`."""

    @abstractmethod
    def own_graphics(self) -> OwnGraphics:
        """What it has to be drawn by."""

    @abstractmethod
    def segments(self) -> Segments:
        """Its bodies, whose joints are taken from the visualization state."""

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

    @abstractmethod
    def initial_state(self) -> tuple[np.ndarray, np.ndarray]:
        """Initial coordinates and speeds (n,) each."""

    @abstractmethod
    def set_initial_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Set initial coordinates and speeds (n,); what does not depend on them keeps its own."""

    # Opening.

    @abstractmethod
    def opened(self) -> AbstractContextManager[ExudynSkeleton]:
        """`open` for a block."""

    @abstractmethod
    def open(self, held: Hold, near: np.ndarray | None = None) -> None:
        """Prepare for evaluations; the system's current state becomes its initial state.

        Whoever has the hold gets the system back as it was. `near` (n,) are values from which the
        turns of angles are counted where the system does not tell.

        Raises
        ------
        ModelError
            The system cannot be driven.
        """

    def snapshot(self) -> tuple[list[np.ndarray], float]:
        """The system's current coordinates, speeds, accelerations, data and time."""
        return State(self.mbs, self.rows).snapshot()

    def restore(self, snapshot: tuple[list[np.ndarray], float]) -> None:
        """Put a snapshot back."""
        State(self.mbs, self.rows).restore(snapshot)

    # The current state and, once it is open, evaluations there.

    @property
    @abstractmethod
    def q(self) -> np.ndarray:
        """Coordinates (n,) of the current state."""

    @property
    @abstractmethod
    def v(self) -> np.ndarray:
        """Their speeds (n,)."""

    @property
    @abstractmethod
    def acceleration(self) -> np.ndarray:
        """Their accelerations (n,)."""

    @property
    @abstractmethod
    def start(self) -> tuple[np.ndarray, ...]:
        """The same three at the start of the step."""

    @property
    def x(self) -> np.ndarray:
        """Coordinates (N,) of the current state, as `system_names` names them."""
        return NO_COORDINATES

    @property
    def x_t(self) -> np.ndarray:
        """Their speeds (N,)."""
        return NO_COORDINATES

    @property
    def drift(self) -> float:
        """By how much the constraints, if any, are violated at most there [rad, m or 1]."""
        return 0.0

    def project(self, by_rule: bool) -> bool:
        """At the end of a step, move the current state to where the constraints are met; False:
        there are none. The coordinates go by the trapezoidal rule, or stay where they are."""
        return False

    @property
    @abstractmethod
    def place(self) -> tuple:
        """What the model's `geometry` takes at the current state: q, q' and what else it needs."""

    @abstractmethod
    def along(self, q: np.ndarray) -> Iterator[tuple]:
        """What the model's lengths are computed from, its `geometry` of a tree and its `loads` of
        any other system, at rest at the coordinates `q` (k, n) of a motion, before a run."""

    def places_of(
        self, q: np.ndarray, v: np.ndarray, x: np.ndarray, x_t: np.ndarray, t: np.ndarray
    ) -> Iterator[tuple]:
        """The `place`s of recorded states, q, q' (k, n) of what is tracked and `x`, `x_t` (k, N) of
        the whole system, at times (k,)."""
        return zip(q, v, strict=True)

    @abstractmethod
    def dynamics(self) -> Dynamics:
        """M and H - Q, without the muscles, at the system's current state and time."""

    def dynamics_at(self, q: np.ndarray, v: np.ndarray, t: float) -> Dynamics:
        """As `dynamics`, at coordinates `q`, speeds `v` and time `t`.

        What does not depend on them stays where it is. The system's state and time are as before
        afterwards, to the last bit.
        """
        return self._dynamics_there(q, v, t, None)

    def dynamics_ahead(
        self, q: np.ndarray, v: np.ndarray, t: float, rule: Rule = TRAPEZOIDAL
    ) -> Dynamics:
        """As `dynamics_at`, with everything else where its state at the start of the step leads.

        Beside a tree it goes on with constant acceleration, in a system of bodies by one step of a
        `rule`, within which it also responds to the forces on q.
        """
        return self._dynamics_there(q, v, t, rule)

    def places_ahead(self, q: np.ndarray, v: np.ndarray, t: float, rule: Rule) -> Iterator[tuple]:
        """The `place` of `dynamics_ahead` at each of the coordinates `q` (k, n)."""
        return (self.dynamics_ahead(row, v, t, rule).place for row in q)

    def dynamics_held(self) -> Dynamics:
        """As `dynamics`, where what nobody tracks does not give way but keeps its place, as far as
        it is stiff."""
        return self.dynamics()

    @abstractmethod
    def _dynamics_there(
        self, q: np.ndarray, v: np.ndarray, t: float, ahead: Rule | None
    ) -> Dynamics:
        """What `dynamics_at` and `dynamics_ahead` share."""

    @abstractmethod
    def go_to(self, q: np.ndarray, v: np.ndarray, t: float) -> None:
        """Put the current state at coordinates `q` and speeds `v` (n,) at the time `t`."""

    # In a run.

    @abstractmethod
    def begin(self, load: np.ndarray) -> None:
        """Set the load at the start of a run, which is the current state."""

    @abstractmethod
    def settle(self, newmark: bool) -> None:
        """The run begins at the current state, by Newmark's method or by generalized alpha.

        Raises
        ------
        ParameterError
            The solver's initial accelerations are wrong, and stay so.
        """

    def ideal_load(self, there: Dynamics, torque: np.ndarray) -> np.ndarray:
        """The load of torques (n,) on the coordinates themselves."""
        return torque

    @abstractmethod
    def apply(self, load: np.ndarray | None, here: Dynamics | None = None) -> None:
        """Set the load at Exudyn's iterate, on top of the user's own, where the `dynamics` are
        `here` if they are known; None: the last one stays."""

    def check_carried(self) -> None:
        """Raise ModelError if loads were changed whose forces the plugin carries."""
        return  # none are, but on trees

    @property
    @abstractmethod
    def memory(self) -> tuple[np.ndarray, ...]:
        """What evaluations take from the ones before: the load that is applied, to the last bit,
        and turns of angles."""

    @abstractmethod
    def recall(self, memory: tuple[np.ndarray, ...]) -> None:
        """Have the `memory` of another time back, where the current state is that of then, and
        contacts as they were."""

    @abstractmethod
    def applied(self, place: tuple) -> np.ndarray:
        """The torques (n,) on the coordinates that Exudyn has now, at the `place`."""

    def reduced(self, covectors: np.ndarray) -> np.ndarray:
        """Loads (..., k) of what unit forces are on `width` coordinates, at the current state."""
        return covectors

    # Newton's matrix, in which the loads follow the iterate.

    @abstractmethod
    def imbalance(self, there: Dynamics, a: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """What of M q'' + H - Q - Q_m (n,) is not in Exudyn's own matrix."""

    @abstractmethod
    def rows_of_law(
        self, exact: np.ndarray, here: Dynamics, mass: float, kp: Gain, kv: Gain
    ) -> np.ndarray:
        """Rows of the Newton matrix with the demand of (15) met, as `Plugin.jacobian`; the gains
        `kp`, `kv` are times its factors dq, dv."""

    @abstractmethod
    def rows_of_slopes(
        self, exact: np.ndarray, here: Dynamics, mass: float, slopes: np.ndarray
    ) -> np.ndarray:
        """The same with slopes (n, n) of `imbalance` but for its q'', times the factor dq."""

    def reduced_rows(self, exact: np.ndarray) -> np.ndarray:
        """`rows` of Exudyn's Newton matrix as those of the coordinates that loads act on."""
        return exact

    def all_rows(self, wanted: np.ndarray) -> np.ndarray:
        """`rows` of a Newton matrix with those of the coordinates that loads act on."""
        return wanted
