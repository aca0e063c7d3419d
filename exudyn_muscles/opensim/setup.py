"""Set-up files of OpenSim's CMC tool."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, fields, replace
from pathlib import Path

from ..checks import number_within
from ..errors import MotionError, MotionWarning, ParameterError, SpanWarning, warn
from ..methods.cmc import CMCSettings
from ..methods.cosimulation_settings import CosimulationSettings, Scheme
from ..methods.tracking import TrackingSettings
from ..model import MusculoskeletalModel
from ..motion import LowPass, Motion
from ..muscle.window import Integrator
from ..recruitment.limits import ControlLimits
from ..recruitment.normalizers import MaximumIsometricForce, RigidTendonForce
from .activations import activation_limits
from .controls import MINIMUM, read_controls
from .document import read_document
from .element import NOT_GIVEN, Element
from .joints import Coordinate
from .load import Content, read_model
from .tasks import Task, Tasks, read_tasks

# How OpenSim integrates, optimizes and prints; start-up; analyses, which only report.
WITHOUT_INFLUENCE = (
    "output_precision", "solve_for_equilibrium_for_auxiliary_states",
    "maximum_number_of_integrator_steps", "maximum_integrator_step_size",
    "minimum_integrator_step_size", "integrator_error_tolerance", "AnalysisSet",
    "optimizer_algorithm", "numerical_derivative_step_size",
    "optimization_convergence_tolerance", "optimizer_max_iterations", "optimizer_print_level",
    "optimizer_derivative_dx", "optimizer_convergence_criterion", "use_verbose_printing",
    "use_curvature_filter", "Analyses", "plot_kinematics", "external_loads_body1",
    "external_loads_body2", "external_loads_model_kinematics_file",
    "lowpass_cutoff_frequency_for_load_kinematics", "compute_average_residuals", "controls_file",
)  # fmt: skip
READ = (
    "model_file", "force_set_files", "replace_force_set", "results_directory",
    "initial_time", "final_time",
    "external_loads_file", "desired_kinematics_file", "task_set_file", "constraints_file",
    "lowpass_cutoff_frequency", "cmc_time_window", "use_fast_optimization_target",
    "actuators_to_exclude",
)  # fmt: skip
# Have to be empty.
REFUSED = ("ControllerSet", "desired_points_file", "rra_controls_file")
STEPS = 10  # of skeleton and muscles in a window
# Behind a record's first sample its accelerations are uncertain for so many periods of the cut-off.
UNSURE = 0.5


@dataclass(frozen=True, eq=False)
class CMCSetup:
    """What a set-up file of OpenSim's CMC tool asks for.

    Attributes
    ----------
    name : str
    model : MusculoskeletalModel
        With reserves, residuals and external loads.
    motion : Motion
        The desired kinematics over the set-up's span.
    settings : CMCSettings
        Of `computed_muscle_control`.
    results_directory : Path
    coordinates : tuple of Coordinate
        All that the model's file has, as `read_coordinates`.
    """

    name: str
    model: MusculoskeletalModel
    motion: Motion
    settings: CMCSettings
    results_directory: Path
    coordinates: tuple[Coordinate, ...]

    def cosimulation(self, scheme: Scheme = Scheme.CONSISTENT) -> CosimulationSettings:
        """The same settings for `cosimulate`, with the window as the step."""
        common = {item.name: getattr(self.settings, item.name) for item in fields(TrackingSettings)}
        return CosimulationSettings(scheme=scheme, step=self.settings.window, **common)


def load_setup(
    file: str | Path,
    *,
    initial_time: float | None = None,
    final_time: float | None = None,
    model: str | Path | None = None,
    in_degrees: bool | None = None,
) -> CMCSetup:
    """Read a set-up file of OpenSim's CMC tool with all the files that it names.

    The fast optimization target becomes `RigidTendonForce`, the slow one `MaximumIsometricForce`;
    either way the demanded torques are met as long as they are within reach. Excitations have
    OpenSim's limits [0.02, 1] where no file of control constraints says otherwise. Windows are
    predicted as `CMCSettings` does, which tracks better than OpenSim's prediction, shifted by the
    errors (`Prediction.SHIFTED`). Muscles are integrated by the Rosenbrock method.

    Coordinates without a task, which OpenSim leaves to the forces, follow the desired kinematics by
    an ideal actuator that costs next to nothing. Tasks of locked coordinates are left out, and so
    are controls of actuators that are switched off or act on what cannot move. Muscles whose
    activations are tracked are given the excitations that lead there. A cut-off frequency that is
    not positive means no filter; the filter has OpenSim's weights, and the accelerations that the
    motion has at its ends.

    Parameters
    ----------
    file : str or Path
        Other files are looked for from its folder.
    initial_time, final_time : float, optional
        The span [s] in place of the file's; where neither says it, the whole motion. It has to
        lie within the motion, whereas OpenSim cuts it off there.
    model : str or Path, optional
        The model's file in place of the set-up's, which may lack one.
    in_degrees : bool, optional
        What the angles of the desired kinematics are, whatever their file says.

    Raises
    ------
    ModelFileError
        A file is damaged, holds what cannot be represented, or names what there is not.
    StorageError, MotionError
        The desired kinematics cannot be used, or not over the span that is asked for.
    ParameterError
        A time that is asked for is no number.
    FileNotFoundError

    Warns
    -----
    MotionWarning
        Angles in the desired kinematics that cannot be radians, or a locked coordinate that moves;
        a start so near to a filtered record's first sample that its accelerations are uncertain.
    SpanWarning
        The file's span is longer than the desired kinematics, whose ends are taken instead, or its
        last part is shorter than a window and left out.
    ModelFileWarning
        Something is left out, or done otherwise than OpenSim does it.
    """
    for name, time in (("initial_time", initial_time), ("final_time", final_time)):
        if time is not None:
            number_within(name, time, -math.inf, math.inf, "s")
    tool = read_document(file, "CMCTool")
    tool.allow(*READ, *WITHOUT_INFLUENCE, *REFUSED)
    for tag in REFUSED:
        if _is_given(tool, tag) or any(each.is_on for each in tool.items(tag)):
            tool.get(tag).refuse()
    name = tool.name or Path(file).stem
    if set(name) & set("/\\"):
        raise tool.error("the names of results begin with this name, which has a slash in it")
    loads = "external_loads_file"
    given = read_tasks(_file(tool, "task_set_file"))
    content = read_model(
        named_model(tool) if model is None else model,
        _force_sets(tool),
        _file(tool, loads) if _is_given(tool, loads) else None,
        tracked=given.coordinates,
        only_sets=tool.flag("replace_force_set"),
        excluded=_excluded(tool),
    )
    tasks = _tasks(tool, content, given)
    window = tool.number("cmc_time_window", 0.01)
    fast = tool.flag("use_fast_optimization_target", True)
    try:
        settings = CMCSettings(
            window=window,
            step=window / STEPS,
            normalizer=RigidTendonForce() if fast else MaximumIsometricForce(),
            integrator=Integrator.ROSENBROCK,
            control_limits=_limits(tool, content),
            kp=[task.kp for task in tasks],
            kv=[task.kv for task in tasks],
            coordinate_weights=[task.weight for task in tasks],
        )
    except ParameterError as error:  # gains and weights have been checked
        raise tool.get("cmc_time_window").error(str(error)) from None
    motion = _motion(tool, content, initial_time, final_time, in_degrees)
    _warn_of_rest(tool, motion, window)
    followed = activation_limits(given, content.model, motion, window)
    settings = replace(settings, control_limits={**settings.control_limits, **followed})
    return CMCSetup(
        name,
        content.model,
        motion,
        settings,
        _path(tool, tool.word("results_directory", default=".")),
        content.coordinates,
    )


def _path(tool: Element, name: str) -> Path:
    """A file or folder, whose name may be Windows', from the set-up's folder."""
    return Path(tool.file).parent / name.replace("\\", "/")


def _is_given(tool: Element, tag: str) -> bool:
    return tool.word(tag, default="") not in NOT_GIVEN


def _existing(element: Element, name: str) -> Path:
    """A file that a property names."""
    path = _path(element, name)
    if not os.path.isfile(path):  # False for names that no file can have, too
        raise element.error(f"there is no file {path}")
    return path


def _file(tool: Element, tag: str) -> Path:
    return _existing(tool.get(tag), tool.word(tag))


def named_model(tool: Element) -> Path:
    """The model's file that a set-up names."""
    if not _is_given(tool, "model_file"):
        raise tool.error("it names no model_file: model= does, or --model on the command line")
    return _file(tool, "model_file")


def _excluded(tool: Element) -> frozenset[str]:
    """Names of the actuators that have no control."""
    words = tool.word("actuators_to_exclude", default="").split()
    return frozenset(word.split("/")[-1] for word in words if word not in NOT_GIVEN)


def _force_sets(tool: Element) -> list[Path]:
    tag = "force_set_files"
    names = tool.word(tag).split() if _is_given(tool, tag) else []
    return [_existing(tool.get(tag), name) for name in names]


def _tasks(tool: Element, content: Content, given: Tasks) -> list[Task]:
    """One for each coordinate."""
    tasks, coordinates = given.coordinates, content.model.coordinates
    locked = [coordinate.name for coordinate in content.coordinates if coordinate.locked]
    for name, task in tasks.items():
        if name not in (*coordinates, *locked):
            raise task.element.error(
                f"'{name}' cannot be tracked: the model's independent coordinates are "
                f"{', '.join(coordinates)}"
            )
    missing = [name for name in coordinates if name not in tasks]
    where = tool.get("task_set_file")
    if len(missing) == len(coordinates):
        raise where.error(f"no task that is on and active tracks {', '.join(missing)}")
    prescribed = [each.name for each in content.coordinates if each.prescribed is not None]
    free = [name for name in missing if name not in prescribed]
    if free:
        where.warn(
            f"no task that is on and active tracks {', '.join(free)}, which OpenSim leaves to "
            "the forces: here they follow the desired kinematics by ideal actuators"
        )
    kp, kv = (max(getattr(task, gain) for task in tasks.values()) for gain in ("kp", "kv"))
    return [tasks.get(name, Task(kp, kv, 1.0, where)) for name in coordinates]


def _limits(tool: Element, content: Content) -> dict[str, ControlLimits]:
    """Of muscles, as OpenSim has them by default, and of the file's controls."""
    limits = {
        muscle.name: ControlLimits(max(MINIMUM, muscle.min_control), muscle.max_control)
        for muscle in content.model.muscles
    }
    tag = "constraints_file"
    if _is_given(tool, tag):
        limits |= read_controls(_file(tool, tag), content.model, content.idle)
    for muscle in content.model.muscles:
        if muscle.name in _excluded(tool):  # it has no control
            lowest = max(muscle.min_control, muscle.minimum_activation)
            limits[muscle.name] = ControlLimits(lowest, lowest)
    return limits


def _motion(
    tool: Element,
    content: Content,
    start: float | None,
    end: float | None,
    in_degrees: bool | None,
) -> Motion:
    cutoff = tool.number("lowpass_cutoff_frequency", -1.0)
    motion = Motion.from_file(
        _file(tool, "desired_kinematics_file"),
        content.model.coordinates,
        content.model.skeleton.units,
        cutoff=cutoff if cutoff > 0.0 else None,
        low_pass=LowPass.WINDOWED_SINC,
        described=content.coordinates,
        in_degrees=in_degrees,
    )
    own = start is None and end is None
    start = _within(tool, "initial_time", motion) if start is None else start
    if cutoff > 0.0 and start - motion.start < UNSURE / cutoff:
        text = (
            f"the run starts {1e3 * (start - motion.start):.3g} ms behind the first sample; up to "
            f"{1e3 * UNSURE / cutoff:.3g} ms the filter does not know the accelerations"
        )
        warn(str(tool.get("lowpass_cutoff_frequency").error(text)), MotionWarning)
    end = _within(tool, "final_time", motion) if end is None else end
    try:
        return motion.between(start, end)
    except MotionError as error:
        if own:
            raise tool.get("desired_kinematics_file").error(str(error)) from None
        raise MotionError(f"initial_time = {start:g} s, final_time = {end:g} s: {error}") from None


def _warn_of_rest(tool: Element, motion: Motion, window: float) -> None:
    """Warn of a last part of the span that is shorter than a window."""
    windows = (motion.end - motion.start) / window
    rest = (windows - math.floor(windows * (1.0 + 1e-12) + 1e-9)) * window
    if windows >= 1.0 and rest > 1e-6 * window:
        text = f"the last {1e3 * rest:.3g} ms of the span are less than a window and are left out"
        warn(str(tool.error(text)), SpanWarning)


def _within(tool: Element, tag: str, motion: Motion) -> float:
    """A time of the file, or the motion's nearest, as in OpenSim."""
    usual = motion.start if tag == "initial_time" else motion.end
    asked = tool.number(tag, usual, infinite=True)
    if motion.start <= asked <= motion.end:
        return asked
    nearest = min(max(asked, motion.start), motion.end)
    text = f"{asked:g} s is outside of the desired kinematics; the run takes {nearest:g} s instead"
    warn(str(tool.get(tag).error(text)), SpanWarning)
    return nearest
