"""Set-up files of OpenSim's CMC tool."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from ..errors import ParameterError
from ..methods.cmc import CMCSettings
from ..methods.cosimulation_settings import CosimulationSettings, Scheme
from ..methods.tracking import TrackingSettings
from ..motion import LowPass
from ..muscle.window import Integrator
from ..recruitment.limits import ControlLimits
from ..recruitment.normalizers import MaximumIsometricForce, RigidTendonForce
from . import setup_files as files
from .activations import activation_limits
from .controls import MINIMUM, read_controls
from .element import NOT_GIVEN, Element
from .load import Content, read_model
from .tasks import Task, Tasks, read_tasks

# How OpenSim optimizes; analyses, which only report.
WITHOUT_INFLUENCE = (
    "AnalysisSet", "optimizer_algorithm", "numerical_derivative_step_size",
    "optimization_convergence_tolerance", "optimizer_max_iterations", "optimizer_print_level",
    "optimizer_derivative_dx", "optimizer_convergence_criterion", "use_verbose_printing",
    "use_curvature_filter", "Analyses", "compute_average_residuals", "controls_file",
)  # fmt: skip
READ = (
    "desired_kinematics_file", "task_set_file", "constraints_file", "lowpass_cutoff_frequency",
    "cmc_time_window", "use_fast_optimization_target", "actuators_to_exclude",
)  # fmt: skip
# Have to be empty.
REFUSED = ("ControllerSet", "desired_points_file", "rra_controls_file")
STEPS = 10  # of skeleton and muscles in a window


@dataclass(frozen=True, eq=False)
class CMCSetup(files.Setup):
    """What a set-up file of OpenSim's CMC tool asks for.

    Attributes
    ----------
    settings : CMCSettings
        Of `computed_muscle_control`.
    """

    settings: CMCSettings

    def cosimulation(self, scheme: Scheme = Scheme.CONSISTENT) -> CosimulationSettings:
        """The same settings for `cosimulate`, with the window as the step.

        Parameters
        ----------
        scheme : Scheme

        Returns
        -------
        CosimulationSettings
        """
        common = {item.name: getattr(self.settings, item.name) for item in fields(TrackingSettings)}
        return CosimulationSettings(scheme=scheme, step=self.settings.window, **common)


def read_cmc_setup(tool: Element, asked: files.Asked) -> CMCSetup:
    """What a `CMCTool` asks for; see `load_setup`."""
    tool.allow(*files.READ, *READ, *files.WITHOUT_INFLUENCE, *WITHOUT_INFLUENCE, *REFUSED)
    for tag in REFUSED:
        if files.is_given(tool, tag) or any(each.is_on for each in tool.items(tag)):
            tool.get(tag).refuse()
    name = files.name_of_results(tool)
    given = read_tasks(files.file_of(tool, "task_set_file"))
    content = read_model(
        files.model_file(tool, asked),
        files.force_sets(tool),
        files.external_loads(tool),
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
    motion = files.desired_motion(
        tool, "desired_kinematics_file", content, "lowpass_cutoff_frequency",
        LowPass.WINDOWED_SINC, asked,
    )  # fmt: skip
    files.warn_of_rest(tool, motion, window)
    followed = activation_limits(given, content.model, motion, window)
    settings = replace(settings, control_limits={**settings.control_limits, **followed})
    directory = files.results_directory(tool)
    return CMCSetup(name, content.model, motion, directory, content.coordinates, settings)


def _excluded(tool: Element) -> frozenset[str]:
    """Names of the actuators that have no control."""
    words = tool.word("actuators_to_exclude", default="").split()
    return frozenset(word.split("/")[-1] for word in words if word not in NOT_GIVEN)


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
    if files.is_given(tool, tag):
        limits |= read_controls(files.file_of(tool, tag), content.model, content.idle)
    for muscle in content.model.muscles:
        if muscle.name in _excluded(tool):  # it has no control
            lowest = max(muscle.min_control, muscle.minimum_activation)
            limits[muscle.name] = ControlLimits(lowest, lowest)
    return limits
