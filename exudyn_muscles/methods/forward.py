"""Forward dynamics: skeleton and muscles under given excitations, in the unified mode."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..checks import check_settings, check_step, number_within
from ..errors import ParameterError
from ..model import MusculoskeletalModel
from ..muscle.arguments import check_range
from ..muscle.equilibrium import equilibrium
from ..results.excitations import Excitations
from ..results.recorder import Window
from ..results.trajectory import Trajectory
from ..simulation.run import simulate
from ..simulation.settings import RunSettings
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
    excitations: Excitations,
    *,
    settings: ForwardSettings = ForwardSettings(),
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Simulate skeleton and muscles under given excitations.

    Starts at the excitations' `initial` state; without one, at the initial state of the `mbs` with
    muscles in the steady state of the first excitations. What is passive in a system of bodies
    starts where it did in the run that the excitations are of, if this has the same coordinates,
    and else where the `mbs` has it. A last incomplete step is left out.

    Parameters
    ----------
    model : MusculoskeletalModel
    excitations : Excitations
        Of the model's m muscles; clipped below at the minimum activations.
    settings : ForwardSettings
    progress : callable, optional
        Called with the time reached after every step.

    Returns
    -------
    Trajectory

    Raises
    ------
    ParameterError, ModelError
        Bad input, before anything is simulated.
    SimulationError, WindowError
        In the middle; the result up to then is the exception's `trajectory`.
    """
    check_settings(settings, ForwardSettings)
    plugin = ForwardPlugin(model, excitations, settings, progress=progress)
    initial, began, whole = excitations.initial, excitations.system, None
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
class ForwardState(UnifiedState):
    """State of a forward run; `window` is the number of the one that goes on."""

    window: int = -1


class ForwardPlugin(UnifiedPlugin):
    """Given excitations in the user's own run of `mbs.SolveDynamic`; see `Plugin`.

    The run starts from the initial state of the `mbs`, the muscles from the excitations' `initial`
    state or in the steady state of the first excitations.

    Parameters
    ----------
    model : MusculoskeletalModel
    excitations : Excitations
        They span the times that can be simulated.
    settings : ForwardSettings
    progress : callable, optional
    """

    method = "forward"
    state: ForwardState

    def __init__(
        self,
        model: MusculoskeletalModel,
        excitations: Excitations,
        settings: ForwardSettings = ForwardSettings(),
        *,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        if not isinstance(excitations, Excitations):
            raise ParameterError(
                f"expected Excitations, such as a result's .excitations, got "
                f"{type(excitations).__name__}"
            )
        time, values = excitations.time, excitations.values
        if values.shape[1] != len(model.muscles):
            raise ParameterError(
                f"excitations of {values.shape[1]} muscles for a model with {len(model.muscles)}"
            )
        if excitations.reserves.shape[1] != len(model.reserves):
            raise ParameterError(
                f"excitations with {excitations.reserves.shape[1]} reserves for a model with "
                f"{len(model.reserves)}"
            )
        if (values > 1.0).any() or (values < 0.0).any():
            k, i = np.argwhere((values > 1.0) | (values < 0.0))[0]
            raise ParameterError(
                f"muscle '{model.muscles.names[i]}': excitation {values[k, i]:g} at "
                f"t = {time[k]:g} s is outside [0, 1]"
            )
        if excitations.initial is not None:
            check_initial(model, *excitations.initial)
        self._excitations = excitations
        self._u = np.maximum(values, model.muscles.minimum_activation)
        super().__init__(model, float(time[0]), float(time[-1]), settings, None, progress)

    @property
    def near(self) -> np.ndarray | None:
        initial = self._excitations.initial
        return None if initial is None else np.asarray(initial[0], dtype=float)

    def new_state(self) -> ForwardState:
        return ForwardState(**self._unified())

    def start_muscles(
        self, q: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        self.state.geometry = geometry = self.model.geometry(*self.skeleton.place)
        self.model.check_stretch(geometry.length)
        given = self._excitations
        unmet = np.zeros(len(self.model.coordinates))
        self.state.record.begin(self.start_time, given.reserves[0], unmet)
        if given.initial is not None:
            a, l_t = (np.array(x, dtype=float) for x in given.initial[2:])
            l_t = self.model.muscles.with_rigid(l_t)
        else:
            a = self._u[0]
            l_t = equilibrium(self.model.muscles, a, geometry.length).tendon_length
        return a, l_t, given.reserves[0]

    def controls(self, t_0: float, t_1: float) -> np.ndarray:
        given = self._excitations
        k = given.window(0.5 * (t_0 + t_1))
        if k != self.state.window:
            # Nothing was demanded and no bounds were computed.
            n, unknown = len(self.model.coordinates), np.full(len(self.model.muscles), np.nan)
            window = Window(self._u[k], np.full(n, np.nan), np.zeros(n), unknown, unknown, unknown)
            self.begin_window(t_0, given.time[k + 1], given.reserves[k + 1], window)
            self.state.window = k
        return self._u[k]


def check_initial(
    model: MusculoskeletalModel, q: np.ndarray, v: np.ndarray, a: np.ndarray, l_t: np.ndarray
) -> None:
    """Raise ParameterError unless a start fits the model and lies in the muscles' range."""
    n, m = len(model.coordinates), len(model.muscles)
    for name, values, size in (("q", q, n), ("q'", v, n), ("a", a, m), ("l_t", l_t, m)):
        array = np.asarray(values, dtype=float)
        if array.shape != (size,) or not np.isfinite(array).all():
            raise ParameterError(
                f"excitations: initial {name} must be {size} finite values, got {values!r}"
            )
    check_range("initial activation", np.asarray(a, dtype=float), model.muscles)
    for muscle, length in zip(model.muscles, l_t, strict=True):
        name, longest = f"muscle '{muscle.name}': initial l_t", 2.0 * muscle.tendon_slack_length
        number_within(name, length, 0.0, longest, "m")
