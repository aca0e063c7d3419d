"""The parts of one step of 10 ms of CSF: what each costs, times how often a step needs it.

The rest of a step are Exudyn's calls of Python and what is done there.
"""

import copy
from contextlib import ExitStack
from functools import partial
from unittest import mock

import exudyn as exu
import numpy as np

import exudyn_muscles as em
from exudyn_muscles.recruitment.optimization import Recruiter
from models import leg
from tests.benchmarks import timed

from .cases import LONGEST, ROOT, least, needs

LEG = "leg"
STEP = 0.010  # s
MANY = 20  # calls of what takes less than a millisecond
LOW, HIGH = 0.02, 1.0  # excitations
HELD = 1e5  # N m s/rad, with which Exudyn itself damps joints


class Step:
    params = [LEG, "gait2354"]  # noqa: RUF012
    param_names = ("model",)
    unit = "CPU ms per step"
    timeout = LONGEST

    def setup(self, model):
        needs(model)
        if model == LEG:
            self.model, self.motion = leg.build(), leg.motion()
            self.settings = em.CosimulationSettings(scheme=em.Scheme.FULL)
        else:
            setup = timed.loaded(model, ROOT)
            self.model, self.motion = setup.model, setup.motion
            self.settings = setup.cosimulation(em.Scheme.FULL)
        self.result = self._run()
        self.counts = self.result.counts

    def track_step(self, model):
        """All of it."""
        return 1e3 * least(self._run) / self.counts.steps

    def track_window(self, model):
        """The muscles' windows of a run, integrated again: each twice for its bounds, and with the
        excitation that was found as often as that was looked for."""
        result, muscles, settings = self.result, self.model.muscles, self.settings
        places = zip(result.coordinates, result.speeds, strict=True)
        l, v = zip(*(self.model.geometry(*place)[:2] for place in places), strict=True)
        searched = self._each_step("window_integrations") / len(muscles) - 2.0

        def windows(u):
            for k, row in enumerate(u):
                em.integrate_window(
                    muscles, result.activations[k], result.tendon_lengths[k], row, l[k : k + 2],
                    v[k : k + 2], STEP, tolerance=settings.window_tolerance,
                    integrator=settings.integrator,
                )  # fmt: skip

        found = result.excitation_values
        low, high, once = (
            least(partial(windows, u))
            for u in (np.full_like(found, LOW), np.full_like(found, HIGH), found)
        )
        return 1e3 * (low + high + searched * once) / len(found)

    def track_recruitment(self, model):
        """The demands of a run, solved again."""
        calls, solve = [], Recruiter.solve

        def recorded(recruiter, *demand):
            calls.append(partial(solve, recruiter, *copy.deepcopy(demand)))
            return solve(recruiter, *demand)

        with mock.patch.object(Recruiter, "solve", recorded):
            self._run()

        def run():
            for call in calls:
                call()

        return 1e3 * least(run) / self.counts.steps

    def track_path(self, model):
        """Lengths, speeds and moment arms, once for every recruitment."""
        q, v = self.motion(0.5 * (self.motion.start + self.motion.end))[:2]
        return self._per_recruitment(lambda: self.model.geometry(q, v))

    def track_dynamics(self, model):
        """M and H - Q, once for every recruitment."""
        with ExitStack() as opened:
            opened.enter_context(self.model.skeleton.opened())
            return self._per_recruitment(self.model.skeleton.dynamics)

    def track_exudyn(self, model):
        """Exudyn's own step of the skeleton, without this package; it damps the joints itself."""
        mbs, skeleton, motion = self.model.mbs, self.model.skeleton, self.motion
        skeleton.set_initial_state(*motion(motion.start)[:2])
        n = len(skeleton.tree)
        for name, value in {
            "PositionOffset": 0.0, "VelocityOffset": 0.0, "PControl": 0.0, "DControl": HELD
        }.items():  # fmt: skip
            mbs.SetObjectParameter(skeleton.object, f"joint{name}Vector", np.full(n, value))
        settings = exu.SimulationSettings()
        settings.solution.file.write = settings.solution.sensors.active = False
        integration = settings.timeIntegration
        integration.verboseMode = 0
        integration.startTime, integration.endTime = motion.start, motion.end
        integration.numberOfSteps = round((motion.end - motion.start) / STEP)
        integration.generalizedAlpha.computeInitialAccelerations = False  # of massless links
        solver = exu.DynamicSolverType.TrapezoidalIndex2
        run = partial(mbs.SolveDynamic, settings, solverType=solver)
        return 1e3 * least(run) / integration.numberOfSteps

    def _run(self):
        return em.cosimulate(self.model, self.motion, settings=self.settings)

    def _each_step(self, what):
        return getattr(self.counts, what) / self.counts.steps

    def _per_recruitment(self, run):
        return 1e3 * least(run, MANY) * self._each_step("recruitments")
