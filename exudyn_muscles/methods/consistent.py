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
step to step. The nodes of the muscles' force are more than those of M and H - Q, which are smoother
and whose values at both ends are known.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ..errors import ModelError, SimulationError
from ..model import MusculoskeletalModel
from ..skeleton.geometry import Geometry
from ..skeleton.opened import Dynamics
from ..skeleton.skeleton import Skeleton
from ..skeleton.state import hermite
from .cosimulation_settings import CosimulationSettings
from .coupled import NOTHING_RECRUITED, CoupledState
from .course import MuscleCourse
from .csf import FullScheme
from .disturbance import speed_error
from .recruiting import Excited, Recruited, Started

# A correction that changes by less [rad or m] is added at the step's end without another iterate:
# what it changes in turn is some per cent of it.
CLOSE = 2e-6
MOST_PASSES = 2


def lobatto(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (count,) of Lobatto's quadrature from 0 to 1.

    Examples
    --------
    >>> lobatto(3)[1] * 6
    array([1., 4., 1.])
    """
    last = np.eye(count)[-1]
    x = np.r_[-1.0, np.sort(legendre.legroots(legendre.legder(last))), 1.0]
    return 0.5 * (x + 1.0), 1.0 / (count * (count - 1) * legendre.legval(x, last) ** 2)


def panels(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (2 count + 1,) of Simpson's rule in as many panels."""
    weights = np.zeros(2 * count + 1)
    for k in range(count):
        weights[2 * k : 2 * k + 3] += np.array([1.0, 4.0, 1.0]) / (6.0 * count)
    return np.linspace(0.0, 1.0, 2 * count + 1), weights


class Nodes:
    """Where in a step accelerations are taken, and what is made of them.

    Attributes
    ----------
    s : (k,) ndarray
        The nodes, as parts of the step.
    weights, moments : (k,) ndarray
        int x ds and int (1 - s) x ds of values x there.
    value, slope : (k, 4) ndarray
        As of `hermite`.
    smooth : (k, 4) ndarray
        Weights of values at the nodes `SMOOTH` in the polynomial through them.
    """

    def __init__(self, s: np.ndarray, weights: np.ndarray) -> None:
        self.s, self.weights, self.moments = s, weights, weights * (1.0 - s)
        self.value, self.slope = hermite(s)
        self.smooth = np.column_stack(
            [np.prod([(s - y) / (x - y) for y in SMOOTH if y != x], axis=0) for x in SMOOTH]
        )


SMOOTH, _ = lobatto(4)  # nodes of M and H - Q
INNER = SMOOTH[1:-1]
INNER_VALUE, INNER_SLOPE = hermite(INNER)
USUAL = Nodes(*lobatto(6))
FINE = Nodes(*panels(10))  # where a path jumps, such as at a point that comes or goes


class Trial(NamedTuple):
    """A step that may be accepted: what was recruited, the muscles with their real state at its
    end, M and H - Q there, and how far away the step really leads, q and h q' (2 n,)."""

    recruited: Recruited
    excited: Excited
    there: Dynamics
    away: np.ndarray


@dataclass(eq=False, kw_only=True)
class ConsistentState(CoupledState):
    """State of a run of consistent co-simulation.

    Attributes
    ----------
    begun : Dynamics
        At the start of the step.
    reserve : (r,) ndarray
        Committed forces of the ideal actuators.
    moved : (2, n) ndarray
        By how much the iterates of the step are moved, q and h q'.
    expected : list of tuple of (2, n) ndarray and float
        The same of the last accepted steps, with their lengths; at most two.
    passes : int
        How often the step's iterate was moved.
    trial : Trial, optional
        The last one of this step.
    response : (2 n, 2 n) ndarray
        How much has to be moved, q and h q', for a unit of what the last accepted step was away.
    learned : (2 n, 2 n) ndarray
        The same after the last pass of this step.
    asked : tuple of two (2 n,) ndarray, optional
        By how much the iterate was moved last, and how far away it had been.
    estimated : (n,) ndarray
        What the steps before ask to be added to the demanded acceleration.
    errors : (2, n) ndarray
        e, e' at the start of the step.
    """

    begun: Dynamics = field(init=False)
    reserve: np.ndarray = field(init=False)
    moved: np.ndarray = field(init=False)
    expected: list[tuple[np.ndarray, float]] = field(default_factory=list)
    passes: int = 0
    trial: Trial | None = None
    response: np.ndarray = field(init=False)
    learned: np.ndarray = field(init=False)
    asked: tuple[np.ndarray, np.ndarray] | None = None
    estimated: np.ndarray = field(init=False)
    errors: np.ndarray = field(init=False)


class ConsistentScheme(FullScheme[ConsistentState]):
    """CSF whose step goes where the muscles' real forces lead."""

    state_kind = ConsistentState
    skeleton: Skeleton

    def __init__(self, model: MusculoskeletalModel, settings: CosimulationSettings) -> None:
        super().__init__(model, settings)
        if not isinstance(model.skeleton, Skeleton):
            raise ModelError(
                "Scheme.CONSISTENT needs a kinematic tree as the skeleton; use Scheme.FULL"
            )
        self.skeleton = model.skeleton
        self._course = MuscleCourse(model, model.skeleton)

    def begin(self, state: ConsistentState, start: Started, t: float) -> None:
        skeleton = self.skeleton
        state.begun = skeleton.dynamics_at(skeleton.q.copy(), skeleton.v.copy(), t)
        state.reserve, state.estimated = start.reserve, np.zeros(len(skeleton))
        state.response = np.eye(2 * len(skeleton))
        state.errors = self._errors(state, t)

    def open_step(self, state: ConsistentState) -> None:
        super().open_step(state)
        state.trial, state.passes, state.asked = None, 0, None
        state.learned = state.response
        state.moved = _expected(state.expected, state.step, len(self.skeleton))

    def torque(self, state: ConsistentState, t: float, first: bool) -> np.ndarray:
        if first:
            self._shift(state, state.moved)
            state.asked = None
            return super().torque(state, t, first)
        load = super().torque(state, t, first)
        state.trial = trial = self._tried(state, t, state.served())
        if state.asked is not None:
            state.learned = learned(state.learned, *state.asked, trial.away)
            state.asked = None
        if state.passes == MOST_PASSES or np.abs(trial.away).max() <= CLOSE:
            return load
        state.passes += 1
        self._follow(state, trial)
        # What the next iterate recruits is near what the control law asks for.
        return super().torque(state, t, True)

    def demand(self, state: ConsistentState, t: float, there: Dynamics) -> np.ndarray:
        # What the muscles' course leaves of the law is asked for in addition, half of it at once.
        lost = state.moved[1] / state.step**2
        d = state.estimated - 0.5 * self.settings.disturbance_gain * lost
        return super().demand(state, t, there) + there.M @ d

    def excite(self, state: ConsistentState) -> tuple[Excited, Geometry]:
        trial = state.trial
        if trial is None:
            raise SimulationError(NOTHING_RECRUITED)
        state.muscles.check(trial.recruited)
        self._follow(state, trial)
        state.expected = [*state.expected[-1:], (state.moved, state.step)]
        state.response = state.learned
        state.begun, state.reserve = trial.there, trial.excited.reserve
        self._estimate(state, trial.recruited)
        return trial.excited, self.model.geometry(*self.skeleton.place)

    def _follow(self, state: ConsistentState, trial: Trial) -> None:
        """Go where the step really leads, as far as is known."""
        by = state.learned @ trial.away
        state.asked = by, trial.away
        by = by.reshape(2, -1)
        self._shift(state, by)
        state.moved = state.moved + by
        state.trial = trial._replace(away=np.zeros_like(trial.away))

    def _shift(self, state: ConsistentState, by: np.ndarray) -> None:
        self.skeleton.move(by[0], by[1] / state.step)

    def _tried(self, state: ConsistentState, t: float, recruited: Recruited) -> Trial:
        """Where the step that ends at the current state really leads."""
        skeleton, h, (M_0, bias_0, _), here = self.skeleton, state.step, state.begun, state.here
        excited = state.muscles.tried(recruited)
        (q_0, v_0, _), q_1, v_1 = skeleton.start, skeleton.q, skeleton.v
        ends = np.array([q_0, h * v_0, q_1, h * v_1])
        inner = [
            skeleton.dynamics_within(x @ ends, x_t @ ends / h, t - (1.0 - s) * h)
            for s, x, x_t in zip(INNER, INNER_VALUE, INNER_SLOPE, strict=True)
        ]
        Ms = np.array([M_0, *(x.M for x in inner), here.M])
        biases = np.array([bias_0, *(x.bias for x in inner), here.bias])
        for nodes in (USUAL, FINE):
            q, v, reduced = skeleton.basis.along(nodes.value @ ends, nodes.slope @ ends / h)
            course = self._course.over(
                state.opened.window, excited.window.excitation, h * nodes.s, q, v
            )
            if course.is_smooth:
                break
        torques = course.torques
        if state.reserve.size:
            held = np.outer(1.0 - nodes.s, state.reserve) + np.outer(nodes.s, excited.reserve)
            actuators = [self.model.columns(x) @ f for x, f in zip(q, held, strict=True)]
            torques = torques + actuators
        lack = reduced(torques) - nodes.smooth @ biases
        a = np.linalg.solve(np.tensordot(nodes.smooth, Ms, 1), lack[..., None])[..., 0]
        away = q_0 + h * (v_0 + h * (nodes.moments @ a)) - q_1, v_0 + h * (nodes.weights @ a) - v_1
        excited = excited._replace(activation=course.activation, tendon_length=course.tendon_length)
        return Trial(recruited, excited, here, np.concatenate([away[0], h * away[1]]))

    def _errors(self, state: ConsistentState, t: float) -> np.ndarray:
        q_d, v_d, _ = state.tracking.desired(t)
        return np.array([q_d - self.skeleton.q, v_d - self.skeleton.v])

    def _estimate(self, state: ConsistentState, recruited: Recruited) -> None:
        """Learn from the accepted step what muscles leave of the control law."""
        h, law = state.step, state.tracking
        errors = self._errors(state, recruited.reached.opened.end)
        # A demand out of reach says nothing of the law.
        if not recruited.recruitment.unmet.any():
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
