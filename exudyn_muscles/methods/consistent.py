"""Consistent co-simulation: within a step the skeleton feels the force that the muscles really
have there.

CSF's torque runs through a step as Exudyn's integrator has it, while the force of muscles with held
excitations is curved. Deferred correction closes the gap. At a corrector iterate, with the forces
recruited and the excitations found that lead to them, the muscles are integrated over the step that
ends there; at the nodes of a quadrature their torques, M and H - Q give the accelerations q'' that
the skeleton really has, and

    q_1 = q_0 + h q_0' + int (t_1 - t) q'' dt,    q_1' = q_0' + int q'' dt

is where the step really leads. The iterate is moved there, and Exudyn's Newton goes on from it as
if the step had begun elsewhere: the integrator is the same, and so is its matrix. A step begins
with the correction that the ones before make expect.

What is a correction to one iterate moves the muscles and so asks for another one, the more so the
lighter a segment and the stiffer its muscles: how they answer is learned (Broyden's method), from
step to step. What happens in a step is found in `course/`, for trees and for systems of bodies.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..errors import ModelError, StabilityWarning, warn
from ..model import MusculoskeletalModel
from ..simulation.solver import goes_by_newmark
from ..simulation.state import HANDED_ON
from ..skeleton.geometry import Geometry
from ..skeleton.skeleton import Skeleton
from .cosimulation_settings import CosimulationSettings
from .coupled import CoupledState
from .course.step import Course, Step
from .course.system import SystemCourse
from .course.tree import TreeCourse
from .csf import FullScheme
from .disturbance import speed_error
from .recruiting import Excited, Recruited, Started

# A correction that changes by less [rad or m] is added at the step's end without another iterate:
# what it changes in turn is some per cent of it.
CLOSE = 2e-6
# Of kp h^2. Courses that run linearly are stable up to 11.8, real muscles on the pendulum up to 3
# and on the planar arm up to 2.
HIGHEST_GAIN = 2.0
# Of h times the frequency of what swings undamped: what is linear and moved twice a step grows by
# 1.0002 a step at 1, by 1.02 at 1.5, and by 1.14 at 2.
HIGHEST_FREQUENCY = 1.5


class Trial(NamedTuple):
    """A step that may be accepted: what was recruited, the muscles with their real state at its
    end, what the next step takes from there, and how far away the step really leads, q and h q'
    (2, N)."""

    recruited: Recruited
    excited: Excited
    begun: Any
    away: np.ndarray


@dataclass(eq=False, kw_only=True)
class ConsistentState(CoupledState):
    """State of a run of consistent co-simulation.

    Attributes
    ----------
    begun : object
        What the course of a step takes from the one before.
    reserve : (r,) ndarray
        Committed forces of the ideal actuators.
    moved : (2, N) ndarray
        By how much the iterates of the step are moved, q and h q'.
    expected : list of tuple of (2, N) ndarray and float
        The same of the last accepted steps, with their lengths; at most two.
    passes : int
        How often the step's iterate was moved.
    trial : Trial, optional
        The last one of this step.
    response : (2 n, 2 n) ndarray
        How much of what is tracked has to be moved, q and h q', for a unit of what it was away in
        the last accepted step.
    learned : (2 n, 2 n) ndarray
        The same after the last pass of this step.
    asked : tuple of two (2 n,) ndarray, optional
        By how much what is tracked was moved last, and how far away it had been.
    estimated : (n,) ndarray
        What the steps before ask to be added to the demanded acceleration.
    errors : (2, n) ndarray
        e, e' at the start of the step.
    fastest : float
        With how much the skeleton may swing at the start of the run [rad/s].
    """

    begun: Any = field(init=False, metadata=HANDED_ON)
    reserve: np.ndarray = field(init=False, metadata=HANDED_ON)
    moved: np.ndarray = field(init=False)
    expected: list[tuple[np.ndarray, float]] = field(default_factory=list, metadata=HANDED_ON)
    passes: int = 0
    trial: Trial | None = None
    response: np.ndarray = field(init=False, metadata=HANDED_ON)
    learned: np.ndarray = field(init=False)
    asked: tuple[np.ndarray, np.ndarray] | None = None
    estimated: np.ndarray = field(init=False, metadata=HANDED_ON)
    errors: np.ndarray = field(init=False, metadata=HANDED_ON)
    fastest: float = field(init=False)


class ConsistentScheme(FullScheme[ConsistentState]):
    """CSF whose step goes where the muscles' real forces lead."""

    state_kind = ConsistentState
    goes_by_rule = False

    def __init__(self, model: MusculoskeletalModel, settings: CosimulationSettings) -> None:
        super().__init__(model, settings)
        self._kp = float(np.max(settings.kp))
        skeleton = model.skeleton
        self._course: Course = (
            TreeCourse(model, skeleton)
            if isinstance(skeleton, Skeleton)
            else SystemCourse(model, skeleton)
        )

    def ready(self, state: ConsistentState, step: float) -> None:
        settings = self.settings
        limit = self._kp * step**2
        if limit > HIGHEST_GAIN:
            warn(
                f"kp h^2 = {limit:.3g} is above {HIGHEST_GAIN:g}, up to which Scheme.CONSISTENT is "
                "stable on all that was tried; lower kp, or take shorter steps",
                StabilityWarning,
            )
        swing = state.fastest * step
        if swing > HIGHEST_FREQUENCY:
            warn(
                f"springs or contacts let the system swing with {swing / step:.3g} rad/s at the "
                f"start: with steps of {step:g} s Scheme.CONSISTENT may run away from "
                f"{HIGHEST_FREQUENCY / step:.3g} rad/s on; take shorter steps, Scheme.FULL or CMC",
                StabilityWarning,
            )
        by_newmark = goes_by_newmark(self.model.mbs)
        tree = isinstance(self.skeleton, Skeleton)
        if not (by_newmark or tree or settings.project_constraints):
            raise ModelError(
                "Scheme.CONSISTENT with generalized alpha opens the constraints of a system of "
                "bodies: use TrapezoidalIndex2, or project_constraints=True"
            )

    def begin(self, state: ConsistentState, start: Started, t: float) -> None:
        state.begun = self._course.begin(t)
        state.reserve, state.estimated = start.reserve, np.zeros(len(self.skeleton))
        state.response = np.eye(2 * len(self.skeleton))
        state.errors = self._errors(state, t)
        state.fastest = self._course.fastest()

    def open_step(self, state: ConsistentState) -> None:
        super().open_step(state)
        state.trial, state.passes, state.asked = None, 0, None
        state.learned = state.response
        state.moved = _expected(state.expected, state.step, self._course.size)

    def torque(self, state: ConsistentState, t: float, first: bool) -> np.ndarray | None:
        if first:
            state.asked = None
            if not state.by_law:
                state.moved = self._shift(state, state.moved)
            return super().torque(state, t, True)
        while True:
            load = super().torque(state, t, False)
            if not self._course.is_settled(state.step):
                state.trial = None
                return load
            state.trial = trial = self._tried(state, t, state.served())
            self._learn(state, trial)
            enough = CLOSE if state.passes else self._near(state.step)
            if state.passes == self._course.passes or np.abs(trial.away).max() <= enough:
                return load
            state.passes += 1
            self._follow(state, trial)
            if not state.by_law:
                # What the next iterate recruits is near what the control law asks for.
                return super().torque(state, t, True)
            state.led = False

    def acceleration(
        self, state: ConsistentState, t: float, q: np.ndarray, v: np.ndarray
    ) -> np.ndarray:
        # What the muscles' course leaves of the law is asked for in addition, half of it at once.
        lost = self._course.tracked(state.moved[1]) / state.step**2
        more = state.estimated - 0.5 * self.settings.disturbance_gain * lost
        return super().acceleration(state, t, q, v) + more

    def newmark_predictor(
        self, state: ConsistentState, dq: float, dv: float
    ) -> tuple[np.ndarray, np.ndarray]:
        q, v = super().newmark_predictor(state, dq, dv)
        return q + state.moved[0], v + state.moved[1] / state.step

    def excite(self, state: ConsistentState) -> tuple[Excited, Geometry]:
        trial = state.trial or self._tried(state, state.opened.end, state.served())
        state.muscles.check(trial.recruited)
        off = np.abs(trial.away).max()
        self._follow(state, trial)
        if not state.passes and CLOSE < off <= self._near(state.step):
            trial = self._again(state, trial)
        state.expected = [*state.expected[-1:], (state.moved, state.step)]
        state.response = state.learned
        state.begun, state.reserve = trial.begun, trial.excited.reserve
        self._estimate(state, trial.recruited)
        excited, geometry = trial.excited, self.model.geometry(*self.skeleton.place)
        # What the muscles really pull with; the next step sets its own.
        muscles = excited.activation, excited.tendon_length
        self.skeleton.apply(self.model.load(geometry, *muscles, excited.reserve))
        return excited, geometry

    def _follow(self, state: ConsistentState, trial: Trial) -> None:
        """Go where the step really leads, as far as is known."""
        course, away = self._course, trial.away
        before = course.tracked(away)
        more = state.learned @ before.ravel() - before.ravel()
        by = self._shift(state, away + course.moving(more.reshape(2, -1), state.here))
        state.asked = course.tracked(by).ravel(), before.ravel()
        state.moved = state.moved + by
        state.trial = trial._replace(away=np.zeros_like(away))

    def _near(self, step: float) -> float:
        """What an iterate may be off [rad or m] to keep its excitations: what it changes in the
        control law, kp times as much, then moves the step by no more than CLOSE."""
        gain = self._kp * step**2
        return max(CLOSE, min(self._course.near, CLOSE / gain if gain else np.inf))

    def _learn(self, state: ConsistentState, trial: Trial) -> None:
        """How what is tracked has answered to the last move, if there was one."""
        if state.asked is not None:
            away = self._course.tracked(trial.away).ravel()
            state.learned = learned(state.learned, *state.asked, away)
            state.asked = None

    def _again(self, state: ConsistentState, trial: Trial) -> Trial:
        """A trial with the same excitations, from where the step has been moved; moves it on."""
        recruited, excited, *_ = trial
        there = self.model.geometry(*self.skeleton.place)
        again = self._led(state, state.opened.end, recruited, excited, there)
        self._learn(state, again)
        self._follow(state, again)
        return again

    def _shift(self, state: ConsistentState, by: np.ndarray) -> np.ndarray:
        """By how much the iterate was moved, q and h q' (2, N), if it was to be `by`."""
        dq, dv = self._course.move(by[0], by[1] / state.step, state.step)
        return np.array([dq, state.step * dv])

    def _tried(self, state: ConsistentState, t: float, recruited: Recruited) -> Trial:
        """Where the step that ends at the current state really leads."""
        excited = state.muscles.tried(recruited)
        return self._led(state, t, recruited, excited, recruited.reached.geometry)

    def _led(
        self,
        state: ConsistentState,
        t: float,
        recruited: Recruited,
        excited: Excited,
        there: Geometry,
    ) -> Trial:
        """The same with excitations that are found; `there` is the geometry at the state."""
        geometry, reserves = (state.geometry, there), (state.reserve, excited.reserve)
        u = excited.window.excitation
        led = self._course.over(
            Step(state.opened.window, t, u, reserves, geometry, state.here, state.begun)
        )
        excited = excited._replace(activation=led.activation, tendon_length=led.tendon_length)
        return Trial(recruited, excited, led.begun, led.away)

    def _errors(self, state: ConsistentState, t: float) -> np.ndarray:
        q_d, v_d, _ = state.tracking.desired(t)
        return np.array([q_d - self.skeleton.q, v_d - self.skeleton.v])

    def _estimate(self, state: ConsistentState, recruited: Recruited) -> None:
        """Learn from the accepted step what muscles leave of the control law."""
        h, law = state.step, state.tracking
        errors = self._errors(state, recruited.reached.opened.end)
        # A demand out of reach says nothing of the law.
        if recruited.recruitment.met:
            e, e_t = state.errors
            ideal = speed_error(e, e_t, law.kp, law.kv, h)
            gain = 0.5 * self.settings.disturbance_gain / h
            state.estimated = state.estimated + gain * (errors[1] - ideal)
        state.errors = errors


def learned(
    response: np.ndarray, moved: np.ndarray, before: np.ndarray, away: np.ndarray
) -> np.ndarray:
    """Broyden's update: what the response to `before` was if `away` is left after moving (2 n,).

    Nothing is known if it has become more.
    """
    change = response @ (before - away)
    along = moved @ change
    if np.abs(away).max() > np.abs(before).max() or not along > 0.0:
        return np.eye(moved.size)
    return response + np.outer(moved - change, moved @ response) / along


def _expected(last: list[tuple[np.ndarray, float]], h: float, n: int) -> np.ndarray:
    """What a step of the length `h` has to be moved by, q and h q' (2, n), from the last steps.

    It is of third order in both, and goes on linearly.
    """
    if not last:
        return np.zeros((2, n))
    scaled = [moved * (h / length) ** 3 for moved, length in last]
    if len(last) == 1:
        return scaled[0]
    ahead = (h + last[1][1]) / (last[0][1] + last[1][1])
    return scaled[1] + ahead * (scaled[1] - scaled[0])
