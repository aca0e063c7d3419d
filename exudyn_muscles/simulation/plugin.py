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
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import exudyn as exu
import numpy as np

from ..errors import (
    IncompleteRunWarning,
    ModelError,
    MotionError,
    ParameterError,
    SimulationError,
    StartWarning,
    UnmetTorqueWarning,
    warn,
)
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..results.trajectory import Counts, Recorder, Row, Status, Trajectory, Window
from ..skeleton.external_forces import check_external_forces
from ..skeleton.geometry import Geometry
from ..skeleton.hold import Hold, hold
from ..skeleton.skeleton import Skeleton
from ..skeleton.system import original, raise_as_itself

# Tracking error at the start [rad or m] above which a user is told.
FAR_AWAY = 0.02

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
    settings : object
        The method's frozen settings, stored with the result.
    motion : Motion, optional
        What is tracked, if anything.
    progress : callable, optional
        Called with the time reached after every accepted step.
    """

    method: str
    feeds_back = True  # the torque depends on the iterate, so that Newton's matrix has to know it
    a: np.ndarray
    l_t: np.ndarray
    geometry: Geometry
    settings: object
    motion: Motion | None

    def __init__(
        self,
        model: MusculoskeletalModel,
        start: float,
        end: float,
        settings: object,
        motion: Motion | None,
        progress: Progress | None,
    ) -> None:
        self.model = model
        self.skeleton = model.skeleton
        self.start_time, self.end_time = start, end
        self.settings = settings
        self.motion = motion
        self._progress = progress
        self._reset()

    # What a method supplies.

    @abstractmethod
    def begin(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Set `a`, `l_t` (m,) and `geometry` at the start; return the muscles' torque (n,).

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
        """
        with hold(self.model.mbs) as held, self.attached_to(held):
            yield self

    @contextmanager
    def attached_to(self, held: Hold) -> Iterator[Plugin]:
        """`attached` for who already holds the `mbs`."""
        begun = time.process_time()
        self.skeleton.open(held)
        self._hooks = _Hooks(self.model.mbs)
        self._reset()
        self.record.begun = begun
        try:
            # What another run has left there must not be taken for this run's solver.
            last_solver = self.model.mbs.sys.get("dynamicSolver")
            held.keep(partial(_put_back_solver, self.model.mbs, last_solver))
            self.model.mbs.sys.pop("dynamicSolver", None)
            self.skeleton.begin(self.begin(*self.skeleton.initial_state()))
            self._triplets = _triplets(self.skeleton)
            held.keep(self._hooks.restore)
            self._hooks.install(self)
            yield self
            self._hooks.check()
            self._check_finished()
        except BaseException as error:
            raised = original(error)
            if isinstance(raised, exu.ExudynError):
                raised = SimulationError(f"Exudyn gave up {self._where()}: {raised}")
                self.record.fail(raised, self._where())
                raise raised from error
            if self._started:
                raised.add_note(f"raised in the simulation {self._where()}")
            self.record.fail(raised, self._where())
            raise_as_itself(raised, error)
        finally:
            self.record.stop()
        warn_of_unmet_torque(self.record)

    @property
    def tendon_forces(self) -> np.ndarray:
        """Tendon forces (m,) [N] after the last accepted step; zero before the run."""
        if self.record.reached is None:
            return np.zeros(len(self.model.muscles))
        return self.model.tendon_forces(self.geometry, self.a, self.l_t)

    def result(self) -> Trajectory:
        """What was accepted so far.

        Raises
        ------
        SimulationError
            Nothing was simulated yet.
        """
        if self.record.reached is None:
            raise SimulationError("there is no result yet: run mbs.SolveDynamic within attached()")
        return self.record.trajectory()

    def _reset(self) -> None:
        self._open = False  # a step is being tried
        self._started = False
        self._t_0 = self.start_time  # start of the step
        self._calls = 0  # of pre_newton in this step
        self.step = 0.0  # length of the step being tried [s]
        self.run_end = self.end_time
        self.counts = Counts()
        self.record = Recorder(self.method, self.model, self.settings, self.counts, self.motion)

    # The hooks.

    def pre_step(self, mbs: exu.MainSystem, t: float) -> bool:
        """Open a step; a step still open was rejected."""
        t_0 = mbs.systemData.GetTime(exu.ConfigurationType.StartOfStep)
        if not self._started or (self._open and t_0 != self._t_0):
            self._hooks.check()  # PostStep was not called
        self.counts.rejected_steps += self._open
        self._open, self._t_0, self._last_iteration, self._calls = True, t_0, -1, 0
        before, self.step = self.step, t - t_0
        if abs(self.step - before) > 1e-6 * self.step:
            # Modified Newton would go on with the matrix of the other step size; with ten
            # iterations a step instead of one, Exudyn never enlarges a reduced step again.
            self.request_jacobian()
        self.open_step(t_0, t)
        return True

    def request_jacobian(self) -> None:
        """Have Exudyn's modified Newton build a new matrix in this step."""
        self._solver().conv.jacobianUpdateRequested = True

    def pre_newton(self, mbs: exu.MainSystem, t: float, iteration: int, _: int) -> None:
        """Set the torque that belongs to the iterate."""
        if not self._open:
            self._hooks.check()
        # A restart of modified Newton repeats the iteration's number with the predictor's state.
        first = iteration == 0 or iteration == self._last_iteration
        self._last_iteration = iteration
        self._calls += 1
        self.counts.newton_iterations += not first
        torque = self.torque(t, first)
        if torque is not None and not math.isfinite(torque @ torque):
            raise SimulationError(f"torque {torque} at t = {t:g} s is not finite")
        self.skeleton.apply(torque)

    def system_jacobian(
        self, mbs: exu.MainSystem, t: float, dq: float, dv: float, _: float
    ) -> exu.MatrixContainer:
        """What has to be added to Exudyn's own Newton matrix."""
        solver, skeleton = self._solver(), self.skeleton
        exact = np.asarray(solver.GetSystemJacobian())[skeleton.rows]
        mass = (1.0 - solver.alphaM) / (1.0 - solver.alphaF)
        wanted = skeleton.reduced_rows(exact)
        if self.feeds_back:
            wanted = self.jacobian(wanted, mass, dq, dv)
        self._triplets[:, 2] = (skeleton.all_rows(wanted) - exact).ravel()
        container = exu.MatrixContainer()
        container.SetWithSparseMatrix(self._triplets, exact.shape[1], exact.shape[1])
        return container

    def post_step(self, mbs: exu.MainSystem, t: float) -> bool:
        """Commit the accepted step, or check that the run starts as the plugin was told."""
        if not self._open:
            self._hooks.check()
            self._check_start(mbs, t)
            self._add(t, self.record.start[1], None)
            return True
        if self._calls == 0:
            self._hooks.check()
            raise ModelError(
                "this solver never asked for the muscles' torque: explicit solvers cannot be used"
            )
        self._open = False
        self._add(t, *self.accept(self._t_0, t))
        self.counts.steps += 1
        end = self._solver().it.endTime
        if t >= end - 1e-9 * max(1.0, abs(end)):
            self.record.status = Status.COMPLETE
        if self._progress is not None:
            self._progress(t)
        return True

    def _add(self, t: float, reserve: np.ndarray, window: Window | None) -> None:
        state = self.skeleton.q, self.skeleton.v, self.skeleton.acceleration
        point = *(x.copy() for x in state), self.a, self.l_t, self.skeleton.applied
        self.record.add(Row(t, point, reserve, window))

    def _check_start(self, mbs: exu.MainSystem, t: float) -> None:
        if self._started:
            raise ModelError(
                "a second run began within one attached(): attach the plugin anew for every run"
            )
        self._started = True
        iteration = self._solver().it
        if abs(t - self.start_time) > 1e-9:
            raise ParameterError(
                f"timeIntegration.startTime = {t:g} s, but the plugin's muscles start at "
                f"{self.start_time:g} s; give the plugin the start of the run with start="
            )
        if iteration.endTime > self.end_time + 1e-9:
            raise MotionError(
                f"timeIntegration.endTime = {iteration.endTime:g} s is beyond the end at "
                f"{self.end_time:g} s"
            )
        check_external_forces(mbs, iteration.startTime, iteration.endTime)
        self.run_end = iteration.endTime
        if self.motion is not None:
            away = self.motion(t)[0] - self.skeleton.q
            if np.abs(away).max() > FAR_AWAY:
                warn(
                    f"the run starts away from the motion, with tracking errors {away} at t = {t:g}"
                    " s; set the initial coordinates of the mbs",
                    StartWarning,
                )
        self.ready((iteration.endTime - iteration.startTime) / iteration.numberOfSteps)
        algorithm = mbs.sys["simulationSettings"].timeIntegration.generalizedAlpha
        self.skeleton.settle(algorithm.useNewmark)

    def _solver(self) -> exu.MainSolverImplicitSecondOrder:
        try:
            return self.model.mbs.sys["dynamicSolver"]
        except KeyError as error:
            raise ModelError(
                "the plugin works with mbs.SolveDynamic and its default storeSolver=True"
            ) from error

    def _check_finished(self) -> None:
        """Exudyn also returns True when it was stopped early."""
        record = self.record
        if not self._started or record.status is Status.COMPLETE:
            return
        solver = self._solver()
        why = "a user function" if solver.output.simulationStoppedByUserFunction else "the user"
        if solver.output.simulationTimeout:
            why = "exudyn.special.solver.timeout"
        record.message = (
            f"stopped by {why} at t = {record.reached:g} s before {solver.it.endTime:g} s"
        )
        warn(record.message, IncompleteRunWarning)

    def _where(self) -> str:
        data = self.model.mbs.systemData
        reached = self.start_time if self.record.reached is None else self.record.reached
        return (
            f"at t = {data.GetTime():.6g} s (accepted up to {reached:.6g} s), "
            f"q = {np.array2string(self.skeleton.q, precision=5)}, "
            f"q' = {np.array2string(self.skeleton.v, precision=5)}"
        )


def _triplets(skeleton: Skeleton) -> np.ndarray:
    """Row, column and a place for the value of the tree's rows in the system's Newton matrix."""
    data = skeleton.mbs.systemData
    columns = np.arange(data.ODE2Size() + data.ODE1Size() + data.AEsize())
    i, j = np.meshgrid(np.arange(skeleton.rows.start, skeleton.rows.stop), columns, indexing="ij")
    return np.column_stack([i.ravel(), j.ravel(), np.zeros(i.size)])


def warn_of_unmet_torque(record: Recorder) -> None:
    """One UnmetTorqueWarning for a whole run, if there is anything to say."""
    if record.fell_short:
        text = record.trajectory().unmet_torque_report()
        warn(f"unmet torque: {text}", UnmetTorqueWarning)


class _Hooks:
    """The user functions that the `mbs` had, and the plugin's in front of the solver."""

    NAMES = ("PreStep", "PreNewtonResidual", "SystemJacobian", "PostStep")

    def __init__(self, mbs: exu.MainSystem) -> None:
        self._mbs = mbs
        self._before = {name: self._now(name) for name in self.NAMES}
        self._installed: dict[str, Callable] = {}
        if self._before["SystemJacobian"]:
            raise ModelError(
                "the mbs has a SystemJacobian user function; the plugin needs this one for itself"
            )

    def install(self, plugin: Plugin) -> None:
        own: dict[str, Callable] = {
            "PreStep": plugin.pre_step,
            "PreNewtonResidual": plugin.pre_newton,
            "PostStep": plugin.post_step,
        }
        if plugin.feeds_back or not plugin.skeleton.basis.known_to_exudyn:
            own["SystemJacobian"] = plugin.system_jacobian
        for name, function in own.items():
            self._installed[name] = _chained(name, self._before[name], function)
            getattr(self._mbs, f"Set{name}UserFunction")(self._installed[name])

    def check(self) -> None:
        """Raise ModelError if any of them is no longer there."""
        lost = [name for name, own in self._installed.items() if self._now(name) != own]
        if lost:
            raise ModelError(
                f"the mbs got another {' and another '.join(lost)} user function within "
                "attached(), without which there are no muscles; set your own ones before: they "
                "are called first"
            )

    def restore(self) -> None:
        for name, function in self._before.items():
            getattr(self._mbs, f"Set{name}UserFunction")(function)

    def _now(self, name: str) -> Any:
        stored = getattr(self._mbs, f"Get{name}UserFunction")()
        return stored["function"] if isinstance(stored, dict) else stored


def _put_back_solver(mbs: exu.MainSystem, solver: Any) -> None:
    """Where no run has left another one."""
    if solver is not None:
        mbs.sys.setdefault("dynamicSolver", solver)


def _chained(name: str, before: Any, own: Callable) -> Callable:
    """The user's own function first, then the plugin's."""
    if not before:
        return own
    if name == "PreNewtonResidual":

        def both(*arguments: Any) -> None:
            before(*arguments)
            own(*arguments)

        return both

    def checked(*arguments: Any) -> bool:
        proceed = before(*arguments)
        if proceed is None:
            raise ModelError(
                f"the {name} user function of the mbs returned None, on which Exudyn would stop "
                "without a word; return True to go on or False to stop"
            )
        return own(*arguments) and bool(proceed)

    return checked
