"""The plugin: Exudyn's user functions, commit and roll-back, Newton matrix.

This is the only file that touches the running solver. What a method does at each of its events is
in `methods/`. For one step from t_n to t_n+1 Exudyn calls

    PreStep                 the step is opened, or opened again after a rejection
    PreNewtonResidual       once before every residual: the muscles' torque is set
    SystemJacobian          when a Newton matrix is built, at the iterate just before
    PostStep                the step is accepted: the trial becomes the committed state

and PostStep once more where the run begins or goes on. Nothing is committed before PostStep, and
every evaluation starts from the committed state, so that rejected steps leave no trace.
"""

from __future__ import annotations

import math
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
from . import continuing
from .continuing import RunPoint
from .ending import fail, judge_tracking, place, warn_of_early_end, warn_of_shortfalls
from .hooks import Hooks
from .method import Method
from .newton import addition, is_alone, last_lack, whole_matrix
from .parameters import keep_parameters
from .settings import RunSettings
from .solver import (
    check_begins,
    forget_solver,
    goes_by_newmark,
    last_solver,
    put_back_solver,
    request_jacobian,
    running_solver,
    set_newton_matrix,
    takes_matrices,
)  # fmt: skip
from .start import check_end_time, check_start_time, warn_of_distance
from .state import RunState

Progress = Callable[[float], None]

SAME_STEP = 1e-6  # of its length: what steps of the same length may differ by


class Plugin(Method):
    """Muscles as part of an Exudyn simulation, through the user functions of the `mbs`.

    Use it around a call of `mbs.SolveDynamic`, with any implicit solver and settings:

        with plugin.attached():
            mbs.SolveDynamic(simulationSettings, solverType=...)
        result = plugin.result()

    Several calls with `updateInitialValues=True`, or of `SolveSteps` of a solver of your own that
    is `mbs.sys["dynamicSolver"]`, are one run as long as each begins where the one before ended.

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

    def _common(self) -> dict[str, Any]:
        """What every run's state begins with."""
        counts = Counts()
        record = Recorder(self.method, self.model, self.settings, counts, self.motion)
        return {
            "counts": counts, "record": record, "end": self.end_time, "t_0": self.start_time
        }  # fmt: skip

    # What a user calls.

    @contextmanager
    def attached(self) -> Iterator[Plugin]:
        """Install the plugin's user functions for one run, which may end and go on; remove them
        afterwards.

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
        state = self.new_state()
        with hold(self.model.mbs) as held, self.attached_to(held, state):
            yield self

    @contextmanager
    def attached_to(self, held: Hold, state: RunState) -> Iterator[Plugin]:
        """`attached` for who already holds the `mbs`, with a new state that was made before: what a
        criterion copies of the `mbs` is free of runs."""
        mbs, skeleton = self.model.mbs, self.skeleton
        record = state.record
        skeleton.open(held, self.near)
        hooks = Hooks(mbs)
        if hooks.of_user:
            keep_parameters(mbs, held)
        self.state = state
        try:
            # What another run has left there must not be taken for this run's solver.
            held.keep(partial(put_back_solver, mbs, last_solver(mbs)))
            forget_solver(mbs)
            mbs.systemData.SetTime(self.start_time)
            load = self.begin(skeleton.q.copy(), skeleton.v.copy())
            skeleton.begin(load)
            held.keep(hooks.restore)
            hooks.install(self._own_hooks(hooks))
            held.keep(lambda: [give_back() for give_back in state.matrices])
            state.attached = True
            yield self
            hooks.check()
            skeleton.check_carried()
            off = judge_tracking(record, state.end)
            if state.running and record.status is Status.INCOMPLETE:
                warn_of_early_end(record, running_solver(mbs), state.open)
        except BaseException as error:
            reached = self.start_time if record.reached is None else record.reached
            fail(record, error, place(skeleton, reached))
        finally:
            state.attached = False
            record.stop()
        warn_of_shortfalls(record, off)

    def _own_hooks(self, hooks: Hooks) -> dict[str, Callable]:
        own: dict[str, Callable] = {
            "PreStep": partial(self._pre_step, hooks),
            "PreNewtonResidual": partial(self._pre_newton, hooks),
            "PostStep": partial(self._post_step, hooks),
        }
        if self.feeds_back or not self.skeleton.known_to_exudyn:
            own["SystemJacobian"] = addition(self, self.skeleton)
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
        """The `Trajectory` of what was accepted so far.

        Raises
        ------
        SimulationError
            Nothing was simulated yet.
        """
        record = self.state.record
        if record.reached is None:
            raise SimulationError("there is no result yet: run mbs.SolveDynamic within attached()")
        return record.trajectory()

    def save(self) -> RunPoint:
        """The `RunPoint` that the run has reached at the end of the last call of Exudyn's solver.

        Raises
        ------
        SimulationError
            There is none, or it stopped before its end.
        """
        return continuing.save_point(self.method, self.model, self.state)

    def restore(self, point: RunPoint) -> None:
        """Be at a point again, within `attached()` and between calls of Exudyn's solver.

        The system's initial and current state, muscles, windows, controls, counts and the record
        are as they were there: the same call gives the same bits, another one another future. The
        point may be of an earlier `attached()`, and of the same model made anew.

        Parameters
        ----------
        point : RunPoint
            From `save` of a run by the same method.

        Raises
        ------
        ModelError
            The plugin is not attached, or the point does not fit it; names what differs.
        """
        continuing.restore_point(point, self.method, self.model, self.state, self.start_time)

    # The hooks.

    def _pre_step(self, hooks: Hooks, mbs: exu.MainSystem, t: float) -> bool:
        """Open a step; a step still open was rejected."""
        state, t_0 = self.state, mbs.systemData.GetTime(exu.ConfigurationType.StartOfStep)
        if not state.running or (state.open and t_0 != state.t_0):
            hooks.check()  # PostStep was not called
        state.counts.rejected_steps += state.open
        state.open, state.t_0, state.iteration, state.calls = True, t_0, -1, 0
        before, state.step = state.step, t - t_0
        if abs(state.step - before) > SAME_STEP * state.step:
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
        if state.replaced:
            return
        if torque is not None and not math.isfinite(torque.dot(torque)):
            raise SimulationError(f"torque {torque} at t = {t:g} s is not finite")
        if first or state.change is None or state.alone is None or torque is None:
            self.skeleton.apply(torque, state.here)
        else:
            state.alone.apply_again(torque, state.change, last_lack(running_solver(mbs)))

    def _post_step(self, hooks: Hooks, mbs: exu.MainSystem, t: float) -> bool:
        """Commit the accepted step, or begin the run or let it go on."""
        state, iteration = self.state, running_solver(mbs).it
        if not state.open or iteration.currentStepIndex == 0:
            hooks.check()
            self._begin_run(hooks, mbs, t)
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
        if t >= iteration.endTime - state.rounding:
            state.record.complete()
            state.running, state.ended = False, continuing.end_of_run(self.model, t)
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

    def _begin_run(self, hooks: Hooks, mbs: exu.MainSystem, t: float) -> None:
        """A run begins, or goes on where the one before has ended."""
        check_begins(mbs, t)
        state, iteration = self.state, running_solver(mbs).it
        end, goes_on = iteration.endTime, state.record.reached is not None
        if goes_on:
            self.skeleton.check_carried()
            continuing.go_on(self.model, state, t)
        else:
            check_start_time(t, self.start_time)
        check_end_time(t, end, self.end_time)
        state.begin_run(end, check_external_forces(mbs, t, end))
        skeleton, state.alone, state.change = self.skeleton, None, None
        if self.feeds_back and is_alone(skeleton) and takes_matrices(mbs):
            state.alone, state.watched = skeleton, hooks.of_user
            state.matrices.append(set_newton_matrix(mbs, whole_matrix(self, skeleton)))
        if goes_on:
            step = iteration.currentStepSize
            if abs(step - state.step) > SAME_STEP * step:
                self.ready(step)
        else:
            if self.motion is not None:
                warn_of_distance(self.motion, t, self.skeleton.q)
            self.ready((end - iteration.startTime) / iteration.numberOfSteps)
            self.skeleton.settle(goes_by_newmark(mbs))
            self._add(t, state.record.start[1], None)
