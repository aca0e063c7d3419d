"""Co-simulation, section 6 of the paper: full (CSF) and simplified (CSS), and consistent.

Exudyn integrates the skeleton. In every corrector iteration, or once at a predicted state (CSS),
the plugin recruits the muscles for the torque of the control law (15),

    q''_CTC = q_d'' + k_v e' + k_p e,    Q_m = M q''_CTC + H - Q,

and hands J_m F_opt to Exudyn. After acceptance the excitations are solved and the muscles
committed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..checks import check_settings
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..results.recorder import Window
from ..results.trajectory import Trajectory
from ..simulation.plugin import Plugin
from ..simulation.run import simulate
from ..skeleton.tree_rows import TreeRows
from .consistent import ConsistentScheme
from .cosimulation_settings import CosimulationSettings, Scheme
from .coupled import CoupledScheme, CoupledState
from .csf import FullScheme
from .css import SimplifiedScheme
from .tracked import start_tracking, tracked
from .tracking import tracking_start

SCHEMES: dict[Scheme, type[CoupledScheme[Any]]] = {
    Scheme.FULL: FullScheme,
    Scheme.SIMPLIFIED: SimplifiedScheme,
    Scheme.CONSISTENT: ConsistentScheme,
}


def cosimulate(
    model: MusculoskeletalModel,
    motion: Motion,
    *,
    settings: CosimulationSettings = CosimulationSettings(),
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Track a motion by co-simulation of Exudyn's skeleton and the muscles.

    Unless `settings` choose one of the paper's schemes, it is consistent: the excitations found
    give the motion back in `forward_dynamics`.

    Starts at the motion's first state and runs in fixed steps to its end; a last incomplete step is
    left out.

    Parameters
    ----------
    model : MusculoskeletalModel
    motion : Motion
        Of the model's n coordinates.
    settings : CosimulationSettings
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
        The run is off its motion by more than the control law promises; see
        `CosimulationPlugin.attached`.
    StabilityWarning
        CSS with gains and step outside its stability limit; names the limit.
    """
    plugin = CosimulationPlugin(model, motion, settings, progress=progress)
    return simulate(plugin, settings.step, motion(motion.start)[:2], modified_newton=False)


class CosimulationPlugin(Plugin):
    """Co-simulation in the user's own run of `mbs.SolveDynamic`; see `Plugin`.

    The run starts from the initial state of the `mbs` at the motion's start, or at `start`.

    Parameters
    ----------
    model : MusculoskeletalModel
    motion : Motion
    settings : CosimulationSettings
    start : float, optional
        startTime of the run [s]; the motion's start if left out.
    progress : callable, optional
    """

    settings: CosimulationSettings
    motion: Motion
    state: CoupledState

    def __init__(
        self,
        model: MusculoskeletalModel,
        motion: Motion,
        settings: CosimulationSettings = CosimulationSettings(),
        *,
        start: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        check_settings(settings, CosimulationSettings)
        start = tracking_start(model, motion, settings, start)
        self.method = settings.scheme.value
        kind = SCHEMES[settings.scheme]
        self._scheme = kind(model, settings)
        self.feeds_back, self.goes_by_rule = kind.feeds_back, kind.goes_by_rule
        super().__init__(model, start, motion.end, settings, motion, progress)

    def new_state(self) -> CoupledState:
        common = tracked(self.model, self.motion, self.settings, self._common())
        return self._scheme.state_kind(**common)

    def begin(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        state = self.state
        start = start_tracking(state, self.model, q, v, self.start_time)
        state.a, state.l_t = start.activation, start.tendon_length
        self._scheme.begin(state, start, self.start_time)
        return self.model.load(state.geometry, state.a, state.l_t, start.reserve)

    def ready(self, step: float) -> None:
        self._scheme.ready(self.state, step)

    def open_step(self, t_0: float, t_1: float) -> None:
        state = self.state
        state.opened = state.muscles.open(
            state.a, state.l_t, state.geometry, t_0, t_1, state.at_bounds
        )
        self._scheme.open_step(state)

    def torque(self, t: float, first: bool) -> np.ndarray | None:
        return self._scheme.torque(self.state, t, first)

    def jacobian(self, exact: np.ndarray, mass: float, dq: float, dv: float) -> np.ndarray:
        return self._scheme.jacobian(self.state, exact, mass, dq, dv)

    def slopes(self, tree: TreeRows) -> None:
        """The control law, or differences, give all rows."""

    def accept(self, t_0: float, t_1: float) -> tuple[np.ndarray, Window]:
        state = self.state
        excited, state.geometry = self._scheme.excite(state)
        state.a, state.l_t = excited.activation, excited.tendon_length
        state.at_bounds = state.served().recruitment.at_bounds
        return excited.reserve, excited.window
