"""What set-up files of OpenSim's tools have in common: the files that they name, and their span."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

from ..checks import number_within
from ..errors import MotionError, MotionWarning, SpanWarning, warn
from ..model import MusculoskeletalModel
from ..motion import LowPass, Motion
from .element import NOT_GIVEN, Element
from .joints import Coordinate
from .load import Content

# How OpenSim integrates and prints; start-up; what only moves points of loads, in older versions.
WITHOUT_INFLUENCE = (
    "output_precision", "solve_for_equilibrium_for_auxiliary_states",
    "maximum_number_of_integrator_steps", "maximum_integrator_step_size",
    "minimum_integrator_step_size", "integrator_error_tolerance", "plot_kinematics",
    "external_loads_body1", "external_loads_body2", "external_loads_model_kinematics_file",
    "lowpass_cutoff_frequency_for_load_kinematics",
)  # fmt: skip
READ = (
    "model_file", "force_set_files", "replace_force_set", "results_directory", "initial_time",
    "final_time", "external_loads_file",
)  # fmt: skip
# Behind a record's first sample its accelerations are uncertain for so many periods of the cut-off.
UNSURE = 0.5


@dataclass(frozen=True, eq=False)
class Setup:
    """What a set-up file asks for, whatever its tool.

    Attributes
    ----------
    name : str
    model : MusculoskeletalModel
        With reserves, residuals and external loads.
    motion : Motion
        The desired kinematics over the set-up's span.
    results_directory : Path
    coordinates : tuple of Coordinate
        All that the model's file has, as `read_coordinates`.
    """

    name: str
    model: MusculoskeletalModel
    motion: Motion
    results_directory: Path
    coordinates: tuple[Coordinate, ...]


@dataclass(frozen=True)
class Asked:
    """What is asked for in place of what a set-up's file says; see `load_setup`.

    Raises
    ------
    ParameterError
        A time is no number.
    """

    initial_time: float | None
    final_time: float | None
    model: str | Path | None
    in_degrees: bool | None

    def __post_init__(self) -> None:
        for name in ("initial_time", "final_time"):
            time = getattr(self, name)
            if time is not None:
                number_within(name, time, -math.inf, math.inf, "s")


def path_from(tool: Element, name: str) -> Path:
    """A file or folder, whose name may be Windows', from the set-up's folder."""
    return Path(tool.file).parent / name.replace("\\", "/")


def results_directory(tool: Element) -> Path:
    return path_from(tool, tool.word("results_directory", default="."))


def name_of_results(tool: Element) -> str:
    """What the names of results begin with."""
    name = tool.name or Path(tool.file).stem
    if set(name) & set("/\\"):
        raise tool.error("the names of results begin with this name, which has a slash in it")
    return name


def is_given(tool: Element, tag: str) -> bool:
    return tool.word(tag, default="") not in NOT_GIVEN


def _existing(element: Element, name: str) -> Path:
    """A file that a property names."""
    path = path_from(element, name)
    if not os.path.isfile(path):  # False for names that no file can have, too
        raise element.error(f"there is no file {path}")
    return path


def file_of(tool: Element, tag: str) -> Path:
    return _existing(tool.get(tag), tool.word(tag))


def model_file(tool: Element, asked: Asked) -> str | Path:
    return named_model(tool) if asked.model is None else asked.model


def named_model(tool: Element) -> Path:
    """The model's file that a set-up names."""
    if not is_given(tool, "model_file"):
        raise tool.error("it names no model_file: model= does, or --model on the command line")
    return file_of(tool, "model_file")


def force_sets(tool: Element) -> list[Path]:
    tag = "force_set_files"
    names = tool.word(tag).split() if is_given(tool, tag) else []
    return [_existing(tool.get(tag), name) for name in names]


def external_loads(tool: Element) -> Path | None:
    tag = "external_loads_file"
    return file_of(tool, tag) if is_given(tool, tag) else None


def desired_motion(
    tool: Element, tag: str, content: Content, cutoff_tag: str, low_pass: LowPass, asked: Asked
) -> Motion:
    """The motion of the file that the property `tag` names, over the set-up's span.

    A cut-off frequency, in the property `cutoff_tag`, that is not positive means no filter.
    """
    cutoff = tool.number(cutoff_tag, -1.0)
    motion = Motion.from_file(
        file_of(tool, tag),
        content.model.coordinates,
        content.model.skeleton.units,
        cutoff=cutoff if cutoff > 0.0 else None,
        low_pass=low_pass,
        described=content.coordinates,
        in_degrees=asked.in_degrees,
    )
    start, end = asked.initial_time, asked.final_time
    own = start is None and end is None
    start = _within(tool, "initial_time", motion) if start is None else start
    if cutoff > 0.0 and start - motion.start < UNSURE / cutoff:
        text = (
            f"the run starts {1e3 * (start - motion.start):.3g} ms behind the first sample; up to "
            f"{1e3 * UNSURE / cutoff:.3g} ms the filter does not know the accelerations"
        )
        warn(str(tool.get(cutoff_tag).error(text)), MotionWarning)
    end = _within(tool, "final_time", motion) if end is None else end
    try:
        return motion.between(start, end)
    except MotionError as error:
        if own:
            raise tool.get(tag).error(str(error)) from None
        raise MotionError(f"initial_time = {start:g} s, final_time = {end:g} s: {error}") from None


def warn_of_rest(tool: Element, motion: Motion, window: float) -> None:
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
