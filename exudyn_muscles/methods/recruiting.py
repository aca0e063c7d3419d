"""The muscle optimization that all methods share: the dark blocks of the paper's flowcharts.

start     forces and activations at the start of the run
open      a window from the committed muscle state
recruit   force limits (8), (9) and optimization (10) for a torque at the window's end
excite    root solver (11): excitations, and the state they end in
"""

from __future__ import annotations

import numpy as np

from ..compilation import announce_compilation
from ..errors import ParameterError, UnmetTorqueError
from ..model import MusculoskeletalModel
from ..path.geometry import Geometry
from ..recruitment.bounds import Excitation, ReachableForces, steady_bounds, steady_state
from ..recruitment.optimization import Recruiter, Recruitment
from ..result import Counts, Recorder
from .control import RecruitmentSettings


class MuscleOptimization:
    """Recruitment over windows for one run.

    Attributes
    ----------
    row : tuple of ndarray
        Of the last excited window: u, demanded and unmet torque, F_min, F_opt and F_max.
    reserve : (r,) ndarray
        Reserve torques at its end.
    """

    def __init__(
        self, model: MusculoskeletalModel, settings: RecruitmentSettings, counts: Counts
    ) -> None:
        announce_compilation()
        self._model = model
        self._settings = settings
        self._counts = counts
        self._forces = ReachableForces(
            model.muscles, settings.window_tolerance, settings.integrator
        )
        self._recruiter = Recruiter(model.coordinates, model.reserves, settings.solver)

    def start(
        self, geometry: Geometry, Q_m: np.ndarray, record: Recorder, t: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Activations, forces (m,) and reserves (r,) of the steady state that serves `Q_m` best."""
        low, high = steady_bounds(self._model.muscles, geometry.length)
        recruitment = self._optimize(geometry.moment_arms, Q_m, low, high)
        self._check_met(recruitment, t)
        a, l_t = steady_state(self._model.muscles, recruitment.force, geometry.length)
        record.start(t, recruitment.reserve, recruitment.unmet)
        return a, l_t, recruitment.reserve

    def open(self, a: np.ndarray, l_t: np.ndarray, geometry: Geometry, h: float) -> None:
        """Begin a window of length `h` at the committed state."""
        self._forces.open(a, l_t, geometry.length, geometry.lengthening_speed, h)

    def recruit(self, geometry: Geometry, Q_m: np.ndarray) -> Recruitment:
        """Force limits and optimization for the torque `Q_m` at the window's end."""
        self.limit(geometry)
        self._demanded = Q_m
        self._recruitment = self._optimize(geometry.moment_arms, Q_m, self._low, self._high)
        return self._recruitment

    def limit(self, geometry: Geometry) -> None:
        """Force limits (8), (9) at the window's end."""
        self._low, self._high = self._forces.bounds(geometry.length, geometry.lengthening_speed)
        self._counts.window_integrations = self._forces.integrations

    def excite(self, t: float) -> Excitation:
        """Excitations for the last recruitment, whose window ends at `t`.

        Raises
        ------
        UnmetTorqueError
            The demand was out of reach and the settings ask for an error.
        """
        self._check_met(self._recruitment, t)
        excitation = self._forces.excite(self._recruitment.force)
        self._counts.window_integrations = self._forces.integrations
        force, self.reserve, _, unmet, _ = self._recruitment
        self.row = (excitation.excitation, self._demanded, unmet, self._low, force, self._high)
        return excitation

    def _optimize(
        self, r: np.ndarray, Q_m: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> Recruitment:
        N = np.asarray(self._settings.normalizer(self._model.muscles, high), dtype=float)
        if N.shape != high.shape or not (N > 0.0).all() or not np.isfinite(N).all():
            raise ParameterError(
                f"normalizer: {self._settings.normalizer!r} must return {high.size} positive "
                f"forces, got {N}"
            )
        self._counts.recruitments += 1
        return self._recruiter.solve(r, Q_m, low, high, N)

    def _check_met(self, recruitment: Recruitment, t: float) -> None:
        if self._settings.raise_on_unmet_torque and recruitment.unmet.any():
            pairs = zip(self._model.coordinates, recruitment.unmet, strict=True)
            short = {name: float(x) for name, x in pairs if x}
            raise UnmetTorqueError(f"torque out of reach at t = {t:g} s, short by {short}")
