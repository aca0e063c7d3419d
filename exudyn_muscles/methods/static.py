"""Physiological static optimization, section 4 of the paper.

At every step: inverse dynamics (6) of the desired motion, force limits (8), (9), optimization (10),
excitations (11). The skeleton is not integrated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..checks import check_settings, check_step
from ..errors import FrozenBodiesWarning, warn
from ..model import MusculoskeletalModel
from ..motion import Motion, check_motion, warn_of_angles
from ..recruitment.settings import RecruitmentSettings, check_fit
from ..results.counts import Counts
from ..results.recorder import Recorder, Row
from ..results.trajectory import Trajectory
from ..simulation.controllers import UserControllers
from ..simulation.ending import warn_of_shortfalls, warn_of_stop
from ..simulation.parameters import keep_parameters
from ..simulation.run import number_of_steps
from ..skeleton.external_forces import check_external_forces
from ..skeleton.hold import hold
from ..skeleton.reading import original, raise_as_itself
from .recruiting import MuscleOptimization


@dataclass(frozen=True, kw_only=True)
class StaticSettings(RecruitmentSettings):
    """Settings of `static_optimization`.

    Parameters
    ----------
    step : float
        Length of the windows [s].
    """

    step: float = 0.01

    def __post_init__(self) -> None:
        super().__post_init__()
        check_step("step", self.step)


def static_optimization(
    model: MusculoskeletalModel,
    motion: Motion,
    *,
    settings: StaticSettings = StaticSettings(),
    step: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Forces, activations and excitations of the desired motion, without a forward simulation.

    User functions of the `mbs` that act before a step or a residual are called as Exudyn would call
    them along the motion, so that the forces that they set are part of it.

    Parameters
    ----------
    model : MusculoskeletalModel
    motion : Motion
        Of the model's n coordinates.
    settings : StaticSettings
        A last incomplete window is left out.
    step : float, optional
        Length of the windows [s] in place of the settings' one.
    progress : callable, optional
        Called with the time reached after every step.

    Returns
    -------
    Trajectory

    Raises
    ------
    MotionError, ModelError, ParameterError
        Bad input, before anything is computed.
    WindowError, RecruitmentError
        In the middle; the result up to then is the exception's `trajectory`.

    Warns
    -----
    FrozenBodiesWarning
        The mbs has other bodies, whose motion is unknown here.
    MotionWarning
        Angles that cannot be radians.
    IncompleteRunWarning
        A PreStep user function returned False.
    UnmetTorqueWarning
        The muscles cannot deliver the motion's torques; names the coordinates.
    """
    check_settings(settings, StaticSettings)
    if step is not None:
        settings = replace(settings, step=step)
    step = settings.step
    check_motion(motion, model.coordinates)
    check_fit(settings, model)
    warn_of_angles(motion, model.coordinates, model.skeleton.units)
    counts = Counts()
    record = Recorder("static", model, settings, counts, motion)
    steps = number_of_steps(motion.start, motion.end, step)
    times = motion.start + step * np.arange(steps + 1)
    q_d, v_d, a_d = motion(times)
    model.check_lengths(q_d)
    check_external_forces(model.mbs, times[0], times[-1])
    muscles = MuscleOptimization(model, settings, counts)
    skeleton = model.skeleton
    others = skeleton.others
    if others:
        warn(
            f"static optimization holds the {others} coordinates of the mbs that are not tracked "
            "at their initial values; forces between them and the skeleton are wrong once they "
            "would move",
            FrozenBodiesWarning,
        )
    skeleton.check_assembled()
    with hold(model.mbs) as held:
        # The evaluations below move the mbs; the user's current state is put back at the end.
        held.keep(partial(skeleton.restore, skeleton.snapshot()))
        controllers = UserControllers(model.mbs)
        if controllers:
            keep_parameters(model.mbs, held)
        skeleton.open(held, q_d[0])
        t = times[0]
        try:
            last = None
            for n, t in enumerate(times):
                if n and not controllers.before_step(t):
                    warn_of_stop(record, "a user function", times[-1])
                    break
                skeleton.go_to(q_d[n], v_d[n], t)
                controllers.before_residual(t)
                there = skeleton.dynamics_held()
                place = there.place
                geometry = model.geometry(*place)
                Q_m = there.torque(a_d[n])  # (6)
                if last is None:
                    start = muscles.start(geometry, Q_m, t, place)
                    record.begin(t, start.reserve, start.unmet)
                    a, l_t, reserve, at_bounds = *start[:3], start.at_bounds
                    torque, window = model.torque(geometry, a, l_t, reserve), None
                else:
                    opened = muscles.open(a, l_t, last, times[n - 1], t, at_bounds)
                    recruited = muscles.recruit(muscles.reach(opened, geometry), Q_m, place)
                    a, l_t, reserve, window = muscles.excite(recruited)
                    found = recruited.recruitment
                    torque, at_bounds = found.torque, found.at_bounds
                    counts.steps += 1
                whole = skeleton.x, skeleton.x_t, skeleton.drift
                point = q_d[n], v_d[n], a_d[n], *whole, a, l_t, torque
                # The place itself may be a view of the current state.
                record.add(Row(t, point, reserve, window, (*point[:2], *place[2:])))
                last = geometry
                if progress is not None:
                    progress(t)
            else:
                record.complete()
        except BaseException as error:
            raised = original(error)
            raised.add_note(f"raised at t = {t:g} s of the static optimization")
            record.fail(raised, f"at t = {t:g} s")
            raise_as_itself(raised, error)
        finally:
            record.stop()
    warn_of_shortfalls(record, "")
    return record.trajectory()
