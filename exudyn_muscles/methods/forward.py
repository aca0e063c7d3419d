"""Forward dynamics: skeleton and muscles under given excitations, in the unified mode."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..checks import check_settings, check_step
from ..model import MusculoskeletalModel
from ..results.excitations import Excitations
from ..results.recorder import Window
from ..results.trajectory import Trajectory
from ..simulation.run import simulate
from ..simulation.settings import RunSettings
from .excitation_function import ExcitationFunction
from .given import ForwardRun, given_for, start_state
from .unified import UnifiedPlugin, UnifiedState


@dataclass(frozen=True, kw_only=True)
class ForwardSettings(RunSettings):
    """Settings of `forward_dynamics` and `ForwardPlugin`.

    Parameters
    ----------
    step : float
        Step of skeleton and muscles [s]; with the plugin, Exudyn's settings decide.
    """

    step: float = 0.001

    def __post_init__(self) -> None:
        super().__post_init__()
        check_step("step", self.step)


def forward_dynamics(
    model: MusculoskeletalModel,
    excitations: Excitations | ExcitationFunction,
    *,
    settings: ForwardSettings = ForwardSettings(),
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Simulate skeleton and muscles under given excitations.

    Starts at the excitations' `initial` state; without one, at the initial state of the `mbs` with
    muscles in the steady state of the first excitations, or of the `activations` of a function.
    The result's excitations are what was really used. What is passive in a system of bodies
    starts where it did in the run that the excitations are of, if this has the same coordinates,
    and else where the `mbs` has it. A last incomplete step is left out.

    Parameters
    ----------
    model : MusculoskeletalModel
    excitations : Excitations or ExcitationFunction
        Of the model's m muscles, or a function of time, or of time and state, that gives them;
        clipped below at the minimum activations.
    settings : ForwardSettings
    progress : callable, optional
        Called with the time reached after every step.

    Returns
    -------
    Trajectory

    Raises
    ------
    ParameterError, ModelError
        Bad input, before anything is simulated; or what a function returned, in the middle.
    SimulationError, WindowError
        In the middle; the result up to then is the exception's `trajectory`.
    """
    check_settings(settings, ForwardSettings)
    plugin = ForwardPlugin(model, excitations, settings, progress=progress)
    initial = whole = None
    if isinstance(excitations, Excitations):
        initial, began = excitations.initial, excitations.system
        if began is not None and began.names == model.skeleton.system_names:
            whole = began.coordinates, began.speeds
    return simulate(
        plugin,
        settings.step,
        None if initial is None else initial[:2],
        modified_newton=True,
        whole=whole,
    )


@dataclass(eq=False, kw_only=True)
class ForwardState(ForwardRun, UnifiedState):
    """State of a forward run."""


class ForwardPlugin(UnifiedPlugin):
    """Given excitations in the user's own run of `mbs.SolveDynamic`; see `Plugin`.

    The run starts from the initial state of the `mbs`, the muscles from the excitations' `initial`
    state or in a steady state, as `forward_dynamics` has it.

    Parameters
    ----------
    model : MusculoskeletalModel
    excitations : Excitations or ExcitationFunction
        They span the times that can be simulated.
    settings : ForwardSettings
    progress : callable, optional
    """

    method = "forward"
    state: ForwardState

    def __init__(
        self,
        model: MusculoskeletalModel,
        excitations: Excitations | ExcitationFunction,
        settings: ForwardSettings = ForwardSettings(),
        *,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self._given = given = given_for(model, excitations)
        super().__init__(model, given.start, given.end, settings, None, progress)

    @property
    def near(self) -> np.ndarray | None:
        initial = self._given.initial
        return None if initial is None else np.asarray(initial[0], dtype=float)

    def new_state(self) -> ForwardState:
        return ForwardState(**self._unified())

    def start_muscles(
        self, q: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        self.state.geometry = geometry = self.model.geometry(*self.skeleton.place)
        self.model.check_stretch(geometry.length)
        a, l_t, reserve = start_state(self.model, self._given, geometry)
        self.state.record.begin(self.start_time, reserve, np.zeros(len(self.model.coordinates)))
        return a, l_t, reserve

    def controls(self, t_0: float, t_1: float) -> np.ndarray:
        begun = self._given.window(self.state, t_0, t_1)
        if begun is not None:
            # Nothing was demanded and no bounds were computed.
            u, n = begun.excitation, len(self.model.coordinates)
            unknown = np.full(u.size, np.nan)
            window = Window(u, np.full(n, np.nan), np.zeros(n), unknown, unknown, unknown)
            self.begin_window(t_0, begun.end, begun.reserve, window)
            self.state.held = u
        return self.state.held
