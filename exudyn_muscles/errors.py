"""Every exception and warning of the package.

An exception that ends a run in its middle, of whatever class, carries what was found up to then as
its attribute `trajectory`.

All exceptions derive from `ExudynMusclesError`. Those that report bad input also derive from
`ValueError`, those that report a failure while running from `RuntimeError`.
"""

from __future__ import annotations

import sys
import warnings
from types import FrameType

NOT_THE_USERS = ("exudyn_muscles", "exudyn", "contextlib")
# Longer texts are cut in messages: some 20 lines of a terminal, and what a file calls a thing.
LONGEST_MESSAGE, LONGEST_WORD = 2000, 60


def cut(text: str, longest: int = LONGEST_WORD) -> str:
    """The text without its middle if it is long, as texts of files may be."""
    if len(text) <= longest:
        return text
    return f"{text[: 2 * longest // 3]} ... {text[-longest // 3 :]}"


class ExudynMusclesError(Exception):
    """Root of all exceptions of this package."""

    def __init__(self, text: str = "") -> None:
        super().__init__(cut(str(text), LONGEST_MESSAGE))


class ParameterError(ExudynMusclesError, ValueError):
    """A muscle, path, model or setting has a value outside its allowed range."""


class MotionError(ExudynMusclesError, ValueError):
    """A motion cannot be built, or is asked for a time outside its range."""


class ModelError(ExudynMusclesError, ValueError):
    """The Exudyn system is not one that the plugin can drive."""


class ResultFileError(ExudynMusclesError, ValueError):
    """A stored result is damaged or was written by an unknown version."""


class StorageError(ExudynMusclesError, ValueError):
    """A storage file (`.sto`, `.mot`) is damaged, or a storage lacks what is asked of it."""


class ModelFileError(ExudynMusclesError, ValueError):
    """A model file (`.osim`) is damaged, or holds what cannot be represented."""


class StudyError(ExudynMusclesError, ValueError):
    """A study cannot be run as it is described, or not where it is to go on."""


class WindowError(ExudynMusclesError, RuntimeError):
    """The muscle equations could not be integrated over a time step."""


class WrappingError(ExudynMusclesError, RuntimeError):
    """No geodesic was found for a muscle that wraps over an ellipsoid."""


class RecruitmentError(ExudynMusclesError, RuntimeError):
    """No solver gave a recruitment whose optimality residuals are acceptable."""


class UnmetTorqueError(RecruitmentError):
    """The muscles cannot deliver the demanded torque and the settings ask for an error."""


class SimulationError(ExudynMusclesError, RuntimeError):
    """A simulation stopped before its end."""


class DisplayError(ExudynMusclesError, RuntimeError):
    """A window cannot be opened, or is in the way."""


class ExudynMusclesWarning(UserWarning):
    """Root of all warnings of this package."""


class UnmetTorqueWarning(ExudynMusclesWarning):
    """In some steps the muscles could not deliver the demanded torque."""


class TrackingWarning(ExudynMusclesWarning):
    """A run is off the motion that it tracks by more than its control law promises."""


class StabilityWarning(ExudynMusclesWarning):
    """Gains and step lie outside the stability limit of the simplified co-simulation."""


class ModelFileWarning(ExudynMusclesWarning):
    """Something in a model file is left out, or taken for something else than it says."""


class StorageWarning(ExudynMusclesWarning):
    """A storage file has other rows than it says."""


class PathWarning(ExudynMusclesWarning):
    """A muscle path cannot act on the skeleton."""


class CriterionWarning(ExudynMusclesWarning):
    """Forces of some recruitments are not those that the criterion prefers."""


class PassiveForceWarning(ExudynMusclesWarning):
    """A muscle pulls with more than its isometric force without being excited."""


class UnknownForcesWarning(ExudynMusclesWarning):
    """A recorded motion needs forces that are not known after its run."""


class IncompleteRunWarning(ExudynMusclesWarning):
    """Exudyn returned before the end time without raising an exception."""


class StartWarning(ExudynMusclesWarning):
    """A run starts away from the motion that it is to track."""


class MotionWarning(ExudynMusclesWarning):
    """A motion contradicts the model: angles that cannot be radians, a locked coordinate moves."""


class SpanWarning(ExudynMusclesWarning):
    """A set-up asks for a longer span than its desired kinematics have."""


class FrozenBodiesWarning(ExudynMusclesWarning):
    """Static optimization cannot move the bodies outside the skeleton."""


def _package(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", "")).split(".")[0]


def warn(text: str, category: type[Warning]) -> None:
    """Issue a warning that points at the user's code, through Exudyn and context managers."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and _package(frame) in NOT_THE_USERS:
        level, frame = level + 1, frame.f_back
    warnings.warn(cut(text, LONGEST_MESSAGE), category, stacklevel=level)
