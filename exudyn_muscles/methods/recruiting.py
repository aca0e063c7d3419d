"""The muscle optimization that all methods share: the dark blocks of the paper's flowcharts.

    start       forces and activations at the start of a run
    open        a window from the committed muscle state
    reach       force limits (8), (9) at the window's end
    recruit     optimization (10) for a torque there
    excite      root solver (11): excitations, and the state they end in

Each takes what the one before has returned.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..errors import ModelError, ParameterError, UnmetTorqueError
from ..model import MusculoskeletalModel
from ..muscle.parameters import MuscleSet
from ..recruitment.demand import Demand
from ..recruitment.limits import Limits
from ..recruitment.optimization import Recruiter
from ..recruitment.problem import Recruitment, all_usable
from ..recruitment.settings import RecruitmentSettings
from ..recruitment.steady import steady_bounds, steady_state
from ..recruitment.windows import (
    MuscleState,
    OpenWindow,
    Reach,
    Windows,
    end_slopes,
    open_window,
    reach_end,
)  # fmt: skip
from ..recruitment.windows import excite as excitations_of
from ..results.counts import Counts
from ..results.recorder import Window
from ..skeleton.geometry import Geometry


class Opened(NamedTuple):
    """A window of the muscles until the time `end`, the limits of the ideal actuators there, and
    the bounds that forces were at where it begins, or in the last recruitment at its end."""

    window: OpenWindow
    ideal: np.ndarray
    end: float
    near: np.ndarray | None

    def after(self, found: Recruitment) -> Opened:
        """The same for the recruitment after this one."""
        return self._replace(near=found.at_bounds)


class Within(NamedTuple):
    """Lowest and highest forces (m,) [N], excitations and activations (2, m) of muscles, and forces
    (2, r) of ideal actuators; which of them forces are likely to be at."""

    low: np.ndarray
    high: np.ndarray
    excitation: np.ndarray
    activation: np.ndarray
    ideal: np.ndarray
    near: np.ndarray | None


class Reached(NamedTuple):
    """What forces are within reach at a window's end, where the muscles have this geometry."""

    opened: Opened
    geometry: Geometry
    reach: Reach


class Recruited(NamedTuple):
    """The forces that serve the demanded torques (n,) best."""

    reached: Reached
    demanded: np.ndarray
    recruitment: Recruitment

    @property
    def load(self) -> np.ndarray:
        """What they are for Exudyn."""
        return self.reached.geometry.load(self.recruitment.force, self.recruitment.torque)


class Excited(NamedTuple):
    """a, l_t (m,) and the reserves (r,) at a window's end, and the window as it is recorded."""

    activation: np.ndarray
    tendon_length: np.ndarray
    reserve: np.ndarray
    window: Window


class Started(NamedTuple):
    """a, l_t (m,), reserves (r,) and unmet torques (n,) at the start of a run, and the bounds that
    forces are at."""

    activation: np.ndarray
    tendon_length: np.ndarray
    reserve: np.ndarray
    unmet: np.ndarray
    at_bounds: np.ndarray


class MuscleOptimization:
    """Recruitment over windows for one run, whose `counts` it adds to.

    Attributes
    ----------
    windows : Windows
        What the run's windows share.

    Raises
    ------
    ModelError
        The model has neither muscles nor ideal actuators.
    ParameterError
        As `Limits`.
    """

    def __init__(
        self, model: MusculoskeletalModel, settings: RecruitmentSettings, counts: Counts
    ) -> None:
        if not (len(model.muscles) or model.reserves):
            raise ModelError("no motion can be followed: the model has no muscle and no reserve")
        self._model = model
        self._settings = settings
        self._counts = counts
        self.windows = Windows(model.muscles, settings.window_tolerance, settings.integrator)
        self._limits = Limits(settings.control_limits, model.muscles, model.reserves)
        self._recruiter = Recruiter(
            settings.solver, settings.coordinate_weights, settings.criterion.prepare(model)
        )
        self._cheaper = _cheaper(settings.weights, model.muscles)
        self._optimal = np.array([actuator.optimal_force for actuator in model.reserves])

    def start(self, geometry: Geometry, Q_m: np.ndarray, t: float, place: tuple) -> Started:
        """The steady state at the time `t` that serves `Q_m` (n,) best, where the geometry is that
        of a `place`.

        Raises
        ------
        UnmetTorqueError
            The demand is out of reach and the settings ask for an error.
        """
        muscles, (u, ideal) = self._model.muscles, self._limits.at(t)
        l, v = geometry.length, geometry.lengthening_speed
        low, high = steady_bounds(muscles, u, l, v)
        recruitment = self._optimize(geometry, Q_m, Within(low, high, u, u, ideal, None), t, place)
        self._check_met(recruitment, t)
        force, reserve = self._split(recruitment.force)
        a, l_t = steady_state(muscles, u, force, l, v)
        return Started(a, l_t, reserve, recruitment.unmet, recruitment.at_bounds)

    def open(
        self,
        a: np.ndarray,
        l_t: np.ndarray,
        geometry: Geometry,
        t_0: float,
        t_1: float,
        near: np.ndarray | None = None,
    ) -> Opened:
        """A window from `t_0` to `t_1` that begins at the committed state, where forces were `near`
        these bounds: most of them still are at its end."""
        u, ideal = self._limits.at(t_1)
        start = MuscleState(a, l_t, geometry.length, geometry.lengthening_speed)
        return Opened(open_window(self.windows, start, t_1 - t_0, u), ideal, t_1, near)

    def reach(self, opened: Opened, geometry: Geometry) -> Reached:
        """Force limits (8), (9) where the window ends with this geometry."""
        reach = reach_end(opened.window, geometry.length, geometry.lengthening_speed)
        self._counts.window_integrations = self.windows.tally[0]
        return Reached(opened, geometry, reach)

    def recruit(self, reached: Reached, Q_m: np.ndarray, place: tuple) -> Recruited:
        """The forces at the window's end for the torques `Q_m` (n,), where the geometry is that of
        a `place`."""
        (window, ideal, end, near), geometry, reach = reached
        within = Within(reach.low, reach.high, window.u, reach.ends[0], ideal, near)
        found = self._optimize(geometry, Q_m, within, end, place)
        return Recruited(reached, Q_m, found)

    def excite(self, recruited: Recruited, at: Reached | None = None) -> Excited:
        """Excitations that lead to the recruited forces, where they were recruited or `at` another
        end of the same window.

        Raises
        ------
        UnmetTorqueError
            The demand was out of reach and the settings ask for an error.
        """
        self.check(recruited)
        return self.tried(recruited, at)

    def check(self, recruited: Recruited) -> None:
        """Raise UnmetTorqueError if the demand was out of reach and the settings ask for it."""
        self._check_met(recruited.recruitment, recruited.reached.opened.end)

    def tried(self, recruited: Recruited, at: Reached | None = None) -> Excited:
        """As `excite`, for a step that may yet be rejected."""
        reached, demanded, recruitment = recruited
        force, reserve = self._split(recruitment.force)
        excitation = excitations_of((at or reached).reach, force)
        self._counts.window_integrations = self.windows.tally[0]
        low, high = reached.reach.low, reached.reach.high
        window = Window(excitation.excitation, demanded, recruitment.unmet, low, force, high)
        return Excited(excitation.activation, excitation.tendon_length, reserve, window)

    def end_slopes(self, reached: Reached, excitation: np.ndarray) -> np.ndarray:
        """How the forces at the window's end follow the lengths there (m,) [N/m], with these
        excitations (m,) held."""
        slopes = end_slopes(reached.reach, excitation)
        self._counts.window_integrations = self.windows.tally[0]
        return slopes

    def _split(self, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces of the muscles (m,) and of the ideal actuators (r,)."""
        m = len(self._model.muscles)
        return forces[:m], forces[m:]

    def _optimize(
        self, geometry: Geometry, Q_m: np.ndarray, within: Within, t: float, place: tuple
    ) -> Recruitment:
        low, high, excitation, activation, ideal, near = within
        given = self._settings.normalizer(self._model.muscles, high, geometry)
        try:
            N = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            N = np.array(np.nan)
        if N.shape != high.shape or not all_usable(N):
            raise ParameterError(
                f"normalizer: {self._settings.normalizer!r} must return {high.size} positive "
                f"forces, got {given}"
            )
        self._counts.recruitments += 1
        r, N = geometry.moment_arms, N * self._cheaper
        if self._optimal.size:
            r = np.concatenate((r, geometry.columns.T))
            low, high = np.concatenate((low, ideal[0])), np.concatenate((high, ideal[1]))
            N = np.concatenate((N, self._optimal))
        found = self._recruiter.solve(
            Demand(r, Q_m, low, high, N, t, excitation, activation, self._cheaper, near, place)
        )
        self._counts.not_preferred += not found.preferred
        return found

    def _check_met(self, recruitment: Recruitment, t: float) -> None:
        if self._settings.raise_on_unmet_torque and not recruitment.met:
            pairs = zip(self._model.coordinates, recruitment.unmet, strict=True)
            short = {name: float(x) for name, x in pairs if x}
            raise UnmetTorqueError(f"torque out of reach at t = {t:g} s, short by {short}")


def _cheaper(weights: Mapping[str, float], muscles: MuscleSet) -> np.ndarray:
    """What weights of the squares make of the normalising forces (m,)."""
    return np.array([weights.get(name, 1.0) ** -0.5 for name in muscles.names])
