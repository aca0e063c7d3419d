"""The muscle optimization that all methods share: the dark blocks of the paper's flowcharts.

start     forces and activations at the start of the run
open      a window from the committed muscle state
recruit   force limits (8), (9) and optimization (10) for a torque at the window's end
excite    root solver (11): excitations, and the state they end in
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import ParameterError, UnmetTorqueError
from ..model import MusculoskeletalModel
from ..muscle.parameters import MuscleSet
from ..recruitment.bounds import Excitation, ReachableForces, steady_bounds, steady_state
from ..recruitment.limits import Limits
from ..recruitment.optimization import Recruiter, Recruitment
from ..results.trajectory import Counts, Recorder, Window
from ..skeleton.geometry import Geometry
from .control import RecruitmentSettings


class MuscleOptimization:
    """Recruitment over windows for one run.

    Attributes
    ----------
    window : Window
        The last excited one, as it is recorded.
    reserve : (r,) ndarray
        Reserve torques at its end.
    """

    def __init__(
        self, model: MusculoskeletalModel, settings: RecruitmentSettings, counts: Counts
    ) -> None:
        self._model = model
        self._settings = settings
        self._counts = counts
        self._forces = ReachableForces(
            model.muscles, settings.window_tolerance, settings.integrator
        )
        self._limits = Limits(settings.control_limits, model.muscles, model.reserves)
        self._recruiter = Recruiter(settings.solver, settings.coordinate_weights)
        self._cheaper = _cheaper(settings.weights, model.muscles)
        self._optimal = np.array([actuator.optimal_force for actuator in model.reserves])

    def start(
        self, geometry: Geometry, Q_m: np.ndarray, record: Recorder, t: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """a, l_t (m,) and reserves (r,) of the steady state that serves `Q_m` best."""
        muscles, (u, self._ideal) = self._model.muscles, self._limits.at(t)
        l, v = geometry.length, geometry.lengthening_speed
        recruitment = self._optimize(geometry, Q_m, *steady_bounds(muscles, u, l, v))
        self._check_met(recruitment, t)
        force, reserve = self._split(recruitment.force)
        a, l_t = steady_state(muscles, u, force, l, v)
        record.start = t, reserve, recruitment.unmet
        return a, l_t, reserve

    def open(
        self, a: np.ndarray, l_t: np.ndarray, geometry: Geometry, t_0: float, t_1: float
    ) -> None:
        """Begin a window from `t_0` to `t_1` at the committed state."""
        u, self._ideal = self._limits.at(t_1)
        self._forces.open(a, l_t, geometry.length, geometry.lengthening_speed, t_1 - t_0, u)

    def recruit(self, geometry: Geometry, Q_m: np.ndarray) -> Recruitment:
        """Force limits and optimization for the torque `Q_m` at the window's end."""
        self._demanded, self._bounds = Q_m, self.limit(geometry)
        self._recruitment = self._optimize(geometry, Q_m, *self._bounds)
        return self._recruitment

    def torque(self, geometry: Geometry, Q_m: np.ndarray) -> np.ndarray:
        """The torque that `recruit` would deliver."""
        return self._optimize(geometry, Q_m, *self.limit(geometry)).torque

    def limit(self, geometry: Geometry) -> tuple[np.ndarray, np.ndarray]:
        """Force limits (8), (9) at the window's end."""
        bounds = self._forces.bounds(geometry.length, geometry.lengthening_speed)
        self._counts.window_integrations = self._forces.integrations
        return bounds

    def excite(self, t: float) -> Excitation:
        """Excitations for the last recruitment, whose window ends at `t`.

        Raises
        ------
        UnmetTorqueError
            The demand was out of reach and the settings ask for an error.
        """
        self._check_met(self._recruitment, t)
        force, self.reserve = self._split(self._recruitment.force)
        excitation = self._forces.excite(force)
        self._counts.window_integrations = self._forces.integrations
        low, high = self._bounds
        unmet = self._recruitment.unmet
        self.window = Window(excitation.excitation, self._demanded, unmet, low, force, high)
        return excitation

    def _split(self, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces of the muscles (m,) and of the ideal actuators (r,)."""
        m = len(self._model.muscles)
        return forces[:m], forces[m:]

    def _optimize(
        self, geometry: Geometry, Q_m: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> Recruitment:
        given = self._settings.normalizer(self._model.muscles, high, geometry)
        try:
            N = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            N = np.array(np.nan)
        if N.shape != high.shape or not (N > 0.0).all() or not np.isfinite(N).all():
            raise ParameterError(
                f"normalizer: {self._settings.normalizer!r} must return {high.size} positive "
                f"forces, got {given}"
            )
        self._counts.recruitments += 1
        r, N = geometry.moment_arms, N * self._cheaper
        if self._optimal.size:
            r = np.vstack([r, geometry.columns.T])
            low, high = np.append(low, self._ideal[0]), np.append(high, self._ideal[1])
            N = np.append(N, self._optimal)
        return self._recruiter.solve(r, Q_m, low, high, N)

    def _check_met(self, recruitment: Recruitment, t: float) -> None:
        if self._settings.raise_on_unmet_torque and recruitment.unmet.any():
            pairs = zip(self._model.coordinates, recruitment.unmet, strict=True)
            short = {name: float(x) for name, x in pairs if x}
            raise UnmetTorqueError(f"torque out of reach at t = {t:g} s, short by {short}")


def _cheaper(weights: Mapping[str, float], muscles: MuscleSet) -> np.ndarray:
    """What weights of the squares make of the normalising forces (m,)."""
    factors = np.ones(len(muscles))
    for name, weight in weights.items():
        if name not in muscles.names:
            raise ParameterError(f"weights of '{name}': the muscles are {', '.join(muscles.names)}")
        factors[muscles.names.index(name)] = weight**-0.5
    return factors
