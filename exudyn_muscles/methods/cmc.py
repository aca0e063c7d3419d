"""Computed muscle control in the unified mode, section 5 of the paper.

Every window: controller accelerations (12) from the errors at its start, torques by (6) at the
desired state at its end, force limits, optimization, excitations; the last two once more where the
stiffness there works against the control (`stiffness.py`). Within the window skeleton and muscles
are integrated together with the excitations held, as in forward dynamics.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from ..checks import check_settings, check_step
from ..errors import ModelError, ParameterError, WindowError, WrappingError
from ..model import MusculoskeletalModel
from ..motion import Motion, check_motion
from ..results.trajectory import Trajectory
from ..simulation.run import number_of_steps, simulate
from ..simulation.state import HANDED_ON
from ..skeleton.ahead import IMPLICIT_EULER
from ..skeleton.opened import Dynamics
from .recruiting import Excited, Recruited
from .stiffness import ALLOWED, SLOWEST, Stiffness, end_stiffness, torque_against
from .tracked import TrackedState, start_tracking, tracked
from .tracking import TrackingSettings, tracking_start
from .unified import UnifiedPlugin, UnifiedState

# One window of so many is looked at for a negative stiffness as long as there is none: of -20 kp M
# (kp = 100 1/s^2) an error grows by half meanwhile.
LOOKS = 2


class Prediction(Enum):
    """Where CMC takes the skeleton to be at a window's end.

    BY_STIFFNESS: where the motion is, but off it by the error that is expected there in directions
    in which muscles and skeleton together have a negative stiffness; DESIRED, bit by bit, where
    there are none.
    DESIRED: where the motion is, as in the paper; unstable where that stiffness is below -kp M.
    SHIFTED: off the motion by the errors at the window's start, as in OpenSim.
    """

    BY_STIFFNESS = "by_stiffness"
    DESIRED = "desired"
    SHIFTED = "shifted"


@dataclass(frozen=True, kw_only=True)
class CMCSettings(TrackingSettings):
    """Settings of `computed_muscle_control` and `CMCPlugin`.

    Parameters
    ----------
    prediction : Prediction
        The state at the window's end for which torques, force limits and excitations are found.
    window : float
        Length of the windows with held excitations [s].
    step : float
        Step of skeleton and muscles [s]; with the plugin, Exudyn's settings decide.
    """

    prediction: Prediction = Prediction.BY_STIFFNESS
    window: float = 0.01
    step: float = 0.001

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.prediction, Prediction):
            raise ParameterError(f"prediction = {self.prediction!r} is not a Prediction")
        check_step("window", self.window)
        check_step("step", self.step)
        steps = self.window / self.step
        if steps < 1.0 - 1e-9 or abs(steps - round(steps)) > 1e-9 * steps:
            raise ParameterError(
                f"window = {self.window:g} s must be a whole number of steps of {self.step:g} s"
            )


def computed_muscle_control(
    model: MusculoskeletalModel,
    motion: Motion,
    *,
    settings: CMCSettings = CMCSettings(),
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Track a motion by computed muscle control.

    Starts at the motion's first state and runs to the end of its last whole window.

    Parameters
    ----------
    model : MusculoskeletalModel
    motion : Motion
        Of the model's n coordinates.
    settings : CMCSettings
    progress : callable, optional
        Called with the time reached after every step.

    Returns
    -------
    Trajectory

    Raises
    ------
    MotionError, ModelError, ParameterError
        Bad input, before anything is simulated.
    SimulationError, WindowError, RecruitmentError
        In the middle; the result up to then is the exception's `trajectory`.

    Warns
    -----
    MotionWarning
        Angles that cannot be radians.
    UnmetTorqueWarning
        The muscles could not deliver the demanded torques; names the coordinates.
    TrackingWarning
        The run is off its motion by more than the control law promises; see `CMCPlugin.attached`.
    """
    check_settings(settings, CMCSettings)
    check_motion(motion, model.coordinates)
    windows = number_of_steps(motion.start, motion.end, settings.window)
    plugin = CMCPlugin(model, motion, settings, progress=progress)
    end = motion.start + windows * settings.window
    return simulate(plugin, settings.step, motion(motion.start)[:2], modified_newton=True, end=end)


@dataclass(eq=False, kw_only=True)
class CMCState(TrackedState, UnifiedState):
    """State of a run of CMC.

    Attributes
    ----------
    window_end : float
        Of the window that goes on [s].
    held : (m,) ndarray
        Its excitations.
    windows : int
        How many there were before.
    stiffness : Stiffness or None
        The last one that was found.
    is_unstable : bool
        It was kept out of the feedback in part.
    """

    window_end: float = field(metadata=HANDED_ON)
    held: np.ndarray = field(init=False, metadata=HANDED_ON)
    windows: int = field(default=0, metadata=HANDED_ON)
    stiffness: Stiffness | None = field(default=None, metadata=HANDED_ON)
    is_unstable: bool = field(default=False, metadata=HANDED_ON)


class CMCPlugin(UnifiedPlugin):
    """Computed muscle control in the user's own run of `mbs.SolveDynamic`; see `Plugin`.

    The run starts from the initial state of the `mbs` at the motion's start, or at `start`. A
    window begins with the first step that starts at or after the end of the one before.

    Parameters
    ----------
    model : MusculoskeletalModel
    motion : Motion
    settings : CMCSettings
    start : float, optional
        startTime of the run [s]; the motion's start if left out.
    progress : callable, optional
    """

    method = "cmc"
    settings: CMCSettings
    motion: Motion
    state: CMCState

    def __init__(
        self,
        model: MusculoskeletalModel,
        motion: Motion,
        settings: CMCSettings = CMCSettings(),
        *,
        start: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        check_settings(settings, CMCSettings)
        start = tracking_start(model, motion, settings, start)
        super().__init__(model, start, motion.end, settings, motion, progress)

    def new_state(self) -> CMCState:
        common = tracked(self.model, self.motion, self.settings, self._unified())
        return CMCState(**common, window_end=self.start_time)

    def start_muscles(
        self, q: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        start = start_tracking(self.state, self.model, q, v, self.start_time)
        return start.activation, start.tendon_length, start.reserve

    def controls(self, t_0: float, t_1: float) -> np.ndarray:
        if t_0 >= self.state.window_end - 1e-9:
            self._open_window(t_0)
        return self.state.held

    def _open_window(self, t_0: float) -> None:
        """Excitations from the state at `t_0`, held over the window."""
        state, skeleton = self.state, self.skeleton
        tracking, muscles = state.tracking, state.muscles
        # Where steps do not divide the window it lasts as long as its last one.
        steps = math.ceil(self.settings.window / state.step - 1e-9)
        length = max(self.settings.window, steps * state.step)
        t_1 = min(t_0 + length, self.motion.end, state.known)
        if abs(t_1 - state.end) < 1e-9:  # accumulated time steps
            t_1 = min(t_1, state.end)
        q, v, _ = skeleton.start
        a_cmc = tracking.acceleration(t_1, t_0, q, v)  # (12)
        q_1, v_1, _ = tracking.desired(t_1)
        if self.settings.prediction is Prediction.SHIFTED:
            q_d, v_d, _ = tracking.desired(t_0)
            q_1, v_1 = q_1 + (q - q_d), v_1 + (v - v_d)
        ahead = skeleton.dynamics_ahead(q_1, v_1, t_1, IMPLICIT_EULER)
        Q_m = ahead.torque(a_cmc)  # (14) with the sign of (6)
        opened = muscles.open(state.a, state.l_t, state.geometry, t_0, t_1, state.at_bounds)
        reached = muscles.reach(opened, self.model.geometry(*ahead.place))
        recruited = muscles.recruit(reached, Q_m, ahead.place)
        excited = muscles.tried(recruited)
        if self.settings.prediction is Prediction.BY_STIFFNESS:
            expected = tracking.expected_error(t_1, t_0, q, v)
            against = self._torque_against(expected, ahead, a_cmc, recruited, excited)
            if against is not None:
                reached = reached._replace(opened=opened.after(recruited.recruitment))
                recruited = muscles.recruit(reached, Q_m + against, ahead.place)
                excited = muscles.tried(recruited)
        muscles.check(recruited)
        state.held, state.window_end = excited.window.excitation, t_1
        state.at_bounds = recruited.recruitment.at_bounds
        self.begin_window(t_0, t_1, excited.reserve, excited.window)

    def _torque_against(
        self,
        expected: np.ndarray,
        ahead: Dynamics,
        a: np.ndarray,
        recruited: Recruited,
        excited: Excited,
    ) -> np.ndarray | None:
        """Torques (n,) that keep a negative stiffness from making more of the error (n,) that is
        `expected` at the window's end `ahead`, where accelerations `a` (n,) are demanded."""
        state, opened = self.state, recruited.reached.opened
        number, known = state.windows, state.stiffness
        state.windows += 1
        if number % LOOKS and not state.is_unstable:
            return None
        of_demand = None
        if known is not None and number // LOOKS % expected.size:
            of_demand = known.of_demand  # found in one of n looks: one evaluation for each
        try:
            slopes = state.muscles.end_slopes(recruited.reached, excited.window.excitation)
            state.stiffness = end_stiffness(
                self.model, self.skeleton, ahead, a, recruited, slopes, of_demand
            )
        except (ModelError, WindowError, WrappingError):
            return None  # at the end of what can be evaluated, such as a linkage's dead point
        least = max(ALLOWED * np.min(state.tracking.kp), SLOWEST / opened.window.h**2)
        against = torque_against(state.stiffness.symmetric, ahead.M, expected, least)
        state.is_unstable = against is not None
        return against
