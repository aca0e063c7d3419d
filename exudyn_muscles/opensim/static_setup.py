"""Set-up files of OpenSim's analyses: those that ask for a static optimization."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import MotionError
from ..files.storage import read_storage
from ..methods.static import StaticSettings
from ..motion import LowPass
from ..muscle.window import Integrator
from ..numerics.splines import told_apart
from ..operators import ignore_physiology
from ..recruitment.criteria.criterion import Criterion
from ..recruitment.criteria.forces import SquaredForces
from ..recruitment.criteria.powers import LARGEST_EXPONENT, PoweredForces
from ..recruitment.normalizers import MaximumIsometricForce, RigidTendonForce
from . import setup_files as files
from .element import Element
from .load import read_model

# Analyses beside the one, and controllers, which a static optimization switches off.
WITHOUT_INFLUENCE = ("AnalysisSet", "Analyses", "ControllerSet", "controls_file")
CUTOFF = "lowpass_cutoff_frequency_for_coordinates"
READ = ("states_file", "coordinates_file", "speeds_file", CUTOFF)
# OpenSim reads the span of an analysis but never looks at it.
NOT_OF_THE_ANALYSIS = (
    "start_time", "end_time", "in_degrees", "optimizer_convergence_criterion",
    "optimizer_max_iterations", "print_results_files", "optimizer_algorithm",
)  # fmt: skip
OF_THE_ANALYSIS = (
    "on", "step_interval", "use_model_force_set", "activation_exponent", "use_muscle_physiology",
)  # fmt: skip
LONGEST = 0.01  # s, of a window: over longer ones a muscle's course is no cubic


@dataclass(frozen=True, eq=False)
class StaticSetup(files.Setup):
    """What a set-up file of OpenSim's analyses asks for that has a static optimization among them.

    Attributes
    ----------
    settings : StaticSettings
        Of `static_optimization`.
    """

    settings: StaticSettings


def read_static_setup(tool: Element, asked: files.Asked) -> StaticSetup:
    """What an `AnalyzeTool` asks for; see `load_setup`."""
    tool.allow(*files.READ, *READ, *files.WITHOUT_INFLUENCE, *WITHOUT_INFLUENCE)
    name = files.name_of_results(tool)
    analysis = _analysis(tool)
    kinematics = _kinematics(tool)
    content = read_model(
        files.model_file(tool, asked),
        files.force_sets(tool),
        files.external_loads(tool),
        only_sets=tool.flag("replace_force_set"),
        inverse=not analysis.flag("use_model_force_set", True),
    )
    physiology = analysis.flag("use_muscle_physiology", True)
    model = content.model
    if not physiology:
        model = model.replace(muscles=ignore_physiology(model.muscles))
    settings = StaticSettings(
        step=_step(tool, kinematics, analysis),
        normalizer=RigidTendonForce() if physiology else MaximumIsometricForce(),
        criterion=_criterion(analysis),
        integrator=Integrator.ROSENBROCK,
    )
    motion = files.desired_motion(
        tool, kinematics, content, CUTOFF, LowPass.BUTTERWORTH_6, asked
    )  # fmt: skip
    files.warn_of_rest(tool, motion, settings.step)
    directory = files.results_directory(tool)
    return StaticSetup(name, model, motion, directory, content.coordinates, settings)


def _analysis(tool: Element) -> Element:
    """The static optimization among the analyses."""
    found = [
        each
        for each in (*tool.items("AnalysisSet"), *tool.items("Analyses"))
        if each.tag == "StaticOptimization" and each.flag("on", True)
    ]
    if not found:
        raise tool.error("of its analyses only a StaticOptimization that is on can be run here")
    if len(found) > 1:
        found[1].warn("only the first StaticOptimization is run")
    found[0].allow(*OF_THE_ANALYSIS, *NOT_OF_THE_ANALYSIS)
    return found[0]


def _kinematics(tool: Element) -> str:
    """The property that names the motion's file."""
    if files.is_given(tool, "speeds_file"):
        tool.get("speeds_file").warn("speeds are those of the coordinates here")
    if not files.is_given(tool, "states_file"):
        return "coordinates_file"
    if tool.number(CUTOFF, -1.0) > 0.0:
        tool.get(CUTOFF).warn("OpenSim does not filter states; here their coordinates are")
    return "states_file"


def _criterion(analysis: Element) -> Criterion:
    asked = analysis.number("activation_exponent", 2.0)
    exponent = min(max(asked, 2.0), LARGEST_EXPONENT)
    if exponent != asked:
        analysis.get("activation_exponent").warn(f"{asked:g}: here it is {exponent:g}")
    return SquaredForces() if exponent == 2.0 else PoweredForces(exponent)


def _step(tool: Element, kinematics: str, analysis: Element) -> float:
    """Length of the windows [s]: OpenSim's interval, or an equal part of it."""
    interval = analysis.number("step_interval", 1.0)
    if interval < 1.0 or interval != round(interval):
        raise analysis.get("step_interval").error(f"{interval:g} is no number of samples")
    times = read_storage(files.file_of(tool, kinematics)).time
    times = times[told_apart(times)]
    if times.size < 2:
        raise MotionError(f"{files.file_of(tool, kinematics)}: a motion needs more points")
    step = float(interval * np.diff(times).mean())
    return step / math.ceil(step / LONGEST - 1e-6)
