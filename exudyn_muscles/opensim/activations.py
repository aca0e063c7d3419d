"""Activations that a set-up tracks, as from EMG, as limits of excitations.

OpenSim adds the error of an activation to what its optimizer minimizes, but only the gradient ever
feels it. Here the muscle is given the excitations that lead to the activation.
"""

from __future__ import annotations

import math

import numpy as np

from ..errors import StorageError
from ..files.storage import Storage, read_storage
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..muscle.activation import activation_rate
from ..muscle.parameters import Muscle
from ..numerics.splines import told_apart
from ..recruitment.limits import ControlLimits
from .element import Element
from .tasks import ACTIVATION, Tasks

DEGREE = 3  # of the spline through the samples, as in OpenSim
HALVINGS = 40  # of [0, 1], where the excitation lies


def activation_limits(
    tasks: Tasks, model: MusculoskeletalModel, motion: Motion, window: float
) -> dict[str, ControlLimits]:
    """Equal limits of the excitations of muscles whose activations are tracked.

    Parameters
    ----------
    tasks : Tasks
    model : MusculoskeletalModel
    motion : Motion
        Over whose span limits are wanted.
    window : float
        Over which excitations are held [s].

    Raises
    ------
    ModelFileError
        The data file has no column for a task.
    StorageError
        It is damaged.

    Warns
    -----
    ModelFileWarning
        That weights do not matter, or there is no muscle of a task's name.
    """
    from scipy.interpolate import make_interp_spline  # slow to import

    limits = {}
    muscles = {muscle.name: muscle for muscle in model.muscles}
    for name, element in tasks.activations.items():
        if name not in muscles:
            element.warn(f"there is no muscle '{name}', and the task is left out")
            continue
        element.warn(
            "the muscle is given the excitations that lead to this activation, whatever the "
            "task's weight; in OpenSim the weight turns the optimizer's gradient only"
        )
        times, values = _samples(read_storage(str(tasks.data)), element)
        middles = np.arange(motion.start + 0.5 * window, motion.end + window, window)
        spline = make_interp_spline(times, values, k=min(DEGREE, times.size - 1))
        inside = np.clip(middles, times[0], times[-1])
        rates = np.where(inside == middles, spline.derivative()(inside), 0.0)
        u = _excitations(muscles[name], spline(inside), rates)
        course = (middles + 0.5 * window).tolist(), u.tolist()
        limits[name] = ControlLimits(course, course)
    return limits


def _samples(data: Storage, element: Element) -> tuple[np.ndarray, np.ndarray]:
    """Times and activations (k,) of a task."""
    name = element.name.removesuffix(ACTIVATION)
    spellings = (element.name, f"{name}/activation", f"/forceset/{name}/activation")
    for number, label in enumerate(data.labels):
        if label in spellings:
            kept = told_apart(data.time)
            values = data.values[kept, number]
            if not np.isfinite(values).all():
                raise StorageError(f"column '{label}' has values that are no numbers")
            return data.time[kept], values
    raise element.error(f"its file has no column '{element.name}', only {', '.join(data.labels)}")


def _excitations(muscle: Muscle, a: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """u (k,) at which activations change at these rates, or come nearest to it."""
    law = muscle.activation_dynamics.value
    numbers = (
        muscle.activation_time_constant,
        muscle.deactivation_time_constant,
        muscle.activation_dynamics_smoothing,
    )
    lowest = max(muscle.min_control, muscle.minimum_activation)
    found = []
    for activation, rate in zip(np.clip(a, lowest, 1.0), rates, strict=True):
        low, high = lowest, muscle.max_control
        for _ in range(HALVINGS):
            u = 0.5 * (low + high)
            if activation_rate(law, activation, u, *numbers)[0] < rate:
                low = u
            else:
                high = u
        found.append(math.fsum((low, high)) / 2.0)
    return np.array(found)
