"""A run that is stepped: someone moves the target while it goes on, and steps are timed.

Exudyn's solver takes one control interval at a time, as its interface to reinforcement learning
does; between two of them a script reads sensors, decides, and steers. A person at a joystick is
replaced by a list of what is wanted when.
"""

import sys
from pathlib import Path
from time import perf_counter

import exudyn as exu
import numpy as np

import exudyn_muscles as em

sys.path.append(str(Path(__file__).resolve().parents[1]))
from models import planar_arm

INTERVAL, END = 0.01, 2.0  # s
WANTED = {  # from when on, and in which pose [deg]
    0.2: [40.0, 70.0], 0.55: [10.0, 110.0], 0.8: [60.0, 40.0], 1.3: [25.0, 60.0]
}  # fmt: skip


class Steered(em.Motion):
    """A target that moves on from where it is, with its speed, whenever it is steered.

    What it has said of times that are over stays, because results are compared with it.
    """

    def __init__(self, start, end, q):
        self.start, self.end, self.source = start, end, None
        self.pieces = [em.Motion.from_waypoints([start, end], [q, q])]

    def __len__(self):
        return len(self.pieces[0])

    def __call__(self, t):
        if np.ndim(t):
            return tuple(np.array(rows) for rows in zip(*map(self, t), strict=True))
        return next(piece for piece in reversed(self.pieces) if piece.start <= t + 1e-9)(t)

    def steer(self, t, q, within=0.3):
        """From the time `t` on, move to `q` and be there `within` this time."""
        now, rest = self(t), np.zeros(len(self))
        ways = zip(now, (q, rest, rest), (q, rest, rest), strict=True)
        self.pieces.append(em.Motion.from_arrays([t, t + within, self.end], *map(list, ways)))


def stepped(scheme):
    """The result, and the time [s] that every interval took."""
    model = planar_arm.build()
    mbs, target = model.mbs, Steered(0.0, END, np.radians([20.0, 50.0]))
    model.skeleton.set_initial_state(*target(0.0)[:2])

    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = INTERVAL, 1
    integration.verboseMode = 0
    integration.generalizedAlpha.useNewmark = True  # TrapezoidalIndex2
    integration.generalizedAlpha.useIndex2Constraints = True
    settings.solution.file.write = False
    settings.solution.sensors.active = False

    plugin = em.CosimulationPlugin(model, target, em.CosimulationSettings(scheme=scheme))
    solver, times, wanted = exu.MainSolverImplicitSecondOrder(), [], list(WANTED.items())
    with plugin.attached():
        mbs.sys["dynamicSolver"], mbs.sys["simulationSettings"] = solver, settings
        solver.InitializeSolver(mbs, settings)
        for _ in range(round(END / INTERVAL)):
            begun, t = perf_counter(), solver.it.currentTime
            if wanted and t > wanted[0][0] - 1e-9:
                target.steer(t, np.radians(wanted.pop(0)[1]))
            solver.it.endTime = t + INTERVAL
            if not solver.SolveSteps(mbs, settings):
                break  # the plugin says why
            times.append(perf_counter() - begun)
        solver.FinalizeSolver(mbs, settings)
    return plugin.result(), np.array(times)


results = {}
for scheme in (em.Scheme.FULL, em.Scheme.CONSISTENT):
    results[scheme], times = stepped(scheme)
    p50, p99 = 1e3 * np.percentile(times, [50, 99])
    error = np.degrees(results[scheme].tracking_error_rms())
    print(
        f"{scheme.name:10}: an interval of {1e3 * INTERVAL:g} ms takes {p50:.2f} ms (p50), "
        f"{p99:.2f} ms (p99); tracking error (RMS) {error.round(4)} deg"
    )
