"""The plugin: Exudyn's user functions, commit and roll-back, Newton matrix.

This is the only file that touches the running solver. What a method does at each of its events is
in `methods/`. For one step from t_n to t_n+1 Exudyn calls

    PreStep                 the step is opened, or opened again after a rejection
    PreNewtonResidual       once before every residual: the muscles' torque is set
    SystemJacobian          when a Newton matrix is built, at the iterate just before
    PostStep                the step is accepted: the trial becomes the committed state

and PostStep once more at the start of the run. Nothing is committed before PostStep, and every
evaluation starts from the committed state, so that rejected steps leave no trace.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import exudyn as exu
import numpy as np

from ..errors import ModelError, SimulationError
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..results.counts import Counts, Status
from ..results.recorder import Recorder, Row, Window
from ..results.trajectory import Trajectory
from ..skeleton.external_forces import check_external_forces
from ..skeleton.hold import Hold, hold
from ..skeleton.reading import original, raise_as_itself
from .ending import judge_tracking, place, warn_of_early_end, warn_of_shortfalls
from .hooks import Hooks
from .parameters import keep_parameters
from .settings import RunSettings
from .solver import matrix_triplets, put_back_solver, request_jacobian, running_solver
from .start import check_times, warn_of_distance
from .state import RunState

Progress = Callable[[float], None]


class Plugin(ABC):
    """Muscles as part of an Exudyn simulation, through the user functions of the `mbs`.

    Use it around one call of `mbs.SolveDynamic`, with any implicit solver and settings:

        with plugin.attached():
            mbs.SolveDynamic(simulationSettings, solverType=...)
        result = plugin.result()

    User functions that the `mbs` already has are called first, as before. `result` can also be read
    after an exception: it holds what was accepted up to then.

    Parameters
    ----------
    model : MusculoskeletalModel
    start, end : float
        Time span that the plugin can serve [s].
    settings : RunSettings
        The method's frozen settings, stored with the result.
    motion : Motion, optional
        What is tracked, if anything.
    progress : callable, optional
        Called with the time reached after every accepted step.
    """

    method: str
    feeds_back = True  # the torque depends on the iterate, so that Newton's matrix has to know it
    goes_by_rule = True  # the coordinates are where Exudyn's rule has them
    settings: RunSettings
    motion: Motion | None
    state: RunState

    def __init__(
        self,
        model: MusculoskeletalModel,
        start: float,
        end: float,
        settings: RunSettings,
        motion: Motion | None,
        progress: Progress | None,
    ) -> None:
        self.model = model
        self.skeleton = model.skeleton
        self.start_time, self.end_time = start, end
        self.settings = settings
        self.motion = motion
        self._progress = progress
        self.state = self.new_state()

    # What a method supplies.

    @abstractmethod
    def new_state(self) -> RunState:
        """State of a run that has not begun."""

    def _common(self) -> dict[str, Any]:
        """What every run's state begins with."""
        counts = Counts()
        record = Recorder(self.method, self.model, self.settings, counts, self.motion)
        return {
            "counts": counts, "record": record, "end": self.end_time, "t_0": self.start_time
        }  # fmt: skip

    @abstractmethod
    def begin(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Set the state's `a`, `l_t` (m,) and `geometry` at the start; return the torque (n,).

        They are the committed state from then on; only `accept` replaces them.
        """

    @abstractmethod
    def ready(self, step: float) -> None:
        """The run begins with steps of length `step` [s]: a last chance to warn."""

    @abstractmethod
    def open_step(self, t_0: float, t_1: float) -> None:
        """A step is tried: `skeleton.start` holds q, q', q'' at `t_0`."""

    @abstractmethod
    def torque(self, t: float, first: bool) -> np.ndarray | None:
        """The torque (n,) at Exudyn's iterate; None leaves the last one.

        `first` marks Exudyn's predictor, where q'' is zero.
        """

    @abstractmethod
    def jacobian(self, exact: np.ndarray, mass: float, dq: float, dv: float) -> np.ndarray:
        """The tree's rows of the Newton matrix (n, N) in place of Exudyn's `exact` ones.

        N counts all coordinates of the system, the tree's are `skeleton.free`. Exudyn's matrix is
        mass * M + dq * dR/dq + dv * dR/dq', where dq, dv < 0 are its own factors and R is its
        right-hand side with the muscles' torque held.
        """

    @abstractmethod
    def accept(self, t_0: float, t_1: float) -> tuple[np.ndarray, Window | None]:
        """The step is accepted at the last iterate: commit.

        Returned are the reserves (r,) and, unless the window before goes on, the window.
        """

    # What a user calls.

    @contextmanager
    def attached(self) -> Iterator[Plugin]:
        """Install the plugin's user functions for one run; remove them afterwards.

        Raises
        ------
        ModelError
            The `mbs` has changed so that it cannot be driven, another run is attached, or one of
            the plugin's user functions was replaced.
        SimulationError
            Exudyn gave up; the result up to then is in its `trajectory` and in `result()`.
        Exception
            Whatever a user function raised, as itself, with a note of time and state.

        Warns
        -----
        IncompleteRunWarning
            Exudyn returned before the end time.
        UnmetTorqueWarning
            The muscles could not deliver the demanded torque; names the coordinates.
        TrackingWarning
            The run is off its motion by more than the control law promises; names the coordinates.
            Where it has lost the motion the result's status is `Status.LOST`, and it is stopped
            where a coordinate is half a turn beyond all that the motion has.
        """
        with hold(self.model.mbs) as held, self.attached_to(held):
            yield self

    @contextmanager
    def attached_to(self, held: Hold) -> Iterator[Plugin]:
        """`attached` for who already holds the `mbs`."""
        state, mbs, skeleton = self.new_state(), self.model.mbs, self.skeleton
        record = state.record
        skeleton.open(held, self.near)
        hooks = Hooks(mbs)
        if hooks.of_user:
            keep_parameters(mbs, held)
        self.state = state
        try:
            # What another run has left there must not be taken for this run's solver.
            held.keep(partial(put_back_solver, mbs, mbs.sys.get("dynamicSolver")))
            mbs.sys.pop("dynamicSolver", None)
            skeleton.begin(self.begin(skeleton.q.copy(), skeleton.v.copy()))
            held.keep(hooks.restore)
            hooks.install(self._own_hooks(hooks))
            yield self
            hooks.check()
            off = judge_tracking(record, state.end)
            if state.started and record.status is Status.INCOMPLETE:
                warn_of_early_end(record, running_solver(mbs))
        except BaseException as error:
            raised = original(error)
            where = place(skeleton, self.start_time if record.reached is None else record.reached)
            if isinstance(raised, exu.ExudynError):
                raised = SimulationError(f"Exudyn gave up {where}: {raised}")
                record.fail(raised, where)
                raise raised from error
            if state.started:
                raised.add_note(f"raised in the simulation {where}")
            record.fail(raised, where)
            raise_as_itself(raised, error)
        finally:
            record.stop()
        warn_of_shortfalls(record, off)

    def _own_hooks(self, hooks: Hooks) -> dict[str, Callable]:
        own: dict[str, Callable] = {
            "PreStep": partial(self._pre_step, hooks),
            "PreNewtonResidual": partial(self._pre_newton, hooks),
            "PostStep": partial(self._post_step, hooks),
        }
        if self.feeds_back or not self.skeleton.known_to_exudyn:
            own["SystemJacobian"] = partial(self._system_jacobian, matrix_triplets(self.skeleton))
        return own

    @property
    def near(self) -> np.ndarray | None:
        """Coordinates (n,) close to which the run starts, if that is known."""
        return None if self.motion is None else self.motion(self.start_time)[0]

    @property
    def tendon_forces(self) -> np.ndarray:
        """Tendon forces (m,) [N] after the last accepted step; zero before the run."""
        state = self.state
        if state.record.reached is None:
            return np.zeros(len(self.model.muscles))
        return self.model.tendon_forces(state.geometry, state.a, state.l_t)

    def result(self) -> Trajectory:
        """What was accepted so far.

        Raises
        ------
        SimulationError
            Nothing was simulated yet.
        """
        record = self.state.record
        if record.reached is None:
            raise SimulationError("there is no result yet: run mbs.SolveDynamic within attached()")
        return record.trajectory()

    # The hooks.

    def _pre_step(self, hooks: Hooks, mbs: exu.MainSystem, t: float) -> bool:
        """Open a step; a step still open was rejected."""
        state, t_0 = self.state, mbs.systemData.GetTime(exu.ConfigurationType.StartOfStep)
        if not state.started or (state.open and t_0 != state.t_0):
            hooks.check()  # PostStep was not called
        state.counts.rejected_steps += state.open
        state.open, state.t_0, state.iteration, state.calls = True, t_0, -1, 0
        before, state.step = state.step, t - t_0
        if abs(state.step - before) > 1e-6 * state.step:
            # Modified Newton would go on with the matrix of the other step size; with ten
            # iterations a step instead of one, Exudyn never enlarges a reduced step again.
            request_jacobian(mbs)
        self.open_step(t_0, t)
        return True

    def _pre_newton(
        self, hooks: Hooks, mbs: exu.MainSystem, t: float, iteration: int, _: int
    ) -> None:
        """Set the torque that belongs to the iterate."""
        state = self.state
        if not state.open:
            hooks.check()
        # A restart of modified Newton repeats the iteration's number with the predictor's state.
        first = iteration == 0 or iteration == state.iteration
        state.iteration = iteration
        state.calls += 1
        state.counts.newton_iterations += not first
        torque = self.torque(t, first)
        if torque is not None and not math.isfinite(torque.dot(torque)):
            raise SimulationError(f"torque {torque} at t = {t:g} s is not finite")
        self.skeleton.apply(torque, state.here)

    def _system_jacobian(
        self, triplets: np.ndarray, mbs: exu.MainSystem, t: float, dq: float, dv: float, _: float
    ) -> exu.MatrixContainer:
        """What has to be added to Exudyn's own Newton matrix."""
        solver, skeleton = running_solver(mbs), self.skeleton
        exact = np.asarray(solver.GetSystemJacobian())[skeleton.rows]
        mass = (1.0 - solver.alphaM) / (1.0 - solver.alphaF)
        wanted = skeleton.reduced_rows(exact)
        if self.feeds_back:
            wanted = self.jacobian(wanted, mass, dq, dv)
        triplets[:, 2] = (skeleton.all_rows(wanted) - exact).ravel()
        container = exu.MatrixContainer()
        container.SetWithSparseMatrix(triplets, exact.shape[1], exact.shape[1])
        return container

    def _post_step(self, hooks: Hooks, mbs: exu.MainSystem, t: float) -> bool:
        """Commit the accepted step, or check that the run starts as the plugin was told."""
        state = self.state
        if not state.open:
            hooks.check()
            self._check_start(mbs, t)
            self._add(t, state.record.start[1], None)
            return True
        if state.calls == 0:
            hooks.check()
            raise ModelError(
                "this solver never asked for the muscles' torque: explicit solvers cannot be used"
            )
        state.open = False
        accepted = self.accept(state.t_0, t)
        if self.settings.project_constraints and self.skeleton.project(self.goes_by_rule):
            state.geometry = self.model.geometry(*self.skeleton.place)
        self._add(t, *accepted)
        state.counts.steps += 1
        end = running_solver(mbs).it.endTime
        if t >= end - 1e-9 * max(1.0, abs(end)):
            state.record.complete()
        if self._progress is not None:
            self._progress(t)
        return not state.is_absurd(self.skeleton.q)

    def _add(self, t: float, reserve: np.ndarray, window: Window | None) -> None:
        state, skeleton = self.state, self.skeleton
        place = skeleton.place
        q, v, a = place[0].copy(), place[1].copy(), skeleton.acceleration.copy()
        whole = skeleton.x, skeleton.x_t, skeleton.drift
        point = q, v, a, *whole, state.a, state.l_t, skeleton.applied(place)
        state.record.add(Row(t, point, reserve, window, (q, v, *place[2:])))

    def _check_start(self, mbs: exu.MainSystem, t: float) -> None:
        state = self.state
        if state.started:
            raise ModelError(
                "a second run began within one attached(): attach the plugin anew for every run"
            )
        state.started = True
        iteration = running_solver(mbs).it
        check_times(t, iteration.endTime, self.start_time, self.end_time)
        check_external_forces(mbs, iteration.startTime, iteration.endTime)
        state.end = iteration.endTime
        if self.motion is not None:
            warn_of_distance(self.motion, t, self.skeleton.q)
        self.ready((iteration.endTime - iteration.startTime) / iteration.numberOfSteps)
        algorithm = mbs.sys["simulationSettings"].timeIntegration.generalizedAlpha
        self.skeleton.settle(algorithm.useNewmark)
