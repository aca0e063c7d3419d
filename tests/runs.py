"""Runs of the plugin in a hand-written Exudyn simulation, shared by the tests."""

import exudyn as exu
import numpy as np

import exudyn_muscles as em

KP = 534.0
TRAPEZOIDAL = exu.DynamicSolverType.TrapezoidalIndex2


def settings(step=0.01, end=1.0, *, start=0.0):
    """Exudyn's settings as a user has them: its defaults, without files and console output."""
    s = exu.SimulationSettings()
    s.timeIntegration.startTime = start
    s.timeIntegration.endTime = end
    s.timeIntegration.numberOfSteps = round((end - start) / step)
    s.timeIntegration.verboseMode = 0
    s.solution.file.write = False
    return s


def start_at(model, motion, t=0.0):
    """Give the mbs the motion's state at `t`."""
    q, v, _ = motion(t)
    model.skeleton.set_initial_state(q, v)


def plugin_run(model, plugin, simulation_settings, solver=TRAPEZOIDAL):
    with plugin.attached():
        model.mbs.SolveDynamic(simulation_settings, solverType=solver)
    return plugin.result()


def csf(model, motion, scheme=em.Scheme.FULL, **options):
    return em.CosimulationPlugin(
        model, motion, em.CosimulationSettings(scheme=scheme, kp=KP, **options)
    )


def rms_deg(trajectory):
    return np.degrees(trajectory.tracking_error_rms())
